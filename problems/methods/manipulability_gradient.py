"""M5: singularity avoidance by the gradient of the manipulability (Yoshikawa) or of the smallest singular value."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.measures.manipulability import log_volume, volume
from problems.measures.measure import Measure
from problems.measures.singular_value import smallest_singular_value
from problems.methods.draw import STATIONARY, generic, moving
from problems.methods.gradient_projection import descending
from problems.original import manipulability_gradient
from problems.robots.robot import Robot
from sandbox.method import Draw, Method
from sandbox.parameters import chosen
from sandbox.problem import VelocityProblem

Array = np.ndarray

CHOICES: dict[str, Measure] = {f.name: f for f in (volume(), log_volume(), smallest_singular_value())}


def cast(
    robot: Robot, q: Array, xdot: Array, *, alpha: float = 0.5, measure: str = "manipulability", scales: Any = None
) -> VelocityProblem:
    """W = I, a = -alpha grad w: alpha > 0 [rad^2/(s unit of w)] drives w, ln w or sigma_min up; scales as in M1."""
    return descending(robot, q, xdot, alpha, _measure(measure).gradient(robot, q), scales, up=True)


def _measure(name: str) -> Measure:
    return CHOICES[chosen("measure of singularity", name, CHOICES)]


def draw(robot: Robot, rng: np.random.Generator, count: int, *, measure: str = "manipulability") -> Draw:
    """Configurations off singularities, off the stationary points of f, and with a simple smallest singular value."""
    f = _measure(measure)

    def accept(q: Array) -> Array:
        accepted = moving(robot, q, f.gradient(robot, q))
        if measure == "smallest_singular_value" and robot.m > 1:
            sigma = np.linalg.svd(robot.jacobian(q), compute_uv=False)
            accepted &= sigma[:, -2] - sigma[:, -1] > STATIONARY * sigma[:, 0]
        return accepted

    return generic(robot, rng, count, accept)._replace(parameters={"measure": measure})


METHOD = Method(
    id="M5",
    name="manipulability_gradient",
    title="Singularity avoidance, manipulability",
    formula="qdot = J^+ xdot + alpha (I - J^+J) grad w, w = sqrt(det JJ')",
    weight="I",
    vector="-alpha grad w",
    condition="always",
    number="[10]",
    certainty="very likely",
    works=(
        "T. Yoshikawa, Manipulability of robotic mechanisms, IJRR 4(2), 1985, doi 10.1177/027836498500400201",
        "C. A. Klein, B. E. Blaho, Dexterity measures for the design and control of kinematically redundant manipulators, "
        "IJRR 6(2), 1987",
    ),
    cast=cast,
    original=manipulability_gradient.original,
    draw=draw,
    refuses=("J without full row rank", "a smallest singular value that is not simple"),
)
