"""Numbers known by hand: the planar arms of methods.md section 0, and the fixtures of the field."""

from __future__ import annotations

import numpy as np
import pytest

from sandbox.closed_form import CLOSED_FORMS
from sandbox.closed_form.jacobian_transpose import jacobian_transpose
from sandbox.closed_form.solve import solve
from sandbox.closed_form.time_scaling import time_scaling
from sandbox.errors import RangeError
from sandbox.problem import VelocityProblem
from sandbox.solution import Status
from sandbox.weight import Weight

F0 = [[0, 0, 0], [3, 2, 1]]
F1 = [[-1, -1, 0], [2, 1, 1]]
F1b = [[-2, -2, -1], [1, 0, 0]]
F2 = [[-2, -2, -1, -1], [2, 1, 1, 0]]
DIGITS = 1e-12
"""All these problems are small integers, with condition numbers below 100."""

EXACT = [name for name, form in CLOSED_FORMS.items() if form.task == "exact"]
ANY_WEIGHT = [name for name in EXACT if CLOSED_FORMS[name].domain == "condition (7)"] + ["eq13"]


def arm(J: list, W: object, xdot: list | None = None, a: list | None = None) -> VelocityProblem:
    """A fixture as a problem; xdot (1, 1) unless given."""
    return VelocityProblem(J=J, xdot=[1, 1] if xdot is None else xdot, W=W, a=a)


@pytest.mark.parametrize("method", [*EXACT, "eq13"])
@pytest.mark.parametrize(
    ("J", "W", "xdot", "a", "x"),
    [
        (F1, np.eye(3), [1, 0], None, [0, -1, 1]),
        (F1, np.eye(3), [0, 1], None, [1 / 3, -1 / 3, 2 / 3]),
        (F1b, np.eye(3), [1, 1], None, [1, -6 / 5, -3 / 5]),
        (F2, np.eye(4), [11, 0], None, [2, -5, 1, -6]),
        (F2, np.eye(4), [0, 11], None, [6, -4, 3, -7]),
        (F1, np.diag([1, 2, 3]), [0.5, -0.3], [0.1, -0.2, 0.4], None),
        (F1, [[8, 4, 2], [4, 3, 1], [2, 1, 1]], [0.25, 0.5], None, [0, -0.25, 0.75]),  # inertia matrix: (0, -x, x + y)
        (F1, np.diag([1, 1.565884242105, 1.090541478737]), [1, 1], None, [0.168251391478, -1.168251391478, 1.831748608522]),
        (
            F1, 0.01 * np.diag([1, 2, 3]) + np.ones((3, 3)), [0.3, -0.7], [-0.9] * 3,
            [-1.52641509434, 1.22641509434, 1.12641509434],
        ),
        (F1b, np.eye(3), [0, 0], [0, 0, -1 / np.sqrt(5)], [0, -0.178885438200, 0.357770876400]),
        ([[1, 0, 1], [0, 1, 1]], [[6, 2, 1], [2, 5, 2], [1, 2, 4]], [3, 0], [-8, -3, -3], [2, -1, 1]),
    ],
    ids=["F1-x", "F1-y", "F1b", "F2-x", "F2-y", "F1-P4", "F1-M16", "F1-M4", "F1-M19", "F1b-M5", "nocedal-wright"],
)  # fmt: skip
def test_positive_weights(method: str, J: list, W: object, xdot: list, a: list | None, x: list | None) -> None:
    """Every exact form gives the number of the book."""
    problem = arm(J, W, xdot, a)
    if x is None:  # y = -(n'a + n'W q_p)/(n'W n) along n = (-1, 1, 1) from q_p = (0, -.5, .2)
        y = -(0.1 + (2 * -0.5 + 3 * 0.2)) / 6
        x = [-y, -0.5 + y, 0.2 + y]
    answer = solve(problem, method)
    np.testing.assert_allclose(answer.x, x, atol=DIGITS * 100 if method == "eq13" else DIGITS * 10)
    np.testing.assert_allclose(problem.W.dense() @ answer.x + problem.a + problem.J.T @ answer.y, 0, atol=DIGITS * 100)


@pytest.mark.parametrize("method", ANY_WEIGHT)
@pytest.mark.parametrize(
    ("J", "W", "xdot", "x", "y"),
    [
        (F1, np.diag([-1, 1, 1]), [1, 1], [1, -2, 1], [-3, -1]),
        (F1, [[-2, -2, -1], [-2, -1, -1], [-1, -1, 0]], [1, 1], [0, -1, 2], None),
        (F1, [[-7, -5, -4], [-5, -3, -2], [-4, -2, -2]], [1, 1], [0, -1, 2], None),
        (F1, np.eye(3) - np.array(F1).T @ F1, [1, 1], [1 / 3, -4 / 3, 5 / 3], None),
        ([[1, -1]], [[2, 4], [4, 2]], [4], [2, -2], None),
    ],
    ids=["F1-indefinite", "F1-M18", "F1-M16-shifted", "I-J'J", "x2+4xy+y2"],
)
def test_indefinite_weights(method: str, J: list, W: object, xdot: list, x: list, y: list | None) -> None:
    """Every form whose domain is condition (7) solves an indefinite W that satisfies it, multipliers included."""
    assert np.linalg.eigvalsh(np.array(W, dtype=float))[0] < 0
    problem = arm(J, W, xdot)
    answer = solve(problem, method)
    np.testing.assert_allclose(answer.x, x, atol=DIGITS)
    if y is not None:
        np.testing.assert_allclose(answer.y, y, atol=DIGITS)


@pytest.mark.parametrize("method", ["eq2_5", "weighted_pseudoinverse"])
def test_normal_equations_refuse_an_indefinite_weight(method: str) -> None:
    """They factor W, so W = diag(-1, 1, 1) is refused by them though condition (7) holds."""
    answer = solve(arm(F1, np.diag([-1, 1, 1])), method, on_refusal="status")
    assert answer.status is Status.NOT_POSITIVE_DEFINITE
    assert np.isnan(answer.x).all() and np.isnan(answer.y).all()


@pytest.mark.parametrize("method", [*ANY_WEIGHT, "eq2_5", "weighted_pseudoinverse"])
@pytest.mark.parametrize(
    ("J", "W"),
    [
        (F1, np.diag([-2, 1, 1])),
        (F1, np.diag([-3, 1, 1])),
        (F2, np.diag([1, 1, 1, -2])),
        (F2, np.diag([-8 / 3, 1, 1, 1])),
        (F1, np.array(F1).T @ [[2, 1], [1, 3]] @ F1),
        (F1, [[-0.5, 0.5, -0.5], [0.5, 1, -1], [-0.5, -1, 0]]),
        ([[1, 1]], [[2, 4], [4, 2]]),
    ],
    ids=["F1-singular", "F1-maximum", "F2-saddle", "F2-boundary", "J'AJ", "F1-hessian", "x2+4xy+y2"],
)
def test_condition_seven_is_refused(method: str, J: list, W: object) -> None:
    """Where N'WN is not positive definite no form answers, however well (6) could be solved (I33)."""
    J = np.array(J)
    N = np.linalg.svd(J)[2][len(J) :].T
    assert np.linalg.eigvalsh(N.T @ W @ N)[0] < DIGITS
    answer = solve(arm(J, W, [1] * len(J)), method, on_refusal="status")
    allowed = {Status.NOT_POSITIVE_DEFINITE} if method in ("eq2_5", "weighted_pseudoinverse") else {Status.CONDITION_SEVEN}
    assert answer.status in allowed
    assert np.isnan(answer.x).all() and np.isnan(answer.y).all()


def test_eq13_at_a_singularity() -> None:
    """The stretched arm with an indefinite W and a coupled Wx (methods 6.6): target 2, not 1; Wx = I gives half."""
    W = np.diag([1, 1, -1 / 20])
    coupled = solve(VelocityProblem(J=F0, xdot=[1, 1], W=W, Wx=[[2, 1], [1, 1]]), "eq13")
    np.testing.assert_allclose(coupled.x, [-6 / 7, -4 / 7, 40 / 7], atol=DIGITS)
    plain = solve(VelocityProblem(J=F0, xdot=[1, 1], W=W), "eq13")
    np.testing.assert_allclose(plain.x, coupled.x / 2, atol=DIGITS)
    # y is in Wx range J = span (1, 1): -d value / d xdot
    np.testing.assert_allclose(coupled.y, [2 / 7, 2 / 7], atol=DIGITS)


def test_eq13_at_rank_zero() -> None:
    """With J = 0 only the objective is left: qdot = -W^-1 a, no multiplier."""
    answer = solve(VelocityProblem(J=np.zeros((2, 3)), xdot=[1, 2], W=np.diag([1, 2, 4]), a=[1, 2, 3]), "eq13")
    np.testing.assert_array_equal(answer.x, [-1, -1, -0.75])
    np.testing.assert_array_equal(answer.y, [0, 0])


def test_eq13_with_more_rows_than_joints() -> None:
    """With n < m and full column rank it is weighted least squares."""
    J, xdot, w = np.array([[1.0, 0], [0, 1], [1, 1]]), np.array([1.0, 2, 4]), np.diag([1.0, 2, 3])
    answer = solve(VelocityProblem(J=J, xdot=xdot, W=np.eye(2), Wx=w), "eq13")
    np.testing.assert_allclose(answer.x, np.linalg.solve(J.T @ w @ J, J.T @ w @ xdot), atol=DIGITS)


@pytest.mark.parametrize("method", EXACT)
def test_exact_forms_need_as_many_joints_as_rows(method: str) -> None:
    """With n < m the exact forms refuse; with n = m they invert J and W has no say."""
    tall = solve(VelocityProblem(J=np.ones((3, 2)), xdot=[1, 1, 1], W=np.eye(2)), method, on_refusal="status")
    assert tall.status is Status.RANK_DEFICIENT
    square = solve(VelocityProblem(J=[[2, 1], [1, 1]], xdot=[3, 2], W=np.diag([1, 5]), a=[1, 1]), method)
    np.testing.assert_allclose(square.x, [1, 1], atol=DIGITS)


def test_square_jacobian_ignores_an_indefinite_weight() -> None:
    """With n = m null J is empty and condition (7) holds of itself: any W will do."""
    for method in ANY_WEIGHT:
        answer = solve(VelocityProblem(J=[[2, 1], [1, 1]], xdot=[3, 2], W=np.diag([1, -5])), method)
        np.testing.assert_allclose(answer.x, [1, 1], atol=DIGITS, err_msg=method)


def test_damped_least_squares_by_hand() -> None:
    """F1 with lambda = 1 and xdot = (1, 1): (1/6, -1/3, 1/2), and y = J qdot - xdot (methods C1)."""
    answer = solve(arm(F1, np.eye(3)), "damped_least_squares", damping=1.0)
    np.testing.assert_allclose(answer.x, [1 / 6, -1 / 3, 1 / 2], atol=DIGITS)
    np.testing.assert_allclose(answer.y, np.array(F1) @ answer.x - 1, atol=DIGITS)


def test_factored_weight_keeps_its_digits() -> None:
    """One function almost in range J' (methods 4.4): formed, W has lost condition (7) at d = 1e-8; factored it has not."""
    d, xdot = 1e-8, np.array([0.3, -0.7])
    E = np.array([[1 + d, 1, 0]])
    x = np.linalg.solve(np.vstack([F1, E]), [*xdot, 0.9])
    formed = solve(arm(F1, E.T @ E, xdot, -0.9 * E[0]), "eq6", on_refusal="status")
    assert formed.status.refused
    for method in ("eq6", "eq6_orthonormal", "null_space", "eq13"):
        problem = arm(F1, Weight(np.zeros((3, 3)), E), xdot, -0.9 * E[0])
        answer = solve(problem, method)
        bound = CLOSED_FORMS[method].bound(problem.stacked())[0]
        assert np.abs(answer.x - x).max() <= bound * np.abs(x).max()
        assert bound < 1e-3


def test_jacobian_transpose_by_hand() -> None:
    """F1, e = (1, 1): kappa = 1/5, J kappa J'e = (-.2, .6); where J'e = 0 it stalls."""
    step = jacobian_transpose(arm(F1, np.eye(3)).stacked())
    np.testing.assert_allclose(step, [[0.2, 0, 0.2]], atol=DIGITS)
    np.testing.assert_allclose(np.array(F1) @ step[0], [-0.2, 0.6], atol=DIGITS)
    np.testing.assert_array_equal(jacobian_transpose(arm(F0, np.eye(3), [1, 0]).stacked()), [[0, 0, 0]])


def test_time_scaling_by_hand() -> None:
    """F1 with limits 1: s = .6; with self-motion .3 n: s = .42; self-motion beyond the limits has no s (methods C3)."""
    x = np.array([1 / 3, -4 / 3, 5 / 3])
    rates, s = time_scaling(x, np.ones(3))
    assert s == pytest.approx(0.6) and np.abs(rates - [0.2, -0.8, 1]).max() < DIGITS
    rates, s = time_scaling(x, np.ones(3), 0.3 * np.array([-1, 1, 1]))
    assert s == pytest.approx(0.42) and np.abs(rates - [-0.16, -0.26, 1]).max() < DIGITS
    assert time_scaling(x / 10, np.ones(3))[1] == 1
    assert np.isnan(time_scaling(x, np.ones(3), np.array([-2.0, 2, 2]))[1])
    with pytest.raises(RangeError, match="limits must be positive"):
        time_scaling(x, np.array([1, 0, 1]))
