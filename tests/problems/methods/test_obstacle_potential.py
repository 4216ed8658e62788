"""M7: an obstacle's potential."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from problems import robots
from problems.measures.obstacle import ContactError, nearest
from problems.methods.obstacle_potential import METHOD, REACH, halfway
from problems.robots.planar import PLANAR_3R
from problems.sets import textbook
from sandbox.errors import RangeError
from sandbox.law import rates
from tests.problems.methods.agreeing import agrees

F1 = np.array(textbook.F1.q)[None]
REST = np.zeros((1, 2))
GIVEN = {"obstacle": (1.0, 1.4, 0.0), "reach": 0.5, "stiffness": 100.0, "points": [(2, (1.0, 0.0, 0.0))]}
ROUNDING = 1e-13


def test_f1():
    """F1, end of link 2 under (1, 1.4), alpha = .01, at rest: qdot = (-1, 1, 1)/30, and the distance grows at 1/30 m/s."""
    found = rates(METHOD, PLANAR_3R, F1, REST, **GIVEN, alpha=0.01), METHOD.original(PLANAR_3R, F1, REST, **GIVEN, alpha=0.01)
    for qdot in found:
        np.testing.assert_allclose(qdot[0], np.array([-1, 1, 1]) / 30, atol=ROUNDING)
        point = PLANAR_3R.point_jacobian(F1[0], 2, (1.0, 0, 0))[:3] @ qdot[0]
        assert abs(-point[1] - 1 / 30) < ROUNDING  # away from the obstacle is down


def test_out_of_reach():
    """An obstacle out of reach leaves the pseudoinverse's motion."""
    far = {**GIVEN, "obstacle": (9.0, 9.0, 0.0)}
    qdot = rates(METHOD, PLANAR_3R, F1, np.ones((1, 2)), **far)[0]
    np.testing.assert_allclose(qdot, [1 / 3, -4 / 3, 5 / 3], atol=ROUNDING)


@pytest.mark.parametrize("name", ["planar_3r", "planar_4r", "seven_joint", "panda"])
def test_situations(name):
    """Drawn situations feel the default obstacle, with one critical point clearly nearest."""
    robot = robots.load(name)
    q = METHOD.draw(robot, np.random.default_rng(0), 50).q
    assert METHOD.cast(robot, q, np.zeros((50, robot.m))).a.any(axis=-1).all()
    assert (nearest(robot, q, halfway(robot))[1] > 1e-4).all()
    assert REACH > 0


def test_fault_towards_the_obstacle():
    """An original that pushes the furthest point, or forgets the depth d0 - d, does not agree."""

    class Wrong:
        def __init__(self, robot):
            self.robot = robot

        def __getattr__(self, name):
            return getattr(self.robot, name)

        def point(self, q, joint, offset):
            return self.robot.point(q, joint, np.asarray(offset) * 0.9)

    wrong = replace(METHOD, original=lambda robot, *a, **k: METHOD.original(Wrong(robot), *a, **k))
    assert not agrees(wrong, "planar_4r", count=20)
    deeper = replace(METHOD, original=lambda *a, **k: METHOD.original(*a, **k, reach=0.6))
    assert not agrees(deeper, "planar_4r", count=20)


def test_refusals():
    """Contact, d0 <= 0 and a critical point that is not on the arm are refused."""
    with pytest.raises(ContactError, match="link 2"):
        METHOD.cast(PLANAR_3R, F1, REST, **{**GIVEN, "obstacle": (1.0, 1.0, 0.0)})
    with pytest.raises(RangeError, match="reach"):
        METHOD.cast(PLANAR_3R, F1, REST, **{**GIVEN, "reach": 0.0})
    with pytest.raises(RangeError, match="not on the arm"):
        METHOD.cast(PLANAR_3R, F1, REST, **{**GIVEN, "points": [(7, (0.0, 0.0, 0.0))]})
