"""Postures found as roots."""

from __future__ import annotations

import numpy as np
from scipy import optimize

from problems.weightings.augmented import clear
from sandbox.claims.augmented_jacobian.frozen_rate import gradient
from sandbox.claims.augmented_jacobian.repeatable_with_alpha_zero import courses, postures


def test_roots_keep_hand_and_functions():
    """Every posture found puts the hand on the path with g as at the start; the paths stay clear of [J; E] singular."""
    for course in courses(True):
        robot = course.robot
        times = np.linspace(0.2, 0.8, 3) * course.path.duration
        found = postures(course, optimize.root, times)
        place = course.robot.forward(course.start)[0] + course.path.displacement(times)
        rows = [row for row in course.robot.rows if row < 3]
        np.testing.assert_allclose(course.robot.forward(found)[0][:, rows], place[:, rows], atol=1e-12)
        for q in found:
            np.testing.assert_allclose(course.g(q), course.g(course.start), atol=1e-12)
            slopes = [
                gradient(lambda z, i=i, g=course.g: np.array([g(row)[i] for row in z]), q[None])[0] for i in range(robot.k)
            ]
            np.testing.assert_allclose(slopes, course.rows(q), atol=1e-14)
            assert clear(course.robot, q, course.rows(q))[0] > 0.05
