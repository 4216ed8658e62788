"""Static torque: what the joints must hold against gravity (methods M6)."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from problems.measures.measure import Card, Measure, symbolic
from problems.robots.robot import Robot
from problems.robots.twin import Symbol, Twin
from sandbox.errors import RangeError, RefusalError
from sandbox.parameters import matrix, single
from sandbox.tolerances import KINK, UNIT

Array = np.ndarray

GRAVITY_TORQUE = Card(
    "gravity_torque", "(Nm)^2 times the unit of Q", "half the weighted square of the torque that holds the robot at rest",
    "after Hollerbach, Suh 1987; methods M6", "everywhere, on a robot that gravity pulls at",
)  # fmt: skip


class WeightlessError(RefusalError):
    """Gravity asks no torque of this robot at any configuration: it has no mass, or there is no gravity."""


def gravity_torque(robot: Robot, *, Q: Any = None) -> Measure:
    """Measure f = 1/2 tau_g'Q tau_g, tau_g the torque that holds the robot at rest; its gradient is (d tau_g/dq)'Q tau_g.

    Q : (n, n) positive semidefinite, or (n,) a diagonal; I without it: f in (Nm)^2. Q = diag(1/tau_max^2) makes f a number.

    Raises WeightlessError for a robot without mass or gravity, RangeError where Q is not positive semidefinite,
    AsymmetricWeightError where it is not symmetric, ShapeError for its shape.
    """
    require_heavy(robot)
    Q = torque_weight(robot, Q).ravel()
    return symbolic(*GRAVITY_TORQUE[:4], _expression, parameters=(Q,), domain=GRAVITY_TORQUE.domain)


def torque_weight(robot: Robot, Q: Any = None) -> Array:
    """Q (n, n), checked: symmetric and, but for rounding, positive semidefinite; a number times I, or a diagonal (n,)."""
    Q = single(matrix(1.0 if Q is None else Q, "Q", robot.n), "Q", robot.n)
    smallest = float(np.linalg.eigvalsh(Q)[..., 0].min())
    if smallest < -KINK * robot.n * UNIT * np.abs(Q).max():
        raise RangeError(
            f"Q has the eigenvalue {smallest:.6g}; a weight of torques is positive semidefinite", field="Q", value=smallest
        )
    return Q


def require_heavy(robot: Robot) -> None:
    """Refuse a robot without mass or gravity (WeightlessError)."""
    mass, gravity = sum(mass for _, mass, *_ in robot.bodies()), float(np.linalg.norm(robot.model.gravity.linear))
    if not (mass > 0 and gravity > 0):
        raise WeightlessError(
            f"{robot.name} has a mass of {mass:g} kg in a gravity of {gravity:g} m/s^2: gravity asks no torque of it",
            mass=mass, gravity=gravity,
        )  # fmt: skip


def _expression(twin: Twin, Q: Symbol) -> Symbol:
    n, torque = twin.robot.n, twin.gravity_torque
    return ca.dot(torque, ca.reshape(Q, n, n) @ torque) / 2
