"""Measures and their gradients by calculus."""

from __future__ import annotations

import numpy as np
import pytest

from problems import robots
from problems.methods.draw import generic
from problems.robots.twin import twin
from sandbox.claims.implicit.directional_derivatives import MEASURES, plain_volume


def test_manipulability_squared_of_the_planar_arm():
    """Its trigonometric form is det JJ' of the Jacobian."""
    robot = robots.load("planar_3r")
    q = generic(robot, np.random.default_rng(4), 30).q
    J = robot.jacobian(q)
    np.testing.assert_allclose(plain_volume(q), np.linalg.det(J @ np.swapaxes(J, 1, 2)), rtol=1e-12)


@pytest.mark.parametrize("name", ["planar_4r", "panda"])
@pytest.mark.parametrize("what, expression, explicit, alpha", MEASURES, ids=[row[0] for row in MEASURES])
def test_explicit_gradients_are_those_of_the_expressions(name, what, expression, explicit, alpha):
    """Central differences of the CasADi expression find the gradient that the other side forms."""
    robot = robots.load(name)
    q, step = generic(robot, np.random.default_rng(5), 5).q, 1e-5
    value = twin(robot).evaluator(expression(twin(robot)))
    along = [(value(q + step * e)[0] - value(q - step * e)[0]) / (2 * step) for e in np.eye(robot.n)]
    gradient = explicit(robot, q)
    np.testing.assert_allclose(np.stack(along, axis=-1), gradient, atol=1e-6 * np.abs(gradient).max())
