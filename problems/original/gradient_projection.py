"""M1: qdot = J^+ xdot - alpha (I - J^+J) grad f (Liegeois 1977), in Klein and Huang's order of operations."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.robots.robot import Robot

Array = np.ndarray


def original(
    robot: Robot, q: Array, xdot: Array, *, alpha: float = 0.5, posture: Any = None, gradient: Any = None, scales: Any = None
) -> Array:
    """Joint rates (B, n); grad f = q - posture, or as given."""
    if gradient is None:
        gradient = q - (np.zeros(robot.n) if posture is None else np.asarray(posture))
    return projected(robot, q, xdot, -alpha * np.asarray(gradient), scales)


def projected(robot: Robot, q: Array, xdot: Array, z: Array, scales: Any = None) -> Array:
    """Joint rates (B, n): z + J^+(xdot - J z), J^+ by singular values; with scales in the joints p = q/s, where W = I."""
    s = np.ones(robot.n) if scales is None else np.asarray(scales, dtype=float)
    J = robot.jacobian(q) * s
    z = z * s
    missing = xdot - np.einsum("...mn,...n->...m", J, z)
    return s * (z + np.einsum("...nm,...m->...n", np.linalg.pinv(J), missing))
