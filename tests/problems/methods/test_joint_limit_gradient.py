"""M3: joint limits by a gradient."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from problems.measures.measure import OutsideDomainError
from problems.methods.joint_limit_gradient import METHOD, draw
from problems.original.gradient_projection import projected
from problems.robots.planar import PLANAR_3R
from problems.sets import textbook
from sandbox.errors import RangeError
from sandbox.law import rates
from sandbox.tolerances import UNIT
from tests.problems.methods.agreeing import agrees

F1 = np.array(textbook.F1.q)[None]
REST = np.zeros((1, 2))
LIMITS = np.array([np.pi, np.pi, 2 * np.pi])
NULL = np.array([-1.0, 1, 1])
ROUNDING = 64 * UNIT


def test_f1():
    """F1, limits (pi, pi, 2 pi), alpha = 1, at rest: qdot = -n/(12 pi), and H falls at .00211086 per second."""
    given = {"alpha": 1.0, "lower": -LIMITS, "upper": LIMITS}
    for qdot in (rates(METHOD, PLANAR_3R, F1, REST, **given)[0], METHOD.original(PLANAR_3R, F1, REST, **given)[0]):
        np.testing.assert_allclose(qdot, -NULL / (12 * np.pi), atol=ROUNDING)
        np.testing.assert_allclose(qdot[0], 0.0265258, atol=5e-8)
        assert abs(qdot @ [0, 1 / (3 * np.pi), -1 / (12 * np.pi)] + 0.00211086) < 5e-9


@pytest.mark.parametrize("measure", ["joint_limits_quadratic", "joint_limits_p_norm", "joint_limits_barrier"])
def test_unlimited_joint(measure):
    """A joint without limits is left to the others, in framework and original alike."""
    q = F1 + np.array([0.2, 5.0, 0.3])
    given = {"measure": measure, "lower": -LIMITS, "upper": LIMITS * [1, np.inf, 1]}
    found = rates(METHOD, PLANAR_3R, q, REST, **given)
    np.testing.assert_allclose(found, METHOD.original(PLANAR_3R, q, REST, **given), atol=ROUNDING)
    assert np.abs(found).max() > 1e-5


def test_barrier_outside():
    """With the barrier a joint outside its limits stops the cast: no absolute value is taken."""
    with pytest.raises(OutsideDomainError, match="joint 2"):
        METHOD.cast(PLANAR_3R, np.array([[0.0, 2.8, 0.0]]), REST, measure="joint_limits_barrier")


def test_refusals():
    """Limits in the wrong order and an infinite limit with a weight are refused."""
    with pytest.raises(RangeError, match="joint 1"):
        METHOD.cast(PLANAR_3R, F1, REST, lower=LIMITS, upper=-LIMITS)
    with pytest.raises(RangeError, match="joint 3"):
        METHOD.cast(PLANAR_3R, F1, REST, upper=[1, 1, np.inf], weights=np.ones(3))


def test_fault_published_sign_of_the_barrier():
    """The derivative -1/u^2 - 1/v^2 of 1/u + 1/v that public code carries, u = qmax - q, v = q - qmin, does not agree."""

    def barrier_of(sign):
        def original(robot, q, xdot, *, alpha=0.5, measure):
            u, v = robot.upper - q, q - robot.lower
            slope = (robot.upper - robot.lower) / 4 * (sign / u**2 - 1 / v**2)
            return projected(robot, q, xdot, -alpha * slope)

        return replace(METHOD, original=original, draw=lambda *a: draw(*a, measure="joint_limits_barrier"))

    assert agrees(barrier_of(+1), "planar_4r", count=20)
    assert not agrees(barrier_of(-1), "planar_4r", count=20)


def test_fault_forgotten_mean():
    """The quadratic's gradient without its 1/n does not agree."""

    def original(robot, q, xdot, *, alpha=0.5, measure):
        half = (robot.upper - robot.lower) / 2
        return projected(robot, q, xdot, -alpha * 2 * (q - (robot.upper + robot.lower) / 2) / half**2)

    assert not agrees(replace(METHOD, original=original), "panda", count=20)
