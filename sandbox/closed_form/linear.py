"""Cholesky factors and scalings of stacks, for the closed forms."""

from __future__ import annotations

import numpy as np

from sandbox.closed_form.compiled import compiled
from sandbox.tolerances import POSITIVE_PIVOT, UNIT

Array = np.ndarray


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
