"""The Jacobian of a robot, decomposed and of full row rank, and the gradient of a pairing <A, J(q)>."""

from __future__ import annotations

from typing import NamedTuple

import casadi as ca
import numpy as np

from problems.measures.measure import compiled
from problems.robots.robot import Robot
from problems.robots.twin import Symbol, Twin
from sandbox import check
from sandbox.errors import RankDeficientError
from sandbox.parameters import configuration
from sandbox.tolerances import RANK, UNIT

Array = np.ndarray


def pairing_gradient(robot: Robot, q: Array, A: Array) -> Array:
    """Gradient (..., n) of sum_ij A_ij J_ij(q), A (..., m, n) held fixed: sum_ij A_ij dJ_ij/dq_k.

    Singular values and what is made of them have gradients of this form, A from the singular vectors at q.
    """
    sizes = (robot.m * robot.n,)
    return compiled(_pairing, (), sizes, robot, 1)(q, A.reshape(*A.shape[:-2], sizes[0]))[0]


def _pairing(twin: Twin, A: Symbol) -> Symbol:
    return ca.dot(A, ca.vec(twin.jacobian.T))  # row by row, as numpy


class Decomposition(NamedTuple):
    """J = U diag(sigma) V' (..., m, n), m <= n: U (..., m, m), sigma (..., m) descending, Vt (..., n, n); of full row rank."""

    U: Array
    sigma: Array
    Vt: Array

    @property
    def V(self) -> Array:
        """Orthonormal basis (..., n, m) of range J'."""
        return np.swapaxes(self.Vt[..., : self.U.shape[-1], :], -1, -2)

    @property
    def N(self) -> Array:
        """Orthonormal basis (..., n, n - m) of null J."""
        return np.swapaxes(self.Vt[..., self.U.shape[-1] :, :], -1, -2)

    @property
    def pinv(self) -> Array:
        """J^+ (..., n, m)."""
        return self.V @ (np.swapaxes(self.U, -1, -2) / self.sigma[..., None])

    @property
    def condition(self) -> Array:
        """sigma_1/sigma_m (...,)."""
        return self.sigma[..., 0] / self.sigma[..., -1]


EQ13 = "use least_squares_rank_deficient (eq. 13)"


def decompose(robot: Robot, J: Array, way_out: str = EQ13) -> Decomposition:
    """J (..., m, n) of a robot, decomposed.

    Raises RankDeficientError as `require_full_rank`.
    """
    found = Decomposition(*np.linalg.svd(J))
    require_full_rank(robot, J, found.sigma, way_out)
    return found


def require_full_rank(robot: Robot, J: Array, sigma: Array, way_out: str = EQ13) -> None:
    """Refuse J (..., m, n) that has by rounding no full row rank; sigma (..., min(m, n)) its singular values.

    Raises RankDeficientError with the configuration, the singular values and the way out.
    """
    m, n = J.shape[-2:]
    bad = ~(sigma[..., -1] > RANK * n * UNIT * sigma[..., 0]) | (m > n)
    if bad.any():
        index = check.first(bad)
        raise RankDeficientError(
            f"{configuration(index)} of {robot.name}: J has no full row rank, its singular values are "
            f"({', '.join(f'{value:.3g}' for value in sigma[index])}); {way_out}",
            index=index, singular_values=sigma[index].tolist(),
        )  # fmt: skip
