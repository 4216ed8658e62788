"""M17: kinetic energy by forward velocity recursion, K_p by polarisation, the minimum along null J."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from problems.robots.robot import Robot

Array = np.ndarray


def original(robot: Robot, q: Array, xdot: Array, *, bodies: Sequence[Any] | None = None) -> Array:
    """Joint rates (B, n): qp - N (N'K N)^-1 N'K qp, qp = J^+ xdot."""
    if bodies is None:
        bodies = [(joint, 1.0, np.zeros(3), 0.025 * np.eye(3)) for joint in robot.joints]
    K, J = load_matrix(robot, q, bodies), robot.jacobian(q)
    particular = np.linalg.pinv(J) @ np.asarray(xdot)[..., None]
    N = np.swapaxes(np.linalg.svd(J)[2][..., robot.m :, :], -1, -2)
    NtK = np.swapaxes(N, -1, -2) @ K
    return (particular - N @ np.linalg.solve(NtK @ N, NtK @ particular))[..., 0]


def load_matrix(robot: Robot, q: Array, bodies: Sequence[Any]) -> Array:
    """K_p (..., n, n): K_ij = T(e_i + e_j) - T(e_i) - T(e_j), as 1/2 qdot'K qdot = T(qdot)."""
    e = np.eye(robot.n)
    pairs = (e[:, None] + e[None, :]).reshape(-1, robot.n)
    both = kinetic_energy(robot, q[..., None, :], pairs, bodies).reshape(*q.shape[:-1], robot.n, robot.n)
    alone = kinetic_energy(robot, q[..., None, :], e, bodies)
    return both - alone[..., :, None] - alone[..., None, :]


def kinetic_energy(robot: Robot, q: Array, qdot: Array, bodies: Sequence[Any]) -> Array:
    """T (...,) [J] of the bodies, 1/2 sum m |v|^2 + w'I w, link by link outwards in each link's own axes."""
    model = robot.model
    q, qdot = np.broadcast_arrays(q, qdot)
    still = np.zeros((*q.shape[:-1], 3))
    turning, moving = [still], [still]  # angular velocity, and velocity of the origin, of the base
    for i in robot.joints:
        parent, place = model.parents[i], model.jointPlacements[i]
        joint = model.joints[i].createData()
        model.joints[i].calc(joint, np.zeros(model.nq))
        slide, axis = np.ravel(joint.S)[:3], np.ravel(joint.S)[3:]
        angle, rate = q[..., model.joints[i].idx_q, None], qdot[..., model.joints[i].idx_v, None]
        turn = _turn(axis, angle[..., None]) if axis.any() else np.eye(3)
        outwards = np.swapaxes(place.rotation @ turn, -1, -2)
        origin = place.translation + angle * (place.rotation @ slide)
        w, v = turning[parent], moving[parent]
        turning.append((outwards @ w[..., None])[..., 0] + rate * axis)
        moving.append((outwards @ (v + np.cross(w, origin))[..., None])[..., 0] + rate * slide)
    T = np.zeros(q.shape[:-1])
    for joint, mass, centre, about_centre in bodies:
        v = moving[joint] + np.cross(turning[joint], centre)
        T += (mass * (v**2).sum(axis=-1) + np.einsum("...i,ij,...j->...", turning[joint], about_centre, turning[joint])) / 2
    return T


def _turn(axis: Array, angle: Array) -> Array:
    """Rotation (..., 3, 3) by `angle` (..., 1, 1) about a unit axis: I + sin K + (1 - cos) K^2."""
    K = np.cross(np.eye(3), axis)
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * (K @ K)
