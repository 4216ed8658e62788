"""The self-motion that feedback is begun on."""

from __future__ import annotations

import numpy as np
import pytest

from problems import robots
from sandbox.claims import constrained
from sandbox.claims.extended_jacobian.extremum_feedback import _curve, _least_bend, _tilted, extrema, residual, springs_of
from sandbox.claims.postures import F1
from sandbox.tolerances import FORWARD, UNIT

ARMS = {n: robots.load(f"planar_{n}r") for n in (3, 4)}
ROUNDING = FORWARD * 8 * UNIT


def test_the_self_motion_is_closed_and_holds_the_tip():
    """Its points have the tip at (2, 1), follow one another evenly, and the last is next to the first."""
    s, curve = _curve(200)
    assert np.abs([constrained.tip(q) - constrained.tip(F1) for q in curve]).max() <= ROUNDING
    gaps = np.linalg.norm(np.diff(curve, axis=0, append=curve[:1]), axis=1)
    assert np.ptp(gaps) <= 0.01 * gaps.mean()
    assert abs(gaps.mean() - s[1]) <= 0.01 * s[1]


@pytest.mark.parametrize("start, alpha, expected", [(10, 1.0, False), (70, 1.0, True), (10, -1.0, True), (45, -1.0, False)])
def test_the_way_downhill_bends_where_it_should(start, alpha, expected):
    """Of g = cos s, 100 places a round, the minimum is at 50: from 70 the way there is convex, from 10 it is not."""
    s = 2 * np.pi * np.arange(100) / 100
    least = _least_bend(start, -np.sin(s), -np.cos(s), alpha)
    assert (least > 0) == expected


def test_tilted_springs_are_off_by_what_is_asked():
    """|N'grad g| at the extremum is the number given."""
    drawn = extrema(ARMS[4], np.random.default_rng(3), 1)
    g = _tilted(drawn.q[0], springs_of(drawn.parameters, 0), 1e-3)
    assert abs(residual(g, drawn.q[0]) / 1e-3 - 1) <= 1e-9
