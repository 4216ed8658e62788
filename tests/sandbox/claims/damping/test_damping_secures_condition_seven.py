"""Conflicts that are exact."""

from __future__ import annotations

import numpy as np
import pytest

from sandbox.claims.damping.damping_secures_condition_seven import SIZES, conflicting
from sandbox.claims.equations import reduced_weight
from sandbox.claims.postures import J1
from sandbox.reference.exact import Dyadic


@pytest.mark.parametrize("m, n", SIZES)
def test_conflicts_are_exact(m, n):
    """J has full row rank and [J; E] has not, decided on integers."""
    problem = conflicting(np.random.default_rng(7), m, n, 20, np.zeros((20, n, n)))
    assert problem.W.E is not None
    for J, E in zip(problem.J, problem.W.E, strict=True):
        assert Dyadic.of(J).integers.rank() == m
        assert Dyadic.of(np.concatenate([J, E])).integers.rank() < n
        assert np.abs(np.concatenate([J, E])).max() < 100


def test_damped_curvature_is_at_least_that_of_the_base():
    """In conflict N'WN is N'W~N alone: its smallest eigenvalue is that of W~ = 0.01 I."""
    conflict = np.array([[1.0, 1, 0]])
    assert reduced_weight(J1, 0.01 * np.eye(3) + conflict.T @ conflict)[0, 0] == pytest.approx(0.01, rel=1e-12)
    assert abs(reduced_weight(J1, conflict.T @ conflict)[0, 0]) < 1e-30
