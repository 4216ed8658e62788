"""C^-1 - Gamma, and the elastic energy it belongs to."""

from __future__ import annotations

import numpy as np
import pytest

from problems import robots
from problems.methods.draw import generic
from problems.robots.planar import PLANAR_3R
from problems.weightings.extended import extremum
from problems.weightings.impedance import OffEquilibriumError, balanced, elastic, impedance
from sandbox.errors import ShapeError, WeightNotPositiveDefiniteError
from tests.problems.secondary import EACH_ROBOT, F1, NULL, Q0, rounding

STEP = np.finfo(float).eps ** (1 / 3)
K = np.array([[2.0, 0.5, 0.0], [0.5, 1.0, 0.1], [0.0, 0.1, 3.0]])


def test_energy_gradient_and_hessian():
    """Energy g = 1/2 (q - rest)'K(q - rest): value, gradient by complex step, Hessian K."""
    q = np.array([[0.3, -0.2, 0.9], [1.0, 0.0, -1.0]])
    g = elastic(PLANAR_3R, K, Q0)
    for i, one in enumerate(q):
        d = one - Q0
        assert abs(g.value(PLANAR_3R, q)[i] - d @ K @ d / 2) <= 1e-14
        slopes = [np.imag((d + 1e-30j * e) @ K @ (d + 1e-30j * e)) / 2e-30 for e in np.eye(3)]
        np.testing.assert_allclose(g.gradient(PLANAR_3R, q)[i], slopes, rtol=1e-14)
    np.testing.assert_array_equal(g.curvature(PLANAR_3R, q), np.broadcast_to(K, (2, 3, 3)))


def test_stiffness_as_number_diagonal_or_matrix():
    """The three ways to give K; rest is zero if left out, or one for each configuration."""
    q = np.array([[0.3, -0.2, 0.9], [1.0, 0.0, -1.0]])
    np.testing.assert_array_equal(elastic(PLANAR_3R, 2.0).gradient(PLANAR_3R, q), 2 * q)
    np.testing.assert_array_equal(elastic(PLANAR_3R, np.full(3, 2.0)).gradient(PLANAR_3R, q), 2 * q)
    np.testing.assert_array_equal(elastic(PLANAR_3R, 2 * np.eye(3), q).gradient(PLANAR_3R, q), 0 * q)


def test_compliance_is_inverted():
    """W = C^-1 where nothing pulls: rest = q."""
    C = np.linalg.inv(K)
    W = impedance(PLANAR_3R, F1, C, F1).dense()[0]
    np.testing.assert_allclose(W, K, rtol=0, atol=1e-14 * np.linalg.cond(K) * 10)


@EACH_ROBOT
def test_gamma_is_the_change_of_torque_under_a_constant_force(name):
    """(K - W) v = d(J'F)/dq v, symmetrised: by central differences of J along random v, F the force in balance."""
    robot = robots.load(name)
    rng = np.random.default_rng(1)
    q, _, _ = generic(robot, rng, 20)
    F, C = rng.uniform(-1, 1, (20, robot.m)), rng.uniform(0.5, 2.0, robot.n)
    home = q - C * np.einsum("bmn,bm->bn", robot.jacobian(q), F)
    Gamma = np.diag(1 / C) - impedance(robot, q, C, home).dense()
    u, v = rng.standard_normal((2, 20, robot.n))

    def torque(step):
        return np.einsum("bmn,bm->bn", robot.jacobian(q + STEP * step) - robot.jacobian(q - STEP * step), F) / (2 * STEP)

    expected = ((u * torque(v)).sum(axis=1) + (v * torque(u)).sum(axis=1)) / 2
    np.testing.assert_allclose(np.einsum("bi,bij,bj->b", u, Gamma, v), expected, rtol=0, atol=1e3 * STEP**2)


def test_force_is_the_one_in_balance():
    """The multipliers are F: F1 with rest q0 has F = (-1, -1)."""
    condition = balanced(extremum(PLANAR_3R, F1, elastic(PLANAR_3R, 1.0, Q0)))
    np.testing.assert_allclose(condition.multipliers[0], (-1, -1), rtol=0, atol=rounding(PLANAR_3R, F1, 3.0)[0])


def test_refusals():
    """Off equilibrium (unless asked to let it pass), K or C not positive definite, a misshapen rest."""
    off = Q0 + 0.1 * NULL
    with pytest.raises(OffEquilibriumError, match="configuration 0 of planar_3r"):
        impedance(PLANAR_3R, F1, 1.0, off)
    assert impedance(PLANAR_3R, F1, 1.0, off, np.inf).lead == (1,)
    with pytest.raises(WeightNotPositiveDefiniteError, match="compliance"):
        impedance(PLANAR_3R, F1, -1.0, Q0)
    with pytest.raises(WeightNotPositiveDefiniteError, match="stiffness"):
        elastic(PLANAR_3R, np.diag([1.0, 1.0, 0.0]))
    with pytest.raises(ShapeError, match="rest"):
        elastic(PLANAR_3R, 1.0, np.zeros(4))


def test_springs_left_to_themselves():
    """Stiffness and compliance are one where left out: g = |q|^2/2, and W is that of C = 1."""
    q = np.array([[0.3, 1.1, -0.7]])
    g = elastic(PLANAR_3R)
    np.testing.assert_array_equal(g.gradient(PLANAR_3R, q), q)
    np.testing.assert_allclose(g.value(PLANAR_3R, q), (q**2).sum(axis=1) / 2)
    np.testing.assert_array_equal(g.curvature(PLANAR_3R, q), [np.eye(3)])
    home = q - np.einsum("bmn,bm->bn", PLANAR_3R.jacobian(q), np.ones((1, 2)))
    W, one, two = (impedance(PLANAR_3R, q, *given, rest=home).dense() for given in ((), (1.0,), (np.eye(3),)))
    np.testing.assert_allclose(W, one, rtol=1e-14)
    np.testing.assert_allclose(W, two, rtol=1e-14)
