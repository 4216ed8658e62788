"""The bordered (KKT) system, solved whole; condition (7) read from its inertia."""

from __future__ import annotations

import numpy as np

from sandbox.closed_form.bounds import BORDERED, bordered, bordered_matrix
from sandbox.closed_form.form import CONDITION_SEVEN_HOLDS, ClosedForm, Ledger
from sandbox.closed_form.geometry import Geometry
from sandbox.problem import VelocityProblem
from sandbox.solution import Solution, Status
from sandbox.stacked import eigenvalues, solve
from sandbox.tolerances import CONDITION_SEVEN, UNIT


@np.errstate(all="ignore")
def kkt(problem: VelocityProblem) -> Solution:
    """Solve [t W, J'; J, 0] (qdot, t y) = (-t a, xdot), rows of J scaled to one and t so that |t W| = sigma_min(J).

    Condition (7) holds exactly where the inertia of the matrix is (n, m, 0) (methods 1.4).
    Source: methods 3.P (P5); Nocedal & Wright, theorem 16.2.
    """
    m, n = problem.m, problem.n
    geometry = Geometry.of(problem)
    ledger = Ledger(problem)
    ledger.show(geometry)
    x, y = np.full((len(problem), n), np.nan), np.full((len(problem), m), np.nan)
    ledger.refuse(~geometry.full_row_rank, Status.RANK_DEFICIENT, ledger.rank_words)
    K, t = bordered_matrix(geometry)
    values = eigenvalues(K)
    zero = CONDITION_SEVEN * (n + m) ** 2 * UNIT * np.abs(values).max(axis=1)[:, None]
    positive, negative = (values > zero).sum(axis=1), (values < -zero).sum(axis=1)
    wrong = (positive != n) | (negative != m)
    if n > m:
        ledger.refuse(wrong & geometry.singular, Status.CONDITION_SEVEN, ledger.curvature_words)
    ledger.refuse(wrong, Status.ILL_CONDITIONED, ledger.unsure_words)
    i = np.flatnonzero(ledger.open)
    if i.size:
        part, scale = problem[i], geometry.scale[i]
        rhs = np.concatenate([-t[i, None] * part.a, part.xdot / scale], axis=1)
        z = solve(K[i], rhs[:, :, None])[:, :, 0]
        x[i], y[i] = z[:, :n], z[:, n:] / t[i, None] / scale
    return ledger.solution(x, y)


KKT = ClosedForm(
    name="kkt", task="exact", domain=CONDITION_SEVEN_HOLDS, function=kkt, bound=bordered, bound_text=BORDERED,
    about="the bordered system [W J'; J 0], scaled and solved whole; condition (7) is its inertia (n, m, 0)",
    source="methods 3.P (P5); Nocedal & Wright, theorem 16.2",
)  # fmt: skip
