"""Ways through kinematic singularities, and what singular values say on them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from problems import robots
from problems.methods.least_squares_rank_deficient import singular
from problems.robots.robot import Robot
from sandbox.claims.claim import CodePath
from sandbox.closed_form.eq6 import eq6
from sandbox.errors import EmptyPlanError
from sandbox.problem import VelocityProblem

Array = np.ndarray

NAMES = ("planar_3r", "seven_joint", "panda")
"""The arms."""

SIX = CodePath("eq. (6) of the sandbox, column-pivoted LU", eq6)

SPEED = 0.25
"""Of the hand, in every direction of the task space [m/s; rad/s]: slow for a robot beside people."""

ALONG = 0.6
"""Share of a task velocity along the direction that is being lost; the rest is across it."""

CLOSE = 1e-2
"""Distance [rad] from a singularity below which the smallest singular value is proportional to it."""

ATTEMPTS = 50
"""Lines drawn before giving up: hardly one in ten only touches its singularity."""

TURN = 0.6
"""Direction of the stretched arm [rad] where rank tolerances are looked at: along an axis a row of J would vanish, and eq13,
which scales rows to one, would see no small singular value at all."""

BENT = (0.0, np.pi / 2, -np.pi / 2)
"""The planar 3R of the worked examples: J = [-1, -1, 0; 2, 1, 1]."""


class Approach(NamedTuple):
    """A straight line q0 + t direction through a singular configuration, and a task velocity with a part in the lost direction.

    q0, direction (n,) [rad]; lost (m,) the left singular vector at q0; xdot (m,) of length SPEED [m/s, rad/s]
    """

    robot: Robot
    q0: Array
    direction: Array
    lost: Array
    xdot: Array

    def q(self, t: Array) -> Array:
        """Configurations (T, n)."""
        return self.q0 + np.asarray(t)[:, None] * self.direction

    def problem(self, t: Array, W: Array | None = None, xdot: Array | None = None) -> VelocityProblem:
        """The task at every t; W is I and a zero if left out."""
        n = self.robot.n
        return VelocityProblem(
            J=self.robot.jacobian(self.q(t)), xdot=self.xdot if xdot is None else xdot, W=np.eye(n) if W is None else W
        )


def approach(robot: Robot, rng: np.random.Generator) -> Approach:
    """A random line through a random singular configuration, which it crosses: sigma_min falls in proportion to |t| there.

    Raises EmptyPlanError where hardly any line does.
    """
    for _ in range(ATTEMPTS):
        q0 = singular(robot, rng, 1)[0]
        lost = np.linalg.svd(robot.jacobian(q0))[0][:, -1]
        direction, across = rng.standard_normal(robot.n), rng.standard_normal(robot.m)
        across -= lost * (lost @ across)
        xdot = ALONG * lost + np.sqrt(1 - ALONG**2) * across / np.linalg.norm(across)
        one = Approach(robot, q0, direction / np.linalg.norm(direction), lost, SPEED * xdot)
        far, near = singular_values(robot.jacobian(one.q(np.array([CLOSE / 10, CLOSE / 100]))))[1][:, -1]
        if abs(np.log10(far / near) - 1) < CLOSE:
            return one
    raise EmptyPlanError(f"no line crosses a singularity of {robot.name}")


def stretching(turn: float = 0.0) -> Approach:
    """The planar 3R (turn + t, -t, -t): its hand moves straight out to the full stretch at t = 0 and straight back.

    The direction that is lost, and of the hand's path, is the radial one; the hand is 1 + 2 cos t from the base.
    """
    robot = robots.load("planar_3r")
    radial = np.array([np.cos(turn), np.sin(turn)])
    return Approach(robot, np.array([turn, 0.0, 0.0]), np.array([1.0, -1.0, -1.0]), radial, -SPEED * radial)


def singular_values(J: Array) -> tuple[Array, Array, Array]:
    """(u (B, m), sigma (B, m), v (B, n)): the singular vectors of the smallest singular value, and all values."""
    U, sigma, Vt = np.linalg.svd(J)
    return U[:, :, -1], sigma, Vt[:, sigma.shape[1] - 1]


def norms(x: Array) -> Array:
    """2-norm of every row."""
    return np.linalg.norm(x, axis=-1)
