"""Eq. (6) as the paper computes it: column-pivoted LU of J, extended by the rows N'W."""

from __future__ import annotations

from typing import Any

import numpy as np

from sandbox.closed_form.bounds import SIX, six
from sandbox.closed_form.compiled import compiled
from sandbox.closed_form.form import CONDITION_SEVEN_HOLDS, ClosedForm, Ledger
from sandbox.closed_form.kernels import CURVATURE, RANK
from sandbox.closed_form.vectorised import eq6_machine, threads, worth
from sandbox.problem import VelocityProblem
from sandbox.solution import Solution, Status
from sandbox.tolerances import PIVOT

Array = np.ndarray


@np.errstate(all="ignore")
def eq6(problem: VelocityProblem, *, dtype: Any = np.float64) -> Solution:
    """Solve [J; N'W] qdot = [xdot; -N'a]; condition (7) is read from the trailing pivots.

    `dtype` float32 computes in single precision (section V). A factored weight stays factored. Multipliers
    come from W x + a + J'y = 0 on the pivot columns. Source: eq. (6) and section IV, English & Maciejewski.
    """
    B, m, n = len(problem), problem.m, problem.n
    ledger = Ledger(problem)
    x, y = np.full((B, n), np.nan, dtype), np.full((B, m), np.nan, dtype)
    if n < m:
        everyone = np.ones(B, dtype=bool)
        ledger.explain(everyone)
        ledger.refuse(everyone, Status.RANK_DEFICIENT, ledger.rank_words)
        return ledger.solution(x, y)
    pivot, bound = np.full((B, n), np.nan, dtype), np.full((B, n), np.nan, dtype)
    code = factored(arrays(problem, dtype, copy=False), x, y, pivot, bound)
    clear = np.abs(pivot) > PIVOT * n * np.finfo(dtype).eps / 2 * bound
    if clear.all() and not code.any():
        return ledger.solution(x, y)
    rank = (code == RANK) | ((code == 0) & ~clear[:, :m].all(axis=1))
    curved = (code == CURVATURE) | ((code == 0) & ~clear[:, m:].all(axis=1))
    refused = rank | curved
    geometry = ledger.explain(refused)
    plain = np.zeros(B, dtype=bool)
    plain[refused] = geometry.singular
    ledger.refuse(rank, Status.RANK_DEFICIENT, ledger.rank_words)
    ledger.refuse(curved & plain, Status.CONDITION_SEVEN, ledger.curvature_words)
    ledger.refuse(curved, Status.ILL_CONDITIONED, ledger.unsure_words)
    return ledger.solution(x, y)


def factored(given: tuple[Array, ...], x: Array, y: Array, pivot: Array, bound: Array) -> Array:
    """Run the kernel on a stack, side by side where that is worth it; the codes (B,) of kernels.py."""
    B, n = x.shape
    m, dtype = y.shape[1], x.dtype
    code = np.zeros(B, dtype=np.int64)
    rest = np.arange(B)
    if worth(B, n, given[3]):
        solved = np.zeros((B, 1), dtype)
        machine = eq6_machine(m, n, given[3].shape[1], True, 8 * dtype.itemsize, True)
        machine(*(v.reshape(B, -1) for v in given if v.size), x, y, pivot, bound, solved, threads=threads())
        rest = np.flatnonzero(solved[:, 0] == 0)  # why they were refused, the scalar kernel says
    if len(rest):
        part = [np.ascontiguousarray(v[rest]) for v in (*given, x, y, pivot, bound, code)]
        compiled("eq6_stack")(*part[:6], dtype.type(1), True, *part[6:])
        for whole, found in zip((x, y, pivot, bound, code), part[6:], strict=True):
            whole[rest] = found
    return code


def arrays(problem: VelocityProblem, dtype: Any, *, copy: bool = True) -> tuple[Array, ...]:
    """J, xdot, base, E, Gamma, a as contiguous arrays of `dtype`, one's own or only to read; no rows E: W is not factored."""
    B, n = len(problem), problem.n
    E, gamma = problem.W.E, problem.W.gamma
    if E is None or gamma is None:
        E, gamma = np.zeros((B, 0, n)), np.zeros((B, 0, 0))
    parts = problem.J, problem.xdot, problem.W.base, E, gamma, problem.a
    return tuple(np.array(v, dtype=dtype, order="C", copy=copy or None) for v in parts)


EQ6 = ClosedForm(
    name="eq6", task="exact", domain=CONDITION_SEVEN_HOLDS, function=eq6, bound=six, bound_text=SIX,
    about="column-pivoted LU of J extended by N'W; its trailing pivots decide condition (7)",
    source="English & Maciejewski, eq. (6) and section IV",
)  # fmt: skip
