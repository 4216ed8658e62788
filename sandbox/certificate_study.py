"""Certificates against exact arithmetic: how often they close, how close, how fast, and that they are never wrong.

Problems come from the sets, drawn with further seeds, and from the families here, which go where certificates must give up:
conditions to 1e16, units far apart, curvatures of both signs, data within rounding of singular.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass, field
from functools import partial
from itertools import zip_longest
from multiprocessing import get_context
from typing import Any

import numpy as np
from pebble import ProcessPool
from rich.table import Table

from sandbox.campaign import Progress, quiet
from sandbox.closed_form.vectorised import LARGEST
from sandbox.problem import VelocityProblem
from sandbox.problem_set import Group
from sandbox.reference.certified import PROVED, REASON, Certified, proved
from sandbox.reference.enclosure import Enclosure, enclosed
from sandbox.reference.exact import Rationals
from sandbox.reference.truth import Truth, truth
from sandbox.stacked import symmetric, transpose
from sandbox.tolerances import UNIT
from sandbox.weight import Weight

Array = np.ndarray
Generator = np.random.Generator

SIZES = ((1, 2), (2, 3), (2, 4), (3, 3), (3, 5), (3, 7), (6, 7))
"""(m, n) of the drawn families."""

BATCH = 2000
"""Problems that one process takes at a time."""

POSE = (6, 7)
"""The size that has a row to itself: the pose of a seven-joint arm."""

FAR, APART = 1_000_000_000, 1_000_000
"""Seeds of the sets' members are below the first; draws of a set are the second apart, as the sets are."""


# ---- families --------------------------------------------------------------------------------------------------


def orthogonal(rng: Generator, count: int, n: int) -> Array:
    """Orthogonal matrices (count, n, n)."""
    return np.linalg.qr(rng.normal(size=(count, n, n)))[0]


def powers(rng: Generator, decades: float, *shape: int) -> Array:
    """Powers of ten, exponents uniform in [-decades, 0]."""
    return 10.0 ** -rng.uniform(0, decades, shape)


def _blocks(rng: Generator, m: int, n: int, B: int, sigma: Array, S_N: Array, tangent: float) -> VelocityProblem:
    """J with singular values sigma (B, m), N'WN with eigenvalues S_N (B, n - m), Y'WY and Y'WN of size `tangent`."""
    U, V, Q = orthogonal(rng, B, m), orthogonal(rng, B, n), orthogonal(rng, B, n - m)
    Y, N = V[..., :m], V[..., m:]
    S_T, C = symmetric(rng.normal(size=(B, m, m))), rng.normal(size=(B, m, n - m))
    mixed = Y @ (S_T @ transpose(Y) / 2 + C @ transpose(N)) * tangent
    W = symmetric(mixed + transpose(mixed) + N @ (Q * S_N[:, None]) @ transpose(Q) @ transpose(N))
    J = (U * sigma[:, None]) @ transpose(Y)
    return VelocityProblem(J=J, xdot=rng.normal(size=(B, m)), W=W, a=rng.normal(size=(B, n)))


def conditioning(rng: Generator, m: int, n: int, B: int) -> VelocityProblem:
    """Conditions of J and of N'WN from 1 to 1e16."""
    decades = rng.uniform(0, 16, (2, B, 1))
    sigma, S_N = 10.0 ** -(decades[0] * rng.uniform(0, 1, (B, m))), 10.0 ** -(decades[1] * rng.uniform(0, 1, (B, n - m)))
    sigma[:, 0] = 1.0
    return _blocks(rng, m, n, B, sigma, S_N, 1.0)


def units(rng: Generator, m: int, n: int, B: int) -> VelocityProblem:
    """Rows, joints, W and a in units up to 1e16 apart."""
    p = _blocks(rng, m, n, B, powers(rng, 1, B, m), powers(rng, 1, B, n - m), 1.0)
    rows, joints = powers(rng, 16, B, m), powers(rng, 8, B, n)
    W = symmetric(joints[:, :, None] * p.W.base * joints[:, None]) * powers(rng, 16, B, 1, 1)
    return VelocityProblem(J=rows[..., None] * p.J * joints[:, None], xdot=rows * p.xdot, W=W, a=joints * p.a)


def factored(rng: Generator, m: int, n: int, B: int) -> VelocityProblem:
    """Augmented Jacobians, E' Gamma E beside nothing, or beside a base, with Gamma up to 1e12 of it, and any of its signs."""
    p = _blocks(rng, m, n, B, powers(rng, 3, B, m), powers(rng, 3, B, n - m), 0.1)
    k = max(1, n - m)
    base = np.where(rng.uniform(size=(B, 1, 1)) < 0.5, 0.0, p.W.base)
    gamma = symmetric(rng.normal(size=(B, k, k))) * rng.uniform(0, 0.5, (B, 1, 1)) + 2 * np.eye(k)
    return VelocityProblem(
        J=p.J, xdot=p.xdot, a=p.a, W=Weight(base, rng.normal(size=(B, k, n)), gamma / powers(rng, 12, B, 1, 1))
    )


def indefinite(rng: Generator, m: int, n: int, B: int) -> VelocityProblem:
    """N'WN of any inertia under a W up to 1e8 times as large: minima, saddles, maxima."""
    S_N = powers(rng, 4, B, n - m) * np.where(rng.uniform(size=(B, n - m)) < rng.choice([0.0, 0.5, 1.0], (B, 1)), -1.0, 1.0)
    return _blocks(rng, m, n, B, powers(rng, 3, B, m), S_N, 10.0 ** rng.uniform(0, 8))


def integer(rng: Generator, m: int, n: int, B: int) -> VelocityProblem:
    """Small integers: zeros, ties between pivots, exact singularity of either kind, motions at rest."""
    J, half = rng.integers(-2, 3, (B, m, n)), rng.integers(-2, 3, (B, n, n))
    low = half * (np.arange(n) < rng.integers(1, n + 1, (B, 1)))[..., None]  # of lower rank, often
    W = np.where(rng.uniform(size=(B, 1, 1)) < 0.5, transpose(low) @ low, half + transpose(half))
    still = rng.uniform(size=(2, B, 1)) < 0.2
    return VelocityProblem(
        J=J, xdot=np.where(still[0], 0, rng.integers(-2, 3, (B, m))), W=W, a=np.where(still[1], 0, rng.integers(-2, 3, (B, n)))
    )


def edge(rng: Generator, m: int, n: int, B: int) -> VelocityProblem:
    """N'WN exactly singular or J of lower rank, but for a few units in the last place of some entries."""
    J = np.round(rng.normal(size=(B, m, n)) * 2.0**10) / 3
    if m > 1:
        combined = rng.uniform(size=(B, 1)) < 0.5
        J[:, -1] = np.where(combined, (rng.integers(-2, 3, (B, 1, m - 1)) @ J[:, :-1])[:, 0], J[:, -1])
    F = rng.integers(-3, 4, (B, max(1, n - m - 1), n)) / 3
    C = rng.normal(size=(B, m, n)) * rng.choice([0.0, 1.0, 1e3], (B, 1, 1))
    mixed = transpose(J) @ C
    W = transpose(F) @ F + mixed + transpose(mixed)
    ulps = rng.integers(-2, 3, W.shape) * (rng.uniform(size=(B, 1, 1)) < 0.7)
    return VelocityProblem(
        J=J, xdot=rng.normal(size=(B, m)), W=symmetric(symmetric(W) * (1 + 2 * UNIT * ulps)), a=rng.normal(size=(B, n))
    )


def extreme(rng: Generator, m: int, n: int, B: int) -> VelocityProblem:
    """Magnitudes to the end of what error-free products bear, 2^-200..2^200, and a little beyond; zeros among them."""
    p = factored(rng, m, n, B)

    def wide(part: Array) -> Array:
        far = rng.integers(-1, 2, (B, *(1 for _ in part.shape[1:]))) * 2.0 ** rng.uniform(150, 205, B).reshape(
            B, *(1 for _ in part.shape[1:])
        )
        scale = np.where(far > 0, far, np.where(far < 0, -1 / np.where(far == 0, 1, far), 1.0))
        return np.where(rng.uniform(size=part.shape) < 0.1, 0.0, part) * scale

    assert p.W.E is not None and p.W.gamma is not None
    J, xdot, a, base, E = (wide(part) for part in (p.J, p.xdot, p.a, p.W.base, p.W.E))
    scale = 2.0 ** rng.choice([-190.0, 0.0, 190.0], (B, 1, 1))
    return VelocityProblem(J=J, xdot=xdot, a=a, W=Weight(np.triu(base) + transpose(np.triu(base, 1)), E, p.W.gamma * scale))


FAMILIES: dict[str, Callable[[Generator, int, int, int], VelocityProblem]] = {
    f.__name__: f for f in (conditioning, units, factored, indefinite, integer, edge, extreme)
}
"""(rng, m, n, count) -> a stack of drawn problems."""


def drawn(family: str, seed: Sequence[int], count: int) -> list[VelocityProblem]:
    """`count` problems or a few more, in equal parts of every size."""
    rng = np.random.default_rng(seed)
    return [FAMILIES[family](rng, m, n, -(-count // len(SIZES))) for m, n in SIZES]


def redrawn(build: Callable[[int, bool], Iterable[Group]], seeds: Sequence[int]) -> list[VelocityProblem]:
    """The members of a set for task "exact", built with each of the seeds; those of one size in one stack."""
    piles: dict[tuple[int, ...], list[VelocityProblem]] = {}
    for seed in seeds:
        for group in build(seed, False):
            if "exact" in group.tasks:
                p = group.problem
                piles.setdefault((p.m, p.n, 0 if p.W.E is None else p.W.E.shape[-2]), []).append(p)
    return [_joined(pile) for pile in piles.values()]


def _joined(pile: list[VelocityProblem]) -> VelocityProblem:
    def whole(name: str, of: Sequence[Any] = pile) -> Array:
        return np.concatenate([getattr(one, name) for one in of])

    parts = ("base", "E", "gamma") if pile[0].W.factored else ("base",)
    weight = Weight(*(whole(part, [p.W for p in pile]) for part in parts))
    return VelocityProblem(J=whole("J"), xdot=whole("xdot"), W=weight, a=whole("a"))


# ---- comparing -------------------------------------------------------------------------------------------------


def faults(found: Enclosure, told: Certified, truths: Sequence[Truth]) -> list[str]:
    """What certificates say that is not so, a line for each problem: class, rank, inertia, entries beyond their radius."""
    lines = []
    for i, right in enumerate(truths):
        words = []
        if found.proved[i]:
            words += _minimum(right, len(told.y[i]))
            for name, exact in (("x", right._x), ("y", right._y)):
                parts = [getattr(found, name + part)[i] for part in ("", "_low", "_radius")]
                words += [f"{name} is further off than its radius"] if not _within(exact, *parts) else []
        if told.reason[i] >= 0:
            reason = REASON[told.reason[i]]
            if (reason, PROVED[reason], told.rank[i]) != (right.reason, right.expected, right.rank):
                words.append(f"{reason}, rank {told.rank[i]}: exactly {right.reason}, rank {right.rank}")
            if tuple(told.inertia[i]) != right.inertia:
                words.append(f"inertia {tuple(told.inertia[i].tolist())}: exactly {right.inertia}")
            if np.isfinite(told.x[i]).all():
                for name, exact in (("x", right._x), ("y", right._y)):
                    values, radius = getattr(told, name)[i], np.broadcast_to(getattr(told, f"{name}_radius")[i], (99,))
                    if not _within(exact, values, np.zeros(len(values)), radius[: len(values)]):
                        words.append(f"rounded {name} is further off than its radius")
        if words:
            lines.append(f"member {i}: " + "; ".join(words))
    return lines


def _minimum(right: Truth, m: int) -> list[str]:
    if right.expected == "unique_minimum" and right.rank == m:
        return []
    return [f"a unique minimum: exactly {right.expected}, {right.reason}, rank {right.rank}"]


def _within(exact: Rationals | None, values: Array, low: Array, radius: Array) -> bool:
    """Whether |exact - (values + low)| <= radius in every entry, in integers."""
    if exact is None:
        return False
    denominator = int(exact.denominator)
    for numerator, *floats in zip(exact.numerators, values.tolist(), low.tolist(), radius.tolist(), strict=True):
        (p, q), (r, s), (t, u) = (number.as_integer_ratio() for number in floats)
        off = abs(int(numerator) * q * s - (p * s + r * q) * denominator)
        if off * u > t * q * s * abs(denominator):
            return False
    return True


@dataclass
class Tally:
    """What came of one family: numbers of problems, seconds, relative radii of certified minima, words on what was wrong.

    singular : of lower rank or with a zero eigenvalue of N'WN, exactly; no certificate in floats can say that
    """

    problems: int = 0
    singular: int = 0
    certified: int = 0
    wrong: list[str] = field(default_factory=list)
    radii: list[Array] = field(default_factory=list)
    seconds: float = 0.0
    exact_seconds: float = 0.0

    def add(self, other: Tally) -> None:
        """Take in another tally of the same family."""
        for name, value in vars(other).items():
            setattr(self, name, getattr(self, name) + value)

    def row(self, family: str) -> dict[str, Any]:
        """Figures for a table: shares in percent, microseconds per problem."""
        radii = np.concatenate([*self.radii, np.zeros(0)])
        regular = self.problems - self.singular
        return {
            "family": family, "problems": self.problems, "certified": self.certified, "singular": self.singular,
            "exact": 100 * (self.problems - self.certified) / max(1, self.problems),
            "exact_of_regular": 100 * (regular - self.certified) / max(1, regular), "wrong": len(self.wrong),
            "median_radius": float(np.median(radii)) if len(radii) else None,
            "largest_radius": float(radii.max()) if len(radii) else None,
            "certificate_us": 1e6 * self.seconds / max(1, self.problems),
            "exact_us": 1e6 * self.exact_seconds / max(1, self.problems),
        }  # fmt: skip


def compare(draw: Callable[[], list[VelocityProblem]]) -> list[tuple[tuple[int, int], Tally]]:
    """Both paths on every stack that is drawn, with its (m, n); runs in a process of its own."""
    tallies = []
    for problem in draw():
        whole = problem.m <= problem.n <= LARGEST
        if whole:
            proved(problem), enclosed(problem)  # compiles where that has not been done, and touches the memory
        begun = time.process_time()
        told = proved(problem)
        middle = time.process_time()
        truths = truth(problem)
        assert isinstance(truths, list)
        tally = Tally(len(problem), seconds=middle - begun, exact_seconds=time.process_time() - middle)
        tally.certified = int((told.reason >= 0).sum())
        tally.singular = sum(t.rank < problem.m or t.inertia[2] > 0 for t in truths)
        if whole:
            tally.wrong = faults(enclosed(problem), told, truths)
        size = np.abs(told.x).max(axis=-1)
        tally.radii = [told.x_radius[size > 0] / size[size > 0]]
        tallies.append(((problem.m, problem.n), tally))
    return tallies


def study(
    sets: Sequence[Any], count: int, seed: int = 0, *, jobs: int = 1, progress: Progress = quiet
) -> tuple[list[dict[str, Any]], list[str]]:
    """About `count` problems, as many of each set and family: one row of figures each, and a line for each wrong certificate.

    sets : rows (name, build, seed) as the table of sets has them; progress : told (phase, problems done, total)
    The last two rows are those of 6 x 7 alone, and of all.
    """
    work = list(_batches(sets, count, seed))
    tallies = {name: Tally() for name in dict.fromkeys(name for name, *_ in work)}
    pose, total, done = Tally(), sum(size for *_, size in work), 0
    with ProcessPool(max_workers=jobs, context=get_context("spawn")) as pool:
        names: dict[Any, tuple[str, int]] = {}
        for name, draw, size in work:
            names[pool.schedule(compare, args=[draw])] = name, size
        try:
            for future in as_completed(names):
                name, size = names[future]
                for at, tally in future.result():
                    tallies[name].add(tally)
                    if at == POSE:
                        pose.add(tally)
                done += size
                progress("certifying", done, total)
        except BaseException:
            pool.stop()
            raise
    everything = Tally()
    for tally in tallies.values():
        everything.add(tally)
    rows = [tally.row(name) for name, tally in {**tallies, "all 6 x 7": pose, "all": everything}.items()]
    return rows, [f"{name}: {line}" for name, tally in tallies.items() for line in tally.wrong]


def _batches(sets: Sequence[Any], count: int, seed: int) -> Iterator[tuple[str, Callable[[], list[VelocityProblem]], int]]:
    """(set or family, what draws a batch of it, problems in it), the kinds in turns of a batch."""
    share, kinds = -(-count // (len(sets) + len(FAMILIES))), []
    for row in sets:
        first, second = (_J(row.build(at, False)) for at in (row.seed, row.seed + FAR))
        size = sum(map(len, first))
        fixed = all(np.array_equal(*pair) for pair in zip(first, second, strict=True))  # published: the same for every seed
        rounds = 1 if fixed else max(1, min(BATCH, share) // size)
        begin = row.seed + FAR * (1 + seed)
        kinds.append([
            (row.name, partial(redrawn, row.build, [begin + APART * i for i in range(number * rounds, (number + 1) * rounds)]),
             rounds * size)
            for number in range(1 if fixed else max(1, round(share / (rounds * size))))
        ])  # fmt: skip
    for place, name in enumerate(FAMILIES):
        part = -(-min(BATCH, share) // len(SIZES)) * len(SIZES)
        kinds.append([
            (name, partial(drawn, name, (seed, place, number), part), part) for number in range(max(1, round(share / part)))
        ])  # fmt: skip
    for turn in zip_longest(*kinds):
        yield from (batch for batch in turn if batch is not None)


def _J(groups: Iterable[Group]) -> list[Array]:
    return [group.problem.J for group in groups if "exact" in group.tasks]


def table(rows: Sequence[dict[str, Any]]) -> Table:
    """The rows of `study`."""
    drawn = Table(
        title="certificates against exact arithmetic", title_justify="left", caption_justify="left",
        caption="exact: left to exact arithmetic; regular: neither of lower rank nor with a singular N'WN, exactly. "
        "Radii of x are relative to its largest entry, rounding included. CPU time, one thread.",
    )  # fmt: skip
    for name in ("", "problems", "certified", "singular", "exact", "exact of regular", "wrong", "radius, median", "largest",
                 "us, certificate", "us, exact"):  # fmt: skip
        drawn.add_column(name, justify="left" if not name else "right", no_wrap=not name)
    for row in rows:
        radii = ("" if row[key] is None else f"{row[key]:.1e}" for key in ("median_radius", "largest_radius"))
        drawn.add_row(
            row["family"], *(f"{row[key]:,}" for key in ("problems", "certified", "singular")),
            *(f"{row[key]:.2f} %" for key in ("exact", "exact_of_regular")),
            f"[{'red' if row['wrong'] else 'green'}]{row['wrong']}[/]", *radii,
            *(f"{row[key]:.2f}" for key in ("certificate_us", "exact_us")),
        )  # fmt: skip
    return drawn
