"""M9: qdot = J^+ xdot - alpha (I - J^+J) grad f; f from the determinants of J with the failed joints' columns deleted."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Any

import numpy as np

from problems.original.gradient_projection import projected
from problems.robots.robot import Robot

Array = np.ndarray


def original(
    robot: Robot, q: Array, xdot: Array, *, alpha: float = 0.1, measure: str = "fault_tolerance", failures: int = 1,
    joints: Sequence[int] | None = None, scales: Any = None,
) -> Array:  # fmt: skip
    """Joint rates (B, n); rho_S = w(^SJ)/w(J), d ln w/dq_k = tr((dJ/dq_k) J^+) of both."""
    J, dJ = robot.jacobian(q), robot.jacobian_derivative(q)
    whole = _slope(J, dJ)
    failing = range(robot.n) if joints is None else sorted({joint - 1 for joint in joints})
    each = []
    for gone in combinations(failing, failures):
        kept = [i for i in range(robot.n) if i not in gone]
        left, slope = J[..., kept], dJ[..., kept]
        if measure == "kfm":
            U, sigma, Vt = np.linalg.svd(left, full_matrices=False)
            each.append((sigma[..., -1], np.einsum("...m,...kmn,...n->...k", U[..., -1], slope, Vt[..., -1, :])))
        else:
            ratio = _volume(left) / _volume(J)
            each.append((ratio, _slope(left, slope) - whole))
    values, slopes = (np.stack(parts, axis=0) for parts in zip(*each, strict=True))
    if measure == "fault_tolerance":
        rise = slopes.sum(axis=0)
    else:
        worst = values.argmin(axis=0)[None]
        rise = np.take_along_axis(slopes, worst[..., None], axis=0)[0]
        if measure == "least_relative_manipulability":
            rise = rise * np.take_along_axis(values, worst, axis=0)[0][..., None]
    return projected(robot, q, xdot, alpha * rise, scales)


def _volume(J: Array) -> Array:
    return np.sqrt(np.linalg.det(J @ np.swapaxes(J, -1, -2)))


def _slope(J: Array, dJ: Array) -> Array:
    return np.einsum("...kmn,...nm->...k", dJ, np.linalg.pinv(J))
