"""M8: Maciejewski and Klein's obstacle avoidance by a second task."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from problems import robots
from problems.measures.obstacle import ContactError
from problems.methods import augmented_jacobian
from problems.methods.two_task_obstacle import METHOD
from problems.robots.planar import PLANAR_3R, PLANAR_4R
from problems.sets import textbook
from problems.weightings.two_task import NotControlledError, escape_rows, two_task
from sandbox.closed_form.solve import solve
from sandbox.errors import ConditionSevenError, RangeError, WeightNotPositiveDefiniteError
from sandbox.law import rates
from sandbox.problem import VelocityProblem
from sandbox.tolerances import UNIT
from tests.problems.methods.agreeing import agrees

F1, F2 = np.array(textbook.F1.q)[None], np.array(textbook.F2.q)[None]
ELBOW = [(3, (0.0, 0.0, 0.0))]  # the end of link 2
BELOW, BESIDE = np.array([1.0, 0.6, 0.0]), np.array([0.6, 1.0, 0.0])
ROUNDING = 256 * UNIT  # of numbers below 10 through matrices of condition below 50
ROBOTS = ("planar_3r", "planar_4r", "seven_joint", "panda")


def both(robot, q, xdot, **parameters):
    """What the framework and the original say."""
    return rates(METHOD, robot, q, xdot, **parameters), METHOD.original(robot, q, xdot, **parameters)


def test_f1():
    """F1, the end of link 2 escaping along +y at d: qdot = (d, -xdot - d, xdot + ydot - d)."""
    for d, (x, y) in ((0.5, (0.3, -0.7)), (0.0, (1.0, 1.0)), (-2.0, (0.0, 0.0))):
        for qdot in both(PLANAR_3R, F1, np.array([[x, y]]), obstacle=BELOW, points=ELBOW, escape=d):
            np.testing.assert_allclose(qdot[0], [d, -x - d, x + y - d], atol=ROUNDING)
    np.testing.assert_allclose(qdot[0], [-2, 2, 2], atol=ROUNDING)


@pytest.mark.parametrize("robot", ROBOTS)
def test_agrees_with_its_original(robot):
    """Eq. (6) and the projected second task agree within their bounds, also where shifts make W indefinite."""
    assert agrees(METHOD, robot)


def test_distances_grow_as_asked():
    """With p = n - m points each distance changes at exactly its escape rate, and the task is met."""
    drawn = METHOD.draw(PLANAR_4R, np.random.default_rng(3), 50)
    qdot = rates(METHOD, PLANAR_4R, drawn.q, drawn.xdot, **drawn.parameters)
    problem = METHOD.cast(PLANAR_4R, drawn.q, drawn.xdot, **drawn.parameters)
    size = 200 * UNIT * np.linalg.cond(np.concatenate([problem.J, problem.W.E], axis=1)) * np.abs(qdot).max(axis=-1)
    assert (np.abs(np.einsum("bpn,bn->bp", problem.W.E, qdot) - drawn.parameters["escape"]).max(axis=-1) <= size).all()
    assert (np.abs(np.einsum("bmn,bn->bm", problem.J, qdot) - drawn.xdot).max(axis=-1) <= size).all()


@pytest.mark.parametrize("robot", ROBOTS)
def test_as_many_points_as_freedoms_are_an_augmented_jacobian(robot):
    """For p = n - m this is M11 with E = Jd and gbar = dd (I22), whatever Qd is."""
    robot = robots.load(robot)
    drawn = METHOD.draw(robot, np.random.default_rng(4), 50)
    problem = METHOD.cast(robot, drawn.q, drawn.xdot, **drawn.parameters)
    E, dd = problem.W.E, drawn.parameters["escape"]
    augmented = rates(augmented_jacobian.METHOD, robot, drawn.q, drawn.xdot, E=E, gbar=dd)
    stacked = np.concatenate([problem.J, E], axis=1)
    directly = np.linalg.solve(stacked, np.concatenate([drawn.xdot, dd], axis=1)[..., None])[..., 0]
    size = 200 * UNIT * np.linalg.cond(stacked) * np.abs(directly).max(axis=-1)
    for Qd in (None, 10.0 ** np.arange(robot.k)):
        qdot = rates(METHOD, robot, drawn.q, drawn.xdot, **drawn.parameters, Qd=Qd)
        for other in (augmented, directly):
            assert (np.abs(qdot - other).max(axis=-1) <= size).all()


def test_more_points_than_freedoms_are_met_in_the_least_squares_sense_of_qd():
    """For p > n - m Qd matters, the original is that of Qd = I, and the answer is the weighted least-squares one."""
    points, q, xdot = [(2, (0, 0, 0)), (3, (0, 0, 0)), (3, (0.5, 0, 0))], np.array([[0.3, 1.1, -0.7]]), np.array([[0.3, -0.7]])
    given = {"obstacle": np.array([0.7, 0.1, 0.0]), "points": points, "escape": [0.1, 0.5, 0.2]}
    plain, original = both(PLANAR_3R, q, xdot, **given)
    np.testing.assert_allclose(plain, original, atol=ROUNDING)
    weighted, original = both(PLANAR_3R, q, xdot, **given, Qd=[1, 100, 1])
    np.testing.assert_allclose(weighted, original, atol=10 * ROUNDING)
    assert np.abs(weighted - plain).max() > 0.01
    Jd, J = escape_rows(PLANAR_3R, q, given["obstacle"], points)[0], PLANAR_3R.jacobian(q)[0]
    null = np.linalg.svd(J)[2][2]
    particular = np.linalg.pinv(J) @ xdot[0]
    miss = np.array(given["escape"]) - Jd @ particular
    y = (Jd @ null) @ (np.array([1, 100, 1]) * miss) / ((Jd @ null) @ (np.array([1, 100, 1]) * (Jd @ null)))
    np.testing.assert_allclose(weighted[0], particular + y * null, atol=10 * ROUNDING)


def test_error_of_eps_on_f2():
    """F2, one row (0, 1, 0, 0) for two freedoms: eps I lets the rest move least, and the law is met to 1.94 eps."""
    J, Jd, dd, xdot = PLANAR_4R.jacobian(F2)[0], np.array([[0.0, 1, 0, 0]]), np.array([1.0]), np.array([0.3, -0.7])
    primary = np.linalg.pinv(J) @ xdot
    limit = primary + np.linalg.pinv(Jd @ (np.eye(4) - np.linalg.pinv(J) @ J)) @ (dd - Jd @ primary)
    errors = {}
    for eps in (1e-3, 1e-4, 1e-5):
        W = two_task(PLANAR_4R, F2[0], Jd, eps=eps)
        errors[eps] = np.abs(solve(VelocityProblem(J=J, xdot=xdot, W=W, a=-(Jd.T @ dd))).x - limit).max()
        assert errors[eps] == pytest.approx(1.94 * eps, rel=3 * eps + 0.005 / 1.94)
    assert errors[1e-4] / errors[1e-3] == pytest.approx(0.1, rel=1e-2)


def test_fewer_points_than_freedoms_need_eps():
    """On four joints one point leaves a freedom: refused without eps, met to O(eps) with it."""
    q, xdot = F2 + 0.1, np.array([[0.3, -0.7]])
    with pytest.raises(NotControlledError):
        METHOD.cast(PLANAR_4R, q, xdot, points=ELBOW)
    miss = []
    for eps in (1e-4, 1e-5, 1e-6):
        framework, original = both(PLANAR_4R, q, xdot, points=ELBOW, eps=eps)
        miss.append(np.abs(framework - original).max())
    assert np.array(miss[1:]) / miss[:-1] == pytest.approx(0.1, rel=0.01)


def test_an_obstacle_that_self_motion_cannot_leave():
    """F1 with u = (1, 0): Jd is a row of J, N'Jd' = 0 and (7) fails; with eps the answer is J^+ xdot, as the original says."""
    given = {"obstacle": BESIDE, "points": ELBOW}
    with pytest.raises(NotControlledError, match="give eps > 0"):
        METHOD.cast(PLANAR_3R, F1, np.ones((1, 2)), **given)
    Jd = np.array([-1.0, -1, 0])
    with pytest.raises(ConditionSevenError):  # and so does the closed form, asked with this weight itself
        solve(VelocityProblem(J=PLANAR_3R.jacobian(F1), xdot=np.ones((1, 2)), W=np.outer(Jd, Jd)))
    for qdot in both(PLANAR_3R, F1, np.ones((1, 2)), **given, eps=1e-6):
        np.testing.assert_allclose(qdot[0], [1 / 3, -4 / 3, 5 / 3], atol=1e-9)


def test_refusals():
    """Contact, a point off the arm, eps < 0 and a Qd that is not positive definite are refused."""
    ones = np.ones((1, 2))
    with pytest.raises(ContactError):
        METHOD.cast(PLANAR_3R, F1, ones, obstacle=[1.0, 1.0, 0.0], points=ELBOW)
    with pytest.raises(RangeError, match="not on the arm"):
        METHOD.cast(PLANAR_3R, F1, ones, obstacle=BELOW, points=[(7, (0, 0, 0))])
    with pytest.raises(RangeError, match="eps"):
        METHOD.cast(PLANAR_3R, F1, ones, obstacle=BELOW, points=ELBOW, eps=-1.0)
    with pytest.raises(WeightNotPositiveDefiniteError, match="Qd"):
        METHOD.cast(PLANAR_3R, F1, ones, obstacle=BELOW, points=ELBOW, Qd=[-1.0])


def wrong_sign(robot, q, xdot, *, escape):
    return METHOD.cast(robot, q, xdot, escape=-escape)


def no_vector(robot, q, xdot, *, escape):
    problem = METHOD.cast(robot, q, xdot, escape=escape)
    return VelocityProblem(J=problem.J, xdot=xdot, W=problem.W)


def unweighted(robot, q, xdot, *, escape):
    problem = METHOD.cast(robot, q, xdot, escape=escape)
    return VelocityProblem(J=problem.J, xdot=xdot, W=np.eye(robot.n), a=problem.a)


def towards(robot, q, xdot, *, escape):
    """Jd of squared distances: u not of unit length."""
    problem = METHOD.cast(robot, q, xdot, escape=escape)
    return VelocityProblem(J=problem.J, xdot=xdot, W=problem.W, a=2 * problem.a)


@pytest.mark.parametrize("cast", [wrong_sign, no_vector, unweighted, towards])
@pytest.mark.parametrize("robot", ["planar_3r", "planar_4r", "panda"])
def test_a_wrong_cast_disagrees(robot, cast):
    """The wrong sign of dd, no dd, W = I, or a factor on a alone: none agrees with the original."""
    assert not agrees(replace(METHOD, cast=cast), robot, 20)
