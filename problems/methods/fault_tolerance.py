"""M9: tolerance of locked joints, by the gradient of what a failure leaves of J."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from problems.measures.fault_tolerance import (
    Redundancy,
    failure_sets,
    fault_tolerance,
    kfm,
    least_relative_manipulability,
    reduced_singular_values,
)
from problems.methods.draw import STATIONARY, generic, moving
from problems.methods.gradient_projection import descending
from problems.original import fault_tolerance as witness
from problems.robots.robot import Robot
from sandbox.method import Draw, Method
from sandbox.parameters import chosen
from sandbox.problem import VelocityProblem

Array = np.ndarray

CHOICES = {"fault_tolerance": fault_tolerance, "kfm": kfm, "least_relative_manipulability": least_relative_manipulability}

TOLERANT = 0.05
"""Situations are drawn with at least this relative manipulability left by every failure."""


def cast(
    robot: Robot, q: Array, xdot: Array, *, alpha: float = 0.1, measure: str = "fault_tolerance", failures: int = 1,
    joints: Sequence[int] | None = None, scales: Any = None,
) -> VelocityProblem:  # fmt: skip
    """W = I, a = alpha grad f, f = -sum ln rho_S, or -kfm, or -min rho_S; alpha [rad^2/(s unit of f)].

    failures : how many joints lock at once; joints : those that may (1..n), all if left out
    scales : as for gradient_projection
    """
    f = CHOICES[chosen("measure of fault tolerance", measure, CHOICES)](robot, failures=failures, joints=joints)
    return descending(robot, q, xdot, alpha, f.gradient(robot, q), scales, up=measure != "fault_tolerance")


def draw(robot: Robot, rng: np.random.Generator, count: int, *, measure: str = "fault_tolerance", failures: int = 1) -> Draw:
    """Configurations that tolerate every failure, off ties and the stationary points of f.

    Joints that self-motion never moves are left out of `joints`: without them the task is lost wherever the arm stands.
    """
    trial = generic(robot, rng, 10).q
    single = Redundancy.of(robot, trial).relative(tuple((i,) for i in range(robot.n)))
    joints = [int(i) + 1 for i in np.flatnonzero(single.max(axis=0) > TOLERANT)]
    sets = failure_sets(robot, failures, joints)
    f = CHOICES[measure](robot, failures=failures, joints=joints)

    def accept(q: Array) -> Array:
        J = robot.jacobian(q)
        rho = Redundancy.of(robot, q).relative(sets)
        accepted = rho.min(axis=-1) > TOLERANT
        if measure != "fault_tolerance" and len(sets) > 1:
            members = np.sort(reduced_singular_values(J, sets) if measure == "kfm" else rho, axis=-1)
            accepted &= members[:, 1] - members[:, 0] > STATIONARY * members[:, 0]
        found = np.flatnonzero(accepted)
        if len(found):
            accepted[found] = moving(robot, q[found], f.gradient(robot, q[found]))
        return accepted

    return generic(robot, rng, count, accept)._replace(parameters={"measure": measure, "failures": failures, "joints": joints})


METHOD = Method(
    id="M9",
    name="fault_tolerance",
    title="Kinematic fault tolerance",
    formula="qdot = J^+ xdot - alpha (I - J^+J) grad f, f = -sum ln rho_i, rho_i = w(J without column i)/w(J)",
    weight="I",
    vector="-alpha grad of sum ln rho_S, of min rho_S, or of kfm",
    condition="always",
    number="[14], [15]",
    certainty="plausible",
    works=(
        "A. A. Maciejewski, Fault tolerant properties of kinematically redundant manipulators, ICRA 1990, 638-642",
        "R. G. Roberts, A. A. Maciejewski, A local measure of fault tolerance for kinematically redundant manipulators, "
        "IEEE Trans. R&A 12(4), 1996, 543-552",
    ),
    cast=cast,
    original=witness.original,
    draw=draw,
    refuses=(
        "more failures than degrees of redundancy", "a joint that self-motion does not move (rho = 0)",
        "J without full row rank", "a smallest singular value that is not simple (kfm)",
    ),
)  # fmt: skip
