"""Positive definiteness of stacked matrices, decided free of the joints' units."""

from __future__ import annotations

from typing import Any

import numpy as np

from sandbox import check
from sandbox.errors import WeightNotPositiveDefiniteError
from sandbox.parameters import configuration, matrix
from sandbox.tolerances import POSITIVE_PIVOT, UNIT

Array = np.ndarray


def definite(A: Array, name: str, way_out: str) -> Array:
    """A (..., n, n), symmetric, if it is positive definite by more than rounding.

    Decided on D A D, D = diag(A_ii^-1/2): definiteness is that of A (Sylvester), and no unit is left in it.

    Raises WeightNotPositiveDefiniteError with the configuration, the smallest eigenvalue of D A D (or the diagonal
    entry that is not positive) and `way_out`.
    """
    diagonal = np.diagonal(A, axis1=-2, axis2=-1)
    positive = diagonal > 0
    root = np.sqrt(np.where(positive, diagonal, 1.0))
    least = np.linalg.eigvalsh(A / (root[..., :, None] * root[..., None, :]))[..., 0]
    least = np.where(positive.all(axis=-1), least, diagonal.min(axis=-1))
    bad = least <= POSITIVE_PIVOT * A.shape[-1] * UNIT
    if bad.any():
        index = check.first(bad)
        where = f" at {configuration(index)}" if index else ""
        if not positive[index].all():
            joint = int(np.argmin(diagonal[index])) + 1
            what = f"its diagonal entry of joint {joint} is {diagonal[index][joint - 1]:.3g}"
        else:
            what = f"scaled to a unit diagonal its smallest eigenvalue is {least[index]:.3g}"
        raise WeightNotPositiveDefiniteError(
            f"{name} is not positive definite{where}: {what}; {way_out}",
            index=index, lambda_min=float(least[index]), matrix=name,
        )  # fmt: skip
    return A


def positive_definite(values: Any, field: str, size: int, way_out: str = "give one that is") -> Array:
    """A symmetric positive definite matrix (..., size, size) from a number, its diagonal (size,), or itself.

    Raises ShapeError, AsymmetricWeightError, WeightNotPositiveDefiniteError.
    """
    return definite(matrix(values, field, size), field, way_out)
