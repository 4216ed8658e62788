"""C1: damped least squares; the task is not met exactly."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.methods.draw import centre, generic
from problems.methods.least_squares_rank_deficient import singular
from problems.original import damped_least_squares
from problems.robots.robot import Robot
from problems.weightings.definite import positive_definite
from problems.weightings.identity import one_unit
from sandbox import check
from sandbox.errors import RangeError
from sandbox.method import Draw, Method
from sandbox.parameters import number, scalar, within
from sandbox.problem import VelocityProblem
from sandbox.tolerances import DAMPING

Array = np.ndarray


def cast(
    robot: Robot, q: Array, xdot: Array, *,
    damping: float = DAMPING, weight: Any = 1.0, gradient: Array | None = None, task_weight: Any = 1.0,
) -> VelocityProblem:  # fmt: skip
    """Minimise |J qdot - xdot|^2_Wx + lambda^2 (qdot'W qdot + 2 a'qdot).

    damping : lambda > 0; weight : W, gradient : a, task_weight : Wx, numbers, diagonals or matrices, positive definite

    Raises RangeError for a lambda that is not positive: the self-motion would be left open.
    """
    damping = number(damping, "damping")
    if not damping > 0:
        raise RangeError(
            f"damping is {damping:g}; lambda must be positive: with none the self-motion is open, and J must keep its rank",
            field="damping", value=damping,
        )  # fmt: skip
    if scalar(weight):
        one_unit(robot, "give weight, its diagonal (n,) or all of it")
    W, Wx = positive_definite(weight, "weight", robot.n), positive_definite(task_weight, "task_weight", robot.m)
    J, a = robot.jacobian(q), np.zeros(robot.n) if gradient is None else check.real(gradient, "gradient")
    for name, lead in (("weight", W.shape[:-2]), ("task_weight", Wx.shape[:-2]), ("gradient", a.shape[:-1])):
        within(J.shape[:-2], lead, name)
    return VelocityProblem(J=J, xdot=xdot, W=W, a=a, Wx=Wx)


def nakamura_hanafusa(w: Any, threshold: float, largest: float) -> Array:
    """lambda^2 (...,) by manipulability w: largest (1 - w/threshold)^2 below the threshold, 0 above.

    One lambda for each configuration enters as weight = lambda^2/damping^2 W. Raises RangeError for a threshold or largest
    that is not positive. Source: Nakamura & Hanafusa 1986.
    """
    for name, value in (("threshold", threshold), ("largest", largest)):
        number(value, name, above=0)
    return largest * np.maximum(1 - np.asarray(w, dtype=float) / threshold, 0.0) ** 2


def draw(robot: Robot, rng: np.random.Generator, count: int) -> Draw:
    """Generic, nearly singular and singular configurations, a third each."""
    third = max(count // 3, 1)
    at = singular(robot, rng, third)
    spread = centre(robot)[1] * rng.uniform(-1.0, 1.0, (third, robot.n))
    near = at + 10.0 ** rng.uniform(-9.0, -1.0, (third, 1)) * spread
    q = np.concatenate([at, near, generic(robot, rng, count).q])[:count]
    parameters = {
        "damping": DAMPING, "weight": rng.uniform(0.5, 2.0, robot.n), "task_weight": rng.uniform(0.5, 2.0, robot.m),
        "gradient": rng.uniform(-1.0, 1.0, (count, robot.n)),
    }  # fmt: skip
    return Draw(q, rng.uniform(-1.0, 1.0, (count, robot.m)), parameters)


METHOD = Method(
    id="C1",
    name="damped_least_squares",
    title="Damped least squares",
    formula="qdot = J'(JJ' + lambda^2 I)^-1 xdot",
    weight="lambda^2 W, on the arm with slack joints [J I]",
    vector="lambda^2 a",
    condition="lambda^2 W + J'Wx J > 0",
    number="[2], [3]",
    certainty="likely",
    works=(
        "Y. Nakamura, H. Hanafusa, Inverse kinematic solutions with singularity robustness for robot manipulator control, "
        "ASME J. Dynamic Systems, Measurement, and Control 108(3), 1986, doi 10.1115/1.3143764",
        "C. W. Wampler, Manipulator inverse kinematic solutions based on vector formulations and damped least-squares methods, "
        "IEEE Trans. SMC 16(1), 1986, doi 10.1109/TSMC.1986.289285",
    ),
    cast=cast,
    original=damped_least_squares.original,
    draw=draw,
    form="damped_least_squares",
    task="damped",
    refuses=("a damping that is not positive", "W or Wx not symmetric positive definite"),
)
