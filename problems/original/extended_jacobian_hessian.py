"""M13: the derivative of the stationary point of g on x(q) = x, from its own optimality conditions."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.original.parameters import springs
from problems.robots.robot import Robot

Array = np.ndarray


def original(
    robot: Robot, q: Array, xdot: Array, *,
    stiffness: Any = 1.0, rest: Array | None = None, maximum: bool = False, tolerance: float = 0.0,
) -> Array:  # fmt: skip
    """Joint rates (B, n): grad g = J'lam differentiated along the motion, beside J qdot = xdot.

    (K - sum_k lam_k dJ_k/dq) qdot - J'lamdot = 0. The same at minima and maxima; the derivative of J as it is.
    """
    B, n, m = len(q), robot.n, robot.m
    J, dJ = robot.jacobian(q), robot.jacobian_derivative(q)
    K, gradient = springs(robot, q, stiffness, rest)
    system, right = np.zeros((B, n + m, n + m)), np.zeros((B, n + m))
    for i in range(B):
        lam = np.linalg.lstsq(J[i].T, gradient[i])[0]
        system[i, :n, :n] = K - (lam @ dJ[i]).T  # (lam @ dJ)[j, i] = sum_k lam_k dJ_ki/dq_j
    system[:, :n, n:], system[:, n:, :n] = -np.swapaxes(J, 1, 2), J
    right[:, n:] = xdot
    return np.linalg.solve(system, right[:, :, None])[:, :n, 0]
