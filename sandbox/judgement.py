"""Judges a stack of answers against the exact truth: residuals, error, tolerance, verdict; nothing a solver said of itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from sandbox.solution import CODE, STATUSES, Status
from sandbox.stacked import times, transpose
from sandbox.task import task_weight
from sandbox.tolerances import (
    CONDITION_SEVEN,
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
from sandbox.verdict import GRADES, REASON_RIGHT, verdicts
from sandbox.yardstick import Yardstick

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class Judgement:
    """Columns of the records of B answers; NaN and -1 stand for null. Names as in records.RECORDS."""

    verdict: Array  # codes into VERDICTS
    found: Array
    reason_right: Array  # 1, 0, or -1 where nothing was refused
    error: Array
    tolerance: Array
    residuals_met: Array  # 1, 0, or -1 where there is no answer
    attainable: Array
    primal_residual: Array
    dual_residual: Array
    objective_gap: Array
    multiplier_error: Array


@dataclass(frozen=True, eq=False)
class Allowance:
    """What a method may miss: effective tolerances of a solver, or the relative error bound of a closed form.

    eps_primal, eps_dual (B,) [units of xdot and of a]; bound (B,) relative, NaN for solvers;
    cap (B,) the relative error above which no answer is verified
    """

    eps_primal: Array
    eps_dual: Array
    bound: Array
    cap: Array

    @classmethod
    def of_solver(cls, eps: tuple[float, float, float, float], primal: Array, dual: Array, settings: str) -> Allowance:
        """Absolute plus relative tolerance times the scales `primal` and `dual` (B,) of the QP as posed."""
        primal_abs, primal_rel, dual_abs, dual_rel = eps
        with np.errstate(over="ignore", invalid="ignore"):
            eps_primal = primal_abs + primal_rel * np.where(np.isfinite(primal), primal, 0.0)
            eps_dual = dual_abs + dual_rel * np.where(np.isfinite(dual), dual, 0.0)
        return cls(eps_primal, eps_dual, np.full(len(primal), np.nan), np.full(len(primal), VERIFIED_RELATIVE[settings]))

    @classmethod
    def of_closed_form(cls, bound: Array) -> Allowance:
        """Its own error bound (B,)."""
        zero = np.zeros(len(bound))
        return cls(zero, zero, bound, zero + VERIFIED_RELATIVE["high_accuracy"])

    @classmethod
    def joined(cls, parts: Sequence[Allowance], members: Sequence[Array]) -> Allowance:
        """The chosen members of several, one after the other."""
        return cls(
            *(np.concatenate([getattr(part, f.name)[m] for part, m in zip(parts, members, strict=True)]) for f in fields(cls))
        )


def _largest(values: Array) -> Array:
    """Max norm over the last axis (B,); 0 where it is empty."""
    return np.abs(values).max(axis=-1, initial=0.0)


def _absolute_product(matrices: Array, vectors: Array) -> Array:
    """|M||v|."""
    return (np.abs(matrices) @ np.abs(vectors)[..., None])[..., 0]


def judge(yardstick: Yardstick, qdot: Array, y: Array, status: Array, allowance: Allowance, promised: Array) -> Judgement:
    """Judge answers qdot (B, n), y (B, m; NaN where none is given) with status codes (B,)."""
    with np.errstate(all="ignore"):  # answers may hold anything: NaN and inf compare as wrong, never as right
        return _judge(yardstick, qdot, y, status, allowance, promised)


def _judge(yardstick: Yardstick, qdot: Array, y: Array, status: Array, allowance: Allowance, promised: Array) -> Judgement:
    view, problem = yardstick.view, yardstick.view.problem
    n, m = problem.n, problem.m
    finite = np.isfinite(qdot).all(axis=-1)
    answered = status == CODE[Status.SOLVED]
    given = finite & np.isfinite(y).all(axis=-1)

    # residuals of the answer in the problem's own units, and the rounding they cannot go below
    x = np.where(finite[:, None], qdot, np.nan)
    gradient = view.gradient(x)
    multiplied = times(transpose(problem.J), y)
    primal_terms = _primal_terms(yardstick, x)
    if view.task == "damped":  # the slack joints fix the multipliers, given or not
        along = view.dual(x, -view.primal(x, np.zeros_like(y)))
        along_terms = _absolute_product(transpose(problem.J), primal_terms)
    else:
        along, along_terms = _null_projection(problem.J, gradient, yardstick.rank), np.abs(gradient)
    dual = _largest(np.where(given[:, None], gradient + multiplied, along))
    primal = _largest(view.primal(x, np.where(given[:, None], y, 0.0)))
    if view.task == "damped":
        primal = np.where(given, primal, 0.0)
    dense = np.abs(problem.W.dense())
    dual_terms = view.scale * (_absolute_product(dense, x) + np.abs(problem.a)) + np.where(
        given[:, None], _absolute_product(transpose(problem.J), y), along_terms
    )
    rounding = FORWARD * (n + m) * UNIT
    primal_met = primal <= SOLVER_SLACK * allowance.eps_primal + rounding * _largest(primal_terms)
    dual_met = dual <= SOLVER_SLACK * allowance.eps_dual + rounding * _largest(dual_terms)
    conditions_met = finite & primal_met & dual_met

    # distance to the exact minimisers, relative to what the data can move them by
    difference = np.where(yardstick.solvable[:, None], x - yardstick.x, np.nan)
    free = times(yardstick.freedom, difference)
    offset = difference - free
    size = np.where(yardstick.size > 0, yardstick.size, 1.0)
    error = _largest(offset) / size
    gains = SOLVER_SLACK * (allowance.eps_primal * yardstick.primal_gain + allowance.eps_dual * yardstick.dual_gain)
    tolerance = np.where(
        np.isnan(allowance.bound),
        (gains + FORWARD * (n + m) * UNIT * yardstick.spread) / size,
        np.where(yardstick.size > 0, allowance.bound, 0.0),
    )

    # multipliers by J'y, unique even where y is not; it moves with x along the freedom, where W is indefinite
    true_multiplied = times(transpose(problem.J), yardstick.y)
    true_multiplied = true_multiplied - view.scale * problem.W.times(free[..., None])[..., 0]
    multiplier_size = _largest(view.scale * (_absolute_product(dense, yardstick.x) + np.abs(problem.a)))
    multiplier_size = np.where(multiplier_size > 0, multiplier_size, 1.0)
    multiplier_error = np.where(given, _largest(multiplied - true_multiplied), np.nan) / multiplier_size
    multiplier_tolerance = (
        view.scale * yardstick.norm_W * tolerance * size + SOLVER_SLACK * allowance.eps_dual
    ) / multiplier_size + rounding
    multipliers_wrong = given & ~(
        (multiplier_error <= FALSE_FACTOR * multiplier_tolerance) | (multiplier_error <= FALSE_RELATIVE)
    )

    near = yardstick.margin < np.where(
        np.isnan(allowance.bound),
        np.maximum(
            UNDECIDABLE_SOLVER * np.maximum(allowance.eps_primal, allowance.eps_dual),
            UNDECIDABLE_CLOSED_FORM * (n + m) * UNIT,
        ),
        UNDECIDABLE_CLOSED_FORM * (n + m) * UNIT,
    )
    # however generous the tolerance: digits of the answer itself, or rounding of the terms that cancel in it
    length = _largest(yardstick.x)
    length = np.where(length > 0, length, np.where(yardstick.size > 0, yardstick.size, np.inf))
    has_digits = (_largest(offset) <= allowance.cap * length) | ((error <= rounding) & ~near)
    right = (error <= tolerance) & has_digits
    beyond = ~(error <= FALSE_FACTOR * tolerance) & ~(error <= FALSE_RELATIVE)
    beyond |= ~conditions_met & ~(error <= FALSE_RESIDUAL_RELATIVE)
    grade = np.where(right & ~multipliers_wrong, 0, np.where(beyond & ~right, 2, 1))
    code = verdicts(yardstick.expected, status, promised, finite, near, conditions_met, grade)

    refused = np.array([STATUSES[s].refused for s in status], dtype=bool)
    reason_right = np.where(refused & ~yardstick.solvable, REASON_RIGHT[yardstick.expected, status], -1)
    # a descending direction of a convex W, singular up to rounding: "not convex" is no true reason
    convex = yardstick.lambda_min_W >= -CONDITION_SEVEN * n * 2 * UNIT * yardstick.norm_W
    reason_right = np.where((reason_right == 1) & convex & (status == CODE[Status.NONCONVEX]), 0, reason_right)
    gap = 0.5 * view.scale * np.sum(difference * problem.W.times(difference[..., None])[..., 0], axis=-1)
    if view.task == "damped":  # the slack joints move by -J dx
        slack = times(problem.J, difference)
        gap = gap + 0.5 * np.sum(slack * times(task_weight(problem), slack), axis=-1)
    attainable = _attainable(yardstick, allowance, dense)
    return Judgement(
        verdict=code, found=finite, reason_right=reason_right, error=error, tolerance=tolerance,
        residuals_met=np.where(finite & (answered | (status == CODE[Status.LIMIT])), conditions_met, -1),
        attainable=attainable, primal_residual=primal, dual_residual=dual, objective_gap=gap,
        multiplier_error=multiplier_error,
    )  # fmt: skip


def _null_projection(J: Array, gradient: Array, rank: Array) -> Array:
    """N N'(gradient): the dual residual that the best multipliers would leave (B, n)."""
    _, _, Vt = np.linalg.svd(J)
    keep = (np.arange(J.shape[-1]) >= rank[:, None])[..., None]
    N = transpose(Vt) * transpose(keep)
    projected: Array = (N @ (transpose(N) @ gradient[..., None]))[..., 0]
    return projected


def _primal_terms(yardstick: Yardstick, x: Array) -> Array:
    """|J||x| + |xdot| and what the task makes of it: the sizes that cancel in the primal residual."""
    problem, task = yardstick.view.problem, yardstick.view.task
    terms = _absolute_product(problem.J, x) + np.abs(problem.xdot)
    if task == "exact":
        return terms
    weighted = _absolute_product(task_weight(problem), terms)
    return weighted if task == "damped" else _absolute_product(transpose(problem.J), weighted)


def _attainable(yardstick: Yardstick, allowance: Allowance, dense: Array) -> Array:
    """Whether float64 can reach the tolerances asked: 1, 0, or -1 where there is no minimum or nothing is asked."""
    view, problem = yardstick.view, yardstick.view.problem
    at_best_dual = UNIT * _largest(
        view.scale * (_absolute_product(dense, yardstick.x) + np.abs(problem.a))
        + _absolute_product(transpose(problem.J), yardstick.y)
    )
    at_best_primal = UNIT * _largest(_absolute_product(problem.J, yardstick.x) + np.abs(problem.xdot))
    reachable = (at_best_dual <= allowance.eps_dual) & (at_best_primal <= allowance.eps_primal)
    asked = (allowance.eps_dual > 0) | (allowance.eps_primal > 0)
    return np.where(yardstick.solvable, np.where(asked, reachable, 1), -1)


assert GRADES == ("within", "between", "beyond")  # the codes 0, 1, 2 above
