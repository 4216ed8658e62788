"""The seven-joint arm: its Jacobian against differences, and the laws of a spherical-revolute-spherical chain."""

from __future__ import annotations

import numpy as np
import pytest

from problems.robots.seven_joint import SEVEN_JOINT as ARM
from sandbox.tolerances import UNIT

RNG = np.random.default_rng(7)
CONFIGURATIONS = RNG.uniform(-0.9, 0.9, (5, 7)) * np.array(ARM.limits)
ROUNDING = 256 * UNIT  # seven products of rotations
STEP = 1e-5
DIFFERENCE = 1e-9  # central differences: STEP^2 truncated, UNIT/STEP rounded


def moved(q, joint):
    """The two configurations STEP to either side along one joint."""
    step = STEP * np.eye(ARM.n)[joint]
    return ARM.forward(q + step), ARM.forward(q - step)


def test_stretched_out():
    """At q = 0 the arm stands upright, as long as its offsets together."""
    position, rotation = ARM.forward(np.zeros(7))
    np.testing.assert_allclose(position, [0, 0, sum(ARM.d)], atol=ROUNDING)
    np.testing.assert_allclose(rotation, np.eye(3), atol=ROUNDING)


@pytest.mark.parametrize("q", CONFIGURATIONS, ids=str)
def test_jacobian_is_the_derivative_of_the_pose(q):
    """The linear rows are the derivative of the position; the angular rows turn the rotation, dR R' = [w]x."""
    J = ARM.jacobian(q)
    for joint in range(ARM.n):
        (p1, R1), (p0, R0) = moved(q, joint)
        np.testing.assert_allclose(J[:3, joint], (p1 - p0) / (2 * STEP), atol=DIFFERENCE)
        turning = (R1 - R0) / (2 * STEP) @ ARM.forward(q)[1].T
        np.testing.assert_allclose(turning, -turning.T, atol=DIFFERENCE)
        np.testing.assert_allclose(J[3:, joint], turning[[2, 0, 1], [1, 2, 0]], atol=DIFFERENCE)
    np.testing.assert_array_equal(ARM.jacobian(q, pose=False), J[:3])


def test_self_motion_leaves_the_elbow_angle_alone():
    """The null vector of the full pose has no elbow component: shoulder and wrist keep their distance."""
    null = np.linalg.svd(ARM.jacobian(CONFIGURATIONS))[2][:, -1]
    np.testing.assert_allclose(null[:, 3], 0, atol=ROUNDING)


def test_shoulder_and_wrist_are_points():
    """The axes of joints 1 to 3 meet in the shoulder, those of joints 5 to 7 in the wrist."""
    R, p = ARM.frames(CONFIGURATIONS)
    for joints, point in (((0, 1, 2), p[:, 1]), ((4, 5, 6), p[:, 6])):
        for joint in joints:
            off_axis = np.cross(R[:, joint, :, 2], point - p[:, joint])
            np.testing.assert_allclose(off_axis, 0, atol=ROUNDING)


def test_inertia_is_that_of_the_kinetic_energy():
    """Twice the kinetic energy, q'M q, is that of the frame origins, speeds by differences, and of the rotors."""
    rates = RNG.uniform(-1, 1, 7)
    for q in CONFIGURATIONS:
        velocity = (ARM.frames(q + STEP * rates)[1] - ARM.frames(q - STEP * rates)[1])[1:] / (2 * STEP)
        energy = np.array(ARM.masses) @ np.sum(velocity**2, axis=-1) + ARM.rotor * rates @ rates
        assert abs(rates @ ARM.inertia(q) @ rates - energy) <= 100 * DIFFERENCE


def test_inertia_is_positive_definite():
    """No motion is free of kinetic energy: every joint has its rotor."""
    M = ARM.inertia(CONFIGURATIONS)
    np.testing.assert_allclose(M, np.swapaxes(M, -1, -2), atol=ROUNDING)
    assert np.all(np.linalg.eigvalsh(M)[:, 0] >= ARM.rotor * (1 - ROUNDING))


@pytest.mark.parametrize("compute", ["jacobian", "inertia"])
def test_stacks(compute):
    """A stack of configurations gives the stack of the single answers."""
    f = getattr(ARM, compute)
    np.testing.assert_allclose(f(CONFIGURATIONS), np.stack([f(q) for q in CONFIGURATIONS]), atol=ROUNDING)
