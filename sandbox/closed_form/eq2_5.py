"""Eqs. (2)-(5): the normal equations, in the paper's Cholesky order."""

from __future__ import annotations

from typing import Any

import numpy as np

from sandbox.closed_form.bounds import NORMAL, normal
from sandbox.closed_form.compiled import compiled
from sandbox.closed_form.form import POSITIVE_WEIGHT, ClosedForm, Ledger
from sandbox.closed_form.kernels import RANK, WEIGHT
from sandbox.closed_form.linear import pivot_share
from sandbox.closed_form.vectorised import eq2_5_machine, threads, worth
from sandbox.problem import VelocityProblem
from sandbox.solution import Solution, Status
from sandbox.tolerances import HEALTHY_PIVOT, POSITIVE_PIVOT

Array = np.ndarray


@np.errstate(all="ignore")
def eq2_5(problem: VelocityProblem, *, dtype: Any = np.float64) -> Solution:
    """W = L L', Jh = (L^-1 J')', zh = L^-1(-a), (Jh Jh') y = xdot - Jh zh, L' qdot = Jh'y + zh; our multiplier is -y.

    `dtype` float32 computes in single precision (section V), where the caller judges the error. Refuses W that is not
    positive definite, and in double precision what its own error bound leaves no digit of.
    Source: eqs. (2)-(5) and section IV, English & Maciejewski, after Klein & Huang.
    """
    ledger = Ledger(problem)
    x, y, weight, rank, suspect = normal_equations(problem, problem.W.dense(), dtype)
    refuse_normal(ledger, weight, rank)
    if dtype is np.float64:
        lost = suspect & ledger.open
        lost[lost] = normal(problem[np.flatnonzero(lost)]) >= 1 if lost.any() else False
        ledger.refuse(lost, Status.ILL_CONDITIONED, NO_DIGIT)
    return ledger.solution(x, y)


NO_DIGIT = (
    "the normal equations square the condition of J: their error bound exceeds the answer itself; eq. (6) does not square it"
)


def normal_equations(problem: VelocityProblem, W: Array, dtype: Any = np.float64) -> tuple[Array, Array, Array, Array, Array]:
    """(x, y, W not positive definite, J W^-1 J' not positive definite, bound worth a look) for every member."""
    B, m, n = len(problem), problem.m, problem.n
    given = [np.ascontiguousarray(v, dtype=dtype) for v in (problem.J, problem.xdot, W, problem.a)]
    x, y, shares = np.full((B, n), np.nan, dtype), np.full((B, m), np.nan, dtype), np.zeros((B, 2), dtype)
    code, rest = np.zeros(B, dtype=np.int64), np.arange(B)
    if worth(B, n) and m <= n:
        solved = np.zeros((B, 1), dtype)
        eq2_5_machine(m, n, True, 8 * x.dtype.itemsize)(
            *(v.reshape(B, -1) for v in given), x, y, shares, solved, threads=threads()
        )
        rest = np.flatnonzero(solved[:, 0] == 0)  # why they were refused, the scalar kernel says
    if len(rest):
        L, M = np.zeros((len(rest), n, n), dtype), np.zeros((len(rest), m, m), dtype)
        found = np.full((len(rest), n), np.nan, dtype), np.full((len(rest), m), np.nan, dtype), np.empty(len(rest), np.int64)
        compiled("eq2_5_stack")(*(v[rest] for v in given), x.dtype.type(1), True, *found[:2], L, M, found[2])
        x[rest], y[rest], code[rest] = found
        shares[rest] = np.stack([pivot_share(L), pivot_share(M)], axis=-1)
    unit = np.finfo(dtype).eps / 2
    weight = (code == WEIGHT) | ~(shares[:, 0] > POSITIVE_PIVOT * n * unit)
    rank = ~weight & ((code == RANK) | ~(shares[:, 1] > POSITIVE_PIVOT * m * unit) | (m > n))
    return x, y, weight, rank, ~(np.minimum(shares[:, 0], shares[:, 1]) > HEALTHY_PIVOT)


def refuse_normal(ledger: Ledger, weight: Array, rank: Array) -> None:
    """Refuse by the two Cholesky factorisations, with evidence."""
    refused = weight | rank
    if not refused.any():
        return
    geometry = ledger.explain(refused)
    seen = np.zeros(len(refused), dtype=bool)
    seen[refused] = geometry.full_row_rank
    ledger.refuse(weight, Status.NOT_POSITIVE_DEFINITE, "W is not positive definite beyond rounding: it has no Cholesky factor")
    ledger.refuse(rank & ~seen, Status.RANK_DEFICIENT, ledger.rank_words)
    ledger.refuse(rank, Status.ILL_CONDITIONED, NO_DIGIT)


EQ2_5 = ClosedForm(
    name="eq2_5", task="exact", domain=POSITIVE_WEIGHT, function=eq2_5, bound=normal, bound_text=NORMAL,
    about="normal equations J W^-1 J' by two Cholesky factorisations",
    source="English & Maciejewski, eqs. (2)-(5) and section IV",
)  # fmt: skip
