"""M5: singularity avoidance."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from problems.methods import manipulability_gradient as module
from problems.methods.manipulability_gradient import METHOD
from problems.robots.planar import PLANAR_3R
from problems.sets import textbook
from sandbox.errors import RankDeficientError
from sandbox.law import rates
from sandbox.tolerances import UNIT
from tests.problems.methods.agreeing import agrees

F1, F1B = np.array(textbook.F1.q)[None], np.array(textbook.F1B.q)[None]
REST = np.zeros((1, 2))
ROUNDING = 64 * UNIT


def both(q, **parameters):
    return rates(METHOD, PLANAR_3R, q, REST, **parameters)[0], METHOD.original(PLANAR_3R, q, REST, **parameters)[0]


def test_f1b():
    """F1b, f = -w, alpha = 1, at rest: qdot = (2/(5 sqrt5)) n = (0, -.178885438, .357770876)."""
    for qdot in both(F1B, alpha=1.0):
        np.testing.assert_allclose(qdot, 2 / (5 * 5**0.5) * np.array([0, -1, 2]), atol=ROUNDING)


def test_f1_is_stationary():
    """F1 is a stationary point of w: no self-motion."""
    for qdot in both(F1, alpha=1.0):
        np.testing.assert_allclose(qdot, np.zeros(3), atol=ROUNDING)


def test_smallest_singular_value():
    """F1b by sigma_min: qdot is the projection of the printed gradient (0, .162459848116, .235114100917)."""
    n = np.array([0, -1.0, 2])
    expected = n * (n @ [0, 0.162459848116, 0.235114100917]) / 5
    for qdot in both(F1B, alpha=1.0, measure="smallest_singular_value"):
        np.testing.assert_allclose(qdot, expected, atol=1e-12)


@pytest.mark.parametrize("measure", module.CHOICES)
def test_singular(measure):
    """At a singularity the cast is refused, and the singular values are the evidence."""
    with pytest.raises(RankDeficientError) as caught:
        METHOD.cast(PLANAR_3R, np.zeros((1, 3)), REST, measure=measure)
    assert "singular_values" in caught.value.evidence


@pytest.mark.parametrize("measure", ["manipulability", "log_manipulability"])
def test_fault_factor_w(measure, monkeypatch):
    """The gradient of w without its factor w, or ln w's with it, does not agree."""
    other = {"manipulability": "log_manipulability", "log_manipulability": "manipulability"}[measure]
    wrong = {**module.CHOICES, measure: module.CHOICES[other]}
    method = replace(METHOD, draw=partial(module.draw, measure=measure))
    assert agrees(method, "planar_3r", count=20)
    monkeypatch.setattr(module, "CHOICES", wrong)
    assert not agrees(method, "planar_3r", count=20)


def test_fault_misread_derivative():
    """The kinematic Hessian's column-major numbers read row by row do not agree."""

    class Misread:
        def __init__(self, robot):
            self.robot, self.n, self.m = robot, robot.n, robot.m

        def jacobian(self, q):
            return self.robot.jacobian(q)

        def jacobian_derivative(self, q):
            right = np.moveaxis(self.robot.jacobian_derivative(q), -3, -1)  # [row, i, k]
            wrong = np.stack([one.ravel(order="F").reshape(one.shape) for one in right])
            return np.moveaxis(wrong, -1, -3)

    wrong = replace(METHOD, original=lambda robot, *a, **k: METHOD.original(Misread(robot), *a, **k))
    assert not agrees(wrong, "panda", count=20)
