"""M19: augmented or extended Jacobian with a positive definite base: the secondary task is damped, the task is not."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.methods.augmented_jacobian import rows
from problems.methods.draw import generic
from problems.original import damped_secondary
from problems.robots.robot import Robot
from problems.weightings.augmented import augmented, secondary_rate
from problems.weightings.damped import damped
from problems.weightings.extended import extremum
from problems.weightings.impedance import elastic
from sandbox.errors import UnknownNameError
from sandbox.method import Draw, Method
from sandbox.problem import VelocityProblem

Array = np.ndarray

SECONDARY = ("augmented", "extended")


def cast(
    robot: Robot, q: Array, xdot: Array, *, secondary: str = "augmented", base: Any = 0.01,
    E: Array | None = None, gbar: Array | None = None, gamma: Array | None = None,
    stiffness: Any = 1.0, rest: Array | None = None,
) -> VelocityProblem:  # fmt: skip
    """W = W~ + E' Gamma E and a = -E' Gamma gbar, or W~ + H'H and a = 0.

    secondary : "augmented", with E (any number of rows), gbar and gamma as of augmented_jacobian; or "extended", with the
        stiffness and rest of extended_jacobian, on or off the manifold
    base : W~, a number, (n,) or (n, n), positive definite, small beside the rest [unit of W]
    """
    if secondary not in SECONDARY:
        raise UnknownNameError.of("secondary task", secondary, SECONDARY)
    if secondary == "augmented":
        gradients = rows(robot, q, E)
        W, a = augmented(gradients, gamma), secondary_rate(gradients, gbar, gamma)
        return VelocityProblem(J=robot.jacobian(q), xdot=xdot, W=damped(W, base), a=a)
    condition = extremum(robot, q, elastic(robot, stiffness, rest))
    return VelocityProblem(J=condition.J, xdot=xdot, W=damped(augmented(condition.H), base))


def draw(robot: Robot, rng: np.random.Generator, count: int) -> Draw:
    """Configurations with J of full rank, algorithmic singularities among them, with rates asked of the functions."""
    q, xdot, _ = generic(robot, rng, count)
    gbar = rng.uniform(-1.0, 1.0, (count, robot.k))
    return Draw(q, xdot, {"base": rng.uniform(0.005, 0.05, robot.n), "gbar": gbar, "gamma": rng.uniform(0.5, 2.0, robot.k)})


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
