"""C2: qdot = kappa J'K e (Wolovich & Elliott 1984), kappa the best one step: it leaves the least of |K e - kappa JJ'K e|."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.original.parameters import matrix
from problems.robots.robot import Robot

Array = np.ndarray


def original(robot: Robot, q: Array, xdot: Array, *, gain: Any = 1.0) -> Array:
    """Joint rates (B, n); xdot is the error e = x_des - x, gain K (m, m), (m,) or a number [1/s]."""
    pull = xdot @ matrix(gain, robot.m)
    qdot = np.empty((len(q), robot.n))
    for i, J in enumerate(robot.jacobian(q)):
        step = J.T @ pull[i]
        reach = J @ step
        best = pull[i] @ reach / (reach @ reach) if reach.any() else 0.0
        qdot[i] = best * step
    return qdot
