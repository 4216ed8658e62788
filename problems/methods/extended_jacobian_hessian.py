"""M13: the extended Jacobian by the Hessian of its Lagrangian, W often indefinite."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.measures.measure import Measure
from problems.methods.draw import HEALTHY
from problems.methods.extended_jacobian import METHOD as EXTENDED_JACOBIAN
from problems.methods.extended_jacobian import situations
from problems.original import extended_jacobian_hessian
from problems.robots.robot import Robot
from problems.weightings.extended import Extremum, extremum
from problems.weightings.hessian import hessian
from problems.weightings.impedance import elastic
from sandbox.method import Draw, Method
from sandbox.problem import VelocityProblem
from sandbox.tolerances import EXTREMAL

Array = np.ndarray


def cast(
    robot: Robot, q: Array, xdot: Array, *,
    stiffness: Any = 1.0, rest: Array | None = None, maximum: bool = False, tolerance: float = EXTREMAL,
) -> VelocityProblem:  # fmt: skip
    """W = Hess L (or -Hess L to follow a maximum), a = 0; g, stiffness, rest and tolerance as of extended_jacobian."""
    g = elastic(robot, stiffness, rest)
    return cast_function(robot, q, xdot, function=g, maximum=maximum, tolerance=tolerance)


def cast_function(
    robot: Robot, q: Array, xdot: Array, *, function: Measure, maximum: bool = False, tolerance: float = EXTREMAL
) -> VelocityProblem:
    """The same for any measure g with a Hessian."""
    condition = extremum(robot, q, function).on_manifold(tolerance)
    return VelocityProblem(J=condition.J, xdot=xdot, W=hessian(condition, maximum=maximum))


def stable(condition: Extremum) -> Array:
    """Where the extremum is a clear minimum on the self-motion (B,), and W is symmetric."""
    W, N = hessian(condition).dense(), condition.N
    return np.linalg.eigvalsh(np.swapaxes(N, 1, 2) @ W @ N)[:, 0] > HEALTHY * np.linalg.norm(W, 2, axis=(1, 2))


def draw(robot: Robot, rng: np.random.Generator, count: int) -> Draw:
    """Minima on the self-motion, W positive definite or not."""
    return situations(robot, rng, count, stable)


METHOD = Method(
    id="M13",
    name="extended_jacobian_hessian",
    title="Extended Jacobian, Hessian form",
    formula="[Hess L, -J'; J, 0] (qdot, lamdot) = (0, xdot), L = g - lam'(x(q) - x)",
    weight="Hess g - sum_k lam_k Hess x_k",
    vector="0",
    condition="q a strict minimum of g on its self-motion",
    number="[20], [21]",
    certainty="very likely",
    works=EXTENDED_JACOBIAN.works,
    cast=cast,
    original=extended_jacobian_hessian.original,
    draw=draw,
    still={"tolerance": np.inf},
    refuses=(
        "a start off the extremal manifold",
        "a task that fixes a part of the angular velocity only",
        "maxima and saddles on the self-motion (condition 7); maxima are followed with maximum=True",
        "g without a Hessian",
        "J of lower rank",
    ),
)
