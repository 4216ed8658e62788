"""M7: qdot = J^+ xdot - alpha (I - J^+J) grad f, grad f = -k (d0 - d) Jc'u of the nearest critical point."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from problems.original.gradient_projection import projected
from problems.original.parameters import obstacle as placed
from problems.robots.robot import Robot

Array = np.ndarray


def original(
    robot: Robot, q: Array, xdot: Array, *, alpha: float = 0.01, obstacle: Any = None, reach: float = 0.5,
    stiffness: float = 100.0, points: Sequence[Any] | None = None, scales: Any = None,
) -> Array:  # fmt: skip
    """Joint rates (B, n)."""
    obstacle = placed(robot, obstacle)
    if points is None:
        points = _joints_that_move(robot)
    away = np.stack([robot.point(q, joint, offset) - obstacle for joint, offset in points], axis=-2)
    Jc = np.stack([robot.point_jacobian(q, joint, offset)[..., :3, :] for joint, offset in points], axis=-3)
    d = np.linalg.norm(away, axis=-1)
    pushes = -stiffness * np.maximum(reach - d, 0.0) / d
    each = np.einsum("...p,...pi,...pin->...pn", pushes, away, Jc)
    gradient = np.take_along_axis(each, d.argmin(axis=-1)[..., None, None], axis=-2)[..., 0, :]
    return projected(robot, q, xdot, -alpha * gradient, scales)


def _joints_that_move(robot: Robot) -> list[tuple[int, Array]]:
    """Where the joints of the chain stand that an earlier one moves, as points of the link before."""
    model = robot.model
    last = model.frames[robot.frame(robot.hand)].parentJoint
    chain = [int(i) for i in model.supports[last]][1:]
    places = [(before, np.array(model.jointPlacements[after].translation)) for before, after in pairwise(chain)]
    bent = np.sin(1.0 + np.arange(robot.n))
    size = sum(np.linalg.norm(offset) for _, offset in places)
    moved = [np.linalg.norm(robot.point_jacobian(bent, joint, offset)[:3]) for joint, offset in places]
    return [place for place, rate in zip(places, moved, strict=True) if place[1].any() and rate > 1e-12 * size]
