"""Whitney's weight and what it refuses."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from problems.robots.planar import PLANAR_3R
from problems.robots.robot import TASKS, Robot
from problems.weightings.identity import MixedUnitsError
from problems.weightings.whitney import whitney
from sandbox.errors import AsymmetricWeightError, NonFiniteError, ShapeError, WeightNotPositiveDefiniteError

Q = np.zeros((2, 3))


def mixed_robot():
    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "turn")
    joint = model.addJoint(joint, pin.JointModelPX(), pin.SE3.Identity(), "slide")
    model.addFrame(pin.Frame("tip", joint, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    return Robot("mixed", model, "tip", TASKS["planar"])


def test_diagonal_matrix_and_stack():
    """A diagonal, a matrix and one matrix per configuration say the same."""
    expected = np.broadcast_to(np.diag([1.0, 2, 3]), (2, 3, 3))
    for weight in ([1, 2, 3], np.diag([1.0, 2, 3]), expected):
        np.testing.assert_array_equal(whitney(PLANAR_3R, Q, weight).dense(), expected)
    np.testing.assert_array_equal(whitney(PLANAR_3R, Q).dense()[0], np.diag([3.0, 2, 1]))


@pytest.mark.parametrize(
    "weight, error, words",
    [
        (np.diag([-1.0, 1, 1]), WeightNotPositiveDefiniteError, r"eq. \(6\) asks for N'WN > 0 alone"),
        ([1, 2], ShapeError, r"\(2,\); it must be a number, \(3,\), \(3, 3\)"),
        (np.eye(3)[None].repeat(3, axis=0), ShapeError, "stacks do not agree"),
        ([[1, 0.8, 0], [0, 2, -0.5], [0.3, 0, 3]], AsymmetricWeightError, "must be symmetric"),
        ([1, np.nan, 1], NonFiniteError, "must be finite"),
    ],
    ids=["indefinite", "short", "stack", "asymmetric", "nan"],
)
def test_refused(weight, error, words):
    """Weights that are not definite, not symmetric, not finite or of the wrong shape are refused by name."""
    with pytest.raises(error, match=words):
        whitney(PLANAR_3R, Q, weight)


def test_mixed_joints_need_a_weight():
    """Radians and metres are not compared without a weight that says how."""
    robot = mixed_robot()
    with pytest.raises(MixedUnitsError, match="joint 2 slides"):
        whitney(robot, np.zeros((1, 2)))
    np.testing.assert_array_equal(whitney(robot, np.zeros((1, 2)), [1, 4]).dense()[0], np.diag([1.0, 4]))
