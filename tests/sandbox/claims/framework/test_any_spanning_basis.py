"""Bases of a chosen condition."""

from __future__ import annotations

import numpy as np
import pytest

from sandbox.claims.framework import (
    any_spanning_basis,
)
from sandbox.tolerances import FORWARD, UNIT

ROUNDING = FORWARD * 10 * UNIT * 1e3
"""Ten joints, condition numbers below 1e3."""


@pytest.mark.parametrize("k", [1, 2, 4])
def test_mixing_has_the_condition_asked_for(k):
    """C of condition 10^d; of size 10^-d where there is one column."""
    C = any_spanning_basis._mixing(np.random.default_rng(4), k, 3, 3.0)
    measured = np.linalg.cond(C) if k > 1 else 1 / np.abs(C[:, 0, 0])
    np.testing.assert_allclose(measured, 1e3, rtol=1e3 * ROUNDING)
