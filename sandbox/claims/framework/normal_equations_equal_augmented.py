"""Eqs. (2)-(5) and eq. (6) give the same joint rates."""

from __future__ import annotations

import numpy as np

from sandbox.claims import equations
from sandbox.claims.claim import Answer, Claim, CodePath, Evidence, Fault, Trial, at_most
from sandbox.claims.exhibit import Axis, Plot, Series
from sandbox.claims.framework.reach import reach
from sandbox.claims.printed import each
from sandbox.claims.scatter import drawable
from sandbox.claims.situations import SIZES, positive
from sandbox.closed_form import CLOSED_FORMS
from sandbox.closed_form.eq6 import eq6
from sandbox.problem import VelocityProblem
from sandbox.solution import Solution

Array = np.ndarray


def wrong_sign(six: Answer) -> Answer:
    """Eq. (6) with the sign of alpha turned."""

    def planted(problem: VelocityProblem) -> Solution:
        return six(VelocityProblem(J=problem.J, xdot=problem.xdot, W=problem.W, a=-problem.a))

    return planted


def normal_equations_equal_augmented(trial: Trial, six: Answer, printed: Answer) -> Evidence:
    """(2)-(5) and (6) on random problems of every size, each difference measured by the sum of both bounds."""
    rng = trial.rng("normal_equations_equal_augmented")
    checks, conditions, differences, bounds = [], [], [], []
    for m, n in SIZES:
        problem = positive(rng, m, n, trial.of(100, 10))
        x, other = six(problem).x, each(printed, problem)
        size = np.abs(x).max(axis=-1)
        bound = (CLOSED_FORMS["eq6"].bound(problem) + CLOSED_FORMS["eq2_5"].bound(problem)) * reach(problem, x) / size
        conditions.append(np.linalg.cond(problem.J))
        differences.append(np.abs(x - other).max(axis=-1) / size)
        bounds.append(bound)
        checks.append(at_most(f"difference / bound, $m = {m}$, $n = {n}$", differences[-1] / bound, 1.0))
    plot = Plot(
        "Relative difference between (2)–(5) and (6), one point a problem, beside the sum of their error bounds; a "
        "difference of zero is drawn at the foot",
        Axis("condition number of J", log=True), Axis("relative difference of the joint rates", log=True),
        (
            Series("difference", np.concatenate(conditions), drawable(np.concatenate(differences))),
            Series("sum of bounds", np.concatenate(conditions), np.concatenate(bounds), role="bound"),
        ),
    )  # fmt: skip
    return Evidence(tuple(checks), (plot,))


CLAIM = Claim(
    name="normal_equations_equal_augmented",
    title="(2)–(5) and (6) give the same joint rates",
    place="Section II, eqs. (2)–(6)",
    says=r"When $J$ has full row rank, the solution from (2)–(5) equals that from (6).",
    formula=(
        r"\dot q = \begin{bmatrix} J \\ N_J^T W \end{bmatrix}^{-1} "
        r"\begin{bmatrix} \dot x \\ -\alpha N_J^T \nabla f \end{bmatrix}"
    ),
    tested=(
        r"Random $J$ of condition up to $10^3$, random $W > 0$, $\nabla f$ and $\dot x$, in eight sizes $m × n$ from 1 × 2 to "
        "6 × 8."
    ),
    accepted="The two answers differ by no more than the sum of their error bounds.",
    paths=(
        CodePath("eq. (6), column-pivoted LU extended by $N_J^T W$", eq6),
        CodePath("eqs. (2)–(5) as printed, explicit inverses in numpy", equations.liegeois),
    ),
    examine=normal_equations_equal_augmented,
    fault=Fault(r"the sign of $\alpha$ turned in (6)", wrong_sign),
)
