"""The formulations beside eq. (13)."""

from __future__ import annotations

from sandbox.claims.claim import Trial
from sandbox.claims.rank_deficient import minimiser, posed

RNG = Trial().rng("tests of rank_deficient")


def test_scipy_and_tikhonov_find_the_minimiser_without_eq_13() -> None:
    """The stretched arm of the worked example, (-6/7, -4/7, 40/7)."""
    one = posed.posed(posed.flat(Wx=minimiser.COUPLED))
    x, bound = minimiser.by_scipy(one)
    assert posed.error(x, one) <= bound
    far, near = (posed.error(minimiser.tikhonov(one, epsilon), one) for epsilon in (1e-3, 1e-6))
    assert near < far / 100
