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

    def once() -> tuple[Array]:
        q = anywhere(robot, rng, count)
        sigma = np.linalg.svd(robot.jacobian(q), compute_uv=False)
        q = q[sigma[:, -1] > HEALTHY * sigma[:, 0]]
        return (q[accept(q)] if len(q) and accept is not None else q,)

    (q,) = gathered(once, count, f"generic configurations of {robot.name}")
    return Draw(q, rng.uniform(-1.0, 1.0, (count, robot.m)))


def gathered(once: Callable[[], tuple[Array, ...]], count: int, what: str, *, attempts: int = ATTEMPTS) -> tuple[Array, ...]:
    """The first `count` members of the stacks that `once` draws, asked until they are enough.

    Raises EmptyPlanError where `attempts` are not enough.
    """
    kept: list[tuple[Array, ...]] = []
    for _ in range(attempts):
        kept.append(once())
        if sum(len(first) for first, *_ in kept) >= count:
            return tuple(np.concatenate(parts)[:count] for parts in zip(*kept, strict=True))
    raise EmptyPlanError(f"only {sum(len(first) for first, *_ in kept)} of {count} {what} found")


def anywhere(robot: Robot, rng: np.random.Generator, count: int) -> Array:
    """Configurations (count, n) within SHARE of the limits."""
    middle, half = centre(robot)
    return middle + SHARE * half * rng.uniform(-1.0, 1.0, (count, robot.n))


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


def scattered(rng: np.random.Generator, n: int, count: int | None = None) -> Array:
    """Random positive definite matrices (count, n, n), or one (n, n), with eigenvalues in [1/2, 8)."""
    lead = () if count is None else (count,)
    turn = np.linalg.qr(rng.standard_normal((*lead, n, n)))[0]
    A = (turn * 2 ** rng.uniform(-1.0, 3.0, (*lead, 1, n))) @ np.swapaxes(turn, -1, -2)
    return (A + np.swapaxes(A, -1, -2)) / 2
