"""M16: minimum kinetic energy, W = M(q)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from problems import robots
from problems.methods.inertia_weighted import METHOD
from problems.original.inertia_weighted import operational
from problems.robots.planar import PLANAR_3R, planar_arm
from problems.sets import textbook
from sandbox.closed_form.solve import solve
from sandbox.errors import AsymmetricWeightError, WeightNotPositiveDefiniteError
from sandbox.law import rates
from sandbox.problem import VelocityProblem
from sandbox.tolerances import UNIT
from tests.problems.methods.agreeing import agrees

F1 = np.array(textbook.F1.q)[None]
M = textbook.INERTIA_F1
J = np.array(textbook.F1.J, dtype=float)
ROUNDING = 1024 * UNIT  # of numbers below 10 through matrices of condition below 100
ROBOTS = ("planar_3r", "planar_4r", "seven_joint", "panda")


def test_f1():
    """F1 with unit point masses: Lambda = diag(2, 1), Jbar = [[0, 0], [-1, 0], [1, 1]], qdot = (0, -xdot, xdot + ydot)."""
    Lambda, Jbar = operational(PLANAR_3R, F1)
    np.testing.assert_allclose(Lambda[0], np.diag([2, 1]), atol=ROUNDING)
    np.testing.assert_allclose(Jbar[0], [[0, 0], [-1, 0], [1, 1]], atol=ROUNDING)
    for x, y in ((1, 1), (0.3, -0.7)):
        for law in (METHOD.original, lambda *given: rates(METHOD, *given)):
            np.testing.assert_allclose(law(PLANAR_3R, F1, np.array([[x, y]]))[0], [0, -x, x + y], atol=ROUNDING)


def test_an_indefinite_weight_with_the_same_answer():
    """M - 3 J'J = [[-7, -5, -4], [-5, -3, -2], [-4, -2, -2]] has two negative eigenvalues, holds (7), moves the same."""
    W = M - 3 * J.T @ J
    np.testing.assert_array_equal(W, [[-7, -5, -4], [-5, -3, -2], [-4, -2, -2]])
    assert (np.linalg.eigvalsh(W) < 0).sum() == 2
    x = solve(VelocityProblem(J=J, xdot=[0.3, -0.7], W=W)).x
    np.testing.assert_allclose(x, [0, -0.3, -0.4], atol=ROUNDING)
    for c, negative in ((0.999, 0), (1.001, 1), (1.999, 1), (2.001, 2)):  # thresholds: the eigenvalues 1, 2 of Lambda
        assert (np.linalg.eigvalsh(M - c * J.T @ J) < 0).sum() == negative


@pytest.mark.parametrize("robot", ROBOTS)
def test_agrees_with_its_original(robot):
    """Eq. (6) and Khatib's Jbar agree within their bounds, also where shifts make W indefinite."""
    assert agrees(METHOD, robot)


@pytest.mark.parametrize("name", ROBOTS)
def test_null_space_torques_do_not_move_the_hand(name):
    """J M^-1 (I - J'Jbar') = 0, the property that singles out Jbar; with J^+ for Jbar it does not hold."""
    robot = robots.load(name)
    q = METHOD.draw(robot, np.random.default_rng(0), 20).q
    Jq, Mq = robot.jacobian(q), robot.inertia(q)
    mobility = Jq @ np.linalg.inv(Mq)
    size = 50 * robot.n * UNIT * np.linalg.cond(Mq) * np.linalg.cond(mobility @ np.swapaxes(Jq, 1, 2))
    for inverse, consistent in ((operational(robot, q)[1], True), (np.linalg.pinv(Jq), False)):
        left = mobility @ (np.eye(robot.n) - np.swapaxes(Jq, 1, 2) @ np.swapaxes(inverse, 1, 2))
        share = np.abs(left).max(axis=(1, 2)) / np.abs(mobility).max(axis=(1, 2))
        assert (share <= size).all() if consistent else (share > 1e-3).all()


@pytest.mark.parametrize("mu", [0.5, 3.0, 100.0])
def test_a_mass_on_the_tip_changes_nothing(mu):
    """A point mass mu on the tip adds mu J'J to M (I20) and leaves the motion alone."""
    loaded = planar_arm((1.0, 1.0, 1.0), (1.0, 1.0, 1.0 + mu))
    drawn = METHOD.draw(PLANAR_3R, np.random.default_rng(1), 50)
    Jq = PLANAR_3R.jacobian(drawn.q)
    added = loaded.inertia(drawn.q) - PLANAR_3R.inertia(drawn.q)
    np.testing.assert_allclose(added, mu * np.swapaxes(Jq, 1, 2) @ Jq, atol=ROUNDING * mu)
    same(PLANAR_3R, loaded, drawn)


@pytest.mark.parametrize("name", ["seven_joint", "panda"])
def test_a_rigid_payload_changes_nothing_for_a_pose_task(name):
    """Any rigid payload on the hand, mass, centre and inertia, leaves the motion of a pose task alone."""
    robot = robots.load(name)
    model = robot.model.copy()
    about_centre = np.array([[0.3, 0.05, 0.0], [0.05, 0.4, 0.02], [0.0, 0.02, 0.5]])
    hand = model.frames[model.getFrameId(robot.hand)].parentJoint
    model.appendBodyToJoint(hand, pin.Inertia(5.0, np.array([0.1, -0.2, 0.15]), about_centre), pin.SE3.Identity())
    drawn = METHOD.draw(robot, np.random.default_rng(2), 50)
    same(robot, replace(robot, model=model), drawn)
    wrist = robot.task("position")  # fixes less than the payload's motion: now it matters
    moved = rates(METHOD, replace(wrist, model=model), drawn.q, drawn.xdot[:, :3])
    assert np.abs(moved - rates(METHOD, wrist, drawn.q, drawn.xdot[:, :3])).max() > 1e-2


def same(robot, loaded, drawn):
    """Whether both robots answer alike, within 50 n u cond of their systems."""
    answers = [rates(METHOD, arm, drawn.q, drawn.xdot) for arm in (robot, loaded)]
    bound = 50 * robot.n * UNIT * np.linalg.cond(loaded.inertia(drawn.q)) * np.linalg.cond(robot.jacobian(drawn.q)) ** 2
    difference = np.abs(answers[0] - answers[1]).max(axis=-1) / np.abs(answers[0]).max(axis=-1)
    assert (difference <= bound).all()
    assert np.median(difference) < 1e-12


def test_refusals():
    """A massless last link and an asymmetric mass matrix are refused."""
    light = planar_arm((1.0, 1.0, 1.0), name="light")
    light.model.inertias[3] = pin.Inertia.Zero()
    with pytest.raises(WeightNotPositiveDefiniteError, match="mass matrix M of light is not positive definite"):
        METHOD.cast(light, F1, np.ones((1, 2)))
    lopsided = planar_arm((1.0, 1.0, 1.0))
    object.__setattr__(lopsided, "inertia", lambda q: np.broadcast_to(np.triu(M), (1, 3, 3)))
    with pytest.raises(AsymmetricWeightError):
        METHOD.cast(lopsided, F1, np.ones((1, 2)))


def inverted(robot, q, xdot):
    A = np.linalg.inv(robot.inertia(q))
    return VelocityProblem(J=robot.jacobian(q), xdot=xdot, W=(A + np.swapaxes(A, 1, 2)) / 2)


def diagonal(robot, q, xdot):
    return VelocityProblem(J=robot.jacobian(q), xdot=xdot, W=robot.inertia(q) * np.eye(robot.n))


def unweighted(robot, q, xdot):
    return VelocityProblem(J=robot.jacobian(q), xdot=xdot, W=np.eye(robot.n))


@pytest.mark.parametrize("cast", [inverted, diagonal, unweighted])
@pytest.mark.parametrize("robot", ["planar_3r", "panda"])
def test_a_wrong_weight_disagrees(robot, cast):
    """M^-1 for M, its diagonal alone, or no weight does not agree with the original."""
    assert not agrees(replace(METHOD, cast=cast), robot, 20)


def test_an_original_with_m_for_its_inverse_disagrees():
    """Jbar = M J'(J M J')^-1 does not agree with the framework."""

    def wrong(robot, q, xdot):
        moved = robot.inertia(q) @ np.swapaxes(robot.jacobian(q), 1, 2)
        return (moved @ np.linalg.solve(robot.jacobian(q) @ moved, xdot[..., None]))[..., 0]

    assert not agrees(replace(METHOD, original=wrong), "planar_3r", 20)
