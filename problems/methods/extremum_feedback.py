"""M14: the extended Jacobian with feedback of h, for configurations off the extremal manifold."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.measures.measure import Measure
from problems.methods.extended_jacobian import METHOD as EXTENDED_JACOBIAN
from problems.methods.extended_jacobian import situations, transversal
from problems.original import extremum_feedback
from problems.robots.robot import Robot
from problems.weightings.extended import extended, extremum
from problems.weightings.impedance import elastic
from sandbox.method import Draw, Method
from sandbox.parameters import number
from sandbox.problem import VelocityProblem

Array = np.ndarray

OFF = 0.3
"""How far the rest posture of drawn situations is moved off the manifold, per joint [rad]."""


def cast(
    robot: Robot, q: Array, xdot: Array, *,
    stiffness: Any = 1.0, rest: Array | None = None, kappa: float = 1.0, alpha: float = 0.0,
) -> VelocityProblem:  # fmt: skip
    """W = H'H, a = alpha grad g + kappa H'h; g, stiffness and rest as of extended_jacobian.

    kappa : rate [1/s] at which h decays, at minima, maxima and saddles alike
    alpha : the paper's feedback, hdot = -alpha (N'H')^-1 h: alpha > 0 attracts to minima and repels from maxima
    """
    return cast_function(robot, q, xdot, function=elastic(robot, stiffness, rest), kappa=kappa, alpha=alpha)


def cast_function(
    robot: Robot, q: Array, xdot: Array, *, function: Measure, kappa: float = 1.0, alpha: float = 0.0
) -> VelocityProblem:
    """The same for any measure g with a Hessian."""
    kappa, alpha = number(kappa, "kappa"), number(alpha, "alpha")
    condition = extremum(robot, q, function)
    pull = kappa * np.einsum("...kn,...k->...n", condition.H, condition.h)
    return VelocityProblem(J=condition.J, xdot=xdot, W=extended(condition), a=alpha * condition.gradient + pull)


def draw(robot: Robot, rng: np.random.Generator, count: int) -> Draw:
    """Configurations off the manifold, and both feedbacks at once."""
    q, xdot, parameters = situations(robot, rng, count, transversal, off=OFF)
    return Draw(q, xdot, {**parameters, "kappa": float(rng.uniform(0.5, 2.0)), "alpha": float(rng.uniform(0.1, 1.0))})


METHOD = Method(
    id="M14",
    name="extremum_feedback",
    title="Extended Jacobian with feedback",
    formula="[J; H] qdot = [xdot; -kappa h - alpha (N'H')^-1 h]",
    weight="H'H",
    vector="alpha grad g + kappa H'h",
    condition="[J; H] nonsingular",
    number="[20], [21]",
    certainty="very likely",
    works=EXTENDED_JACOBIAN.works,
    cast=cast,
    original=extremum_feedback.original,
    draw=draw,
    refuses=(
        "a bifurcation of the extremum, N'H' singular",
        "g without a Hessian",
        "gains that are not finite",
        "J of lower rank",
    ),
)
