"""The Panda of published parameters: where it stands, that it weighs something, and the same arm from its URDF file."""

from __future__ import annotations

import time

import numpy as np
import pytest

from problems.robots import load
from problems.robots.panda import BODIES, FINGER, HAND, PANDA
from sandbox.tolerances import UNIT

ROUNDING = 256 * UNIT  # seven products of placements, of about a metre


def test_stretched_out():
    """At q = 0 the tool hangs at (0.088, 0, 0.333 + 0.316 + 0.384 - 0.107 - 0.1034) m, turned by -pi/4 and upside down."""
    position, rotation = PANDA.forward(np.zeros(7))
    np.testing.assert_allclose(position, [0.088, 0, 0.8226], atol=ROUNDING)
    s = 0.5**0.5
    np.testing.assert_allclose(rotation, [[s, s, 0], [s, -s, 0], [0, 0, -1]], atol=ROUNDING)


def test_ready():
    """In Franka's ready position the tool is 0.3069 m ahead, 0.4869 m high, and points straight down."""
    position, rotation = PANDA.forward(np.pi / 4 * np.array([0, -1, 0, -3, 0, 2, 1]))
    np.testing.assert_allclose(position, [0.306891, 0, 0.486882], atol=5e-7)  # printed to six digits
    np.testing.assert_allclose(rotation, np.diag([1, -1, -1]), atol=ROUNDING)


def test_weight():
    """Links 1-7, hand and fingers weigh 16.8 kg together."""
    total = sum(body.mass for body in (*BODIES, HAND, FINGER, FINGER))
    assert sum(mass for _, mass, _, _ in PANDA.bodies()) == pytest.approx(total, abs=ROUNDING * total)
    assert total == pytest.approx(16.82213, abs=5e-6)


def test_inertia_within_the_limits():
    """M is positive definite all over the joint range, corners included."""
    rng = np.random.default_rng(11)
    corners = np.where(rng.random((1000, 7)) < 0.5, PANDA.lower, PANDA.upper)
    q = np.concatenate([rng.uniform(PANDA.lower, PANDA.upper, (4000, 7)), corners])
    eigenvalues = np.linalg.eigvalsh(PANDA.inertia(q))
    assert eigenvalues[:, 0].min() > 4e-3  # [kg m^2], the wrist


def test_the_same_arm_from_its_urdf(extra):
    """Kinematics, inertia, gravity torque, limits and rates are those of the URDF file of example-robot-data."""
    urdf = load("panda_urdf")
    q = np.random.default_rng(12).uniform(PANDA.lower, PANDA.upper, (50, 7))
    for compute, scale in (("geometric", 1.0), ("jacobian_derivative", 1.0), ("inertia", 3.0), ("gravity_torque", 60.0)):
        np.testing.assert_allclose(getattr(PANDA, compute)(q), getattr(urdf, compute)(q), atol=ROUNDING * scale, rtol=0)
    for one, other in zip(PANDA.forward(q), urdf.forward(q), strict=True):
        np.testing.assert_allclose(one, other, atol=ROUNDING, rtol=0)
    for limits in ("lower", "upper", "rate_limits"):
        np.testing.assert_array_equal(getattr(PANDA, limits), getattr(urdf, limits))


@pytest.mark.parametrize("compute", ["forward", "jacobian", "jacobian_derivative", "inertia", "gravity_torque"])
def test_ten_thousand_configurations(compute):
    """10,000 configurations take well under the two seconds that a whole method may take."""
    q = np.random.default_rng(13).uniform(PANDA.lower, PANDA.upper, (10_000, 7))
    start = time.process_time()
    getattr(PANDA, compute)(q)
    assert time.process_time() - start < 0.5  # [s]; 0.01 to 0.04 on one core
