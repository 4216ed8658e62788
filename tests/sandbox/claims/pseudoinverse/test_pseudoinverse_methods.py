"""Which way each measure goes, and that every citation has a use."""

from __future__ import annotations

import numpy as np
import pytest

from problems import robots
from sandbox.claims.pseudoinverse.pseudoinverse_methods import USES, climbing, measure_of
from sandbox.law import rates


@pytest.mark.parametrize("use", USES, ids=[use.what for use in USES])
def test_alpha_enters_with_the_sign_that_the_row_says(use):
    """The vector a of the cast is alpha times the gradient of the measure, or of its negative where it is to rise."""
    robot = robots.load("planar_4r")
    q, xdot, parameters = use.draw(robot, np.random.default_rng(1), 3)
    a = use.method.cast(robot, q, xdot, **parameters).a
    gradient = measure_of(use, robot, parameters).gradient(robot, q)
    along = np.einsum("bn,bn->b", a, gradient) / np.linalg.norm(a, axis=1) / np.linalg.norm(gradient, axis=1)
    np.testing.assert_allclose(along, -1.0 if use.rising else 1.0, rtol=0, atol=1e-9)


def test_the_planted_climber_is_the_mirror_image():
    """With the sign of alpha turned the mean of both motions is that of alpha = 0."""
    use, robot = USES[0], robots.load("planar_3r")
    q, xdot, _ = use.draw(robot, np.random.default_rng(2), 3)
    down = rates(use.method, robot, q, xdot, alpha=0.5)
    up = climbing(rates)(use.method, robot, q, xdot, alpha=0.5)
    np.testing.assert_allclose((up + down) / 2, rates(use.method, robot, q, xdot, alpha=0.0), rtol=0, atol=1e-12)
    assert np.abs(up - down).max() > 1e-2


def test_every_citation_of_the_paragraph_has_a_use():
    """The numbers [1] and [9] to [15] are all there."""
    cited = " ".join(use.cites for use in USES)
    assert all(f"[{number}]" in cited for number in (1, *range(9, 17)))
