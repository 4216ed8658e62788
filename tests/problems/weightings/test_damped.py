"""W~ + W."""

from __future__ import annotations

import numpy as np
import pytest

from problems.weightings.augmented import augmented
from problems.weightings.damped import damped
from sandbox.errors import ShapeError, WeightNotPositiveDefiniteError

E = np.random.default_rng(0).standard_normal((4, 1, 3))


@pytest.mark.parametrize("base", [0.5, np.array([0.5, 1.0, 2.0]), np.array([[1.0, 0.2, 0], [0.2, 1, 0], [0, 0, 1]])])
def test_base_is_added_and_factors_are_kept(base):
    """W~ + E'E, with E still its own factor, is positive definite."""
    weight = damped(augmented(E), base)
    added = base if np.ndim(base) == 2 else base * np.eye(3)
    np.testing.assert_array_equal(weight.base, np.broadcast_to(added, (4, 3, 3)))
    np.testing.assert_array_equal(weight.E, E)
    assert (np.linalg.eigvalsh(weight.dense())[:, 0] > 0).all()
    assert (np.linalg.eigvalsh(augmented(E).dense())[:, 0] < 1e-14).all()


@pytest.mark.parametrize("base", [0.0, -0.1, np.array([1.0, 1.0, 0.0]), np.ones((3, 3)), np.diag([1.0, 1.0, -1e-12])])
def test_refuses_a_base_that_is_not_positive_definite(base):
    """Zero, negative and singular to rounding, by eigenvalue or diagonal entry."""
    with pytest.raises(WeightNotPositiveDefiniteError, match="base is not positive definite: ") as refusal:
        damped(augmented(E), base)
    assert refusal.value.evidence["lambda_min"] <= 1e-15


def test_refuses_a_base_for_other_configurations():
    """Three bases for four weights are refused by the field."""
    with pytest.raises(ShapeError, match="base"):
        damped(augmented(E), np.stack([np.eye(3)] * 3))
    assert damped(augmented(E), np.stack([np.eye(3)] * 4)).lead == (4,)
