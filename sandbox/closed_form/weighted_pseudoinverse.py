"""The weighted pseudoinverse L^-T (J L^-T)^+ by singular values: eq. (5) without squaring."""

from __future__ import annotations

import numpy as np

from sandbox.closed_form.bounds import SINGULAR_VALUES, singular_values
from sandbox.closed_form.eq2_5 import refuse_normal
from sandbox.closed_form.form import POSITIVE_WEIGHT, ClosedForm, Ledger
from sandbox.closed_form.linear import cholesky, power_of_two
from sandbox.problem import VelocityProblem
from sandbox.solution import Solution
from sandbox.stacked import solve, svd, times, transpose
from sandbox.tolerances import RANK, UNIT


@np.errstate(all="ignore")
def weighted_pseudoinverse(problem: VelocityProblem) -> Solution:
    """W = L L', Jh = J L^-T = U Sigma V', qdot = L^-T (Jh^+ (xdot - Jh zh) + zh), zh = -L^-1 a; y = -(Jh Jh')^+ (xdot - Jh zh).

    Source: methods 3.P (P6); eqs. (2)-(5), English & Maciejewski.
    """
    m, n = problem.m, problem.n
    ledger = Ledger(problem)
    L, positive = cholesky(problem.W.dense())
    Jh = transpose(solve(L, transpose(problem.J)))
    scale = power_of_two(np.abs(Jh).max(axis=-1))
    U, sigma, V = svd(Jh / scale[:, :, None])
    rank = ~(sigma[:, -1] > RANK * n * UNIT * sigma[:, 0]) | (m > n)
    refuse_normal(ledger, ~positive, positive & rank)
    if m > n:
        return ledger.solution(np.full((len(problem), n), np.nan), np.full((len(problem), m), np.nan))
    zh = -solve(L, problem.a[:, :, None])[:, :, 0]
    miss = times(transpose(U), (problem.xdot - times(Jh, zh)) / scale) / sigma
    x = solve(transpose(L), (times(V[:, :, :m], miss) + zh)[:, :, None])[:, :, 0]
    y = -times(U, miss / sigma) / scale
    return ledger.solution(x, y)


WEIGHTED_PSEUDOINVERSE = ClosedForm(
    name="weighted_pseudoinverse", task="exact", domain=POSITIVE_WEIGHT, function=weighted_pseudoinverse, bound=singular_values,
    bound_text=SINGULAR_VALUES, about="L^-T (J L^-T)^+ by singular values, W = L L': squares nothing",
    source="methods 3.P (P6)",
)  # fmt: skip
