"""M4: Chan and Dubey's weighted least norm for joint limits."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.methods.draw import generic
from problems.original import weighted_least_norm
from problems.robots.robot import Robot
from problems.weightings.least_norm import least_norm
from sandbox.method import Draw, Method
from sandbox.problem import VelocityProblem

Array = np.ndarray


def cast(
    robot: Robot, q: Array, xdot: Array, *, qdot_previous: Any = None, lower: Any = None, upper: Any = None
) -> VelocityProblem:
    """W = diag(1 + |dH/dq_i| or 1), a = 0.

    qdot_previous : (n,) or (B, n) [rad/s, m/s], whose signs say which joints approach a limit; all do if left out
    lower, upper : (n,) [rad, m], the robot's own limits if left out
    """
    W = least_norm(robot, q, qdot_previous, lower=lower, upper=upper)
    return VelocityProblem(J=robot.jacobian(q), xdot=xdot, W=W)


def draw(robot: Robot, rng: np.random.Generator, count: int) -> Draw:
    """Generic configurations inside the limits, and rates of the step before in all directions."""
    drawn = generic(robot, rng, count)
    return Draw(drawn.q, drawn.xdot, {"qdot_previous": rng.uniform(-1.0, 1.0, (count, robot.n))})


METHOD = Method(
    id="M4",
    name="weighted_least_norm",
    title="Weighted least norm, joint limits",
    formula="qdot = W^-1/2 (J W^-1/2)^+ xdot",
    weight="diag(1 + |dH/dq_i| where |dH/dq_i| is not falling, else 1)",
    vector="0",
    condition="always",
    number="",
    certainty="not identified",
    works=(
        "T. F. Chan, R. V. Dubey, A weighted least-norm solution based scheme for avoiding joint limits for redundant joint "
        "manipulators, IEEE Trans. R&A 11(2), 1995, doi 10.1109/70.370511",
    ),
    cast=cast,
    original=weighted_least_norm.original,
    draw=draw,
    inverts_weight=True,
    refuses=("a joint at or beyond its limit", "a lower limit that is not below its upper one"),
)
