"""The mathematics that the claims of Sections I, II and VII bring with them."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from problems.sets import construct as make
from sandbox.claims import framework, introduction
from sandbox.claims.claim import Role, Trial
from sandbox.claims.situations import SIZES, indefinite, positive
from sandbox.closed_form.eq6 import eq6
from sandbox.problem import VelocityProblem
from sandbox.reference.truth import truth
from sandbox.stacked import times
from sandbox.tolerances import FORWARD, UNIT

ROUNDING = FORWARD * 10 * UNIT * 1e3
"""Ten joints, condition numbers below 1e3."""


KINDS = [(m, n, kind) for m, n in SIZES for kind in framework.KINDS if n - m > 1 or not kind.startswith("saddle")]
"""One degree of redundancy has one curvature, and no saddle."""


@pytest.mark.parametrize("m, n, kind", KINDS)
def test_a_problem_is_of_the_kind_asked_for(m, n, kind):
    """The exact reference finds the kind that was constructed, and N spans null J without rounding."""
    drawn = framework.curved(np.random.default_rng(1), m, n, kind)
    assert framework.EXACT_KIND[truth(drawn.problem).reason] == drawn.kind == kind
    assert not (drawn.problem.J @ drawn.N).any() and np.linalg.matrix_rank(drawn.N) == n - m


def test_one_degree_of_redundancy_has_no_saddle():
    """Of all kinds only those are drawn that the size has room for, each as often."""
    rng = np.random.default_rng(1)
    assert [one.kind for one in framework.curved_of_all_kinds(rng, 2, 3, 2)] == ["minimum"] * 2 + ["maximum"] * 2 + ["flat"] * 2
    assert {one.kind for one in framework.curved_of_all_kinds(rng, 2, 4, 1)} == set(framework.KINDS)


def test_finslers_threshold_is_the_one_worked_out():
    """Planar 3R, W = diag(-1, 1, 1): sqrt(2) - 1; and for W = I, which needs none, -1/sigma_max^2."""
    assert framework.finsler_threshold(framework.J1, np.diag([-1.0, 1, 1])) == pytest.approx(np.sqrt(2) - 1, abs=ROUNDING)
    largest = np.linalg.norm(framework.J1, 2)
    assert framework.finsler_threshold(framework.J1, np.eye(3)) == pytest.approx(-1 / largest**2, abs=ROUNDING)


def test_the_threshold_divides_definite_from_indefinite():
    """W + c J'J has a positive smallest eigenvalue just above c*, a negative one just below, zero at it."""
    problem = indefinite(np.random.default_rng(2), 3, 6, 20, decades=0.5)
    for J, W in zip(problem.J, problem.W.dense(), strict=True):
        c = framework.finsler_threshold(J, W)
        below, at, above = (np.linalg.eigvalsh(W + c * share * J.T @ J)[0] for share in (0.999, 1.0, 1.001))
        assert below < -ROUNDING < at < ROUNDING < above


def test_reach_is_what_the_data_can_move():
    """At least |x|; with W = I and a = 0 it is that of |J^+||xdot|, and it scales with the data."""
    problem = positive(np.random.default_rng(3), 2, 4, 5, decades=0.5)
    plain = VelocityProblem(J=problem.J, xdot=problem.xdot, W=np.eye(4))
    x = eq6(plain).x
    expected = times(np.abs(np.linalg.pinv(plain.J)), np.abs(plain.xdot)).max(axis=-1)
    np.testing.assert_allclose(framework.reach(plain, x), expected, rtol=ROUNDING)
    np.testing.assert_allclose(framework.reach(problem, 1e9 * x), 1e9 * np.abs(x).max(axis=-1), rtol=ROUNDING)
    twice = VelocityProblem(J=problem.J, xdot=2 * problem.xdot, W=problem.W, a=2 * problem.a)
    np.testing.assert_allclose(framework.reach(twice, 0 * x), 2 * framework.reach(problem, 0 * x), rtol=ROUNDING)


@pytest.mark.parametrize("k", [1, 2, 4])
def test_mixing_has_the_condition_asked_for(k):
    """C of condition 10^d; of size 10^-d where there is one column."""
    C = framework._mixing(np.random.default_rng(4), k, 3, 3.0)
    measured = np.linalg.cond(C) if k > 1 else 1 / np.abs(C[:, 0, 0])
    np.testing.assert_allclose(measured, 1e3, rtol=1e3 * ROUNDING)


def test_fractions_lose_nothing():
    """A float becomes the rational it is, and the objective of fractions is a fraction."""
    assert framework.rational([0.1])[0] == Fraction(0.1) != Fraction(1, 10)
    W, a, x = framework.rational(np.diag([3.0, 5])), framework.rational([1.0, 2]), np.array([Fraction(1, 3), Fraction(1, 7)])
    assert framework.objective(W, a, x) == Fraction(1, 6) + Fraction(5, 98) + Fraction(1, 3) + Fraction(2, 7)


def test_constrained_least_squares_meets_its_own_conditions():
    """The rows are met, and A'(A x - c) has no part along null J."""
    rng = np.random.default_rng(5)
    A, J, c, xdot = (rng.standard_normal(shape) for shape in ((5, 4), (2, 4), 5, 2))
    x = framework.constrained_least_squares(A, J, c, xdot)
    N = np.linalg.svd(J)[2][2:].T
    np.testing.assert_allclose(J @ x, xdot, atol=ROUNDING)
    np.testing.assert_allclose(N.T @ A.T @ (A @ x - c), 0, atol=ROUNDING)


def test_a_gradient_does_not_circulate():
    """c(q) = C sin q with A'C diagonal is a gradient; with A'C not symmetric the integral is the curl times the area."""
    q = np.array([0.3, -0.2, 0.9])
    still = framework.Field(np.diag([1.0, 2, 3]), np.zeros((3, 3)))
    assert abs(framework.circulation(np.eye(3), still, q, 0.7)) < ROUNDING
    C = np.array([[0.0, 1, 0], [-2, 0, 0], [0, 0, 0]])
    # a = -(sin q_2, -2 sin q_1, 0): curl 2 cos q_1 + cos q_2
    found = framework.circulation(np.eye(3), framework.Field(C, np.zeros((3, 3))), q, 1e-3)
    assert found == pytest.approx((2 * np.cos(q[0]) + np.cos(q[1])) * np.pi * 1e-6, rel=1e-6)


def test_the_excess_of_a_motion_is_a_square():
    """The measure of x + N y is that of G xdot and y'N'WN y more, for stacks of stacks."""
    W = np.stack([make.positive_definite(np.random.default_rng(6), 3)] * 2)
    x = np.arange(12.0).reshape(2, 2, 3)
    expected = [[x[r, b] @ W[b] @ x[r, b] for b in range(2)] for r in range(2)]
    np.testing.assert_allclose(framework._measure(W, x), expected, rtol=ROUNDING)


def test_columns_of_the_inverse_answer_unit_velocities():
    """J G = I, and G xdot is the answer to xdot."""
    problem = positive(np.random.default_rng(7), 3, 6, 4, decades=0.5)
    plain = VelocityProblem(J=problem.J, xdot=problem.xdot, W=problem.W)
    G = framework.inverse_of(eq6, problem)
    np.testing.assert_allclose(problem.J @ G, np.stack([np.eye(3)] * 4), atol=ROUNDING)
    np.testing.assert_allclose(times(G, problem.xdot), eq6(plain).x, atol=ROUNDING)


def test_thinned_keeps_what_fits():
    """At most as many as asked, the first among them, in order; all where they fit."""
    values = np.arange(1000)
    assert len(introduction.thinned(values, 300)) <= 300 and introduction.thinned(values, 300)[0] == 0
    assert (np.diff(introduction.thinned(values, 300)) > 0).all()
    assert len(introduction.thinned(values, 1000)) == 1000


def test_points_of_a_category_stay_with_it():
    """Spread around its place by less than half a step; a lone one stands on it."""
    assert (np.abs(introduction.beside(3, 9) - 3) < 0.5).all() and len(set(introduction.beside(3, 9))) == 9
    assert introduction.beside(3, 1).tolist() == [3.0]


def test_nineteen_methods_are_exact():
    """M1 to M19; the two that the paper names are outside."""
    assert [method.id for method in introduction.EXACT] == [f"M{i}" for i in range(1, 20)]
    assert [method.id for method in introduction.OUTSIDE] == ["C1", "C2"]


ERRATA = ("footnote_1", "symmetric_weight")


@pytest.mark.paper
@pytest.mark.parametrize("claim", framework.CLAIMS, ids=lambda claim: claim.name)
def test_what_is_printed_falls_only_where_an_erratum_is_known(claim):
    """The literal reading fails in two claims, once each, and says how to read it; nothing else fails."""
    fallen = [check for check in claim.evidence(Trial(full=False)).checks if not check.holds]
    assert [check.role for check in fallen] == ([Role.PRINTED] if claim.name in ERRATA else [])
    assert all(check.range for check in fallen)
