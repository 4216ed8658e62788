"""M4: weighted least norm for joint limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from problems.measures.measure import OutsideDomainError
from problems.methods.weighted_least_norm import METHOD
from problems.robots.planar import PLANAR_3R
from problems.sets import textbook
from sandbox.errors import RangeError
from sandbox.law import rates
from sandbox.problem import VelocityProblem
from sandbox.tolerances import UNIT
from tests.problems.methods.agreeing import agrees

F1 = np.array(textbook.F1.q)[None]
UPPER = np.array([np.pi, np.pi, 2 * np.pi])
PRINTED = 1e-12  # twelve digits
ROBOTS = ("planar_3r", "planar_4r", "seven_joint", "panda")


def test_f1():
    """F1, limits +-(pi, pi, 2 pi), all joints approaching, xdot = (1, 1): the published twelve digits."""
    for law in (METHOD.original, lambda *x, **p: rates(METHOD, *x, **p)):
        qdot = law(PLANAR_3R, F1, np.ones((1, 2)), lower=-UPPER, upper=UPPER)
        np.testing.assert_allclose(qdot[0], [0.168251391478, -1.168251391478, 1.831748608522], atol=PRINTED)


@pytest.mark.parametrize("robot", ROBOTS)
def test_agrees_with_its_original(robot):
    """Eq. (6) and the scaled-joint form agree within their bounds, directions drawn at random, also after the shifts."""
    assert agrees(METHOD, robot)


def test_agrees_without_directions():
    """So they do where every joint counts as approaching, where all stood still before, and where a joint has no limit."""
    q = np.random.default_rng(1).uniform(-2, 2, (20, 3))
    xdot = np.ones((20, 2))
    for options in ({}, {"qdot_previous": np.zeros(3)}, {"upper": [2.5, np.inf, 2.5]}):
        np.testing.assert_allclose(
            rates(METHOD, PLANAR_3R, q, xdot, **options), METHOD.original(PLANAR_3R, q, xdot, **options),
            rtol=0, atol=1e5 * UNIT * np.linalg.cond(PLANAR_3R.jacobian(q)).max(),
        )  # fmt: skip


def test_the_answer_depends_on_the_direction_of_motion():
    """The law is not odd: turned round, qdot(-xdot) with the rates before it turned is not -qdot(xdot)."""
    q, xdot, before = np.array([[2.0, -2.0, 1.5]]), np.array([[0.3, -0.7]]), np.array([[1.0, 1.0, 1.0]])
    there = rates(METHOD, PLANAR_3R, q, xdot, qdot_previous=before)
    back = rates(METHOD, PLANAR_3R, q, -xdot, qdot_previous=-before)
    assert np.abs(there + back).max() > 0.01
    np.testing.assert_array_equal(rates(METHOD, PLANAR_3R, q, -xdot, qdot_previous=before), -there)


def test_at_a_limit_refused():
    """A joint at or over its limit is refused; so are limits in the wrong order."""
    for value in (2.75, 2.8):
        with pytest.raises(OutsideDomainError, match="joint 2"):
            METHOD.cast(PLANAR_3R, np.array([[0.1, value, 0.3]]), np.ones((1, 2)))
    with pytest.raises(RangeError):
        METHOD.cast(PLANAR_3R, F1, np.ones((1, 2)), lower=UPPER, upper=-UPPER)


def wrong_sign(robot, q, xdot, *, qdot_previous):
    """The derivative of 1/u + 1/v as -u^-2 - v^-2."""
    u, v, quarter = robot.upper - q, q - robot.lower, (robot.upper - robot.lower) / 4
    slope = quarter * (-(u**-2) - v**-2)
    size = np.where(slope * qdot_previous >= 0, np.abs(slope), 0.0)
    return VelocityProblem(J=robot.jacobian(q), xdot=xdot, W=(1 + size)[..., None] * np.eye(robot.n))


def every_joint(robot, q, xdot, *, qdot_previous):
    return METHOD.cast(robot, q, xdot)


def leaving(robot, q, xdot, *, qdot_previous):
    return METHOD.cast(robot, q, xdot, qdot_previous=-qdot_previous)


def root(robot, q, xdot, *, qdot_previous):
    problem = METHOD.cast(robot, q, xdot, qdot_previous=qdot_previous)
    return VelocityProblem(J=problem.J, xdot=xdot, W=np.sqrt(problem.W.dense()))


@pytest.mark.parametrize("cast", [wrong_sign, every_joint, leaving, root])
@pytest.mark.parametrize("robot", ["planar_3r", "panda"])
def test_a_wrong_weight_disagrees(robot, cast):
    """The wrong sign of the barrier's slope, no rule of direction, its reverse, or W^1/2 for W: none agrees."""
    assert not agrees(replace(METHOD, cast=cast), robot, 20)
