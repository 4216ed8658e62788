"""What the claims on damping compute by themselves: exact conflicts, the bound of damped rates, postures, a controller."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from problems import paths, robots
from sandbox.claims.damping import (
    ANGLE,
    AUGMENTED,
    DAMPED,
    F1,
    FEEDBACK,
    J1,
    REACHED,
    SIZES,
    Example,
    base_forgotten,
    conflicting,
    controlled,
    everything_damped,
    examples,
    folded,
    law,
    rate_bound,
    thinned,
    where,
)
from sandbox.claims.equations import reduced_weight
from sandbox.law import rates
from sandbox.motion import follow
from sandbox.reference.exact import Dyadic


@pytest.mark.parametrize("m, n", SIZES)
def test_conflicts_are_exact(m, n):
    """J has full row rank and [J; E] has not, decided on integers."""
    problem = conflicting(np.random.default_rng(7), m, n, 20, np.zeros((20, n, n)))
    assert problem.W.E is not None
    for J, E in zip(problem.J, problem.W.E, strict=True):
        assert Dyadic.of(J).integers.rank() == m
        assert Dyadic.of(np.concatenate([J, E])).integers.rank() < n
        assert np.abs(np.concatenate([J, E])).max() < 100


def test_damped_curvature_is_at_least_that_of_the_base():
    """In conflict N'WN is N'W~N alone: its smallest eigenvalue is that of W~ = 0.01 I."""
    conflict = np.array([[1.0, 1, 0]])
    assert reduced_weight(J1, 0.01 * np.eye(3) + conflict.T @ conflict)[0, 0] == pytest.approx(0.01, rel=1e-12)
    assert abs(reduced_weight(J1, conflict.T @ conflict)[0, 0]) < 1e-30


@pytest.mark.parametrize("base, share", [(1 / 3, 1.0), (0.01, 0.9), (3.0, 0.999)])
def test_the_bound_of_damped_rates_is_reached(base, share):
    """At F1 s = e'n is 1/sqrt 3: the rates stay below the bound, and reach it for W~ = s^2 I."""
    robot, xdot = robots.load("planar_3r"), np.array([[0.3, -0.7], [-1.0, 0.4]])
    q = np.repeat(F1[None], 2, axis=0)
    speed = np.linalg.norm(rates(DAMPED, robot, q, xdot, E=ANGLE, base=base), axis=-1)
    bound = rate_bound(SimpleNamespace(q=q, xdot=xdot), robot, base)
    assert (speed <= bound * (1 + 1e-12)).all()
    assert speed == pytest.approx(bound, rel=1e-12) if share == 1 else (speed < bound).all()


def test_where_the_hand_cannot_go_on():
    """At 2 - sqrt 2 m along (1, 1) the wrist, one link behind the hand, is at the full reach of two."""
    hand = np.array([2.0, 1.0]) + REACHED * np.ones(2) / np.sqrt(2)
    assert np.linalg.norm(hand - [1.0, 0.0]) == pytest.approx(2.0, rel=1e-15)


def test_folded_postures_put_the_wrist_there():
    """The hand is one link beyond the wrist along x, and points along x."""
    q = folded(-0.6, 0.1)
    position, rotation = robots.load("planar_3r").forward(q)
    np.testing.assert_allclose(position, [0.4, 0.1, 0.0], atol=1e-15)
    np.testing.assert_allclose(rotation[:, 0], [1.0, 0.0, 0.0], atol=1e-15)


def test_the_controller_is_that_of_a_motion_by_steps():
    """Several weights at once give each what `follow` gives it alone, cut to the same limits."""
    robot, example, bases = robots.load("planar_3r"), examples()[1], (0.01, 0.1)
    given = {"E": ANGLE, "base": np.array(bases)[:, None, None] * np.eye(3)}
    several = controlled(lambda q, xdot: rates(DAMPED, robot, q, xdot, **given), robot, example, 2, 60)
    for i, base in enumerate(bases):
        one = law(rates, robot, base)
        done = follow(
            lambda q, xdot, one=one: np.clip(one(q, xdot), -example.limit, example.limit), robot, example.path, example.start,
            integrator="steps", steps=60, feedback=FEEDBACK,
        )  # fmt: skip
        np.testing.assert_allclose(several.q[:, i], done.q[:-1], atol=1e-11)
        np.testing.assert_allclose(several.rates[:, i], done.qdot[:-1], atol=1e-9)
        np.testing.assert_allclose(several.error[:, i], np.linalg.norm(done.task_error[:-1], axis=-1), atol=1e-11)
    assert np.abs(several.rates).max() == example.limit


def test_damping_everything_gives_up_the_task():
    """Damped least squares on [J; E] moves the hand otherwise than asked; W~ left out is the undamped law."""
    robot, q, xdot = robots.load("planar_3r"), F1[None], np.array([[0.3, -0.7]])
    wrong = everything_damped(rates)(DAMPED, robot, q, xdot, E=ANGLE, base=0.01)
    assert np.abs(J1 @ wrong[0] - xdot).max() > 1e-3
    np.testing.assert_allclose(J1 @ rates(DAMPED, robot, q, xdot, E=ANGLE, base=0.01)[0], xdot[0], atol=1e-15)
    bare = base_forgotten(rates)(DAMPED, robot, q, xdot, E=ANGLE, base=0.01)
    np.testing.assert_array_equal(bare, rates(AUGMENTED, robot, q, xdot, E=ANGLE))


def test_a_thinned_curve_keeps_its_ends_and_its_peak():
    """No more members than asked for and ten, among them the first, the last and the fastest."""
    way, speed = np.linspace(0, 1, 1000), np.exp(-((np.linspace(0, 1, 1000) - 0.37) ** 2) * 1e4)
    kept = thinned(speed, way, 50)
    assert {0, 999, int(np.argmax(speed))} <= set(kept.tolist())
    assert len(kept) <= 60
    assert (np.diff(kept) > 0).all()


def test_the_range_names_the_weights_that_reduce():
    """Of three sizes the one that made the error larger is left out, and the largest share is told."""
    example = Example("past", paths.load("straight"), F1, np.inf)
    words = where((example,), (0.1, 0.2, 0.3), [np.array([0.5, 1.5, 0.25])], [1e-12, 2e-12])
    assert "of 0.1, 0.3, to between 0.25 and 1.5 of the undamped error" in words
    assert "within 2.0e-12 m" in words
