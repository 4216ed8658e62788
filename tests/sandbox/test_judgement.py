"""Judgement against fractions and at the edges of its rules: residuals, error, tolerance, gap, multipliers, grade."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction as F
from typing import Any

import numpy as np
import pytest

from sandbox.judgement import Allowance, Judgement, judge
from sandbox.problem import VelocityProblem
from sandbox.reference.truth import truth
from sandbox.solution import CODE, Status
from sandbox.task import TaskView
from sandbox.tolerances import (
    DAMPING,
    FALSE_FACTOR,
    FALSE_RELATIVE,
    FALSE_RESIDUAL_RELATIVE,
    FORWARD,
    SOLVER_SLACK,
    UNDECIDABLE_CLOSED_FORM,
    UNDECIDABLE_SOLVER,
    UNIT,
    VERIFIED_RELATIVE,
)
from sandbox.verdict import VERDICTS
from sandbox.yardstick import Yardstick
from tests.oracle import oracle

Array = np.ndarray

F1 = np.array([[-1.0, -1, 0], [2, 1, 1]])
JUST = 1e-3
"""Share by which the tests step over an edge."""


def yardstick(problem: VelocityProblem, task: str = "exact") -> Yardstick:
    """Of one problem or a stack."""
    problem = problem.stacked()
    return Yardstick.of(problem, task, truth(problem, task))


def allowance(B: int, eps: Any = (0.0, 0.0), level: str = "high_accuracy") -> Allowance:
    """Absolute tolerances of rows and stationarity, one pair or one for each of B answers."""
    primal, dual = (np.broadcast_to(v, (B,)).astype(float) for v in eps)
    whole = Allowance.of_solver((0.0, 1.0, 0.0, 1.0), primal, dual, level)
    assert (whole.eps_primal == primal).all() and (whole.eps_dual == dual).all()
    return whole


def judged(
    stick: Yardstick, x: Any, y: Any, allowed: Allowance | None = None, status: Status = Status.SOLVED, promised: bool = True
) -> Judgement:
    """Judge answers; a yardstick of one serves them all."""
    x, y = np.atleast_2d(np.asarray(x, dtype=float)), np.atleast_2d(np.asarray(y, dtype=float))
    if len(stick.expected) < len(x):
        stick = stick[np.zeros(len(x), dtype=int)]
    allowed = allowed or allowance(len(x))
    return judge(stick, x, y, np.full(len(x), CODE[status], np.int8), allowed, np.full(len(x), promised))


def verdicts(found: Judgement) -> list[str]:
    return [VERDICTS[code] for code in found.verdict]


def integer_problem(seed: int, task: str) -> tuple[VelocityProblem, Array, Array]:
    """A problem of small integers with a minimum, and some integer qdot and y that are not its answer."""
    rng = np.random.default_rng(seed)
    while True:
        J, W, B = rng.integers(-2, 3, (2, 4)), rng.integers(-2, 3, (4, 4)), rng.integers(-1, 2, (2, 2))
        xdot, a = rng.integers(-3, 4, 2), rng.integers(-3, 4, 4)
        problem = VelocityProblem(J, xdot, W + W.T + (8 * np.eye(4) if seed % 2 else 0), a, B @ B.T + np.eye(2))
        if truth(problem, task).expected == "unique_minimum":
            return problem, rng.integers(-3, 4, 4).astype(float), rng.integers(-3, 4, 2).astype(float)


def of_task(problem: VelocityProblem, task: str) -> tuple[F, oracle.Matrix]:
    """The factor on W and a, and Wx, as fractions."""
    return F(DAMPING) ** 2 if task == "damped" else F(1), oracle.rational(problem.Wx)


def value(problem: VelocityProblem, task: str, x: oracle.Vector) -> F:
    """The objective, in fractions; with the slack of C1 for damping."""
    scale, Wx = of_task(problem, task)
    W, a, J = oracle.rational(problem.W.dense()), oracle.vector(problem.a), oracle.rational(problem.J)
    whole = scale * (oracle.inner(x, oracle.apply(W, x)) / 2 + oracle.inner(a, x))
    if task == "damped":
        slack = [u - v for u, v in zip(oracle.vector(problem.xdot), oracle.apply(J, x), strict=True)]
        whole += oracle.inner(slack, oracle.apply(Wx, slack)) / 2
    return whole


@pytest.mark.parametrize("task", ["exact", "least_squares", "damped"])
@pytest.mark.parametrize("seed", range(4))
def test_residuals_gap_and_error_in_fractions(seed: int, task: str) -> None:
    """Residuals of any point, its objective gap and its error are what fractions say, for each task."""
    problem, x, y = integer_problem(seed, task)
    scale, Wx = of_task(problem, task)
    t = truth(problem, task)
    stick = yardstick(problem, task)
    found = judged(stick, x, y)
    J, X, Y = oracle.rational(problem.J), oracle.vector(x), oracle.vector(y)
    slope = [scale * (u + v) for u, v in zip(oracle.apply(oracle.rational(problem.W.dense()), X), problem.a, strict=True)]
    dual = [u + v for u, v in zip(slope, oracle.apply(oracle.transpose(J), Y), strict=True)]
    miss = [u - F(v) for u, v in zip(oracle.apply(J, X), problem.xdot, strict=True)]
    weighted = oracle.apply(Wx, miss)
    primal = {
        "exact": miss,
        "least_squares": oracle.apply(oracle.transpose(J), weighted),
        "damped": [u - v for u, v in zip(Y, weighted, strict=True)],
    }[task]
    assert found.dual_residual[0] == float(max(map(abs, dual)))
    assert found.primal_residual[0] == float(max(map(abs, primal)))
    view = TaskView.of(problem.stacked(), task, DAMPING)
    assert oracle.rational(view.gradient(x[None]))[0] == slope
    assert oracle.rational(view.dual(x[None], y[None]))[0] == dual
    # 1/2 dx'W dx is what the objective lost, less what missing the rows gained
    gap = value(problem, task, X) - value(problem, task, list(t.x_exact))
    if task != "damped":
        gap += oracle.inner(list(t.y_exact), miss)
        best = [u - F(v) for u, v in zip(oracle.apply(J, list(t.x_exact)), problem.xdot, strict=True)]
        gap -= oracle.inner(list(t.y_exact), best)
    np.testing.assert_allclose(found.objective_gap[0], float(gap), rtol=1e-12)
    apart = max(abs(u - v) for u, v in zip(X, t.x_exact, strict=True))
    np.testing.assert_allclose(found.error[0] * stick.size[0], float(apart), rtol=1e-14)
    off = [
        u - v for u, v in zip(oracle.apply(oracle.transpose(J), Y), oracle.apply(oracle.transpose(J), t.y_exact), strict=True)
    ]
    size = max(
        scale * (sum(abs(F(w)) * abs(v) for w, v in zip(row, t.x_exact, strict=True)) + abs(F(float(g))))
        for row, g in zip(problem.W.dense(), problem.a, strict=True)
    )
    np.testing.assert_allclose(found.multiplier_error[0], float(max(map(abs, off)) / size), rtol=1e-13)


@pytest.mark.parametrize("task", ["exact", "least_squares", "damped"])
def test_without_multipliers_the_best_ones_are_assumed(task: str) -> None:
    """An answer with no y is held to the dual residual that the best y leaves; for damping the slack joints give y."""
    problem, x, _ = integer_problem(2, task)
    found = judged(yardstick(problem, task), x, [np.nan, np.nan])
    J, slope = problem.J, problem.W.dense() @ x + problem.a
    if task == "damped":
        left = DAMPING**2 * slope + J.T @ problem.Wx @ (J @ x - problem.xdot)
        assert found.primal_residual[0] == 0
    else:
        left = slope - J.T @ np.linalg.lstsq(J.T, slope, rcond=None)[0]
    np.testing.assert_allclose(found.dual_residual[0], np.abs(left).max(), rtol=1e-12)
    assert found.residuals_met[0] == 0 and np.isnan(found.multiplier_error[0])
    right = judged(yardstick(problem, task), truth(problem, task).x, [np.nan, np.nan])
    assert right.residuals_met[0] == 1 and verdicts(right) == ["verified"]


def test_rank_deficient_rows_are_projected_out_by_their_exact_rank() -> None:
    """With two equal rows and no y, only the part of the slope in the true null space of J counts."""
    problem = VelocityProblem([[1.0, 0, 0], [2, 0, 0]], [1.0, 2], np.eye(3), [5.0, 0, 0])
    found = judged(yardstick(problem), [[1.0, 0, 0], [1, 0.25, 0]], np.full((2, 2), np.nan))
    np.testing.assert_allclose(found.dual_residual, [0, 0.25], atol=1e-15)
    assert found.residuals_met.tolist() == [1, 0]


def test_motion_along_the_freedom_is_no_error() -> None:
    """Where the minimum is not unique x may move along Z, and y with it where W is indefinite; across Z it may not."""
    problem = VelocityProblem([[1.0, 0, 0]], [1.0], [[0, 2.0, 0], [2, 0, 0], [0, 0, 1]], [2.0, -2, -1])
    assert truth(problem).expected == "minimum_not_unique"
    t = np.array([0.0, 3, -50])
    x, y = np.stack([1 + 0 * t, t, 1 + 0 * t], axis=-1), (-2 - 2 * t)[:, None]
    found = judged(yardstick(problem), x, y)
    assert verdicts(found) == ["verified"] * 3
    assert (found.error <= 1e-15).all() and (found.multiplier_error <= 1e-15).all() and (found.residuals_met == 1).all()
    stale = judged(yardstick(problem), x[1:], y[:1].repeat(2, axis=0))
    assert (stale.multiplier_error > 1).all() and "verified" not in verdicts(stale)
    across = judged(yardstick(problem), x + np.array([0, 0, 0.5]), y)
    np.testing.assert_allclose(across.error * yardstick(problem).size, 0.5)
    assert "verified" not in verdicts(across)


def test_multipliers_are_compared_by_what_they_do() -> None:
    """Where rows repeat, any y with the right J'y is right; one with another J'y is caught though x is exact."""
    problem = VelocityProblem([[1.0, 1], [1, 1]], [2.0, 2], np.eye(2), [1.0, 1])
    found = judged(yardstick(problem), [[1.0, 1]] * 3, [[-2.0, 0], [5, -7], [-2, -2]])
    np.testing.assert_array_equal(found.multiplier_error, [0, 0, 1])  # 2 off, of |W||x| + |a| = 2
    assert verdicts(found) == ["verified", "verified", "inaccurate"]


@pytest.mark.parametrize("task", ["exact", "damped"])
def test_multipliers_may_be_as_far_off_as_the_slope(task: str) -> None:
    """Multipliers are excused up to 1000 times what the tolerances of x and of the slope explain, and up to 1e-3."""
    scale = DAMPING**2 if task == "damped" else 1.0
    a1 = 1 / scale  # so that x = (2, 0), |y| = scale (6 + a1) = size of the multipliers
    slope = scale * (6 + a1)
    problem = VelocityProblem([[1.0, 0]], [2 + slope if task == "damped" else 2], np.diag([3.0, 1]), [a1, 0])
    stick = yardstick(problem, task)
    np.testing.assert_allclose(stick.x, [[2, 0]], atol=1e-14)
    x, sides = [[2.0, 0]] * 2, np.array([[1 - JUST], [1 + JUST]])
    found = judged(stick, x, -slope * (1 + FALSE_RELATIVE * sides))
    np.testing.assert_allclose(found.multiplier_error, FALSE_RELATIVE * sides[:, 0], rtol=1e-9)
    assert verdicts(found) == ["verified", "inaccurate"]
    eps = 2.0**-10
    for given in ((eps, 0), (0, eps)):
        allowed = allowance(2, given)
        tolerance = judged(stick, x, [[-slope]] * 2, allowed).tolerance * stick.size[0]
        edge = FALSE_FACTOR * (scale * 3 * tolerance[0] + SOLVER_SLACK * given[1])
        assert edge / slope > FALSE_RELATIVE
        assert verdicts(judged(stick, x, -slope - edge * sides, allowed)) == ["verified", "inaccurate"]


def test_tolerance_is_its_formula() -> None:
    """T = [2 (eps_p |X12| + eps_d |X11|) + 50 (n+m) u spread] / size for solvers, its own bound for a closed form."""
    problem = VelocityProblem(F1, [1, 1], np.diag([-1.0, 1, 1]), [1, 0, 2])
    stick = yardstick(problem)
    eps = np.array([[0, 0], [1e-3, 0], [0, 1e-3], [1e-9, 1e-6]])
    found = judged(stick, np.tile(stick.x, (4, 1)), np.tile(stick.y, (4, 1)), allowance(4, eps.T))
    expected = SOLVER_SLACK * eps @ [stick.primal_gain[0], stick.dual_gain[0]] + FORWARD * 5 * UNIT * stick.spread[0]
    np.testing.assert_allclose(found.tolerance, expected / stick.size[0], rtol=1e-14)
    bound = np.array([1e-12, 0.5])
    found = judged(stick, np.tile(stick.x, (2, 1)), np.tile(stick.y, (2, 1)), Allowance.of_closed_form(bound))
    np.testing.assert_array_equal(found.tolerance, bound)


@pytest.mark.parametrize("scale", [2.0**20, 2.0**-20])
def test_error_and_tolerance_do_not_change_with_units(scale: float) -> None:
    """Scaling W and a, or a row of J and of xdot, leaves error, tolerance, gap share and multiplier error."""
    rows = np.array([1, scale])
    W, a, x, y = np.diag([-1.0, 1, 1]), np.array([1.0, 0, 2]), np.array([1.5, -2, 1]), np.array([-3.0, 1])
    one = judged(yardstick(VelocityProblem(F1, [1, 1], W, a)), x, y)
    other = judged(yardstick(VelocityProblem(rows[:, None] * F1, rows, scale * W, scale * a)), x, scale * y / rows)
    for name in ("error", "tolerance", "multiplier_error"):
        np.testing.assert_allclose(getattr(other, name), getattr(one, name), rtol=1e-10, err_msg=name)
    np.testing.assert_allclose(other.objective_gap, scale * one.objective_gap, rtol=1e-12)


def test_at_rest_the_error_is_absolute() -> None:
    """Asked for no motion and given no gradient, a closed form must answer 0, a solver within its tolerance."""
    stick = yardstick(VelocityProblem(F1, [0, 0], np.eye(3)))
    assert stick.size[0] == 0
    step = 1e-3 * np.array([[1.0], [0.999], [0]]) * [-1, 1, 1]
    eps = 1e-3 / SOLVER_SLACK / stick.dual_gain[0]
    found = judged(stick, step, np.zeros((3, 2)), allowance(3, (0, eps * 0.9995)))
    np.testing.assert_array_equal(found.error, [1e-3, 0.999e-3, 0])
    assert [v == "verified" for v in verdicts(found)] == [False, True, True]
    assert found.residuals_met[2] == 1
    exactly = judged(stick, 0 * step, np.zeros((3, 2)))
    assert (exactly.residuals_met == 1).all() and verdicts(exactly) == ["verified"] * 3
    pulled = judged(stick, 0 * step, [[0.25, 0], [0, -0.125], [FALSE_RELATIVE, 0]])
    np.testing.assert_array_equal(pulled.multiplier_error, [0.25, 0.25, FALSE_RELATIVE])  # J'y itself
    assert verdicts(pulled) == ["inaccurate", "inaccurate", "verified"]
    far = judged(stick, 5 * step, np.zeros((3, 2)), allowance(3, (0, 6 * eps)))
    assert verdicts(far) == ["verified"] * 3  # there is nothing to be relative to: the cap has no say
    closed = judged(stick, 1e-14 * step, np.zeros((3, 2)), Allowance.of_closed_form(np.full(3, 1e-3)))
    assert [v == "verified" for v in verdicts(closed)] == [False, False, True]


def test_residuals_are_met_up_to_twice_the_tolerance() -> None:
    """residuals_met turns at 2 eps, for the rows and for stationarity each on its own."""
    problem = VelocityProblem([[1.0, 0]], [1.0], np.eye(2))
    stick, eps = yardstick(problem), 2.0**-10
    step = SOLVER_SLACK * eps * np.array([1 - JUST, 1 + JUST])
    rows = np.array([[1 + d, 0] for d in step])
    found = judged(stick, rows, -rows[:, :1], allowance(2, (eps, 0)))
    np.testing.assert_allclose(found.primal_residual, step)
    assert found.residuals_met.tolist() == [1, 0]
    assert judged(stick, rows, -rows[:, :1], allowance(2, (0, 1e3))).residuals_met.tolist() == [0, 0]
    for x, y in (([1.0, 0], -1 - step[:, None]), (np.array([[1, d] for d in step]), np.full((2, 1), np.nan))):
        x = np.broadcast_to(x, (2, 2))
        found = judged(stick, x, y, allowance(2, (0, eps)))
        np.testing.assert_allclose(found.dual_residual, step)
        assert found.residuals_met.tolist() == [1, 0]
        assert judged(stick, x, y, allowance(2, (1e3, 0))).residuals_met.tolist() == [0, 0]


@pytest.mark.parametrize("task", ["exact", "least_squares"])
def test_rounding_is_no_missed_residual(task: str) -> None:
    """With no tolerance at all the residuals may reach 50 (n+m) u of the terms that cancel in them, and no more."""
    J, target = (3.0, 5.0) if task == "least_squares" else (4.0, None)
    problem = VelocityProblem([[J, 0]], [J], np.diag([2.0, 1]), [0.5, 0], None if target is None else [[target]])
    stick, edge = yardstick(problem, task), FORWARD * 3 * UNIT
    across = J * (target or 1) if task == "least_squares" else 1.0  # what turns a miss of the rows into the residual
    step = np.array([0.99, 1.01]) * edge * 2  # |J||x| + |xdot| = 2 J
    found = judged(stick, [[1 + d, 0] for d in step], np.full((2, 1), np.nan))
    np.testing.assert_allclose(found.primal_residual, across * J * step, rtol=1e-2)
    assert found.residuals_met.tolist() == [1, 0]
    step = np.array([0.99, 1.01]) * edge * 5  # |W||x| + |a| + |J'y| = 2 + 0.5 + 2.5
    y = (-2.5 + step[:, None]) / J
    found = judged(stick, [[1.0, 0]] * 2, y)
    assert found.residuals_met.tolist() == [1, 0]
    found = judged(stick, [[1.0, d] for d in step], np.full((2, 1), np.nan))
    assert found.residuals_met.tolist() == [1, 0]


def test_rounding_of_damping_is_no_missed_residual() -> None:
    """The same for damping: Wx(|J||x| + |xdot|) in its rows, and J' of that where y comes from the slack joints."""
    problem = VelocityProblem([[4.0, 0]], [5.0], np.diag([8.0, 1]), [1.0, 0], [[2.0]])
    s = DAMPING**2  # at x = (1, 0): y = Wx(J x - xdot) = -2, slope s (8 + a1), a1 such that both cancel
    problem = VelocityProblem(problem.J, problem.xdot, problem.W, [8 / s - 8, 0], problem.Wx)
    stick, edge = yardstick(problem, "damped"), FORWARD * 3 * UNIT
    np.testing.assert_allclose(stick.x[0], [1, 0], atol=1e-15)
    step = np.array([0.99, 1.01]) * edge
    found = judged(stick, [[1.0, 0]] * 2, -2 + step[:, None] * 18, allowance(2, (0, 1e9)))  # Wx (4 + 5)
    assert found.residuals_met.tolist() == [1, 0]
    found = judged(stick, [[1.0, 0]] * 2, -2 + step[:, None] * 4, allowance(2, (1e9, 0)))  # (8 + 8) / |J|
    assert found.residuals_met.tolist() == [1, 0]
    motion = step * (8 + 4 * 18) / (8 * s + 32)  # s |W||x| + s |a| + |J'| Wx (4 + 5), over the slope's own slope
    found = judged(stick, [[1.0 + d, 0] for d in motion], np.full((2, 1), np.nan))
    assert found.residuals_met.tolist() == [1, 0]


def test_terms_that_cancel_count_in_full() -> None:
    """The rounding allowed is that of |W||x| + |a| + |J'||y| and |J||x|: signs that cancel in W x, J x do not cancel in it."""
    problem = VelocityProblem([[2.0, -2]], [0.0], [[2.0, -1], [-1, 2]], [1.0, -3])
    stick = yardstick(problem)  # x = (1, 1), y = -1: W x = (1, 1), J x = 0
    np.testing.assert_allclose(stick.x, [[1, 1]])
    np.testing.assert_allclose(stick.y, [[-1]])
    sides, edge = np.array([0.98, 1.02]), FORWARD * 3 * UNIT
    wide = allowance(2, (0, 1e9))
    found = judged(stick, [[1 + d, 1] for d in sides * edge * 4 / 2], [[-1.0]] * 2, wide)  # |J||x| = 4, J dx = 2 d
    assert found.residuals_met.tolist() == [1, 0]
    found = judged(stick, [[1.0, 1]] * 2, -1 - sides[:, None] * edge * 8 / 2)  # 3 + 3 + 2, J'dy = 2 d
    assert found.residuals_met.tolist() == [1, 0]
    found = judged(stick, [[1 + d, 1 + d] for d in sides * edge * 8], [[np.nan]] * 2)  # W dx = d
    assert found.residuals_met.tolist() == [1, 0]
    eps = UNIT * np.array([[4, 8], [3.9, 8], [4, 7.9]])
    assert judged(stick, [[1.0, 1]] * 3, [[-1.0]] * 3, allowance(3, eps.T)).attainable.tolist() == [1, 0, 0]
    back = yardstick(VelocityProblem([[1.0, 0]], [-2.0], np.eye(2)))  # |J||x| + |xdot| = 4
    found = judged(back, [[-2 - d, 0] for d in sides * edge * 4], [[2.0]] * 2, wide)
    assert found.residuals_met.tolist() == [1, 0]
    eps = UNIT * np.array([[4, 4], [3.9, 4]])
    assert judged(back, [[-2.0, 0]] * 2, [[2.0]] * 2, allowance(2, eps.T)).attainable.tolist() == [1, 0]


def test_small_problems_are_relative_too() -> None:
    """Error and tolerance are divided by the size of the answer also where that is below 1."""
    small = 2.0**-10
    stick = yardstick(VelocityProblem([[1.0, 0]], [small], np.eye(2)))
    found = judged(stick, [small * 1.25, 0], [np.nan], allowance(1, (small / 4, 0)))
    np.testing.assert_allclose((found.error[0], found.tolerance[0]), (0.25, 0.5), rtol=1e-12)


def test_residuals_met_has_no_value_without_an_answer() -> None:
    """A refusal, and an answer with a NaN, have no residuals to meet; an iterate at the limit has."""
    stick = yardstick(VelocityProblem([[1.0, 0]], [1.0], np.eye(2)))
    assert judged(stick, [1, 0], [-1], status=Status.LIMIT).residuals_met[0] == 1
    assert judged(stick, [2, 0], [-1], status=Status.LIMIT).residuals_met[0] == 0
    assert judged(stick, [1, 0], [-1], status=Status.NONCONVEX).residuals_met[0] == -1
    for bad in (np.nan, np.inf):
        found = judged(stick, [1, bad], [-1])
        assert (found.residuals_met[0], found.found[0], verdicts(found)) == (-1, False, ["false_success"])
        half = judged(yardstick(VelocityProblem(np.eye(2, 3), [1, 1], np.eye(3))), [1, 1, 0], [-1, bad])
        assert half.residuals_met[0] == 1 and np.isnan(half.multiplier_error[0]) and verdicts(half) == ["verified"]
        broken = judged(stick, [1, 0], [bad])
        assert broken.found[0] and np.isnan(broken.multiplier_error[0]) and verdicts(broken) == ["verified"]


def test_attainable_says_what_float64_can_reach() -> None:
    """Rounding u (|W||x| + |a| + |J'||y|) and u (|J||x| + |xdot|) must each lie below their own tolerance."""
    problem = VelocityProblem([[4.0, 0]], [4.0], np.diag([2.0, 1]), [0.5, 0])
    stick = yardstick(problem)  # x = (1, 0), y = -2.5/4
    dual, primal = 5 * UNIT, 8 * UNIT
    eps = [(primal, dual), (0.99 * primal, dual), (primal, 0.99 * dual), (1, 0), (0, 1), (0, 0)]
    found = judged(stick, np.tile([1.0, 0], (6, 1)), np.full((6, 1), -0.625), allowance(6, np.array(eps).T))
    assert found.attainable.tolist() == [1, 0, 0, 0, 0, 1]  # where nothing is asked nothing is missed
    none = judged(yardstick(VelocityProblem([[4.0, 0]], [4.0], -np.eye(2))), [1, 0], [0])
    assert none.attainable[0] == -1
    s = DAMPING**2
    damped = yardstick(VelocityProblem([[4.0, 0]], [5.0], np.diag([8.0, 1]), [4 / s - 8, 0]), "damped")  # x = (1, 0), y = -1
    eps = [(9 * UNIT, 8 * UNIT), (9 * UNIT, 7.9 * UNIT), (8.9 * UNIT, 8 * UNIT)]
    found = judged(damped, np.tile([1.0, 0], (3, 1)), np.full((3, 1), -1.0), allowance(3, np.array(eps).T))
    assert found.attainable.tolist() == [1, 0, 0]


def test_effective_tolerances_are_absolute_plus_relative() -> None:
    """Each eps is absolute + relative times the QP's size; a size that is not finite counts as 0; the cap is the level's."""
    scale = np.array([2.0, np.nan, np.inf])
    allowed = Allowance.of_solver((1e-3, 1e-2, 1e-5, 1e-4), scale, 10 * scale, "default")
    np.testing.assert_allclose(allowed.eps_primal, [1e-3 + 2e-2, 1e-3, 1e-3])
    np.testing.assert_allclose(allowed.eps_dual, [1e-5 + 2e-3, 1e-5, 1e-5])
    assert np.isnan(allowed.bound).all()
    for level, cap in VERIFIED_RELATIVE.items():
        assert (Allowance.of_solver((0, 0, 0, 0), scale, scale, level).cap == cap).all()
    closed = Allowance.of_closed_form(np.array([1e-9, 1e-3]))
    assert not closed.eps_primal.any() and not closed.eps_dual.any()
    assert closed.bound.tolist() == [1e-9, 1e-3] and (closed.cap == VERIFIED_RELATIVE["high_accuracy"]).all()
    joined = Allowance.joined([allowed, closed], [np.array([2, 0]), np.array([1])])
    np.testing.assert_allclose(joined.eps_primal, [1e-3, 1e-3 + 2e-2, 0])
    assert np.isnan(joined.bound[:2]).all() and joined.bound[2] == 1e-3
    np.testing.assert_array_equal(joined.cap, [2e-2, 2e-2, 1e-3])


@pytest.mark.parametrize("level", VERIFIED_RELATIVE)
def test_no_answer_beyond_the_cap_is_verified(level: str) -> None:
    """However generous the tolerance, the cap of the settings level is the end of verified."""
    stick = yardstick(VelocityProblem([[1.0, 0]], [1.0], np.eye(2)))
    cap = VERIFIED_RELATIVE[level]
    x = [[1 + cap * (1 - JUST), 0], [1 + cap * (1 + JUST), 0]]
    assert verdicts(judged(stick, x, [[np.nan]] * 2, allowance(2, (0.05, 0.05), level))) == ["verified", "inaccurate"]


@pytest.mark.parametrize(
    ("xdot", "pull", "edge"),
    [(2.0, 2.0**10, 1e-3), (0.0, 2.0**10, 1.024), (0.0, 2.0**-10, 1e-3 * 2.0**-10), (2.0, 2.0**50, 150 * UNIT * 2.0**50)],
)
def test_a_verified_answer_has_digits_of_its_own(xdot: float, pull: float, edge: float) -> None:
    """Where large terms cancel in x, the cap is relative to x; to the terms where x is 0; rounding of them is excused."""
    problem = VelocityProblem([[1.0, 1]], [xdot], np.eye(2), [pull, pull])  # x = xdot (1, 1)/2, size = pull + xdot/2
    stick = yardstick(problem)
    allowed = Allowance.of_closed_form(np.ones(2))
    x = stick.x + edge * np.array([[1 - JUST, 0], [1 + JUST, 0]])
    assert [v == "verified" for v in verdicts(judged(stick, x, [[np.nan]] * 2, allowed))] == [True, False]
    near = replace(stick, margin=np.zeros(1))
    by_rounding = edge > 2  # near a boundary nobody knows which answer the rounding belongs to
    assert (verdicts(judged(near, x, [[np.nan]] * 2, allowed))[0] == "verified") == (not by_rounding)


def test_beyond_excuse_needs_both_a_thousandfold_and_a_thousandth() -> None:
    """False success by error: more than 1000 T and more than 1e-3; either alone is inaccurate."""
    problem = VelocityProblem([[1.0, 0]], [1.0], np.eye(2))
    stick = yardstick(problem)
    for T, edge in ((1e-9, FALSE_RELATIVE), (5e-6, FALSE_FACTOR * 5e-6)):
        allowed = Allowance.of_closed_form(np.full(3, T))
        # whether the residuals are met must not decide: tolerances wide open
        allowed = replace(allowed, eps_primal=np.ones(3), eps_dual=np.ones(3))
        x = [[1 + edge * f, 0] for f in (1 - JUST, 1 + JUST, 0)]
        assert verdicts(judged(stick, x, [[np.nan]] * 3, allowed)) == ["inaccurate", "false_success", "verified"]


def test_missed_residuals_leave_a_hundredth() -> None:
    """With its own conditions missed an answer is false from 1e-2 on, however generous T; with them met it is not."""
    stick = yardstick(VelocityProblem([[1.0, 0]], [1.0], np.eye(2)))
    x = [[1 + FALSE_RESIDUAL_RELATIVE * f, 0] for f in (1 - JUST, 1 + JUST)]
    missed = Allowance.of_closed_form(np.full(2, 1e-4))
    assert verdicts(judged(stick, x, [[np.nan]] * 2, missed)) == ["inaccurate", "false_success"]
    met = replace(missed, eps_primal=np.ones(2), eps_dual=np.ones(2))
    assert verdicts(judged(stick, x, [[np.nan]] * 2, met)) == ["inaccurate", "inaccurate"]
    # an error within tolerance and cap is right whatever the residuals say
    generous = replace(missed, bound=np.full(2, 0.5), cap=np.full(2, 0.5))
    assert verdicts(judged(stick, x, [[np.nan]] * 2, generous)) == ["verified"] * 2


def test_the_edges_themselves_are_on_the_good_side() -> None:
    """An error of exactly the tolerance, or exactly the cap, is verified."""
    stick = replace(yardstick(VelocityProblem([[1.0, 0]], [1.0], np.eye(2))), size=np.array([1.0]))
    x, met = [[1 + 2.0**-12, 0]], {"eps_primal": np.ones(1), "eps_dual": np.ones(1)}
    allowed = replace(Allowance.of_closed_form(np.array([2.0**-12])), **met)
    assert verdicts(judged(stick, x, [[np.nan]], allowed)) == ["verified"]
    assert verdicts(judged(stick, x, [[np.nan]], replace(allowed, bound=np.ones(1), cap=np.array([2.0**-12])))) == ["verified"]
    assert verdicts(judged(stick, [[1.0, 0]], [[np.nan]], Allowance.of_closed_form(np.zeros(1)))) == ["verified"]
    thousandfold = 1 + FALSE_FACTOR * 2.0**-12
    assert verdicts(judged(stick, [[thousandfold, 0]], [[np.nan]], allowed)) == ["inaccurate"]
    rest = replace(yardstick(VelocityProblem([[1.0, 0]], [0.0], np.eye(2))), size=np.array([1.0]))
    strict = replace(allowed, bound=np.full(1, 1e-9))
    assert verdicts(judged(rest, [[FALSE_RELATIVE, 0]], [[np.nan]], strict)) == ["inaccurate"]
    missed = Allowance.of_closed_form(np.full(1, 1e-4))
    assert verdicts(judged(rest, [[FALSE_RESIDUAL_RELATIVE, 0]], [[np.nan]], missed)) == ["inaccurate"]


def test_near_a_boundary_refusals_are_excused() -> None:
    """Undecidable below 10 eps of the larger tolerance, and below 1e3 (n+m) u for closed forms and exact engines."""
    problem = VelocityProblem([[1.0, 0]], [1.0], np.diag([1.0, 2.0**-20]))
    stick = yardstick(problem)
    assert stick.margin[0] == 2.0**-20
    nothing = np.full((2, 2), np.nan), np.full((2, 1), np.nan)
    turn = 2.0**-20 / UNDECIDABLE_SOLVER * np.array([1 - JUST, 1 + JUST])
    for eps in ((turn, 0), (0, turn)):
        found = judged(stick, *nothing, allowance(2, eps), status=Status.NONCONVEX)
        assert verdicts(found) == ["wrong_refusal", "undecidable"]
    edge = UNDECIDABLE_CLOSED_FORM * 3 * UNIT
    two = stick[np.array([0, 0])]
    rounding = replace(two, margin=edge * np.array([1 + JUST, 1 - JUST]))
    for allowed in (allowance(2), Allowance.of_closed_form(np.ones(2)), allowance(2, (1e-30, 1e-30))):
        assert verdicts(judged(rounding, *nothing, allowed, Status.NONCONVEX)) == ["wrong_refusal", "undecidable"]
    exactly = replace(two, margin=np.full(2, edge))
    assert verdicts(judged(exactly, *nothing, allowance(2), Status.NONCONVEX)) == ["wrong_refusal"] * 2
    assert verdicts(judged(exactly, *nothing, allowance(2), Status.NONCONVEX, promised=False)) == ["out_of_scope"] * 2


def test_a_true_reason_is_told_from_a_false_one() -> None:
    """reason_right judges refusals of problems with nothing to solve, and nothing else."""
    falls = VelocityProblem([[1.0, -1, 0]], [0.0], np.diag([0.0, 0, 1]), [1.0, 1, 0])
    straight = VelocityProblem([[1.0, 0, 0]], [0.0], np.zeros((3, 3)), [0, 1.0, 0])
    bent = VelocityProblem([[1.0, 0, 0]], [1.0], np.diag([-1.0, 0, 1]), [0, 1.0, 0])
    saddle = VelocityProblem([[1.0, 0, 0]], [1.0], np.diag([1.0, -1, 1]))
    empty = VelocityProblem([[1.0, 0, 0], [1, 0, 0]], [1.0, 2], np.eye(3))
    fine = VelocityProblem([[1.0, 0, 0]], [1.0], np.eye(3))
    expected = {
        (falls, Status.UNBOUNDED): 1, (falls, Status.NONCONVEX): 0, (falls, Status.CONDITION_SEVEN): 1,
        (straight, Status.NONCONVEX): 0,
        (bent, Status.NONCONVEX): 1, (saddle, Status.NONCONVEX): 1, (saddle, Status.INFEASIBLE): 0,
        (saddle, Status.LIMIT): -1, (saddle, Status.SOLVED): -1, (saddle, Status.CRASHED): -1,
        (empty, Status.INFEASIBLE): 1, (empty, Status.RANK_DEFICIENT): 1, (empty, Status.NONCONVEX): 0,
        (fine, Status.NONCONVEX): -1,
    }  # fmt: skip
    for (problem, status), right in expected.items():
        nothing = np.full((1, 3), np.nan), np.full((1, problem.m), np.nan)
        assert judged(yardstick(problem), *nothing, status=status).reason_right[0] == right, (status, right)


@pytest.mark.parametrize("scale", [1.0, 2.0**20, 2.0**-20])
def test_convex_up_to_rounding_is_convex(scale: float) -> None:
    """A semidefinite W whose zero eigenvalue comes out as -1e-16 |W| makes "not convex" no truer a reason."""
    W = scale * np.array([[1.0, 2, 3], [2, 4, 6], [3, 6, 9]])
    falls = VelocityProblem([[2.0, -1, 0]], [0.0], W, scale * np.array([1.0, 1, 1]))
    stick = yardstick(falls)
    assert stick.reason == ["descending"] and stick.lambda_min_W[0] < 0
    nothing = np.full((1, 3), np.nan), np.full((1, 1), np.nan)
    assert judged(stick, *nothing, status=Status.NONCONVEX).reason_right[0] == 0
    assert judged(stick, *nothing, status=Status.UNBOUNDED).reason_right[0] == 1
    edge = -3 * 2 * UNIT * stick.norm_W
    for share, right in ((0.99, 0), (1.01, 1)):
        bent = replace(stick, lambda_min_W=share * edge)
        assert judged(bent, *nothing, status=Status.NONCONVEX).reason_right[0] == right


def test_nothing_to_solve_leaves_no_figures() -> None:
    """Where there is no minimum, error, gap and multiplier error are null, and any answer is false."""
    found = judged(yardstick(VelocityProblem([[1.0, 0]], [1.0], np.diag([1.0, -1]))), [1, 0], [-1])
    assert verdicts(found) == ["false_success"]
    assert found.residuals_met[0] == 1  # a maximum along the rows: first-order conditions cannot tell
    assert np.isnan([found.error[0], found.objective_gap[0], found.multiplier_error[0], found.tolerance[0]]).all()
