"""Problem sets by name: names are frozen numbers, changed numbers get a new name."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

from problems.sets import (
    badly_scaled,
    indefinite,
    manufactured,
    methods,
    near_singular,
    no_minimum,
    not_unique,
    planar,
    rank_deficient,
    seven_joint,
    textbook,
    trajectories,
)
from sandbox.errors import UnknownNameError
from sandbox.problem_set import Group, ProblemSet


class Row(NamedTuple):
    """One set: its name, what it holds, what builds it, and the seed of its first member (member i has seed + i)."""

    name: str
    about: str
    build: Callable[[int, bool], tuple[Group, ...]]
    seed: int


SETS = {
    row.name: row
    for row in (
        Row("textbook", "published fixtures and hand-derived cases with rational answers", textbook.build, 0),
        Row("manufactured", "answers known by construction, every inertia of N'WN", manufactured.build, 1_000_000),
        Row("indefinite", "W with 1..m negative eigenvalues, condition (7) true", indefinite.build, 2_000_000),
        Row("no_minimum", "saddles, maxima, singular N'WN with a descent", no_minimum.build, 3_000_000),
        Row("not_unique", "singular N'WN without a descent, exactly", not_unique.build, 4_000_000),
        Row("rank_deficient", "J exactly rank-deficient, every kind of xdot and Wx", rank_deficient.build, 5_000_000),
        Row("near_singular", "sigma_min(J) from 1e-1 to 1e-12", near_singular.build, 6_000_000),
        Row("badly_scaled", "rows, joints, W or a in unfortunate units", badly_scaled.build, 7_000_000),
        Row("planar", "planar 3R and 4R arms, with a gradient", planar.build, 8_000_000),
        Row("seven_joint", "a spherical-revolute-spherical arm, position and pose", seven_joint.build, 9_000_000),
        Row("methods", "every method of the paper on planar arms, 7R and Panda", methods.build, 10_000_000),
        Row("trajectories", "control steps along closed paths, cold and warm-started", trajectories.build, 11_000_000),
    )
}


@cache
def _load(name: str, full: bool) -> ProblemSet:
    row = SETS[name]
    return ProblemSet(row.name, row.build(row.seed, full), row.about)


def load(name: str, full: bool = False) -> ProblemSet:
    """The set called `name`; the full form holds the standard one as a prefix of each group.

    Raises UnknownNameError where no set has that name.
    """
    if name not in SETS:
        raise UnknownNameError.of("set", name, SETS)
    return _load(name, bool(full))
