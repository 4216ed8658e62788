"""What the claims about singularities compute for themselves: ways through them, and the least load of exact rates."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog

from problems import robots
from sandbox.claims import singularities
from sandbox.claims.claim import Trial
from sandbox.closed_form.eq6 import eq6
from sandbox.closed_form.eq13 import eq13
from sandbox.errors import EmptyPlanError
from sandbox.law import rates
from sandbox.problem import VelocityProblem
from sandbox.tolerances import LINEAR_PROGRAM, ORIGINAL, ROBOT_RANK, UNIT

TRIAL = Trial(full=False)
ROUNDING = ORIGINAL * 7 * UNIT


@pytest.mark.parametrize("turn", [0.0, singularities.TURN])
def test_the_hand_of_the_stretching_arm_moves_on_a_ray(turn: float) -> None:
    """It is 1 + 2 cos t from the base in one direction, and J loses its rank at t = 0 alone."""
    one = singularities.stretching(turn)
    t = np.array([-0.5, 0.0, 1e-3, 0.5])
    hand = one.robot.forward(one.q(t))[0][:, :2]
    assert np.abs(hand - (1 + 2 * np.cos(t))[:, None] * one.lost).max() <= ROUNDING
    sigma = singularities.singular_values(one.robot.jacobian(one.q(t)))[1][:, -1]
    assert sigma[1] <= ROUNDING and (sigma[[0, 2, 3]] > 1e-4).all()


@pytest.mark.parametrize("name", singularities.ARMS)
def test_an_approach_crosses_a_singularity(name: str) -> None:
    """J has lost its rank at t = 0; xdot has its speed and its share in the lost direction; sigma is proportional to t."""
    one = singularities.approach(robots.load(name), TRIAL.rng(name))
    u, sigma, _ = singularities.singular_values(one.robot.jacobian(one.q(np.array([0.0, 1e-5, 1e-4]))))
    assert sigma[0, -1] <= ROBOT_RANK * sigma[0, 0]
    assert abs(u[0] @ one.lost) == pytest.approx(1)
    assert np.linalg.norm(one.xdot) == pytest.approx(singularities.SPEED)
    assert one.lost @ one.xdot == pytest.approx(singularities.ALONG * singularities.SPEED)
    assert sigma[2, -1] / sigma[1, -1] == pytest.approx(10, rel=singularities.CLOSE)


def test_a_robot_of_which_no_line_crosses_a_singularity_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is said after so many attempts, not searched for for ever."""
    monkeypatch.setattr(singularities, "ATTEMPTS", 0)
    with pytest.raises(EmptyPlanError, match="planar_3r"):
        singularities.approach(robots.load("planar_3r"), TRIAL.rng("none"))


def test_the_least_load_is_that_of_a_linear_programme() -> None:
    """q1 + q2 = 1 with limits 1 and 3: both joints at a quarter of their limits; 0 qdot = 1: nothing."""
    limits = np.array([1.0, 3.0])
    assert singularities.least_load(linprog, np.ones((1, 2)), np.ones(1), limits) == pytest.approx(0.25, abs=LINEAR_PROGRAM)
    assert singularities.least_load(linprog, np.zeros((1, 2)), np.ones(1), limits) == np.inf


def test_no_exact_rates_have_a_lower_load() -> None:
    """Along the self-motion of the bent planar 3R, to either side."""
    J, limits = robots.load("planar_3r").jacobian(singularities.BENT), np.array([1.0, 2.0, 3.0])
    least = singularities.least_load(linprog, J, np.ones(2), limits)
    moves = np.linspace(-3, 3, 2001)[:, None] * np.array([-1.0, 1.0, 1.0]) + np.linalg.pinv(J) @ np.ones(2)
    loads = np.abs(moves / limits).max(axis=1)
    assert loads.min() >= least - LINEAR_PROGRAM
    assert loads.min() <= least + 6 / 2000


def test_the_share_of_unrealizable_directions_is_counted_one_by_one() -> None:
    """By the rates of each direction, solved for itself."""
    one = singularities.approach(robots.load("planar_3r"), TRIAL.rng("share"))
    t = np.array([0.3, 0.05, 1e-3])
    share = singularities.unrealizable(one, t, np.random.default_rng(4), eq6, 40)
    directions = np.random.default_rng(4).standard_normal((40, 2))
    directions *= singularities.SPEED / np.linalg.norm(directions, axis=1)[:, None]
    over = [(np.abs(eq6(one.problem(t, xdot=row)).x) > one.robot.rate_limits).any(axis=1) for row in directions]
    assert share == pytest.approx(np.mean(over, axis=0))
    assert share[-1] > share[0]


def test_rank_tolerances_are_compared_with_the_scaled_singular_values() -> None:
    """Eq. (13) drops the small singular value just where the tolerance passes the share that is drawn in the plot."""
    one = singularities.stretching(singularities.TURN)
    problem = one.problem(np.array([1e-5]))
    share = float(singularities.relative_sigma(problem.J)[0])
    kept, dropped = (eq13(problem, rank_tolerance=factor * share).x[0] for factor in (1 - 1e-6, 1 + 1e-6))
    assert np.linalg.norm(kept) > 1e3 * np.linalg.norm(dropped)


def test_a_passage_tells_what_leaves_the_path() -> None:
    """A hand at half speed has half the task error, and none aside; one that turns away by 3:4:5 has 0.8 aside."""
    one = singularities.stretching()
    problem = VelocityProblem(J=np.eye(2, 3)[None].repeat(2, 0), xdot=[[1.0, 0.0], [1.0, 0.0]], W=np.eye(3))
    by = {"some": np.array([[0.5, 0.0, 9.0], [0.6, 0.8, 0.0]])}
    way = singularities.Passage("some way", one, np.zeros(2), problem, np.ones((2, 2)), by, np.ones(2), np.ones(2))
    assert way.missed("some") == pytest.approx([0.5, np.hypot(0.4, 0.8)])
    assert way.aside("some") == pytest.approx([0.0, 0.8])
    assert way.load("some") == pytest.approx(np.array([9.0, 0.8]) / one.robot.rate_limits.min())


def test_the_scaled_hand_comes_to_the_full_stretch() -> None:
    """Its joints run at their limits there, so it takes longer than asked for, and arrives."""
    (check,), plot = singularities._time_to_stretch(rates)
    scaled, asked = plot.series
    assert check.holds
    assert np.max(scaled.x) > np.max(asked.x)
    assert (np.diff(scaled.x) > 0).all() and scaled.y[-1] < 1e-3 * scaled.y[0]
