"""Configurations, velocities and weights."""

from __future__ import annotations

import numpy as np

from sandbox.claims.beyond import situation
from sandbox.claims.beyond.situation import Situation
from sandbox.tolerances import UNIT

Array = np.ndarray


def test_situations_are_those_of_section_v(drawn: list[Situation]) -> None:
    """Three arms under three weights; unit velocities, no gradient, the same configurations under every weight."""
    assert [(one.arm, one.weight) for one in drawn] == [
        (arm, weight) for arm in situation.NAMES for weight in ("identity", "random", "inertia")
    ]
    for plain, *others in (drawn[k : k + 3] for k in (0, 3, 6)):
        assert np.allclose(np.linalg.norm(plain.problem.xdot, axis=1), 1, rtol=4 * UNIT, atol=0)
        assert not plain.problem.a.any()
        assert np.array_equal(plain.problem.W.dense(), np.broadcast_to(np.eye(plain.problem.n), plain.problem.W.base.shape))
        for other in others:
            assert np.array_equal(other.problem.J, plain.problem.J) and np.array_equal(other.q, plain.q)


def test_random_weights_are_definite_over_the_decades_they_say(drawn: list[Situation]) -> None:
    """All eigenvalues lie within DECADES, and the draws use most of them."""
    for one in drawn:
        if one.weight == "random":
            values = np.linalg.eigvalsh(one.problem.W.dense())
            spread = np.log10(values[:, -1] / values[:, 0])
            assert values.min() > 0 and 0.6 * situation.DECADES < spread.max() <= situation.DECADES + 1e-9
