"""Rigorous enclosures: their time, and how often exact arithmetic has to decide."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

import numpy as np

from problems import sets
from sandbox.bench.measured import Measured, each
from sandbox.bench.race import Effort, one_core, race
from sandbox.bench.stack import stack
from sandbox.problem import VelocityProblem
from sandbox.reference.certified import certified
from sandbox.reference.enclosure import enclosed

SINGULAR = "singular"
"""Word in the case of a manufactured problem whose N'WN is exactly singular: only exact arithmetic can tell."""


def time_of(function: Callable[[VelocityProblem], object]) -> Callable[[Effort], Measured]:
    """Time of `enclosed` or `certified` for one 7 x 6 problem [us]; beside it the per cent that enclosures prove."""

    def measure(effort: Effort) -> Measured:
        problem = stack(6, 7, effort.problems(8192)).problem
        with one_core():
            times = race({"it": lambda: function(problem)}, effort.rounds)
        proved = 100 * float(enclosed(problem).proved.mean())
        return each(times["it"], len(problem)).with_({"proved %": proved, "problems": len(problem)})

    return measure


def fallback(names: Iterable[str], full: bool) -> Callable[[Effort], Measured]:
    """Per cent of the problems of task exact that exact arithmetic decided, singular N'WN of `manufactured` left out."""

    def measure(effort: Effort) -> Measured:
        shares: dict[str, float | str] = {}
        decided = problems = 0
        for name in names:
            counts = [certified(problem).exactly for problem in posed(name, full, effort)]
            exactly = np.concatenate(counts) if counts else np.zeros(0, dtype=bool)
            decided, problems = decided + int(exactly.sum()), problems + len(exactly)
            if len(exactly):
                shares[f"{name} %"] = 100 * float(exactly.mean())
        return Measured(100 * decided / problems, beside={**(shares if len(shares) > 1 else {}), "problems": problems})

    return measure


def posed(name: str, full: bool, effort: Effort) -> Iterator[VelocityProblem]:
    """The groups of a set that are posed for task exact; at a lower effort the first ones, and a share of their members."""
    groups = [group for group in sets.load(name, full and effort.share >= 1).groups if "exact" in group.tasks]
    for group in groups[: effort.least(len(groups))]:
        cases = group.labels.get("case") or [""] * len(group)
        kept = [i for i, case in enumerate(cases) if name != "manufactured" or SINGULAR not in str(case)]
        yield group.problem[kept[: effort.least(len(kept))]]


OTHERS = [name for name in sets.SETS if name not in ("manufactured", "planar", "seven_joint")]
"""Sets without a target: many of their problems are singular on purpose."""
