"""J close to a singularity: the scan over sigma_min(J) from 1e-1 to 1e-12."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from problems.sets import construct as make
from problems.sets.collect import FULL, Member, draw, grouped
from sandbox.problem_set import Group

TASKS = ("exact", "damped")
ROUNDS = 1
KNOB = "sigma_min(J)"
SIZES = ((2, 3), (6, 7), (2, 4), (3, 5), (3, 7), (5, 8))
LEVELS = tuple(float(f"1e-{power}") for power in range(1, 13))
XDOT = ("xdot = J q0", "xdot random")
WEIGHTS = ("W = I", "W positive definite", "W indefinite")


class Case(NamedTuple):
    """Size, smallest singular value of J, and the kinds of xdot and W."""

    m: int
    n: int
    level: float
    xdot: str
    W: str


CASES = tuple(
    Case(m, n, level, xdot, WEIGHTS[(size + i + j) % len(WEIGHTS)])
    for size, (m, n) in enumerate(SIZES)
    for j, xdot in enumerate(XDOT)
    for i, level in enumerate(LEVELS)
)


def member(case: Case, rng: np.random.Generator) -> Member:
    """J = U diag(sigma) V'; with xdot = J q0 the answer stays of order 1, with random xdot it grows as 1/sigma_min."""
    m, n = case.m, case.n
    sigma = rng.uniform(0.5, 2.0, m)
    sigma[-1] = case.level
    basis = make.orthonormal_basis(rng, m, n)
    J = make.product(make.orthogonal(rng, m) * sigma, basis.J)
    if case.W == "W = I":
        W = np.eye(n)
    elif case.W == "W positive definite":
        W = make.positive_definite(rng, n)
    else:
        W = make.valid_indefinite(rng, basis)
    q0 = make.vector(rng, n)
    xdot = make.product(J, q0) if case.xdot == XDOT[0] else make.vector(rng, m)
    labels = {"knob": KNOB, "value": case.level, "case": f"{case.xdot}, {case.W}"}
    return Member(J, xdot, W, make.vector(rng, n), None, labels)


def build(seed: int, full: bool) -> tuple[Group, ...]:
    """The groups of the set."""
    return grouped(draw(CASES, member, seed, rounds=ROUNDS * (FULL if full else 1)), TASKS)
