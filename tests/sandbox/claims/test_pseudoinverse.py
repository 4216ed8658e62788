"""What the claims on W = I are checked against: units of the joints, and which way a measure goes."""

from __future__ import annotations

import numpy as np
import pytest

from problems import robots
from sandbox.claims import equations
from sandbox.claims import pseudoinverse as claims
from sandbox.closed_form.eq6 import eq6

RNG = np.random.default_rng(0)
J, XDOT = RNG.normal(size=(3, 2, 4)), RNG.normal(size=(3, 2))
W = claims.make_definite(RNG, 3, 4)


def test_weights_drawn_are_definite():
    """Eigenvalues between 1/2 and 2."""
    eigenvalues = np.linalg.eigvalsh(W)
    assert (eigenvalues > 0.5 - 1e-12).all() and (eigenvalues < 2.0 + 1e-12).all()


def test_the_weight_in_other_units_measures_the_same_motion_alike():
    """Measure p'(S'WS)p of p is q'Wq of q = S p, and J S p is J q."""
    S = RNG.normal(size=(4, 4))
    problem, p = claims.in_units(J, XDOT, W, S), RNG.normal(size=4)
    np.testing.assert_allclose(p @ problem.W.dense() @ p, (S @ p) @ W @ (S @ p), rtol=1e-12)
    np.testing.assert_allclose(problem.J @ p, J @ (S @ p), rtol=1e-12)


def test_rates_come_back_in_radians():
    """Rates found in the joints p, q = S p, meet the task in q."""
    S = np.diag([1.0, np.pi / 180, 2.0, 1.0])
    x, bound = claims.solved(eq6, claims.in_units(J, XDOT, W, S), S)
    np.testing.assert_allclose(np.einsum("bmn,bn->bm", J, x), XDOT, rtol=0, atol=1e-12)
    printed, own = claims.printed_rates(equations.liegeois, J, XDOT, W)
    assert (np.abs(x - printed).max(axis=-1) <= bound + own).all()
    assert (bound < 1e-6).all()


@pytest.mark.parametrize("use", claims.USES, ids=[use.what for use in claims.USES])
def test_alpha_enters_with_the_sign_that_the_row_says(use):
    """The vector a of the cast is alpha grad f, or -alpha grad f where f is to rise."""
    robot = robots.load("planar_4r")
    q, xdot, parameters = use.draw(robot, np.random.default_rng(1), 3)
    a = use.method.cast(robot, q, xdot, **parameters).a
    gradient = claims.measure_of(use, robot, parameters).gradient(robot, q)
    along = np.einsum("bn,bn->b", a, gradient) / np.linalg.norm(a, axis=1) / np.linalg.norm(gradient, axis=1)
    np.testing.assert_allclose(along, -1.0 if use.rising else 1.0, rtol=0, atol=1e-9)


def test_the_planted_climber_is_the_mirror_image():
    """With the sign of alpha turned the mean of both motions is that of alpha = 0."""
    use, robot = claims.USES[0], robots.load("planar_3r")
    q, xdot, _ = use.draw(robot, np.random.default_rng(2), 3)
    down = claims.rates(use.method, robot, q, xdot, alpha=0.5)
    up = claims.climbing(claims.rates)(use.method, robot, q, xdot, alpha=0.5)
    np.testing.assert_allclose((up + down) / 2, claims.rates(use.method, robot, q, xdot, alpha=0.0), rtol=0, atol=1e-12)
    assert np.abs(up - down).max() > 1e-2


def test_every_citation_of_the_paragraph_has_a_use():
    """The numbers [1] and [9] to [15] are all there."""
    cited = " ".join(use.cites for use in claims.USES)
    assert all(f"[{number}]" in cited for number in (1, *range(9, 17)))
