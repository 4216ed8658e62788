"""M19: qdot = J^+ xdot + N y, y from one least-squares problem in the self-motion (Seraji & Colbaugh's damping, J exact)."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.original.parameters import matrix, secondary_rows, springs
from problems.robots.robot import Robot

Array = np.ndarray


def original(
    robot: Robot, q: Array, xdot: Array, *, secondary: str = "augmented", base: Any = 0.01,
    E: Array | None = None, gbar: Array | None = None, gamma: Array | None = None,
    stiffness: Any = None, rest: Array | None = None,
) -> Array:  # fmt: skip
    """Joint rates (B, n): y minimises |L'(q_p + N y)|^2 + |Gamma^1/2 (E (q_p + N y) - gbar)|^2, W~ = LL', q_p = J^+ xdot."""
    n, m, k = robot.n, robot.m, robot.n - robot.m
    J = robot.jacobian(q)
    roots = np.broadcast_to(np.linalg.cholesky(matrix(base, n)), (len(q), n, n))
    K, gradient = springs(robot, q, stiffness, rest)
    dJ = robot.jacobian_derivative(q) if secondary == "extended" else J
    E, gbar = secondary_rows(robot, q, E, gbar)
    weight = np.sqrt(np.broadcast_to(1.0 if gamma is None else gamma, E.shape[1]))
    qdot = np.empty((len(q), n))
    for i in range(len(q)):
        Q, R = np.linalg.qr(J[i].T, mode="complete")
        N, particular = Q[:, m:], Q[:, :m] @ np.linalg.solve(R[:m].T, xdot[i])
        rows, wanted = weight[:, None] * E[i], weight * gbar[i]
        if secondary == "extended":  # of N followed by projecting it
            dN = -np.linalg.pinv(J[i]) @ dJ[i] @ N
            rows, wanted = N.T @ K + np.einsum("jna,n->aj", dN, gradient[i]), np.zeros(k)
        A = np.vstack([roots[i].T, rows])
        left = np.concatenate([np.zeros(n), wanted]) - A @ particular
        qdot[i] = particular + N @ np.linalg.lstsq(A @ N, left)[0]
    return qdot
