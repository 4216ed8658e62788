"""M19: qdot = J^+ xdot + N y, y from one least-squares problem in the self-motion (Seraji & Colbaugh's damping, J exact)."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.robots.robot import Robot

Array = np.ndarray


def original(
    robot: Robot, q: Array, xdot: Array, *, secondary: str = "augmented", base: Any = 0.01,
    E: Array | None = None, gbar: Array | None = None, gamma: Array | None = None,
    stiffness: Any = 1.0, rest: Array | None = None,
) -> Array:  # fmt: skip
    """Joint rates (B, n): y minimises |L'(q_p + N y)|^2 + |Gamma^1/2 (E (q_p + N y) - gbar)|^2, W~ = LL', q_p = J^+ xdot."""
    n, m, k = robot.n, robot.m, robot.n - robot.m
    J = robot.jacobian(q)
    base = np.asarray(base, dtype=float)
    root = np.linalg.cholesky(base if base.ndim == 2 else base * np.eye(n)).T
    K = np.asarray(stiffness, dtype=float)
    K = K if K.ndim == 2 else K * np.eye(n)
    gradient = (q - (0.0 if rest is None else rest)) @ K
    dJ = robot.jacobian_derivative(q) if secondary == "extended" else J
    if E is None:
        E = np.eye(n)[:k]
        E[-1] = 1.0
    E = np.broadcast_to(E, (len(q), *np.shape(E)[-2:]))
    gbar = np.broadcast_to(0.0 if gbar is None else gbar, E.shape[:2])
    weight = np.sqrt(np.broadcast_to(1.0 if gamma is None else gamma, E.shape[1]))
    qdot = np.empty((len(q), n))
    for i in range(len(q)):
        Q, R = np.linalg.qr(J[i].T, mode="complete")
        N, particular = Q[:, m:], Q[:, :m] @ np.linalg.solve(R[:m].T, xdot[i])
        rows, wanted = weight[:, None] * E[i], weight * gbar[i]
        if secondary == "extended":  # of N followed by projecting it
            dN = -np.linalg.pinv(J[i]) @ dJ[i] @ N
            rows, wanted = N.T @ K + np.einsum("jna,n->aj", dN, gradient[i]), np.zeros(k)
        A = np.vstack([root, rows])
        left = np.concatenate([np.zeros(n), wanted]) - A @ particular
        qdot[i] = particular + N @ np.linalg.lstsq(A @ N, left)[0]
    return qdot
