"""Units of the joints."""

from __future__ import annotations

import numpy as np

from sandbox.claims import equations
from sandbox.claims.pseudoinverse import identity_rarely_ideal
from sandbox.closed_form.eq6 import eq6

RNG = np.random.default_rng(0)

J, XDOT = RNG.normal(size=(3, 2, 4)), RNG.normal(size=(3, 2))

W = identity_rarely_ideal.make_definite(RNG, 3, 4)


def test_weights_drawn_are_definite():
    """Eigenvalues between 1/2 and 2."""
    eigenvalues = np.linalg.eigvalsh(W)
    assert (eigenvalues > 0.5 - 1e-12).all() and (eigenvalues < 2.0 + 1e-12).all()


def test_the_weight_in_other_units_measures_the_same_motion_alike():
    """Measure p'(S'WS)p of p is q'Wq of q = S p, and J S p is J q."""
    S = RNG.normal(size=(4, 4))
    problem, p = identity_rarely_ideal.in_units(J, XDOT, W, S), RNG.normal(size=4)
    np.testing.assert_allclose(p @ problem.W.dense() @ p, (S @ p) @ W @ (S @ p), rtol=1e-12)
    np.testing.assert_allclose(problem.J @ p, J @ (S @ p), rtol=1e-12)


def test_rates_come_back_in_radians():
    """Rates found in the joints p, q = S p, meet the task in q."""
    S = np.diag([1.0, np.pi / 180, 2.0, 1.0])
    x, bound = identity_rarely_ideal.solved(eq6, identity_rarely_ideal.in_units(J, XDOT, W, S), S)
    np.testing.assert_allclose(np.einsum("bmn,bn->bm", J, x), XDOT, rtol=0, atol=1e-12)
    printed, own = identity_rarely_ideal.printed_rates(equations.liegeois, J, XDOT, W)
    assert (np.abs(x - printed).max(axis=-1) <= bound + own).all()
    assert (bound < 1e-6).all()
