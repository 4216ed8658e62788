"""W = I, and joint scales."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from problems.robots.planar import PLANAR_3R
from problems.robots.robot import Robot
from problems.weightings.identity import MixedUnitsError, identity
from sandbox.errors import RangeError

Q = np.zeros((2, 3))


def chain(*kinds):
    """A robot of these joints, one after another."""
    model, joint = pin.Model(), 0
    for i, kind in enumerate(kinds, start=1):
        moving = pin.JointModelRZ() if kind == "turns" else pin.JointModelPX()
        joint = model.addJoint(joint, moving, pin.SE3.Identity(), f"{i}")
    model.addFrame(pin.Frame("hand", joint, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    return Robot("chain", model, "hand", (0, 1))


def test_identity_and_scales():
    """One I per configuration; scales s make diag(1/s^2)."""
    np.testing.assert_array_equal(identity(PLANAR_3R, Q).dense(), [np.eye(3)] * 2)
    np.testing.assert_array_equal(identity(PLANAR_3R, Q[0], [1, 0.5, 4]).dense(), np.diag([1, 4, 1 / 16]))


@pytest.mark.parametrize(
    "kinds, joint", [(("turns", "slides", "turns"), 2), (("slides", "turns", "turns"), 1), (("turns", "slides", "slides"), 2)]
)
def test_mixed_joints_need_scales(kinds, joint):
    """Radians beside metres have no W = I: refused by the first joint that slides, taken with scales."""
    with pytest.raises(MixedUnitsError, match=rf"\(joint {joint} slides\)") as refusal:
        identity(chain(*kinds), Q)
    assert refusal.value.evidence["joint"] == joint
    assert identity(chain(*kinds), Q, [1, 1, 1]).lead == (2,)


@pytest.mark.parametrize("kind", ["turns", "slides"])
def test_joints_of_one_kind_need_none(kind):
    """Joints that all turn, or all slide, have one unit."""
    np.testing.assert_array_equal(identity(chain(kind, kind, kind), Q[0]).dense(), np.eye(3))


@pytest.mark.parametrize(
    "scales", [[1, 1], [1, 0, 1], [1, -1, 1], [1, np.inf, 1], [1, np.nan, 1], 1.0, [[1, 1, 1], [1, 1, 1]]], ids=str
)
def test_scales_are_one_positive_number_per_joint(scales):
    """Any other number of them, zero, negative or not finite: refused."""
    with pytest.raises(RangeError, match="scales must be 3 positive numbers"):
        identity(PLANAR_3R, Q, scales)
