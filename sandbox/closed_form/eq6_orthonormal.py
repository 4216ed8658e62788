"""Eq. (6) with an orthonormal null-space basis."""

from __future__ import annotations

import numpy as np

from sandbox.closed_form.bounds import SIX, six
from sandbox.closed_form.form import CONDITION_SEVEN_HOLDS, ClosedForm, Ledger
from sandbox.closed_form.geometry import Geometry, gradient
from sandbox.closed_form.linear import equilibrated
from sandbox.problem import VelocityProblem
from sandbox.solution import Solution
from sandbox.stacked import solve, times, transpose


@np.errstate(all="ignore")
def eq6_orthonormal(problem: VelocityProblem) -> Solution:
    """Solve [J; N'W] qdot = [xdot; -N'a], N from the singular value decomposition of J; y = -(J')^+ (W qdot + a).

    Condition (7) is decided by the smallest eigenvalue of N'WN. Source: eq. (6), English & Maciejewski.
    """
    geometry = Geometry.of(problem)
    ledger = Ledger(problem)
    ledger.refuse_by(geometry)
    m, n = problem.m, problem.n
    x, y = np.full((len(problem), n), np.nan), np.full((len(problem), m), np.nan)
    i = np.flatnonzero(ledger.open)
    if i.size:
        part, N = problem[i], geometry.N[i]
        A = np.concatenate([part.J, part.W.left(N)], axis=1)
        b = np.concatenate([part.xdot, -times(transpose(N), part.a)], axis=1)
        A, b = equilibrated(A, b)
        x[i] = solve(A, b[:, :, None])[:, :, 0]
        y[i] = -geometry[i].range_solve(gradient(part, x[i]))
    return ledger.solution(x, y)


EQ6_ORTHONORMAL = ClosedForm(
    name="eq6_orthonormal", task="exact", domain=CONDITION_SEVEN_HOLDS, function=eq6_orthonormal, bound=six, bound_text=SIX,
    about="eq. (6) with N from the singular value decomposition; condition (7) by the eigenvalues of N'WN",
    source="English & Maciejewski, eq. (6)",
)  # fmt: skip
