"""C2: the Jacobian transpose."""

from __future__ import annotations

import numpy as np
import pytest

from problems import robots
from problems.methods.jacobian_transpose import METHOD, cast
from problems.robots.planar import PLANAR_3R
from sandbox.errors import AsymmetricWeightError, NonFiniteError, ShapeError, WeightNotPositiveDefiniteError
from sandbox.law import answer, rates
from sandbox.solution import Status
from tests.problems.secondary import COUNT, EACH_ROBOT, F1, agrees, at, faulty, rounding


@EACH_ROBOT
def test_agrees_with_the_original(name):
    """Framework and kappa J'K e agree."""
    agrees(METHOD, name)


def test_f1():
    """With e = (1, 1): J'e = (1, 0, 1), kappa = .2, what is left is (1.2, .4)."""
    (x,) = rates(METHOD, PLANAR_3R, F1, at(1, 1))
    allowed = rounding(PLANAR_3R, F1, 2.0)[0]
    np.testing.assert_allclose(x, (0.2, 0.0, 0.2), rtol=0, atol=allowed)
    np.testing.assert_allclose(1 - PLANAR_3R.jacobian(F1)[0] @ x, (1.2, 0.4), rtol=0, atol=allowed)


@EACH_ROBOT
def test_no_other_step_along_the_same_direction_is_better(name):
    """|K e - J qdot| is least at kappa: a step longer or shorter by a percent leaves more."""
    robot = robots.load(name)
    q, e, parameters = METHOD.draw(robot, np.random.default_rng(1), COUNT)
    x, J = rates(METHOD, robot, q, e, **parameters), robot.jacobian(q)

    def left(share):
        return np.linalg.norm(parameters["gain"] * e - share * np.einsum("bmn,bn->bm", J, x), axis=1)

    assert ((left(1.0) < left(1.01)) & (left(1.0) < left(0.99))).all()


@EACH_ROBOT
def test_error_falls(name):
    """V = e'K e / 2 falls, Vdot = -kappa |J'K e|^2, for K = I and any other."""
    robot = robots.load(name)
    q, e, parameters = METHOD.draw(robot, np.random.default_rng(2), COUNT)
    x, J = rates(METHOD, robot, q, e, **parameters), robot.jacobian(q)
    fall = -np.einsum("bm,bmn,bn->b", parameters["gain"] * e, J, x)
    pull = np.einsum("bmn,bm->bn", J, parameters["gain"] * e)
    kappa = (x * pull).sum(axis=1) / np.square(pull).sum(axis=1)
    assert (kappa > 0).all() and (fall < 0).all()
    np.testing.assert_allclose(fall, -kappa * np.square(pull).sum(axis=1), rtol=1e-12)


def test_stalls_at_a_singularity():
    """F0, e along the arm: J'e = 0 with e != 0, nothing moves."""
    np.testing.assert_array_equal(rates(METHOD, PLANAR_3R, np.zeros((1, 3)), at(1, 0)), np.zeros((1, 3)))
    np.testing.assert_array_equal(METHOD.witness(PLANAR_3R, np.zeros((1, 3)), at(1, 0)), np.zeros((1, 3)))


def without_gain(robot, q, xdot, *, gain=1.0):
    return cast(robot, q, xdot)


def wrong_sign(robot, q, xdot, *, gain=1.0):
    return cast(robot, q, -xdot, gain=gain)


@pytest.mark.parametrize("fault", [without_gain, wrong_sign])
def test_fault_in_the_cast(fault):
    """Without K, or with -e, framework and original disagree."""
    faulty(METHOD, fault)


@pytest.mark.parametrize("gain", [0.0, -1.0, np.array([1.0, 0.0]), np.array([[1.0, 2.0], [2.0, 1.0]])])
def test_refuses_a_gain_that_is_not_positive_definite(gain):
    """K must be positive definite."""
    with pytest.raises(WeightNotPositiveDefiniteError, match="gain is not positive definite"):
        cast(PLANAR_3R, F1, at(1, 1), gain=gain)


def test_refuses_asymmetric_misshapen_and_infinite_gains():
    """K must be symmetric, m x m and finite."""
    for error, gain in ((AsymmetricWeightError, [[1.0, 0.5], [0, 1]]), (ShapeError, np.ones(3)), (NonFiniteError, np.nan)):
        with pytest.raises(error, match="gain"):
            cast(PLANAR_3R, F1, at(1, 1), gain=np.array(gain))


def test_has_no_multipliers():
    """It minimises nothing: every member is answered, its multipliers (m,) are NaN; one problem has plain shapes."""
    for q, e, lead in ((np.tile(F1, (2, 1)), np.ones((2, 2)), (2,)), (F1[0], np.ones(2), ())):
        found = answer(METHOD, PLANAR_3R, cast(PLANAR_3R, q, e), {})
        assert found.x.shape == (*lead, 3) and found.y.shape == (*lead, 2) and np.isnan(found.y).all()
        assert all(status is Status.SOLVED for status in np.ravel(np.array(found.status, dtype=object)))
