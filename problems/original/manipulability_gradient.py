"""M5: qdot = J^+ xdot + alpha (I - J^+J) grad w, dw/dq_k = w tr((dJ/dq_k) J^+) (Yoshikawa 1985)."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.original.gradient_projection import projected
from problems.robots.robot import Robot

Array = np.ndarray


def original(
    robot: Robot, q: Array, xdot: Array, *, alpha: float = 0.5, measure: str = "manipulability", scales: Any = None
) -> Array:
    """Joint rates (B, n); for the smallest singular value d sigma_m/dq_k = u_m'(dJ/dq_k)v_m (Klein, Blaho 1987)."""
    J, dJ = robot.jacobian(q), robot.jacobian_derivative(q)
    if measure == "smallest_singular_value":
        U, _, Vt = np.linalg.svd(J, full_matrices=False)
        gradient = np.einsum("...m,...kmn,...n->...k", U[..., -1], dJ, Vt[..., -1, :])
    else:
        gradient = np.einsum("...kmn,...nm->...k", dJ, np.linalg.pinv(J))
    if measure == "manipulability":
        gradient = np.prod(np.linalg.svd(J, compute_uv=False), axis=-1, keepdims=True) * gradient
    return projected(robot, q, xdot, alpha * gradient, scales)
