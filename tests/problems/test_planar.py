"""Planar arms against the fixtures F1, F1b, F2 of methods.md and against differences."""

from __future__ import annotations

import numpy as np
import pytest

from problems.measures.joint_limits import joint_limits, joint_limits_gradient
from problems.measures.manipulability import manipulability, manipulability_gradient
from problems.robots.planar import PLANAR_3R, PLANAR_4R, PlanarArm
from problems.sets import textbook
from sandbox.errors import RangeError
from sandbox.tolerances import UNIT

F1, F1B = np.array(textbook.F1.q), np.array(textbook.F1B.q)
GENERIC = np.array([0.3, 1.1, -0.7])
UNEVEN = PlanarArm("uneven", (1.0, 0.7, 0.4, 0.9), (2.0, 0.5, 1.5, 0.25))
ROUNDING = 64 * UNIT  # a dozen operations on numbers of order 10
PRINTED = 1e-12  # methods.md prints twelve digits
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
    """F1 reaches (2, 1), F1b reaches (1, 2)."""
    reached = PLANAR_3R.forward(np.stack([F1, F1B]))[:, :2]
    np.testing.assert_allclose(reached, [[2, 1], [1, 2]], atol=ROUNDING)


@pytest.mark.parametrize("arm", [PLANAR_3R, PLANAR_4R, UNEVEN], ids=lambda arm: arm.name)
def test_jacobian_is_the_derivative_of_the_tip(arm):
    """J, its angle row included, is the derivative of the tip, and dJ/dq that of J."""
    q = np.linspace(0.3, -1.1, arm.n)
    J = arm.jacobian(q, angle=True)
    np.testing.assert_allclose(J, gradient(arm.forward, q), atol=DIFFERENCE)
    np.testing.assert_array_equal(J[:2], arm.jacobian(q))
    dJ = np.moveaxis(gradient(lambda q: arm.jacobian(q, angle=True), q), -1, 0)
    np.testing.assert_allclose(arm.jacobian_derivative(q, angle=True), dJ, atol=DIFFERENCE)


def test_inertia_of_f1():
    """F1 with unit masses has M = [[8, 4, 2], [4, 3, 1], [2, 1, 1]]."""
    np.testing.assert_allclose(PLANAR_3R.inertia(F1), textbook.INERTIA_F1, atol=ROUNDING)


def test_inertia_is_that_of_the_kinetic_energy():
    """Twice the kinetic energy, q'M q, is the sum of mass times squared speed of the link ends, speeds by differences."""
    q, rates = np.array([0.2, -0.9, 1.3, 0.4]), np.array([0.7, -0.3, 0.5, 0.9])
    energy = 0.0
    for link, mass in enumerate(UNEVEN.masses, start=1):
        part = PlanarArm("part", UNEVEN.lengths[:link], UNEVEN.masses[:link])
        speed = gradient(lambda q, part=part: part.forward(q)[:2], q[:link]) @ rates[:link]
        energy += mass * speed @ speed
    assert abs(rates @ UNEVEN.inertia(q) @ rates - energy) <= 10 * DIFFERENCE


def test_manipulability():
    """Manipulability and its gradient have the printed values at F1, F1b and a generic configuration."""
    q = np.stack([F1, F1B, GENERIC])
    J = PLANAR_3R.jacobian(q)
    np.testing.assert_allclose(manipulability(J), [3**0.5, 5**0.5, 1.456001828397555], atol=PRINTED)
    slope = manipulability_gradient(J, PLANAR_3R.jacobian_derivative(q))
    printed = [[0, 0, 0], [0, 0, 5**-0.5], [0, 1.047893942366, 0.176677313279]]
    np.testing.assert_allclose(slope, printed, atol=PRINTED)


def test_joint_limits():
    """The joint-limit gradient is (0, 1/(3 pi), -1/(12 pi)) at F1 and the derivative of the measure."""
    upper = np.pi * np.array([1.0, 1.0, 2.0])
    expected = [0, 1 / (3 * np.pi), -1 / (12 * np.pi)]
    np.testing.assert_allclose(joint_limits_gradient(F1, -upper, upper), expected, atol=ROUNDING)
    lower = np.array([-1.0, -0.5, -2.0])
    slope = gradient(lambda q: joint_limits(q, lower, upper), GENERIC)
    np.testing.assert_allclose(joint_limits_gradient(GENERIC, lower, upper), slope, atol=DIFFERENCE)


def test_joint_limits_the_wrong_way_round():
    """A lower limit that is not below the upper one is refused."""
    with pytest.raises(RangeError, match="lower joint limit"):
        joint_limits_gradient(F1, np.ones(3), np.ones(3))


@pytest.mark.parametrize("compute", ["forward", "jacobian", "jacobian_derivative", "inertia"])
def test_stacks(compute):
    """A stack of configurations gives the stack of the single answers."""
    q = np.stack([[F1, F1B], [GENERIC, -GENERIC]])
    f = getattr(PLANAR_3R, compute)
    np.testing.assert_allclose(f(q), np.stack([[f(p) for p in row] for row in q]), atol=ROUNDING)
