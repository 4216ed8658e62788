"""C1: damped least squares."""

from __future__ import annotations

import numpy as np
import pytest

from problems import robots
from problems.methods.damped_least_squares import METHOD, cast, nakamura_hanafusa
from problems.methods.draw import generic
from problems.robots.planar import PLANAR_3R
from sandbox.closed_form.solve import solve
from sandbox.errors import NonFiniteError, RangeError, WeightNotPositiveDefiniteError
from sandbox.law import rates
from sandbox.problem import VelocityProblem
from tests.problems.secondary import COUNT, EACH_ROBOT, F1, agrees, answers, at, faulty, found, rounding


@pytest.mark.parametrize("name", ["planar_3r", "planar_4r", "panda", "seven_joint"])
def test_agrees_with_the_original(name):
    """Framework and the sum over singular values agree: at singularities, near them and elsewhere."""
    agrees(METHOD, name)


def test_f1():
    """With lambda = 1, xdot = (1, 1): (1/6, -1/3, 1/2)."""
    answers(METHOD, PLANAR_3R, F1, at(1, 1), (1 / 6, -1 / 3, 1 / 2), damping=1.0)


def test_matrix_at_f1():
    """With lambda = 1: J* = [[-1/12, 1/4], [-1/3, 0], [1/4, 1/4]]."""
    answers(METHOD, PLANAR_3R, np.repeat(F1, 2, axis=0), np.eye(2), [(-1 / 12, -1 / 3, 1 / 4), (1 / 4, 0, 1 / 4)], damping=1.0)


def test_homogeneous_term_leaks_into_the_task():
    """With a = -e1, xdot = 0, lambda = 1: J qdot = J (I - J*J) e1 = (-1/12, 1/4), not 0."""
    x, allowed = found(METHOD, PLANAR_3R, F1, at(0, 0), damping=1.0, gradient=np.array([-1.0, 0, 0]))
    moved = PLANAR_3R.jacobian(F1)[0] @ x[0]
    assert (np.abs(moved - (-1 / 12, 1 / 4)) <= 4 * allowed[0]).all()


@EACH_ROBOT
@pytest.mark.parametrize("damping", [0.5, 0.125, 1e-3])
def test_rates_are_bounded(name, damping):
    """|qdot| <= |xdot| / (2 lambda) at and near singularities, with W = Wx = I."""
    robot = robots.load(name)
    q, xdot, _ = METHOD.draw(robot, np.random.default_rng(1), COUNT)
    x, allowed = found(METHOD, robot, q, xdot, damping=damping)
    most = np.linalg.norm(xdot, axis=1) / (2 * damping)
    assert (np.linalg.norm(x, axis=1) <= most + robot.n * allowed[:, 0]).all()
    assert (np.linalg.norm(x, axis=1) > 0.1 * most).any()


def test_tends_to_the_pseudoinverse():
    """The distance from J^+ xdot falls a hundredfold per decade of lambda (I25)."""
    panda = robots.load("panda")
    q, xdot, _ = generic(panda, np.random.default_rng(2), 20)
    exact = np.einsum("bnm,bm->bn", np.linalg.pinv(panda.jacobian(q)), xdot)
    errors = [np.abs(rates(METHOD, panda, q, xdot, damping=d) - exact).max() for d in (1e-2, 1e-3, 1e-4)]
    np.testing.assert_allclose(np.divide(errors[1:], errors[:-1]), 0.01, rtol=0.2)


def test_tends_to_the_jacobian_transpose():
    """lambda^2 qdot -> J'xdot as lambda grows (I25)."""
    panda = robots.load("panda")
    q, xdot, _ = generic(panda, np.random.default_rng(2), 20)
    transposed = np.einsum("bmn,bm->bn", panda.jacobian(q), xdot)
    errors = [np.abs(d**2 * rates(METHOD, panda, q, xdot, damping=d) - transposed).max() for d in (1e1, 1e2, 1e3)]
    np.testing.assert_allclose(np.divide(errors[1:], errors[:-1]), 0.01, rtol=0.2)


@EACH_ROBOT
def test_is_the_framework_on_an_arm_with_slack_joints(name):
    """Eq. (6) on [J I] with blkdiag(lambda^2 W, Wx): the first n rates are those of C1, the rest what is missing (I25)."""
    robot = robots.load(name)
    q, xdot, parameters = METHOD.draw(robot, np.random.default_rng(3), COUNT)
    n, m, share = robot.n, robot.m, parameters["damping"] ** 2
    W = np.diag(np.concatenate([share * parameters["weight"], parameters["task_weight"]]))
    J = np.concatenate([robot.jacobian(q), np.broadcast_to(np.eye(m), (COUNT, m, m))], axis=2)
    a = np.concatenate([share * parameters["gradient"], np.zeros((COUNT, m))], axis=1)
    slack = solve(VelocityProblem(J=J, xdot=xdot, W=W, a=a)).x
    x, allowed = found(METHOD, robot, q, xdot, **parameters)
    assert (np.abs(slack[:, :n] - x) <= allowed).all()
    missing = xdot - np.einsum("bmn,bn->bm", robot.jacobian(q), x)
    assert (np.abs(slack[:, n:] - missing) <= 10 * allowed).all()


def test_damping_by_manipulability():
    """lambda^2 = k0 (1 - w/w0)^2 below w0, nothing above: continuous, and k0 at the singularity."""
    w = np.array([0.0, 0.25, 0.5, 1.0, 2.0])
    np.testing.assert_array_equal(nakamura_hanafusa(w, threshold=0.5, largest=0.04), [0.04, 0.01, 0.0, 0.0, 0.0])
    for wrong in ({"threshold": 0.0, "largest": 1.0}, {"threshold": 1.0, "largest": -1.0}):
        with pytest.raises(RangeError):
            nakamura_hanafusa(w, **wrong)


def plain_lambda(robot, q, xdot, *, damping=0.125, weight=1.0, **others):
    return cast(robot, q, xdot, damping=damping, weight=np.asarray(weight) / damping, **others)


def task_weight_forgotten(robot, q, xdot, *, task_weight=1.0, **others):
    return cast(robot, q, xdot, **others)


def wrong_sign(robot, q, xdot, *, gradient=None, **others):
    return cast(robot, q, xdot, gradient=-gradient, **others)


@pytest.mark.parametrize("fault", [plain_lambda, task_weight_forgotten, wrong_sign])
def test_fault_in_the_cast(fault):
    """With lambda in the place of lambda^2, without Wx, or with -a, framework and original disagree."""
    faulty(METHOD, fault)


@pytest.mark.parametrize("damping", [0.0, -1.0])
def test_refuses_damping_that_is_not_positive(damping):
    """Any lambda <= 0 is refused, at a singular arm and elsewhere."""
    for q in (F1, np.zeros((1, 3))):
        with pytest.raises(RangeError, match="lambda must be positive"):
            cast(PLANAR_3R, q, at(1, 1), damping=damping)


def test_refuses_weights_that_are_not_positive_definite():
    """W and Wx must be, damping must be finite; the field is named."""
    for field, size in (("weight", 3), ("task_weight", 2)):
        with pytest.raises(WeightNotPositiveDefiniteError, match=field):
            cast(PLANAR_3R, F1, at(1, 1), **{field: np.diag([1.0, -1.0, 1.0])[:size, :size]})
    with pytest.raises(NonFiniteError, match="damping"):
        cast(PLANAR_3R, F1, at(1, 1), damping=np.inf)


def test_task_is_missed():
    """Damping leaves J qdot - xdot = -lambda^2 (JJ' + lambda^2 I)^-1 xdot of the task."""
    J = PLANAR_3R.jacobian(F1)[0]
    x = rates(METHOD, PLANAR_3R, F1, at(1, 1), damping=0.5)[0]
    expected = -0.25 * np.linalg.solve(J @ J.T + 0.25 * np.eye(2), np.ones(2))
    np.testing.assert_allclose(J @ x - 1, expected, rtol=0, atol=rounding(PLANAR_3R, F1, 3.0)[0])
