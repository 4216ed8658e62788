"""C1: qdot = sum_i s_i / (s_i^2 + lambda^2) v_i u_i'xdot (Nakamura & Hanafusa 1986, Wampler 1986), by SVD."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.robots.robot import Robot

Array = np.ndarray


def original(
    robot: Robot, q: Array, xdot: Array, *,
    damping: float = 0.125, weight: Any = 1.0, gradient: Array | None = None, task_weight: Any = 1.0,
) -> Array:  # fmt: skip
    """Joint rates (B, n), of M'J L^-T with W = LL' and Wx = MM'; a gradient moves the centre to -W^-1 a."""
    W = np.asarray(weight, dtype=float)
    Wx = np.asarray(task_weight, dtype=float)
    L = np.linalg.cholesky(W if W.ndim == 2 else W * np.eye(robot.n))
    M = np.linalg.cholesky(Wx if Wx.ndim == 2 else Wx * np.eye(robot.m))
    J = robot.jacobian(q)
    centre = np.zeros((len(q), robot.n)) if gradient is None else np.broadcast_to(-np.asarray(gradient), (len(q), robot.n))
    centre = np.linalg.solve(L, centre.T)  # of L'qdot
    scaled = M.T @ np.swapaxes(np.linalg.solve(L, np.swapaxes(J, 1, 2)), 1, 2)
    U, s, Vt = np.linalg.svd(scaled, full_matrices=False)
    missing = xdot @ M - np.einsum("bmn,nb->bm", scaled, centre)
    share = s / (s**2 + damping**2) * np.einsum("bmi,bm->bi", U, missing)
    moved = centre.T + np.einsum("bin,bi->bn", Vt, share)
    return np.linalg.solve(L.T, moved.T).T
