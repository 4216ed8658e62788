"""M9: tolerance of locked joints."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from problems import robots
from problems.measures.fault_tolerance import TooManyFailuresError
from problems.measures.measure import NotDifferentiableError, OutsideDomainError
from problems.methods import fault_tolerance as module
from problems.methods.fault_tolerance import METHOD
from problems.original import fault_tolerance as witness
from problems.robots.planar import PLANAR_3R
from problems.sets import textbook
from sandbox.errors import RankDeficientError
from tests.problems.methods.agreeing import agrees

F1, F1B = np.array(textbook.F1.q)[None], np.array(textbook.F1B.q)[None]
REST = np.zeros((1, 2))


@pytest.mark.parametrize("measure", module.CHOICES)
def test_two_failures(measure):
    """Framework and determinant ratios agree for two joints locked at once too."""
    method = replace(METHOD, draw=partial(module.draw, measure=measure, failures=2))
    assert agrees(method, "planar_4r")


def test_elbow_is_left_out():
    """Situations of the spherical-revolute-spherical arm leave out its elbow, which self-motion never moves."""
    drawn = METHOD.draw(robots.load("seven_joint"), np.random.default_rng(0), 5)
    assert drawn.parameters["joints"] == [1, 2, 3, 5, 6, 7]
    with pytest.raises(OutsideDomainError, match="joint 4"):
        METHOD.cast(robots.load("seven_joint"), drawn.q, drawn.xdot)


@pytest.mark.parametrize(
    "measure, error",
    [
        ("fault_tolerance", OutsideDomainError),
        ("least_relative_manipulability", NotDifferentiableError),
        ("kfm", RankDeficientError),
    ],
)
def test_failure_that_costs_the_task(measure, error):
    """At F1b joint 1 takes no part in self-motion: rho_1 = 0 has no gradient."""
    with pytest.raises(error):
        METHOD.cast(PLANAR_3R, F1B, REST, measure=measure)


def test_too_many_failures():
    """More failures than degrees of redundancy are refused."""
    with pytest.raises(TooManyFailuresError):
        METHOD.cast(PLANAR_3R, F1, REST, failures=2)


@pytest.mark.parametrize("measure", module.CHOICES)
def test_fault_one_joint_forgotten(measure, monkeypatch):
    """An original that forgets the failures of all joints but the first two does not agree."""
    method = replace(METHOD, draw=partial(module.draw, measure=measure))
    assert agrees(method, "panda", count=20)
    right = witness.original

    def wrong(*arguments, joints, **parameters):
        return right(*arguments, joints=joints[:2], **parameters)

    assert not agrees(replace(method, original=wrong), "panda", count=50)


def test_fault_volume_of_the_whole():
    """The slope of ln w(^SJ) without - ln w(J) does not agree."""

    def wrong(*arguments, **parameters):
        with pytest.MonkeyPatch.context() as patch:
            whole = witness._slope
            patch.setattr(witness, "_slope", lambda J, dJ: whole(J, dJ) * (J.shape[-1] < 7))
            return METHOD.original(*arguments, **parameters)

    assert not agrees(replace(METHOD, original=wrong), "panda", count=20)
