"""M15: minimum elastic energy of the joints."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from problems.methods.draw import generic, scattered
from problems.original import joint_stiffness
from problems.robots.robot import Robot
from problems.weightings.stiffness import ComplianceAsPrinted, JointCompliance, JointStiffness
from problems.weightings.stiffness import stiffness as weighting
from sandbox.errors import RangeError
from sandbox.method import Draw, Method
from sandbox.parameters import unused
from sandbox.problem import VelocityProblem

Array = np.ndarray


def cast(
    robot: Robot, q: Array, xdot: Array, *, stiffness: Any = None, compliance: Any = None, compliance_as_printed: Any = None,
    unit: str | None = None,
) -> VelocityProblem:  # fmt: skip
    """W = K of `stiffness` [Nm/rad], or C^-1 of `compliance` [rad/Nm], or C itself, literally, of `compliance_as_printed`.

    Each (n,), (n, n) or (B, n, n), positive definite, and at most one of them; K = diag(n, ..., 2, 1) if none is given.
    unit : of what is given, SI of the robot's joints if left out. a = 0.
    """
    kinds: tuple[Callable[..., JointStiffness | JointCompliance], ...] = (JointStiffness, JointCompliance, ComplianceAsPrinted)
    given = (stiffness, compliance, compliance_as_printed)
    chosen = [kind(matrix, unit) for kind, matrix in zip(kinds, given, strict=True) if matrix is not None]
    if len(chosen) > 1:
        raise RangeError("give one of stiffness, compliance and compliance_as_printed: they are different weights of one arm")
    if not chosen:
        unused("the stiffness that stands where none is given", unit=unit)
    return VelocityProblem(J=robot.jacobian(q), xdot=xdot, W=weighting(robot, q, *chosen))


def draw(robot: Robot, rng: np.random.Generator, count: int) -> Draw:
    """Generic configurations, one full stiffness for all."""
    drawn = generic(robot, rng, count)
    return Draw(drawn.q, drawn.xdot, {"stiffness": scattered(rng, robot.n)})


METHOD = Method(
    id="M15",
    name="joint_stiffness",
    title="Joint stiffness, minimum elastic energy",
    formula="qdot = C J' (J C J')^-1 xdot, C = K^-1",
    weight="K, or C^-1",
    vector="0",
    condition="always",
    number="[22]",
    certainty="guess",
    works=("J. K. Salisbury, Active stiffness control of a manipulator in Cartesian coordinates, CDC 1980",),
    cast=cast,
    original=joint_stiffness.original,
    draw=draw,
    inverts_weight=True,
    refuses=("a matrix unlabelled as stiffness or compliance", "K or C that is not positive definite", "a wrong unit"),
)
