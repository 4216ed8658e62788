"""M8: Maciejewski and Klein's obstacle avoidance by a second task."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from problems.measures.obstacle import Point
from problems.methods.draw import HEALTHY, generic
from problems.methods.obstacle_potential import CLEAR, halfway
from problems.original import two_task_obstacle
from problems.robots.robot import Robot
from problems.weightings.augmented import redundancy
from problems.weightings.two_task import escape_rows, two_task
from sandbox import check
from sandbox.method import Draw, Method
from sandbox.parameters import within
from sandbox.problem import VelocityProblem

Array = np.ndarray

ESCAPE = 0.25
"""Default escape rate [m/s]."""


def cast(
    robot: Robot, q: Array, xdot: Array, *, obstacle: Any = None, points: Sequence[Any] | None = None, escape: Any = ESCAPE,
    Qd: Any = None, eps: float = 0.0,
) -> VelocityProblem:  # fmt: skip
    """W = Jd'Qd Jd + eps I, a = -Jd'Qd dd; row i of Jd is u_i'Jc_i, u_i the unit vector from the obstacle to point i.

    obstacle : (3,) or (B, 3) [m], base axes; half way to the hand in a bent posture if left out
    points : p pairs (joint 1..n, (x, y, z) [m] in its axes); if left out the n - m joints in the middle of the arm
    escape : dd, one number, (p,) or (B, p) [m/s], how fast each distance is to grow
    Qd : (p,) or (p, p), matters where p > n - m; eps : unit of Jd'Qd Jd, needed where rank(Jd N) < n - m
    """
    obstacle = halfway(robot) if obstacle is None else obstacle
    Jd = escape_rows(robot, q, obstacle, middle(robot) if points is None else points)
    W = two_task(robot, q, Jd, Qd, eps=eps)
    escape = check.real(escape, "escape")
    within(Jd.shape[:-1], escape.shape, "escape")
    dd = np.broadcast_to(escape, Jd.shape[:-1])
    a = -np.einsum("...pn,...p->...n", Jd, dd if W.gamma is None else np.einsum("...pr,...r->...p", W.gamma, dd))
    return VelocityProblem(J=robot.jacobian(q), xdot=xdot, W=W, a=a)


def middle(robot: Robot) -> tuple[Point, ...]:
    """Where the n - m joints in the middle of the arm stand: self-motion moves them most.

    Raises NotRedundantError where there is no self-motion.
    """
    first = robot.m // 2 + 1
    return tuple((joint, (0.0, 0.0, 0.0)) for joint in range(first, first + redundancy(robot)))


def draw(robot: Robot, rng: np.random.Generator, count: int) -> Draw:
    """Configurations clear of the obstacle in which self-motion changes every distance; escape rates of their own."""
    obstacle, points = halfway(robot), middle(robot)

    def free(q: Array) -> Array:
        away = np.stack([robot.point(q, joint) - obstacle for joint, _ in points], axis=1)
        clear = (np.linalg.norm(away, axis=-1) > CLEAR).all(axis=-1)
        Jd = np.zeros((len(q), robot.k, robot.n))
        if clear.any():
            Jd[clear] = escape_rows(robot, q[clear], obstacle, points)
        V = np.linalg.svd(robot.jacobian(q))[2][:, robot.m :, :]
        sigma = np.linalg.svd(Jd @ np.swapaxes(V, 1, 2), compute_uv=False)
        return clear & (sigma[:, -1] > HEALTHY * np.linalg.norm(Jd, axis=(1, 2)))

    drawn = generic(robot, rng, count, free)
    return Draw(drawn.q, drawn.xdot, {"escape": rng.uniform(0.0, 1.0, (count, robot.k))})


METHOD = Method(
    id="M8",
    name="two_task_obstacle",
    title="Obstacle avoidance, second task",
    formula="qdot = J^+ xdot + [Jd (I - J^+J)]^+ (dd - Jd J^+ xdot)",
    weight="Jd'Qd Jd (+ eps I)",
    vector="-Jd'Qd dd",
    condition="rank(Jd N) = n - m, or eps > 0",
    number="[12]",
    certainty="very likely",
    works=(
        "A. A. Maciejewski, C. A. Klein, Obstacle avoidance for kinematically redundant manipulators in dynamically varying "
        "environments, IJRR 4(3), 1985, doi 10.1177/027836498500400308",
    ),
    cast=cast,
    original=two_task_obstacle.original,
    draw=draw,
    still={"escape": 0.0},
    refuses=(
        "rank(Jd N) < n - m with eps <= 0", "contact: a distance of zero", "a point that is not on the arm",
        "Qd that is not positive definite",
    ),
)  # fmt: skip
