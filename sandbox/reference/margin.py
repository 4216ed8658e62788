"""How far a problem is from the next class: relative perturbations, in float64."""

from __future__ import annotations

import numpy as np

Array = np.ndarray


def spaces(J: Array, rank: int) -> tuple[float, Array]:
    """(sigma_r / sigma_1, N): of J with its rows scaled to length one, and an orthonormal basis of null(J).

    J (m, n) has the exact rank r; its further singular values, zero but for rounding, do not count. Row scaling
    leaves null(J) alone. The ratio is inf for rank 0: there is no rank to lose.
    """
    if rank == 0:
        return np.inf, np.eye(J.shape[1])
    J = J / np.abs(J).max(axis=1, initial=0.0, keepdims=True).clip(np.finfo(float).tiny)
    J = J / np.linalg.norm(J, axis=1, keepdims=True).clip(np.finfo(float).tiny)  # zero rows stay zero
    _, sigma, Vt = np.linalg.svd(J)
    return float(sigma[rank - 1] / sigma[0]), Vt[rank:].T


def curvature(W: Array, N: Array) -> float:
    """|lambda_min(N'WN)| / |W|_2, N with orthonormal columns: what W must change for that eigenvalue to vanish.

    Where N'WN is positive definite its smallest eigenvalue decides the class, elsewhere its most negative one does.
    0 where W itself, formed from its factors, leaves the range of float64: nothing can be decided there.
    """
    largest = np.abs(W).max()
    if not 0 < largest < np.inf:  # NaN fails too
        return 0.0
    W = W / largest
    return float(abs(np.linalg.eigvalsh(N.T @ W @ N)[0]) / np.abs(np.linalg.eigvalsh(W)).max())


def target_curvature(Wx: Array, columns: Array) -> float:
    """|lambda| / |Wx|_2 of the eigenvalue of Wx on range(J) that decides; `columns` (m, r) span range(J).

    With a negative eigenvalue it is the most negative one, otherwise the smallest. `curvature` of that subspace.
    """
    return curvature(Wx, _orthonormal(columns))


def inconsistency(xdot: Array, columns: Array) -> float:
    """|(I - J J^+) xdot| / |xdot|: what xdot must change to be in range(J), spanned by `columns` (m, r)."""
    xdot = xdot / np.abs(xdot).max()
    Q = _orthonormal(columns)
    rest = xdot - Q @ (Q.T @ xdot)
    rest -= Q @ (Q.T @ rest)  # the second pass removes what rounding of the first left
    return float(np.linalg.norm(rest) / np.linalg.norm(xdot))


def slack_curvature(J: Array, W: Array, Wx: Array) -> float:
    """`curvature` of the arm with slack joints: J~ = [J I], W~ = blkdiag(W, Wx) (methods C1; W carries lambda^2)."""
    m, n = J.shape
    N = _orthonormal(np.vstack([np.eye(n), -J]))
    return curvature(np.block([[W, np.zeros((n, m))], [np.zeros((m, n)), Wx]]), N)


def _orthonormal(columns: Array) -> Array:
    return np.linalg.qr(columns / np.abs(columns).max(axis=0, initial=0.0).clip(np.finfo(float).tiny))[0]
