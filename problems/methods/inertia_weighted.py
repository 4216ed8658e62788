"""M16: minimum kinetic energy, W = M(q)."""

from __future__ import annotations

import numpy as np

from problems.methods.draw import generic
from problems.original import inertia_weighted
from problems.robots.robot import Robot
from problems.weightings.inertia import inertia
from sandbox.method import Draw, Method
from sandbox.problem import VelocityProblem

Array = np.ndarray


def cast(robot: Robot, q: Array, xdot: Array) -> VelocityProblem:
    """W = M(q) [kg m^2, kg m, kg], a = 0."""
    return VelocityProblem(J=robot.jacobian(q), xdot=xdot, W=inertia(robot, q))


def draw(robot: Robot, rng: np.random.Generator, count: int) -> Draw:
    """Generic configurations."""
    return generic(robot, rng, count)


METHOD = Method(
    id="M16",
    name="inertia_weighted",
    title="Inertia-weighted (Khatib's dynamically consistent inverse)",
    formula="qdot = Jbar xdot, Jbar = M^-1 J' Lambda, Lambda = (J M^-1 J')^-1",
    weight="M(q)",
    vector="0",
    condition="always",
    number="[6], [23], [24]",
    certainty="plausible",
    works=(
        "O. Khatib, A unified approach for motion and force control of robot manipulators: the operational space formulation, "
        "IEEE J. R&A 3(1), 1987",
        "O. Khatib, Inertial properties in robotic manipulation: an object-level framework, IJRR 14(1), 1995",
        "M. Vukobratovic, M. Kircanski, IEEE Trans. SMC 14(4), 1984",
    ),
    cast=cast,
    original=inertia_weighted.original,
    draw=draw,
    inverts_weight=True,
    refuses=("a mass matrix that is not positive definite (a joint that moves no mass), or not symmetric",),
)
