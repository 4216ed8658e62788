"""M18: Mussa-Ivaldi and Hogan's modified pseudoinverse, W = C^-1 - Gamma."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.methods.extended_jacobian import situations
from problems.methods.extended_jacobian_hessian import stable
from problems.original import mussa_ivaldi_hogan
from problems.robots.robot import Robot
from problems.weightings.extended import Extremum
from problems.weightings.hessian import hessian
from problems.weightings.impedance import impedance
from sandbox.method import Draw, Method
from sandbox.problem import VelocityProblem
from sandbox.tolerances import EXTREMAL

Array = np.ndarray

WORST = 1e3
"""Largest condition number of W in drawn situations: the original inverts W, the framework does not."""


def cast(
    robot: Robot, q: Array, xdot: Array, *, compliance: Any = 1.0, rest: Array | None = None, tolerance: float = EXTREMAL
) -> VelocityProblem:
    """W = C^-1 - Gamma, a = 0, at an elastic equilibrium C^-1 (q - rest) = J'F.

    compliance : C, a number, (n,) or (n, n), positive definite [rad/Nm]; rest : (n,) or (B, n) [rad], zero if left out
    tolerance : share of the elastic torque that may be out of balance; inf along a path that started in balance
    """
    W = impedance(robot, q, compliance, rest, tolerance)
    return VelocityProblem(J=robot.jacobian(q), xdot=xdot, W=W)


def draw(robot: Robot, rng: np.random.Generator, count: int) -> Draw:
    """Stable equilibria; those with W nearly singular are left out, where the original has no digits."""
    return situations(robot, rng, count, lambda condition: stable(condition) & invertible(condition), name="compliance")


def invertible(condition: Extremum) -> Array:
    """Where W itself is far from singular (B,)."""
    return np.linalg.cond(hessian(condition).dense()) < WORST


METHOD = Method(
    id="M18",
    name="mussa_ivaldi_hogan",
    title="Mussa-Ivaldi & Hogan, impedance control",
    formula="qdot = C_a J'(J C_a J')^-1 xdot, C_a = (C^-1 - Gamma)^-1",
    weight="C^-1 - Gamma, Gamma = sum_k F_k Hess x_k, C^-1 (q - rest) = J'F",
    vector="0",
    condition="the elastic equilibrium is stable with the hand held",
    number="[26]",
    certainty="certain",
    works=(
        "F. A. Mussa-Ivaldi, N. Hogan, Integrable solutions of kinematic redundancy via impedance control, "
        "Int. J. Robotics Research 10(5), 1991",
    ),
    cast=cast,
    original=mussa_ivaldi_hogan.original,
    draw=draw,
    still={"tolerance": np.inf},
    inverts_weight=True,
    refuses=(
        "a compliance that is not symmetric positive definite",
        "a configuration off equilibrium",
        "an unstable equilibrium (condition 7)",
        "a task that fixes a part of the angular velocity only",
        "J of lower rank",
    ),
)
