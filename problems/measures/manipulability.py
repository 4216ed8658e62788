"""Manipulability w = sqrt(det JJ') (Yoshikawa 1985; methods M5)."""

from __future__ import annotations

import numpy as np

Array = np.ndarray


def manipulability(J: Array) -> Array:
    """Product w (...,) of the singular values of J (..., m, n)."""
    return np.prod(np.linalg.svd(J, compute_uv=False), axis=-1)


def manipulability_gradient(J: Array, dJ: Array) -> Array:
    """Gradient dw/dq_k = w tr((dJ/dq_k) J^+) (..., n), for dJ (..., n, m, n) with dJ[..., k, :, :] = dJ/dq_k.

    J must have full row rank: at a singularity w has no gradient.
    """
    return manipulability(J)[..., None] * np.einsum("...kij,...ji->...k", dJ, np.linalg.pinv(J))
