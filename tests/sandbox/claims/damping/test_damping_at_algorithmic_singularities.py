"""The bound of damped rates, and the path through the singularity."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from problems import robots
from sandbox.claims.augmented_jacobian.method import AUGMENTED
from sandbox.claims.damping.damping_at_algorithmic_singularities import DAMPED, REACHED, everything_damped, rate_bound, thinned
from sandbox.claims.damping.damping_reduces_task_errors import base_forgotten
from sandbox.claims.postures import F1, HAND_ANGLE, J1
from sandbox.law import rates


@pytest.mark.parametrize("base, share", [(1 / 3, 1.0), (0.01, 0.9), (3.0, 0.999)])
def test_the_bound_of_damped_rates_is_reached(base, share):
    """At F1 s = e'n is 1/sqrt 3: the rates stay below the bound, and reach it for W~ = s^2 I."""
    robot, xdot = robots.load("planar_3r"), np.array([[0.3, -0.7], [-1.0, 0.4]])
    q = np.repeat(F1[None], 2, axis=0)
    speed = np.linalg.norm(rates(DAMPED, robot, q, xdot, E=HAND_ANGLE, base=base), axis=-1)
    bound = rate_bound(SimpleNamespace(q=q, xdot=xdot), robot, base)
    assert (speed <= bound * (1 + 1e-12)).all()
    assert speed == pytest.approx(bound, rel=1e-12) if share == 1 else (speed < bound).all()


def test_where_the_hand_cannot_go_on():
    """At 2 - sqrt 2 m along (1, 1) the wrist, one link behind the hand, is at the full reach of two."""
    hand = np.array([2.0, 1.0]) + REACHED * np.ones(2) / np.sqrt(2)
    assert np.linalg.norm(hand - [1.0, 0.0]) == pytest.approx(2.0, rel=1e-15)


def test_damping_everything_gives_up_the_task():
    """Damped least squares on [J; E] moves the hand otherwise than asked; W~ left out is the undamped law."""
    robot, q, xdot = robots.load("planar_3r"), F1[None], np.array([[0.3, -0.7]])
    wrong = everything_damped(rates)(DAMPED, robot, q, xdot, E=HAND_ANGLE, base=0.01)
    assert np.abs(J1 @ wrong[0] - xdot).max() > 1e-3
    np.testing.assert_allclose(J1 @ rates(DAMPED, robot, q, xdot, E=HAND_ANGLE, base=0.01)[0], xdot[0], atol=1e-15)
    bare = base_forgotten(rates)(DAMPED, robot, q, xdot, E=HAND_ANGLE, base=0.01)
    np.testing.assert_array_equal(bare, rates(AUGMENTED, robot, q, xdot, E=HAND_ANGLE))


def test_a_thinned_curve_keeps_its_ends_and_its_peak():
    """No more members than asked for and ten, among them the first, the last and the fastest."""
    way, speed = np.linspace(0, 1, 1000), np.exp(-((np.linspace(0, 1, 1000) - 0.37) ** 2) * 1e4)
    kept = thinned(speed, way, 50)
    assert {0, 999, int(np.argmax(speed))} <= set(kept.tolist())
    assert len(kept) <= 60
    assert (np.diff(kept) > 0).all()
