"""The framework's answer to a method: its cast, by its own closed form, with its own parameters."""

from __future__ import annotations

import numpy as np
import pytest

from problems.methods import METHODS
from problems.robots.planar import PLANAR_3R
from sandbox.closed_form.solve import solve
from sandbox.errors import RankDeficientError, UnknownNameError
from sandbox.law import answer, rates
from sandbox.problem import VelocityProblem
from sandbox.solution import Status

Q, XDOT = np.array([[0.3, 1.1, -0.7], [1.0, -0.8, 0.5]]), np.array([[0.3, -0.7], [1.0, 1.0]])


@pytest.mark.parametrize("name", METHODS)
def test_unknown_parameters_are_refused(name):
    """A parameter that the method does not take is refused with those it does, or none."""
    with pytest.raises(UnknownNameError, match=f"no parameter of {name} is called 'alfa'; there are"):
        rates(METHODS[name], PLANAR_3R, Q, XDOT, alfa=1.0)


def test_a_method_is_answered_by_its_own_form_and_parameters():
    """Damped least squares with the damping it was cast with, the gradient projection by eq. (6)."""
    damped, plain = METHODS["damped_least_squares"], METHODS["gradient_projection"]
    J, eye = PLANAR_3R.jacobian(Q), np.eye(3)
    for damping in (0.01, 0.5):
        expected = np.linalg.solve(np.swapaxes(J, 1, 2) @ J + damping**2 * eye, np.swapaxes(J, 1, 2) @ XDOT[..., None])[..., 0]
        np.testing.assert_allclose(rates(damped, PLANAR_3R, Q, XDOT, damping=damping), expected, rtol=1e-9)
    problem = plain.cast(PLANAR_3R, Q, XDOT)
    np.testing.assert_array_equal(rates(plain, PLANAR_3R, Q, XDOT), solve(problem, "eq6").x)


def test_one_configuration_has_plain_shapes():
    """Of q (n,) and xdot (m,) the rates are (n,), the same as in a stack."""
    for name in ("gradient_projection", "inertia_weighted", "jacobian_transpose", "time_scaling"):
        np.testing.assert_allclose(rates(METHODS[name], PLANAR_3R, Q[0], XDOT[0]), rates(METHODS[name], PLANAR_3R, Q, XDOT)[0])


@pytest.mark.parametrize("name", ["gradient_projection", "time_scaling"])
def test_refusals_are_raised_or_told(name):
    """Of a J that has lost rank in one member: an error, or its status while the others are answered."""
    J = PLANAR_3R.jacobian(np.array([[0.0, 0.0, 0.0], Q[0]]))
    problem = VelocityProblem(J=J, xdot=XDOT, W=np.eye(3), a=0.1 * Q)
    with pytest.raises(RankDeficientError):
        answer(METHODS[name], PLANAR_3R, problem, {})
    found = answer(METHODS[name], PLANAR_3R, problem, {}, on_refusal="status")
    assert found.status[0] is Status.RANK_DEFICIENT and found.status[1] is Status.SOLVED
    assert np.isfinite(found.x[1]).all()


def test_time_scaling_takes_the_limits_it_is_given():
    """Limits among the parameters hold; None, like nothing, are the robot's."""
    method = METHODS["time_scaling"]
    problem = method.cast(PLANAR_3R, Q, 20 * XDOT, alpha=0.0)
    own, none, half = (
        answer(method, PLANAR_3R, problem, given).x for given in ({}, {"rate_limits": None}, {"rate_limits": np.ones(3)})
    )
    np.testing.assert_array_equal(own, none)
    np.testing.assert_allclose(np.abs(own).max(axis=1), 2.0)
    np.testing.assert_allclose(half, own / 2)
