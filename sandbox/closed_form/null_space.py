"""The null-space method: a particular solution, then the best step along null J."""

from __future__ import annotations

import numpy as np

from sandbox.closed_form.bounds import SIX, six
from sandbox.closed_form.form import CONDITION_SEVEN_HOLDS, ClosedForm, Ledger
from sandbox.closed_form.geometry import Geometry, gradient
from sandbox.problem import VelocityProblem
from sandbox.solution import Solution
from sandbox.stacked import solve, symmetric, times, transpose


@np.errstate(all="ignore")
def null_space(problem: VelocityProblem) -> Solution:
    """Qdot = q_p - N (N'WN)^-1 N'(a + W q_p), with q_p = Q1 R^-T xdot and N = Q2 from J' = Q R; y = -R^-1 Q1'(W qdot + a).

    Source: the projection method, methods 3.P (P4); Nocedal & Wright, section 16.2.
    """
    geometry = Geometry.of(problem)
    ledger = Ledger(problem)
    ledger.refuse_by(geometry)
    m, n = problem.m, problem.n
    x, y = np.full((len(problem), n), np.nan), np.full((len(problem), m), np.nan)
    i = np.flatnonzero(ledger.open)
    if i.size:
        part, scale = problem[i], geometry.scale[i]
        Q, R = np.linalg.qr(transpose(part.J / scale[:, :, None]), mode="complete")
        Q1, N, R = Q[:, :, :m], Q[:, :, m:], R[:, :m]
        q_p = times(Q1, solve(transpose(R), (part.xdot / scale)[:, :, None])[:, :, 0])
        if n > m:
            S = symmetric(part.W.left(N) @ N)
            slope = times(transpose(N), gradient(part, q_p))
            q_p = q_p - times(N, solve(S, slope[:, :, None])[:, :, 0])
        x[i] = q_p
        y[i] = -solve(R, transpose(Q1) @ gradient(part, q_p)[:, :, None])[:, :, 0] / scale
    return ledger.solution(x, y)


NULL_SPACE = ClosedForm(
    name="null_space", task="exact", domain=CONDITION_SEVEN_HOLDS, function=null_space, bound=six, bound_text=SIX,
    about="particular solution by QR of J', then the minimum along null J",
    source="projection method (methods 3.P, P4); Nocedal & Wright, section 16.2",
)  # fmt: skip
