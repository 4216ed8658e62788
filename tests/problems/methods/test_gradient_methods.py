"""What all gradient methods (M1, M3, M5, M6, M7, M9, M10) share: W = I, agreement, direction, units, speed, faults."""

from __future__ import annotations

import time
from dataclasses import replace
from functools import partial

import numpy as np
import pinocchio as pin
import pytest

from problems import robots
from problems.measures.measure import Measure
from problems.methods import (
    fault_tolerance,
    free_swinging,
    gradient_projection,
    gravity_torque_gradient,
    joint_limit_gradient,
    manipulability_gradient,
    obstacle_potential,
)
from problems.methods.draw import STATIONARY, generic
from problems.original.gradient_projection import projected
from problems.robots.robot import Robot
from problems.weightings.identity import MixedUnitsError
from sandbox.errors import NonFiniteError, RangeError, ShapeError, UnknownNameError
from sandbox.law import rates
from sandbox.tolerances import UNIT
from tests.problems.measures import chain
from tests.problems.methods.agreeing import agrees

CHOICES = {
    gradient_projection: [None],
    joint_limit_gradient: joint_limit_gradient.CHOICES,
    manipulability_gradient: manipulability_gradient.CHOICES,
    gravity_torque_gradient: [None],
    obstacle_potential: [None],
    fault_tolerance: fault_tolerance.CHOICES,
    free_swinging: free_swinging.CHOICES,
}
"""Every method, and the measures it may follow."""


def variant(module, measure):
    """The method, its situations drawn for that measure."""
    method = module.METHOD
    return method if measure is None else replace(method, draw=partial(module.draw, measure=measure))


CASES = {measure or module.METHOD.name: variant(module, measure) for module, names in CHOICES.items() for measure in names}
METHODS = {module.METHOD.name: module.METHOD for module in CHOICES}
ROBOTS = ("planar_3r", "planar_4r", "seven_joint", "panda")
MANY, SECONDS = 10_000, 2.0

each_case = pytest.mark.parametrize("method", CASES.values(), ids=CASES)
each_method = pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
each_robot = pytest.mark.parametrize("robot", ROBOTS)


def drawn(method, robot, count=50, seed=2):
    return method.draw(robots.load(robot), np.random.default_rng(seed), count)


@each_case
@each_robot
def test_agrees_with_its_original(method, robot):
    """Eq. (6) and the projected gradient written out agree within their bounds, also where shifts make W indefinite."""
    assert agrees(method, robot)


@each_case
def test_fault_sign(method):
    """An original that climbs where the method descends does not agree."""
    right = method.original

    def wrong(robot, q, xdot, **parameters):
        down = right(robot, q, xdot, **parameters)
        return 2 * right(robot, q, xdot, **{**parameters, "alpha": 0.0}) - down  # the other way from alpha = 0

    assert not agrees(replace(method, original=wrong), "panda", count=20)


@each_method
def test_fault_transposed_jacobian(method, monkeypatch):
    """An original that projects by J' in the place of J^+ does not agree."""
    monkeypatch.setattr(np.linalg, "pinv", lambda J: np.swapaxes(J, -1, -2))
    robot = robots.load("planar_4r")
    situation = drawn(gradient_projection.METHOD, "planar_4r", 5)
    wrong = projected(robot, situation.q, situation.xdot, -situation.q)
    monkeypatch.undo()
    assert np.abs(wrong - projected(robot, situation.q, situation.xdot, -situation.q)).max() > 0.1

    def transposing(*arguments, **parameters):
        with monkeypatch.context() as patch:
            patch.setattr(np.linalg, "pinv", lambda J: np.swapaxes(J, -1, -2))
            return method.original(*arguments, **parameters)

    assert not agrees(replace(method, original=transposing), "planar_4r", count=20)


@each_case
@each_robot
def test_drawn_situations_move(method, robot):
    """No situation drawn lies near a stationary point of f on its self-motion, and the parameters are plain."""
    situation = drawn(method, robot)
    problem = method.cast(robots.load(robot), situation.q, situation.xdot, **situation.parameters)
    N = np.linalg.svd(problem.J)[2][:, problem.m :, :]
    along = np.linalg.norm(np.einsum("bkn,bn->bk", N, problem.a), axis=-1)
    assert (along > STATIONARY * np.linalg.norm(problem.a, axis=-1)).all()
    np.testing.assert_array_equal(problem.W.dense(), np.broadcast_to(np.eye(problem.n), problem.W.dense().shape))
    assert not any(isinstance(value, Measure) for value in situation.parameters.values())


RISING = {"manipulability", "log_manipulability", "smallest_singular_value", "kfm", "least_relative_manipulability"}
STEP = 1e-6  # [s]: the change of f along a step is told from its rounding, and from the step's square


@pytest.mark.parametrize("name", CASES)
def test_direction(name):
    """At rest (xdot = 0) alpha > 0 improves the measure: down for costs, up for what is to be kept large (methods 0, I17)."""
    from problems.measures import load

    method, robot = CASES[name], robots.load("panda")
    situation = drawn(method, "panda", 20)
    given = {k: v for k, v in situation.parameters.items() if k in ("joints", "failures")}
    if name == "obstacle_potential":
        given = {"obstacle": obstacle_potential.halfway(robot), "reach": obstacle_potential.REACH}
    f = load("posture" if name == "gradient_projection" else "gravity_torque" if "gravity" in name else name, robot, **given)
    qdot = rates(method, robot, situation.q, np.zeros((20, 6)), **situation.parameters)
    size = STEP / np.linalg.norm(qdot, axis=-1, keepdims=True)
    change = f.value(robot, situation.q + size * qdot) - f.value(robot, situation.q - size * qdot)
    assert (np.sign(change) == (1 if name in RISING else -1)).all()


@each_case
def test_speed(method):
    """J, W and a of 10,000 configurations of the seven-joint Panda within two seconds, once compiled."""
    panda = robots.load("panda")
    some = drawn(method, "panda", 100)
    q, xdot = np.tile(some.q, (MANY // 100, 1)), np.tile(some.xdot, (MANY // 100, 1))
    method.cast(panda, some.q, some.xdot, **some.parameters)
    start = time.perf_counter()
    method.cast(panda, q, xdot, **some.parameters)
    assert time.perf_counter() - start < SECONDS


def sliding():
    """A planar arm, prismatic in its second joint, with mass and limits; task: the tip's position in the plane."""
    model = pin.Model()
    model.name = "sliding"
    model.gravity.linear = np.array([0.0, -9.81, 0.0])
    joint, place = 0, pin.SE3.Identity()
    for i, kind in enumerate((pin.JointModelRZ(), pin.JointModelPX(), pin.JointModelRZ(), pin.JointModelRZ()), start=1):
        joint = model.addJoint(joint, kind, place, f"joint_{i}")
        model.appendBodyToJoint(joint, pin.Inertia(1.0, np.array([0.5, 0.1, 0]), 0.01 * np.eye(3)), pin.SE3.Identity())
        place = pin.SE3(np.eye(3), np.array([0.8, 0.0, 0.0]))
    model.addFrame(pin.Frame("tip", joint, 0, place, pin.FrameType.OP_FRAME))
    model.lowerPositionLimit, model.upperPositionLimit = np.array([-2.5, -0.4, -2.5, -2.5]), np.array([2.5, 0.6, 2.5, 2.5])
    return Robot("sliding", model, "tip", (0, 1))


SLIDING = sliding()
SCALES = np.array([1.0, 0.25, 2.0, 1.5])


@each_case
def test_mixed_units(method):
    """A sliding joint among turning ones is refused without scales; with them framework and original agree, and they count."""
    q, xdot = generic(SLIDING, np.random.default_rng(5), 20)[:2]
    given = method.draw.keywords if isinstance(method.draw, partial) else {}
    with pytest.raises(MixedUnitsError, match="joint 2 slides"):
        method.cast(SLIDING, q, xdot, **given)
    qdot = rates(method, SLIDING, q, xdot, **given, scales=SCALES)
    other = method.original(SLIDING, q, xdot, **given, scales=SCALES)
    size = 1e3 * UNIT * np.linalg.cond(SLIDING.jacobian(q) * SCALES) ** 2 * np.abs(qdot).max(axis=-1)
    assert (np.abs(qdot - other).max(axis=-1) <= size).all()
    unscaled = method.original(SLIDING, q, xdot, **given)
    assert np.abs(unscaled - other).max() > 1e-3


@each_method
@pytest.mark.parametrize("alpha", [np.nan, np.inf])
def test_bad_alpha(method, alpha):
    """An alpha that is not finite is refused by name."""
    robot = robots.load("planar_3r")
    situation = drawn(method, "planar_3r", 2)
    with pytest.raises(NonFiniteError, match="alpha"):
        method.cast(robot, situation.q, situation.xdot, **{**situation.parameters, "alpha": alpha})


@pytest.mark.parametrize("module", [joint_limit_gradient, manipulability_gradient, fault_tolerance, free_swinging])
def test_unknown_measure(module):
    """A measure that the method does not follow is refused with those it does."""
    with pytest.raises(UnknownNameError, match="posture"):
        module.METHOD.cast(robots.load("planar_3r"), np.ones((1, 3)), np.ones((1, 2)), measure="posture")


@each_method
def test_wrong_shapes(method):
    """Configurations and task velocities of another robot are refused by their shapes."""
    robot = robots.load("planar_3r")
    situation = drawn(method, "planar_3r", 2)
    for q, xdot in ((np.ones((2, 4)), situation.xdot), (situation.q, np.ones((2, 3)))):
        with pytest.raises(ShapeError):
            method.cast(robot, q, xdot, **situation.parameters)


@each_method
@pytest.mark.parametrize("scales", [[1, 1], [1, 0, 1], [1, np.inf, 1]], ids=str)
def test_bad_scales(method, scales):
    """Scales that are not one positive number per joint are refused."""
    robot = robots.load("planar_3r")
    situation = drawn(method, "planar_3r", 2)
    with pytest.raises(RangeError, match="scales"):
        method.cast(robot, situation.q, situation.xdot, **situation.parameters, scales=scales)


def test_chain_robot():
    """A robot in space whose second joint slides agrees too, every measure that needs no more redundancy."""
    q, xdot = generic(chain.MIXED, np.random.default_rng(6), 20)[:2]
    for name in ("swing_torque", "swing_acceleration", "swing_angle"):
        qdot = rates(free_swinging.METHOD, chain.MIXED, q, xdot, measure=name, scales=SCALES)
        other = free_swinging.METHOD.original(chain.MIXED, q, xdot, measure=name, scales=SCALES)
        size = 1e3 * UNIT * np.linalg.cond(chain.MIXED.jacobian(q) * SCALES) ** 2 * np.abs(qdot).max(axis=-1)
        assert (np.abs(qdot - other).max(axis=-1) <= size).all()
