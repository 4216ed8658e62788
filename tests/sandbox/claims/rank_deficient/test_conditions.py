"""Exact determinants, and saddles."""

from __future__ import annotations

import numpy as np
import pytest

from sandbox.claims.claim import Trial
from sandbox.claims.rank_deficient import conditions, posed
from sandbox.closed_form.eq13 import eq13
from sandbox.solution import Status
from sandbox.tolerances import ORIGINAL, UNIT

RNG = Trial().rng("tests of rank_deficient")


def test_determinants_are_those_of_the_four_matrices() -> None:
    """Exact, so that rounding them is what floats are off by."""
    one = posed.posed(posed.drawn(RNG, 4, 6, 3, *posed.KINDS[4]))
    J, _, W, _, _, Wx = one.parts
    image = J @ one.R
    first = np.vstack([one.R.T @ J.T @ Wx @ J, one.N.T @ W])
    matrices = (first, np.hstack([one.R, one.N]), image.T @ Wx @ image, one.N.T @ W @ one.N)
    for exact, matrix in zip(conditions.determinants(one.problem, one.N, one.R), matrices, strict=True):
        assert np.linalg.det(matrix) == pytest.approx(exact, rel=ORIGINAL * 6 * UNIT * np.linalg.cond(matrix))


def test_a_saddle_is_beaten_and_a_minimum_is_not() -> None:
    """What eq. (13) as printed gives where W or Wx is not positive where it must be."""
    kinds = {"positive definite": False, "negative on null J": True}
    for W, beaten in kinds.items():
        one = posed.posed(posed.drawn(RNG, 3, 5, 2, "unachievable", "identity", W))
        assert conditions._beaten(one) is beaten
    one = posed.posed(posed.drawn(RNG, 3, 5, 2, "unachievable", "P indefinite", "positive definite"))
    assert conditions._beaten(one)


def test_the_fault_that_accepts_any_nonsingular_matrix_accepts_a_saddle() -> None:
    """The problem that eq13 refuses is answered."""
    one = posed.drawn(RNG, 3, 5, 2, "unachievable", "identity", "negative on null J")
    assert eq13(one.stacked()).status[0] is Status.CONDITION_SEVEN
    assert conditions.any_nonsingular(eq13)(one.stacked()).status[0] is Status.SOLVED
