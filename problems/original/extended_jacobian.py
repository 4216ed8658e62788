"""M12: [J; H] qdot = [xdot; 0], H = dh/dq (Baillieul 1985), h through a null space by elimination with frozen pivots."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.linalg import qr

from problems.original.parameters import springs
from problems.robots.robot import Robot

Array = np.ndarray


def original(
    robot: Robot, q: Array, xdot: Array, *, stiffness: Any = 1.0, rest: Array | None = None, tolerance: float = 0.0
) -> Array:
    """Joint rates (B, n); g = 1/2 (q - rest)'K(q - rest), h = N'grad g with N = [-J_B^-1 J_F; I].

    dN_B = -J_B^-1 dJ N, as J N = 0. The answer is that of every other N where h = 0 (`tolerance` is the cast's business).
    """
    n, m = robot.n, robot.m
    J, dJ = robot.jacobian(q), robot.jacobian_derivative(q)
    K, gradient = springs(robot, q, stiffness, rest)
    qdot = np.empty((len(q), n))
    for i in range(len(q)):
        order = qr(J[i], mode="r", pivoting=True)[1]
        basic, free = order[:m], order[m:]
        inverse = np.linalg.inv(J[i][:, basic])
        N = np.zeros((n, n - m))
        N[free] = np.eye(n - m)
        N[basic] = -inverse @ J[i][:, free]
        H = N.T @ K
        for joint in range(n):
            dN = -inverse @ dJ[i, joint] @ N
            H[:, joint] += dN.T @ gradient[i][basic]
        qdot[i] = np.linalg.solve(np.vstack([J[i], H]), np.concatenate([xdot[i], np.zeros(n - m)]))
    return qdot
