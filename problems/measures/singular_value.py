"""Smallest singular value of the Jacobian (Klein, Blaho 1987; methods M5)."""

from __future__ import annotations

import numpy as np

from problems.measures.jacobian import pairing_gradient, require_full_rank
from problems.measures.measure import Card, Measure, NotDifferentiableError
from problems.robots.robot import Robot
from sandbox import check
from sandbox.parameters import configuration
from sandbox.tolerances import SIMPLE

Array = np.ndarray

SMALLEST = Card(
    "smallest_singular_value", "the task's unit per rad", "smallest singular value of the Jacobian",
    "Klein, Blaho 1987; methods M5", "everywhere; no gradient where it is 0 or not simple",
)  # fmt: skip


def smallest_singular_value() -> Measure:
    """Measure sigma_m, how slow the slowest unit joint motion is at the hand; its gradient is u_m'(dJ/dq_k)v_m.

    The gradient refuses a Jacobian without full row rank (RankDeficientError) and sigma_m that is not told from
    sigma_(m-1) (NotDifferentiableError). It depends on the units of the task rows.
    """
    return Measure(*SMALLEST, _value, _gradient)


def _value(robot: Robot, q: Array) -> Array:
    return np.linalg.svd(robot.jacobian(q), compute_uv=False)[..., -1]


def _gradient(robot: Robot, q: Array) -> Array:
    q = check.real(q, "q")
    J = robot.jacobian(q)
    U, sigma, Vt = np.linalg.svd(J, full_matrices=False)
    require_full_rank(robot, J, sigma, "its smallest singular value has no gradient there: keep away")
    require_simple(robot, sigma, "the smallest singular value")
    return pairing_gradient(robot, q, U[..., :, -1, None] * Vt[..., -1, None, :])


def require_simple(robot: Robot, sigma: Array, name: str) -> None:
    """Refuse singular values (..., m) whose last two are not told apart.

    Raises NotDifferentiableError with the configuration and the values.
    """
    if sigma.shape[-1] < 2:
        return
    bad = ~(sigma[..., -2] - sigma[..., -1] >= SIMPLE * sigma[..., 0])
    if bad.any():
        index = check.first(bad)
        low, high = sigma[index][-1], sigma[index][-2]
        raise NotDifferentiableError(
            f"{name} of {robot.name} at {configuration(index)}, {low:.17g}, is not told from the next, {high:.17g}: "
            "it has no gradient there; maximise the manipulability instead",
            index=index, singular_values=sigma[index].tolist(),
        )  # fmt: skip
