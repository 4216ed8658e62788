"""M16: qdot = Jbar xdot, Jbar = M^-1 J' Lambda, Lambda = (J M^-1 J')^-1 (Khatib 1987)."""

from __future__ import annotations

import numpy as np

from problems.robots.robot import Robot

Array = np.ndarray


def original(robot: Robot, q: Array, xdot: Array) -> Array:
    """Joint rates (B, n)."""
    return np.einsum("...nm,...m->...n", operational(robot, q)[1], xdot)


def operational(robot: Robot, q: Array) -> tuple[Array, Array]:
    """Lambda (..., m, m), the inertia felt at the hand, and Jbar (..., n, m), by the explicit M^-1."""
    J = robot.jacobian(q)
    mobility = np.linalg.inv(robot.inertia(q)) @ np.swapaxes(J, -1, -2)
    Lambda = np.linalg.inv(J @ mobility)
    return Lambda, mobility @ Lambda
