"""Free-swinging failures: printed values, joints that never swing, refusals (methods M10)."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from problems.measures.free_swinging import swing, swing_acceleration, swing_angle, swing_torque, turned
from problems.measures.gravity_torque import WeightlessError
from problems.measures.measure import NotDifferentiableError, OutsideDomainError
from problems.robots import load
from problems.robots.planar import GRAVITY, PLANAR_3R, planar_arm
from problems.robots.robot import Robot
from problems.sets import textbook
from sandbox.errors import RangeError, ShapeError
from sandbox.tolerances import UNIT
from tests.problems.measures import chain

F1, F1B = np.array(textbook.F1.q), np.array(textbook.F1B.q)
ROUNDING = 256 * UNIT
MEASURES = pytest.mark.parametrize("factory", [swing_torque, swing_acceleration, swing_angle])


def single(factory, i, q):
    """|X_i| of one joint alone, i of 0..2."""
    return np.sqrt(2 * factory(PLANAR_3R, weights=np.eye(3)[i]).value(PLANAR_3R, q))


def test_torques():
    """tau_g/g0 is (4, 1, 1) at F1 and (3, 0, 0) at F1b."""
    for q, expected in ((F1, [4, 1, 1]), (F1B, [3, 0, 0])):
        np.testing.assert_allclose([single(swing_torque, i, q) for i in range(3)], np.multiply(expected, GRAVITY), atol=1e-13)


def test_accelerations():
    """A/g0 is (1/2, 1/3, 1) at F1 and (.375, 0, 0) at F1b."""
    for q, expected in ((F1, [1 / 2, 1 / 3, 1]), (F1B, [0.375, 0, 0])):
        found = [single(swing_acceleration, i, q) for i in range(3)]
        np.testing.assert_allclose(found, np.multiply(expected, GRAVITY), atol=1e-13)


def test_angles():
    """Angles theta are (-116.565051177, -153.434948823, -90) degrees at F1, (-135, -180, -180) at F1b, 180 being -180."""
    degrees = np.degrees(swing(PLANAR_3R, np.stack([F1, F1B])).theta)
    np.testing.assert_allclose(degrees[0], [-116.565051177, -153.434948823, -90], atol=1e-9)
    np.testing.assert_allclose(degrees[1, 0], -135, atol=1e-9)
    np.testing.assert_allclose(np.abs(degrees[1, 1:]), 180, atol=1e-9)


def test_upright_pose_is_seen_by_angles_only():
    """At F1b joints 2 and 3 stand upright: torque and acceleration are blind to it, the angle is as large as it gets."""
    assert single(swing_torque, 1, F1B) < 1e-13 and single(swing_acceleration, 1, F1B) < 1e-13
    np.testing.assert_allclose(single(swing_angle, 1, F1B), np.pi, atol=ROUNDING)


def test_rigid_turn():
    """Turning a joint, or one before it, by an amount changes its swing angle by just that: d theta_i/dq_j = -1, j <= i."""
    q = np.array([0.3, 0.2, -0.4])
    for i in range(3):
        theta = swing(PLANAR_3R, q).theta[i]
        slope = swing_angle(PLANAR_3R, weights=np.eye(3)[i]).gradient(PLANAR_3R, q)
        np.testing.assert_allclose(slope[: i + 1], -theta, rtol=ROUNDING)


def test_swings_until_it_hangs():
    """A joint turned by its swing angle has its outboard mass hanging: no gravity torque, and least potential energy."""
    panda = load("panda")
    q = np.array([0.1, -0.4, 0.3, -2.0, 0.2, 1.7, 0.5])
    theta = swing(panda, q).theta
    for i in np.flatnonzero(turned(panda)):
        hung = q + theta[i] * np.eye(7)[i]
        tau = panda.gravity_torque(hung)[i]
        assert abs(tau) <= 1e-12 * np.abs(panda.gravity_torque(q)).max()
        assert panda.gravity_torque_derivative(hung)[i, i] > 0  # a minimum, not the upright pose


@pytest.mark.parametrize(
    "robot, expected",
    [
        (PLANAR_3R, [1, 1, 1]),
        (load("seven_joint"), [0, 1, 1, 1, 1, 1, 0]),
        (load("panda"), [0, 1, 1, 1, 1, 1, 1]),
        (chain.MIXED, [1, 0, 1, 1]),
    ],
    ids=["planar_3r", "seven_joint", "panda", "mixed"],
)
def test_joints_that_never_swing(robot, expected):
    """By default joints that slide, whose axis is upright, or that carry their mass on their axis, do not count."""
    np.testing.assert_array_equal(turned(robot), np.array(expected, dtype=bool))


def test_axis_parallel_to_gravity():
    """An axis parallel to gravity has no swing angle: refused with joint and configuration, where it is given a weight."""
    panda = load("panda")
    with pytest.raises(OutsideDomainError, match="joint 1 of panda turns about an axis parallel to gravity at configuration 0"):
        swing_angle(panda, weights=np.ones(7)).value(panda, np.full((2, 7), 0.4))
    upright = np.array([0.5, 0.0, 0.4, -1.0, 0.3, 1.0, 0.2])  # joint 3 stands on joint 1
    with pytest.raises(OutsideDomainError, match=r"joint 3 .*parallel to gravity"):
        swing_angle(panda).gradient(panda, upright)


def test_centre_on_the_axis():
    """An outboard centre of mass on the axis has no swing angle: refused, where it is given a weight."""
    arm = planar_arm([1.0, 1.0], [1.0, 1.0])
    folded = np.array([0.3, np.pi])  # the end of link 2 is back on joint 1, that of link 1 is not
    assert np.isfinite(swing_angle(arm).value(arm, folded))
    model = pin.Model(arm.model)
    model.inertias[1] = pin.Inertia(1.0, np.zeros(3), np.zeros((3, 3)))
    balanced = Robot("balanced", model, "tip", (0, 1))
    with pytest.raises(OutsideDomainError, match="joint 1 of balanced has its outboard centre of mass on its axis"):
        swing_angle(balanced).value(balanced, folded)
    seven = load("seven_joint")
    with pytest.raises(OutsideDomainError, match=r"joint 7 .*on its axis"):
        swing_angle(seven, weights=np.eye(7)[6]).value(seven, np.full(7, 0.3))


def test_upright():
    """Upright, |theta| = pi, the angle has a value but jumps: no gradient there."""
    f, q = swing_angle(PLANAR_3R), np.stack([F1, F1B])
    assert f.value(PLANAR_3R, q)[1] > np.pi**2
    with pytest.raises(NotDifferentiableError, match="joint 2 of configuration 1 stands upright"):
        f.gradient(PLANAR_3R, q)
    assert np.isfinite(f.gradient(PLANAR_3R, F1B + np.array([0, 1e-9, 1e-9]))).all()


def test_joint_that_moves_nothing():
    """A joint whose outboard mass stands on its axis, without inertia, would accelerate without bound: refused."""
    model = pin.Model(PLANAR_3R.model)
    model.inertias[3] = pin.Inertia(1.0, np.zeros(3), np.zeros((3, 3)))
    robot = Robot("pin", model, "tip", (0, 1))
    with pytest.raises(OutsideDomainError, match="joint 3 of pin moves no inertia"):
        swing_acceleration(robot).gradient(robot, F1)
    assert np.isfinite(swing_acceleration(robot, weights=[1, 1, 0]).gradient(robot, F1)).all()


@MEASURES
def test_weightless(factory):
    """Without gravity nothing swings: refused."""
    model = pin.Model(PLANAR_3R.model)
    model.gravity.linear = np.zeros(3)
    with pytest.raises(WeightlessError):
        factory(Robot("afloat", model, "tip", (0, 1)))


@MEASURES
@pytest.mark.parametrize("weights, error", [([1, 1], ShapeError), ([1, -1, 1], RangeError)], ids=["two", "negative"])
def test_bad_weights(factory, weights, error):
    """Weights of the wrong number, or negative ones, are refused."""
    with pytest.raises(error, match="weight"):
        factory(PLANAR_3R, weights=weights)


def test_sliding_joint():
    """A sliding joint swings by no angle: a weight on it is refused."""
    with pytest.raises(RangeError, match="joint 2 of mixed slides"):
        swing_angle(chain.MIXED, weights=np.ones(4))


def test_nothing_swings():
    """Weights that are all zero leave nothing to measure."""
    with pytest.raises(WeightlessError):
        swing_angle(PLANAR_3R, weights=np.zeros(3))


@pytest.mark.parametrize("length", [1e-6, 1e6])
def test_size_of_the_arm(length):
    """An arm of micrometres or of a thousand kilometres swings by the same angles as one of metres."""
    q = np.array([0.3, 1.1, -0.7])
    f, g = swing_angle(planar_arm([length] * 3)), swing_angle(PLANAR_3R)
    np.testing.assert_allclose(f.value(planar_arm([length] * 3), q), g.value(PLANAR_3R, q), rtol=1e-12)
    np.testing.assert_allclose(f.gradient(planar_arm([length] * 3), q), g.gradient(PLANAR_3R, q), rtol=1e-10)
