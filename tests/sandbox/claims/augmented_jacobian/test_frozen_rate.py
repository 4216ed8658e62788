"""Functions g on complex numbers, and gradients by complex steps."""

from __future__ import annotations

import numpy as np
import pytest

from problems import robots
from sandbox.claims.augmented_jacobian.frozen_rate import (
    _shifted_angle,
    _shifted_curved,
    gradient,
    plain_angle,
    plain_curved,
    shifted,
)


@pytest.mark.parametrize("plain, expression", [(plain_angle, _shifted_angle), (plain_curved, _shifted_curved)])
def test_plain_functions_are_the_measures(plain, expression):
    """The functions on complex numbers and those in CasADi have the same values, up to the constant, and gradients."""
    robot, q = robots.load("panda"), np.random.default_rng(1).uniform(-1, 1, (20, 7))
    measure = shifted(expression, 0.7)
    np.testing.assert_allclose(measure.value(robot, q), plain(q) + 0.7, rtol=1e-14)
    np.testing.assert_allclose(measure.gradient(robot, q), gradient(plain, q), rtol=1e-14)


def test_complex_steps_differentiate_products():
    """The gradient of (c - g) g is (c - 2 g) grad g: what differentiating gbar adds."""
    q = np.random.default_rng(2).uniform(-1, 1, (10, 3))
    found = gradient(lambda z: (0.3 - plain_curved(z)) * plain_curved(z), q)
    np.testing.assert_allclose(found, (0.3 - 2 * plain_curved(q))[:, None] * gradient(plain_curved, q), rtol=1e-13)
