"""M1: Liegeois's gradient projection, W = I."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.measures.posture import posture as posture_measure
from problems.methods.draw import generic, moving
from problems.original import gradient_projection
from problems.robots.robot import Robot
from problems.weightings.identity import identity
from sandbox.errors import RangeError
from sandbox.method import Draw, Method
from sandbox.parameters import number, vectors
from sandbox.problem import VelocityProblem

Array = np.ndarray


def cast(
    robot: Robot, q: Array, xdot: Array, *, alpha: float = 0.5, posture: Any = None, gradient: Any = None, scales: Any = None
) -> VelocityProblem:
    """W = I, a = alpha grad f, f = 1/2 |q - posture|^2 [rad^2], alpha [1/s]; posture (n,), zero if left out.

    gradient : (n,) or (B, n), grad f of any other f at q, in the place of the posture's; alpha [rad^2/(s unit of f)]
    scales : (n,) [rad, m], then W = diag(1/scales^2); needed where joints that turn and that slide are mixed
    """
    if gradient is None:
        gradient = posture_measure(np.zeros(robot.n) if posture is None else posture).gradient(robot, q)
    elif posture is not None:
        raise RangeError("posture and gradient are both given: f is the distance from the posture, or another; give one")
    return descending(robot, q, xdot, alpha, gradient, scales)


def descending(
    robot: Robot, q: Array, xdot: Array, alpha: float, gradient: Any, scales: Any = None, *, up: bool = False
) -> VelocityProblem:
    """W = I or diag(1/scales^2), a = alpha grad f: alpha > 0 drives f down, or with `up` (a = -alpha grad f) up.

    Raises NonFiniteError for alpha or a gradient that is not finite, ShapeError for a gradient that is not (n,) or (B, n).
    """
    rate, gradient = number(alpha, "alpha"), vectors(gradient, "grad f", robot.n, lead=np.shape(q)[:-1])
    W = identity(robot, q, scales)
    return VelocityProblem(J=robot.jacobian(q), xdot=xdot, W=W, a=(-rate if up else rate) * gradient)


def draw(robot: Robot, rng: np.random.Generator, count: int) -> Draw:
    """Configurations off the stationary points of f."""
    return generic(robot, rng, count, lambda q: moving(robot, q, q))


METHOD = Method(
    id="M1",
    name="gradient_projection",
    title="Liegeois gradient projection",
    formula="qdot = J^+ xdot - alpha (I - J^+J) grad f",
    weight="I",
    vector="alpha grad f",
    condition="always",
    number="[1], [16]",
    certainty="certain",
    works=(
        "A. Liegeois, Automatic supervisory control of the configuration and behavior of multibody mechanisms, "
        "IEEE Trans. SMC 7(12), 1977, doi 10.1109/TSMC.1977.4309644",
        "C. A. Klein, C. H. Huang, Review of pseudoinverse control for use with kinematically redundant manipulators, "
        "IEEE Trans. SMC 13(2), 1983, doi 10.1109/TSMC.1983.6313123",
    ),
    cast=cast,
    original=gradient_projection.original,
    draw=draw,
    refuses=(
        "mixed revolute and prismatic joints without a scale", "a gradient of the wrong length", "alpha that is not finite",
        "f that is not differentiable at q",
    ),
)  # fmt: skip
