"""W = W~ + E' Gamma E: a positive definite W~ added to a weight that is not."""

from __future__ import annotations

from typing import Any

from problems.weightings.definite import positive_definite
from sandbox import check
from sandbox.weight import Weight


def damped(weight: Weight, base: Any) -> Weight:
    """W~ + W, kept factored; base W~ is a number, (n,) a diagonal, or (..., n, n), positive definite [unit of W].

    Condition (7) then holds wherever W >= 0; what W asked for is no longer met exactly.
    Raises WeightNotPositiveDefiniteError, AsymmetricWeightError. Source: methods M19; the paper's reference [27].
    """
    added = positive_definite(base, "base", weight.n)
    check.leading({"W": weight.lead, "base": added.shape[:-2]})
    return Weight(weight.base + added, weight.E, weight.gamma)
