"""M4: qdot = W^-1/2 (J W^-1/2)^+ xdot in scaled joints p = W^1/2 q (Chan & Dubey 1995)."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.robots.robot import Robot

Array = np.ndarray


def original(robot: Robot, q: Array, xdot: Array, *, qdot_previous: Any = None, lower: Any = None, upper: Any = None) -> Array:
    """Joint rates (B, n); H = (range/4)(1/u + 1/v) with u = upper - q, v = q - lower, so dH/dq = (range/4)(u^-2 - v^-2)."""
    upper = robot.upper if upper is None else np.asarray(upper, dtype=float)
    lower = robot.lower if lower is None else np.asarray(lower, dtype=float)
    bounded = np.isfinite(upper - lower)
    upper, lower = np.where(bounded, upper, q + 1), np.where(bounded, lower, q - 1)  # mid-range: no slope
    u, v, quarter = upper - q, q - lower, (upper - lower) / 4
    slope, curvature = quarter * (u**-2 - v**-2), 2 * quarter * (u**-3 + v**-3)
    size = np.abs(slope)
    if qdot_previous is not None:
        growth = np.sign(slope) * curvature * np.asarray(qdot_previous, dtype=float)  # d|dH/dq|/dt
        size = np.where(growth >= 0, size, 0.0)
    root = np.sqrt(1 + size)
    scaled = np.linalg.pinv(robot.jacobian(q) / root[..., None, :])
    return np.einsum("...nm,...m->...n", scaled, xdot) / root
