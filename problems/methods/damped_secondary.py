"""M19: augmented or extended Jacobian with a positive definite base: the secondary task is damped, the task is not."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.methods.augmented_jacobian import rows
from problems.methods.draw import generic
from problems.original import damped_secondary
from problems.robots.robot import Robot
from problems.weightings.augmented import augmented, redundancy, secondary_rate
from problems.weightings.damped import damped
from problems.weightings.extended import extremum
from problems.weightings.identity import one_unit
from problems.weightings.impedance import elastic
from sandbox.method import Draw, Method
from sandbox.parameters import chosen, scalar, unused, within
from sandbox.problem import VelocityProblem

Array = np.ndarray

SECONDARY = ("augmented", "extended")


def cast(
    robot: Robot, q: Array, xdot: Array, *, secondary: str = "augmented", base: Any = 0.01,
    E: Array | None = None, gbar: Array | None = None, gamma: Array | None = None,
    stiffness: Any = None, rest: Array | None = None,
) -> VelocityProblem:  # fmt: skip
    """W = W~ + E' Gamma E and a = -E' Gamma gbar, or W~ + H'H and a = 0.

    secondary : "augmented", with E (any number of rows), gbar and gamma as of augmented_jacobian; or "extended", with the
        stiffness and rest of extended_jacobian, on or off the manifold
    base : W~, a number, (n,) or (n, n), positive definite, small beside the rest [unit of W]

    Raises RangeError for parameters of the other secondary task.
    """
    if scalar(base):
        one_unit(robot, "give base, its diagonal (n,) or all of it")
    if chosen("secondary task", secondary, SECONDARY) == "augmented":
        unused("the augmented Jacobian", stiffness=stiffness, rest=rest)
        gradients = rows(robot, q, E)
        W, a = augmented(gradients, gamma), secondary_rate(gradients, gbar, gamma)
        W = damped(W, base)
        within(gradients.shape[:-2], W.lead, "base")
        return VelocityProblem(J=robot.jacobian(q), xdot=xdot, W=W, a=a)
    unused("the extended Jacobian", E=E, gbar=gbar, gamma=gamma)
    condition = extremum(robot, q, elastic(robot, 1.0 if stiffness is None else stiffness, rest))
    W = damped(augmented(condition.H), base)
    within(condition.J.shape[:-2], W.lead, "base")
    return VelocityProblem(J=condition.J, xdot=xdot, W=W)


def draw(robot: Robot, rng: np.random.Generator, count: int) -> Draw:
    """Configurations with J of full rank, algorithmic singularities among them, with rates asked of the functions."""
    k = redundancy(robot)
    q, xdot, _ = generic(robot, rng, count)
    gbar = rng.uniform(-1.0, 1.0, (count, k))
    return Draw(q, xdot, {"base": rng.uniform(0.005, 0.05, robot.n), "gbar": gbar, "gamma": rng.uniform(0.5, 2.0, k)})


METHOD = Method(
    id="M19",
    name="damped_secondary",
    title="Damped augmented or extended Jacobian",
    formula="qdot = J^+ xdot + N y, y = (N'(W~ + E' Gamma E) N)^-1 (N'E' Gamma (gbar - E J^+ xdot) - N'W~ J^+ xdot)",
    weight="W~ + E' Gamma E, or W~ + H'H",
    vector="-E' Gamma gbar, or 0",
    condition="always",
    number="[27]",
    certainty="plausible",
    works=("H. Seraji, R. Colbaugh, Improved configuration control for redundant robots, J. Robotic Systems 7(6), 1990",),
    cast=cast,
    original=damped_secondary.original,
    draw=draw,
    still={"gbar": None},
    refuses=("a base W~ that is not symmetric positive definite", "a gamma that is not positive"),
)
