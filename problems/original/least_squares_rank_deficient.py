"""M20: qdot = q_p + N y, q_p the least-squares solution by SVD of Wx^1/2 J, then the null-space method on the enlarged N."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.robots.robot import Robot

Array = np.ndarray

SMALL = 1e-8
"""Singular values below this share of the largest count as zero where no tolerance is given."""


def original(
    robot: Robot, q: Array, xdot: Array, *,
    weight: Any = 1.0, gradient: Array | None = None, task_weight: Any = 1.0, rank_tolerance: float | None = None,
) -> Array:  # fmt: skip
    """Joint rates (B, n): N y minimises 1/2 qdot'W qdot + a'qdot over what the least-squares target leaves free."""
    n, m = robot.n, robot.m
    W = np.asarray(weight, dtype=float)
    W = W if W.ndim == 2 else W * np.eye(n)
    Wx = np.asarray(task_weight, dtype=float)
    root = np.linalg.cholesky(Wx if Wx.ndim == 2 else Wx * np.eye(m)).T
    a = np.broadcast_to(0.0 if gradient is None else gradient, (len(q), n))
    J = robot.jacobian(q)
    qdot = np.empty((len(q), n))
    for i in range(len(q)):
        U, sigma, Vt = np.linalg.svd(root @ J[i])
        rank = int((sigma > (SMALL if rank_tolerance is None else rank_tolerance) * sigma[0]).sum())
        N = Vt[rank:].T
        particular = Vt[:rank].T @ ((U.T @ root @ xdot[i])[:rank] / sigma[:rank])
        qdot[i] = particular - N @ np.linalg.solve(N.T @ W @ N, N.T @ (a[i] + W @ particular))
    return qdot
