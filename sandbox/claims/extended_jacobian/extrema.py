"""Extrema of spring energy with the hand held: drawn, told apart, and the two code paths that follow them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from problems.measures.measure import Measure
from problems.methods import METHODS
from problems.methods import extended_jacobian as cast_of
from problems.methods.draw import gathered, generic
from problems.robots.robot import Robot
from problems.weightings.extended import extended
from problems.weightings.extended import extremum as condition_of
from problems.weightings.impedance import elastic
from sandbox.claims import constrained, equations
from sandbox.claims.claim import Answer, CodePath
from sandbox.claims.constrained import Springs, cross
from sandbox.claims.postures import F1
from sandbox.law import rates
from sandbox.method import Draw, Method
from sandbox.problem import VelocityProblem

Array = np.ndarray

ROW = METHODS["extended_jacobian"]


REST = np.array([1.0, np.pi / 2, 1.0 - np.pi / 2])
"""For which F1 is the minimum of 1/2 |q - rest|^2 with the hand held, lam = (-1, -1)."""


TOP = F1 - 2.0 * np.array([1.0, 1.0, 0.0])
"""For which F1 is a maximum: lam = (-2, 0), rest = q - J'lam, and (-1, -1, 0) is the first row of J."""


STRONGEST = 16.0
"""Multipliers of drawn extrema, times |J| [Nm/rad]: the curvature of the task then often outdoes that of the springs."""


TASK = np.array([0.3, -0.7])


def with_cast(cast: Callable[..., VelocityProblem]) -> Callable[[Answer], Answer]:
    """A planted fault: the framework handed another cast of the same method."""

    def plant(framework: Answer) -> Answer:
        def planted(method: Method, robot: Robot, q: Array, xdot: Array, **parameters: Any) -> Array:
            return framework(replace(method, cast=cast), robot, q, xdot, **parameters)

        return planted

    return plant


def turned_torsion(factor: float) -> Callable[..., VelocityProblem]:
    """The cast of M12 with factor T for T, T_ij = sum_k lam_k dJ_ki/dq_j."""

    def cast(
        robot: Robot, q: Array, xdot: Array, *,
        stiffness: Any = 1.0, rest: Any = None, tolerance: float = np.inf, function: Measure | None = None,
    ) -> VelocityProblem:  # fmt: skip
        condition = condition_of(robot, q, elastic(robot, stiffness, rest) if function is None else function)
        changed = replace(condition, T=factor * condition.T)
        return VelocityProblem(J=condition.J, xdot=xdot, W=extended(changed))

    return cast


def springs_of(parameters: Mapping[str, Any], i: int) -> Springs:
    """The function g of one drawn situation."""
    return Springs(np.asarray(parameters["stiffness"]), parameters["rest"][i])


def extrema(robot: Robot, rng: np.random.Generator, count: int) -> Draw:
    """Minima, saddles and maxima of springs with the hand held: rest = q - J'F, F from slight to strong."""

    def once() -> tuple[Array, Array, Array]:
        q, xdot, _ = generic(robot, rng, count)
        J = robot.jacobian(q)
        F = rng.uniform(-STRONGEST, STRONGEST, (count, robot.m)) / np.linalg.norm(J, 2, axis=(1, 2))[:, None]
        rest = q - np.einsum("bmn,bm->bn", J, F)
        good = cast_of.transversal(condition_of(robot, q, elastic(robot, 1.0, rest)))
        return q[good], xdot[good], rest[good]

    q, xdot, rest = gathered(once, count, f"extrema of {robot.name}")
    return Draw(q, xdot, {"stiffness": np.ones(robot.n), "rest": rest})


def kinds(robot: Robot, drawn: Draw) -> Array:
    """Smallest and largest eigenvalue (B, 2) of N'(Hess g - T)N, N orthonormal: of one sign at minima and maxima."""
    condition = condition_of(robot, drawn.q, elastic(robot, **drawn.parameters))
    return np.linalg.eigvalsh(condition.H @ condition.N)[:, [0, -1]]


def torsion_share(robot: Robot, drawn: Draw) -> Array:
    """What rounding of Hess g - T is to H (B,): cancellation in the row of eq. (11)."""
    condition = condition_of(robot, drawn.q, elastic(robot, **drawn.parameters))
    parts = np.linalg.norm(condition.hessian, 2, axis=(1, 2)) + np.linalg.norm(condition.T, 2, axis=(1, 2))
    return parts / np.linalg.svd(condition.H, compute_uv=False)[:, -1]


def left_over(robot: Robot, g: Springs, q: Array) -> float:
    """|N'grad g| / |grad g| by singular values of J alone."""
    gradient = g.gradient(q)
    return float(np.linalg.norm(equations.null_space(constrained.tip_jacobian(q)).T @ gradient) / np.linalg.norm(gradient))


def residual(g: Springs, q: Array) -> float:
    """|N'grad g|, N orthonormal."""
    return float(np.linalg.norm(equations.null_space(constrained.tip_jacobian(q)).T @ g.gradient(q)))


def scaled(scale: Callable[[Array], Any]) -> Callable[[Array], Array]:
    """The basis scale(q) n(q), n the cross product of the rows of J."""
    return lambda q: scale(q) * cross(q)


def unit(q: Array) -> Any:
    """What scales the cross product n to length one."""
    n = cross(q)[:, 0]
    return 1 / np.sqrt(n @ n)


FRAMEWORK = CodePath(r"the method cast by (11)–(12), $H = N_J^T(\nabla^2 g - T)$, answered by eq. (6)", rates)


EXTREMUM = CodePath(
    "the extremum of g with the hand held, by root finding on Lagrange's conditions, differenced", constrained.extremum_rates
)


BY_BASIS = CodePath(
    r"$[J; H]$ solved as Baillieul wrote it, $H$ from complex steps of $\bar N_J^T \nabla g$", constrained.basis_rates
)


SOURCES = (*ROW.works,)
