"""Section V's random configurations and unit velocities, on several arms under several weights."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from problems import robots
from problems.robots.robot import Robot
from sandbox.claims.arms import ARMS
from sandbox.problem import VelocityProblem
from sandbox.stacked import symmetric, transpose

Array = np.ndarray
Generator = np.random.Generator

NAMES = ("planar_3r", "panda", "seven_joint")
"""The arms, the paper's own first."""

WEIGHTS = {"identity": "W = I", "random": "random W", "inertia": "W = M"}
"""What a weight is called."""

DECADES = 3.0
"""The eigenvalues of a random weight lie within so many decades."""


@dataclass(frozen=True, eq=False)
class Situation:
    """Configurations q (B, n) [rad] of one arm and task velocities of unit length, under one kind of weight; a = 0."""

    arm: str
    weight: str
    q: Array
    problem: VelocityProblem

    @property
    def words(self) -> str:
        """The arm and its weight."""
        return f"{ARMS[self.arm]}, {WEIGHTS[self.weight]}"


def situations(rng: Generator, count: int) -> list[Situation]:
    """Every arm with W = I, a random W > 0 and its inertia matrix, at the same `count` configurations.

    q uniform within the joint limits (at most a turn), xdot uniform on the unit sphere of R^m (section V).
    """
    found = []
    for arm in NAMES:
        robot = robots.load(arm)
        q = rng.uniform(np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi), (count, robot.n))
        xdot = rng.standard_normal((count, robot.m))
        xdot = xdot / np.linalg.norm(xdot, axis=1, keepdims=True)
        J = robot.jacobian(q)
        for weight, W in weights(robot, q, rng).items():
            found.append(Situation(arm, weight, q, VelocityProblem(J=J, xdot=xdot, W=W, a=np.zeros_like(q))))
    return found


def weights(robot: Robot, q: Array, rng: Generator) -> dict[str, Array]:
    """W (B, n, n) by name; random: Q diag(w) Q', Q orthogonal, log w uniform over DECADES."""
    shape = (*q.shape, robot.n)
    Q = np.linalg.qr(rng.standard_normal(shape))[0]
    w = 10.0 ** rng.uniform(-DECADES / 2, DECADES / 2, q.shape)
    return {
        "identity": np.broadcast_to(np.eye(robot.n), shape),
        "random": symmetric((Q * w[:, None, :]) @ transpose(Q)),
        "inertia": robot.inertia(q),
    }
