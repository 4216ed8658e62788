"""M8: qdot = J^+ xdot + [Jd (I - J^+J)]^+ (dd - Jd J^+ xdot) (Maciejewski & Klein 1985)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from problems.original.parameters import matrix
from problems.original.parameters import obstacle as placed
from problems.robots.robot import Robot

Array = np.ndarray


def original(
    robot: Robot, q: Array, xdot: Array, *, obstacle: Any = None, points: Sequence[Any] | None = None, escape: Any = 0.25,
    Qd: Any = None, eps: float = 0.0,
) -> Array:  # fmt: skip
    """Joint rates (B, n); `eps` has no place here: this is the limit eps -> 0.

    With Qd = L L' the second task is L'(Jd qdot - dd), which is Maciejewski and Klein's for Qd = I.
    """
    if points is None:
        first = robot.m // 2 + 1
        points = [(joint, (0.0, 0.0, 0.0)) for joint in range(first, first + robot.k)]
    obstacle, rows = placed(robot, obstacle), []
    for joint, offset in points:
        away = robot.point(q, joint, offset) - obstacle
        u = away / np.linalg.norm(away, axis=-1, keepdims=True)
        rows.append(np.einsum("...i,...in->...n", u, robot.point_jacobian(q, joint, offset)[..., :3, :]))
    L = np.linalg.cholesky(matrix(1.0 if Qd is None else Qd, len(rows)))
    Jd = L.T @ np.stack(rows, axis=-2)
    dd = np.broadcast_to(np.asarray(escape, dtype=float), Jd.shape[:-1]) @ L
    J = robot.jacobian(q)
    pinv = np.linalg.pinv(J)
    primary = np.einsum("...nm,...m->...n", pinv, xdot)
    U, sigma, V = np.linalg.svd(Jd @ (np.eye(robot.n) - pinv @ J), full_matrices=False)
    # rounding of the projector is no self-motion: half the digits are enough to tell
    kept = sigma > np.sqrt(np.finfo(float).eps) * np.linalg.norm(Jd, axis=(-1, -2))[..., None]
    missing = np.einsum("...pr,...p->...r", U, dd - np.einsum("...pn,...n->...p", Jd, primary))
    return primary + np.einsum("...rn,...r->...n", V, np.where(kept, missing / np.where(kept, sigma, 1.0), 0.0))
