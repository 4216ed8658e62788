"""C1: qdot = sum_i s_i / (s_i^2 + lambda^2) v_i u_i'xdot (Nakamura & Hanafusa 1986, Wampler 1986), by SVD."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.original.parameters import matrix
from problems.robots.robot import Robot

Array = np.ndarray


def original(
    robot: Robot, q: Array, xdot: Array, *,
    damping: float = 0.125, weight: Any = 1.0, gradient: Array | None = None, task_weight: Any = 1.0,
) -> Array:  # fmt: skip
    """Joint rates (B, n), of M'J L^-T with W = LL' and Wx = MM'; a gradient moves the centre to -W^-1 a."""
    L, M = np.linalg.cholesky(matrix(weight, robot.n)), np.linalg.cholesky(matrix(task_weight, robot.m))
    J = robot.jacobian(q)
    a = np.broadcast_to(np.asarray(0.0 if gradient is None else gradient, dtype=float), (len(q), robot.n))
    centre = -np.linalg.solve(L, a[:, :, None])  # of L'qdot
    scaled = np.swapaxes(M, -1, -2) @ np.swapaxes(np.linalg.solve(L, np.swapaxes(J, 1, 2)), 1, 2)
    U, s, Vt = np.linalg.svd(scaled, full_matrices=False)
    missing = (np.asarray(xdot)[:, None, :] @ M)[:, 0] - (scaled @ centre)[:, :, 0]
    share = s / (s**2 + damping**2) * np.einsum("bmi,bm->bi", U, missing)
    moved = centre[:, :, 0] + np.einsum("bin,bi->bn", Vt, share)
    return np.linalg.solve(np.swapaxes(L, -1, -2), moved[:, :, None])[:, :, 0]
