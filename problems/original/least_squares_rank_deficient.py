"""M20: qdot = q_p + N y, q_p the least-squares solution by SVD of Wx^1/2 J, then the null-space method on the enlarged N."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.original.parameters import matrix
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
    W = np.broadcast_to(matrix(weight, n), (len(q), n, n))
    roots = np.broadcast_to(np.linalg.cholesky(matrix(task_weight, m)), (len(q), m, m))
    a = np.broadcast_to(np.asarray(0.0 if gradient is None else gradient, dtype=float), (len(q), n))
    J = robot.jacobian(q)
    qdot = np.empty((len(q), n))
    for i in range(len(q)):
        root = roots[i].T
        U, sigma, Vt = np.linalg.svd(root @ J[i])
        rank = int((sigma > (SMALL if rank_tolerance is None else rank_tolerance) * sigma[0]).sum())
        N = Vt[rank:].T
        particular = Vt[:rank].T @ ((U.T @ root @ xdot[i])[:rank] / sigma[:rank])
        qdot[i] = particular - N @ np.linalg.solve(N.T @ W[i] @ N, N.T @ (a[i] + W[i] @ particular))
    return qdot
