"""The augmented Jacobian as a method of the table, its arms, and what two ways to its joint rates may differ by."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from problems import robots
from problems.methods import METHODS
from sandbox.agreement import bounds

Array = np.ndarray

Law = Callable[[Array, Array], Array]

AUGMENTED = METHODS["augmented_jacobian"]


ARMS = (("planar_3r", None), ("planar_4r", None), ("panda", None), ("panda", "position"), ("seven_joint", "position"))
"""Robots and tasks with one, two, one, four and four degrees of redundancy."""


def arm(name: str, task: str | None) -> Any:
    """The robot, asked for that task."""
    return robots.load(name, task)


def words(name: str, task: str | None) -> str:
    """What the robot is called on the page."""
    robot = arm(name, task)
    return f"{name}{', ' + task if task else ''} ({robot.m}×{robot.n})"


def allowance(robot: Any, q: Array, xdot: Array, x: Array, **given: Any) -> Array:
    """What (6) and [J; E] may differ by (B,) [rad/s, m/s]: the sum of their bounds."""
    return sum(bounds(AUGMENTED, AUGMENTED.cast(robot, q, xdot, **given), x, given))  # type: ignore[return-value]
