"""Section V in single precision by the compiled kernels, and the matrix that eqs. (2)-(5) factor."""

from __future__ import annotations

from typing import Any

import numpy as np

from sandbox.closed_form.compiled import compiled

Array = np.ndarray


def by_kernels(q: Array, xdot: Array) -> tuple[Array, Array, Array, Array]:
    """Both methods on a planar arm of unit links, W = I, alpha = 0, q (B, n) [rad], xdot (B, 2) [m/s], all in float32.

    Returns J (B, 2, n), the rates (2, B, n) of (2)-(5) and of (6), and |xdot - J qdot| (2, B) evaluated in float32
    and in float64. Nothing is refused: where a pivot is not positive the rates are NaN. Source: sections IV and V.
    """
    J = planar_jacobian(q)
    B, m, n = J.shape
    none, zero = np.zeros((B, 0, 0), np.float32), np.zeros((B, n), np.float32)
    rates = np.full((2, B, n), np.nan, np.float32)
    y, code, alpha = np.empty((B, m), np.float32), np.empty(B, np.int64), np.float32(0)
    L, M = np.empty((B, n, n), np.float32), np.empty((B, m, m), np.float32)
    compiled("eq2_5_stack")(J, xdot, none, zero, alpha, False, rates[0], y, L, M, code)
    E, pivot, bound = np.zeros((B, 0, n), np.float32), np.empty((B, n), np.float32), np.empty((B, n), np.float32)
    compiled("eq6_stack")(J, xdot, none, E, none, zero, alpha, False, rates[1], y, pivot, bound, code)
    return J, rates, residual(J, xdot, rates, np.float32), residual(J, xdot, rates, np.float64)


def planar_jacobian(q: Array) -> Array:
    """J (B, 2, n) of the tip, relative joint angles, unit links; q float32, every sine and sum rounded to float32.

    The sines are those of double precision, rounded: the nearest float32, the same on every machine.
    """
    angle = q.copy()
    for i in range(1, q.shape[1]):
        angle[:, i] += angle[:, i - 1]
    J = np.stack([-np.sin(angle, dtype=np.float64), np.cos(angle, dtype=np.float64)], axis=1).astype(np.float32)
    for i in range(q.shape[1] - 2, -1, -1):
        J[:, :, i] += J[:, :, i + 1]
    return J


def residual(J: Array, xdot: Array, rates: Array, dtype: Any) -> Array:
    """|xdot - J qdot| (2, B), every operation rounded to `dtype`, sums from left to right."""
    J, xdot, rates = J.astype(dtype), xdot.astype(dtype), rates.astype(dtype)
    actual = J[:, :, 0] * rates[:, :, None, 0]
    for j in range(1, J.shape[2]):
        actual = actual + J[:, :, j] * rates[:, :, None, j]
    square = (xdot - actual) ** 2
    return np.sqrt(square[..., 0] + square[..., 1])


def factored(J: Array, W: Array | None = None) -> Array:
    """The matrix (B, m, m) that the kernel of eqs. (2)-(5) factors, multiplied out from its Cholesky factor; W None is I."""
    B, m, n = J.shape
    J = np.ascontiguousarray(J, dtype=np.float64)
    weight = np.zeros((B, 0, 0)) if W is None else np.ascontiguousarray(W, dtype=np.float64)
    x, y, code = np.empty((B, n)), np.empty((B, m)), np.empty(B, np.int64)
    L, M = np.zeros((B, n, n)), np.zeros((B, m, m))
    compiled("eq2_5_stack")(J, np.zeros((B, m)), weight, np.zeros((B, n)), 0.0, W is not None, x, y, L, M, code)
    lower = np.tril(M)
    return np.where((code == 0)[:, None, None], lower @ lower.transpose(0, 2, 1), np.nan)
