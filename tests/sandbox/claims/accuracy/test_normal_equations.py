"""The exact side of the condition numbers, and the matrix that the kernel factors."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

from sandbox.claims.exact_condition import exactly
from sandbox.claims.single_compiled import factored
from sandbox.tolerances import UNIT

F1 = np.array([[[-1.0, -1, 0], [2, 1, 1]]])


def test_exact_condition_of_a_textbook_arm() -> None:
    """Planar 3R at (0, pi/2, -pi/2): J J' has the eigenvalues 4 +- sqrt 13."""
    square, formed, printed = exactly(F1, np.eye(3)[None])
    assert square[0] == pytest.approx((4 + math.sqrt(13)) / (4 - math.sqrt(13)), rel=4 * UNIT)
    assert formed[0].tolist() == printed[0].tolist() == [[2, -3], [-3, 6]]
    assert factored(F1)[0] == pytest.approx(formed[0], rel=8 * UNIT)


def test_exact_matrices_for_a_weight() -> None:
    """W = diag(1, 4, 16) by hand: J W^-1 J' and J W J'; the kernel factors the former."""
    L = np.diag([1.0, 2.0, 4.0])[None]
    square, formed, printed = exactly(F1, L)
    assert formed[0].tolist() == [[1.25, -2.25], [-2.25, 4.3125]]
    assert printed[0].tolist() == [[5, -6], [-6, 24]]
    assert factored(F1, L @ L)[0] == pytest.approx(formed[0], rel=8 * UNIT)
    trace, product = Fraction(89, 16), Fraction(5, 4) * Fraction(69, 16) - Fraction(81, 16)
    gap = math.sqrt(trace**2 - 4 * product)
    assert square[0] == pytest.approx((float(trace) + gap) / (float(trace) - gap), rel=1e-13)


def test_what_has_no_cholesky_factor_is_not_a_matrix() -> None:
    """A Jacobian of lower rank leaves NaN."""
    assert np.isnan(factored(np.array([[[1.0, 2, 3], [1, 2, 3]]]))).all()
