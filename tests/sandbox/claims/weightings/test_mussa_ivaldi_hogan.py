"""Postures in balance with a force, and a force of the wrong sign."""

from __future__ import annotations

import numpy as np

from problems import robots
from sandbox.claims.postures import F1
from sandbox.claims.weightings.mussa_ivaldi_hogan import IMPEDANCE, balanced, force_turned

ARM = robots.load("planar_3r")


def test_rest_postures_balance_the_force():
    """Springs at rest - J'F pull by J'F."""
    F = np.array([[-1.0, -1.0]])
    rest = balanced(ARM, F1[None], F)
    np.testing.assert_allclose(rest[0], (1.0, np.pi / 2, 1 - np.pi / 2), rtol=0, atol=1e-14)


def test_a_force_of_the_wrong_sign_gives_another_weight():
    """C^-1 + Gamma and C^-1 - Gamma add up to 2 C^-1."""
    rest = np.array([1.0, np.pi / 2, 1 - np.pi / 2])
    given = F1[None], np.zeros((1, 2))
    right = IMPEDANCE.cast(ARM, *given, rest=rest).W.dense()[0]
    wrong = force_turned(ARM, *given, rest=rest).W.dense()[0]
    np.testing.assert_allclose(right + wrong, 2 * np.eye(3), rtol=0, atol=1e-14)
    assert np.abs(right - wrong).max() > 1
