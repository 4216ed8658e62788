"""The least load of exact rates, and what leaves the path."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog

from problems import robots
from sandbox.claims.singularities import approach, giving_up_exactness
from sandbox.problem import VelocityProblem
from sandbox.tolerances import LINEAR_PROGRAM


def test_the_least_load_is_that_of_a_linear_programme() -> None:
    """q1 + q2 = 1 with limits 1 and 3: both joints at a quarter of their limits; 0 qdot = 1: nothing."""
    limits = np.array([1.0, 3.0])
    assert giving_up_exactness.least_load(linprog, np.ones((1, 2)), np.ones(1), limits) == pytest.approx(
        0.25, abs=LINEAR_PROGRAM
    )
    assert giving_up_exactness.least_load(linprog, np.zeros((1, 2)), np.ones(1), limits) == np.inf


def test_no_exact_rates_have_a_lower_load() -> None:
    """Along the self-motion of the bent planar 3R, to either side."""
    J, limits = robots.load("planar_3r").jacobian(approach.BENT), np.array([1.0, 2.0, 3.0])
    least = giving_up_exactness.least_load(linprog, J, np.ones(2), limits)
    moves = np.linspace(-3, 3, 2001)[:, None] * np.array([-1.0, 1.0, 1.0]) + np.linalg.pinv(J) @ np.ones(2)
    loads = np.abs(moves / limits).max(axis=1)
    assert loads.min() >= least - LINEAR_PROGRAM
    assert loads.min() <= least + 6 / 2000


def test_a_passage_tells_what_leaves_the_path() -> None:
    """A hand at half speed has half the task error, and none aside; one that turns away by 3:4:5 has 0.8 aside."""
    one = approach.stretching()
    problem = VelocityProblem(J=np.eye(2, 3)[None].repeat(2, 0), xdot=[[1.0, 0.0], [1.0, 0.0]], W=np.eye(3))
    by = {"some": np.array([[0.5, 0.0, 9.0], [0.6, 0.8, 0.0]])}
    way = giving_up_exactness.Passage("some way", one, np.zeros(2), problem, np.ones((2, 2)), by, np.ones(2), np.ones(2))
    assert way.missed("some") == pytest.approx([0.5, np.hypot(0.4, 0.8)])
    assert way.aside("some") == pytest.approx([0.0, 0.8])
    assert way.load("some") == pytest.approx(np.array([9.0, 0.8]) / one.robot.rate_limits.min())
