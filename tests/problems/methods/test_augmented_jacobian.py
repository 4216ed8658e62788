"""M11 and section 4 of methods.md."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from problems import robots
from problems.measures.measure import symbolic
from problems.methods import augmented_jacobian
from problems.methods.augmented_jacobian import METHOD, cast, cast_functions
from problems.methods.draw import generic
from problems.robots.planar import PLANAR_3R, PLANAR_4R
from problems.weightings import augmented
from problems.weightings.augmented import (
    AlgorithmicSingularityError,
    FunctionCountError,
    NotRedundantError,
    OverdeterminedWarning,
)
from sandbox.closed_form.solve import solve
from sandbox.errors import RangeError, RankDeficientError, ShapeError
from sandbox.law import rates
from sandbox.problem import VelocityProblem
from sandbox.weight import Weight
from tests.problems.secondary import COUNT, EACH_ROBOT, F1, F2, NULL, agrees, answers, at, faulty, found, generic_3r, rounding

SUM = np.ones((1, 3))
XDOT, RATE = at(0.3, -0.7), np.array([0.9])


@EACH_ROBOT
def test_agrees_with_the_original(name):
    """Framework and [J; E] qdot = [xdot; gbar] agree, also after shifts of W."""
    agrees(METHOD, name)


def test_four_secondary_functions():
    """The seven-joint arm asked for its position alone takes four functions."""
    agrees(METHOD, "seven_joint", task="position")


@pytest.mark.parametrize("gamma", [1e-3, 1.0, 57.3])
def test_orientation_of_the_3r_arm(gamma):
    """F1, g = q1 + q2 + q3: qdot = (ydot - om, om - xdot - ydot, om + xdot), whatever gamma (4.2)."""
    answers(METHOD, PLANAR_3R, F1, XDOT, (-1.6, 1.3, 1.2), E=SUM, gbar=RATE, gamma=np.array([gamma]))


def test_two_functions_of_the_4r_arm():
    """F2, g = (q1, q1 + q2 + q3 + q4): integer coefficients, found by hand (4.3)."""
    (x, y), (b1, b2) = (0.3, -0.7), (0.9, -0.4)
    expected = (b1, -x - b1 - b2, x + y - b1 + b2, -y + b1 + b2)
    E = np.array([[1.0, 0, 0, 0], [1, 1, 1, 1]])
    answers(METHOD, PLANAR_4R, F2, at(x, y), expected, E=E, gbar=np.array([b1, b2]), gamma=np.array([0.1, 7.0]))


def test_default_functions():
    """Joints 1..k-1 and the sum of all: the functions of F2, and the orientation of the 3R arm."""
    np.testing.assert_array_equal(cast(PLANAR_4R, F2, at(0, 0)).W.E[0], [[1, 0, 0, 0], [1, 1, 1, 1]])
    np.testing.assert_array_equal(cast(PLANAR_3R, F1, at(0, 0)).W.E[0], SUM)


@pytest.mark.parametrize("gamma, expected", [((1, 1), (-0.7, 0.4, 0.3)), ((10, 1), (-1.436364, 1.136364, 1.036364))])
def test_more_functions_than_redundancy(gamma, expected):
    """Two functions where one fits: gamma matters, and a warning says so (4.3)."""
    parameters = {"E": np.array([[1.0, 1, 1], [1, 0, 0]]), "gbar": np.array([0.9, 0.2]), "gamma": np.array(gamma, dtype=float)}
    with pytest.warns(OverdeterminedWarning, match="2 secondary functions for 1 degrees of redundancy"):
        answers(METHOD, PLANAR_3R, F1, XDOT, expected, digits=6, **parameters)


def test_gamma_has_no_effect():
    """gam_i -> c_i gam_i changes nothing while there are exactly k functions (I3)."""
    panda = robots.load("panda", "position")
    drawn = METHOD.draw(panda, np.random.default_rng(3), COUNT)
    one, allowed = found(METHOD, panda, drawn.q, drawn.xdot, **drawn.parameters)
    other = rates(METHOD, panda, drawn.q, drawn.xdot, gbar=drawn.parameters["gbar"], gamma=np.array([1e-2, 3, 0.5, 40.0]))
    assert (np.abs(one - other) <= 2 * allowed).all()


def test_determinant_is_a_product_with_the_null_vector():
    """Determinants: det [J; e'] = n.e for n the cross product of the rows of J."""
    q, _ = generic_3r()
    J, e = PLANAR_3R.jacobian(q), np.array([0.3, -1.0, 0.7])
    n = np.cross(J[:, 0], J[:, 1])
    A = np.concatenate([J, np.broadcast_to(e, (len(q), 1, 3))], axis=1)
    assert (np.abs(np.linalg.det(A) - n @ e) <= rounding(PLANAR_3R, q, np.linalg.norm(n, axis=1) + 1)).all()


@pytest.mark.parametrize("d, lost", [(1e-4, 1e-9), (1e-6, 1e-5), (1e-8, np.inf)])
def test_weight_is_never_multiplied_out(d, lost):
    """F1, g = (1 + d) q1 + q2: W = E' Gamma E formed first loses `lost`, or everything; factored, cond [J; E] alone (4.4)."""
    E = np.array([[1 + d, 1.0, 0.0]])
    b, x, y = (Fraction(v) for v in (0.9, 0.3, -0.7))
    q1 = (b + x) / (Fraction(1 + d) - 1)  # q1 + q2 = -x in the exact Jacobian of F1
    exact = np.array([float(v) for v in (q1, -x - q1, y + x - q1)])
    problem = cast(PLANAR_3R, F1, XDOT, E=E, gbar=RATE)
    size = np.abs(exact).max()
    error = np.abs(solve(problem).x - exact).max() / size
    assert error <= rounding(PLANAR_3R, F1, np.linalg.cond(np.vstack([PLANAR_3R.jacobian(F1)[0], E])))[0]
    formed = VelocityProblem(J=problem.J, xdot=problem.xdot, W=Weight(problem.W.dense()), a=problem.a)
    solution = solve(formed, on_refusal="status")
    if np.isfinite(lost):
        assert np.abs(solution.x - exact).max() / size > lost
        assert error < 1e-3 * np.abs(solution.x - exact).max() / size
    else:
        assert not solution.status[0].answered


def orientation(shift: float):
    """Measure g = q1 + q2 + q3 + shift."""
    return symbolic("orientation", "rad", "sum of the joints", "methods 8.3", lambda twin: _sum(twin.q) + shift)


def _sum(q):
    return q[0] + q[1] + q[2]


@pytest.mark.parametrize("shift", [0.0, 1.0])
def test_closed_loop_rate_is_frozen(shift):
    """The rate gbar = kp (g_des - g) is a number: constants added to g and g_des change nothing (8.3)."""
    problem = cast_functions(PLANAR_3R, F1, at(1, 1), functions=[orientation(shift)], desired=0.3 + shift, gain=2.0)
    (reference,) = rates(METHOD, PLANAR_3R, F1, at(1, 1), E=SUM, gbar=np.array([0.6]))
    np.testing.assert_allclose(solve(problem).x[0], (0.4, -1.4, 1.6), rtol=0, atol=rounding(PLANAR_3R, F1, 2.0)[0])
    np.testing.assert_allclose(solve(problem).x[0], reference, rtol=0, atol=rounding(PLANAR_3R, F1, 2.0)[0])


def test_fault_differentiated_desired_rate():
    """The literal gradient of gam gbar g depends on the constant in g: (2.4, -3.4, -.4) where g is shifted by one (8.3)."""
    problem = cast_functions(PLANAR_3R, F1, at(1, 1), functions=[orientation(1.0)], desired=1.3, gain=2.0)
    literal = problem.a + 2.0 * 1.0 * SUM  # -(gbar grad g + g grad gbar), grad gbar = -kp grad g
    wrong = solve(VelocityProblem(J=problem.J, xdot=problem.xdot, W=problem.W, a=literal)).x[0]
    np.testing.assert_allclose(wrong, (2.4, -3.4, -0.4), rtol=0, atol=rounding(PLANAR_3R, F1, 4.0)[0])
    with pytest.raises(AssertionError):
        np.testing.assert_allclose(wrong, (0.4, -1.4, 1.6), rtol=0, atol=rounding(PLANAR_3R, F1, 4.0)[0])


def test_without_feedback_the_functions_are_held():
    """The rate gbar = 0 where no desired value is given: the secondary functions do not move."""
    q, xdot = generic_3r()
    qdot = solve(cast_functions(PLANAR_3R, q, xdot, functions=[orientation(0.0)])).x
    assert (np.abs(qdot.sum(axis=1)) <= rounding(PLANAR_3R, q, np.abs(qdot).max(axis=1) * 3)).all()


def test_fault_wrong_sign_of_alpha(monkeypatch):
    """With a = +E' Gamma gbar framework and original disagree."""
    right = augmented.secondary_rate
    monkeypatch.setattr(augmented_jacobian, "secondary_rate", lambda *given: -right(*given))
    faulty(METHOD, cast)


def test_fault_rate_without_gamma(monkeypatch):
    """With gamma in W but not in a they disagree."""
    right = augmented.secondary_rate
    monkeypatch.setattr(augmented_jacobian, "secondary_rate", lambda E, gbar, gamma: right(E, gbar))
    faulty(METHOD, cast)


def test_refuses_fewer_functions_than_redundancy():
    """One function for two degrees of redundancy: refused, and the numbers are named."""
    with pytest.raises(FunctionCountError, match="2 degrees of redundancy but 1 secondary functions") as refusal:
        cast(PLANAR_4R, F2, at(1, 1), E=np.ones((1, 4)))
    assert refusal.value.evidence == {"functions": 1, "redundancy": 2}


def test_refuses_an_arm_without_redundancy():
    """Three joints for position and angle: nothing is left to ask."""
    with pytest.raises(NotRedundantError, match="3 joints for 3 task rows"):
        cast(PLANAR_3R.task("planar pose"), F1, np.zeros((1, 3)), E=SUM)


@pytest.mark.parametrize("gamma", [(0.0,), (-1.0,)])
def test_refuses_gamma_that_is_not_positive(gamma):
    """Any gamma <= 0 is refused."""
    with pytest.raises(RangeError, match="must be 1 positive numbers"):
        cast(PLANAR_3R, F1, XDOT, gamma=np.array(gamma))


def test_refuses_an_algorithmic_singularity():
    """F1, g = q1 + q2: its gradient is a row of J, n'grad g = 0; the configuration is named (4.2)."""
    q = np.concatenate([generic_3r(2)[0], F1])
    E = np.array([[1.0, 1.0, 0.0]])
    assert E[0] @ NULL == 0
    with pytest.raises(AlgorithmicSingularityError, match="configuration 2 of planar_3r: sigma_min") as refusal:
        cast(PLANAR_3R, q, np.ones((3, 2)), E=E)
    assert refusal.value.evidence["index"] == (2,)


def test_refuses_a_function_without_gradient():
    """A row of zeros asks nothing: an algorithmic singularity."""
    with pytest.raises(AlgorithmicSingularityError):
        cast(PLANAR_3R, F1, XDOT, E=np.zeros((1, 3)))


def test_refuses_a_singular_arm():
    """The stretched arm has lost rank; eq. (13) is named."""
    with pytest.raises(RankDeficientError, match=r"configuration 0 of planar_3r.*eq\. 13"):
        cast(PLANAR_3R, np.zeros((1, 3)), XDOT, E=SUM)


@pytest.mark.parametrize("field, value", [("E", np.ones((1, 4))), ("gbar", np.ones(2)), ("gamma", np.ones(2))])
def test_refuses_wrong_shapes(field, value):
    """A wrong number of entries is refused, and the field named."""
    with pytest.raises(ShapeError, match=field):
        cast(PLANAR_3R, F1, XDOT, **{field: value})


def test_indefinite_gamma_would_be_a_saddle():
    """With k = 2 and one negative gamma N'WN is indefinite: why gamma > 0 is asked."""
    q, _, _ = generic(PLANAR_4R, np.random.default_rng(0), 5)
    N = np.swapaxes(np.linalg.svd(PLANAR_4R.jacobian(q))[2][:, 2:], 1, 2)
    E = augmented_jacobian.rows(PLANAR_4R, q, None)
    reduced = np.linalg.eigvalsh(np.swapaxes(E @ N, 1, 2) @ np.diag([1.0, -1.0]) @ (E @ N))
    assert (reduced[:, 0] < 0).all() and (reduced[:, 1] > 0).all()
