"""M12: Baillieul's extended Jacobian, eqs. (11)-(12)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from problems.measures.measure import Measure
from problems.methods.draw import HEALTHY, gathered, generic
from problems.original import extended_jacobian
from problems.robots.robot import Robot
from problems.weightings.extended import Extremum, extended, extremum
from problems.weightings.impedance import elastic
from sandbox.method import Draw, Method
from sandbox.problem import VelocityProblem
from sandbox.tolerances import EXTREMAL

Array = np.ndarray

PULL = 2.0
"""Multipliers of drawn situations, times |J|: the curvature of the task is then of the size of the springs'."""


def cast(
    robot: Robot, q: Array, xdot: Array, *, stiffness: Any = 1.0, rest: Array | None = None, tolerance: float = EXTREMAL
) -> VelocityProblem:
    """W = H'H, a = 0; g = 1/2 (q - rest)'K(q - rest).

    stiffness : K, a number, (n,) or (n, n), positive definite; rest : (n,) or (B, n) [rad], zero if left out
    tolerance : |N'grad g| / |grad g| up to which q counts as extremal; inf along a path that started so
    """
    return cast_function(robot, q, xdot, function=elastic(robot, stiffness, rest), tolerance=tolerance)


def cast_function(robot: Robot, q: Array, xdot: Array, *, function: Measure, tolerance: float = EXTREMAL) -> VelocityProblem:
    """The same for any measure g with a Hessian."""
    condition = extremum(robot, q, function).on_manifold(tolerance)
    return VelocityProblem(J=condition.J, xdot=xdot, W=extended(condition))


def situations(
    robot: Robot, rng: np.random.Generator, count: int, accept: Callable[[Extremum], Array], *,
    name: str = "stiffness", off: float = 0.0,
) -> Draw:  # fmt: skip
    """Configurations on the extremal manifold of springs: rest = q - K^-1 J'F, F random, K diagonal.

    accept : the condition at q (B, n) -> (B,) bool; name : of the parameter, "stiffness" K or "compliance" K^-1
    off : how far rest is moved off the manifold, per joint [rad]
    """
    stiffness = rng.uniform(0.5, 2.0, robot.n)

    def once() -> tuple[Array, Array, Array]:
        q, xdot, _ = generic(robot, rng, count)
        J = robot.jacobian(q)
        F = PULL / np.linalg.norm(J, 2, axis=(1, 2))[:, None] * rng.uniform(-1.0, 1.0, (count, robot.m))
        rest = q - np.einsum("bmn,bm->bn", J, F) / stiffness + off * rng.uniform(-1.0, 1.0, q.shape)
        good = accept(extremum(robot, q, elastic(robot, stiffness, rest)))
        return q[good], xdot[good], rest[good]

    q, xdot, rest = gathered(once, count, f"configurations of {robot.name} near enough to the manifold")
    return Draw(q, xdot, {name: stiffness if name == "stiffness" else 1 / stiffness, "rest": rest})


def transversal(condition: Extremum) -> Array:
    """Where N'H' is well away from singular (B,)."""
    H = condition.H
    return np.linalg.svd(H @ condition.N, compute_uv=False)[:, -1] > HEALTHY * np.linalg.norm(H, 2, axis=(1, 2))


def draw(robot: Robot, rng: np.random.Generator, count: int) -> Draw:
    """Configurations on the extremal manifold, minima, maxima and saddles."""
    return situations(robot, rng, count, transversal)


METHOD = Method(
    id="M12",
    name="extended_jacobian",
    title="Extended Jacobian",
    formula="[J; H] qdot = [xdot; 0], H = dh/dq, h = N'grad g",
    weight="H'H",
    vector="0",
    condition="[J; H] nonsingular",
    number="[20], [21]",
    certainty="very likely",
    works=(
        "J. Baillieul, Kinematic programming alternatives for redundant manipulators, IEEE ICRA 1985",
        "P. H. Chang, A closed-form solution for inverse kinematics of robot manipulators with redundancy, "
        "IEEE J. Robotics and Automation 3(5), 1987",
        "C. A. Klein, C. Chu-Jenq, S. Ahmed, A new formulation of the extended Jacobian method, "
        "IEEE Trans. Robotics and Automation 11(1), 1995",
    ),
    cast=cast,
    original=extended_jacobian.original,
    draw=draw,
    still={"tolerance": np.inf},
    refuses=(
        "a start off the extremal manifold",
        "a bifurcation of the extremum, N'H' singular",
        "g without a Hessian",
        "J of lower rank",
    ),
)
