"""Static torque: printed values and refusals (methods M6)."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from problems.measures.gravity_torque import WeightlessError, gravity_torque
from problems.robots.planar import GRAVITY, PLANAR_3R
from problems.robots.robot import Robot
from problems.sets import textbook
from sandbox.errors import AsymmetricWeightError, RangeError, ShapeError
from sandbox.tolerances import UNIT

F1, F1B = np.array(textbook.F1.q), np.array(textbook.F1B.q)
ROUNDING = 256 * UNIT * GRAVITY**2


def test_gradient_at_f1b():
    """F1b, unit masses at the link ends: f = 9 g0^2/2, grad f = -g0^2 (9, 9, 3)."""
    f = gravity_torque(PLANAR_3R)
    np.testing.assert_allclose(f.value(PLANAR_3R, F1B), 4.5 * GRAVITY**2, atol=ROUNDING)
    np.testing.assert_allclose(f.gradient(PLANAR_3R, F1B), -(GRAVITY**2) * np.array([9, 9, 3]), atol=ROUNDING)


def test_f1():
    """F1: tau_g = g0 (4, 1, 1), so f = 9 g0^2."""
    np.testing.assert_allclose(gravity_torque(PLANAR_3R).value(PLANAR_3R, F1), 9 * GRAVITY**2, atol=ROUNDING)


def test_weights():
    """Q counts: a diagonal is the matrix with that diagonal, and Q = diag(1, 0, 0) sees the first torque alone."""
    q = np.random.default_rng(0).uniform(-2, 2, (10, 3))
    first = gravity_torque(PLANAR_3R, Q=[1, 0, 0])
    np.testing.assert_allclose(first.value(PLANAR_3R, q), PLANAR_3R.gravity_torque(q)[:, 0] ** 2 / 2, atol=ROUNDING)
    Q = np.array([[2, 1, 0], [1, 2, 0], [0, 0, 3.0]])
    tau = PLANAR_3R.gravity_torque(q)
    value = gravity_torque(PLANAR_3R, Q=Q).value(PLANAR_3R, q)
    np.testing.assert_allclose(value, np.einsum("bi,ij,bj->b", tau, Q, tau) / 2, atol=4 * ROUNDING)


def test_singular_weight():
    """Q that is positive semidefinite but for rounding is accepted."""
    v = np.array([1.0, 1 / 3, -0.7])
    assert gravity_torque(PLANAR_3R, Q=np.outer(v, v)).value(PLANAR_3R, F1) >= 0


@pytest.mark.parametrize(
    "Q, error, words",
    [
        (np.diag([1.0, -1, 1]), RangeError, "eigenvalue -1"),
        ([1.0, -0.5, 1], RangeError, "eigenvalue -0.5"),
        ([[1.0, 2, 0], [0, 1, 0], [0, 0, 1]], AsymmetricWeightError, "symmetric"),
        (np.eye(2), ShapeError, "Q"),
    ],
    ids=["indefinite", "negative entry", "asymmetric", "size"],
)
def test_bad_weight(Q, error, words):
    """A weight of torques that is not symmetric and positive semidefinite is refused."""
    with pytest.raises(error, match=words):
        gravity_torque(PLANAR_3R, Q=Q)


def changed(mass=1.0, gravity=GRAVITY):
    """The 3R arm with other masses and gravity."""
    model = pin.Model(PLANAR_3R.model)
    model.gravity.linear = np.array([0.0, -gravity, 0.0])
    for i in range(1, 4):
        model.inertias[i] = pin.Inertia(mass, np.array(model.inertias[i].lever), np.zeros((3, 3)))
    return Robot("changed", model, "tip", (0, 1))


@pytest.mark.parametrize(
    "robot, words", [(changed(mass=0.0), "0 kg"), (changed(gravity=0.0), "0 m/s")], ids=["mass", "gravity"]
)
def test_weightless(robot, words):
    """A robot without mass, or without gravity, asks no torque: refused, not silently f = 0."""
    with pytest.raises(WeightlessError, match=words):
        gravity_torque(robot)


def test_negative_mass():
    """A link of negative mass makes no robot at all."""
    with pytest.raises(RangeError, match="mass"):
        changed(mass=-1.0)


def test_light_robot():
    """Grams in a gravity of a centimetre per second squared ask torque all the same: f = 9 (m g0)^2 at F1."""
    light = changed(mass=1e-3, gravity=0.01)
    np.testing.assert_allclose(gravity_torque(light).value(light, F1), 9 * (1e-3 * 0.01) ** 2, rtol=256 * UNIT)
