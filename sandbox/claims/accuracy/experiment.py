"""What the claims about the experiment of section V share: the paper's numbers, both code paths, and how seeds are shown."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from sandbox.claims.claim import Answer, Check, CodePath, Role, Trial, every
from sandbox.claims.exhibit import Series, Table
from sandbox.claims.single_compiled import by_kernels
from sandbox.claims.single_elementwise import by_elements
from sandbox.claims.single_precision import SAMPLES, Study, study

Array = np.ndarray

NORMAL, AUGMENTED = 0, 1
METHODS = ("(2)–(5)", "(6)")

PAPER_MEAN = (2.7e-7, 6.4e-8)
PAPER_WORST = (3.9e-5, 5.1e-6)
PAPER_SHARES = (79, 12, 9)
"""Table III: means and worst cases of (2)-(5) and (6) [m/s]; percent where (2)-(5) is worse, (6) is worse, both are equal."""

SHARES = ("(2)–(5) worse", "(6) worse", "both equal")

DENSE = 100
"""Samples that a bin of cond(J) must hold for its share or its quantile to count."""

ARM = (
    r"Planar arm with three unit links, $W = I$, $\alpha = 0$. $q$, $\dot x$, $J$, the algorithms in the order of Section IV "
    r"and the actual velocity $J \dot q$ are in float32; the error is the two-norm of $\dot x - J \dot q$. "
)

SETUP = ARM + (
    r"$q$ is uniform in $[-\pi, \pi]^3$, which the paper leaves open, and $\dot x$ of unit norm; 10,000 samples a seed, 200 "
    "seeds. "
)

EXPERIMENT = (
    CodePath("the compiled kernels of (2)–(5) and (6) on float32", by_kernels),
    CodePath("the same operations written out for 2×3, elementwise in numpy float32", by_elements),
)

Shown = Callable[[float], str]
"""How a statistic is written."""

Row = tuple[str, Array, float | None, Shown]
"""A statistic of the tables: its name, its values (S,), the paper's number, how they are written."""


def both(trial: Trial, first: Answer, second: Answer) -> tuple[Study, Check]:
    """The study by the first path, and whether the second agrees with it in every bit."""
    ours, other = study(first, trial), study(second, trial)
    agree = [a == b for a, b in zip(ours.digests, other.digests, strict=True)]
    says = f"rates and errors of {SAMPLES:,} samples agree bit for bit in both code paths, seed by seed"
    return ours, every(says, agree, role=Role.OURS)


def inside(what: str, values: Array, paper: float, rounding: float, shown: Shown, near: str) -> Check:
    """The paper's number, rounded as it is printed, among the central 98 % of the seeds; `near` says how near it is."""
    low, high = np.quantile(values, (0.01, 0.99))
    side = "below" if paper < low else "above" if paper > high else "among"
    return Check(
        f"{what}: the paper's is among the central 98 % of the seeds, to its last digit",
        low - rounding <= paper <= high + rounding, shown(paper), f"{shown(low)} to {shown(high)}", len(values), Role.REACH,
        f"{what} {near}. The central 98 % of our {len(values)} seeds are {shown(low)} to {shown(high)}, and the paper's "
        f"{shown(paper)} is {side} them.",
    )  # fmt: skip


def percent(value: float) -> str:
    """A share, to a tenth where it is not whole."""
    return f"{value:g} %" if value == round(value) else f"{value:.1f} %"


def table(caption: str, rows: Sequence[Row]) -> Table:
    """One statistic a row: the paper's number, our first seed, median and central 98 %."""
    cells = []
    for name, values, paper, shown in rows:
        low, middle, high = np.quantile(values, (0.01, 0.5, 0.99))
        ours = (shown(values[0]), shown(middle), f"{shown(low)} to {shown(high)}")
        cells.append((name, None if paper is None else shown(paper), *ours))
    return Table(caption, ("statistic", "paper", "first seed", "median", "1 % to 99 %"), tuple(cells), paper=("paper",))


def edges(values: Sequence[Array], *, log: bool = False) -> Array:
    """Edges of thirty bins that hold all values."""
    low, high = min(part.min() for part in values), max(part.max() for part in values)
    if not low < high:
        low, high = low * 0.99, high * 1.01 + 1e-12
    return np.geomspace(low, high, 31) if log else np.linspace(low, high, 31)


def rule(name: str, at: float) -> Series:
    """A number of the paper's, drawn as a vertical line."""
    return Series(name, [at], [0.0], "vertical", "paper")
