"""M2: qdot = L^-T (J L^-T)^+ xdot, W = L L': the pseudoinverse in scaled joints p = L'q (Doty et al. 1993)."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.original.parameters import matrix
from problems.robots.robot import Robot

Array = np.ndarray


def original(robot: Robot, q: Array, xdot: Array, *, weight: Any = None) -> Array:
    """Joint rates (B, n), by singular values; weight (n,), (n, n) or (B, n, n)."""
    W = matrix(np.arange(robot.n, 0, -1.0) if weight is None else weight, robot.n)
    back = np.swapaxes(np.linalg.inv(np.linalg.cholesky(W)), -1, -2)  # L^-T
    return np.einsum("...ij,...j->...i", back @ np.linalg.pinv(robot.jacobian(q) @ back), xdot)
