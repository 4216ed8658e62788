"""W with 1..m negative eigenvalues and condition (7) true: the scan over lambda_min(W)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from problems.sets import construct as make
from problems.sets.collect import FULL, Member, draw, grouped
from sandbox.problem_set import Group

TASKS = ("exact",)
ROUNDS = 1
KNOB = "lambda_min(W)"
SIZES = ((2, 3), (6, 7), (2, 4), (3, 5), (4, 6), (3, 6), (3, 7), (5, 8), (6, 10))
LEVELS = tuple(-float(f"1e{power}") for power in range(-9, 5))


class Case(NamedTuple):
    """Size, smallest eigenvalue of W and how many are negative."""

    m: int
    n: int
    level: float
    negative: int


CASES = tuple(Case(m, n, level, 1 + i % m) for m, n in SIZES for i, level in enumerate(LEVELS))


def member(case: Case, rng: np.random.Generator) -> Member:
    """In eigenvectors of W = Q diag(d_u, d_v) Q': null J is spanned by Q [X; I], so N'WN = diag(d_v) + X'diag(d_u)X.

    d_u holds the negative eigenvalues; their rows of X are so short that they cost N'WN at most 0.25 of its 0.5.
    """
    m, n, level, p = case
    k = n - m
    d_u, d_v = rng.uniform(0.5, 2.0, m), rng.uniform(0.5, 2.0, k)
    d_u[:p] = level * rng.uniform(0.25, 1.0, p)
    d_u[0] = level
    X = rng.uniform(-1.0, 1.0, (m, k))
    X[:p] *= np.minimum(0.5, np.sqrt(0.25 / (k * p * -d_u[:p])))[:, None]
    Q = make.orthogonal(rng, n)
    K = make.orthogonal(rng, m) * rng.uniform(0.5, 2.0, m)
    return Member(
        J=make.product(K, np.hstack([np.eye(m), -X]), Q.T),
        xdot=make.vector(rng, m),
        W=make.symmetrised(make.product(Q * np.concatenate([d_u, d_v]), Q.T)),
        a=make.vector(rng, n),
        Wx=None,
        labels={"knob": KNOB, "value": level, "case": f"{p} negative eigenvalue{'s' if p > 1 else ''}"},
    )


def build(seed: int, full: bool) -> tuple[Group, ...]:
    """The groups of the set."""
    return grouped(draw(CASES, member, seed, rounds=ROUNDS * (FULL if full else 1)), TASKS)
