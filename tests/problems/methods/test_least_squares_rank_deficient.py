"""M20 and section 6 of methods.md: eq. (13) on arms that have lost rank."""

from __future__ import annotations

import numpy as np
import pytest

from problems import robots
from problems.methods import augmented_jacobian, damped_secondary, extended_jacobian, gradient_projection, mussa_ivaldi_hogan
from problems.methods.draw import generic
from problems.methods.least_squares_rank_deficient import METHOD, cast
from problems.robots.planar import PLANAR_3R
from problems.weightings.augmented import augmented
from sandbox.agreement import bounds
from sandbox.closed_form.solve import solve
from sandbox.errors import (
    AsymmetricWeightError,
    ConditionSevenError,
    RankAmbiguousError,
    RankDeficientError,
    ShapeError,
    WeightNotPositiveDefiniteError,
)
from sandbox.law import rates
from sandbox.problem import VelocityProblem
from tests.problems.secondary import COUNT, EACH_ROBOT, agrees, answers, at, faulty, found, rounding

F0 = np.zeros((1, 3))
INDEFINITE = np.diag([1.0, 1.0, -0.05])
SKEWED = np.array([[2.0, 1.0], [1.0, 1.0]])


@pytest.mark.parametrize("name", ["planar_3r", "planar_4r", "panda", "seven_joint"])
def test_agrees_with_the_original(name):
    """Framework and SVD of Wx^1/2 J with the null-space method agree at singular configurations."""
    agrees(METHOD, name)


@EACH_ROBOT
def test_drawn_configurations_are_singular(name):
    """J has lost exactly one rank, to rounding, within the joint limits, and the task asked is out of reach."""
    robot = robots.load(name)
    drawn = METHOD.draw(robot, np.random.default_rng(1), COUNT)
    U, sigma, _ = np.linalg.svd(robot.jacobian(drawn.q))
    assert (sigma[:, -1] < 1e-13 * sigma[:, 0]).all()
    assert (sigma[:, -2] > 0.009 * sigma[:, 0]).all()
    assert ((robot.lower <= drawn.q) & (drawn.q <= robot.upper)).all()
    assert (np.abs(np.einsum("bm,bm->b", U[:, :, -1], drawn.xdot)) > 1e-3).mean() > 0.9


def test_planar_arms_are_singular_when_aligned():
    """What the search finds on the 3R arm has q2 = q3 = 0, the one aligned posture inside the limits."""
    drawn = METHOD.draw(PLANAR_3R, np.random.default_rng(2), COUNT)
    assert np.abs(np.sin(drawn.q[:, 1:])).max() < 1e-13


@pytest.mark.parametrize("task_weight, expected", [(SKEWED, (-6 / 7, -4 / 7, 40 / 7)), (1.0, (-3 / 7, -2 / 7, 20 / 7))])
def test_f0(task_weight, expected):
    """F0, W = diag(1, 1, -1/20) indefinite: target 2 with the skewed Wx, 1 with Wx = I (6.6)."""
    answers(METHOD, PLANAR_3R, F0, at(1, 1), expected, weight=INDEFINITE, task_weight=task_weight)


def test_reduced_weight_of_f0_is_positive():
    """N'WN = [[.55, -.3], [-.3, .8]] with N = [[1, 0], [0, 1], [-3, -2]] (6.6)."""
    N = np.array([[1.0, 0], [0, 1], [-3, -2]])
    np.testing.assert_allclose(N.T @ INDEFINITE @ N, [[0.55, -0.3], [-0.3, 0.8]], rtol=1e-15)


def test_is_eq6_where_rank_is_full():
    """At r = m eq. (13) is eq. (6), whatever Wx (I26)."""
    panda = robots.load("panda")
    q, xdot, _ = generic(panda, np.random.default_rng(3), COUNT)
    Wx = np.diag(np.random.default_rng(4).uniform(0.1, 10.0, panda.m))
    one, allowed = found(METHOD, panda, q, xdot, gradient=0.5 * q, task_weight=Wx)
    two, more = found(gradient_projection.METHOD, panda, q, xdot, alpha=0.5)
    assert (np.abs(one - two) <= allowed + more).all()


@EACH_ROBOT
def test_task_weight_is_irrelevant_where_the_task_can_be_met(name):
    """With xdot in range J: any Wx > 0 gives the same rates; and Wx -> c Wx always does (I26)."""
    robot = robots.load(name)
    q, _, parameters = METHOD.draw(robot, np.random.default_rng(5), COUNT)
    rng = np.random.default_rng(6)
    reachable = np.einsum("bmn,bn->bm", robot.jacobian(q), rng.uniform(-1.0, 1.0, q.shape))
    one, allowed = found(METHOD, robot, q, reachable, **parameters)
    two, more = found(METHOD, robot, q, reachable, **{**parameters, "task_weight": rng.uniform(0.5, 2.0, robot.m)})
    assert (np.abs(one - two) <= allowed + more).all()
    anything = rng.uniform(-1.0, 1.0, reachable.shape)
    one, allowed = found(METHOD, robot, q, anything, **parameters)
    two, more = found(METHOD, robot, q, anything, **{**parameters, "task_weight": 7 * parameters["task_weight"]})
    assert (np.abs(one - two) <= allowed + more).all()


def test_choice_of_the_range_basis_does_not_matter():
    """R -> R C + N D, C nonsingular, leaves [R'J'WxJ; N'W] qdot = [R'J'Wx xdot; -N'a] its solution (I26)."""
    rng = np.random.default_rng(7)
    q, xdot, parameters = METHOD.draw(PLANAR_3R, rng, 20)
    x, allowed = found(METHOD, PLANAR_3R, q, xdot, **parameters)
    W, Wx = parameters["weight"], parameters["task_weight"]
    for i, J in enumerate(PLANAR_3R.jacobian(q)):
        Vt = np.linalg.svd(J)[2]
        N, R = Vt[1:].T, Vt[:1].T * rng.uniform(0.5, 2.0) + Vt[1:].T @ rng.standard_normal((2, 1))
        A = np.vstack([R.T @ J.T @ Wx @ J, N.T @ W])
        right = np.concatenate([R.T @ J.T @ Wx @ xdot[i], -N.T @ parameters["gradient"][i]])
        assert (np.abs(np.linalg.solve(A, right) - x[i]) <= allowed[i] * np.linalg.cond(A)).all()


@pytest.mark.parametrize("weight", [INDEFINITE, 1.0], ids=["indefinite", "identity"])
def test_is_the_limit_of_a_penalty(weight):
    """(J'WxJ + eps W)^-1 (J'Wx xdot - eps a) tends to it, ratio .100 per decade of eps (6.5)."""
    a = np.array([0.3, -0.2, 0.1])
    (x,) = rates(METHOD, PLANAR_3R, F0, at(1, 1), weight=weight, gradient=a, task_weight=SKEWED)
    J, W = PLANAR_3R.jacobian(F0)[0], weight * np.eye(3)
    G = J.T @ SKEWED
    errors = [np.abs(np.linalg.solve(G @ J + eps * W, G @ [1, 1] - eps * a) - x).max() for eps in (1e-3, 1e-4, 1e-5)]
    np.testing.assert_allclose(np.divide(errors[1:], errors[:-1]), 0.1, rtol=0.02)


def test_row_of_rounding_is_no_row():
    """q1 = pi/2 leaves 6e-17 in the place of an exact zero row: the answer is that of the row dropped."""
    x, allowed = found(METHOD, PLANAR_3R, np.array([[np.pi / 2, 0, 0]]), at(-1, 1), weight=INDEFINITE)
    turned, more = found(METHOD, PLANAR_3R, F0, at(1, 1), weight=INDEFINITE)
    assert (np.abs(x - turned) <= allowed + more).all()


def test_weights_of_rank_k_never_do():
    """Undamped augmented and extended Jacobians fail (7) at a singularity, the damped one does not (6.3)."""
    for name in ("planar_3r", "panda"):
        robot = robots.load(name)
        q, xdot, parameters = METHOD.draw(robot, np.random.default_rng(8), 20)
        E = augmented_jacobian.rows(robot, q, None)
        posed = VelocityProblem(J=robot.jacobian(q), xdot=xdot, W=augmented(E))
        status = solve(posed, "eq13", on_refusal="status", rank_tolerance=parameters["rank_tolerance"]).status
        assert not any(one.answered for one in status)
        cured = damped_secondary.cast(robot, q, xdot, base=0.1)
        assert np.isfinite(solve(cured, "eq13", rank_tolerance=parameters["rank_tolerance"]).x).all()
        for method in (augmented_jacobian, extended_jacobian, mussa_ivaldi_hogan):
            with pytest.raises(RankDeficientError):
                method.cast(robot, q, xdot)


def ignoring_task_weight(robot, q, xdot, *, task_weight=1.0, **others):
    return cast(robot, q, xdot, **others)


def wrong_sign(robot, q, xdot, *, gradient=None, **others):
    return cast(robot, q, xdot, gradient=-gradient, **others)


@pytest.mark.parametrize("fault", [ignoring_task_weight, wrong_sign])
def test_fault_in_the_cast(fault):
    """Without Wx, or with -a, framework and original disagree."""
    faulty(METHOD, fault)


def test_fault_null_space_not_enlarged():
    """With the n - m vectors of the regular arm in the place of the n - r, the rates are others."""
    q, xdot, parameters = METHOD.draw(PLANAR_3R, np.random.default_rng(9), 20)
    x, allowed = found(METHOD, PLANAR_3R, q, xdot, **parameters)
    W = parameters["weight"]
    for i, J in enumerate(PLANAR_3R.jacobian(q)):
        U, s, Vt = np.linalg.svd(J)
        N, particular = Vt[2:].T, Vt[:1].T @ (U[:, :1].T @ xdot[i]) / s[0]
        wrong = particular - N @ np.linalg.solve(N.T @ W @ N, N.T @ (parameters["gradient"][i] + W @ particular))
        assert np.abs(wrong - x[i]).max() > allowed[i, 0]


def test_refuses_an_ambiguous_rank():
    """Singular values without a gap at the declared tolerance: no rank, no answer."""
    q = np.array([[0.7, 0.02, 0.0]])
    with pytest.raises(RankAmbiguousError):
        rates(METHOD, PLANAR_3R, q, at(1, 1), rank_tolerance=1e-2)
    x = rates(METHOD, PLANAR_3R, q, at(1, 1))
    J = PLANAR_3R.jacobian(q)[0]
    assert np.abs(J @ x[0] - 1).max() <= rounding(PLANAR_3R, q, np.abs(x).max())[0]


def test_refuses_task_weights_that_are_not_positive_on_the_range():
    """Wx indefinite or singular on range J: the target is unbounded, or not unique."""
    for diagonal in ((1.0, -1.0), (1.0, 0.0)):
        with pytest.raises(WeightNotPositiveDefiniteError):
            rates(METHOD, PLANAR_3R, F0, at(1, 1), task_weight=np.array(diagonal))


def test_task_weight_may_be_anything_off_the_range():
    """Wx = diag(-1, 1) at F0, where range J is the second axis: the row that is out of reach does not count."""
    problem = cast(PLANAR_3R, F0, at(1, 1), task_weight=np.array([-1.0, 1.0]), weight=INDEFINITE)
    x = solve(problem, "eq13").x
    allowed = sum(bounds(METHOD, cast(PLANAR_3R, F0, at(1, 1), weight=INDEFINITE), x, {}))
    assert np.abs(x[0] - (-3 / 7, -2 / 7, 20 / 7)).max() <= allowed[0]


def test_refuses_weights_that_are_not_positive_on_the_enlarged_null_space():
    """diag(1, 1, -1) is positive along the null vector of a regular arm, but not on both of F0."""
    with pytest.raises(ConditionSevenError):
        rates(METHOD, PLANAR_3R, F0, at(1, 1), weight=np.diag([1.0, 1.0, -1.0]))


def test_refuses_misshapen_and_asymmetric_weights():
    """The field is named."""
    for field, value in (("weight", np.ones(2)), ("task_weight", np.ones(3)), ("weight", np.ones((2, 2)))):
        with pytest.raises(ShapeError, match=field):
            cast(PLANAR_3R, F0, at(1, 1), **{field: value})
    with pytest.raises(AsymmetricWeightError, match="task_weight"):
        cast(PLANAR_3R, F0, at(1, 1), task_weight=np.array([[1.0, 1], [0, 1]]))


def test_rates_jump_where_rank_is_lost():
    """Near a singularity the exact rates grow without bound, at it they do not: qdot is no continuous function of q."""
    near, at_it = (np.abs(rates(METHOD, PLANAR_3R, np.array([[0.0, q2, 0.0]]), at(1, 1))).max() for q2 in (1e-6, 0.0))
    assert near > 1e5 * at_it
