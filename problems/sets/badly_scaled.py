"""Well-conditioned problems in unfortunate units: a row of J, some joints, W against J, or a, scaled."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from problems.sets import construct as make
from problems.sets.collect import FULL, Member, draw, grouped
from sandbox.problem_set import Group

TASKS = ("exact",)
ROUNDS = 1
SIZES = ((2, 3), (6, 7), (2, 4), (3, 6))
DEGREE = 0.017453292519943295  # [rad/deg]
SCALES = {
    "row of J": (1e-4, 1e-3, 1e-2, 1e-1, 1e1, 1e2, 1e3, 1e4),
    "unit of joints": (1e-4, 1e-3, 1e-2, DEGREE, 1 / DEGREE, 1e2, 1e3, 1e4),  # mm, cm, deg against m and rad
    "W against J": (1e-8, 1e-6, 1e-4, 1e-2, 1e2, 1e4, 1e6, 1e8),
    "a": (1e-8, 1e-6, 1e-4, 1e-2, 1e2, 1e4, 1e6, 1e8),
}
WEIGHTS = ("W positive definite", "W indefinite")


class Case(NamedTuple):
    """Size, what is scaled and how far, and the definiteness of W."""

    m: int
    n: int
    knob: str
    scale: float
    W: str


CASES = tuple(
    Case(m, n, knob, scale, WEIGHTS[(size + i) % 2])
    for size, (m, n) in enumerate(SIZES)
    for knob, scales in SCALES.items()
    for i, scale in enumerate(scales)
)


def member(case: Case, rng: np.random.Generator) -> Member:
    """A problem of order 1, then scaled; all but "a" only change units, so the motion stays the same."""
    m, n, scale = case.m, case.n, case.scale
    basis = make.real_basis(rng, m, n)
    W = make.positive_definite(rng, n) if case.W == WEIGHTS[0] else make.valid_indefinite(rng, basis)
    J, xdot, a = basis.J, make.vector(rng, m), make.vector(rng, n)
    if case.knob == "row of J":
        rows = np.where(np.arange(m) == rng.integers(m), scale, 1.0)
        J, xdot = rows[:, None] * J, rows * xdot
    elif case.knob == "unit of joints":
        joints = np.where(np.arange(n) % 2 == 0, scale, 1.0)
        J, W, a = J * joints, joints[:, None] * W * joints, joints * a
    elif case.knob == "W against J":
        W, a = scale * W, scale * a
    else:
        a = scale * a
    return Member(J, xdot, W, a, None, {"knob": case.knob, "value": scale, "case": case.W})


def build(seed: int, full: bool) -> tuple[Group, ...]:
    """The groups of the set."""
    return grouped(draw(CASES, member, seed, rounds=ROUNDS * (FULL if full else 1)), TASKS)
