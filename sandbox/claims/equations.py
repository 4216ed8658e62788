"""The paper's displayed equations as they are printed, for one problem, in numpy alone.

Nothing here is clever, stacked or checked: this is the other side of a comparison. J (m, n), xdot (m,), W (n, n),
gradf (n,), N (n, k); [rad/s, m/s].
"""

from __future__ import annotations

import numpy as np

Array = np.ndarray


def generalized_inverse(J: Array, W: Array) -> Array:
    """Eq. (5): G = W^-1 J' (J W^-1 J')^-1."""
    V = np.linalg.inv(W)
    return V @ J.T @ np.linalg.inv(J @ V @ J.T)


def liegeois(J: Array, xdot: Array, W: Array, gradf: Array, alpha: float) -> Array:
    """Eqs. (2)-(5): qdot = G xdot + (I - G J) z, z = -alpha W^-1 grad f, G1 = G2 = G."""
    G = generalized_inverse(J, W)
    z = -alpha * np.linalg.inv(W) @ gradf
    return G @ xdot + (np.eye(len(z)) - G @ J) @ z


def null_space(J: Array, rank: int | None = None) -> Array:
    """N_J, orthonormal, by singular value decomposition."""
    return np.linalg.svd(J)[2][len(J) if rank is None else rank :].T


def augmented(J: Array, xdot: Array, W: Array, gradf: Array, alpha: float, N: Array | None = None) -> Array:
    """Eq. (6): [J; N'W] qdot = [xdot; -alpha N' grad f]."""
    N = null_space(J) if N is None else N
    return np.linalg.solve(np.vstack([J, N.T @ W]), np.concatenate([xdot, -alpha * N.T @ gradf]))


def reduced_weight(J: Array, W: Array) -> Array:
    """N_J' W N_J of condition (7), N_J orthonormal."""
    N = null_space(J)
    return N.T @ W @ N


def rank_deficient(J: Array, xdot: Array, W: Array, gradf: Array, alpha: float, Wx: Array, N: Array, R: Array) -> Array:
    """Eq. (13): [R'J'Wx J; N'W] qdot = [R'J'Wx xdot; -alpha N' grad f]."""
    matrix = np.vstack([R.T @ J.T @ Wx @ J, N.T @ W])
    return np.linalg.solve(matrix, np.concatenate([R.T @ J.T @ Wx @ xdot, -alpha * N.T @ gradf]))
