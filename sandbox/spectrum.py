"""Singular values and null space of J, and the reduced weight N'WN, of a stack of problems."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sandbox.problem import VelocityProblem
from sandbox.stacked import eigenvalues, svd
from sandbox.tolerances import RANK, UNIT

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class Spectrum:
    """J = U Sigma V' of a stack of B problems, all sizes complete.

    U (B, m, m), sigma (B, min(m, n)) descending [unit of J], V (B, n, n), rank (B,).
    """

    U: Array
    sigma: Array
    V: Array
    rank: Array

    @classmethod
    def of(cls, problem: VelocityProblem, rank: Array | None = None) -> Spectrum:
        """Decompose J; `rank` (B,) is declared where it is known, else decided by the singular values."""
        U, sigma, V = svd(problem.J)
        if rank is None:
            rank = numerical_rank(sigma, problem.m, problem.n)
        return cls(U, sigma, V, np.asarray(rank, dtype=int))

    def by_rank(self) -> Iterator[tuple[int, Array]]:
        """Each rank that occurs, with the members that have it."""
        for r in np.unique(self.rank):
            yield int(r), np.flatnonzero(self.rank == r)

    def range_basis(self, r: int, members: Array) -> Array:
        """V_r (b, n, r), orthonormal: range J'."""
        return self.V[members, :, :r]

    def null_basis(self, r: int, members: Array) -> Array:
        """N (b, n, n - r), orthonormal: null J."""
        return self.V[members, :, r:]

    def image_basis(self, r: int, members: Array) -> Array:
        """U_r (b, m, r), orthonormal: range J."""
        return self.U[members, :, :r]

    def solve(self, r: int, members: Array, vectors: Array) -> Array:
        """J^+ v (b, n) for v (b, m), factor by factor: an explicit J^+ would spread its rounding over all directions."""
        U, V = self.image_basis(r, members), self.range_basis(r, members)
        parts = (np.swapaxes(U, -1, -2) @ vectors[..., None]) / self.sigma[members, :r, None]
        solution: Array = (V @ parts)[..., 0]
        return solution

    def solve_transposed(self, r: int, members: Array, vectors: Array) -> Array:
        """J^+' v (b, m) for v (b, n)."""
        U, V = self.image_basis(r, members), self.range_basis(r, members)
        parts = (np.swapaxes(V, -1, -2) @ vectors[..., None]) / self.sigma[members, :r, None]
        solution: Array = (U @ parts)[..., 0]
        return solution


def numerical_rank(sigma: Array, m: int, n: int) -> Array:
    """Number of singular values (..., p) above rounding of the largest."""
    return np.sum(sigma > RANK * max(m, n) * UNIT * sigma[..., :1], axis=-1)


def reduced_weight(problem: VelocityProblem, N: Array) -> Array:
    """N'WN (..., k, k), through the factors of W and symmetric to the last bit."""
    S = problem.W.left(N) @ N
    return (S + np.swapaxes(S, -1, -2)) / 2


def smallest_eigenvalue(matrices: Array) -> Array:
    """lambda_min (...,) of symmetric matrices (..., k, k); +inf where k = 0."""
    if matrices.shape[-1] == 0:
        return np.full(matrices.shape[:-2], np.inf)
    return eigenvalues(matrices)[..., 0]


def spectral_norm(matrices: Array) -> Array:
    """|M|_2 (...,) of symmetric matrices (..., k, k)."""
    return np.abs(eigenvalues(matrices)).max(axis=-1)
