"""C3: time scaling."""

from __future__ import annotations

import numpy as np
import pytest

from problems import robots
from problems.methods import time_scaling
from problems.methods.time_scaling import METHOD, cast
from problems.robots.planar import PLANAR_3R
from sandbox.errors import NonFiniteError, RangeError, RankDeficientError, ShapeError
from sandbox.law import rates
from sandbox.problem import VelocityProblem
from tests.problems.secondary import COUNT, EACH_ROBOT, F1, NULL, agrees, at, faulty, rounding

ONES = np.ones(3)


@EACH_ROBOT
def test_agrees_with_the_original(name):
    """Framework and bisection agree."""
    agrees(METHOD, name)


@pytest.mark.parametrize("own, expected", [(0.0, (0.2, -0.8, 1.0)), (0.3, (-0.16, -0.26, 1.0))])
def test_f1(own, expected):
    """For xdot = (1, 1), limits 1: s = .6 without self-motion, .42 with .3 n."""
    parameters = {"alpha": 1.0, "posture": F1[0] + own * NULL, "rate_limits": ONES}
    for law in (
        lambda **p: rates(METHOD, PLANAR_3R, F1, at(1, 1), **p),
        lambda **p: METHOD.witness(PLANAR_3R, F1, at(1, 1), **p),
    ):
        np.testing.assert_allclose(law(**parameters)[0], expected, rtol=0, atol=rounding(PLANAR_3R, F1, 2.0)[0])


@EACH_ROBOT
def test_limits_are_kept_and_reached(name):
    """No rate exceeds its limit; where the whole speed does not fit, one is at it; the path keeps its direction."""
    robot = robots.load(name)
    q, xdot, parameters = METHOD.draw(robot, np.random.default_rng(1), COUNT)
    x = rates(METHOD, robot, q, xdot, **parameters)
    moved = np.einsum("bmn,bn->bm", robot.jacobian(q), x)
    share = (moved * xdot).sum(axis=1) / np.square(xdot).sum(axis=1)
    allowed = rounding(robot, q, np.abs(x).max(axis=1))
    used = (np.abs(x) / parameters["rate_limits"]).max(axis=1)
    assert (used <= 1 + allowed).all()
    whole = share > 1 - allowed
    assert (np.abs(used - 1) <= allowed)[~whole].all()
    assert 0.05 < whole.mean() < 0.95 or name == "panda"
    assert (np.abs(moved - share[:, None] * xdot).max(axis=1) <= 10 * allowed).all()
    assert ((share >= -allowed) & (share <= 1 + allowed)).all()


def test_fast_self_motion_is_shrunk_first():
    """Where the self-motion alone exceeds a limit it is shrunk to it, and what is left goes to the task."""
    parameters = {"alpha": 100.0, "posture": F1[0] + NULL, "rate_limits": ONES}
    for x in (
        rates(METHOD, PLANAR_3R, F1, at(1, 1), **parameters)[0], METHOD.witness(PLANAR_3R, F1, at(1, 1), **parameters)[0]
    ):  # fmt: skip
        assert np.isfinite(x).all() and (np.abs(x) <= 1).all()
        np.testing.assert_allclose(x, NULL, rtol=0, atol=1e-5)


def test_limits_of_the_robot_are_the_default():
    """Without limits given, those of the robot hold."""
    expected = METHOD.witness(PLANAR_3R, F1, at(9, 9), rate_limits=PLANAR_3R.rate_limits)
    np.testing.assert_array_equal(METHOD.witness(PLANAR_3R, F1, at(9, 9)), expected)
    assert np.abs(expected).max() <= PLANAR_3R.rate_limits.max()


def unshrunk(robot, q, xdot, *, alpha=0.5, posture=None, rate_limits=None):
    right = cast(robot, q, xdot, alpha=alpha, posture=posture, rate_limits=1e6 * np.ones(robot.n))
    return VelocityProblem(J=right.J, xdot=xdot, W=right.W, a=right.a)


def wrong_sign(robot, q, xdot, *, alpha=0.5, posture=None, rate_limits=None):
    return cast(robot, q, xdot, alpha=-alpha, posture=posture, rate_limits=rate_limits)


@pytest.mark.parametrize("fault", [unshrunk, wrong_sign])
def test_fault_in_the_cast(fault):
    """With a self-motion that is not shrunk, or of the wrong sign, framework and original disagree."""
    faulty(METHOD, fault)


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan])
def test_refuses_limits_that_are_not_positive(value):
    """Any limits <= 0 are refused, and the joint is named."""
    with pytest.raises(RangeError, match="rate limit of joint 2"):
        cast(PLANAR_3R, F1, at(1, 1), rate_limits=np.array([1.0, value, 1.0]))


def test_other_refusals():
    """A wrong number of limits, a gain that is not finite, a singular arm: each by its own error."""
    with pytest.raises(ShapeError, match="rate_limits"):
        cast(PLANAR_3R, F1, at(1, 1), rate_limits=np.ones(4))
    with pytest.raises(NonFiniteError, match="alpha"):
        cast(PLANAR_3R, F1, at(1, 1), alpha=np.nan)
    with pytest.raises(RankDeficientError):
        cast(PLANAR_3R, np.zeros((1, 3)), at(1, 1))


def test_joints_without_limit_never_bind():
    """Infinite limits: the whole speed."""
    limits = np.full(3, np.inf)
    np.testing.assert_array_equal(time_scaling.positive_limits(PLANAR_3R, limits), limits)
    (x,) = rates(METHOD, PLANAR_3R, F1, at(1, 1), alpha=0.0, rate_limits=limits)
    np.testing.assert_allclose(x, (1 / 3, -4 / 3, 5 / 3), rtol=0, atol=rounding(PLANAR_3R, F1, 2.0)[0])
