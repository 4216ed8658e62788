"""Extrema with the hand held, and bases of the null space: what claims are checked against."""

from __future__ import annotations

import numpy as np
import pytest

from problems import robots
from problems.original import extended_jacobian as original
from sandbox.claims import constrained
from sandbox.claims.constrained import PLANAR, Springs
from sandbox.claims.extended_jacobian.any_differentiable_basis import OFF
from sandbox.claims.extended_jacobian.extrema import REST, TASK, TOP, extrema, springs_of
from sandbox.claims.postures import F1
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
    g = Springs(np.ones(3), REST)
    found = constrained.extremum(PLANAR, g.gradient, constrained.tip(F1), F1 + 0.05)
    np.testing.assert_allclose(found, F1, rtol=0, atol=ROUNDING)


def test_a_hand_out_of_reach_has_no_extremum():
    """No posture puts the tip of three unit links at (4, 0)."""
    with pytest.raises(ArithmeticError, match="no extremum"):
        constrained.extremum(PLANAR, Springs(np.ones(3), REST).gradient, np.array([4.0, 0.0]), F1)


@each_arm
def test_the_error_of_a_followed_extremum_holds(n):
    """Its rates are off from those of the extended Jacobian as published by no more than they say."""
    drawn = extrema(ARMS[n], np.random.default_rng(1), 10)
    exact = original.original(ARMS[n], drawn.q, drawn.xdot, **drawn.parameters)
    for i, right in enumerate(exact):
        g = springs_of(drawn.parameters, i)
        rate, error = constrained.extremum_rates(PLANAR, g.gradient, drawn.q[i], drawn.xdot[i])
        assert np.abs(rate - right).max() <= error
        assert error <= 1e-3 * np.abs(right).max()


def test_elimination_keeps_the_identity_in_the_free_joints():
    """Joints 1 and 3 solved for: rows 2 and 4 of N are the identity."""
    N = constrained.eliminated(PLANAR, (0, 2), 4)(somewhere(4))
    np.testing.assert_array_equal(N[[1, 3]], np.eye(2))


def test_feedback_decays_as_it_says():
    """With kappa, H qdot = -kappa h; with alpha, N'H'H qdot = -alpha N'grad g."""
    q, xdot, g = OFF, TASK, Springs(np.ones(3), REST)
    H = constrained.slope(lambda z: constrained.cross(z).T @ g.gradient(z), q)
    N = constrained.cross(q)
    h = N.T @ g.gradient(q)
    x, _ = constrained.basis_rates(PLANAR, g.gradient, q, xdot, constrained.cross, kappa=0.7)
    np.testing.assert_allclose(H @ x, -0.7 * h, rtol=0, atol=ROUNDING)
    x, _ = constrained.basis_rates(PLANAR, g.gradient, q, xdot, constrained.cross, alpha=-0.7)
    np.testing.assert_allclose(N.T @ H.T @ H @ x, 0.7 * h, rtol=0, atol=10 * ROUNDING)
    np.testing.assert_allclose(constrained.tip_jacobian(q) @ x, xdot, rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("rest, expected", [(REST, 1 / 3), (TOP, -1 / 3)], ids=["minimum", "maximum"])
def test_curvature_along_the_self_motion(rest, expected):
    """At F1 n'Hess L n is 1 for lam = (-1, -1) and -1 for (-2, 0), n'n = 3."""
    n = constrained.cross(F1)[:, 0] / np.sqrt(3)
    found = constrained.curvature(PLANAR, Springs(np.ones(3), rest), F1, n)
    assert abs(found - expected) <= CURVATURE_DIFFERENCED
