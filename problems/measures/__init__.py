"""Configuration measures f(q) whose gradients enter the problem as a = alpha grad f."""

from __future__ import annotations

from collections.abc import Callable
from inspect import signature
from typing import Any, NamedTuple

import numpy as np

from problems.measures.fault_tolerance import FAULT_TOLERANCE, KFM, LEAST, fault_tolerance, kfm, least_relative_manipulability
from problems.measures.free_swinging import ACCELERATION, ANGLE, TORQUE, swing_acceleration, swing_angle, swing_torque
from problems.measures.gravity_torque import GRAVITY_TORQUE, gravity_torque
from problems.measures.joint_limits import BARRIER, P_NORM, QUADRATIC, barrier, p_norm, quadratic
from problems.measures.manipulability import LOG_VOLUME, VOLUME, log_volume, volume
from problems.measures.measure import Measure
from problems.measures.obstacle import OBSTACLE, obstacle_potential
from problems.measures.posture import POSTURE, posture
from problems.measures.singular_value import SMALLEST, smallest_singular_value
from problems.robots.robot import Robot
from sandbox.errors import RangeError
from sandbox.parameters import chosen


class Row(NamedTuple):
    """One measure: its card, and `factory` (robot, **parameters) -> Measure."""

    name: str
    unit: str
    about: str
    source: str
    domain: str
    factory: Callable[..., Measure]


MEASURES = {
    row.name: row
    for row in (
        Row(*POSTURE, lambda robot, target=None: posture(np.zeros(robot.n) if target is None else target)),
        Row(*QUADRATIC, quadratic),
        Row(*P_NORM, p_norm),
        Row(*BARRIER, barrier),
        Row(*VOLUME, lambda robot: volume()),
        Row(*LOG_VOLUME, lambda robot: log_volume()),
        Row(*SMALLEST, lambda robot: smallest_singular_value()),
        Row(*GRAVITY_TORQUE, gravity_torque),
        Row(*OBSTACLE, obstacle_potential),
        Row(*KFM, kfm),
        Row(*LEAST, least_relative_manipulability),
        Row(*FAULT_TOLERANCE, fault_tolerance),
        Row(*TORQUE, swing_torque),
        Row(*ACCELERATION, swing_acceleration),
        Row(*ANGLE, swing_angle),
    )
}


def load(name: str, robot: Robot, **parameters: Any) -> Measure:
    """The measure called `name` on a robot.

    Raises UnknownNameError where there is none, RangeError where a parameter without a default is left out, and what the
    measure's own parameters raise.
    """
    factory = MEASURES[chosen("measure", name, MEASURES)].factory
    _, *known = signature(factory).parameters.values()
    for parameter in parameters:
        chosen(f"parameter of {name}", parameter, [one.name for one in known] or ("none",))
    missing = [one.name for one in known if one.default is one.empty and one.name not in parameters]
    if missing:
        raise RangeError(f"{name} is no measure without {' and '.join(missing)}; give it from Python", field=missing[0])
    return factory(robot, **parameters)
