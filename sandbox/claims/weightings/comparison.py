"""What the claims on weights share: their methods and robots, and how two code paths are compared."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from problems.methods import METHODS
from problems.robots.robot import Robot
from sandbox.agreement import bounds
from sandbox.claims.claim import Answer
from sandbox.method import Method
from sandbox.problem import VelocityProblem

Array = np.ndarray

STIFFNESS, INERTIA = METHODS["joint_stiffness"], METHODS["inertia_weighted"]


LOAD, IMPEDANCE = METHODS["virtual_load"], METHODS["mussa_ivaldi_hogan"]


PSEUDOINVERSE = METHODS["gradient_projection"]


ROBOTS = ("planar_3r", "planar_4r", "seven_joint", "panda")


TASKS = np.array([[1.0, 0.0], [0.0, 1.0], [0.3, -0.7]])


def quadratic(W: Array, x: Array) -> Array:
    """Measure 1/2 x'W x of each row (B,)."""
    return np.einsum("...i,...ij,...j->...", x, W, x) / 2


def agreement(
    method: Method, robot: Robot, given: tuple[Array, Array, dict[str, Any]], first: Answer, second: Answer
) -> tuple[Array, Array]:
    """The first path's rates (B, n), and their difference (B,) from the second's over the sum of both bounds."""
    q, xdot, parameters = given
    x = first(method, robot, q, xdot, **parameters)
    allowed = sum(bounds(method, method.cast(robot, q, xdot, **parameters), x, parameters))
    return x, np.abs(x - second(robot, q, xdot, **parameters)).max(axis=-1) / allowed


def cast_wrong(row: Method, cast: Callable[..., VelocityProblem]) -> Callable[[Answer], Answer]:
    """A planted fault: the framework handed another cast of the method `row`."""

    def plant(framework: Answer) -> Answer:
        def planted(method: Method, robot: Robot, q: Array, xdot: Array, **parameters: Any) -> Array:
            return framework(replace(method, cast=cast) if method is row else method, robot, q, xdot, **parameters)

        return planted

    return plant


FRAMEWORK = "cast as $W$, answered by eq. (6)"
