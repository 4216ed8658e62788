"""Whitney's weight: any symmetric positive definite W, most often a diagonal."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.robots.robot import Robot
from problems.weightings.definite import positive_definite
from problems.weightings.identity import one_unit
from sandbox.parameters import scalar, within
from sandbox.weight import Weight

Array = np.ndarray

WAY_OUT = "give a positive definite W, or pose the problem with this W itself: eq. (6) asks for N'WN > 0 alone"


def whitney(robot: Robot, q: Array, weight: Any = None) -> Weight:
    """W (..., n, n) from `weight`: a number, its diagonal (n,), one matrix (n, n), or one per configuration (B, n, n).

    Left out, it is diag(n, ..., 2, 1): the joints that carry most move least.

    Raises WeightNotPositiveDefiniteError where W is not positive definite although eq. (6) may accept it, ShapeError,
    AsymmetricWeightError; MixedUnitsError for revolute beside prismatic joints without a weight.

    Source: D. E. Whitney, IEEE Trans. Man-Machine Systems 10(2), 1969; eq. (5), English & Maciejewski.
    """
    lead, n = np.shape(q)[:-1], robot.n
    if weight is None or scalar(weight):
        one_unit(robot, "give weight, its diagonal (n,) or all of it")
        weight = np.arange(n, 0, -1) if weight is None else weight
    W = positive_definite(weight, "weight", n, WAY_OUT)
    within(lead, W.shape[:-2], "weight")
    return Weight(np.broadcast_to(W, (*lead, n, n)))
