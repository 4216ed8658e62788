"""C3: time scaling: the path is kept, and travelled as fast as the rate limits allow."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.measures.jacobian import decompose
from problems.measures.posture import posture as posture_measure
from problems.methods.draw import generic
from problems.original import time_scaling
from problems.robots.robot import Robot
from problems.weightings.identity import identity, one_unit
from sandbox.errors import RangeError, ShapeError
from sandbox.method import Draw, Method
from sandbox.parameters import extended, number
from sandbox.problem import VelocityProblem
from sandbox.tolerances import SHRUNK

Array = np.ndarray


def cast(
    robot: Robot, q: Array, xdot: Array, *, alpha: float = 0.5, posture: Array | None = None, rate_limits: Any = None
) -> VelocityProblem:
    """W = I, a = alpha grad f, f = 1/2 |q - posture|^2, as of gradient_projection.

    alpha [1/s] is lowered, configuration by configuration, where the self-motion alone would exceed a limit.
    rate_limits : (n,) [rad/s, m/s], those of the robot if left out

    Raises RangeError for a limit that is not positive.
    """
    limits = positive_limits(robot, rate_limits)
    one_unit(robot, "use gradient_projection with scales")
    f = posture_measure(np.zeros(robot.n) if posture is None else posture)
    J = robot.jacobian(q)
    a = number(alpha, "alpha") * f.gradient(robot, q)
    N = decompose(robot, J).N
    own = np.einsum("...nk,...k->...n", N, np.einsum("...nk,...n->...k", N, a))
    over = (np.abs(own) / limits).max(axis=-1, keepdims=True)
    return VelocityProblem(J=J, xdot=xdot, W=identity(robot, q), a=a * np.minimum(1.0, SHRUNK / np.maximum(over, SHRUNK)))


def positive_limits(robot: Robot, rate_limits: Any) -> Array:
    """Rate limits (n,), inf where there is none.

    Raises RangeError naming the joint whose limit is not positive.
    """
    limits = robot.rate_limits if rate_limits is None else extended(rate_limits, "rate_limits")
    if limits.shape != (robot.n,):
        raise ShapeError(f"rate_limits has shape {limits.shape}; it must be (n,) = ({robot.n},)", field="rate_limits")
    if not (limits > 0).all():
        joint = int(np.flatnonzero(~(limits > 0))[0]) + 1
        value = float(limits[joint - 1])
        raise RangeError(f"the rate limit of joint {joint} is {value:g}; limits must be positive", joint=joint, value=value)
    return limits


def draw(robot: Robot, rng: np.random.Generator, count: int) -> Draw:
    """Generic configurations; the limits bind in many of them."""
    q, xdot, _ = generic(robot, rng, count)
    return Draw(q, xdot, {"alpha": 0.5, "posture": np.zeros(robot.n), "rate_limits": rng.uniform(0.25, 1.0, robot.n)})


METHOD = Method(
    id="C3",
    name="time_scaling",
    title="Time scaling",
    formula="qdot = s J^+ xdot - alpha (I - J^+J) grad f, s the largest in [0, 1] within the rate limits",
    weight="I",
    vector="alpha grad f",
    condition="always",
    number="",
    certainty="likely",
    works=("J. M. Hollerbach, Dynamic scaling of manipulator trajectories, ASME J. Dynamic Systems 106, 1984",),
    cast=cast,
    original=time_scaling.original,
    draw=draw,
    form="time_scaling",
    task=None,
    refuses=("a rate limit that is not positive", "J of lower rank"),
)
