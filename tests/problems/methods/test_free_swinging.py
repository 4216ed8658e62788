"""M10: preparing for free-swinging failures."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from problems import robots
from problems.measures.measure import NotDifferentiableError, OutsideDomainError
from problems.methods import free_swinging as module
from problems.methods.free_swinging import METHOD
from problems.original import free_swinging as witness
from problems.robots.planar import PLANAR_3R
from problems.sets import textbook
from sandbox.law import rates
from sandbox.tolerances import UNIT
from tests.problems.methods.agreeing import agrees

F1, F1B = np.array(textbook.F1.q)[None], np.array(textbook.F1B.q)[None]
REST = np.zeros((1, 2))


def variant(measure):
    return replace(METHOD, draw=partial(module.draw, measure=measure))


@pytest.mark.parametrize("measure", module.CHOICES)
def test_weights(measure):
    """Weights count, and count alike in framework and original."""
    panda, weights = robots.load("panda"), np.array([0, 2.0, 0, 1, 0.5, 0, 3])
    drawn = METHOD.draw(panda, np.random.default_rng(1), 20)
    given = {"measure": measure, "weights": weights}
    found, other = (law(panda, drawn.q, drawn.xdot, **given) for law in (partial(rates, METHOD), METHOD.original))
    np.testing.assert_allclose(found, other, rtol=0, atol=1e-11 * np.abs(other).max())
    plain = rates(METHOD, panda, drawn.q, drawn.xdot, measure=measure)
    assert np.abs(plain - found).max() > 1e-4


def test_planar_derivative():
    """On planar arms d theta_i/dq_j = -(a d_j b - b d_j a)/(a^2 + b^2), (a, b) from joint i to what it carries; -1, j <= i."""
    q = np.random.default_rng(2).uniform(-2, 2, (10, 3))
    _, slope = witness._angles(PLANAR_3R, q)
    for i in range(3):
        masses, ends = 3 - i, [PLANAR_3R.point(q, j, (1.0, 0, 0)) for j in (1, 2, 3)]
        centre = sum(ends[i:]) / masses - PLANAR_3R.point(q, i + 1)
        a, b = centre[:, 0], centre[:, 1]
        np.testing.assert_allclose(slope[:, i, : i + 1], -1, rtol=64 * UNIT)
        for j in range(i + 1, 3):
            moved = sum(PLANAR_3R.point_jacobian(q, b + 1, (1.0, 0, 0))[:, :3, j] for b in range(j, 3)) / masses
            expected = -(a * moved[:, 1] - b * moved[:, 0]) / (a**2 + b**2)
            np.testing.assert_allclose(slope[:, i, j], expected, rtol=1e-12, atol=1e-13)


def test_refusals():
    """Upright joints and, with a weight, axes parallel to gravity are refused for the angle."""
    with pytest.raises(NotDifferentiableError, match="upright"):
        METHOD.cast(PLANAR_3R, F1B, REST, measure="swing_angle")
    panda = robots.load("panda")
    with pytest.raises(OutsideDomainError, match=r"joint 1 .*parallel to gravity"):
        METHOD.cast(panda, np.full((1, 7), 0.4), np.zeros((1, 6)), measure="swing_angle", weights=np.ones(7))


def test_fault_inertia_held_fixed(monkeypatch):
    """An acceleration whose M_ii is not differentiated does not agree."""
    assert agrees(variant("swing_acceleration"), "panda", count=20)
    monkeypatch.setattr(witness, "_inertia_slopes", lambda robot, q: np.zeros((*q.shape, robot.n)))
    assert not agrees(variant("swing_acceleration"), "panda", count=20)


def test_fault_angle_from_the_wrong_side(monkeypatch):
    """Angles from gravity to the centre of mass, the derivative's sign kept, do not agree."""
    right = witness._angles
    assert agrees(variant("swing_angle"), "panda", count=20)
    monkeypatch.setattr(witness, "_angles", lambda robot, q: (-right(robot, q)[0], right(robot, q)[1]))
    assert not agrees(variant("swing_angle"), "panda", count=20)


def test_fault_unwrapped_angle(monkeypatch):
    """Angles within [0, 2 pi) in the place of (-pi, pi] do not agree."""
    right = witness._angles
    monkeypatch.setattr(witness, "_angles", lambda robot, q: (right(robot, q)[0] % (2 * np.pi), right(robot, q)[1]))
    assert not agrees(variant("swing_angle"), "planar_3r", count=20)


def test_fault_only_the_joint_itself(monkeypatch):
    """An angle whose derivative by the other joints is forgotten does not agree."""
    right = witness._angles
    monkeypatch.setattr(witness, "_angles", lambda robot, q: (right(robot, q)[0], right(robot, q)[1] * np.eye(robot.n)))
    assert not agrees(variant("swing_angle"), "planar_3r", count=20)
