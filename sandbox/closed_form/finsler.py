"""Eqs. (2)-(5) on the positive definite weight W + c J'J: valid for every weight that condition (7) admits."""

from __future__ import annotations

import numpy as np

from sandbox.closed_form.bounds import NORMAL, finsler_bound, shifted_bound, shifted_weight
from sandbox.closed_form.eq2_5 import normal_equations, refuse_normal
from sandbox.closed_form.form import CONDITION_SEVEN_HOLDS, ClosedForm, Ledger
from sandbox.closed_form.geometry import Geometry
from sandbox.problem import VelocityProblem
from sandbox.solution import Solution, Status


@np.errstate(all="ignore")
def finsler(problem: VelocityProblem) -> Solution:
    """eq2_5 on W + c J'D^-2 J, D the row sizes of J; the multiplier moves by c D^-2 xdot and is moved back.

    c > -lambda_min(S), S = Y'WY - Y'WN (N'WN)^-1 N'WY with Y = (D^-1 J)^+, exists exactly where (7) holds.
    Source: methods 1.5 and 3.P (P7); Finsler's lemma.
    """
    geometry = Geometry.of(problem)
    ledger = Ledger(problem)
    ledger.refuse_by(geometry)
    x, y = np.full((len(problem), problem.n), np.nan), np.full((len(problem), problem.m), np.nan)
    i = np.flatnonzero(ledger.open)
    if i.size:
        W, c = shifted_weight(geometry[i])
        part = problem[i]
        x[i], y[i], weight, rank, _ = normal_equations(part, W)
        rank |= ~weight & ~(shifted_bound(part, W, geometry[i]) < 1)
        y[i] += c[:, None] * part.xdot / geometry.scale[i] ** 2
        failed, lost = np.zeros((2, len(problem)), dtype=bool)
        failed[i], lost[i] = weight, rank
        ledger.refuse(
            failed, Status.ILL_CONDITIONED, "W + c J'J is positive definite, but by less than rounding of its larger part"
        )
        refuse_normal(ledger, np.zeros_like(lost), lost)
    return ledger.solution(x, y)


FINSLER = ClosedForm(
    name="finsler", task="exact", domain=CONDITION_SEVEN_HOLDS, function=finsler, bound=finsler_bound,
    bound_text=NORMAL.replace("W", "W + c J'J"), about="eq2_5 on W + c J'J, positive definite by Finsler's lemma",
    source="methods 1.5 and 3.P (P7); Finsler's lemma",
)  # fmt: skip
