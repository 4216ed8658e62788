"""Chan and Dubey's weight: the barrier's slope, and the rule of direction."""

from __future__ import annotations

import numpy as np
import pytest

from problems import robots
from problems.measures.joint_limits import barrier
from problems.measures.measure import OutsideDomainError
from problems.robots.planar import PLANAR_3R
from problems.sets import textbook
from problems.weightings.identity import MixedUnitsError
from problems.weightings.least_norm import least_norm
from sandbox.errors import RangeError, ShapeError
from tests.problems.measures import chain

PRINTED = 1e-12  # twelve digits
F1 = np.array(textbook.F1.q)
UPPER = np.array([np.pi, np.pi, 2 * np.pi])
STEP = 1e-6


def diagonal(*arguments, **options):
    return np.diagonal(least_norm(*arguments, **options).dense(), axis1=-2, axis2=-1)


def test_weights_of_f1():
    """F1 with limits +-(pi, pi, 2 pi), every joint approaching: W = diag(1, 1.565884242105, 1.090541478737)."""
    W = diagonal(PLANAR_3R, F1, lower=-UPPER, upper=UPPER)
    np.testing.assert_allclose(W, [1, 1.565884242105, 1.090541478737], atol=PRINTED)


@pytest.mark.parametrize("name", ["planar_3r", "panda"])
def test_a_joint_weighs_where_the_slope_grows(name):
    """W_ii is 1 + |dH/dq_i| exactly where a small step along qdot_previous makes |dH/dq_i| larger, else 1."""
    robot = robots.load(name)
    rng = np.random.default_rng(2)
    q = robot.lower + (robot.upper - robot.lower) * rng.uniform(0.05, 0.95, (50, robot.n))
    qdot = rng.uniform(-1, 1, q.shape)
    slope = np.abs(barrier(robot).gradient(robot, q))
    grown = np.abs(barrier(robot).gradient(robot, q + STEP * qdot)) > slope
    assert grown.any() and not grown.all()
    np.testing.assert_array_equal(diagonal(robot, q, qdot), np.where(grown, 1 + slope, 1.0))


def test_the_weight_depends_on_the_direction():
    """W is not odd in the motion: turned round, other joints weigh; a joint at rest or at mid-range counts as approaching."""
    q = np.array([1.0, -1.0, 0.0])
    there, back = (diagonal(PLANAR_3R, q, np.array([s, s, s])) for s in (1.0, -1.0))
    assert there[0] > 1 and there[1] == 1 and back[0] == 1 and back[1] > 1
    assert there[2] == back[2] == 1
    np.testing.assert_array_equal(diagonal(PLANAR_3R, q, np.zeros(3)), diagonal(PLANAR_3R, q))


def test_a_joint_without_limits_weighs_one():
    """An infinite limit drops the joint's term."""
    W = diagonal(PLANAR_3R, np.array([1.0, 1.0, 1.0]), upper=[2, np.inf, 2])
    assert W[0] > 1 and W[1] == 1 and W[2] > 1


@pytest.mark.parametrize("value", [2.75, 3.0, -2.75], ids=["at", "beyond", "at lower"])
def test_at_a_limit_refused(value):
    """A joint at its limit or beyond is refused, with configuration, joint and value: no absolute value hides it."""
    with pytest.raises(OutsideDomainError) as caught:
        least_norm(PLANAR_3R, np.array([[0.1, 0.2, 0.3], [0.1, value, 0.3]]))
    assert caught.value.evidence["index"] == (1,)
    assert caught.value.evidence["joint"] == 2 and caught.value.evidence["value"] == value


def test_limits_refused():
    """Limits in the wrong order or number, and rates of the wrong length, are refused."""
    with pytest.raises(RangeError, match="joint 2"):
        least_norm(PLANAR_3R, F1, lower=[-3, 3, -3], upper=[3, -3, 3])
    with pytest.raises(ShapeError):
        least_norm(PLANAR_3R, F1, lower=[-3, -3])
    with pytest.raises(ShapeError, match="qdot_previous"):
        least_norm(PLANAR_3R, F1, [1.0, 2.0])


def test_sliding_beside_turning_joints_are_refused():
    """1 + |dH/dq_i| has one unit only where the joints have."""
    with pytest.raises(MixedUnitsError, match="weighted_pseudoinverse"):
        least_norm(chain.MIXED, np.zeros((1, chain.MIXED.n)))
