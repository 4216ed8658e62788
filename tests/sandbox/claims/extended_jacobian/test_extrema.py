"""Extrema drawn at random."""

from __future__ import annotations

import numpy as np

from problems import robots
from sandbox.claims.extended_jacobian.extrema import extrema, kinds, left_over, springs_of
from sandbox.tolerances import FORWARD, UNIT

ARMS = {n: robots.load(f"planar_{n}r") for n in (3, 4)}
ROUNDING = FORWARD * 8 * UNIT


def test_drawn_extrema_are_of_every_kind():
    """Minima, saddles and maxima; all of them extrema."""
    drawn = extrema(ARMS[4], np.random.default_rng(2), 200)
    low, high = kinds(ARMS[4], drawn).T
    assert (low > 0).any() and (high < 0).any() and ((low < 0) & (high > 0)).any()
    for i, q in enumerate(drawn.q):
        assert left_over(ARMS[4], springs_of(drawn.parameters, i), q) <= 1e3 * ROUNDING
