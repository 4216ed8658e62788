"""M3: qdot = J^+ xdot - alpha (I - J^+J) grad H (Liegeois 1977), grad H written out."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.original.gradient_projection import projected
from problems.robots.robot import Robot

Array = np.ndarray


def original(
    robot: Robot, q: Array, xdot: Array, *, alpha: float = 0.5, measure: str = "joint_limits_quadratic", p: int | None = None,
    lower: Any = None, upper: Any = None, weights: Any = None, scales: Any = None,
) -> Array:  # fmt: skip
    """Joint rates (B, n); a joint without two finite limits takes no part."""
    qmin = robot.lower if lower is None else np.asarray(lower, dtype=float)
    qmax = robot.upper if upper is None else np.asarray(upper, dtype=float)
    finite = np.isfinite(qmin) & np.isfinite(qmax)
    w = np.where(finite, 1.0 if weights is None else np.asarray(weights, dtype=float), 0.0)
    qmin, qmax = np.where(finite, qmin, -1.0), np.where(finite, qmax, 1.0)
    c = (qmax + qmin) / 2
    if measure == "joint_limits_quadratic":
        gradient = 2 / robot.n * w * (q - c) / (c - qmax) ** 2
    elif measure == "joint_limits_p_norm":
        x = np.abs((q - c) / (c - qmax))
        p = 6 if p is None else p
        norm = np.sum(w * x**p, axis=-1, keepdims=True) ** (1 / p)
        gradient = w * (x / norm) ** (p - 1) * np.sign(q - c) / (qmax - c)
    else:
        room = np.where(w > 0, (qmax - q) ** 2 * (q - qmin) ** 2, 1.0)
        gradient = w * (qmax - qmin) ** 2 * (2 * q - qmax - qmin) / (4 * room)
    return projected(robot, q, xdot, -alpha * gradient, scales)
