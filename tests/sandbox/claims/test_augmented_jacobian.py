"""What the claims on the augmented Jacobian compute by themselves: cases by hand, gradients, roots, rows of gammas."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from scipy import optimize

from problems import robots
from problems.weightings.augmented import clear
from sandbox.claims.augmented_jacobian import (
    AUGMENTED,
    DECADES,
    F1,
    SUM,
    _shifted_angle,
    _shifted_curved,
    by_hand,
    courses,
    gradient,
    half_unit,
    plain_angle,
    plain_curved,
    postures,
    printed_cases,
    run,
    shifted,
    told,
    turned_alpha,
)
from sandbox.closed_form.kernels import CURVATURE, SOLVED
from sandbox.closed_form.uncompiled import eq6_on
from sandbox.law import rates
from sandbox.tolerances import ORIGINAL, UNIT

J = np.array([[-1.0, -1, 0], [2, 1, 1]])
"""The Jacobian at F1."""


@pytest.mark.parametrize("case", printed_cases(), ids=lambda case: case.robot + str(len(case.name)))
def test_the_cases_by_hand_meet_task_and_functions(case):
    """Each expected answer satisfies J qdot = xdot and E qdot = gbar to rounding: it is the one solution of [J; E]."""
    rows = np.concatenate([robots.load(case.robot).jacobian(case.q), case.E])
    asked = np.array([*case.xdot, *case.gbar])
    assert np.abs(rows @ np.array(case.expected) - asked).max() <= ORIGINAL * rows.shape[1] * UNIT * np.linalg.norm(rows)
    assert np.linalg.matrix_rank(rows) == len(rows)


@pytest.mark.parametrize("plain, expression", [(plain_angle, _shifted_angle), (plain_curved, _shifted_curved)])
def test_plain_functions_are_the_measures(plain, expression):
    """The functions on complex numbers and those in CasADi have the same values, up to the constant, and gradients."""
    robot, q = robots.load("panda"), np.random.default_rng(1).uniform(-1, 1, (20, 7))
    measure = shifted(expression, 0.7)
    np.testing.assert_allclose(measure.value(robot, q), plain(q) + 0.7, rtol=1e-14)
    np.testing.assert_allclose(measure.gradient(robot, q), gradient(plain, q), rtol=1e-14)


def test_complex_steps_differentiate_products():
    """The gradient of (c - g) g is (c - 2 g) grad g: what differentiating gbar adds."""
    q = np.random.default_rng(2).uniform(-1, 1, (10, 3))
    found = gradient(lambda z: (0.3 - plain_curved(z)) * plain_curved(z), q)
    np.testing.assert_allclose(found, (0.3 - 2 * plain_curved(q))[:, None] * gradient(plain_curved, q), rtol=1e-13)


def test_rational_rates_are_exact():
    """On rationals (8)-(10) in (6) give (ydot - om, om - xdot - ydot, om + xdot) at F1 with no error at all, for any gamma."""
    x, y, om = Fraction(3, 8), Fraction(-11, 16), Fraction(7, 8)
    for exponent in DECADES:
        found = by_hand(eq6_on, Fraction, J, np.array([0.375, -0.6875]), SUM, np.array([0.875]), [Fraction(10) ** exponent])
        assert tuple(found) == (y - om, om - x - y, om + x)


def test_codes_tell_a_conflict():
    """A function whose gradient lies in range J' stops (6) at its last pivot, one that does not passes."""
    given = (J, np.array([0.5, 0.25]))
    assert run(eq6_on, Fraction, *given, SUM, np.array([1.0]), [1])[0] == SOLVED
    assert run(eq6_on, Fraction, *given, np.array([[1.0, 1, 0]]), np.array([1.0]), [1])[0] == CURVATURE


def test_the_base_stands_beside_the_functions():
    """With a base (6) minimises 1/2 qdot'(W~ + e e')qdot - gbar e'qdot on the constraint: M19 by hand."""
    base, e = 0.01 * np.diag([1.0, 2, 3]), np.ones(3)
    found = by_hand(eq6_on, float, J, np.array([0.3, -0.7]), e[None], np.array([0.9]), [1.0], base).astype(float)
    np.testing.assert_allclose(found, [-1.526415094340, 1.226415094340, 1.126415094340], atol=half_unit(12))


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


def test_the_planted_alpha_turns_the_desired_rate():
    """The fault of the first claim gives E qdot = -gbar and leaves the task alone."""
    xdot, gbar = np.array([[0.3, -0.7]]), np.array([0.9])
    wrong = turned_alpha(rates)(AUGMENTED, robots.load("planar_3r"), F1[None], xdot, E=SUM, gbar=gbar)[0]
    np.testing.assert_allclose(np.vstack([J, SUM]) @ wrong, [0.3, -0.7, -0.9], atol=1e-14)


def test_rows_of_numbers_are_told_without_rounding_s_dust():
    """Six digits, a true minus, and zero for what is a rounding."""
    assert told([-1.6, 1e-17, 2 / 3]) == "(−1.6, 0, 0.666667)"
