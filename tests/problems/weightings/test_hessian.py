"""W = Hess L."""

from __future__ import annotations

import numpy as np
import pytest

from problems import robots
from problems.methods.draw import generic
from problems.weightings.extended import extremum
from problems.weightings.hessian import PartialOrientationError, hessian
from problems.weightings.impedance import elastic
from tests.problems.secondary import COUNT, rest, rounding


@pytest.mark.parametrize(
    "name, task", [("planar_4r", "planar"), ("panda", "pose"), ("panda", "position"), ("panda", "orientation")]
)
def test_reduced_weight_is_the_derivative_of_h(name, task):
    """N'W = H on the manifold and off it, although T itself is not symmetric: what makes M13 the same motion as M12."""
    robot = robots.load(name, task)
    q, _, _ = generic(robot, np.random.default_rng(0), COUNT)
    condition = extremum(robot, q, elastic(robot, 1.0, rest(robot, q, np.ones(robot.m))))
    NtW = np.swapaxes(condition.N, 1, 2) @ hessian(condition).dense()
    size = 1 + np.abs(condition.T).max(axis=(1, 2))
    assert (np.abs(NtW - condition.H).max(axis=(1, 2)) <= rounding(robot, q, size)).all()


def test_sign():
    """-Hess L for maxima."""
    robot = robots.load("planar_3r")
    q, _, _ = generic(robot, np.random.default_rng(1), 5)
    condition = extremum(robot, q, elastic(robot))
    np.testing.assert_array_equal(hessian(condition, maximum=True).dense(), -hessian(condition).dense())


@pytest.mark.parametrize("rows", [(0, 1, 2, 3), (0, 1, 2, 3, 4), (3, 4), (5,)])
def test_refuses_a_part_of_the_angular_velocity(rows):
    """One or two of its three rows: the configuration and the rows are named."""
    robot = robots.load("panda", rows)
    q, _, _ = generic(robot, np.random.default_rng(2), 5)
    with pytest.raises(PartialOrientationError, match="configuration 0 of panda") as refusal:
        hessian(extremum(robot, q, elastic(robot)))
    assert refusal.value.evidence["asymmetry"] > 1e-3


def test_planar_angles_are_no_part():
    """On a planar arm the one angular row commutes: T is symmetric, nothing is refused."""
    robot = robots.load("planar_4r", "planar pose")
    q, _, _ = generic(robot, np.random.default_rng(3), COUNT)
    condition = extremum(robot, q, elastic(robot))
    np.testing.assert_allclose(condition.T, np.swapaxes(condition.T, 1, 2), rtol=0, atol=1e-12 * np.abs(condition.T).max())
    assert hessian(condition).lead == (COUNT,)


def test_one_member_is_enough():
    """In a stack where all but one hang free (lambda = 0, T = 0), that one is refused and named."""
    robot = robots.load("seven_joint", (0, 1, 2, 3))
    q, _, _ = generic(robot, np.random.default_rng(2), 3)
    home = q.copy()
    assert hessian(extremum(robot, q, elastic(robot, 1.0, home))).lead == (3,)
    home[1] = rest(robot, q, np.ones(robot.m))[1]
    with pytest.raises(PartialOrientationError, match="configuration 1 of seven_joint"):
        hessian(extremum(robot, q, elastic(robot, 1.0, home)))
