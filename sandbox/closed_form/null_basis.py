"""Bases of null J: the paper's, from the column-pivoted LU, and the orthonormal one."""

from __future__ import annotations

from typing import Any

import numpy as np

from sandbox import check
from sandbox.closed_form.compiled import compiled
from sandbox.closed_form.linear import power_of_two
from sandbox.errors import ShapeError
from sandbox.stacked import svd

Array = np.ndarray


def pivoted(J: Any) -> Array:
    """N (..., n, n - m) with JN = 0 that is the identity on the joints no row of J (..., m, n) pivots on.

    Column-pivoted LU of J and back-substitution (section IV, English & Maciejewski). Where a row of J vanishes in the
    elimination the orthonormal basis stands instead: eq. (6) refuses that member by its singular values.

    Raises ShapeError for n < m, and what check.real raises.
    """
    J = _jacobian(J)
    m, n = J.shape[-2:]
    stack = np.array(J, order="C").reshape(-1, m, n)
    N, code = np.empty((len(stack), n, n - m)), np.empty(len(stack), dtype=np.int64)
    compiled("null_basis_stack")(stack, N, code)
    lost = ~np.isfinite(N).all(axis=(1, 2)) | (code != 0)
    if lost.any():
        N[lost] = orthonormal(stack[lost])
    return N.reshape(*J.shape[:-2], n, n - m)


def orthonormal(J: Any) -> Array:
    """N (..., n, n - m) with JN = 0, N'N = I: the last right singular vectors of J (..., m, n), rows scaled near one.

    Raises ShapeError for n < m, and what check.real raises.
    """
    J = _jacobian(J)
    m, n = J.shape[-2:]
    stack = J.reshape(-1, m, n)
    N: Array = svd(stack / power_of_two(np.abs(stack).max(axis=-1))[:, :, None])[2][:, :, m:]
    return N.reshape(*J.shape[:-2], n, n - m)


def _jacobian(J: Any) -> Array:
    J = check.matrices(J, "J")
    check.shape(J, ("m", "n"), {}, "J")
    m, n = J.shape[-2:]
    if n < m:
        raise ShapeError(f"J is {m} x {n}: with more rows than joints a basis of null J has no fixed size", field="J")
    return J
