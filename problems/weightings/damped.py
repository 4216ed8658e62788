"""W = W~ + E' Gamma E: a positive definite W~ added to a weight that is not."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.weightings.definite import definite
from sandbox import check
from sandbox.errors import ShapeError
from sandbox.weight import Weight

Array = np.ndarray


def damped(weight: Weight, base: Any) -> Weight:
    """W~ + W, kept factored; base W~ is a number, (n,) a diagonal, or (..., n, n), positive definite [unit of W].

    Condition (7) then holds wherever W >= 0; what W asked for is no longer met exactly.
    Raises WeightNotPositiveDefiniteError, AsymmetricWeightError. Source: methods M19; the paper's reference [27].
    """
    return Weight(weight.base + positive_definite(base, weight.n, "base"), weight.E, weight.gamma)


def positive_definite(values: Any, size: int, field: str) -> Array:
    """A symmetric positive definite matrix (..., size, size) from a number, a diagonal (size,) or itself.

    Raises ShapeError, AsymmetricWeightError, WeightNotPositiveDefiniteError; the last names the member and an eigenvalue.
    """
    return definite(symmetric(values, size, field), field, "give one that is")


def symmetric(values: Any, size: int, field: str) -> Array:
    """A symmetric matrix (..., size, size) from a number, a diagonal (size,) or itself.

    Raises ShapeError, AsymmetricWeightError.
    """
    given = check.real(values, field)
    if given.ndim < 2:
        if given.ndim == 1 and given.shape != (size,):
            raise ShapeError(f"{field} has {given.size} entries on its diagonal; it must have {size}", field=field)
        given = given * np.eye(size)
    check.shape(given, ("n", "n"), {"n": size}, field)
    return check.symmetric(given, field)
