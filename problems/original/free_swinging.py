"""M10: qdot = J^+ xdot - alpha (I - J^+J) grad f, f = 1/2 sum w_i X_i^2 (English, Maciejewski 1998), grad f written out."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.original.gradient_projection import projected
from problems.robots.robot import Robot

Array = np.ndarray

ALPHA = {"swing_torque": 1e-3, "swing_acceleration": 1e-3, "swing_angle": 0.1}


def original(
    robot: Robot, q: Array, xdot: Array, *, alpha: float | None = None, measure: str = "swing_acceleration",
    weights: Any = None, scales: Any = None,
) -> Array:  # fmt: skip
    """Joint rates (B, n)."""
    if measure == "swing_angle":
        X, slope = _angles(robot, q)
        w = _turned(robot).astype(float) if weights is None else np.asarray(weights, dtype=float)
    else:
        X, slope = robot.gravity_torque(q), robot.gravity_torque_derivative(q)
        w = np.ones(robot.n) if weights is None else np.asarray(weights, dtype=float)
        if measure == "swing_acceleration":
            inertia = np.diagonal(robot.inertia(q), axis1=-2, axis2=-1)
            X = X / inertia
            slope = (slope - X[..., None] * _inertia_slopes(robot, q)) / inertia[..., None]
    terms = np.where(w[:, None] > 0, (w * X)[..., None] * slope, 0.0)
    alpha = ALPHA[measure] if alpha is None else alpha
    return projected(robot, q, xdot, -alpha * terms.sum(axis=-2), scales)


def _inertia_slopes(robot: Robot, q: Array) -> Array:
    """dM_ii/dq_k (..., i, k) by Newton and Euler: it is twice the Christoffel symbol (i; i, k), of h(qdot) = C(qdot) qdot.

    h is quadratic, so its bilinear part at (e_i, e_k) is half of h(e_i + e_k) - h(e_i) - h(e_k).
    """
    n = robot.n

    def h(qdot: Array) -> Array:
        return robot.inverse_dynamics(q, np.broadcast_to(qdot, q.shape), np.zeros_like(q), gravity=False)

    unit = np.eye(n)
    alone = [h(unit[i]) for i in range(n)]
    slopes = np.zeros((*q.shape, n))
    for i in range(n):
        slopes[..., i, i] = 2 * alone[i][..., i]
        for k in range(i):
            both = h(unit[i] + unit[k]) - alone[i] - alone[k]
            slopes[..., i, k], slopes[..., k, i] = both[..., i], both[..., k]
    return slopes


def _angles(robot: Robot, q: Array) -> tuple[Array, Array]:
    """theta_i (..., n) = atan2(z_i.(s_i x g), s_i.g - (z_i.s_i)(z_i.g)) and its derivative by q_k (..., n, n).

    s_i is the outboard mass times its centre's place off joint i. What joint k carries turns about z_k: for k <= i that is
    axis and s_i together, beyond only the part of s_i outboard of k.
    """
    model = robot.model
    g = np.array(model.gravity.linear)
    z, p = [], []
    for i in robot.joints:
        column = robot.point_jacobian(q, i)[..., i - 1]
        z.append(column[..., :3] if robot.prismatic[i - 1] else column[..., 3:])
        p.append(robot.point(q, i))
    masses = {body: mass for body, mass, *_ in robot.bodies()}
    centres = {body: robot.point(q, body, centre) for body, _, centre, _ in robot.bodies()}
    outboard = [[int(b) for b in model.subtrees[i]] for i in robot.joints]
    s = [sum(masses[b] * (centres[b] - p[i]) for b in outboard[i]) for i in range(robot.n)]
    total = [sum(masses[b] for b in bodies) for bodies in outboard]
    X, slope = np.zeros(q.shape), np.zeros((*q.shape, robot.n))
    for i in range(robot.n):
        rides = {int(j) - 1 for j in model.supports[i + 1] if j}
        across = np.sum(z[i] * np.cross(s[i], g), axis=-1)
        along = s[i] @ g - np.sum(z[i] * s[i], axis=-1) * (z[i] @ g)
        X[..., i] = np.arctan2(across, along)
        size = across**2 + along**2
        for k in range(robot.n):
            if k in rides:
                turning = not robot.prismatic[k]
                ds, dz = (np.cross(z[k], s[i]), np.cross(z[k], z[i])) if turning else (np.zeros_like(s[i]), np.zeros_like(z[i]))
            elif k + 1 in outboard[i]:
                ds = total[k] * z[k] if robot.prismatic[k] else np.cross(z[k], s[k])
                dz = np.zeros_like(z[i])
            else:
                continue
            d_across = np.sum(dz * np.cross(s[i], g) + z[i] * np.cross(ds, g), axis=-1)
            d_along = ds @ g - np.sum(dz * s[i] + z[i] * ds, axis=-1) * (z[i] @ g) - np.sum(z[i] * s[i], axis=-1) * (dz @ g)
            with np.errstate(divide="ignore", invalid="ignore"):
                slope[..., i, k] = (along * d_across - across * d_along) / size
    return X, slope


def _turned(robot: Robot) -> Array:
    """Which joints turn and feel gravity: those it puts a torque on at three configurations that are not special."""
    tau = np.abs(robot.gravity_torque(np.sin(np.outer([1.0, 2.0, 3.0], 1.0 + np.arange(robot.n)))))
    return ~robot.prismatic & (tau > 1e-12 * tau.max()).all(axis=0)
