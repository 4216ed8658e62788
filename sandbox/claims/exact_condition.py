"""Condition numbers of normal equations in exact rationals; python-flint alone."""

from __future__ import annotations

from typing import Any

import numpy as np
from flint import fmpq, fmpq_mat

Array = np.ndarray


def exactly(J: Array, L: Array) -> tuple[Array, Array, Array]:
    """cond2(J L^-T)^2 (B,), J W^-1 J' and J W J' (B, m, m) with W = L L', J (B, m, n), L (B, n, n) lower triangular.

    Floats are taken for the rationals they are; what is returned is rounded once. Source: eq. (5) and section V.
    """
    conditions, formed, printed = [], [], []
    for j, factor in zip(J, L, strict=True):
        Jq, Lq = _rational(j), _rational(factor)
        scaled = Jq * Lq.transpose().inv()
        conditions.append(_squared_condition(scaled))
        formed.append(_nearest(scaled * scaled.transpose()))
        printed.append(_nearest(Jq * Lq * Lq.transpose() * Jq.transpose()))
    return np.array(conditions), np.array(formed), np.array(printed)


def _squared_condition(J: fmpq_mat) -> float:
    """(sigma_1 / sigma_m)^2: [0 J; J' 0] has the eigenvalues +-sigma_i, and n - m zeros; J J' is not formed."""
    m, n = J.nrows(), J.ncols()
    rows = [[fmpq(0)] * m + row for row in J.tolist()] + [row + [fmpq(0)] * n for row in J.transpose().tolist()]
    characteristic = fmpq_mat(rows).charpoly()
    in_squares = type(characteristic)(characteristic.coeffs()[n - m :: 2])
    roots: Any = in_squares.complex_roots()  # each with its multiplicity, which the library's stubs leave out
    squares = [float(root.real) for root, _ in roots]
    return max(squares) / min(squares)


def _rational(values: Array) -> fmpq_mat:
    return fmpq_mat([[fmpq(*value.as_integer_ratio()) for value in row] for row in values.tolist()])


def _nearest(values: fmpq_mat) -> list[list[float]]:
    return [[int(value.p) / int(value.q) for value in row] for row in values.tolist()]
