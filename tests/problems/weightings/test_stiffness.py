"""Stiffness and compliance are two things."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from problems.methods.draw import scattered
from problems.robots.planar import PLANAR_3R
from problems.robots.robot import Robot
from problems.weightings.stiffness import (
    ComplianceAsPrinted,
    JointCompliance,
    JointStiffness,
    UnitMismatchError,
    stiffness,
)
from sandbox.errors import AsymmetricWeightError, ShapeError, WeightNotPositiveDefiniteError
from sandbox.tolerances import UNIT

Q = np.zeros((2, 3))


def test_compliance_is_the_inverse_of_stiffness():
    """JointCompliance(K^-1) is the weight of JointStiffness(K); ComplianceAsPrinted takes the same matrix literally."""
    K = scattered(np.random.default_rng(0), 3)
    C = np.linalg.inv(K)
    C = (C + C.T) / 2
    rounding = 64 * UNIT * np.linalg.cond(K) * np.abs(K).max()
    np.testing.assert_array_equal(stiffness(PLANAR_3R, Q, JointStiffness(K)).dense()[1], K)
    np.testing.assert_allclose(stiffness(PLANAR_3R, Q, JointCompliance(C)).dense()[1], K, atol=rounding)
    np.testing.assert_array_equal(stiffness(PLANAR_3R, Q, ComplianceAsPrinted(C)).dense()[1], C)


def test_an_unlabelled_matrix_is_refused():
    """A bare matrix may be either; the error names the three labels."""
    with pytest.raises(ShapeError, match=r"JointStiffness\(K\), JointCompliance\(C\).*ComplianceAsPrinted"):
        stiffness(PLANAR_3R, Q, np.eye(3))


@pytest.mark.parametrize("kind", [JointStiffness, JointCompliance, ComplianceAsPrinted])
def test_not_positive_definite_refused(kind):
    """K or C that is singular, indefinite, asymmetric or of the wrong size is refused."""
    for matrix in ([1, 0, 1], np.diag([1.0, -1, 1])):
        with pytest.raises(WeightNotPositiveDefiniteError, match=f"{kind.letter} is not positive definite"):
            stiffness(PLANAR_3R, Q, kind(matrix))
    with pytest.raises(AsymmetricWeightError):
        stiffness(PLANAR_3R, Q, kind([[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]))
    with pytest.raises(ShapeError):
        stiffness(PLANAR_3R, Q, kind([1, 2]))


@pytest.mark.parametrize("kind, right, wrong", [(JointStiffness, "Nm/rad", "rad/Nm"), (JointCompliance, "rad/Nm", "Nm/rad")])
def test_a_wrong_unit_is_refused(kind, right, wrong):
    """A stiffness given in the unit of a compliance, or of sliding joints, is refused; its own unit is taken."""
    stiffness(PLANAR_3R, Q, kind([1, 2, 3], right))
    for unit in (wrong, "N/m", "Nm/deg"):
        with pytest.raises(UnitMismatchError, match=f"not {unit}"):
            stiffness(PLANAR_3R, Q, kind([1, 2, 3], unit))


@pytest.mark.parametrize("kinds, right", [("PPP", "N/m"), ("RRR", "Nm/rad"), ("RPR", "Nm/rad, N/m"), ("PRR", "Nm/rad, N/m")])
def test_the_unit_is_that_of_the_joints(kinds, right):
    """Sliding joints have N/m, turning ones Nm/rad, both in one arm both; the compliance's unit is the inverse."""
    model, joint = pin.Model(), 0
    for kind in kinds:
        moving = pin.JointModelRZ() if kind == "R" else pin.JointModelPX()
        joint = model.addJoint(joint, moving, pin.SE3.Identity(), f"joint_{joint + 1}")
    model.addFrame(pin.Frame("hand", joint, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    robot = Robot("chain", model, "hand", (0, 1))
    inverse = {"N/m": "m/N", "Nm/rad": "rad/Nm", "Nm/rad, N/m": "rad/Nm, m/N"}
    for kind, own in ((JointStiffness, dict.fromkeys(inverse)), (JointCompliance, inverse)):
        for unit in inverse:
            given = kind([1, 2, 3], own[unit] or unit)
            if unit == right:
                assert stiffness(robot, Q, given).lead == (2,)
            else:
                with pytest.raises(UnitMismatchError):
                    stiffness(robot, Q, given)


def test_one_matrix_for_each_configuration_or_one_for_all():
    """Two for two configurations, one for both; three are refused by their letter."""
    K = scattered(np.random.default_rng(1), 3, 3)
    np.testing.assert_array_equal(stiffness(PLANAR_3R, Q, JointStiffness(K[:2])).dense(), K[:2])
    with pytest.raises(ShapeError, match="K"):
        stiffness(PLANAR_3R, Q, JointStiffness(K))
