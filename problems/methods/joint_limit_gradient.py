"""M3: joint-limit avoidance by the gradient of a distance from the limits."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.measures.joint_limits import EXPONENT, barrier, p_norm, quadratic
from problems.measures.measure import Measure
from problems.methods.draw import generic, moving
from problems.methods.gradient_projection import descending
from problems.original import joint_limit_gradient
from problems.robots.robot import Robot
from sandbox.method import Draw, Method
from sandbox.parameters import chosen, unused
from sandbox.problem import VelocityProblem

Array = np.ndarray

CHOICES = ("joint_limits_quadratic", "joint_limits_p_norm", "joint_limits_barrier")


def cast(
    robot: Robot, q: Array, xdot: Array, *, alpha: float = 0.5, measure: str = CHOICES[0], p: int | None = None,
    lower: Any = None, upper: Any = None, weights: Any = None, scales: Any = None,
) -> VelocityProblem:  # fmt: skip
    """W = I, a = alpha grad H, alpha [rad^2/s]; H one of CHOICES.

    lower, upper : (n,) [rad, m], the robot's own if left out; weights : (n,), of each joint's term
    p : of the p-norm alone, EXPONENT if left out; scales : as for gradient_projection
    """
    f = _measure(robot, measure, p=p, lower=lower, upper=upper, weights=weights)
    return descending(robot, q, xdot, alpha, f.gradient(robot, q), scales)


def _measure(robot: Robot, name: str, *, p: int | None = None, **limits: Any) -> Measure:
    if chosen("measure of joint limits", name, CHOICES) == "joint_limits_p_norm":
        return p_norm(robot, p=EXPONENT if p is None else p, **limits)
    unused(name, p=p)
    return (quadratic if name == "joint_limits_quadratic" else barrier)(robot, **limits)


def draw(robot: Robot, rng: np.random.Generator, count: int, *, measure: str = CHOICES[0]) -> Draw:
    """Configurations inside the limits, off the stationary points of H."""
    f = _measure(robot, measure)
    drawn = generic(robot, rng, count, lambda q: moving(robot, q, f.gradient(robot, q)))
    return drawn._replace(parameters={"measure": measure})


METHOD = Method(
    id="M3",
    name="joint_limit_gradient",
    title="Joint limits, gradient",
    formula="qdot = J^+ xdot - alpha (I - J^+J) grad H, H = 1/n sum ((q_i - c_i)/(c_i - qmax_i))^2",
    weight="I",
    vector="alpha grad H",
    condition="always",
    number="[1], [9]",
    certainty="plausible",
    works=(
        "A. Liegeois, Automatic supervisory control of the configuration and behavior of multibody mechanisms, "
        "IEEE Trans. SMC 7(12), 1977, doi 10.1109/TSMC.1977.4309644",
        "H. Zghal, R. V. Dubey, J. A. Euler, Efficient gradient projection optimization for manipulators with multiple "
        "degrees of redundancy, ICRA 1990, 1006-1011",
    ),
    cast=cast,
    original=joint_limit_gradient.original,
    draw=draw,
    refuses=(
        "a lower limit that is not below its upper one", "a joint at or beyond a limit (barrier)",
        "a weight on a joint without two finite limits", "all joints at mid-range (p-norm)",
    ),
)  # fmt: skip
