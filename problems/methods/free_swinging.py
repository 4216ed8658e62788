"""M10: preparing for free-swinging failures, by the gradient of the torques, accelerations or angles of joints that let go."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.measures.free_swinging import swing, swing_acceleration, swing_angle, swing_torque, turned
from problems.methods.draw import STATIONARY, generic, moving
from problems.methods.gradient_projection import descending
from problems.original import free_swinging
from problems.robots.robot import Robot
from sandbox.method import Draw, Method
from sandbox.parameters import chosen
from sandbox.problem import VelocityProblem

Array = np.ndarray

CHOICES = {"swing_torque": swing_torque, "swing_acceleration": swing_acceleration, "swing_angle": swing_angle}

ALPHA = {"swing_torque": 1e-3, "swing_acceleration": 1e-3, "swing_angle": 0.1}
"""alpha where it is left out [rad^2/(s unit of f)]."""


def cast(
    robot: Robot, q: Array, xdot: Array, *, alpha: float | None = None, measure: str = "swing_acceleration",
    weights: Any = None, scales: Any = None,
) -> VelocityProblem:  # fmt: skip
    """W = I, a = alpha grad f, f = 1/2 sum w_i X_i^2, X the torque, acceleration or angle of a joint that lets go.

    alpha : [rad^2/(s unit of f)], from ALPHA if left out; scales : as for gradient_projection
    weights : w (n,) >= 0; 1 if left out, but 0 for the angle of joints that slide or that gravity never turns
    """
    f = CHOICES[chosen("measure of free swinging", measure, CHOICES)](robot, weights=weights)
    return descending(robot, q, xdot, ALPHA[measure] if alpha is None else alpha, f.gradient(robot, q), scales)


def draw(robot: Robot, rng: np.random.Generator, count: int, *, measure: str = "swing_acceleration") -> Draw:
    """Configurations off the stationary points of f; for the angle, with no joint near upright."""
    f = CHOICES[measure](robot)

    def accept(q: Array) -> Array:
        accepted = moving(robot, q, f.gradient(robot, q))
        if measure == "swing_angle":
            found = swing(robot, q)
            clear = (np.pi - np.abs(found.theta) > STATIONARY) & (found.tilt > STATIONARY)
            accepted &= clear[:, turned(robot)].all(axis=-1)
        return accepted

    return generic(robot, rng, count, accept)._replace(parameters={"measure": measure})


METHOD = Method(
    id="M10",
    name="free_swinging",
    title="Free-swinging failures",
    formula="qdot = J^+ xdot - alpha (I - J^+J) grad f, f = 1/2 sum w_i X_i^2, X_i = tau_g,i, tau_g,i/M_ii or theta_i",
    weight="I",
    vector="alpha grad 1/2 sum w_i X_i^2",
    condition="always",
    number="[14], [15]",
    certainty="plausible",
    works=(
        "J. D. English, A. A. Maciejewski, Fault tolerance for kinematically redundant manipulators: anticipating "
        "free-swinging joint failures, IEEE Trans. R&A 14(4), 1998, 566-575",
    ),
    cast=cast,
    original=free_swinging.original,
    draw=draw,
    refuses=(
        "gravity parallel to a joint's axis (angle)", "an outboard centre of mass on a joint's axis (angle)",
        "a joint upright over its axis (angle)", "a robot without mass or gravity",
    ),
)  # fmt: skip
