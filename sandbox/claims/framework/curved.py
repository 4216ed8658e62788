"""Problems of whole numbers whose stationary points are of a chosen kind, exactly."""

from __future__ import annotations

from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from flint import fmpz_mat

from problems.sets import construct as make
from sandbox.problem import VelocityProblem

Array = np.ndarray


def rational(values: Any) -> Array:
    """The same numbers as Fractions; every float is one."""
    return np.vectorize(Fraction, otypes=[object])(values)


def objective(W: Array, a: Array, x: Array) -> Any:
    """1/2 x'Wx + a'x in the arithmetic of its arguments."""
    return x @ (W @ x) / 2 + a @ x


def integer(A: Array) -> fmpz_mat:
    """A matrix of whole numbers, exactly."""
    return fmpz_mat([[int(v) for v in row] for row in A])


KINDS = ("minimum", "saddle", "maximum", "flat", "saddle and flat")
"""What N'WN makes of the stationary points: positive definite, both signs, negative definite, singular without and with a
negative eigenvalue."""

EXACT_KIND = {
    "condition_7": "minimum", "saddle": "saddle", "maximum": "maximum", "singular": "flat", "descending": "flat",
    "indefinite_singular": "saddle and flat",
}  # fmt: skip
"""The kinds in the words of the exact reference."""


class Curved(NamedTuple):
    """A problem of whole numbers, N with J N = 0 exactly, and its kind by construction."""

    problem: VelocityProblem
    N: Array
    kind: str


def curved(rng: np.random.Generator, m: int, n: int, kind: str) -> Curved:
    """A problem with N'WN of the kind asked for, exactly: N'WN = F' diag(pivots) F, F unimodular; W may be indefinite."""
    basis, k = make.integer_basis(rng, m, n), n - m
    pivots = rng.integers(1, 2, k, endpoint=True).astype(float)
    if kind in ("saddle", "saddle and flat"):
        pivots[0] *= -1
    if kind == "maximum":
        pivots *= -1
    if kind in ("flat", "saddle and flat"):
        pivots[-1] = 0
    S_N, _ = make.integer_form(rng, pivots)
    W = make.weight(basis, make.integer_symmetric(rng, m), make.nonzero_integers(rng, m, k), S_N)
    return Curved(VelocityProblem(J=basis.J, xdot=make.integers(rng, m), W=W, a=make.integers(rng, n)), basis.N, kind)


def curved_of_all_kinds(rng: np.random.Generator, m: int, n: int, count: int) -> list[Curved]:
    """`count` of every kind that the degree of redundancy has room for."""
    kinds = [kind for kind in KINDS if n - m > 1 or not kind.startswith("saddle")]
    return [curved(rng, m, n, kind) for kind in kinds for _ in range(count)]


def stack(members: list[VelocityProblem]) -> VelocityProblem:
    """Problems of one size as a stack."""
    parts = {name: np.stack([getattr(one, name) for one in members]) for name in ("J", "xdot", "a")}
    return VelocityProblem(**parts, W=np.stack([one.W.dense() for one in members]))
