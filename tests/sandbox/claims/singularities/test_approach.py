"""Ways through singularities."""

from __future__ import annotations

import numpy as np
import pytest

from problems import robots
from sandbox.claims.claim import Trial
from sandbox.claims.singularities import approach
from sandbox.errors import EmptyPlanError
from sandbox.tolerances import ORIGINAL, ROBOT_RANK, UNIT

TRIAL = Trial(full=False)
ROUNDING = ORIGINAL * 7 * UNIT


@pytest.mark.parametrize("turn", [0.0, approach.TURN])
def test_the_hand_of_the_stretching_arm_moves_on_a_ray(turn: float) -> None:
    """It is 1 + 2 cos t from the base in one direction, and J loses its rank at t = 0 alone."""
    one = approach.stretching(turn)
    t = np.array([-0.5, 0.0, 1e-3, 0.5])
    hand = one.robot.forward(one.q(t))[0][:, :2]
    assert np.abs(hand - (1 + 2 * np.cos(t))[:, None] * one.lost).max() <= ROUNDING
    sigma = approach.singular_values(one.robot.jacobian(one.q(t)))[1][:, -1]
    assert sigma[1] <= ROUNDING and (sigma[[0, 2, 3]] > 1e-4).all()


@pytest.mark.parametrize("name", approach.NAMES)
def test_an_approach_crosses_a_singularity(name: str) -> None:
    """J has lost its rank at t = 0; xdot has its speed and its share in the lost direction; sigma is proportional to t."""
    one = approach.approach(robots.load(name), TRIAL.rng(name))
    u, sigma, _ = approach.singular_values(one.robot.jacobian(one.q(np.array([0.0, 1e-5, 1e-4]))))
    assert sigma[0, -1] <= ROBOT_RANK * sigma[0, 0]
    assert abs(u[0] @ one.lost) == pytest.approx(1)
    assert np.linalg.norm(one.xdot) == pytest.approx(approach.SPEED)
    assert one.lost @ one.xdot == pytest.approx(approach.ALONG * approach.SPEED)
    assert sigma[2, -1] / sigma[1, -1] == pytest.approx(10, rel=approach.CLOSE)


def test_a_robot_of_which_no_line_crosses_a_singularity_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is said after so many attempts, not searched for for ever."""
    monkeypatch.setattr(approach, "ATTEMPTS", 0)
    with pytest.raises(EmptyPlanError, match="planar_3r"):
        approach.approach(robots.load("planar_3r"), TRIAL.rng("none"))
