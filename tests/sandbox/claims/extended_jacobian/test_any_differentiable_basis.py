"""The bases compared."""

from __future__ import annotations

import numpy as np
import pytest

from problems import robots
from sandbox.claims import constrained
from sandbox.claims.extended_jacobian.any_differentiable_basis import bases
from sandbox.tolerances import FORWARD, UNIT

ARMS = {n: robots.load(f"planar_{n}r") for n in (3, 4)}
ROUNDING = FORWARD * 8 * UNIT
each_arm = pytest.mark.parametrize("n", ARMS)


def somewhere(n: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(0.3, 1.2, n) * (-1.0) ** np.arange(n)


@each_arm
def test_bases_span_the_null_space(n):
    """J N = 0 and N has full column rank for each of them, at q and beside it."""
    q = somewhere(n)
    for _, basis in bases(ARMS[n], q):
        for at in (q, q + 0.1):
            N = basis(at)
            assert np.abs(constrained.tip_jacobian(at) @ N).max() <= ROUNDING * np.abs(N).max()
            assert np.linalg.matrix_rank(N) == n - 2
