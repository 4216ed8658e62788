"""M17: minimum kinetic energy of virtual loads."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from problems.methods.draw import generic
from problems.original import virtual_load
from problems.robots.robot import Robot
from problems.weightings.virtual_load import VirtualBody
from problems.weightings.virtual_load import virtual_load as weighting
from sandbox.method import Draw, Method
from sandbox.problem import VelocityProblem

Array = np.ndarray


def cast(robot: Robot, q: Array, xdot: Array, *, bodies: Sequence[Any] | None = None) -> VelocityProblem:
    """W = K_p = sum_b J_b' M_b J_b, a = 0.

    bodies : (joint 1..n, mass [kg], centre (3,) [m], inertia (3, 3) about it [kg m^2]), in joint axes; if left out a
        solid ball of 1 kg and 0.25 m radius at every joint
    """
    return VelocityProblem(J=robot.jacobian(q), xdot=xdot, W=weighting(robot, q, bodies))


def draw(robot: Robot, rng: np.random.Generator, count: int) -> Draw:
    """Generic configurations, one set of random boxes for all, a box on each link."""
    drawn = generic(robot, rng, count)
    bodies = []
    for joint in robot.joints:
        mass, x = rng.uniform(0.5, 2.0), rng.uniform(0.1, 0.4, 3)
        turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
        about_centre = turn @ np.diag(mass / 12 * (x @ x - x**2)) @ turn.T  # box with edges x
        bodies.append(VirtualBody(joint, mass, rng.uniform(-0.2, 0.2, 3), (about_centre + about_centre.T) / 2))
    return Draw(drawn.q, drawn.xdot, {"bodies": tuple(bodies)})


METHOD = Method(
    id="M17",
    name="virtual_load",
    title="Kinetic energy of virtual loads",
    formula="qdot minimises 1/2 qdot' K_p qdot = sum of the loads' kinetic energies, subject to J qdot = xdot",
    weight="K_p = sum J_b' M_b J_b",
    vector="0",
    condition="where some load moves with every self-motion; fails for a load on the hand whose motion the task fixes",
    number="[25]",
    certainty="not identified",
    works=("not identified; the kinetic energy of rigid bodies carried by the links, methods M17",),
    cast=cast,
    original=virtual_load.original,
    draw=draw,
    refuses=(
        "a negative mass", "an inertia that is not positive semidefinite or breaks the triangle inequality",
        "loads that some self-motion leaves at rest (condition (7), by the closed form)",
    ),
)  # fmt: skip
