"""M6: gradient of the static torque; and least torque by accelerations (Hollerbach, Suh 1987)."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.original.gradient_projection import projected
from problems.original.parameters import matrix
from problems.robots.robot import Robot

Array = np.ndarray


def original(robot: Robot, q: Array, xdot: Array, *, alpha: float = 1e-3, Q: Any = None, scales: Any = None) -> Array:
    """Joint rates (B, n); grad f = (d tau_g/dq)'Q tau_g."""
    tau, slope = robot.gravity_torque(q), robot.gravity_torque_derivative(q)
    gradient = np.einsum("...ij,...i->...j", slope, tau @ matrix(1.0 if Q is None else Q, robot.n))
    return projected(robot, q, xdot, -alpha * gradient, scales)


def original_acceleration(robot: Robot, q: Array, xddot: Array, *, qdot: Any = None, Q: Any = None) -> Array:
    """Joint accelerations (B, n): J^+(xddot - Jdot qdot) - [M(I - J^+J)]^+ tau~.

    tau~ = M J^+(xddot - Jdot qdot) + C qdot + tau_g. With Q = L L' torques are measured as L'tau; the authors have Q = I.
    """
    qdot = np.broadcast_to(np.zeros(robot.n) if qdot is None else qdot, np.shape(q))
    J, M = robot.jacobian(q), robot.inertia(q)
    carried = np.einsum("...kmn,...k,...n->...m", robot.jacobian_derivative(q), qdot, qdot)
    c = robot.inverse_dynamics(q, qdot, np.zeros_like(qdot))
    pinv = np.linalg.pinv(J)
    primary = np.einsum("...nm,...m->...n", pinv, xddot - carried)
    value, vectors = np.linalg.eigh(matrix(1.0 if Q is None else Q, robot.n))
    root = np.sqrt(np.maximum(value, 0))[:, None] * vectors.T
    left = (np.einsum("...ij,...j->...i", M, primary) + c) @ root.T
    across = root @ M @ (np.eye(robot.n) - pinv @ J)
    # the projector has rank n - m: what rounding leaves beside it must not be inverted
    U, sigma, Vt = np.linalg.svd(across)
    k = robot.n - robot.m
    inverse = np.einsum("...rn,...r,...pr->...np", Vt[..., :k, :], 1 / sigma[..., :k], U[..., :, :k])
    return primary - np.einsum("...np,...p->...n", inverse, left)
