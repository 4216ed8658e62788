"""What the tests of the accuracy study beyond the paper share."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pytest

from sandbox.claims.beyond.situation import Situation, situations

Array = np.ndarray


@pytest.fixture(scope="module")
def drawn() -> list[Situation]:
    """Every arm and weight at a few configurations."""
    return situations(np.random.default_rng(0), 40)


@pytest.fixture(scope="module")
def exact_residual() -> Callable[[Array, Array, Array], list[Fraction]]:
    """J qdot - xdot of one problem, without rounding."""

    def residual(J: Array, x: Array, xdot: Array) -> list[Fraction]:
        return [
            sum((Fraction(a) * Fraction(b) for a, b in zip(row, x.tolist(), strict=True)), -Fraction(right))
            for row, right in zip(J.tolist(), xdot.tolist(), strict=True)
        ]

    return residual
