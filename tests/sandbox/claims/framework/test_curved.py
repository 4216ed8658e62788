"""Problems of whole numbers of a chosen kind, and their arithmetic."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from sandbox.claims.framework import (
    curved,
)
from sandbox.claims.situations import SIZES
from sandbox.reference.truth import truth

KINDS = [(m, n, kind) for m, n in SIZES for kind in curved.KINDS if n - m > 1 or not kind.startswith("saddle")]
"""One degree of redundancy has one curvature, and no saddle."""


@pytest.mark.parametrize("m, n, kind", KINDS)
def test_a_problem_is_of_the_kind_asked_for(m, n, kind):
    """The exact reference finds the kind that was constructed, and N spans null J without rounding."""
    drawn = curved.curved(np.random.default_rng(1), m, n, kind)
    assert curved.EXACT_KIND[truth(drawn.problem).reason] == drawn.kind == kind
    assert not (drawn.problem.J @ drawn.N).any() and np.linalg.matrix_rank(drawn.N) == n - m


def test_one_degree_of_redundancy_has_no_saddle():
    """Of all kinds only those are drawn that the size has room for, each as often."""
    rng = np.random.default_rng(1)
    assert [one.kind for one in curved.curved_of_all_kinds(rng, 2, 3, 2)] == ["minimum"] * 2 + ["maximum"] * 2 + ["flat"] * 2
    assert {one.kind for one in curved.curved_of_all_kinds(rng, 2, 4, 1)} == set(curved.KINDS)


def test_fractions_lose_nothing():
    """A float becomes the rational it is, and the objective of fractions is a fraction."""
    assert curved.rational([0.1])[0] == Fraction(0.1) != Fraction(1, 10)
    W, a, x = curved.rational(np.diag([3.0, 5])), curved.rational([1.0, 2]), np.array([Fraction(1, 3), Fraction(1, 7)])
    assert curved.objective(W, a, x) == Fraction(1, 6) + Fraction(5, 98) + Fraction(1, 3) + Fraction(2, 7)
