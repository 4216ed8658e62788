"""Many points on one plot."""

from __future__ import annotations

import numpy as np

from sandbox.claims import scatter


def test_thinned_keeps_what_fits():
    """At most as many as asked, the first among them, in order; all where they fit."""
    values = np.arange(1000)
    assert len(scatter.thinned(values, 300)) <= 300 and scatter.thinned(values, 300)[0] == 0
    assert (np.diff(scatter.thinned(values, 300)) > 0).all()
    assert len(scatter.thinned(values, 1000)) == 1000


def test_points_of_a_category_stay_with_it():
    """Spread around its place by less than half a step; a lone one stands on it."""
    assert (np.abs(scatter.beside(3, 9) - 3) < 0.5).all() and len(set(scatter.beside(3, 9))) == 9
    assert scatter.beside(3, 1).tolist() == [3.0]
