"""Kantorovich's limit, and the compliances drawn."""

from __future__ import annotations

import numpy as np
import pytest

from sandbox.claims.weightings.stiffness_weight import compliances, kantorovich


@pytest.mark.parametrize("kappa", [2.0, 10.0, 100.0])
def test_the_limit_of_a_wrong_metric_is_attained_and_never_exceeded(kappa):
    """Two joints, one task row, K = diag(1, kappa), W = I: the worst row spends (kappa - 1)^2 / 4 kappa more."""
    angle = np.linspace(0.0, np.pi / 2, 100_001)
    j = np.stack([np.cos(angle), np.sin(angle)])
    spent = j[0] ** 2 + kappa * j[1] ** 2  # of qdot = j, for the task 1
    least = 1 / (j[0] ** 2 + j[1] ** 2 / kappa)
    worst = (spent / least).max() - 1
    limit = kantorovich(np.array(kappa))
    assert worst <= limit * (1 + 1e-12)
    assert worst >= limit * (1 - 1e-6)


def test_compliances_are_definite_and_of_condition_up_to_a_hundred():
    """Symmetric, positive, and some of them far from a multiple of I."""
    C = compliances(np.random.default_rng(0), 200, 4)
    np.testing.assert_array_equal(C, np.swapaxes(C, 1, 2))
    conditions = np.linalg.cond(C)
    assert (np.linalg.eigvalsh(C) > 0).all() and conditions.max() <= 100 and conditions.max() > 20
