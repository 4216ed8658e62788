"""Seeded generic situations: configurations away from singularities and from stationary points, and task velocities."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from problems.robots.robot import Robot
from sandbox.errors import EmptyPlanError
from sandbox.method import Draw

Array = np.ndarray

SHARE = 0.9
"""Joints are drawn within this share of their limits."""

LIMIT = 2.5
"""Where a joint has no limit, it is drawn within this, both ways [rad, m]."""

HEALTHY = 0.05
"""Smallest singular value of J, as a share of the largest, of a generic configuration."""

STATIONARY = 1e-3
"""A configuration is generic where |N'grad f| exceeds this share of |grad f| (N orthonormal)."""

ATTEMPTS = 200
"""Rounds of drawing before giving up."""


def generic(robot: Robot, rng: np.random.Generator, count: int, accept: Callable[[Array], Array] | None = None) -> Draw:
    """`count` configurations with sigma_min(J) healthy, and task velocities, each row uniform in [-1, 1) [m/s, rad/s].

    accept : q (B, n) -> (B,) bool, a further condition; see `moving` for one

    Raises EmptyPlanError where hardly any configuration is accepted.
    """
    middle, half = centre(robot)
    kept: list[Array] = []
    for _ in range(ATTEMPTS):
        q = middle + SHARE * half * rng.uniform(-1.0, 1.0, (count, robot.n))
        sigma = np.linalg.svd(robot.jacobian(q), compute_uv=False)
        q = q[sigma[:, -1] > HEALTHY * sigma[:, 0]]
        if len(q) and accept is not None:
            q = q[accept(q)]
        kept.extend(q)
        if len(kept) >= count:
            return Draw(np.array(kept[:count]), rng.uniform(-1.0, 1.0, (count, robot.m)))
    raise EmptyPlanError(f"{robot.name}: only {len(kept)} of {count} generic configurations found")


def centre(robot: Robot) -> tuple[Array, Array]:
    """Middle and half width (n,) of the range that joints are drawn from."""
    bounded = np.isfinite(robot.lower) & np.isfinite(robot.upper)
    lower, upper = np.where(bounded, robot.lower, -LIMIT), np.where(bounded, robot.upper, LIMIT)
    return (lower + upper) / 2, (upper - lower) / 2


def moving(robot: Robot, q: Array, gradient: Array) -> Array:
    """Where the null-space part of a gradient (B, n) is not negligible: q is no stationary point of f on its self-motion."""
    J = robot.jacobian(q)
    V = np.linalg.svd(J)[2][:, robot.m :, :]
    part = np.linalg.norm(np.einsum("bki,bi->bk", V, gradient), axis=-1)
    return part > STATIONARY * np.linalg.norm(gradient, axis=-1)
