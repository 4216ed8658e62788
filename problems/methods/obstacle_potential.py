"""M7: obstacle avoidance by a repulsive potential."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from problems.measures.obstacle import STIFFNESS, critical_points, distances, nearest, obstacle_potential
from problems.methods.draw import STATIONARY, centre, generic, moving
from problems.methods.gradient_projection import descending
from problems.original import obstacle_potential as witness
from problems.robots.robot import Robot
from sandbox.method import Draw, Method
from sandbox.problem import VelocityProblem

Array = np.ndarray

REACH = 0.5
"""d0 [m]."""

CLEAR = 0.05
"""Situations are drawn with every critical point at least this far from the obstacle [m]."""


def cast(
    robot: Robot, q: Array, xdot: Array, *, alpha: float = 0.01, obstacle: Any = None, reach: float = REACH,
    stiffness: float = STIFFNESS, points: Sequence[Any] | None = None, scales: Any = None,
) -> VelocityProblem:  # fmt: skip
    """W = I, a = alpha grad f, f = 1/2 k (d0 - d)^2 where d < d0, else 0; alpha [rad^2/(s J)].

    obstacle : (3,) or (B, 3) [m], base axes; half way to the hand in a bent posture if left out
    reach, stiffness : d0 [m], k [N/m]; scales : as for gradient_projection
    points : critical points, pairs (joint 1..n, (x, y, z) [m] in its axes); the inner ends of the links if left out
    """
    obstacle = halfway(robot) if obstacle is None else obstacle
    f = obstacle_potential(robot, obstacle=obstacle, reach=reach, stiffness=stiffness, points=points)
    return descending(robot, q, xdot, alpha, f.gradient(robot, q), scales)


def halfway(robot: Robot) -> Array:
    """An obstacle (3,) [m] half way from the base to where the hand is in a bent posture."""
    q, half = centre(robot)
    return robot.forward(q + half / 4)[0] / 2


def draw(robot: Robot, rng: np.random.Generator, count: int) -> Draw:
    """Configurations that feel the obstacle, one critical point clearly nearest, off the stationary points of f."""
    obstacle, points = halfway(robot), critical_points(robot)
    f = obstacle_potential(robot, obstacle=obstacle, reach=REACH, points=points)

    def accept(q: Array) -> Array:
        least, (_, gap) = distances(robot, q, obstacle, points).min(axis=-1), nearest(robot, q, obstacle, points)
        felt = (least > CLEAR) & (least < (1 - STATIONARY) * REACH) & (gap > STATIONARY * REACH)
        return felt & moving(robot, q, f.gradient(robot, q))

    return generic(robot, rng, count, accept)


METHOD = Method(
    id="M7",
    name="obstacle_potential",
    title="Obstacle avoidance, potential",
    formula="qdot = J^+ xdot + alpha k (d0 - d) (I - J^+J) Jc'u, u from the obstacle to the critical point",
    weight="I",
    vector="alpha grad 1/2 k (d0 - d)^2, d < d0",
    condition="always",
    number="[12], [13]",
    certainty="plausible",
    works=(
        "A. A. Maciejewski, C. A. Klein, Obstacle avoidance for kinematically redundant manipulators in dynamically varying "
        "environments, IJRR 4(3), 1985, doi 10.1177/027836498500400308",
    ),
    cast=cast,
    original=witness.original,
    draw=draw,
    refuses=("contact: a distance of zero", "d0 <= 0 or k <= 0", "a critical point that is not on the arm"),
)
