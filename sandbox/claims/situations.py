"""Seeded stacks of problems that claims are examined on; J of full row rank, in any size and conditioning."""

from __future__ import annotations

import numpy as np

from problems.sets import construct as make
from sandbox.problem import VelocityProblem

Array = np.ndarray

SIZES = ((1, 2), (2, 3), (2, 4), (3, 6), (4, 6), (6, 7), (6, 8), (3, 7))
"""(m, n) on which claims for any redundant manipulator are examined."""


def positive(rng: np.random.Generator, m: int, n: int, count: int, *, decades: float = 3.0) -> VelocityProblem:
    """W > 0, eigenvalues in [.5, 2); J with singular values in [10^-decades, 1]; xdot and a in [-1, 1)."""
    J = np.stack([_basis(rng, m, n, decades).J for _ in range(count)])
    W = np.stack([make.positive_definite(rng, n) for _ in range(count)])
    return VelocityProblem(J=J, xdot=rng.uniform(-1, 1, (count, m)), W=W, a=rng.uniform(-1, 1, (count, n)))


def indefinite(rng: np.random.Generator, m: int, n: int, count: int, *, decades: float = 3.0) -> VelocityProblem:
    """The same, W with m negative eigenvalues or more, and N'WN > 0 by construction (methods 1.7)."""
    bases = [_basis(rng, m, n, decades) for _ in range(count)]
    W = np.stack([make.valid_indefinite(rng, basis) for basis in bases])
    J = np.stack([basis.J for basis in bases])
    return VelocityProblem(J=J, xdot=rng.uniform(-1, 1, (count, m)), W=W, a=rng.uniform(-1, 1, (count, n)))


def _basis(rng: np.random.Generator, m: int, n: int, decades: float) -> make.Basis:
    return make.real_basis(rng, m, n, np.sort(10.0 ** -rng.uniform(0, decades, m))[::-1])
