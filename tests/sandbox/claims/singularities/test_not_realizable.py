"""The share of directions beyond the limits."""

from __future__ import annotations

import numpy as np
import pytest

from problems import robots
from sandbox.claims.claim import Trial
from sandbox.claims.singularities import approach, not_realizable
from sandbox.closed_form.eq6 import eq6

TRIAL = Trial(full=False)


def test_the_share_of_unrealizable_directions_is_counted_one_by_one() -> None:
    """By the rates of each direction, solved for itself."""
    one = approach.approach(robots.load("planar_3r"), TRIAL.rng("share"))
    t = np.array([0.3, 0.05, 1e-3])
    share = not_realizable.unrealizable(one, t, np.random.default_rng(4), eq6, 40)
    directions = np.random.default_rng(4).standard_normal((40, 2))
    directions *= approach.SPEED / np.linalg.norm(directions, axis=1)[:, None]
    over = [(np.abs(eq6(one.problem(t, xdot=row)).x) > one.robot.rate_limits).any(axis=1) for row in directions]
    assert share == pytest.approx(np.mean(over, axis=0))
    assert share[-1] > share[0]
