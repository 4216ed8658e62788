"""Finsler's threshold."""

from __future__ import annotations

import numpy as np
import pytest

from sandbox.claims.framework import (
    beyond_positive_definite,
    small_arms,
)
from sandbox.claims.situations import indefinite
from sandbox.tolerances import FORWARD, UNIT

ROUNDING = FORWARD * 10 * UNIT * 1e3
"""Ten joints, condition numbers below 1e3."""


def test_finslers_threshold_is_the_one_worked_out():
    """Planar 3R, W = diag(-1, 1, 1): sqrt(2) - 1; and for W = I, which needs none, -1/sigma_max^2."""
    assert beyond_positive_definite.finsler_threshold(small_arms.J1, np.diag([-1.0, 1, 1])) == pytest.approx(
        np.sqrt(2) - 1, abs=ROUNDING
    )
    largest = np.linalg.norm(small_arms.J1, 2)
    assert beyond_positive_definite.finsler_threshold(small_arms.J1, np.eye(3)) == pytest.approx(-1 / largest**2, abs=ROUNDING)


def test_the_threshold_divides_definite_from_indefinite():
    """W + c J'J has a positive smallest eigenvalue just above c*, a negative one just below, zero at it."""
    problem = indefinite(np.random.default_rng(2), 3, 6, 20, decades=0.5)
    for J, W in zip(problem.J, problem.W.dense(), strict=True):
        c = beyond_positive_definite.finsler_threshold(J, W)
        below, at, above = (np.linalg.eigvalsh(W + c * share * J.T @ J)[0] for share in (0.999, 1.0, 1.001))
        assert below < -ROUNDING < at < ROUNDING < above
