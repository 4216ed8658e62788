"""Every check can fail: planted wrong answers of every kind, in closed-form and solver tolerances, are caught."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from problems import sets
from sandbox.judgement import Allowance, Judgement, judge
from sandbox.problem import VelocityProblem
from sandbox.reference.truth import truth
from sandbox.solution import CODE, Status
from sandbox.verdict import VERDICTS
from sandbox.yardstick import Yardstick

Array = np.ndarray


def clean(problem: VelocityProblem) -> tuple[Yardstick, Array, Array]:
    """A yardstick with the exact answers of a stack."""
    yardstick = Yardstick.of(problem, "exact", truth(problem, "exact"))
    return yardstick, yardstick.x.copy(), yardstick.y.copy()


def judged(yardstick: Yardstick, x: Array, y: Array, status: Status = Status.SOLVED) -> Judgement:
    """The judgement at high accuracy (absolute tolerance 1e-9)."""
    B = len(x)
    allowance = Allowance.of_solver((1e-9, 0.0, 1e-9, 0.0), np.ones(B), np.ones(B), "high_accuracy")
    return judge(yardstick, x, y, np.full(B, CODE[status], np.int8), allowance, np.ones(B, bool))


def verdicts(judgement: Judgement) -> list[str]:
    return [VERDICTS[code] for code in judgement.verdict]


@pytest.fixture(scope="module")
def regular() -> VelocityProblem:
    """Well-conditioned problems with one minimum, some with indefinite W."""
    for group in sets.load("planar").groups:
        yardstick = Yardstick.of(group.problem, "exact", truth(group.problem, "exact"))
        good = np.flatnonzero((yardstick.margin > 1e-2) & (np.abs(yardstick.y).min(axis=-1) > 1e-3))
        if group.problem.n - group.problem.m >= 2 and len(good) >= 8:
            return group.problem[good[:8]]
    raise AssertionError("no group of the planar set is regular enough")


def test_the_true_answer_passes(regular: VelocityProblem) -> None:
    """Nothing is caught in the exact answer: the planted faults below are what is found."""
    yardstick, x, y = clean(regular)
    found = judged(yardstick, x, y)
    assert verdicts(found) == ["verified"] * len(x)
    assert (found.residuals_met == 1).all()
    assert (found.multiplier_error < 1e-12).all()


def nan(x: Array, y: Array) -> tuple[Array, Array]:
    x[:, 0] = np.nan
    return x, y


def infinite(x: Array, y: Array) -> tuple[Array, Array]:
    x[:, -1] = np.inf
    return x, y


def flipped_multipliers(x: Array, y: Array) -> tuple[Array, Array]:
    return x, -y


def perturbed(x: Array, y: Array) -> tuple[Array, Array]:
    x[:, 0] += 1e-2 * np.abs(x).max(axis=-1)
    return x, y


def truncated(x: Array, y: Array) -> tuple[Array, Array]:
    return np.round(x, 2), y


def wrong_problem(x: Array, y: Array) -> tuple[Array, Array]:
    return np.roll(x, 1, axis=0), np.roll(y, 1, axis=0)


def reversed_joints(x: Array, y: Array) -> tuple[Array, Array]:
    return x[:, ::-1].copy(), y


def zero(x: Array, y: Array) -> tuple[Array, Array]:
    return 0 * x, y


@pytest.mark.parametrize(
    ("fault", "caught_as"),
    [
        (nan, {"false_success"}),
        (infinite, {"false_success"}),
        (flipped_multipliers, {"inaccurate"}),
        (perturbed, {"false_success", "inaccurate"}),
        (truncated, {"false_success", "inaccurate"}),
        (wrong_problem, {"false_success"}),
        (reversed_joints, {"false_success"}),
        (zero, {"false_success"}),
    ],
)
def test_a_wrong_answer_is_caught(regular: VelocityProblem, fault: Callable, caught_as: set[str]) -> None:
    """An answer with this fault is never verified, and its residuals do not count as met."""
    yardstick, x, y = clean(regular)
    x, y = fault(x, y)
    found = judged(yardstick, x, y)
    assert set(verdicts(found)) <= caught_as
    assert (found.residuals_met != 1).all()


def test_a_flipped_multiplier_shows_in_its_own_columns(regular: VelocityProblem) -> None:
    """-y keeps x right, so the multiplier error and the dual residual must tell."""
    yardstick, x, y = clean(regular)
    found = judged(yardstick, x, -y)
    assert (found.error < 1e-12).all()
    assert (found.multiplier_error > 1e-3).all()
    assert (found.dual_residual > 1e-6).all()


def test_an_answer_off_along_the_null_space_is_caught(regular: VelocityProblem) -> None:
    """J qdot = xdot still holds exactly, only the minimum is missed: the primal residual alone would pass it."""
    yardstick, x, y = clean(regular)
    _, _, Vt = np.linalg.svd(regular.J)
    found = judged(yardstick, x + 0.1 * Vt[:, -1] * np.abs(x).max(axis=-1, keepdims=True), y)
    assert (found.primal_residual < 1e-12).all()
    assert set(verdicts(found)) == {"false_success"}


@pytest.mark.parametrize("reason", ["saddle", "maximum"])
def test_a_stationary_point_that_is_no_minimum_is_caught(reason: str) -> None:
    """A maximiser or saddle meets every first-order condition; only the curvature tells, and the verdict does."""
    caught = 0
    for group in sets.load("no_minimum").groups:
        truths = truth(group.problem, "exact")
        members = np.flatnonzero([t.reason == reason and t.margin > 1e-6 for t in truths])
        if not len(members):
            continue
        problem = group.problem[members]
        n, m = problem.n, problem.m
        K = np.zeros((len(members), n + m, n + m))
        K[:, :n, :n], K[:, :n, n:], K[:, n:, :n] = problem.W.dense(), np.swapaxes(problem.J, -1, -2), problem.J
        z = np.linalg.solve(K, np.concatenate([-problem.a, problem.xdot], axis=-1)[..., None])[..., 0]
        yardstick = Yardstick.of(problem, "exact", [truths[i] for i in members])
        found = judged(yardstick, z[:, :n], z[:, n:])
        assert set(verdicts(found)) == {"false_success"}
        assert (found.residuals_met == 1).mean() > 0.5  # the conditions alone would have let most of them pass
        caught += len(members)
    assert caught >= 10


def test_an_answer_without_a_right_digit_is_not_verified() -> None:
    """Near a singularity the residual hides joint rates that are off by their own length; the verdict does not."""
    caught = 0
    for group in sets.load("near_singular").groups:
        yardstick, x, y = clean(group.problem)
        _, sigma, Vt = np.linalg.svd(group.problem.J)
        hidden = (sigma[:, -1] < 1e-9) & (np.abs(x).max(axis=-1) < 10)
        if not hidden.any():
            continue
        last = group.problem.m - 1
        found = judged(yardstick, x + Vt[:, last] * np.abs(x).max(axis=-1, keepdims=True), y)
        assert (found.primal_residual[hidden] < 1e-8).all()
        assert "verified" not in {name for name, one in zip(verdicts(found), hidden, strict=True) if one}
        caught += int(hidden.sum())
    assert caught >= 5


def test_a_wrong_refusal_is_caught(regular: VelocityProblem) -> None:
    """Refusing a problem that the documentation promises to solve is no way out."""
    yardstick, x, y = clean(regular)
    found = judged(yardstick, np.full_like(x, np.nan), np.full_like(y, np.nan), Status.NONCONVEX)
    assert set(verdicts(found)) == {"wrong_refusal"}


def test_an_answer_to_an_infeasible_problem_is_caught() -> None:
    """The least-squares solution of inconsistent rows is not a solution."""
    caught = 0
    for group in sets.load("rank_deficient").groups:
        truths = truth(group.problem, "exact")
        members = np.flatnonzero([t.expected == "infeasible" for t in truths])
        if not len(members):
            continue
        problem = group.problem[members]
        x = (np.linalg.pinv(problem.J) @ problem.xdot[..., None])[..., 0]
        found = judged(Yardstick.of(problem, "exact", [truths[i] for i in members]), x, np.zeros((len(x), problem.m)))
        assert set(verdicts(found)) == {"false_success"}
        caught += len(members)
    assert caught >= 10


def test_a_closed_form_beyond_its_bound_is_caught(regular: VelocityProblem) -> None:
    """A closed form that is a little further off than its own error bound is not verified."""
    yardstick, x, y = clean(regular)
    bound = np.full(len(x), 1e-12)
    solved = np.full(len(x), CODE[Status.SOLVED], np.int8)
    x[:, 0] += 3e-12 * yardstick.size
    found = judge(yardstick, x, y, solved, Allowance.of_closed_form(bound), np.ones(len(x), bool))
    assert set(verdicts(found)) == {"inaccurate"}
