"""What measures of the Jacobian share: its rank by rounding, and the gradient of a pairing <A, J(q)>."""

from __future__ import annotations

import casadi as ca
import numpy as np

from problems.measures.measure import at, compiled
from problems.robots.robot import Robot
from problems.robots.twin import Symbol, Twin
from sandbox.errors import RankDeficientError
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


def deficient(J: Array, sigma: Array) -> Array:
    """Where J (..., m, n) with the singular values sigma has, by rounding, no full row rank (...,) bool."""
    m, n = J.shape[-2:]
    if m > n:
        return np.ones(J.shape[:-2], dtype=bool)
    return ~(sigma[..., m - 1] > RANK * n * UNIT * sigma[..., 0])


def require_full_rank(robot: Robot, J: Array, sigma: Array, name: str) -> None:
    """Refuse J (..., m, n) without full row rank, sigma (..., min(m, n)) its singular values: `name` has no gradient there.

    Raises RankDeficientError with the configuration and the singular values.
    """
    bad = deficient(J, sigma)
    if bad.any():
        index = tuple(int(i) for i in np.argwhere(bad)[0])
        raise RankDeficientError(
            f"the Jacobian of {robot.name} has no full row rank at {at(index)} (singular values "
            f"{', '.join(f'{s:.3g}' for s in sigma[index])}): {name} has no gradient there; keep away from the singularity",
            index=index, singular_values=sigma[index].tolist(),
        )  # fmt: skip
