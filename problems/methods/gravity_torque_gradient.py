"""M6: less static torque by its gradient; and Hollerbach and Suh's least torque at the level of accelerations."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from problems.measures.gravity_torque import gravity_torque
from problems.methods.draw import generic, moving
from problems.methods.gradient_projection import descending
from problems.original import gravity_torque_gradient
from problems.robots.robot import Robot
from problems.robots.twin import Twin, twin
from problems.weightings.torque import torque
from sandbox.method import Draw, Method
from sandbox.parameters import vectors
from sandbox.problem import VelocityProblem

Array = np.ndarray


def cast(robot: Robot, q: Array, xdot: Array, *, alpha: float = 1e-3, Q: Any = None, scales: Any = None) -> VelocityProblem:
    """W = I, a = alpha grad f, f = 1/2 tau_g'Q tau_g; alpha [rad^2/(s unit of f)].

    Q : (n, n) positive semidefinite, or (n,) a diagonal, else I; scales : as for gradient_projection
    """
    return descending(robot, q, xdot, alpha, gravity_torque(robot, Q=Q).gradient(robot, q), scales)


def cast_acceleration(robot: Robot, q: Array, xddot: Array, *, qdot: Any = None, Q: Any = None) -> VelocityProblem:
    """Least torque at the next instant, in the unknown qddot (footnote 2): J qddot = xddot - Jdot qdot, W = M'QM, a = M'Q c.

    c = C qdot + tau_g, so that the objective is 1/2 (M qddot + c)'Q(M qddot + c) but for a constant. Jdot qdot and c are
    differentiated from the twin's forward kinematics, kinetic and potential energy.

    xddot : (..., m) [m/s^2, rad/s^2]; qdot : (n,) or (..., n) [rad/s, m/s], at rest if left out; Q : as in `cast`

    Locally optimal only: followed for long, the self-motion it asks for can grow without bound.

    Raises WeightNotPositiveDefiniteError where M is not positive definite, RangeError where Q is not semidefinite.
    """
    q, xddot = vectors(q, "q", robot.n), vectors(xddot, "xddot", robot.m, letter="m")
    qdot = vectors(np.zeros(robot.n) if qdot is None else qdot, "qdot", robot.n, lead=q.shape[:-1])
    W = torque(robot, q, Q)
    carried, c = _dynamics(robot)(q, np.broadcast_to(qdot, q.shape))
    assert W.E is not None and W.gamma is not None
    a = np.einsum("...ij,...ik,...k->...j", W.E, W.gamma, c)
    return VelocityProblem(J=robot.jacobian(q), xdot=xddot - carried, W=W, a=a)


@lru_cache(maxsize=32)
def _dynamics(robot: Robot) -> Any:
    """Evaluator of Jdot qdot (m,) and C qdot + tau_g (n,) from q and qdot."""
    symbols: Twin = twin(robot)
    qdot = ca.SX.sym("qdot", robot.n)
    carried = ca.jtimes(symbols.jacobian @ qdot, symbols.q, qdot)
    momentum = symbols.inertia @ qdot
    c = ca.jtimes(momentum, symbols.q, qdot) - ca.gradient(ca.dot(qdot, momentum) / 2, symbols.q) + symbols.gravity_torque
    return symbols.evaluator(carried, c, parameters=(qdot,), axes=[1, 1])


def draw(robot: Robot, rng: np.random.Generator, count: int) -> Draw:
    """Configurations off the stationary points of f."""
    f = gravity_torque(robot)
    return generic(robot, rng, count, lambda q: moving(robot, q, f.gradient(robot, q)))


METHOD = Method(
    id="M6",
    name="gravity_torque_gradient",
    title="Torque minimisation",
    formula="qdot = J^+ xdot - alpha (I - J^+J) (d tau_g/dq)'Q tau_g",
    weight="I (on accelerations M'QM)",
    vector="alpha grad 1/2 tau_g'Q tau_g (on accelerations M'Q(C qdot + tau_g))",
    condition="always",
    number="[11]",
    certainty="very likely",
    works=(
        "J. M. Hollerbach, K. C. Suh, Redundancy resolution of manipulators through torque optimization, "
        "IEEE J. R&A 3(4), 1987",
    ),
    cast=cast,
    original=gravity_torque_gradient.original,
    draw=draw,
    refuses=(
        "Q that is not positive semidefinite", "a robot without mass or gravity",
        "an inertia matrix that is not positive definite (accelerations)",
    ),
)  # fmt: skip
