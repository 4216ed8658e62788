"""Measures what documentation promises of H and A, and what it does not: seeded QPs with exact answers, counted.

Every instance is a small QP in integers whose class is certain by construction: with T unimodular, A its first m rows,

    H = T' [I B'; 0 I] diag(S, S_N) [I 0; B I] T,    N'HN = S_N,    In(H) = In(S) + In(S_N)

for N the last columns of T^-1 (methods 1.6, 1.7). Success is a verdict against exact truth; what a solver says of
itself decides nothing.
"""

from __future__ import annotations

import os
import threading
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from math import sqrt
from typing import Any

import numpy as np
from rich.table import Table

from sandbox.backends import BACKENDS
from sandbox.backends.backend import Promise
from sandbox.batch import Batch
from sandbox.campaign import PATIENCE, Progress, quiet
from sandbox.formulation import FORMULATIONS, Posed
from sandbox.judgement import judge
from sandbox.plan import known
from sandbox.problem import VelocityProblem
from sandbox.qp import QP
from sandbox.reference.truth import truth
from sandbox.solution import CODE, Status
from sandbox.verdict import EXPECTED, GRADES, VERDICTS, verdicts
from sandbox.worker import Answers, Workers
from sandbox.yardstick import Yardstick

Array = np.ndarray
Generator = np.random.Generator
Rows = dict[str, Any]

SEED = 20000301
ROWS, JOINTS = 2, 5
"""Size of an instance before redundant rows are added."""

LARGEST = 1
"""Largest entry of T and of its inverse: the instances are to show kinds of H and A, not ill conditioning."""

QUANTILE = 1.959963984540054
"""Of the normal distribution at 0.975, for intervals that hold the true share 95 times in 100."""

LEVEL = "mid_accuracy"
"""The sentences are about kinds of H and A, not about digits: HiGHS, which adds 1e-7 I, could never meet 1e-9."""


@dataclass(frozen=True, eq=False)
class Claim:
    """A sentence that each instance bears out or not.

    expected : exact class of its instances; success : the verdict that bears the sentence out
    H, full_rank : what documentation must cover in order to promise it; H None where none does
    build : (generator) -> J, xdot, W, a; spoil : changes the QPs after that
    """

    sentence: str
    expected: str
    success: str
    H: str | None
    full_rank: bool
    build: Callable[[Generator], tuple[Array, Array, Array, Array]]
    spoil: Callable[[Generator, QP], QP] | None = None

    def promised(self, promise: Promise) -> bool:
        """Whether the documentation says so."""
        if self.H is None or promise.H is None:
            return False
        kinds = ("pd", "psd", "indefinite")
        return kinds.index(self.H) <= kinds.index(promise.H) and (self.full_rank or promise.A == "any")


# ---- instances ------------------------------------------------------------------------------------------------


def _unimodular(rng: Generator, n: int) -> Array:
    """An integer matrix of determinant 1; neither it nor its inverse has an entry above LARGEST."""
    T, inverse = np.eye(n), np.eye(n)
    for _ in range(4 * n):
        i, j = rng.choice(n, 2, replace=False)
        sign = float(rng.choice((-1, 1)))
        row, column = T[i] + sign * T[j], inverse[:, j] - sign * inverse[:, i]
        if max(np.abs(row).max(), np.abs(column).max()) <= LARGEST:
            T[i], inverse[:, j] = row, column
    return T


def _form(rng: Generator, *signs: int) -> Array:
    """A symmetric integer matrix with an eigenvalue of each sign: F' diag F, F unimodular (Sylvester)."""
    F = _unimodular(rng, len(signs))
    return F.T @ (np.array(signs)[:, None] * rng.integers(1, 4, (len(signs), 1)) * F)


def _instance(rng: Generator, S: Sequence[int], S_N: Sequence[int]) -> tuple[Array, Array, Array, Array]:
    """J, xdot, W, a from the signs of the two blocks."""
    m, n = len(S), len(S) + len(S_N)
    T, B, D = _unimodular(rng, n), np.eye(n), np.zeros((n, n))
    B[m:, :m] = rng.integers(-1, 2, (n - m, m))
    D[:m, :m], D[m:, m:] = _form(rng, *S), _form(rng, *S_N)
    return T[:m], rng.integers(-3, 4, m), T.T @ B.T @ D @ B @ T, rng.integers(-3, 4, n)


def _definite(rng: Generator) -> tuple[Array, Array, Array, Array]:
    return _instance(rng, (1,) * ROWS, (1,) * (JOINTS - ROWS))


def _semidefinite(rng: Generator) -> tuple[Array, Array, Array, Array]:
    return _instance(rng, (1,) + (0,) * (ROWS - 1), (1,) * (JOINTS - ROWS))


def _indefinite(rng: Generator) -> tuple[Array, Array, Array, Array]:
    """Mildly to strongly indefinite: S between 1 and 1024 times S_N."""
    depth = 4 ** int(rng.integers(0, 6))
    return _instance(rng, (-depth,) + (int(rng.choice((-1, 1))),) * (ROWS - 1), (1,) * (JOINTS - ROWS))


def _saddle(rng: Generator) -> tuple[Array, Array, Array, Array]:
    return _instance(rng, (1,) * ROWS, (-1,) + (1,) * (JOINTS - ROWS - 1))


def _maximum(rng: Generator) -> tuple[Array, Array, Array, Array]:
    return _instance(rng, (1,) * ROWS, (-1,) * (JOINTS - ROWS))


def _redundant(rng: Generator) -> tuple[Array, Array, Array, Array]:
    """A row that is an integer combination of the others, and its right-hand side with it."""
    J, xdot, W, a = _definite(rng)
    combination = rng.choice((-2, -1, 1, 2), ROWS)
    order = rng.permutation(ROWS + 1)
    return np.vstack([J, combination @ J])[order], np.append(xdot, combination @ xdot)[order], W, a


def _inconsistent(rng: Generator) -> tuple[Array, Array, Array, Array]:
    """As redundant rows, one right-hand side moved by an integer."""
    J, xdot, W, a = _redundant(rng)
    xdot[rng.integers(ROWS + 1)] += rng.choice((-2, -1, 1, 2))
    return J, xdot, W, a


def _with_nan(rng: Generator, qp: QP) -> QP:
    """One entry of H, and its mirror image, is NaN."""
    H = qp.H.copy()
    i, j = rng.integers(qp.n, size=(2, len(qp)))
    H[np.arange(len(qp)), i, j] = H[np.arange(len(qp)), j, i] = np.nan
    return QP(H, qp.g, qp.A, qp.b)


CLAIMS = (
    Claim("pd H is solved", "unique_minimum", "verified", "pd", True, _definite),
    Claim("psd H with full-rank rows is solved", "unique_minimum", "verified", "psd", True, _semidefinite),
    Claim(
        "valid indefinite H (condition (7)) is solved directly", "unique_minimum", "verified", "indefinite", True, _indefinite
    ),
    Claim("no minimum (saddle) is refused", "no_minimum", "right_refusal", None, True, _saddle),
    Claim("no minimum (maximum) is refused", "no_minimum", "right_refusal", None, True, _maximum),
    Claim("consistent redundant rows are solved", "unique_minimum", "verified", "pd", False, _redundant),
    Claim("inconsistent rows are refused", "infeasible", "right_refusal", None, False, _inconsistent),
    Claim("NaN in H is refused", "no_minimum", "right_refusal", None, True, _definite, _with_nan),
)
"""What is measured, one row each."""


@dataclass(frozen=True, eq=False)
class Trial:
    """Instances of a claim, with their truth; `yardstick` is None where the QPs were spoilt and nothing is true of them."""

    claim: Claim
    problem: VelocityProblem
    posed: Posed
    yardstick: Yardstick | None

    @classmethod
    def of(cls, claim: Claim, instances: int) -> Trial:
        """The first `instances` of a claim; always the same ones."""
        rng = np.random.default_rng([SEED, [c.sentence for c in CLAIMS].index(claim.sentence)])
        drawn = [claim.build(rng) for _ in range(instances)]
        problem = VelocityProblem(*(np.array(part, dtype=float) for part in zip(*drawn, strict=True)))
        posed = FORMULATIONS["direct"].build(problem).parts[0]
        if claim.spoil is not None:
            return cls(claim, problem, Posed(posed.index, claim.spoil(rng, posed.qp)), None)
        truths = truth(problem)
        assert isinstance(truths, list)
        return cls(claim, problem, posed, Yardstick.of(problem, "exact", truths))

    def verdicts(self, backend: str, answers: Answers) -> Array:
        """Codes into VERDICTS (B,) of one backend's answers."""
        B = len(self.problem)
        promised = np.full(B, self.claim.promised(BACKENDS[backend].promise))
        if self.yardstick is None:
            nothing = np.full(B, EXPECTED.index("no_minimum")), np.full(B, GRADES.index("beyond"))
            flags = np.isfinite(answers.x).all(axis=-1), np.zeros(B, bool), np.zeros(B, bool)
            return verdicts(nothing[0], answers.status, promised, *flags, nothing[1])
        batch = Batch.empty(backend, LEVEL, "direct", self.problem, np.arange(B))
        batch.engine = answers.engine
        said = (answers.status == CODE[Status.SOLVED])[:, None]  # the ray of an unbounded QP is no scale for tolerances
        batch.scale(self.posed, replace(answers, x=np.where(said, answers.x, np.nan), y=np.where(said, answers.y, np.nan)))
        batch.take(self.posed, answers, self.problem, FORMULATIONS["direct"])
        return judge(self.yardstick, batch.qdot, batch.y, batch.status, batch.allowance(), promised).verdict


# ---- measuring ------------------------------------------------------------------------------------------------


def probe(
    backends: Sequence[str] | None = None, instances: int = 50, progress: Progress = quiet, *,
    jobs: int | None = None, time_limit: float = 2.0,
) -> list[Rows]:  # fmt: skip
    """How often each claim is borne out, by backend, asked for 1e-6 (mid_accuracy).

    backends : names, all where None ("qpsolvers": all its engines); instances : per claim, the same for all backends
    progress : told (phase, instances done, total); jobs : libraries at a time, as many as cores where None
    time_limit : seconds for one instance; a claim stops after PATIENCE crashes or overruns

    Returns
    -------
    One dict per backend and claim: backend, claim, instances (that were run), successes, low and high (Wilson 95 %
    interval of the share), promised (by documentation), verdicts (how often each), stopped (instances left out for
    want of patience), why (a backend that cannot be opened).

    Raises
    ------
    UnknownNameError
        no such backend.
    """
    names = known("backend", backends, BACKENDS)
    trials = [Trial.of(claim, instances) for claim in CLAIMS]
    libraries: dict[str, list[str]] = {}
    for name in names:
        libraries.setdefault(BACKENDS[name].library, []).append(name)
    order = sorted(libraries.values(), key=len, reverse=True)  # the longest first
    total, done = len(names) * len(CLAIMS) * instances, [0]
    lock, stop = threading.Lock(), threading.Event()

    def measure(library: list[str]) -> list[Rows]:
        rows: list[Rows] = []
        with Workers() as workers:
            for name in library:
                for trial in trials:
                    if stop.is_set():
                        return rows
                    rows.append(_measured(workers, name, trial, time_limit))
                    with lock:
                        done[0] += instances
                        progress("probing", done[0], total)
        return rows

    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    with ThreadPoolExecutor(max_workers=jobs or cores) as threads:
        futures = [threads.submit(measure, library) for library in order]
        try:
            rows = [row for future in futures for row in future.result()]
        except BaseException:
            stop.set()
            for future in futures:
                future.cancel()
            raise
    return sorted(rows, key=lambda row: names.index(row["backend"]))  # stable: claims stay in order


def _measured(workers: Workers, backend: str, trial: Trial, time_limit: float) -> Rows:
    """One claim put to one backend."""
    answers = workers.solve(backend, trial.posed.qp, settings=LEVEL, time_limit=time_limit, patience=PATIENCE)
    run = answers.status != CODE[Status.NOT_RUN]
    counted = Counter(VERDICTS[code] for code in trial.verdicts(backend, answers)[run])
    size, successes = int(run.sum()), counted[trial.claim.success]
    low, high = wilson(successes, size)
    return {
        "backend": backend, "claim": trial.claim.sentence, "instances": size, "successes": successes, "low": low, "high": high,
        "promised": trial.claim.promised(BACKENDS[backend].promise), "verdicts": dict(sorted(counted.items())),
        "stopped": 0 if answers.absent else len(run) - size, "why": answers.absent,
    }  # fmt: skip


def wilson(successes: int, instances: int) -> tuple[float, float]:
    """95 % interval of a share (Wilson 1927); all of [0, 1] where nothing was run."""
    if not instances:
        return 0.0, 1.0
    share, weight = successes / instances, QUANTILE**2 / instances
    middle = (share + weight / 2) / (1 + weight)
    half = QUANTILE * sqrt(share * (1 - share) / instances + weight / (4 * instances)) / (1 + weight)
    return (0.0 if successes == 0 else middle - half), (1.0 if successes == instances else middle + half)


def table(rows: Sequence[Rows]) -> Table:
    """The rows of `probe`, one line per backend and one column per claim: successes / instances and interval."""
    claims = list(dict.fromkeys(row["claim"] for row in rows))
    drawn = Table(
        title="how often each sentence holds, with 95 % interval; * its documentation promises it", title_justify="left",
        caption_justify="left",
    )  # fmt: skip
    drawn.add_column("backend", no_wrap=True)
    for claim in claims:
        drawn.add_column(claim, justify="right")
    for name in dict.fromkeys(row["backend"] for row in rows):
        cells = {row["claim"]: _cell(row) for row in rows if row["backend"] == name}
        drawn.add_row(name, *(cells.get(claim, "") for claim in claims))
    absent = {row["backend"]: row["why"] for row in rows if row["why"]}
    drawn.caption = "\n".join(f"not run: {name}: {why}" for name, why in absent.items()) or None
    return drawn


def _cell(row: Rows) -> str:
    if not row["instances"]:
        return "not run"
    share = f"{row['successes']}/{row['instances']}{'*' if row['promised'] else ' '}"
    interval = f"{100 * row['low']:.0f}-{100 * row['high']:.0f} %"
    colour = "green" if row["successes"] == row["instances"] else "red" if row["promised"] else "yellow"
    stopped = f"\nstopped, {row['stopped']} left" if row["stopped"] else ""
    return f"[{colour}]{share}[/]\n{interval}{stopped}"
