"""N'M, M the inertia matrix, by inverse dynamics: the columns of N are joint accelerations, the torques are rows of N'M."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pinocchio as pin

from problems.robots.robot import Robot
from sandbox import check

Array = np.ndarray


def inertia_along(robot: Robot, q: Any, N: Any) -> Array:
    """N'M (..., k, n) [kg m^2, kg m, kg] for N (..., n, k) at q (..., n): k recursions at rest and without gravity.

    Rotor inertias are in it, as they are in Robot.inertia.

    Raises ShapeError, NonFiniteError, RangeError for q or N. Source: methods M16; section III, English & Maciejewski.
    """
    q, N = check.real(q, "q"), check.matrices(N, "N")
    n = robot.n
    check.shape(q, ("n",), {"n": n}, "q")
    check.shape(N, ("n", "k"), {"n": n}, "N")
    lead, k = check.leading({"q": q.shape[:-1], "N": N.shape[:-2]}), N.shape[-1]
    rows = np.broadcast_to(q, (*lead, n)).reshape(-1, n)
    columns = np.swapaxes(np.broadcast_to(N, (*lead, n, k)), -1, -2).reshape(-1, k, n)
    model, data, still = _weightless(robot)
    torques = np.empty((len(rows), k, n))
    for i, row in enumerate(rows):
        for c in range(k):
            torques[i, c] = pin.rnea(model, data, row, still, columns[i, c])
    return torques.reshape(*lead, k, n)


@cache
def _weightless(robot: Robot) -> tuple[pin.Model, pin.Data, Array]:
    """The robot's model where nothing falls: subtracting the gravity torque afterwards would cost its digits."""
    model = robot.model.copy()
    model.gravity = pin.Motion.Zero()
    return model, model.createData(), np.zeros(robot.n)
