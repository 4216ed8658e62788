"""What the bounds are relative to."""

from __future__ import annotations

import numpy as np

from sandbox.claims.framework import (
    reach,
)
from sandbox.claims.situations import positive
from sandbox.closed_form.eq6 import eq6
from sandbox.problem import VelocityProblem
from sandbox.stacked import times
from sandbox.tolerances import FORWARD, UNIT

ROUNDING = FORWARD * 10 * UNIT * 1e3
"""Ten joints, condition numbers below 1e3."""


def test_reach_is_what_the_data_can_move():
    """At least |x|; with W = I and a = 0 it is that of |J^+||xdot|, and it scales with the data."""
    problem = positive(np.random.default_rng(3), 2, 4, 5, decades=0.5)
    plain = VelocityProblem(J=problem.J, xdot=problem.xdot, W=np.eye(4))
    x = eq6(plain).x
    expected = times(np.abs(np.linalg.pinv(plain.J)), np.abs(plain.xdot)).max(axis=-1)
    np.testing.assert_allclose(reach.reach(plain, x), expected, rtol=ROUNDING)
    np.testing.assert_allclose(reach.reach(problem, 1e9 * x), 1e9 * np.abs(x).max(axis=-1), rtol=ROUNDING)
    twice = VelocityProblem(J=problem.J, xdot=2 * problem.xdot, W=problem.W, a=2 * problem.a)
    np.testing.assert_allclose(reach.reach(twice, 0 * x), 2 * reach.reach(problem, 0 * x), rtol=ROUNDING)
