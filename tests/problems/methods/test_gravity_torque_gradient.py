"""M6: static torque by its gradient, and Hollerbach and Suh's least torque by accelerations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from problems import robots
from problems.methods import gravity_torque_gradient as module
from problems.methods.gravity_torque_gradient import METHOD, cast_acceleration
from problems.original.gravity_torque_gradient import original_acceleration
from problems.robots.planar import GRAVITY, PLANAR_3R
from problems.robots.robot import Robot
from problems.sets import textbook
from problems.weightings.torque import torque
from sandbox.agreement import SHIFTS, compare, shifted
from sandbox.closed_form.solve import solve
from sandbox.errors import ConditionSevenError, RangeError, ShapeError, WeightNotPositiveDefiniteError
from sandbox.law import rates
from sandbox.tolerances import UNIT
from tests.problems.methods.agreeing import agrees

F1, F1B = np.array(textbook.F1.q)[None], np.array(textbook.F1B.q)[None]
REST = np.zeros((1, 2))
M_F1 = np.array([[8.0, 4, 2], [4, 3, 1], [2, 1, 1]])
ROUNDING = 1e3 * UNIT * GRAVITY**2  # numbers of order g0^2 through a condition of ten
ROBOTS = ("planar_3r", "planar_4r", "seven_joint", "panda")
ACCELERATIONS = replace(METHOD, inverts_weight=True)
"""Its original inverts M on the null space."""


def test_f1b():
    """F1b, alpha = 1e-3, at rest: qdot = -alpha (3 g0^2/5) n = (0, .05774166, -.11548332)."""
    for qdot in (rates(METHOD, PLANAR_3R, F1B, REST)[0], METHOD.original(PLANAR_3R, F1B, REST)[0]):
        np.testing.assert_allclose(qdot, -1e-3 * 3 * GRAVITY**2 / 5 * np.array([0, -1, 2]), atol=ROUNDING)
        np.testing.assert_allclose(qdot, [0, 0.05774166, -0.11548332], atol=5e-9)


def test_weighted_torques():
    """Q counts, and counts alike in framework and original."""
    panda = robots.load("panda")
    situation = METHOD.draw(panda, np.random.default_rng(1), 20)
    found = [rates(METHOD, panda, situation.q, situation.xdot, Q=Q) for Q in (None, 10.0 ** -np.arange(7))]
    other = METHOD.original(panda, situation.q, situation.xdot, Q=10.0 ** -np.arange(7))
    np.testing.assert_allclose(found[1], other, rtol=0, atol=1e-11 * np.abs(other).max())
    assert np.abs(found[0] - found[1]).max() > 1e-3


def test_fault_derivative_left_out():
    """tau_g in the place of (d tau_g/dq)'Q tau_g does not agree."""
    from problems.original.gradient_projection import projected

    def wrong(robot, q, xdot, *, alpha=1e-3):
        return projected(robot, q, xdot, -alpha * robot.gravity_torque(q))

    assert not agrees(replace(METHOD, original=wrong), "planar_4r", count=20)


# by accelerations


def situations(robot, count=200):
    """q, qdot, xddot."""
    rng = np.random.default_rng([7, *robot.name.encode()])
    drawn = METHOD.draw(robot, rng, count)
    return drawn.q, rng.uniform(-1, 1, drawn.q.shape), drawn.xdot


def agreeing(robot, original, count=200, **parameters):
    """Whether eq. (6) on accelerations and `original` agree everywhere, as cast and after both shifts of W."""
    q, qdot, xddot = situations(robot, count)
    problem = cast_acceleration(robot, q, xddot, qdot=qdot, **parameters)
    other = original(robot, q, xddot, qdot=qdot, **parameters)
    posed = [problem] + [shifted(problem, shift, np.random.default_rng(0)) for shift in SHIFTS]
    rows = [compare(ACCELERATIONS, robot, one, other, {}) for one in posed]
    return all(row["agreed"] == row["held"] == count for row in rows)


def test_accelerations_at_f1():
    """F1 at rest, xddot = 0: M as printed, qddot = 2 g0 (-1, 1, 1), and the torque falls from g0 (4, 1, 1) to g0 (0, 1, 1)."""
    np.testing.assert_allclose(PLANAR_3R.inertia(F1)[0], M_F1, atol=ROUNDING)
    W = torque(PLANAR_3R, F1)
    np.testing.assert_allclose(W.dense()[0], M_F1 @ M_F1, atol=ROUNDING)
    assert W.factored
    problem = cast_acceleration(PLANAR_3R, F1, REST)
    np.testing.assert_allclose(problem.a[0], GRAVITY * M_F1 @ [4, 1, 1], atol=ROUNDING)
    for qddot in (solve(problem).x[0], original_acceleration(PLANAR_3R, F1, REST)[0]):
        np.testing.assert_allclose(qddot, 2 * GRAVITY * np.array([-1, 1, 1]), atol=ROUNDING)
        after = PLANAR_3R.inverse_dynamics(F1[0], np.zeros(3), qddot)
        np.testing.assert_allclose(after, GRAVITY * np.array([0, 1, 1]), atol=ROUNDING)


@pytest.mark.parametrize("name", ROBOTS)
def test_accelerations_agree(name):
    """Framework and the authors' formula agree, moving and under gravity, with Q = I and with a full Q."""
    robot = robots.load(name)
    assert agreeing(robot, original_acceleration)
    A = np.random.default_rng(3).standard_normal((robot.n, robot.n))
    assert agreeing(robot, original_acceleration, Q=A @ A.T + np.eye(robot.n))


@pytest.mark.parametrize("name", ROBOTS)
def test_accelerations_meet_the_task_with_least_torque(name):
    """J qddot + Jdot qdot = xddot, and no other acceleration that does needs less torque."""
    robot = robots.load(name)
    q, qdot, xddot = situations(robot, 20)
    qddot = solve(cast_acceleration(robot, q, xddot, qdot=qdot)).x
    h = 1e-6
    carried = (robot.jacobian(q + h * qdot) - robot.jacobian(q - h * qdot)) / (2 * h)
    reached = np.einsum("bmn,bn->bm", robot.jacobian(q), qddot) + np.einsum("bmn,bn->bm", carried, qdot)
    np.testing.assert_allclose(reached, xddot, atol=1e-8 * np.abs(qddot).max())
    N = np.linalg.svd(robot.jacobian(q))[2][:, robot.m :, :]
    least = np.linalg.norm(robot.inverse_dynamics(q, qdot, qddot), axis=-1)
    for sign in (1, -1):
        other = robot.inverse_dynamics(q, qdot, qddot + sign * 0.1 * N[:, 0])
        assert (np.linalg.norm(other, axis=-1) > least).all()


@pytest.mark.parametrize("left_out", ["jacobian_derivative", "gravity", "coriolis"])
def test_fault_in_accelerations(left_out):
    """An original without Jdot qdot, without gravity or without Coriolis torques does not agree."""
    panda = robots.load("panda")

    class Part:
        def __init__(self, robot):
            self.robot, self.n, self.m = robot, robot.n, robot.m

        def __getattr__(self, name):
            return getattr(self.robot, name)

        def jacobian_derivative(self, q):
            return self.robot.jacobian_derivative(q) * (left_out != "jacobian_derivative")

        def inverse_dynamics(self, q, qdot, qddot):
            qdot = qdot * (left_out != "coriolis")
            return self.robot.inverse_dynamics(q, qdot, qddot, gravity=left_out != "gravity")

    assert agreeing(panda, original_acceleration, count=20)
    assert not agreeing(panda, lambda robot, *a, **k: original_acceleration(Part(robot), *a, **k), count=20)


def test_fault_transposed_weight(monkeypatch):
    """M Q in the place of M'QM does not agree."""
    from sandbox.weight import Weight

    monkeypatch.setattr(module, "torque", lambda robot, q, Q: Weight(np.zeros((len(q), 7, 7)), robot.inertia(q) + np.eye(7)))
    assert not agreeing(robots.load("panda"), original_acceleration, count=20)


def test_semidefinite_weight():
    """Q of rank one is semidefinite: with two degrees of redundancy condition (7) fails, and it is refused."""
    four = robots.load("planar_4r")
    q, qdot, xddot = situations(four, 2)
    problem = cast_acceleration(four, q, xddot, qdot=qdot, Q=[1.0, 0, 0, 0])
    with pytest.raises(ConditionSevenError):
        solve(problem)


def test_acceleration_refusals():
    """An inertia matrix that is not positive definite, Q that is indefinite, and wrong shapes are refused."""
    model = pin.Model(PLANAR_3R.model)
    model.inertias[3] = pin.Inertia(1.0, np.zeros(3), np.zeros((3, 3)))
    pinned = Robot("pinned", model, "tip", (0, 1))
    with pytest.raises(WeightNotPositiveDefiniteError, match="mass matrix M of pinned"):
        cast_acceleration(pinned, F1, REST)
    with pytest.raises(RangeError, match="Q has the eigenvalue"):
        cast_acceleration(PLANAR_3R, F1, REST, Q=[1, 1, -1])
    with pytest.raises(ShapeError, match="xddot"):
        cast_acceleration(PLANAR_3R, F1, np.zeros((1, 3)))
    with pytest.raises(ShapeError, match="qdot"):
        cast_acceleration(PLANAR_3R, F1, REST, qdot=np.zeros(2))
