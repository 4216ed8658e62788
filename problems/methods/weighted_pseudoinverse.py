"""M2: Whitney's weighted pseudoinverse."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.methods.draw import generic, scattered
from problems.original import weighted_pseudoinverse
from problems.robots.robot import Robot
from problems.weightings.whitney import whitney
from sandbox.method import Draw, Method
from sandbox.problem import VelocityProblem

Array = np.ndarray


def cast(robot: Robot, q: Array, xdot: Array, *, weight: Any = None) -> VelocityProblem:
    """W = weight, (n,), (n, n) or (B, n, n), positive definite; diag(n, ..., 2, 1) if left out. a = 0."""
    return VelocityProblem(J=robot.jacobian(q), xdot=xdot, W=whitney(robot, q, weight))


def draw(robot: Robot, rng: np.random.Generator, count: int) -> Draw:
    """Generic configurations, each with a full weight of its own."""
    drawn = generic(robot, rng, count)
    return Draw(drawn.q, drawn.xdot, {"weight": scattered(rng, robot.n, count)})


METHOD = Method(
    id="M2",
    name="weighted_pseudoinverse",
    title="Whitney weighted pseudoinverse",
    formula="qdot = W^-1 J' (J W^-1 J')^-1 xdot",
    weight="any symmetric positive definite W",
    vector="0",
    condition="always",
    number="[6], [7]",
    certainty="likely",
    works=(
        "D. E. Whitney, Resolved motion rate control of manipulators and human prostheses, "
        "IEEE Trans. Man-Machine Systems 10(2), 1969",
        "K. L. Doty, C. Melchiorri, C. Bonivento, A theory of generalized inverses applied to robotics, IJRR 12(1), 1993",
    ),
    cast=cast,
    original=weighted_pseudoinverse.original,
    draw=draw,
    inverts_weight=True,
    refuses=("a weight that is not positive definite, even where eq. (6) accepts it", "mixed joints without a weight"),
)
