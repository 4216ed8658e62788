"""Whitney's weight: any symmetric positive definite W, most often a diagonal."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.robots.robot import Robot
from problems.weightings.definite import definite
from problems.weightings.identity import identity
from sandbox import check
from sandbox.errors import ShapeError
from sandbox.weight import Weight

Array = np.ndarray

WAY_OUT = "give a positive definite W, or pose the problem with this W itself: eq. (6) asks for N'WN > 0 alone"


def whitney(robot: Robot, q: Array, weight: Any = None) -> Weight:
    """W (..., n, n) from `weight`: its diagonal (n,), one matrix (n, n), or one per configuration (B, n, n).

    Left out, it is diag(n, ..., 2, 1): the joints that carry most move least.

    Raises WeightNotPositiveDefiniteError where W is not positive definite although eq. (6) may accept it, ShapeError,
    AsymmetricWeightError; MixedUnitsError for revolute beside prismatic joints without a weight.

    Source: D. E. Whitney, IEEE Trans. Man-Machine Systems 10(2), 1969; eq. (5), English & Maciejewski.
    """
    lead, n = np.shape(q)[:-1], robot.n
    if weight is None:
        identity(robot, q)  # refuses mixed units
        weight = np.arange(n, 0, -1)
    W = check.real(weight, "weight")
    if W.shape == (n,):
        W = np.diag(W)
    if W.ndim < 2 or W.shape[-2:] != (n, n):
        raise ShapeError(f"weight has shape {W.shape}; it must be ({n},), ({n}, {n}) or (B, {n}, {n})", shape=W.shape)
    check.leading({"q": lead, "weight": W.shape[:-2]})
    W = definite(check.symmetric(W, "weight"), "weight", WAY_OUT)
    return Weight(np.broadcast_to(W, (*np.broadcast_shapes(lead, W.shape[:-2]), n, n)))
