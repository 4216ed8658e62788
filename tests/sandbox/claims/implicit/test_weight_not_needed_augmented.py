"""Exact rates near an algorithmic singularity."""

from __future__ import annotations

import numpy as np
import pytest

from problems.implicit.augmented import augmented_along
from sandbox.claims import equations
from sandbox.claims.claim import Trial
from sandbox.claims.implicit.weight_not_needed_augmented import FAR, half_projected, near_singular, nearest, system


def test_near_a_singularity_the_explicit_weight_loses_the_square():
    """Halfway to rounding, at d = 1e-6, the explicit W has lost about ten more digits' worth of 1/d than the factors."""
    distances, errors = near_singular(Trial(full=False), augmented_along, equations.augmented, np.random.default_rng(0))
    at = int(np.argmin(np.abs(distances - 1e-6)))
    assert errors["explicit"][at] > 1e3 * errors["factored"][at]
    assert (errors["factored"] < 1e-6).all()
    wrong = near_singular(Trial(full=False), half_projected(augmented_along), equations.augmented, np.random.default_rng(0))[1]
    assert (wrong["factored"][1:] > 1e-2).all()


def test_d_is_the_distance_from_singularity():
    """The determinant of [J; E] is -d, and there is a decade of d at least beyond which the explicit weight is judged."""
    for d in (1.0, 1e-3, 2.0**-20):
        assert np.linalg.det(system(d)) == pytest.approx(-d, rel=1e-9)
    assert FAR <= 1e-3


def test_the_error_nearest_to_a_distance():
    """The entry whose distance is nearest by ratio; what is not finite is told in words."""
    distances = np.array([1.0, 1e-4, 1e-8])
    assert nearest(distances, np.array([1.0, 2.0, np.inf]), 2e-4) == 2.0
    assert nearest(distances, np.array([1.0, 2.0, np.inf]), 1e-8) == "singular"
