"""Stacked linear algebra in which one bad member leaves its neighbours unharmed: it gets NaN, nothing is raised."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from sandbox.closed_form.compiled import compiled
from sandbox.tolerances import POSITIVE_PIVOT, UNIT

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


def cholesky(A: Array) -> tuple[Array, Array]:
    """(L, positive) with A = L L'; `positive` is False where A is not positive definite beyond rounding.

    Where it is not, L is the identity.
    """
    L = np.array(A, dtype=np.float64)
    code = np.empty(len(L), dtype=np.int64)
    compiled("cholesky_stack")(L, code)
    L = np.tril(L)
    positive = (code == 0) & (pivot_share(L) > POSITIVE_PIVOT * L.shape[-1] * UNIT)
    L[~positive] = np.eye(A.shape[-1])
    return L, positive


def pivot_share(L: Array) -> Array:
    """Smallest pivot of a Cholesky factor (B, n, n) as a share of its diagonal entry (B,).

    The pivot is L_ii^2, the diagonal entry sum_j L_ij^2: nothing but L is needed.
    """
    lower = np.tril(L)
    share: Array = (np.diagonal(lower, axis1=-1, axis2=-2) ** 2 / np.square(lower).sum(axis=-1)).min(axis=-1)
    return share


def equilibrated(A: Array, b: Array) -> tuple[Array, Array]:
    """The same equations A x = b (A (B, p, q), b (B, p)), every row scaled by a power of two to entries near one."""
    scale = power_of_two(np.abs(A).max(axis=-1))
    return A / scale[:, :, None], b / scale


def power_of_two(size: Array) -> Array:
    """The power of two just above `size`, 1 where that is 0: scaling by it rounds nothing."""
    _, exponent = np.frexp(np.where(np.isfinite(size), size, 1.0))
    return np.where(size > 0, np.ldexp(1.0, exponent), 1.0)
