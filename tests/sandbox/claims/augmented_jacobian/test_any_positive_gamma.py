"""Eq. (6) on rationals and with a base beside (8)."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from sandbox.claims.augmented_jacobian.any_positive_gamma import DECADES, rates_of, run
from sandbox.claims.numbers import half_unit
from sandbox.claims.postures import HAND_ANGLE, J1
from sandbox.closed_form.kernels import CURVATURE, SOLVED
from sandbox.closed_form.uncompiled import eq6_on


def test_rational_rates_are_exact():
    """On rationals (8)-(10) in (6) give (ydot - om, om - xdot - ydot, om + xdot) at F1 with no error at all, for any gamma."""
    x, y, om = Fraction(3, 8), Fraction(-11, 16), Fraction(7, 8)
    for exponent in DECADES:
        found = rates_of(
            eq6_on, Fraction, J1, np.array([0.375, -0.6875]), HAND_ANGLE, np.array([0.875]), [Fraction(10) ** exponent]
        )
        assert tuple(found) == (y - om, om - x - y, om + x)


def test_codes_tell_a_conflict():
    """A function whose gradient lies in range J' stops (6) at its last pivot, one that does not passes."""
    given = (J1, np.array([0.5, 0.25]))
    assert run(eq6_on, Fraction, *given, HAND_ANGLE, np.array([1.0]), [1])[0] == SOLVED
    assert run(eq6_on, Fraction, *given, np.array([[1.0, 1, 0]]), np.array([1.0]), [1])[0] == CURVATURE


def test_the_base_stands_beside_the_functions():
    """With a base (6) minimises 1/2 qdot'(W~ + e e')qdot - gbar e'qdot on the constraint: M19 by hand."""
    base, e = 0.01 * np.diag([1.0, 2, 3]), np.ones(3)
    found = rates_of(eq6_on, float, J1, np.array([0.3, -0.7]), e[None], np.array([0.9]), [1.0], base).astype(float)
    np.testing.assert_allclose(found, [-1.526415094340, 1.226415094340, 1.126415094340], atol=half_unit(12))
