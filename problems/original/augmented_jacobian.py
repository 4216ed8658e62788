"""M11: [J; E] qdot = [xdot; gbar], solved as it stands (Egeland 1987, Seraji 1989)."""

from __future__ import annotations

import numpy as np

from problems.original.parameters import secondary_rows
from problems.robots.robot import Robot

Array = np.ndarray


def original(
    robot: Robot, q: Array, xdot: Array, *, E: Array | None = None, gbar: Array | None = None, gamma: Array | None = None
) -> Array:
    """Joint rates (B, n); with more rows than k, those of the task met and the rest in the least-squares sense of gamma."""
    B, m, k = len(q), robot.m, robot.n - robot.m
    E, gbar = secondary_rows(robot, q, E, gbar)
    J, count = robot.jacobian(q), E.shape[1]
    if count == k:
        A = np.concatenate([J, E], axis=1)
        return np.linalg.solve(A, np.concatenate([xdot, gbar], axis=1)[:, :, None])[:, :, 0]
    root = np.sqrt(np.ones(count) if gamma is None else gamma)
    qdot = np.empty((B, robot.n))
    for i in range(B):
        Q, R = np.linalg.qr(J[i].T, mode="complete")
        particular = Q[:, :m] @ np.linalg.solve(R[:m].T, xdot[i])
        wanted = root * (gbar[i] - E[i] @ particular)
        qdot[i] = particular + Q[:, m:] @ np.linalg.lstsq(root[:, None] * E[i] @ Q[:, m:], wanted)[0]
    return qdot
