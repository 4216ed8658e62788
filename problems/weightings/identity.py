"""W = I, or the squared inverse of joint scales."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.robots.robot import Robot
from sandbox.errors import RangeError
from sandbox.parameters import extended, told
from sandbox.weight import Weight

Array = np.ndarray


SCALES = "give scales=(s_1, ..., s_n), how far each joint is wont to move [rad, m]"


class MixedUnitsError(RangeError):
    """Radians and metres have no common length: W = I would compare them as if they had."""


def one_unit(robot: Robot, way_out: str = SCALES) -> None:
    """Refuse (MixedUnitsError) joints that turn beside joints that slide where all are weighed alike."""
    if robot.prismatic.any() and not robot.prismatic.all():
        first = int(np.flatnonzero(robot.prismatic)[0]) + 1
        raise MixedUnitsError(
            f"{robot.name} mixes revolute and prismatic joints (joint {first} slides): W = I has no unit there; {way_out}",
            robot=robot.name, joint=first,
        )  # fmt: skip


def identity(robot: Robot, q: Array, scales: Any = None) -> Weight:
    """W = diag(1/s_i^2), s (n,) [rad, m] the joint scales; I without them.

    Raises MixedUnitsError for revolute beside prismatic joints without scales, RangeError for a scale that is not positive.
    """
    if scales is None:
        one_unit(robot)
        scales = np.ones(robot.n)
    scales = extended(scales, "scales")
    if scales.shape != (robot.n,) or not (np.isfinite(scales) & (scales > 0)).all():
        raise RangeError(f"scales must be {robot.n} positive numbers [rad, m], not {told(scales.tolist())}", scales=scales)
    return Weight(np.broadcast_to(np.diag(scales**-2.0), (*np.shape(q)[:-1], robot.n, robot.n)))
