"""A spherical-revolute-spherical arm of seven joints, by its table of Denavit-Hartenberg parameters."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from problems.robots import denavit_hartenberg as table
from problems.robots.denavit_hartenberg import Link
from problems.robots.robot import TASKS, Robot

QUARTER = np.pi / 2

LINKS = (
    Link(d=0.34, alpha=-QUARTER),
    Link(d=0.0, alpha=QUARTER),
    Link(d=0.4, alpha=QUARTER),
    Link(d=0.0, alpha=-QUARTER),
    Link(d=0.4, alpha=-QUARTER),
    Link(d=0.0, alpha=QUARTER),
    Link(d=0.126, alpha=0.0),
)
"""Standard convention, all a = 0: the axes of joints 1-3 meet in the shoulder, those of 5-7 in the wrist."""

MASSES = (0.0, 4.0, 2.0, 3.0, 1.5, 1.5, 0.5)
"""Point masses [kg] at the origins of frames 1..7."""

ROTOR = 0.0625
"""Inertia of each joint's drive about its own axis [kg m^2]."""

LIMITS = (2.9, 2.0, 2.9, 2.0, 2.9, 2.0, 3.0)
"""Joint limits, symmetric [rad]."""

RATES = (1.5, 1.5, 1.75, 1.25, 2.25, 2.25, 2.25)
"""Largest joint rates [rad/s]."""


def seven_joint() -> Robot:
    """The arm, its task the pose of the tool; the numbers are made up, the proportions those of a light-weight arm."""
    model = table.arm("seven_joint", LINKS, hand="tool")
    for joint, mass in enumerate(MASSES, start=1):
        origin = model.frames[model.getFrameId(f"frame_{joint}")].placement.translation
        model.appendBodyToJoint(joint, pin.Inertia(mass, origin, np.zeros((3, 3))), pin.SE3.Identity())
    model.armature = np.full(len(LINKS), ROTOR)
    table.limit(model, [-limit for limit in LIMITS], LIMITS, RATES)
    about = "spherical-revolute-spherical arm of seven joints, point masses at its frames; made up"
    return Robot("seven_joint", model, "tool", TASKS["pose"], about)


SEVEN_JOINT = seven_joint()
