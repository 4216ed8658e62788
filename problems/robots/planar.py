"""Planar nR arms: relative joint angles, motion in the x-y plane, gravity along -y."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from problems.robots.robot import TASKS, Robot
from sandbox import check
from sandbox.errors import RangeError, ShapeError
from sandbox.parameters import flag, text

Array = np.ndarray

GRAVITY = 9.81
"""[m/s^2]"""

LIMIT = 2.75
"""Limit of every joint, both ways [rad]."""

RATE = 2.0
"""Largest rate of every joint [rad/s]."""


def planar_arm(
    lengths: Sequence[float], masses: Sequence[float] | None = None, *, rods: bool = False, name: str | None = None
) -> Robot:
    """A planar arm of n revolute joints; its task is the tip's position ("planar"), or with its angle ("planar pose").

    lengths : link lengths (n,) [m]
    masses : of the links (n,) [kg], 1 each if left out: points at the link ends, or uniform thin rods

    Raises RangeError where a length or mass is not positive, ShapeError where the two differ in number or are no row of
    numbers, NonFiniteError.
    """
    size = _positive(lengths, "length")
    n = len(size)
    load = np.ones(n) if masses is None else _positive(masses, "mass")
    if len(load) != n:
        raise ShapeError(f"{n} link lengths and {len(load)} masses: give one of each per link")
    rods = flag(rods, "rods")
    model = pin.Model()
    model.name = f"planar_{n}r" if name is None else text(name, "the name of a robot")
    model.gravity.linear = np.array([0.0, -GRAVITY, 0.0])
    joint, place = 0, pin.SE3.Identity()
    for link, (length, mass) in enumerate(zip(size, load, strict=True), start=1):
        joint = model.addJoint(joint, pin.JointModelRZ(), place, f"joint_{link}")
        centre = np.array([length / 2 if rods else length, 0.0, 0.0])
        about_centre = mass * length**2 / 12 * np.diag([0.0, 1.0, 1.0]) if rods else np.zeros((3, 3))
        model.appendBodyToJoint(joint, pin.Inertia(mass, centre, about_centre), pin.SE3.Identity())
        place = pin.SE3(np.eye(3), np.array([length, 0.0, 0.0]))
    model.addFrame(pin.Frame("tip", joint, 0, place, pin.FrameType.OP_FRAME))
    model.lowerPositionLimit = np.full(n, -LIMIT)
    model.upperPositionLimit = np.full(n, LIMIT)
    model.velocityLimit = np.full(n, RATE)
    loads = "uniform rods" if rods else "point masses at the link ends"
    return Robot(model.name, model, "tip", TASKS["planar"], f"planar arm of {n} revolute joints, {loads}")


def _positive(values: Sequence[float], what: str) -> Array:
    """One positive number per link (n,)."""
    numbers = check.real(values, f"link {what}")
    if numbers.ndim != 1 or not len(numbers):
        raise ShapeError(f"the link {what} has shape {numbers.shape}; give one per link, and one link at least")
    for link, value in enumerate(numbers, start=1):
        if not value > 0:
            raise RangeError(f"the {what} of link {link} is {value:g}; it must be positive", link=link, value=float(value))
    return numbers


PLANAR_3R = planar_arm((1.0, 1.0, 1.0))
PLANAR_4R = planar_arm((1.0, 1.0, 1.0, 1.0))
