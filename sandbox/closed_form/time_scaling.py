"""Time scaling, shown beside the closed forms: the path is kept and travelled more slowly."""

from __future__ import annotations

import numpy as np

from sandbox.errors import RangeError

Array = np.ndarray


@np.errstate(all="ignore")
def time_scaling(qdot: Array, limits: Array, self_motion: Array | None = None) -> tuple[Array, Array]:
    """(s qdot + self_motion, s), s the largest in [0, 1] that keeps every |rate| within `limits` (n,) [rad/s, m/s].

    qdot (..., n) carries xdot, self_motion (..., n) moves nothing of the task. s is NaN where the self-motion alone
    exceeds a limit: shrink it first. Raises RangeError for a limit that is not positive.
    Source: methods C3; Hollerbach 1984.
    """
    limits = np.asarray(limits, dtype=np.float64)
    if not (limits > 0).all():
        raise RangeError(f"a rate limit is {limits.min()}; limits must be positive", field="limits", value=float(limits.min()))
    own = np.zeros_like(qdot) if self_motion is None else self_motion
    room = limits - np.sign(qdot) * own
    share = np.where(qdot != 0, room / np.abs(qdot), np.inf)
    s = np.minimum(1.0, share.min(axis=-1))
    s = np.where((np.abs(own) <= limits).all(axis=-1), s, np.nan)
    return s[..., None] * qdot + own, s
