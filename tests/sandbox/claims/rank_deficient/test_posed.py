"""Problems of a known rank: exact bases, and what errors are relative to."""

from __future__ import annotations

import numpy as np
import pytest

from problems import robots
from sandbox.claims.claim import Trial
from sandbox.claims.rank_deficient import minimiser, posed
from sandbox.problem import VelocityProblem
from sandbox.tolerances import UNIT

RNG = Trial().rng("tests of rank_deficient")


@pytest.mark.parametrize(("m", "n"), minimiser.SHAPES)
def test_exact_bases_span_the_null_space_and_complete_it(m: int, n: int) -> None:
    """J N = 0 to the last bit, N has n - rank columns, and [R N] is nonsingular."""
    for r in range(min(m, n) + 1):
        J = posed.drawn(RNG, m, n, r, *posed.KINDS[0]).J
        N, R = posed.exact_bases(J)
        assert N.shape == (n, n - r) and R.shape == (n, r)
        assert not (J @ N).any()
        assert np.linalg.matrix_rank(np.hstack([R, N])) == n


def test_errors_are_relative_to_what_the_data_can_move() -> None:
    """The size of the stretched arm is that of its answer: W is nearly the identity there."""
    one = posed.posed(posed.flat(Wx=minimiser.COUPLED))
    assert one.size >= np.abs(one.x).max()
    assert posed.error(one.x, one) == 0
    assert posed.error(one.x + one.size * np.eye(3)[0], one) == pytest.approx(1)


def test_where_nothing_is_asked_only_zero_is_right() -> None:
    """J, xdot and a vanish: no error is small beside them."""
    one = posed.posed(VelocityProblem(J=np.zeros((1, 2)), xdot=np.zeros(1), W=np.eye(2)))
    assert posed.error(np.zeros(2), one) == 0
    assert posed.error(np.array([0.0, UNIT]), one) == np.inf


def test_the_flat_arm_is_stretched() -> None:
    """Its J is that of the robot at zero."""
    problem = posed.flat()
    assert isinstance(problem, VelocityProblem)
    assert np.array_equal(problem.J, robots.load("planar_3r").jacobian(np.zeros(3)))
