"""The mathematics of both footnotes."""

from __future__ import annotations

import numpy as np
import pytest

from problems.sets import construct as make
from sandbox.claims.framework import (
    footnote_1,
    footnote_2,
)
from sandbox.claims.situations import positive
from sandbox.closed_form.eq6 import eq6
from sandbox.problem import VelocityProblem
from sandbox.stacked import times
from sandbox.tolerances import FORWARD, UNIT

ROUNDING = FORWARD * 10 * UNIT * 1e3
"""Ten joints, condition numbers below 1e3."""


def test_constrained_least_squares_meets_its_own_conditions():
    """The rows are met, and A'(A x - c) has no part along null J."""
    rng = np.random.default_rng(5)
    A, J, c, xdot = (rng.standard_normal(shape) for shape in ((5, 4), (2, 4), 5, 2))
    x = footnote_2.constrained_least_squares(A, J, c, xdot)
    N = np.linalg.svd(J)[2][2:].T
    np.testing.assert_allclose(J @ x, xdot, atol=ROUNDING)
    np.testing.assert_allclose(N.T @ A.T @ (A @ x - c), 0, atol=ROUNDING)


def test_a_gradient_does_not_circulate():
    """c(q) = C sin q with A'C diagonal is a gradient; with A'C not symmetric the integral is the curl times the area."""
    q = np.array([0.3, -0.2, 0.9])
    still = footnote_2.Field(np.diag([1.0, 2, 3]), np.zeros((3, 3)))
    assert abs(footnote_2.circulation(np.eye(3), still, q, 0.7)) < ROUNDING
    C = np.array([[0.0, 1, 0], [-2, 0, 0], [0, 0, 0]])
    # a = -(sin q_2, -2 sin q_1, 0): curl 2 cos q_1 + cos q_2
    found = footnote_2.circulation(np.eye(3), footnote_2.Field(C, np.zeros((3, 3))), q, 1e-3)
    assert found == pytest.approx((2 * np.cos(q[0]) + np.cos(q[1])) * np.pi * 1e-6, rel=1e-6)


def test_the_excess_of_a_motion_is_a_square():
    """The measure of x + N y is that of G xdot and y'N'WN y more, for stacks of stacks."""
    W = np.stack([make.positive_definite(np.random.default_rng(6), 3)] * 2)
    x = np.arange(12.0).reshape(2, 2, 3)
    expected = [[x[r, b] @ W[b] @ x[r, b] for b in range(2)] for r in range(2)]
    np.testing.assert_allclose(footnote_1._measure(W, x), expected, rtol=ROUNDING)


def test_columns_of_the_inverse_answer_unit_velocities():
    """J G = I, and G xdot is the answer to xdot."""
    problem = positive(np.random.default_rng(7), 3, 6, 4, decades=0.5)
    plain = VelocityProblem(J=problem.J, xdot=problem.xdot, W=problem.W)
    G = footnote_1.inverse_of(eq6, problem)
    np.testing.assert_allclose(problem.J @ G, np.stack([np.eye(3)] * 4), atol=ROUNDING)
    np.testing.assert_allclose(times(G, problem.xdot), eq6(plain).x, atol=ROUNDING)
