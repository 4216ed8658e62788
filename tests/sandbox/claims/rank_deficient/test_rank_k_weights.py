"""Weights (11) with the links in one line, and damped ones."""

from __future__ import annotations

import numpy as np

from problems import robots
from problems.sets import construct as make
from sandbox.claims.claim import Trial
from sandbox.claims.rank_deficient import posed, rank_k_weights
from sandbox.tolerances import DIFFERENCE, GRADIENT_STEP, ORIGINAL, UNIT

RNG = Trial().rng("tests of rank_deficient")


def test_null_vector_derivative_is_that_of_the_cross_product() -> None:
    """Central differences of (s3, -s3 - s23, s2 + s23) with the links in one line; J is that of the robot."""
    robot = robots.load("planar_3r")
    for q2 in (0.0, np.pi):
        for q3 in (0.0, np.pi):
            q = np.array([0.0, q2, q3])
            steps = [np.cross(*np.swapaxes(robot.jacobian(q + GRADIENT_STEP * np.array([[s], [-s]]) * e), 0, 1)) for s, e in
                     ((1.0, row) for row in np.eye(3))]  # fmt: skip
            difference = np.stack([(plus - minus) / 2 / GRADIENT_STEP for plus, minus in steps], axis=1)
            found = rank_k_weights.null_vector_derivative(np.cos(q2), np.cos(q3))
            assert np.abs(np.cross(*robot.jacobian(q))).max() <= ORIGINAL * UNIT
            assert np.abs(found - difference).max() <= DIFFERENCE


def test_stretched_arms_are_those_of_the_robot() -> None:
    """Their J is the robot's at q2, q3 of 0 or pi, and their weight has rank one at most."""
    robot = robots.load("planar_3r")
    known = [robot.jacobian([0.0, q2, q3]) for q2 in (0.0, np.pi) for q3 in (0.0, np.pi)]
    for problem in rank_k_weights.stretched_extended(RNG, 5):
        assert min(np.abs(problem.J - J).max() for J in known) <= ORIGINAL * UNIT
        assert np.linalg.matrix_rank(problem.W.dense()) <= 1


def test_a_damped_weight_is_the_weight_and_a_multiple_of_the_identity() -> None:
    """And the problem is otherwise the same."""
    plain = posed.drawn(RNG, 2, 4, 1, *posed.KINDS[0])
    problem = rank_k_weights.augmented(plain, make.nonzero_integers(RNG, 2, 4), np.ones(2), RNG)
    more = rank_k_weights.damped(problem, 0.5)
    assert np.array_equal(more.W.dense(), problem.W.dense() + 0.5 * np.eye(4))
    assert np.array_equal(more.J, problem.J) and np.array_equal(more.a, problem.a)
