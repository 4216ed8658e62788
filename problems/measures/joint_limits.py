"""Distance from the joint limits (Liegeois 1977; methods M3)."""

from __future__ import annotations

import numpy as np

from sandbox.errors import RangeError

Array = np.ndarray


def _centre(lower: Array, upper: Array) -> tuple[Array, Array]:
    if not np.all(lower < upper):
        raise RangeError("every lower joint limit must lie below the upper one", lower=lower, upper=upper)
    return (lower + upper) / 2, (upper - lower) / 2


def joint_limits(q: Array, lower: Array, upper: Array) -> Array:
    """Measure f = 1/n sum ((q_i - c_i)/(c_i - upper_i))^2 (...,), dimensionless; q (..., n), limits (n,) [rad].

    Raises RangeError where a lower limit is not below its upper one.
    """
    centre, half = _centre(lower, upper)
    return np.mean(((q - centre) / half) ** 2, axis=-1)


def joint_limits_gradient(q: Array, lower: Array, upper: Array) -> Array:
    """Gradient of f (..., n) [1/rad], f as in `joint_limits`.

    Raises RangeError where a lower limit is not below its upper one.
    """
    centre, half = _centre(lower, upper)
    return 2 / q.shape[-1] * (q - centre) / half**2
