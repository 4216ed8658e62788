"""Distances from the joint limits: printed values, dropped joints, refusals (methods M3)."""

from __future__ import annotations

import numpy as np
import pytest

from problems.measures.joint_limits import barrier, p_norm, quadratic
from problems.measures.measure import NotDifferentiableError, OutsideDomainError
from problems.robots.planar import PLANAR_3R
from problems.sets import textbook
from sandbox.errors import RangeError, ShapeError
from sandbox.tolerances import UNIT

F1 = np.array(textbook.F1.q)
PI = np.array([np.pi, np.pi, 2 * np.pi])
ROUNDING = 16 * UNIT
PRINTED = 1e-12
MEASURES = pytest.mark.parametrize("factory", [quadratic, p_norm, barrier])


def test_quadratic_at_f1():
    """F1, limits (pi, pi, 2 pi) both ways: grad H = (0, 1/(3 pi), -1/(12 pi))."""
    slope = quadratic(PLANAR_3R, lower=-PI, upper=PI).gradient(PLANAR_3R, F1)
    np.testing.assert_allclose(slope, [0, 1 / (3 * np.pi), -1 / (12 * np.pi)], atol=ROUNDING)


def test_barrier_at_f1():
    """F1, the same limits: dH = (0, .565884242105, -.090541478737), and H = 1 for the joint at mid-range."""
    f = barrier(PLANAR_3R, lower=-PI, upper=PI)
    np.testing.assert_allclose(f.gradient(PLANAR_3R, F1), [0, 0.565884242105, -0.090541478737], atol=PRINTED)
    np.testing.assert_allclose(f.value(PLANAR_3R, F1), 1 + 4 / 3 + 16 / 15, rtol=ROUNDING)


def test_p_norm_nears_the_largest():
    """The p-norm lies between the largest share of the way to a limit and n^(1/p) times it."""
    q = np.random.default_rng(0).uniform(-2.5, 2.5, (20, 3))
    largest = np.abs(q / 2.75).max(axis=-1)
    for p in (2, 6, 20):
        value = p_norm(PLANAR_3R, p=p).value(PLANAR_3R, q)
        assert (value >= largest * (1 - ROUNDING)).all() and (value <= 3 ** (1 / p) * largest * (1 + ROUNDING)).all()


def test_quadratic_written_out():
    """H = 1/n sum x_i^2 and dH/dq_i = 2/n x_i/r, x_i = q_i/r, r the half range of the robot's own limits."""
    q, r = np.random.default_rng(1).uniform(-2.5, 2.5, (20, 3)), 2.75
    f = quadratic(PLANAR_3R)
    np.testing.assert_allclose(f.value(PLANAR_3R, q), ((q / r) ** 2).sum(axis=-1) / 3, rtol=ROUNDING)
    np.testing.assert_allclose(f.gradient(PLANAR_3R, q), 2 / 3 * q / r**2, rtol=ROUNDING)


@MEASURES
@pytest.mark.parametrize("end", ["lower", "upper"])
def test_infinite_limit_drops_the_term(factory, end):
    """A joint without two finite limits takes no part, as if its weight were 0."""
    ends = {"lower": -PI, "upper": PI}
    ends[end] = ends[end] * [1, np.inf, 1]
    q = F1 + np.array([0.1, 7.0, 0.2])
    dropped = factory(PLANAR_3R, **ends).gradient(PLANAR_3R, q)
    weightless = factory(PLANAR_3R, lower=-PI, upper=PI, weights=[1, 0, 1]).gradient(PLANAR_3R, q)
    np.testing.assert_array_equal(dropped, weightless)
    assert dropped[1] == 0 and dropped[0] != 0


@MEASURES
def test_weights(factory):
    """A weight scales its joint's term."""
    q = F1 + np.array([0.1, 0.0, 0.0])
    plain, heavy = (factory(PLANAR_3R, weights=w) for w in (None, [64.0] * 3))
    scale = 64 ** (1 / 6) if factory is p_norm else 64
    np.testing.assert_allclose(heavy.value(PLANAR_3R, q), scale * plain.value(PLANAR_3R, q), rtol=ROUNDING)


@MEASURES
@pytest.mark.parametrize(
    "limits, words",
    [
        ({"lower": [-1, 1, -1], "upper": [1, 1, 1]}, "joint 2 .* 1 and 1"),
        ({"lower": [-1, 2, -1], "upper": [1, 1, 1]}, "joint 2 .* 2 and 1"),
        ({"upper": [1, 1, np.nan]}, "joint 3 .* nan"),
        ({"upper": [1, np.inf, 1], "weights": [1, 1, 1]}, "joint 2 .* inf"),
        ({"weights": [1, 1, -1]}, "joint 3 is -1"),
        ({"weights": [1, np.inf, 1]}, "joint 2 is inf"),
        ({"lower": np.full(3, -np.inf)}, "nothing to avoid"),
    ],
    ids=["equal", "crossed", "NaN", "infinite with a weight", "negative weight", "infinite weight", "none"],
)
def test_bad_limits(factory, limits, words):
    """Limits in the wrong order, not a number, or infinite where a weight is given, are refused with joint and values."""
    with pytest.raises(RangeError, match=words):
        factory(PLANAR_3R, **limits)


@MEASURES
@pytest.mark.parametrize("lower", [[-1, -1], "low"], ids=["two", "words"])
def test_limits_of_the_wrong_shape(factory, lower):
    """Limits that are not one number per joint are refused."""
    with pytest.raises(ShapeError, match="lower"):
        factory(PLANAR_3R, lower=lower)


@pytest.mark.parametrize("place", [2.75, 3.0, -2.75])
def test_barrier_outside(place):
    """At or beyond a limit the barrier refuses, value and gradient, and names configuration, joint, value and limits."""
    q = np.zeros((4, 3))
    q[2, 1] = place
    f = barrier(PLANAR_3R)
    for function in (f.value, f.gradient, f.curvature):
        with pytest.raises(OutsideDomainError, match=f"joint 2 of configuration 2 is at {place:g}.*-2.75 and 2.75") as caught:
            function(PLANAR_3R, q)
    assert caught.value.evidence == {"index": (2,), "joint": 2, "value": place, "lower": -2.75, "upper": 2.75}


def test_barrier_just_inside():
    """One float inside its limit a joint is pushed back, not through."""
    f, q = barrier(PLANAR_3R), np.array([0.0, np.nextafter(2.75, 0), 0.0])
    assert f.gradient(PLANAR_3R, q)[1] > 1e28


@pytest.mark.parametrize("p", [0, 1, 3, 22, 2.5, -6, True])
def test_odd_exponent(p):
    """An exponent that is not even, or too large for floats, is refused."""
    with pytest.raises(RangeError, match="even"):
        p_norm(PLANAR_3R, p=p)


def test_p_norm_at_mid_range():
    """With all joints at mid-range, but for rounding, the p-norm has a value and no gradient."""
    f, q = p_norm(PLANAR_3R), np.array([[0.3, 0, 0], [0, 1e-16, 0]])
    assert f.value(PLANAR_3R, q)[1] < 1e-15
    with pytest.raises(NotDifferentiableError, match="configuration 1"):
        f.gradient(PLANAR_3R, q)
