"""M11: the augmented Jacobian, eqs. (8)-(10)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from problems.measures.measure import Measure
from problems.methods.draw import HEALTHY, generic
from problems.original import augmented_jacobian
from problems.robots.robot import Robot
from problems.weightings.augmented import augmented, check_rows, clear, closed_loop, redundancy, secondary_rate
from problems.weightings.identity import MixedUnitsError
from sandbox import check
from sandbox.errors import ShapeError
from sandbox.method import Draw, Method
from sandbox.parameters import within
from sandbox.problem import VelocityProblem

Array = np.ndarray


def cast(
    robot: Robot, q: Array, xdot: Array, *, E: Array | None = None, gbar: Array | None = None, gamma: Array | None = None
) -> VelocityProblem:
    """W = E' Gamma E, a = -E' Gamma gbar.

    E : (k, n) or (B, k, n), gradients of k = n - m secondary functions g; joints 1..k-1 and the sum of all if left out
    gbar : (k,) or (B, k), the rates asked of g [g_i/s]; zero if left out
    gamma : (k,) positive, gamma_i [g_i]^2 of a common unit; without effect on the motion
    """
    return posed(robot, q, xdot, rows(robot, q, E), gbar, gamma)


def cast_functions(
    robot: Robot, q: Array, xdot: Array, *,
    functions: Sequence[Measure], desired: Any = None, gain: Any = 0.0, desired_rate: Any = 0.0, gamma: Array | None = None,
) -> VelocityProblem:  # fmt: skip
    """The same for measures g: gbar = desired_rate + gain (desired - g), a number that is not differentiated.

    functions : k measures; desired (k,) [g_i], g itself if left out; gain (k,) or a number [1/s]; desired_rate (k,) [g_i/s]
    """
    if not len(functions):
        raise ShapeError("functions is empty; give one measure per degree of redundancy", field="functions")
    g = np.stack([function.value(robot, q) for function in functions], axis=-1)
    E = np.stack([function.gradient(robot, q) for function in functions], axis=-2)
    gbar = closed_loop(g, g if desired is None else desired, gain, desired_rate)
    return posed(robot, q, xdot, E, gbar, gamma)


def posed(robot: Robot, q: Array, xdot: Array, E: Array, gbar: Array | None, gamma: Array | None) -> VelocityProblem:
    """The problem of secondary rows E (B, p, n), refused where they do not fix the self-motion."""
    check_rows(robot, q, E)
    return VelocityProblem(J=robot.jacobian(q), xdot=xdot, W=augmented(E, gamma), a=secondary_rate(E, gbar, gamma))


def rows(robot: Robot, q: Array, E: Array | None) -> Array:
    """E (B, k, n) as given, or the gradients of q_1, ..., q_(k-1) and q_1 + ... + q_n.

    Raises MixedUnitsError where that sum has no unit, NotRedundantError where there is nothing to fix.
    """
    if E is None:
        if robot.prismatic.any() and not robot.prismatic.all():
            raise MixedUnitsError(
                f"{robot.name} mixes revolute and prismatic joints: their sum has no unit; give E", robot=robot.name
            )
        E = np.eye(robot.n)[: redundancy(robot)]
        E[-1:] = 1.0
    E = check.matrices(E, "E")
    check.shape(E, ("k", "n"), {"n": robot.n}, "E")
    within(np.shape(q)[:-1], E.shape[:-2], "E")
    return np.broadcast_to(E, (*np.shape(q)[:-1], *E.shape[-2:]))


def draw(robot: Robot, rng: np.random.Generator, count: int) -> Draw:
    """Configurations off the algorithmic singularities of the default functions, with rates asked of them."""
    q, xdot, _ = generic(robot, rng, count, lambda q: clear(robot, q, rows(robot, q, None))[0] > HEALTHY)
    return Draw(q, xdot, {"gbar": rng.uniform(-1.0, 1.0, (count, robot.k)), "gamma": rng.uniform(0.1, 10.0, robot.k)})


METHOD = Method(
    id="M11",
    name="augmented_jacobian",
    title="Augmented Jacobian",
    formula="[J; E] qdot = [xdot; gbar], E the gradients of n - m secondary functions",
    weight="E' Gamma E",
    vector="-E' Gamma gbar",
    condition="[J; E] nonsingular",
    number="[17], [18]",
    certainty="likely",
    works=(
        "O. Egeland, Task-space tracking with redundant manipulators, IEEE J. Robotics and Automation 3(5), 1987",
        "H. Seraji, Configuration control of redundant manipulators: theory and implementation, "
        "IEEE Trans. Robotics and Automation 5(4), 1989",
        "L. Sciavicco, B. Siciliano, A solution algorithm to the inverse kinematic problem for redundant manipulators, "
        "IEEE J. Robotics and Automation 4(4), 1988, doi 10.1109/56.804",
    ),
    cast=cast,
    original=augmented_jacobian.original,
    draw=draw,
    still={"gbar": None},
    refuses=(
        "fewer secondary functions than degrees of redundancy (more: a warning, least squares)",
        "a gamma that is not positive",
        "an algorithmic singularity, N'E' singular",
        "J of lower rank",
    ),
)
