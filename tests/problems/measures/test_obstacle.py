"""Potential of an obstacle: printed values, the choice of the nearest point, refusals (methods M7)."""

from __future__ import annotations

import numpy as np
import pytest

from problems.measures.obstacle import ContactError, distances, inner_ends, nearest, obstacle_potential
from problems.robots import load
from problems.robots.planar import PLANAR_3R, PLANAR_4R, planar_arm
from problems.sets import textbook
from sandbox.errors import RangeError, ShapeError
from sandbox.tolerances import UNIT

F1 = np.array(textbook.F1.q)
END = [(2, (1.0, 0.0, 0.0))]
ABOVE = (1.0, 1.4, 0.0)
ROUNDING = 1e-13  # d0 - d cancels two digits of numbers of order one, k = 100 follows


def test_at_f1():
    """F1, end of link 2 at (1, 1), obstacle (1, 1.4), d0 = .5, k = 100: d = .4, f = .5 J, grad f = (10, 0, 0)."""
    f = obstacle_potential(PLANAR_3R, obstacle=ABOVE, reach=0.5, stiffness=100.0, points=END)
    np.testing.assert_allclose(distances(PLANAR_3R, F1, ABOVE, END), [0.4], rtol=ROUNDING)
    np.testing.assert_allclose(f.value(PLANAR_3R, F1), 0.5, rtol=ROUNDING)
    np.testing.assert_allclose(f.gradient(PLANAR_3R, F1), [10, 0, 0], atol=10 * ROUNDING)


def test_out_of_reach():
    """Further away than d0 the obstacle is not felt: f = 0, and no gradient."""
    f = obstacle_potential(PLANAR_3R, obstacle=ABOVE, reach=0.3, points=END)
    assert f.value(PLANAR_3R, F1) == 0 and not f.gradient(PLANAR_3R, F1).any()


def test_gradient_fades_in():
    """Across d = d0 the gradient is continuous: at a distance e inside it is k e in size."""
    f = obstacle_potential(PLANAR_3R, obstacle=ABOVE, reach=0.4 + 1e-6, points=END)
    np.testing.assert_allclose(f.gradient(PLANAR_3R, F1), [1e-4, 0, 0], atol=1e-12)


def test_nearest_counts():
    """Of several critical points the nearest is pushed, with the distance to the next one told."""
    points = [(1, (1.0, 0.0, 0.0)), *END, (3, (1.0, 0.0, 0.0))]
    together = obstacle_potential(PLANAR_3R, obstacle=ABOVE, reach=5.0, points=points)
    alone = obstacle_potential(PLANAR_3R, obstacle=ABOVE, reach=5.0, points=END)
    np.testing.assert_array_equal(together.gradient(PLANAR_3R, F1), alone.gradient(PLANAR_3R, F1))
    which, gap = nearest(PLANAR_3R, F1, ABOVE, points)
    assert which == 1 and abs(gap - (1.16**0.5 - 0.4)) < ROUNDING  # tip (2, 1)


def test_tie_is_the_first():
    """Where two points are equally near the first one's gradient is given, and the gap tells: f is only piecewise smooth."""
    points = [(2, (1.0, 0.0, 0.0)), (3, (1.0, 0.0, 0.0))]
    middle = (1.5, 1.4, 0.0)
    which, gap = nearest(PLANAR_3R, F1, middle, points)
    assert which in (0, 1) and gap < ROUNDING
    slope = obstacle_potential(PLANAR_3R, obstacle=middle, reach=1.0, points=points).gradient(PLANAR_3R, F1)
    each = [obstacle_potential(PLANAR_3R, obstacle=middle, reach=1.0, points=[p]).gradient(PLANAR_3R, F1) for p in points]
    assert min(np.abs(slope - one).max() for one in each) < 100 * ROUNDING


def test_one_lone_point():
    """A lone critical point has no next one: the gap is infinite."""
    assert nearest(PLANAR_3R, F1, ABOVE, END) == (0, np.inf)


def test_an_obstacle_for_each_configuration():
    """Each configuration may have its own obstacle."""
    q, places = np.stack([F1, F1]), np.array([ABOVE, (1.0, 0.6, 0.0)])
    f = obstacle_potential(PLANAR_3R, obstacle=places, reach=0.5, points=END)
    np.testing.assert_allclose(f.gradient(PLANAR_3R, q), [[10, 0, 0], [-10, 0, 0]], atol=10 * ROUNDING)
    with pytest.raises(ShapeError, match="obstacle"):
        f.gradient(PLANAR_3R, np.stack([F1] * 3))


def test_inner_ends():
    """Without points of their own robots are met at their inner joints that move."""
    assert inner_ends(PLANAR_3R) == ((1, (1.0, 0.0, 0.0)), (2, (1.0, 0.0, 0.0)))
    assert [joint for joint, _ in inner_ends(load("panda"))] == [2, 3, 4, 6]
    assert [joint for joint, _ in inner_ends(load("seven_joint"))] == [3, 5]  # its first ends in the shoulder, which stays
    assert len(inner_ends(PLANAR_4R)) == 3


@pytest.mark.parametrize("offset", [0.0, 1e-16], ids=["touching", "by rounding"])
def test_contact(offset):
    """In contact value and gradient are refused, with configuration, link and distance."""
    f = obstacle_potential(PLANAR_3R, obstacle=(1.0, 1.0 + offset, 0.0), reach=0.5, points=END)
    for function in (f.value, f.gradient, f.curvature):
        with pytest.raises(ContactError, match=r"link 2 .* configuration 1 \(distance") as caught:
            function(PLANAR_3R, np.stack([F1 + 0.2, F1]))
    assert caught.value.evidence["index"] == (1,) and caught.value.evidence["joint"] == 2


@pytest.mark.parametrize(
    "parameters, error, words",
    [
        ({"reach": 0.0}, RangeError, "reach is 0"),
        ({"reach": -0.5}, RangeError, "reach is -0.5"),
        ({"reach": np.nan}, RangeError, "reach is nan"),
        ({"stiffness": 0.0}, RangeError, "stiffness is 0"),
        ({"points": [(4, (0, 0, 0))]}, RangeError, "not on the arm"),
        ({"points": [(0, (0, 0, 0))]}, RangeError, "not on the arm"),
        ({"points": [(1.5, (0, 0, 0))]}, RangeError, "not on the arm"),
        ({"points": [(1, (0, 0))]}, ShapeError, r"points\[0\]"),
        ({"points": [3]}, ShapeError, r"points\[0\]"),
        ({"points": []}, ShapeError, "empty"),
        ({"obstacle": (1.0, 1.0)}, ShapeError, "obstacle"),
    ],
    ids=str,
)
def test_refusals(parameters, error, words):
    """d0 <= 0, k <= 0, points on no joint of the arm and wrong shapes are refused by name."""
    with pytest.raises(error, match=words):
        obstacle_potential(PLANAR_3R, **{"obstacle": ABOVE, "reach": 0.5, **parameters})


def test_contact_tolerance_is_rounding():
    """A hundred roundings off contact is off contact."""
    near = (1.0, 1.0 + 2e4 * UNIT, 0.0)
    assert distances(PLANAR_3R, F1, near, END)[0] > 0


def test_an_arm_without_inner_ends_has_no_critical_points():
    """One link from base to hand: which points are to keep clear must be said."""
    with pytest.raises(ShapeError, match="critical points"):
        inner_ends(planar_arm([1.0]))
