"""M14: [J; H] qdot = [xdot; -kappa h - alpha (N'H')^-1 h], N followed by projecting it, N(q) = N_0 - J^+J N_0."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.linalg import null_space

from problems.original.parameters import springs
from problems.robots.robot import Robot

Array = np.ndarray


def original(
    robot: Robot, q: Array, xdot: Array, *,
    stiffness: Any = 1.0, rest: Array | None = None, kappa: float = 1.0, alpha: float = 0.0,
) -> Array:  # fmt: skip
    """Joint rates (B, n); g = 1/2 (q - rest)'K(q - rest)."""
    n = robot.n
    J, dJ = robot.jacobian(q), robot.jacobian_derivative(q)
    K, gradient = springs(robot, q, stiffness, rest)
    qdot = np.empty((len(q), n))
    for i in range(len(q)):
        N, pinv = null_space(J[i]), np.linalg.pinv(J[i])
        dN = -pinv @ dJ[i] @ N  # of the projection: what moves J^+ meets J N = 0
        H = N.T @ K + np.einsum("jna,n->aj", dN, gradient[i])
        h = N.T @ gradient[i]
        pull = -kappa * h - alpha * np.linalg.solve(N.T @ H.T, h)
        qdot[i] = np.linalg.solve(np.vstack([J[i], H]), np.concatenate([xdot[i], pull]))
    return qdot
