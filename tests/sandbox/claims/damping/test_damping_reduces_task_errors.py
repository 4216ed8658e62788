"""The controller that holds its rates, and its examples."""

from __future__ import annotations

import numpy as np

from problems import robots
from sandbox.claims.damping.damping_reduces_task_errors import DAMPED, FEEDBACK, controlled, examples, folded, law, where
from sandbox.claims.postures import HAND_ANGLE
from sandbox.law import rates
from sandbox.motion import follow


def test_folded_postures_put_the_wrist_there():
    """The hand is one link beyond the wrist along x, and points along x."""
    q = folded(-0.6, 0.1)
    position, rotation = robots.load("planar_3r").forward(q)
    np.testing.assert_allclose(position, [0.4, 0.1, 0.0], atol=1e-15)
    np.testing.assert_allclose(rotation[:, 0], [1.0, 0.0, 0.0], atol=1e-15)


def test_the_controller_is_that_of_a_motion_by_steps():
    """Several weights at once give each what `follow` gives it alone, cut to the same limits."""
    robot, example, bases = robots.load("planar_3r"), examples()[1], (0.01, 0.1)
    given = {"E": HAND_ANGLE, "base": np.array(bases)[:, None, None] * np.eye(3)}
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


def test_the_range_names_the_weights_that_reduce():
    """Of three sizes the one that made an error larger is left out, and the smallest share is told."""
    words = where((0.1, 0.2, 0.3), [np.array([0.5, 1.5, 0.25])], [1e-12, 2e-12])
    assert r"\epsilon$ = 0.1, 0.3 reduced them in every example, at best to 0.25 of the undamped error" in words
    assert r"within $2.0 \times 10^{-12}$ m" in words
