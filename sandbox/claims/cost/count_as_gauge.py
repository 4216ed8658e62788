"""How far a count of operations gauges time."""

from __future__ import annotations

import math
import time
from functools import cache
from typing import Any

import numpy as np

from sandbox.claims import operation_counts as by_hand
from sandbox.claims.claim import Answer, Claim, CodePath, Evidence, Fault, Role, Trial, at_least, at_most
from sandbox.claims.cost.comparison import (
    GENERAL,
    IDENTITY,
    PAPER,
    SHOWN,
    WORDS,
    Cell,
    cells,
    counted,
)
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.operation_counts import ROWS, Row
from sandbox.closed_form import CLOSED_FORMS
from sandbox.closed_form.compiled import compiled
from sandbox.problem import VelocityProblem
from sandbox.tolerances import IMPERFECT, RANK_CORRELATION

Array = np.ndarray


def in_turn(kernel: Any, stack: Any, args: Any, J: Array, xdot: Array, W: Array, gradf: Array, x: Array, answers: Array) -> int:
    """Copy every problem of the stack into the arrays that `args` hold and solve it there; how many were refused."""
    Js, xdots, Ws, gradfs = stack
    m, n = J.shape
    refused = 0
    for i in range(Js.shape[0]):
        for r in range(m):
            xdot[r] = xdots[i, r]
            for j in range(n):
                J[r, j] = Js[i, r, j]
        for r in range(n):
            gradf[r] = gradfs[i, r]
            for j in range(n):
                W[r, j] = Ws[i, r, j]
        if kernel(*args) != 0:
            refused += 1
        for j in range(n):
            answers[i, j] = x[j]
    return refused


@cache
def _in_turn() -> Any:
    import numba

    return numba.njit(in_turn)


def stopwatch(compiled: Answer, stack: tuple[Array, ...], repeats: int) -> tuple[dict[Row, float], dict[Row, Array]]:
    """Seconds per solve of the bare kernels on a stack, the least of `repeats` taken in turns, and the answers (B, n)."""
    B, m, n = stack[0].shape
    J, xdot, W, gradf = (np.empty(part.shape[1:]) for part in stack)
    x, loop = np.zeros(n), _in_turn()
    A, N, p = np.empty((n, n)), np.eye(n, n - m, -m), np.empty(n, dtype=np.int64)
    none = np.zeros((0, n)), np.zeros((0, 0))
    work = np.empty((n, n)), np.empty((m, n)), np.empty(n), np.empty((m, m)), x, np.empty(m)
    least, answers = dict.fromkeys(ROWS, math.inf), {row: np.empty((B, n)) for row in ROWS}
    for _ in range(repeats + 1):  # the first one compiles
        for row in ROWS:
            args: tuple[Any, ...] = (J, xdot, W, gradf, 1.0, row[1], *work)
            if row[0] == "eq6":
                args = (J, xdot, W, *none, gradf, 1.0, row[1], A, N, p, np.empty(n), np.empty((2, 0)), np.empty(n), x)
            kernel, begun = compiled(row[0]), time.perf_counter()
            refused = loop(kernel, stack, args, J, xdot, W, gradf, x, answers[row])
            least[row] = min(least[row], (time.perf_counter() - begun) / B)
            if refused:
                answers[row][:] = np.nan
    return least, answers


def drawn(rng: np.random.Generator, n: int, m: int, count: int) -> tuple[Array, ...]:
    """J, xdot, W, grad f of a stack: entries in [-1, 1), W > 0 and full."""
    W = rng.uniform(-0.25, 0.25, (count, n, n))
    W = W + np.swapaxes(W, 1, 2) + n * np.eye(n)
    return rng.uniform(-1, 1, (count, m, n)), rng.uniform(-1, 1, (count, m)), W, rng.uniform(-1, 1, (count, n))


@np.errstate(invalid="ignore")  # 0 / 0 where nothing was solved: NaN fails the check
def apart(stack: tuple[Array, ...], answers: dict[Row, Array], weighted: bool, members: int = 10) -> Array:
    """How far the answers of both methods are apart, in units of the sum of their bounds, on the first `members`."""
    J, xdot, W, gradf = (part[:members] for part in stack)
    W = W if weighted else np.broadcast_to(np.eye(J.shape[2]), W.shape)
    problem = VelocityProblem(J=J, xdot=xdot, W=W, a=gradf)
    six, normal = answers["eq6", weighted][:members], answers["eq2_5", weighted][:members]
    bound = CLOSED_FORMS["eq6"].bound(problem) + CLOSED_FORMS["eq2_5"].bound(problem)
    return np.abs(six - normal).max(axis=1) / np.abs(six).max(axis=1) / bound


def count_as_gauge(trial: Trial, compiled: Answer, count: Answer) -> Evidence:
    """The ratio of times of (6) and (2)-(5) against the ratio of counts, in one run."""
    from scipy.stats import spearmanr

    rng = trial.rng("count_as_gauge")
    within = cells(12) if trial.full else [cell for cell in cells(7) if cell[0] in (3, 5, 7)]
    seconds: dict[Cell, dict[Row, float]] = {}
    off = []
    for n, m in within:
        stack = drawn(rng, n, m, trial.of(2000, 300))
        seconds[n, m], answers = stopwatch(compiled, stack, trial.of(7, 5))
        off += [apart(stack, answers, weighted) for weighted in (False, True)]
    operations = {cell: {row: counted(count, row, cell).total for row in ROWS} for cell in within}
    ratio = {
        pair: np.array([[taken[cell][pair[0]] / taken[cell][pair[1]] for cell in within] for taken in (operations, seconds)])
        for pair in (IDENTITY, GENERAL)
    }
    correlation = [spearmanr(*ratio[pair]).statistic for pair in (IDENTITY, GENERAL)]
    counts, times = np.hstack([ratio[IDENTITY], ratio[GENERAL]])
    order, clear = (counts < 1) == (times < 1), np.maximum(counts, 1 / counts) > 2
    per = {row: [1e9 * seconds[cell][row] / operations[cell][row] for cell in within] for row in ROWS}
    six, normal = (float(np.median([per[row] for row in ROWS if row[0] == method])) for method in ("eq6", "eq2_5"))
    at = [ratio[pair][:, within.index(PAPER)] for pair in (IDENTITY, GENERAL)]
    checks = (
        at_least(
            "rank correlation of the two ratios over $n$ and $m$, for $W = I$ and for a general $W$",
            correlation, RANK_CORRELATION,
        ),
        at_least(
            "the gauge is imperfect: the largest factor between the ratio of times and that of counts",
            [np.exp(np.abs(np.log(times / counts)).max())], IMPERFECT,
            range=f"In this run the method that counts fewer operations takes less time in {order.sum()} of {len(order)} "
            f"cases, and in {(order & clear).sum()} of the {clear.sum()} where the counts differ more than twofold. (6) counts "
            f"fewer operations in {(counts < 1).sum()} cases and takes less time in {(times < 1).sum()}: in these plain scalar "
            f"loops a counted operation of (6) takes {six:.2g} ns (median), one of (2)–(5) {normal:.2g} ns. At $n = 7$, $m = "
            f"6$ (6) takes {at[0][1]:.2f} times as long as (2)–(5) for $W = I$ (counts: {at[0][0]:.2f}), and {at[1][1]:.2f} "
            f"times for a general $W$ (counts: {at[1][0]:.2f}).",
        ),
        at_most(
            "the problems timed are solved: difference of the two methods / sum of their bounds", np.concatenate(off), 1.0,
            role=Role.OURS,
        ),
    )  # fmt: skip
    names = [f"n = {n}, m = {m}" for n, m in within]
    ends = [float(min(counts.min(), times.min())), float(max(counts.max(), times.max()))]
    plot = Plot(
        "Time of (6) over time of (2)–(5) against the ratio of their operations, one point for every n and m",
        Axis("ratio of operations (6) / (2)–(5)", log=True), Axis("ratio of times (6) / (2)–(5)", log=True),
        (
            *(
                Series(words, list(ratio[pair][0]), list(ratio[pair][1]), text=names)
                for words, pair in (("W = I", IDENTITY), ("any W", GENERAL))
            ),
            Series("times as the counts", ends, ends, "line", "bound"), Series("equal times", [], [1.0], "horizontal", "bound"),
        ),
    )  # fmt: skip
    rate = Plot(
        "Time of one solve against its operations, compiled kernels",
        Axis("operations", log=True), Axis("time of one solve [ns]", log=True),
        tuple(
            Series(
                WORDS[row], [operations[cell][row] for cell in within], [1e9 * seconds[cell][row] for cell in within],
                text=names,
            )
            for row in ROWS
        ),
    )  # fmt: skip
    table = Table(
        "Measured time of one solve [ns], and in parentheses the operations counted",
        ("n", "m", *(WORDS[row] for row in ROWS)),
        tuple(
            (*cell, *(f"{1e9 * seconds[cell][row]:,.0f} ({operations[cell][row]:,})" for row in ROWS))
            for cell in SHOWN if cell in within
        ),
    )  # fmt: skip
    return Evidence(checks, (plot, rate, table))


def optimised_away(compiled: Answer) -> Answer:
    """Kernels that return at once: what a compiler makes of work whose result nobody reads."""
    import numba

    idle = numba.njit(lambda *args: 0)
    return lambda name: idle


CLAIM = Claim(
    name="count_as_gauge",
    title="A count of operations is a rough gauge",
    place="Section IV, footnote 3",
    says=("A floating-point count is an imperfect measure of implementation cost, and is used here only as a rough gauge."),
    tested=(
        "Both kernels, compiled, are timed by turns in one run on stacks of 2,000 problems of every size, the least of seven "
        "repeats; beside it their counts. The kernels are plain scalar loops, without multipliers or checks. Comparisons (the "
        "search for pivots), copies, look-ups of pivoted indices and square roots take time and are not counted."
    ),
    accepted=(
        "A gauge: the ratios of times and of counts are ordered alike. A rough one: they are not equal. Which method is faster "
        "depends on the implementation and on the machine."
    ),
    paths=(
        CodePath("time of the compiled kernels", compiled),
        CodePath("the description in Section IV added up by hand, in integers", by_hand.accounting),
    ),
    examine=count_as_gauge,
    fault=Fault("the work optimised away: the kernels return at once", optimised_away),
)
