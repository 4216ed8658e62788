"""Kinetic energy."""

from __future__ import annotations

import numpy as np
import pytest

from problems import robots
from sandbox.claims.weightings.inertia_weight import ROBOTS, kinetic_energy, quadratic
from sandbox.tolerances import ORIGINAL, UNIT


@pytest.mark.parametrize("name", ROBOTS)
def test_kinetic_energy_counts_the_rotors(name):
    """Energy by recursion with the rotors is that of the robot's inertia matrix."""
    robot = robots.load(name)
    rng = np.random.default_rng(1)
    q, qdot = rng.uniform(-1, 1, (2, 5, robot.n))
    M = robot.inertia(q)
    rounding = ORIGINAL * robot.n * UNIT * np.linalg.norm(M, 2, axis=(1, 2)) * np.sum(qdot**2, axis=1)
    assert (np.abs(kinetic_energy(robot, q, qdot) - quadratic(M, qdot)) <= rounding).all()
