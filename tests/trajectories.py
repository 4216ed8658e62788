"""A planar 3R arm whose hand follows a line: problems that follow each other, numbers short enough to be exact."""

from __future__ import annotations

import numpy as np

from problems.sets import construct as make
from sandbox.problem import VelocityProblem
from sandbox.problem_set import Group

Array = np.ndarray

DURATION = 2.0
"""Of one trajectory [s]."""

JOINTS = 3


def jacobian(q: Array) -> Array:
    """Of the hand's position (2, n), unit links: column k is the hand as joint k sees it, turned by a right angle."""
    angles = np.cumsum(q)
    tail = np.cumsum(np.stack([-np.sin(angles), np.cos(angles)])[:, ::-1], axis=1)
    return tail[:, ::-1]


def inertia(q: Array) -> Array:
    """Of unit point masses at the ends of the links, and a little of every joint's own (n, n)."""
    n = len(q)
    parts = [np.pad(jacobian(q[:k]), ((0, 0), (0, n - k))) for k in range(1, n + 1)]
    return sum(part.T @ part for part in parts) + np.eye(n) / 8


def line(seed: int, steps: int) -> list[tuple[Array, Array, Array, Array]]:
    """J, xdot, W, a along one trajectory: W the inertia, f = |q|^2/4, integrated in Euler steps."""
    rng = np.random.default_rng(seed)
    q, xdot = rng.uniform(0.3, 0.9, JOINTS), make.short(rng.uniform(-0.3, 0.3, 2))
    members = []
    for _ in range(steps):
        J, W, a = (make.short(part) for part in (jacobian(q), inertia(q), q / 2))
        members.append((J, xdot, W, a))
        K = np.block([[W, J.T], [J, np.zeros((2, 2))]])
        q = q + DURATION / steps * np.linalg.solve(K, np.concatenate([-a, xdot]))[:JOINTS]
    return members


def lines(*seeds: int, steps: int) -> Group:
    """A sequence: one trajectory per seed, one after the other."""
    J, xdot, W, a = (np.stack(parts) for parts in zip(*(m for seed in seeds for m in line(seed, steps)), strict=True))
    labels = {"seed": np.repeat(seeds, steps).tolist(), "step": list(range(steps)) * len(seeds)}
    return Group(VelocityProblem(J=J, xdot=xdot, W=W, a=a), labels, sequence=True)
