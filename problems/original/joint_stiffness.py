"""M15: the wrench F = (J C J')^-1 dx that springs of compliance C need for dx, and dq = C J'F (linear springs)."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.original.parameters import matrix
from problems.robots.robot import Robot

Array = np.ndarray


def original(
    robot: Robot, q: Array, xdot: Array, *, stiffness: Any = None, compliance: Any = None, compliance_as_printed: Any = None,
    unit: str | None = None,
) -> Array:  # fmt: skip
    """Joint rates (B, n). Literally printed, W = C, the springs' compliance is C^-1."""
    if compliance is not None:
        C = matrix(compliance, robot.n)
    else:
        given = stiffness if stiffness is not None else compliance_as_printed
        C = np.linalg.inv(matrix(np.arange(robot.n, 0, -1.0) if given is None else given, robot.n))
    J = robot.jacobian(q)
    moved = C @ np.swapaxes(J, -1, -2)
    F = np.linalg.solve(J @ moved, np.asarray(xdot)[..., None])
    return (moved @ F)[..., 0]
