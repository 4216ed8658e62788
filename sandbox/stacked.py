"""Stacked linear algebra in which one bad member leaves its neighbours unharmed: it gets NaN, nothing is raised."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

Array = np.ndarray


def transpose(A: Array) -> Array:
    """A' of every member."""
    return np.swapaxes(A, -1, -2)


def times(A: Array, v: Array) -> Array:
    """A v of every member, v (B, n)."""
    product: Array = (A @ v[..., None])[..., 0]
    return product


def symmetric(A: Array) -> Array:
    """(A + A')/2: symmetric to the last bit."""
    return (A + transpose(A)) / 2


def _guarded(function: Callable[[Array], Any], A: Array) -> tuple[Any, Array]:
    """`function` of the stack A with members that are not finite replaced by zero, and the mask of those that are."""
    finite = np.isfinite(A).all(axis=(-1, -2))
    return function(np.where(finite[:, None, None], A, 0.0)), finite


def svd(A: Array) -> tuple[Array, Array, Array]:
    """(U, sigma, V) of every member of A (B, m, n), complete: A = U Sigma V'."""
    (U, sigma, Vt), finite = _guarded(np.linalg.svd, A)
    sigma[~finite] = np.nan
    return U, sigma, transpose(Vt)


def eigenvalues(A: Array) -> Array:
    """Ascending eigenvalues (B, k) of symmetric A (B, k, k)."""
    values, finite = _guarded(np.linalg.eigvalsh, A)
    values[~finite] = np.nan
    return values  # type: ignore[no-any-return]


def solve(A: Array, B: Array) -> Array:
    """A^-1 B for A (b, n, n), B (b, n, p); NaN for a member that is singular to the last bit."""
    try:
        return np.linalg.solve(A, B)
    except np.linalg.LinAlgError:
        out = np.full(np.broadcast_shapes(B.shape), np.nan)
        for i in range(len(A)):
            try:
                out[i] = np.linalg.solve(A[i], B[i])
            except np.linalg.LinAlgError:
                continue
        return out
