"""Where the paths begin."""

from __future__ import annotations

import numpy as np

from problems import robots
from sandbox.claims import constrained
from sandbox.claims.claim import Trial
from sandbox.claims.constrained import PLANAR
from sandbox.claims.extended_jacobian.maintains_an_extremum import _starts, circle

ARMS = {n: robots.load(f"planar_{n}r") for n in (3, 4)}


def test_the_path_begins_at_extrema_that_stay_clear_of_bifurcation():
    """Each start is found again after one round by root finding alone."""
    path = circle(0.15, 4.0)
    for _, q0, g in _starts(ARMS[3], Trial(full=False).rng("test"), path, 20):
        q = q0
        for place in constrained.tip(q0) + path.displacement(np.linspace(0.0, 4.0, 13))[:, :2]:
            q = constrained.extremum(PLANAR, g.gradient, place, q)
        np.testing.assert_allclose(q, q0, rtol=0, atol=1e-10)
