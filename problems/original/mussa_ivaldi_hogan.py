"""M18: qdot = C_a J'(J C_a J')^-1 xdot, C_a = (C^-1 - Gamma)^-1 (Mussa-Ivaldi & Hogan 1991)."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.original.parameters import matrix
from problems.robots.robot import Robot

Array = np.ndarray


def original(
    robot: Robot, q: Array, xdot: Array, *, compliance: Any = 1.0, rest: Array | None = None, tolerance: float = 0.0
) -> Array:
    """Joint rates (B, n), with F = (J C J')^-1 J (q - rest) and Gamma = sum_k F_k dJ_k/dq; C^-1 - Gamma must be nonsingular."""
    J, dJ = robot.jacobian(q), robot.jacobian_derivative(q)
    C = matrix(compliance, robot.n)
    Jt = np.swapaxes(J, 1, 2)
    stretch = J @ (q - np.asarray(0.0 if rest is None else rest, dtype=float))[:, :, None]
    F = np.linalg.solve(J @ C @ Jt, stretch)[:, :, 0]
    Gamma = np.einsum("bk,bjki->bij", F, dJ)
    adapted = np.linalg.solve(np.linalg.inv(C) - (Gamma + np.swapaxes(Gamma, 1, 2)) / 2, Jt)
    return (adapted @ np.linalg.solve(J @ adapted, xdot[:, :, None]))[:, :, 0]
