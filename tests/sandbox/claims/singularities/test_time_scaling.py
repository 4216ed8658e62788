"""The time that a scaled hand takes."""

from __future__ import annotations

import numpy as np

from sandbox.claims.singularities import time_scaling
from sandbox.law import rates


def test_the_scaled_hand_comes_to_the_full_stretch() -> None:
    """Its joints run at their limits there, so it takes longer than asked for, and arrives."""
    (check,), plot = time_scaling._time_to_stretch(rates)
    scaled, asked = plot.series
    assert check.holds
    assert np.max(scaled.x) > np.max(asked.x)
    assert (np.diff(scaled.x) > 0).all() and scaled.y[-1] < 1e-3 * scaled.y[0]
