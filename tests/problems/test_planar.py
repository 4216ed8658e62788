"""Planar arms against the fixtures F1, F1b, F2 of methods.md and against differences."""

from __future__ import annotations

import numpy as np
import pytest

from problems.robots.planar import GRAVITY, PLANAR_3R, PLANAR_4R, planar_arm
from problems.sets import textbook
from sandbox.errors import NonFiniteError, RangeError, ShapeError
from sandbox.tolerances import UNIT

F1, F1B = np.array(textbook.F1.q), np.array(textbook.F1B.q)
LENGTHS, MASSES = (1.0, 0.7, 0.4, 0.9), (2.0, 0.5, 1.5, 0.25)
UNEVEN = planar_arm(LENGTHS, MASSES, name="uneven")
ROUNDING = 64 * UNIT  # a dozen operations on numbers of order 10
STEP = 1e-5
DIFFERENCE = 1e-9  # central differences: STEP^2 truncated, UNIT/STEP rounded


def gradient(f, q):
    """Central difference of f along each joint, the joint on the last axis."""
    steps = STEP * np.eye(len(q))
    return np.stack([(f(q + step) - f(q - step)) / (2 * STEP) for step in steps], axis=-1)


@pytest.mark.parametrize(
    "arm, fixture",
    [(PLANAR_3R, textbook.F0), (PLANAR_3R, textbook.F1), (PLANAR_3R, textbook.F1B), (PLANAR_4R, textbook.F2)],
    ids=["F0", "F1", "F1b", "F2"],
)
def test_jacobian_of_the_fixtures(arm, fixture):
    """The textbook's Jacobians are those of the arm at the textbook's configurations."""
    np.testing.assert_allclose(arm.jacobian(np.array(fixture.q)), np.array(fixture.J), atol=ROUNDING)


def test_tip_of_the_fixtures():
    """F1 reaches (2, 1), F1b reaches (1, 2), and both stay in the plane."""
    reached = PLANAR_3R.forward(np.stack([F1, F1B]))[0]
    np.testing.assert_allclose(reached, [[2, 1, 0], [1, 2, 0]], atol=ROUNDING)


@pytest.mark.parametrize("arm", [PLANAR_3R, PLANAR_4R, UNEVEN], ids=lambda arm: arm.name)
def test_jacobian_is_that_of_the_link_vectors(arm):
    """J has rows -Y_i, X_i, the links from i on, and ones for the angle; Hess x_ij = -X_max(i,j), Hess y_ij = -Y_max(i,j)."""
    q = np.linspace(0.3, -1.1, arm.n)
    lengths = np.array(LENGTHS if arm is UNEVEN else np.ones(arm.n))
    x, y = lengths * np.cos(np.cumsum(q)), lengths * np.sin(np.cumsum(q))
    X, Y = np.cumsum(x[::-1])[::-1], np.cumsum(y[::-1])[::-1]
    pose = arm.task("planar pose")
    np.testing.assert_allclose(pose.jacobian(q), [-Y, X, np.ones(arm.n)], atol=ROUNDING)
    np.testing.assert_array_equal(pose.jacobian(q)[:2], arm.jacobian(q))
    later = np.maximum.outer(np.arange(arm.n), np.arange(arm.n))
    second = np.stack([-X[later], -Y[later], np.zeros((arm.n, arm.n))], axis=-2)
    np.testing.assert_allclose(pose.jacobian_derivative(q), second, atol=ROUNDING)


def test_inertia_of_f1():
    """F1 with unit masses has M = [[8, 4, 2], [4, 3, 1], [2, 1, 1]]."""
    np.testing.assert_allclose(PLANAR_3R.inertia(F1), textbook.INERTIA_F1, atol=ROUNDING)


def test_inertia_is_that_of_the_kinetic_energy():
    """Twice the kinetic energy, q'M q, is the sum of mass times squared speed of the link ends, speeds by differences."""
    q, rates = np.array([0.2, -0.9, 1.3, 0.4]), np.array([0.7, -0.3, 0.5, 0.9])
    energy = 0.0
    for link, mass in enumerate(MASSES, start=1):
        part = planar_arm(LENGTHS[:link], MASSES[:link])
        speed = gradient(lambda q, part=part: part.forward(q)[0], q[:link]) @ rates[:link]
        energy += mass * speed @ speed
    assert abs(rates @ UNEVEN.inertia(q) @ rates - energy) <= 10 * DIFFERENCE


def test_gravity_torque_of_f1():
    """F1 with unit masses holds (4, 1, 1) g: its masses stand 1, 1 and 2 m ahead of the base; gravity is along -y."""
    np.testing.assert_allclose(PLANAR_3R.gravity_torque(F1), GRAVITY * np.array([4, 1, 1]), atol=GRAVITY * ROUNDING)


def test_rods():
    """Two uniform rods have the inertia matrix and the gravity torque of the textbook's double pendulum."""
    (l1, l2), (m1, m2), q = (1.2, 0.7), (2.0, 0.5), np.array([0.4, -1.1])
    arm = planar_arm([l1, l2], [m1, m2], rods=True)
    c, second = np.cos(q[1]), m2 * l2**2 / 3
    cross = second + m2 * l1 * l2 * c / 2
    expected = [[m1 * l1**2 / 3 + m2 * l1**2 + second + m2 * l1 * l2 * c, cross], [cross, second]]
    np.testing.assert_allclose(arm.inertia(q), expected, atol=ROUNDING)
    ahead = l2 * np.cos(q.sum()) / 2
    torque = [m1 * l1 * np.cos(q[0]) / 2 + m2 * (l1 * np.cos(q[0]) + ahead), m2 * ahead]
    np.testing.assert_allclose(arm.gravity_torque(q), GRAVITY * np.array(torque), atol=GRAVITY * ROUNDING)


@pytest.mark.parametrize(
    "lengths, masses, kind, says",
    [
        ([1, 0, 1], None, RangeError, "the length of link 2 is 0; it must be positive"),
        ([1, -1], None, RangeError, "the length of link 2 is -1"),
        ([1, 1], [0.5, -2], RangeError, "the mass of link 2 is -2; it must be positive"),
        ([1, np.nan], None, NonFiniteError, r"link length\[1\] is nan"),
        ([1, 1], [np.inf, 1], NonFiniteError, r"link mass\[0\] is inf"),
        ([1, 1], [1], ShapeError, "2 link lengths and 1 masses"),
        ([], None, ShapeError, r"the link length has shape \(0,\)"),
        (2.0, None, ShapeError, r"the link length has shape \(\)"),
        ([[1, 1]], None, ShapeError, r"the link length has shape \(1, 2\)"),
        (["a"], None, ShapeError, "link length must hold real numbers"),
    ],
)
def test_bad_links(lengths, masses, kind, says):
    """Lengths and masses that are no positive numbers, one each per link, are refused by link."""
    with pytest.raises(kind, match=says):
        planar_arm(lengths, masses)
