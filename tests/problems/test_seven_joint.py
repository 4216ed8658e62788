"""The seven-joint arm: the laws of a spherical-revolute-spherical chain, by its table in either convention."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from problems.robots import denavit_hartenberg as table
from problems.robots.denavit_hartenberg import Link
from problems.robots.robot import Robot
from problems.robots.seven_joint import LIMITS, LINKS, MASSES, ROTOR
from problems.robots.seven_joint import SEVEN_JOINT as ARM
from sandbox.errors import NonFiniteError, RangeError, ShapeError, UnknownNameError
from sandbox.tolerances import UNIT

RNG = np.random.default_rng(7)
CONFIGURATIONS = RNG.uniform(-0.9, 0.9, (5, 7)) * np.array(LIMITS)
ROUNDING = 256 * UNIT  # seven products of rotations
STEP = 1e-5
DIFFERENCE = 1e-9  # central differences: STEP^2 truncated, UNIT/STEP rounded


def frame(q, joint):
    """Origin (..., 3) [m] of frame `joint` (1..7) of the table."""
    return ARM.point(q, joint, np.array([0, 0, LINKS[joint - 1].d]))


def test_stretched_out():
    """At q = 0 the arm stands upright, as long as its offsets together."""
    position, rotation = ARM.forward(np.zeros(7))
    np.testing.assert_allclose(position, [0, 0, sum(link.d for link in LINKS)], atol=ROUNDING)
    np.testing.assert_allclose(rotation, np.eye(3), atol=ROUNDING)


def test_limits():
    """The joint limits are symmetric."""
    np.testing.assert_array_equal(ARM.upper, LIMITS)
    np.testing.assert_array_equal(ARM.lower, -ARM.upper)


def test_self_motion_leaves_the_elbow_angle_alone():
    """The null vector of the full pose has no elbow component: shoulder and wrist keep their distance."""
    null = np.linalg.svd(ARM.jacobian(CONFIGURATIONS))[2][:, -1]
    np.testing.assert_allclose(null[:, 3], 0, atol=ROUNDING)


def test_shoulder_and_wrist_are_points():
    """The axes of joints 1 to 3 meet in the shoulder, those of joints 5 to 7 in the wrist."""
    axes = np.swapaxes(ARM.geometric(CONFIGURATIONS)[:, 3:], -1, -2)
    for joints, point in (((1, 2, 3), frame(CONFIGURATIONS, 1)), ((5, 6, 7), frame(CONFIGURATIONS, 5))):
        for joint in joints:
            off_axis = np.cross(axes[:, joint - 1], point - ARM.point(CONFIGURATIONS, joint))
            np.testing.assert_allclose(off_axis, 0, atol=ROUNDING)


def test_inertia_is_that_of_the_kinetic_energy():
    """Twice the kinetic energy, q'M q, is that of the frame origins, speeds by differences, and of the rotors."""
    rates = RNG.uniform(-1, 1, 7)
    energy = ROTOR * rates @ rates
    for joint, mass in enumerate(MASSES, start=1):
        speed = (frame(CONFIGURATIONS + STEP * rates, joint) - frame(CONFIGURATIONS - STEP * rates, joint)) / (2 * STEP)
        energy = energy + mass * np.sum(speed**2, axis=-1)
    twice = np.einsum("i,...ij,j->...", rates, ARM.inertia(CONFIGURATIONS), rates)
    np.testing.assert_allclose(twice, energy, atol=100 * DIFFERENCE)


def test_inertia_is_positive_definite():
    """No motion is free of kinetic energy: every joint has its rotor."""
    M = ARM.inertia(CONFIGURATIONS)
    np.testing.assert_allclose(M, np.swapaxes(M, -1, -2), atol=ROUNDING)
    assert np.all(np.linalg.eigvalsh(M)[:, 0] >= ROTOR * (1 - ROUNDING))


TABLE = (Link(0.3, 0.4, 0.5, 0.6), Link(-0.2, -1.4, 0.1, 2.0, slides=True), Link(0.1, np.pi / 2, -0.3, -1.0))


def elementary(axis, angle=0.0, along=0.0):
    """Homogeneous matrix (4, 4) of a turn about and a shift along one coordinate axis."""
    T = np.eye(4)
    i = "xyz".index(axis)
    T[:3, :3] = pin.AngleAxis(angle, np.eye(3)[i]).toRotationMatrix()
    T[i, 3] = along
    return T


@pytest.mark.parametrize("convention", table.CONVENTIONS)
def test_conventions(convention):
    """Frames follow the product of four elementary motions per row, in the order of the convention."""
    robot = Robot("table", table.arm("table", TABLE, convention=convention), "hand")
    q, T = np.array([0.7, -0.4, 1.9]), np.eye(4)
    for i, (row, moved) in enumerate(zip(TABLE, q, strict=True), start=1):
        turn, shift = (0.0, moved) if row.slides else (moved, 0.0)
        about, across = (
            elementary("z", row.theta + turn) @ elementary("z", along=row.d + shift),
            elementary("x", along=row.a) @ elementary("x", row.alpha),
        )
        T = T @ (about @ across if convention == "standard" else across @ about)
        seen = Robot("table", robot.model, f"frame_{i}").forward(q)
        np.testing.assert_allclose(seen[0], T[:3, 3], atol=ROUNDING)
        np.testing.assert_allclose(seen[1], T[:3, :3], atol=ROUNDING)
    np.testing.assert_array_equal(robot.forward(q)[0], seen[0])
    assert robot.prismatic.tolist() == [False, True, False]


def test_flange():
    """The hand sits at the flange behind the last frame."""
    flange = pin.SE3(table.turned("y", 0.3), np.array([0.1, 0.2, 0.3]))
    model = table.arm("table", TABLE, flange=flange)
    robot, last, q = Robot("table", model, "hand"), Robot("table", model, "frame_3"), np.array([0.1, 0.2, 0.3])
    position, rotation = last.forward(q)
    np.testing.assert_allclose(robot.forward(q)[0], position + rotation @ flange.translation, atol=ROUNDING)
    np.testing.assert_allclose(robot.forward(q)[1], rotation @ flange.rotation, atol=ROUNDING)


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_quarter_turns_are_exact(axis):
    """A quarter turn has entries 0, 1 and -1 only; another turn is pinocchio's."""
    for quarters in range(-4, 5):
        R = table.turned(axis, quarters * np.pi / 2)
        assert set(np.abs(R).ravel()) == {0.0, 1.0}
        np.testing.assert_allclose(R, elementary(axis, quarters * np.pi / 2)[:3, :3], atol=ROUNDING)
    np.testing.assert_allclose(table.turned(axis, 0.7), elementary(axis, 0.7)[:3, :3], atol=ROUNDING)


def test_bad_tables():
    """No rows, rows that hold no numbers, another convention, and limits that do not fit are refused."""
    with pytest.raises(ShapeError, match="at least one row"):
        table.arm("x", [])
    with pytest.raises(NonFiniteError, match=r"row 2 of the Denavit-Hartenberg table\[1\] is nan"):
        table.arm("x", [Link(), Link(alpha=np.nan)])
    with pytest.raises(UnknownNameError, match="convention is called 'Paul'; there are: modified, standard"):
        table.arm("x", [Link()], convention="Paul")
    model = table.arm("x", [Link(), Link()])
    with pytest.raises(ShapeError, match="1 upper limits for the 2 joints of x"):
        table.limit(model, [0, 0], [1], [1, 1])
    table.limit(model, [0, 2], [1, 1], [1, 1])
    with pytest.raises(RangeError, match=r"joint 'joint_2' of x has lower limit 2, upper limit 1"):
        Robot("x", model, "hand")
