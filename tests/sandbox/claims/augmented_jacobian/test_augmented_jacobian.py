"""Cases by hand, and the planted sign of alpha."""

from __future__ import annotations

import numpy as np
import pytest

from problems import robots
from sandbox.claims.augmented_jacobian.augmented_jacobian import AUGMENTED, printed_cases, turned_alpha
from sandbox.claims.postures import F1, HAND_ANGLE, J1
from sandbox.law import rates
from sandbox.tolerances import ORIGINAL, UNIT


@pytest.mark.parametrize("case", printed_cases(), ids=lambda case: case.robot + str(len(case.name)))
def test_the_cases_by_hand_meet_task_and_functions(case):
    """Each expected answer satisfies J qdot = xdot and E qdot = gbar to rounding: it is the one solution of [J; E]."""
    rows = np.concatenate([robots.load(case.robot).jacobian(case.q), case.E])
    asked = np.array([*case.xdot, *case.gbar])
    assert np.abs(rows @ np.array(case.expected) - asked).max() <= ORIGINAL * rows.shape[1] * UNIT * np.linalg.norm(rows)
    assert np.linalg.matrix_rank(rows) == len(rows)


def test_the_planted_alpha_turns_the_desired_rate():
    """The fault of the first claim gives E qdot = -gbar and leaves the task alone."""
    xdot, gbar = np.array([[0.3, -0.7]]), np.array([0.9])
    wrong = turned_alpha(rates)(AUGMENTED, robots.load("planar_3r"), F1[None], xdot, E=HAND_ANGLE, gbar=gbar)[0]
    np.testing.assert_allclose(np.vstack([J1, HAND_ANGLE]) @ wrong, [0.3, -0.7, -0.9], atol=1e-14)
