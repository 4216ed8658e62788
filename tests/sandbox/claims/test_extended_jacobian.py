"""What the claims on extended Jacobians are checked against: extrema with the hand held, bases, the self-motion of an arm."""

from __future__ import annotations

import numpy as np
import pytest

from problems import robots
from problems.original import extended_jacobian as original
from sandbox.claims import constrained
from sandbox.claims import extended_jacobian as claims
from sandbox.claims.claim import Trial
from sandbox.claims.constrained import PLANAR, Springs
from sandbox.tolerances import CURVATURE_DIFFERENCED, FORWARD, UNIT

ARMS = {n: robots.load(f"planar_{n}r") for n in (3, 4)}
ROUNDING = FORWARD * 8 * UNIT
each_arm = pytest.mark.parametrize("n", ARMS)


def somewhere(n: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(0.3, 1.2, n) * (-1.0) ** np.arange(n)


@each_arm
def test_the_arm_written_out_is_the_robot(n):
    """Tip and Jacobian are pinocchio's, and the Jacobian is the tip's derivative by complex steps."""
    q = somewhere(n)
    np.testing.assert_allclose(constrained.tip(q), ARMS[n].forward(q)[0][:2], rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(constrained.tip_jacobian(q), ARMS[n].jacobian(q), rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(constrained.slope(constrained.tip, q), constrained.tip_jacobian(q), rtol=0, atol=ROUNDING)


def test_the_extremum_of_springs_is_where_their_torque_is_a_force_on_the_hand():
    """From a posture nearby root finding comes back to F1, whose springs pull by J'lam with lam = (-1, -1)."""
    g = Springs(np.ones(3), claims.REST)
    found = constrained.extremum(PLANAR, g.gradient, constrained.tip(claims.F1), claims.F1 + 0.05)
    np.testing.assert_allclose(found, claims.F1, rtol=0, atol=ROUNDING)


def test_a_hand_out_of_reach_has_no_extremum():
    """No posture puts the tip of three unit links at (4, 0)."""
    with pytest.raises(ArithmeticError, match="no extremum"):
        constrained.extremum(PLANAR, Springs(np.ones(3), claims.REST).gradient, np.array([4.0, 0.0]), claims.F1)


@each_arm
def test_the_error_of_a_followed_extremum_holds(n):
    """Its rates are off from those of the extended Jacobian as published by no more than they say."""
    drawn = claims.extrema(ARMS[n], np.random.default_rng(1), 10)
    exact = original.original(ARMS[n], drawn.q, drawn.xdot, **drawn.parameters)
    for i, right in enumerate(exact):
        g = claims.springs_of(drawn.parameters, i)
        rate, error = constrained.extremum_rates(PLANAR, g.gradient, drawn.q[i], drawn.xdot[i])
        assert np.abs(rate - right).max() <= error
        assert error <= 1e-3 * np.abs(right).max()


@each_arm
def test_bases_span_the_null_space(n):
    """J N = 0 and N has full column rank for each of them, at q and beside it."""
    q = somewhere(n)
    for _, basis in claims.bases(ARMS[n], q):
        for at in (q, q + 0.1):
            N = basis(at)
            assert np.abs(constrained.tip_jacobian(at) @ N).max() <= ROUNDING * np.abs(N).max()
            assert np.linalg.matrix_rank(N) == n - 2


def test_elimination_keeps_the_identity_in_the_free_joints():
    """Joints 1 and 3 solved for: rows 2 and 4 of N are the identity."""
    N = constrained.eliminated(PLANAR, (0, 2), 4)(somewhere(4))
    np.testing.assert_array_equal(N[[1, 3]], np.eye(2))


def test_feedback_decays_as_it_says():
    """With kappa, H qdot = -kappa h; with alpha, N'H'H qdot = -alpha N'grad g."""
    q, xdot, g = claims.OFF, claims.TASK, Springs(np.ones(3), claims.REST)
    H = constrained.slope(lambda z: constrained.cross(z).T @ g.gradient(z), q)
    N = constrained.cross(q)
    h = N.T @ g.gradient(q)
    x, _ = constrained.basis_rates(PLANAR, g.gradient, q, xdot, constrained.cross, kappa=0.7)
    np.testing.assert_allclose(H @ x, -0.7 * h, rtol=0, atol=ROUNDING)
    x, _ = constrained.basis_rates(PLANAR, g.gradient, q, xdot, constrained.cross, alpha=-0.7)
    np.testing.assert_allclose(N.T @ H.T @ H @ x, 0.7 * h, rtol=0, atol=10 * ROUNDING)
    np.testing.assert_allclose(constrained.tip_jacobian(q) @ x, xdot, rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("rest, expected", [(claims.REST, 1 / 3), (claims.TOP, -1 / 3)], ids=["minimum", "maximum"])
def test_curvature_along_the_self_motion(rest, expected):
    """At F1 n'Hess L n is 1 for lam = (-1, -1) and -1 for (-2, 0), n'n = 3."""
    n = constrained.cross(claims.F1)[:, 0] / np.sqrt(3)
    found = constrained.curvature(PLANAR, Springs(np.ones(3), rest), claims.F1, n)
    assert abs(found - expected) <= CURVATURE_DIFFERENCED


def test_the_self_motion_is_closed_and_holds_the_tip():
    """Its points have the tip at (2, 1), follow one another evenly, and the last is next to the first."""
    s, curve = claims._curve(200)
    assert np.abs([constrained.tip(q) - constrained.tip(claims.F1) for q in curve]).max() <= ROUNDING
    gaps = np.linalg.norm(np.diff(curve, axis=0, append=curve[:1]), axis=1)
    assert np.ptp(gaps) <= 0.01 * gaps.mean()
    assert abs(gaps.mean() - s[1]) <= 0.01 * s[1]


@pytest.mark.parametrize("start, alpha, expected", [(10, 1.0, False), (70, 1.0, True), (10, -1.0, True), (45, -1.0, False)])
def test_the_way_downhill_bends_where_it_should(start, alpha, expected):
    """Of g = cos s, 100 places a round, the minimum is at 50: from 70 the way there is convex, from 10 it is not."""
    s = 2 * np.pi * np.arange(100) / 100
    least = claims._least_bend(start, -np.sin(s), -np.cos(s), alpha)
    assert (least > 0) == expected


def test_drawn_extrema_are_of_every_kind():
    """Minima, saddles and maxima; all of them extrema."""
    drawn = claims.extrema(ARMS[4], np.random.default_rng(2), 200)
    low, high = claims.kinds(ARMS[4], drawn).T
    assert (low > 0).any() and (high < 0).any() and ((low < 0) & (high > 0)).any()
    for i, q in enumerate(drawn.q):
        assert claims._left(ARMS[4], claims.springs_of(drawn.parameters, i), q) <= 1e3 * ROUNDING


def test_tilted_springs_are_off_by_what_is_asked():
    """|N'grad g| at the extremum is the number given."""
    drawn = claims.extrema(ARMS[4], np.random.default_rng(3), 1)
    g = claims._tilted(drawn.q[0], claims.springs_of(drawn.parameters, 0), 1e-3)
    assert abs(claims._residual(g, drawn.q[0]) / 1e-3 - 1) <= 1e-9


def test_the_path_begins_at_extrema_that_stay_clear_of_bifurcation():
    """Each start is found again after one round by root finding alone."""
    path = claims.circle(0.15, 4.0)
    for _, q0, g in claims._starts(ARMS[3], Trial(full=False).rng("test"), path, 20):
        q = q0
        for place in constrained.tip(q0) + path.displacement(np.linspace(0.0, 4.0, 13))[:, :2]:
            q = constrained.extremum(PLANAR, g.gradient, place, q)
        np.testing.assert_allclose(q, q0, rtol=0, atol=1e-10)
