"""C3: qdot = s J^+ xdot + qdot_h, s the largest in [0, 1] within the rate limits (Hollerbach 1984), found by bisection."""

from __future__ import annotations

import numpy as np

from problems.robots.robot import Robot

Array = np.ndarray

HALVINGS = 60
"""Of [0, 1]: more than a float64 has."""

SHRUNK = 1 - 2.0**-20
"""Share of the limits that a self-motion beyond them is shrunk to."""


def original(
    robot: Robot, q: Array, xdot: Array, *,
    alpha: float = 0.5, posture: Array | None = None, rate_limits: Array | None = None,
) -> Array:  # fmt: skip
    """Joint rates (B, n); qdot_h = -alpha (I - J^+J)(q - posture), shrunk first where it exceeds a limit by itself."""
    limits = robot.rate_limits if rate_limits is None else np.asarray(rate_limits, dtype=float)
    J = robot.jacobian(q)
    pinv = np.linalg.pinv(J)
    move = np.einsum("bnm,bm->bn", pinv, xdot)
    z = -alpha * (q - (np.zeros(robot.n) if posture is None else posture))
    own = z - np.einsum("bnm,bm->bn", pinv, np.einsum("bmn,bn->bm", J, z))
    over = (np.abs(own) / limits).max(axis=-1, keepdims=True)
    own = np.where(over > SHRUNK, own * SHRUNK / np.maximum(over, SHRUNK), own)

    def feasible(s: Array) -> Array:
        return (np.abs(s[:, None] * move + own) <= limits).all(axis=-1)

    low, high = np.zeros(len(q)), np.ones(len(q))
    whole = feasible(high)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        good = feasible(middle)
        low, high = np.where(good, middle, low), np.where(good, high, middle)
    return np.where(whole, 1.0, low)[:, None] * move + own
