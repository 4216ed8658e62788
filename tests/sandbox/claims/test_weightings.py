"""What the claims on weightings are checked against: Wielandt's limit, energies, a force of the wrong sign."""

from __future__ import annotations

import numpy as np
import pytest

from problems import robots
from sandbox.claims import weightings as claims
from sandbox.tolerances import ORIGINAL, UNIT

ARM = robots.load("planar_3r")


@pytest.mark.parametrize("kappa", [2.0, 10.0, 100.0])
def test_the_limit_of_a_wrong_metric_is_attained_and_never_exceeded(kappa):
    """Two joints, one task row, K = diag(1, kappa), W = I: the worst row spends (kappa - 1)^2 / 4 kappa more."""
    angle = np.linspace(0.0, np.pi / 2, 100_001)
    j = np.stack([np.cos(angle), np.sin(angle)])
    spent = j[0] ** 2 + kappa * j[1] ** 2  # of qdot = j, for the task 1
    least = 1 / (j[0] ** 2 + j[1] ** 2 / kappa)
    worst = (spent / least).max() - 1
    limit = claims._kantorovich(np.array(kappa))
    assert worst <= limit * (1 + 1e-12)
    assert worst >= limit * (1 - 1e-6)


def test_compliances_are_definite_and_of_condition_up_to_a_hundred():
    """Symmetric, positive, and some of them far from a multiple of I."""
    C = claims._compliances(np.random.default_rng(0), 200, 4)
    np.testing.assert_array_equal(C, np.swapaxes(C, 1, 2))
    conditions = np.linalg.cond(C)
    assert (np.linalg.eigvalsh(C) > 0).all() and conditions.max() <= 100 and conditions.max() > 20


@pytest.mark.parametrize("name", claims.ROBOTS)
def test_kinetic_energy_counts_the_rotors(name):
    """Energy by recursion with the rotors is that of the robot's inertia matrix."""
    robot = robots.load(name)
    rng = np.random.default_rng(1)
    q, qdot = rng.uniform(-1, 1, (2, 5, robot.n))
    M = robot.inertia(q)
    rounding = ORIGINAL * robot.n * UNIT * np.linalg.norm(M, 2, axis=(1, 2)) * np.sum(qdot**2, axis=1)
    assert (np.abs(claims.kinetic_energy(robot, q, qdot) - claims.quadratic(M, qdot)) <= rounding).all()


def test_rest_postures_balance_the_force():
    """Springs at rest - J'F pull by J'F."""
    F = np.array([[-1.0, -1.0]])
    rest = claims.balanced(ARM, claims.F1, F)
    np.testing.assert_allclose(rest[0], (1.0, np.pi / 2, 1 - np.pi / 2), rtol=0, atol=1e-14)


def test_a_force_of_the_wrong_sign_gives_another_weight():
    """C^-1 + Gamma and C^-1 - Gamma add up to 2 C^-1."""
    rest = np.array([1.0, np.pi / 2, 1 - np.pi / 2])
    given = claims.F1, np.zeros((1, 2))
    right = claims.IMPEDANCE.cast(ARM, *given, rest=rest).W.dense()[0]
    wrong = claims.force_turned(ARM, *given, rest=rest).W.dense()[0]
    np.testing.assert_allclose(right + wrong, 2 * np.eye(3), rtol=0, atol=1e-14)
    assert np.abs(right - wrong).max() > 1


def test_a_load_alone_is_told_by_its_place():
    """On the last link of the Panda's pose task it is at rest under self-motion, on the fourth it is not."""
    robot = robots.load("panda")
    q = (robot.lower + robot.upper)[None] / 2 + 0.2
    for joint, held in ((4, True), (7, False)):
        body = claims.VirtualBody(joint, 1.0, (0.05, 0.02, 0.03), 0.01 * np.eye(3))
        refused, share = claims._alone(claims.rates, robot, q, np.ones((1, 6)), body)
        assert refused[0] != held
        assert (share[0] > 1e-6) == held


def test_vectors_and_matrices_in_words():
    """Rounding of zero is written as zero; a matrix is written by its rows."""
    assert claims.written([1e-17, 0.5]) == "(0, 0.5)"
    assert claims.written(np.eye(2)) == "[(1, 0), (0, 1)]"
