"""Positive definiteness of stacked matrices, decided free of the joints' units."""

from __future__ import annotations

import numpy as np

from sandbox.errors import WeightNotPositiveDefiniteError
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
        index = tuple(int(i) for i in np.argwhere(bad)[0])
        where = f" at configuration {list(index)}" if index else ""
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


def scattered(rng: np.random.Generator, n: int, count: int | None = None) -> Array:
    """Random positive definite matrices (count, n, n), or one (n, n), with eigenvalues in [1/2, 8)."""
    lead = () if count is None else (count,)
    turn = np.linalg.qr(rng.standard_normal((*lead, n, n)))[0]
    A = (turn * 2 ** rng.uniform(-1.0, 3.0, (*lead, 1, n))) @ np.swapaxes(turn, -1, -2)
    return (A + np.swapaxes(A, -1, -2)) / 2
