"""N'W and N'a of the augmented Jacobian, eqs. (8)-(10): W = E' Gamma E, a = -E' Gamma gbar."""

from __future__ import annotations

from typing import Any

import numpy as np

from sandbox import check

Array = np.ndarray


def augmented_along(E: Any, N: Any, gbar: Any, gamma: Any = None) -> tuple[Array, Array]:
    """(N'W, N'a) = ((N'E') Gamma E, -(N'E') Gamma gbar), shapes (..., k, n) and (..., k).

    E (..., p, n), rows grad g_i'; N (..., n, k); gbar (..., p) desired rates of the g_i, not differentiated; gamma (p,)
    the scalars gamma_i, 1 if left out. Of one function and k = 1 it is (N' grad g) grad g'.

    Raises ShapeError, NonFiniteError, RangeError.
    """
    E, N, gbar = check.matrices(E, "E"), check.matrices(N, "N"), check.real(gbar, "gbar")
    check.shape(E, ("p", "n"), {}, "E")
    p, n = E.shape[-2:]
    check.shape(N, ("n", "k"), {"n": n}, "N")
    check.shape(gbar, ("p",), {"p": p}, "gbar")
    gamma = np.ones(p) if gamma is None else check.real(gamma, "gamma")
    check.shape(gamma, ("p",), {"p": p}, "gamma")
    met = (np.swapaxes(N, -1, -2) @ np.swapaxes(E, -1, -2)) * gamma[..., None, :]  # (N'E') Gamma
    return met @ E, -(met @ gbar[..., None])[..., 0]
