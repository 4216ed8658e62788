"""What the originals' parameters stand for where they are short or left out; nothing here is the framework's."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.robots.robot import Robot

Array = np.ndarray


def matrix(values: Any, n: int) -> Array:
    """A number, a diagonal (n,) or a matrix (..., n, n) as a matrix."""
    A = np.asarray(values, dtype=float)
    return A if A.ndim > 1 else A * np.eye(n)


def springs(robot: Robot, q: Array, stiffness: Any, rest: Any) -> tuple[Array, Array]:
    """K (n, n) and grad g = K (q - rest) (B, n), g = 1/2 (q - rest)'K(q - rest); K is I and rest zero if left out."""
    K = matrix(1.0 if stiffness is None else stiffness, robot.n)
    return K, (q - np.asarray(0.0 if rest is None else rest, dtype=float)) @ K


def secondary_rows(robot: Robot, q: Array, E: Any, gbar: Any) -> tuple[Array, Array]:
    """E (B, p, n), of q_1, ..., q_(k-1) and q_1 + ... + q_n if left out, and gbar (B, p), zero if left out."""
    if E is None:
        E = np.eye(robot.n)[: robot.n - robot.m]
        E[-1] = 1.0
    E = np.broadcast_to(E, (len(q), *np.shape(E)[-2:]))
    return E, np.broadcast_to(0.0 if gbar is None else gbar, E.shape[:2])


def obstacle(robot: Robot, place: Any) -> Array:
    """An obstacle (..., 3) [m]; half way from the base to the hand in a bent posture if left out."""
    if place is not None:
        return np.asarray(place, dtype=float)
    bounded = np.isfinite(robot.lower) & np.isfinite(robot.upper)
    low, high = np.where(bounded, robot.lower, -2.5), np.where(bounded, robot.upper, 2.5)
    return robot.forward(low + 0.625 * (high - low))[0] / 2
