"""The same study for every QP backend, as an ordinary run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from problems.sets import construct as make
from sandbox import plan, run_folder
from sandbox.backends import BACKENDS
from sandbox.claims import equations
from sandbox.claims.beyond.beside_six import FORMS, WORDS, heat
from sandbox.claims.beyond.deviation import disagreement, exact, nearer, rate_error, ratios, task_error, worst
from sandbox.claims.beyond.situation import Situation, situations
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_most, every
from sandbox.claims.exhibit import Axis, Heat, Plot, Series, Table
from sandbox.claims.printed import each
from sandbox.closed_form import CLOSED_FORMS
from sandbox.closed_form.eq6 import eq6
from sandbox.problem import VelocityProblem
from sandbox.problem_set import Group, ProblemSet
from sandbox.records import CLOSED_FORM, read_table
from sandbox.solution import Solution, Status

Array = np.ndarray

FAMILIES = ("active set", "interior point", "augmented Lagrangian", "operator splitting", "KKT system")
"""Kinds of backends, as the words of their rows tell them; what is none of these is a nonlinear programme's solver."""

FAST = (
    "numpy:lstsq", "osqp", "proxsuite:dense", "qpsolvers:quadprog", "qpsolvers:daqp", "qpsolvers:piqp",
)  # fmt: skip
"""Backends of the reduced size."""

LEVELS = np.concatenate([np.linspace(0, 0.98, 50), 1 - np.geomspace(0.01, 1e-4, 12)])
"""Shares at which a distribution is drawn."""


def single_precision(six: Answer) -> Answer:
    """Eq. (6) in single precision."""

    def planted(problem: VelocityProblem) -> Solution:
        return six(problem, dtype=np.float32)

    return planted


def section_v(drawn: Sequence[Situation], seed: int) -> ProblemSet:
    """The situations as an ordinary set; numbers to 2**-30, so that the same seed names the same problems anywhere."""
    groups = []
    for one in drawn:
        labels: dict[str, Sequence[Any]] = {
            "robot": [one.arm] * len(one.q), "method": [one.weight] * len(one.q), "seed": [seed] * len(one.q),
            "q": one.q.tolist(), "case": [one.words] * len(one.q),
        }  # fmt: skip
        groups.append(Group(make.shortened(one.problem), labels))
    return ProblemSet("section_v", tuple(groups), "section V's random configurations and unit velocities, a = 0")


def ids(posed: ProblemSet) -> list[str]:
    """Content hashes of a set's problems, group after group."""
    return [name for group in posed.groups for name in group.ids()]


@dataclass(frozen=True, eq=False)
class Records:
    """The answers of a campaign, one entry each (R,).

    backend, verdict : names; problem : id; place : its number in the set
    task, rates : task error, and error of the joint rates as judged; NaN where none was given as a solution
    apart : how far the recorded residual is from the one found here, as a share of its own rounding
    """

    backend: Array
    verdict: Array
    problem: Array
    place: Array
    task: Array
    rates: Array
    apart: Array

    def __getitem__(self, rows: Array) -> Records:
        """Those that a mask or an index array names."""
        return Records(*(getattr(self, field.name)[rows] for field in fields(self)))

    @property
    def solved(self) -> Array:
        """Where an answer was given."""
        return np.isfinite(self.task)

    @classmethod
    def read(cls, folder: Path, posed: ProblemSet) -> Records:
        """The backends' records of a run of `posed`."""
        table = read_table(folder, "records", ["problem", "backend", "verdict", "status", "error", "primal_residual", "qdot"])
        table = table.filter([not name.startswith(CLOSED_FORM) for name in table["backend"].to_pylist()])
        columns = {name: table[name].to_pylist() for name in table.column_names}
        places = {name: place for place, name in enumerate(ids(posed))}
        place = np.array([places[name] for name in columns["problem"]], dtype=int)
        solved = np.array(columns["status"], dtype=str) == Status.SOLVED.name.lower()
        solved &= [qdot is not None for qdot in columns["qdot"]]  # some say so and give NaN
        rates, kept = (np.where(solved, np.array(columns[name], float), np.nan) for name in ("error", "primal_residual"))
        task, apart = np.full((2, len(place)), np.nan)
        first = 0
        for group in posed.groups:
            rows = np.flatnonzero(solved & (place >= first) & (place < first + len(group)))
            if len(rows):
                problem, x = group.problem[place[rows] - first], np.array([columns["qdot"][i] for i in rows])
                task[rows] = task_error(problem, x)
                apart[rows] = disagreement(problem, x, kept[rows])
            first += len(group)
        backend, verdict, hashes = (np.array(columns[name], dtype=str) for name in ("backend", "verdict", "problem"))
        return cls(backend, verdict, hashes, place, task, rates, apart)


def campaign(trial: Trial, posed: ProblemSet) -> Records:
    """`posed` through every backend (a few at the reduced size) as an ordinary run, kept where the trial keeps things."""
    wanted = None if trial.full else [*FAST, *(f"{CLOSED_FORM}{name}" for name in FORMS)]
    chosen = plan.chosen([posed], wanted, ["direct"], jobs=trial.jobs, sample_every=10, warm=False)
    command = f"sandbox paper --claim backends_in_double --seed {trial.seed}{'' if trial.full else ' --quick'}"
    with TemporaryDirectory() as passing:
        folder = (trial.folder or Path(passing)) / "accuracy"
        run_folder.carry_out(chosen, folder, command=command, overwrite=True)
        return Records.read(folder, posed)


def backends_in_double(trial: Trial, six: Answer, printed: Answer) -> Evidence:
    """(6) and (2)-(5) beside every QP backend on the same problems."""
    drawn = situations(trial.rng("backends_in_double"), trial.of(200, 1))
    posed = section_v(drawn, trial.seed)
    records = campaign(trial, posed)
    problems = [group.problem for group in posed.groups]
    x = {
        "eq6": [six(problem).x for problem in problems],
        "eq2_5": [CLOSED_FORMS["eq2_5"](problem).x for problem in problems],
        "printed": [each(printed, problem) for problem in problems],
    }
    truths = [exact(problem) for problem in problems]
    task = {name: np.concatenate(list(map(task_error, problems, answers))) for name, answers in x.items()}
    rates = {name: np.concatenate(list(map(rate_error, truths, answers))) for name, answers in x.items()}
    checks = (
        at_most(
            "task error of (6) / of (2)–(5), both ways of computing these, median and 99 %",
            [*ratios(task["eq6"], task["eq2_5"]), *ratios(task["eq6"], task["printed"])], 1.0,
        ),
        at_most(
            "the residual on record against the one evaluated here / rounding, for every answer of every backend",
            records.apart[records.solved], 1.0, role=Role.OURS,
        ),
        as_accurate_as_any("task error", task["eq6"], records, records.task),
        as_accurate_as_any("error of the joint rates", rates["eq6"], records, records.rates),
    )  # fmt: skip
    exhibits = (_distributions(task, records), _backends_heat(drawn, task, records), _table(task, rates, records, posed))
    return Evidence(checks, exhibits)


def answering(records: Records) -> list[str]:
    """Backends that gave at least one solution."""
    return list(dict.fromkeys(records.backend[records.solved].tolist()))


def as_accurate_as_any(words: str, six: Array, records: Records, error: Array) -> Check:
    """(6) at most as far off as every backend in median and 99 %, on the problems that the backend solved.

    six (B,) error of (6) by problem; error (R,) that of every record
    """
    names = answering(records)
    found = {}
    for name in names:
        own = records.backend == name
        found[name] = ratios(six[records.place[own]], error[own])
    held = [max(pair) <= 1 for pair in found.values()]
    median, high = (sum(pair[k] <= 1 for pair in found.values()) for k in (0, 1))
    ahead = sorted((pair for pair in found.items() if max(pair[1]) > 1), key=lambda pair: -max(pair[1]))
    beaten = ", ".join(f"{name} ({pair[0]:.2g} and {pair[1]:.2g})" for name, pair in ahead)
    more = f" Where either is larger, error of (6) over theirs, median and 99 %: {beaten}." if ahead else ""
    return every(
        f"{words}: median and 99 % of (6) are at most those of every backend",
        held, role=Role.REACH,
        range=f"{words[0].upper()}{words[1:]}: (6) is at least as accurate as {median} of {len(names)} backends in median, "
        f"{high} in 99 %, {sum(held)} in both.{more}",
    )  # fmt: skip


def family(backend: str) -> str:
    """What kind of solver a backend is."""
    return next((words for words in FAMILIES if words in BACKENDS[backend].method), "nonlinear programming")


def _distributions(task: Mapping[str, Array], records: Records) -> Plot:
    """Which share of the answers is how near."""
    solved = records[records.solved]
    kinds = np.array([family(name) for name in solved.backend])
    lots = {WORDS[name]: task[name] for name in ("eq6", "eq2_5")}
    lots |= {kind: solved.task[kinds == kind] for kind in dict.fromkeys(kinds.tolist())}
    series = []
    for name, error in lots.items():
        found = error[np.isfinite(error)]
        series.append(Series(f"{name} ({len(found):,})", np.quantile(found, LEVELS), LEVELS, "line"))
    return Plot(
        "Share of the answers with a task error up to the abscissa: (6), (2)–(5), and the QP backends at high accuracy "
        "($10^{-9}$ where they have a tolerance), by kind; in brackets the number of answers",
        Axis(r"$|J\dot q - \dot x| \,/\, |\dot x|$", log=True), Axis("share of the answers", low=0, high=1), tuple(series),
    )  # fmt: skip


def _backends_heat(drawn: Sequence[Situation], task: Mapping[str, Array], records: Records) -> Heat:
    """Median task error by backend, arm and weight."""
    which = np.repeat(np.arange(len(drawn)), [len(one.q) for one in drawn])
    cells = range(len(drawn))
    rows = {WORDS[name]: [worst(error[which == k])[0] for k in cells] for name, error in task.items()}
    at, lots = which[records.place], {name: records.backend == name for name in answering(records)}
    medians = {name: [worst(records.task[own & (at == k)])[0] for k in cells] for name, own in lots.items()}
    order = sorted(medians, key=lambda name: worst(records.task[lots[name]])[0])
    caption = "Median task error of the answers given as solutions, coloured by its ratio to that of (6)"
    return heat(caption, rows | {name: medians[name] for name in order}, rows["(6)"], [one.words for one in drawn])


def _table(task: Mapping[str, Array], rates: Mapping[str, Array], records: Records, posed: ProblemSet) -> Table:
    """Every backend, and the closed forms compared, by the 99 % of the task error; those without an answer last."""
    rows: list[tuple[str | float | int | None, ...]] = []
    for name, error in task.items():
        share = None if name == "eq6" else nearer(task["eq6"], error)
        found = (WORDS[name], "closed form", len(error), *worst(error), share, worst(rates[name])[1])
        rows.append((*found, None, "", ids(posed)[_largest(error)]))
    for name in dict.fromkeys(records.backend.tolist()):
        own = records[records.backend == name]
        counts = Counter(own.verdict.tolist())
        others = ", ".join(f"{verdict} {count}" for verdict, count in counts.most_common() if verdict != "verified")
        share = nearer(task["eq6"][own.place], own.task)
        found = (name, family(name), len(own.place), *worst(own.task), share, worst(own.rates)[1])
        rows.append((*found, counts["verified"], others, own.problem[_largest(own.task)] if own.solved.any() else ""))
    rows.sort(key=lambda row: (np.isnan(row[4]), row[4]))  # type: ignore[arg-type]
    finite = tuple(tuple(None if isinstance(cell, float) and np.isnan(cell) else cell for cell in row) for row in rows)
    return Table(
        "Task errors and errors of the joint rates, by the 99 % of the former. Every case is kept in the run: sandbox show "
        "RUN/accuracy PROBLEM",
        (
            "answered by", "kind", "problems", "median", "99 %", "worst", "(6) is nearer, %",
            "joint rates: 99 %", "verified", "other verdicts", "worst problem",
        ),
        finite,
    )  # fmt: skip


def _largest(error: Array) -> int:
    return int(np.argmax(np.where(np.isfinite(error), error, -1.0)))


CLAIM = Claim(
    name="backends_in_double",
    title="The same study for every QP solver",
    place="Section V, beyond the paper",
    says=(
        "The optimisation that (6) solves can be given to any QP solver: (6) stays at least as accurate as (2)–(5), and, which "
        "goes beyond the paper's own words, as accurate as the solvers."
    ),
    formula=r"\min_{\dot q} \tfrac{1}{2} \dot q^T W \dot q \quad \text{subject to} \quad J \dot q = \dot x",
    tested=(
        "Random configurations and unit velocities on planar 3R, Panda and 7R under three weights are given to every backend "
        "at high accuracy as an ordinary run (slow interfaces see every tenth problem); every answer is judged against the "
        "exact minimiser."
    ),
    accepted=(
        "Median and 99 % of the task error of (6) are at most those of (2)–(5). Beyond the paper's words: at most those of "
        "every backend, on the problems that it solved."
    ),
    paths=(
        CodePath("eq. (6), column-pivoted LU extended by $N_J^T W$, in float64", eq6),
        CodePath("eqs. (2)–(5) as printed, explicit inverses in numpy", equations.liegeois),
    ),
    examine=backends_in_double,
    fault=Fault("(6) answered in single precision", single_precision),
    alone=True,
)
