"""Franka Emika Panda with its hand, from published parameters; needs no file.

Kinematics: Franka's table in the modified convention; the hand is turned by -pi/4 on the flange, the tool centre point
0.1034 m ahead. Limits and rates: Franka's data sheet.

Inertias: as the public franka_description carries them. Links 1-7 are those identified by C. Gaz, M. Cognetti, A. Oliva,
P. Robuffo Giordano, A. De Luca, Dynamic identification of the Franka Emika Panda robot with retrieval of feasible
parameters using penalty-based optimization, IEEE RA-L 4(4), 2019, doi 10.1109/LRA.2019.2931248; the hand (0.73 kg) is
Franka's own, its two fingers (0.015 kg each) are closed. Masses are single numbers of a fit, not weighed links: only the
motion of the whole arm is meant by them. No rotor inertia is added, friction is left out.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pinocchio as pin

from problems.robots import denavit_hartenberg as table
from problems.robots.denavit_hartenberg import Link, turned
from problems.robots.robot import TASKS, Robot

Array = np.ndarray

QUARTER = np.pi / 2

LINKS = (
    Link(a=0.0, alpha=0.0, d=0.333),
    Link(a=0.0, alpha=-QUARTER, d=0.0),
    Link(a=0.0, alpha=QUARTER, d=0.316),
    Link(a=0.0825, alpha=QUARTER, d=0.0),
    Link(a=-0.0825, alpha=-QUARTER, d=0.384),
    Link(a=0.0, alpha=QUARTER, d=0.0),
    Link(a=0.088, alpha=QUARTER, d=0.0),
)
"""Modified convention; a and alpha are those of the link before."""

FLANGE = 0.107
"""From frame 7 to the flange, along its z [m]."""

HAND_TURN = -np.pi / 4
"""Of the hand on the flange, about z [rad]."""

TOOL = 0.1034
"""From the flange to the tool centre point between the finger tips, along z [m]."""

LOWER = (-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973)
UPPER = (2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973)
"""Joint limits [rad]."""

RATES = (2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61)
"""Largest joint rates [rad/s]."""


class Body(NamedTuple):
    """Mass [kg], centre [m], and inertia about it: xx, xy, xz, yy, yz, zz [kg m^2]."""

    mass: float
    centre: tuple[float, float, float]
    about_centre: tuple[float, float, float, float, float, float]

    def inertia(self) -> pin.Inertia:
        """The same for pinocchio."""
        xx, xy, xz, yy, yz, zz = self.about_centre
        return pin.Inertia(self.mass, np.array(self.centre), np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))


BODIES = (
    Body(4.970684, (0.003875, 0.002081, -0.04762), (0.70337, -0.000139, 0.006772, 0.70661, 0.019169, 0.009117)),
    Body(0.646926, (-0.003141, -0.02872, 0.003495), (0.007962, -0.003925, 0.010254, 0.02811, 0.000704, 0.025995)),
    Body(3.228604, (0.027518, 0.039252, -0.066502), (0.037242, -0.004761, -0.011396, 0.036155, -0.012805, 0.01083)),
    Body(3.587895, (-0.05317, 0.104419, 0.027454), (0.025853, 0.007796, -0.001332, 0.019552, 0.008641, 0.028323)),
    Body(1.225946, (-0.011953, 0.041065, -0.038437), (0.035549, -0.002117, -0.004037, 0.029474, 0.000229, 0.008627)),
    Body(1.666555, (0.060149, -0.014117, -0.010517), (0.001964, 0.000109, -0.001158, 0.004354, 0.000341, 0.005433)),
    Body(0.735522, (0.010517, -0.004252, 0.061597), (0.012516, -0.000428, -0.001196, 0.010027, -0.000741, 0.004815)),
)
"""Links 1-7, in the axes of frames 1-7."""

HAND = Body(0.73, (-0.01, 0.0, 0.03), (0.001, 0.0, 0.0, 0.0025, 0.0, 0.0017))
"""The hand, in its own axes."""

FINGER = Body(0.015, (0.0, 0.0, 0.0584), (2.375e-6, 0.0, 0.0, 2.375e-6, 0.0, 7.5e-7))
"""One of its two fingers, closed, in the hand's axes."""


def panda() -> Robot:
    """The Panda of seven joints; its task is the pose of the tool centre point."""
    hand = pin.SE3(turned("z", HAND_TURN), np.array([0.0, 0.0, FLANGE]))
    tool = pin.SE3(np.eye(3), np.array([0.0, 0.0, TOOL]))
    model = table.arm("panda", LINKS, convention="modified", flange=hand * tool, hand="hand_tcp")
    for joint, body in enumerate(BODIES, start=1):
        model.appendBodyToJoint(joint, body.inertia(), pin.SE3.Identity())
    for body in (HAND, FINGER, FINGER):
        model.appendBodyToJoint(len(LINKS), body.inertia(), hand)
    table.limit(model, LOWER, UPPER, RATES)
    return Robot("panda", model, "hand_tcp", TASKS["pose"], "Franka Emika Panda with its hand; inertias of Gaz et al. 2019")


PANDA = panda()
