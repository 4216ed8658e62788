"""C2: the Jacobian transpose, with the best single step."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.methods.draw import generic
from problems.original import jacobian_transpose
from problems.robots.robot import Robot
from problems.weightings.definite import positive_definite
from problems.weightings.identity import identity
from sandbox.method import Draw, Method
from sandbox.parameters import single, vectors
from sandbox.problem import VelocityProblem

Array = np.ndarray


def cast(robot: Robot, q: Array, xdot: Array, *, gain: Any = 1.0) -> VelocityProblem:
    """J and K e, with e = `xdot` (B, m) the task error x_des - x; gain K [1/s] a number, (m,) or (m, m), positive definite."""
    K = positive_definite(gain, "gain", robot.m)
    error = np.einsum("...ij,...j->...i", single(K, "gain", robot.m), vectors(xdot, "xdot", robot.m, letter="m"))
    return VelocityProblem(J=robot.jacobian(q), xdot=error, W=identity(robot, q, np.ones(robot.n)))


def draw(robot: Robot, rng: np.random.Generator, count: int) -> Draw:
    """Generic configurations and errors."""
    q, error, _ = generic(robot, rng, count)
    return Draw(q, error, {"gain": rng.uniform(0.5, 2.0, robot.m)})


METHOD = Method(
    id="C2",
    name="jacobian_transpose",
    title="Jacobian transpose",
    formula="qdot = kappa J'K e, kappa = <K e, JJ'K e> / |JJ'K e|^2",
    weight="none",
    vector="none",
    condition="outside the framework; stalls where J'K e = 0",
    number="[4]",
    certainty="plausible",
    works=(
        "W. A. Wolovich, H. Elliott, A computational technique for inverse kinematics, IEEE CDC 1984",
        "H. Das, J.-J. E. Slotine, T. B. Sheridan, Inverse kinematic algorithms for redundant systems, IEEE ICRA 1988",
    ),
    cast=cast,
    original=jacobian_transpose.original,
    draw=draw,
    form="jacobian_transpose",
    task=None,
    refuses=("a gain that is not symmetric positive definite",),
)
