"""What decides a stack: singular values and null space of J, and the curvature N'WN that condition (7) asks for."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from sandbox.closed_form.linear import power_of_two
from sandbox.problem import VelocityProblem
from sandbox.stacked import eigenvalues, svd, symmetric, transpose
from sandbox.tolerances import CONDITION_SEVEN, RANK, UNIT

Array = np.ndarray


def norm(A: Array) -> Array:
    """Frobenius norm (B,), safe from overflow."""
    scale = power_of_two(np.abs(A).max(axis=(-1, -2), initial=0.0))
    return scale * np.sqrt(np.square(A / scale[:, None, None]).sum(axis=(-1, -2)))


def weight_size(problem: VelocityProblem, N: Array) -> Array:
    """What rounding of N'WN is measured by (B,): |base| + 2 |N'E'||Gamma||E|, Frobenius norms.

    Through the factors N'WN is as small as N'E' makes it: a factored weight is known to more digits than W.
    """
    total = norm(problem.W.base)
    E, gamma = problem.W.E, problem.W.gamma
    if E is not None and gamma is not None:
        total = total + 2 * norm(E @ N) * norm(gamma) * norm(E)
    return total


def null_rounding(problem: VelocityProblem, V: Array, N: Array, sigma: Array) -> Array:
    """What the error of N adds to N'WN (B,): N turns by u sigma_1/sigma_r towards range J' (basis V), where N'W meets it."""
    if not (V.shape[-1] and N.shape[-1]):
        return np.zeros(len(problem))
    across = norm(problem.W.left(N) @ V)
    turn = problem.n * UNIT * sigma[:, 0] / sigma[:, -1]
    return 2 * np.where(across > 0, across * turn, 0.0)


class Standing:
    """Whether eq. (6) has an answer, and nobody doubts it: of a whole problem (Geometry), or of N'W alone (eq6_implicit).

    problem : a stack of B; sigma (B, min(m, n)) of J with its rows scaled near one; singular_values of J itself
    curvature (B, n - m) ascending eigenvalues of N'WN, N orthonormal; threshold (B,) below which one is an algorithmic
    singularity; rounding (B,) above that what errors in N can add to it
    """

    problem: VelocityProblem
    sigma: Array
    singular_values: Array
    curvature: Array
    threshold: Array
    rounding: Array

    @property
    def full_row_rank(self) -> Array:
        """Where J has n >= m and no singular value of its equilibrated rows is within rounding of zero (B,)."""
        m, n = self.problem.m, self.problem.n
        if n < m:
            return np.zeros(len(self.problem), dtype=bool)
        full: Array = self.sigma[:, -1] > RANK * n * UNIT * self.sigma[:, 0]
        return full

    @property
    def smallest(self) -> Array:
        """Smallest eigenvalue of N'WN (B,); +inf where N is empty."""
        return self.curvature[:, 0] if self.curvature.shape[-1] else np.full(len(self.problem), np.inf)

    @property
    def unsure(self) -> Array:
        """Where the error of N is what leaves condition (7) open (B,)."""
        size = np.abs(self.smallest)
        within: Array = (size > self.threshold) & (size <= self.threshold + self.rounding)
        return within

    @property
    def singular(self) -> Array:
        """Where condition (7) fails, or holds by no more than rounding of N'WN (B,)."""
        return ~(self.smallest > self.threshold) & ~self.unsure

    @property
    def sound(self) -> Array:
        """Where J has full row rank and condition (7) holds, both beyond rounding (B,)."""
        return self.full_row_rank & ~self.singular & ~self.unsure

    @property
    def evidence(self) -> dict[str, Array]:
        """The numbers behind a refusal."""
        missing = np.full(len(self.problem), np.nan)
        k = self.curvature.shape[-1]
        return {
            "lambda_min_reduced": self.curvature[:, 0] if k else missing,
            "lambda_max_reduced": self.curvature[:, -1] if k else missing,
            "singular_values": self.singular_values,
        }


@dataclass(frozen=True, eq=False)
class Geometry(Standing):
    """Of a stack of B problems; J = diag(scale) Jeq, with rows of Jeq at most 1, and Jeq = U Sigma V'.

    scale (B, m) powers of two; U (B, m, m), sigma (B, min(m, n)), V (B, n, n): row scaling leaves null J alone
    singular_values (B, min(m, n)) of J itself [unit of J]
    N (B, n, max(n - m, 0)) orthonormal; size (B,) of W; the others as in Standing
    """

    problem: VelocityProblem
    scale: Array
    U: Array
    sigma: Array
    V: Array
    singular_values: Array
    N: Array
    curvature: Array
    size: Array
    threshold: Array
    rounding: Array

    @classmethod
    def of(cls, problem: VelocityProblem) -> Geometry:
        """Decompose every member of a stack with one leading axis."""
        m, n = problem.m, problem.n
        with np.errstate(all="ignore"):
            scale = power_of_two(np.abs(problem.J).max(axis=-1))
            Jeq = problem.J / scale[:, :, None]
            U, sigma, V = svd(Jeq)
            N = V[:, :, m:]
            curvature = eigenvalues(symmetric(problem.W.left(N) @ N))
            size = weight_size(problem, N)
            threshold = CONDITION_SEVEN * max(n - m, 0) * n * 2 * UNIT * size
            rounding = null_rounding(problem, V[:, :, :m], N, sigma)
            singular_values = svd(problem.J)[1]
        return cls(problem, scale, U, sigma, V, singular_values, N, curvature, size, threshold, rounding)

    def __getitem__(self, members: Array) -> Geometry:
        """The members an index array names."""
        parts = {field.name: getattr(self, field.name)[members] for field in fields(self)}
        return Geometry(**parts)

    def range_solve(self, v: Array) -> Array:
        """Y (B, m) with J'y = the part of v (B, n) in range J': D^-1 U Sigma^-1 V'v."""
        m = self.problem.m
        inner = (transpose(self.V[:, :, :m]) @ v[..., None])[..., 0] / self.sigma
        product: Array = (self.U @ inner[..., None])[..., 0] / self.scale
        return product


def gradient(problem: VelocityProblem, x: Array) -> Array:
    """W x + a (B, n), through the factors of W."""
    total: Array = problem.W.times(x[:, :, None])[:, :, 0] + problem.a
    return total


def positive_definite(W: Array) -> Array:
    """Where W (B, n, n) is positive definite beyond rounding (B,), by its eigenvalues."""
    values = eigenvalues(W)
    clear: Array = values[:, 0] > W.shape[-1] * UNIT * values[:, -1]
    return clear
