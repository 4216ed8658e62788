"""The rows of the second task, and where they do not control the self-motion."""

from __future__ import annotations

import numpy as np
import pytest

from problems import robots
from problems.measures.obstacle import ContactError
from problems.robots.planar import PLANAR_3R, PLANAR_4R
from problems.sets import textbook
from problems.weightings.two_task import NotControlledError, escape_rows, two_task
from sandbox.errors import ConditionSevenError, RangeError, ShapeError, WeightNotPositiveDefiniteError
from sandbox.tolerances import UNIT

F1, F2 = np.array(textbook.F1.q), np.array(textbook.F2.q)
ELBOW = [(3, (0.0, 0.0, 0.0))]  # the end of link 2
BELOW, BESIDE = np.array([1.0, 0.6, 0.0]), np.array([0.6, 1.0, 0.0])
STEP, DIFFERENCE = 1e-5, 1e-9  # central differences: STEP^2 truncated, UNIT/STEP rounded


def test_rows_of_f1():
    """At F1 the end of link 2, over its obstacle, has Jd = (1, 0, 0); beside it, Jd = (-1, -1, 0), a row of J."""
    np.testing.assert_allclose(escape_rows(PLANAR_3R, F1, BELOW, ELBOW), [[1, 0, 0]], atol=64 * UNIT)
    np.testing.assert_allclose(escape_rows(PLANAR_3R, F1, BESIDE, ELBOW), [[-1, -1, 0]], atol=64 * UNIT)


def test_rows_are_derivatives_of_the_distances():
    """Jd is the gradient of the distances, for points off the joints and an obstacle per configuration; growing is positive."""
    panda = robots.load("panda")
    q = panda.lower + (panda.upper - panda.lower) * np.random.default_rng(0).uniform(0.2, 0.8, (4, 7))
    obstacle = np.random.default_rng(1).uniform(-1, 1, (4, 3))
    points = [(4, (0.1, 0.0, -0.05)), (6, (0.0, 0.2, 0.0))]

    def distance(q):
        return np.stack([np.linalg.norm(panda.point(q, joint, at) - obstacle, axis=-1) for joint, at in points], axis=-1)

    steps = STEP * np.eye(7)
    difference = np.stack([(distance(q + s) - distance(q - s)) / (2 * STEP) for s in steps], axis=-1)
    np.testing.assert_allclose(escape_rows(panda, q, obstacle, points), difference, atol=DIFFERENCE)


def test_contact_and_foreign_points_are_refused():
    """A point on its obstacle has no direction away; a point on no joint is not on the arm."""
    with pytest.raises(ContactError, match="touches the obstacle") as caught:
        escape_rows(PLANAR_3R, np.stack([F1 + 0.1, F1]), np.array([1.0, 1.0, 0.0]), ELBOW)
    assert caught.value.evidence["index"] == (1,)
    with pytest.raises(RangeError, match=r"joints 1\.\.3"):
        escape_rows(PLANAR_3R, F1, BELOW, [(4, (0, 0, 0))])


def test_weight_is_factored():
    """W = Jd'Qd Jd + eps I, with Jd and Qd kept apart; Qd as a diagonal or a matrix."""
    Jd = np.array([[1.0, 2, 0], [0, 1, 1]])
    W = two_task(PLANAR_3R, F1, Jd, [2, 3], eps=0.5)
    np.testing.assert_array_equal(W.dense(), Jd.T @ np.diag([2, 3]) @ Jd + np.eye(3) / 2)
    np.testing.assert_array_equal(W.E, Jd)
    np.testing.assert_array_equal(two_task(PLANAR_3R, F1, Jd, np.diag([2.0, 3]), eps=0.5).dense(), W.dense())


def test_uncontrolled_self_motion_is_refused():
    """rank(Jd N) < n - m needs eps > 0: a direction that self-motion does not move, and fewer rows than freedoms."""
    along = escape_rows(PLANAR_3R, F1[None], BESIDE, ELBOW)
    with pytest.raises(NotControlledError, match="give eps > 0") as caught:
        two_task(PLANAR_3R, F1[None], along)
    assert isinstance(caught.value, ConditionSevenError) and caught.value.evidence["index"] == (0,)
    two_task(PLANAR_3R, F1[None], along, eps=1e-3)
    with pytest.raises(NotControlledError, match=r"p = 1 rows.*n - m = 2"):
        two_task(PLANAR_4R, F2, np.array([[1.0, 0, 0, 0]]))


def test_bad_numbers_are_refused():
    """A negative or infinite eps, and a Qd that is not positive definite or of the wrong size, are refused."""
    Jd = np.array([[1.0, 0, 0]])
    for eps in (-1e-3, np.inf, np.nan):
        with pytest.raises(RangeError, match="eps is"):
            two_task(PLANAR_3R, F1, Jd, eps=eps)
    with pytest.raises(WeightNotPositiveDefiniteError, match="Qd"):
        two_task(PLANAR_3R, F1, Jd, [0.0])
    with pytest.raises(ShapeError, match="Qd"):
        two_task(PLANAR_3R, F1, Jd, np.eye(2))
