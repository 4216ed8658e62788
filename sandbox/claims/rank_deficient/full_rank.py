"""Eq. (13) is eq. (6) where J has full row rank; what the task weight does where it has not."""

from __future__ import annotations

import numpy as np
import scipy.linalg

from problems.sets import construct as make
from sandbox.claims import equations
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_most, every
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.power import fitted
from sandbox.claims.rank_deficient.posed import SANDBOX, answered, drawn, posed, scaled_rows
from sandbox.claims.situations import SIZES, indefinite, positive
from sandbox.closed_form import CLOSED_FORMS
from sandbox.problem import VelocityProblem
from sandbox.solution import Solution
from sandbox.task import task_weight
from sandbox.tolerances import ORIGINAL, TIKHONOV, UNIT

Array = np.ndarray


def eq13_reduces_to_eq6(trial: Trial, thirteen: Answer, printed: Answer) -> Evidence:
    """(13) where J has full row rank against (6) as printed; and where it has not, the effect of Wx against inconsistency."""
    rng = trial.rng("eq13_reduces_to_eq6")
    checks, conditions, differences, bounds, literal = [], [], [], [], []
    for m, n in SIZES if trial.full else SIZES[::3]:
        for draw in (positive, indefinite):
            count = trial.of(25, 6)
            problem = draw(rng, m, n, count, decades=2.0)
            problem = _weighed(problem, np.stack([_spread(rng, m, trial.of(3, 2)) for _ in range(count)]))
            x, W, Wx = thirteen(problem).x, problem.W.dense(), task_weight(problem)
            bound = CLOSED_FORMS["eq13"].bound(problem) + CLOSED_FORMS["eq6"].bound(problem)
            for i in range(count):
                J, xdot, a = problem.J[i], problem.xdot[i], problem.a[i]
                six = printed(J, xdot, W[i], a, 1.0)
                differences.append(np.abs(x[i] - six).max() / np.abs(six).max())
                conditions.append(np.linalg.cond(J))
                bounds.append(bound[i])
                N, V = equations.null_space(J), np.linalg.svd(J)[2][:m].T
                with_wx = equations.rank_deficient(J, xdot, W[i], a, 1.0, Wx[i], N, V)
                kappa = np.linalg.cond(scaled_rows(problem[i], N, V)) + np.linalg.cond(J) ** 2 * np.linalg.cond(Wx[i])
                literal.append(np.abs(with_wx - six).max() / np.abs(six).max() / (bound[i] + ORIGINAL * n * UNIT * kappa))
        words = f"difference of (13) from (6) / bound, $W$ definite and indefinite, $m = {m}$, $n = {n}$"
        checks.append(at_most(words, np.array(differences[-2 * count :]) / np.array(bounds[-2 * count :]), 1.0))
    checks.append(
        at_most(r"the same of (13) as printed with $R_J = V_m$, $W_{\dot x}$ of condition up to $10^6$ left in",
                literal, 1.0)
    )  # fmt: skip
    plot = Plot(
        "(13) where $J$ has full row rank: relative difference from (6), one point a problem",
        Axis(r"$\mathrm{cond}\,J$", log=True), Axis("relative difference of the joint rates", log=True),
        (
            Series("difference", conditions, differences),
            Series("sum of bounds", conditions, bounds, role="bound"),
        ),
    )  # fmt: skip
    more, effect, table = _effect_of_task_weight(trial, thirteen, rng)
    return Evidence((*checks, *more), (plot, effect, table))


def _weighed(problem: VelocityProblem, Wx: Array) -> VelocityProblem:
    return VelocityProblem(J=problem.J, xdot=problem.xdot, W=problem.W, a=problem.a, Wx=Wx)


def _spread(rng: np.random.Generator, m: int, decades: float) -> Array:
    """Wx > 0 with eigenvalues in [10^-decades, 10^decades)."""
    return make.with_eigenvalues(rng, 10.0 ** rng.uniform(-decades, decades, m))


def _effect_of_task_weight(trial: Trial, thirteen: Answer, rng: np.random.Generator) -> tuple[list[Check], Plot, Table]:
    """Where J has lost rank: qdot with Wx less qdot with I, by how far xdot is from range J; the rationals beside."""
    shares = 2.0 ** -np.arange(0, 52, 2)
    same, ratios, series, rows, exponents, exact_line = [], [], [], [], [], []
    for m, n, r in ((3, 5, 2), (4, 6, 3), (6, 7, 5), (4, 3, 2)):
        for repeat in range(trial.of(4, 1)):
            one = drawn(rng, m, n, r, "achievable", "positive definite", "indefinite")
            away = np.array(scipy.linalg.null_space(one.J.T)[:, 0])
            away = np.round(64 * away) / 64
            gap, exact_gap = [], []
            for share in (*shares, 0.0):
                pair = [
                    VelocityProblem(J=one.J, xdot=one.xdot + share * away, W=one.W, a=one.a, Wx=Wx) for Wx in (one.Wx, None)
                ]
                told = [posed(p) for p in pair]
                x = [answered(thirteen, p)[0] for p in pair]
                exact_gap.append(float(np.abs(told[0].x - told[1].x).max()) / told[1].size)
                gap.append(float(np.abs(x[0] - x[1]).max()) / told[1].size)
                if not share:
                    same.append(told[0].told.x_exact == told[1].told.x_exact)
                    ratios.append(gap[-1] / (told[0].bound + told[1].bound))
            exponents.append(fitted(shares[5:15], np.array(exact_gap[5:15])))
            if not repeat:
                name = f"rank {r} of {m} × {n}"
                series.append(Series(f"(13), {name}", shares, gap[:-1]))
                exact_line += [*exact_gap[:-1], np.nan]
                rows.append((name, exact_gap[0], exact_gap[10], exact_gap[-1], gap[-1]))
    checks = [
        every(r"rank lost, $\dot x$ in the range of $J$: the exact answers with $W_{\dot x}$ and with $I$ are the same "
              r"rationals",
              same, role=Role.OURS),
        at_most(r"the same by (13): difference / bound", ratios, 1.0, role=Role.OURS),
        at_most(r"rank lost, $\dot x$ off the range of $J$: the effect of $W_{\dot x}$ grows with the distance, |exponent − 1|",
                np.abs(np.array(exponents) - 1), TIKHONOV, role=Role.OURS),
    ]  # fmt: skip
    plot = Plot(
        r"What the task weight $W_{\dot x}$ does where $J$ has lost rank: nothing to an achievable $\dot x$, and the more the "
        "further it is from the range of $J$",
        Axis(r"part of $\dot x$ outside the range of $J$", log=True),
        Axis("relative change of the joint rates", log=True),
        (*series, Series("exact", np.tile([*shares, np.nan], len(series)), exact_line, "line", "bound")),
    )  # fmt: skip
    columns = ("case", "part outside 1", "2⁻²⁰", "0, exact", "0, by (13)")
    return (
        checks,
        plot,
        Table(
            r"Relative change of the rates when $W_{\dot x}$ replaces $I$, by the part of $\dot x$ outside the range of $J$",
            columns,
            tuple(rows),
        ),
    )


def right_side_alone(thirteen: Answer) -> Answer:
    """Wx in the right-hand side of the first rows but not in their matrix: R'J'J qdot = R'J'Wx xdot."""

    def planted(problem: VelocityProblem) -> Solution:
        weighed = (task_weight(problem) @ problem.xdot[..., None])[..., 0]
        return thirteen(VelocityProblem(J=problem.J, xdot=weighed, W=problem.W, a=problem.a))

    return planted


CLAIM = Claim(
    name="eq13_reduces_to_eq6",
    title="(13) is (6) where J has full row rank",
    place="Section VI, eq. (13)",
    says=r"(13) is the augmented form of (6), modified. Where $J$ has full row rank, then, both give the same joint rates "
    r"whatever $W_{\dot x} > 0$, which the paper does not say in so many words.",
    tested=r"Random $J$ of full row rank in eight sizes with $W$ definite and indefinite, $W_{\dot x}$ of condition up to "
    r"$10^6$. Then, over integers, $J$ that has lost rank: the effect of $W_{\dot x}$ as $\dot x$ leaves the range of "
    r"$J$.",
    accepted=r"(13) and (6) differ by no more than the sum of their bounds. Ours: where $J$ has lost rank, $W_{\dot x}$ "
    r"changes nothing in an achievable $\dot x$, to the last rational.",
    paths=(SANDBOX, CodePath("eq. (6) as printed, in numpy", equations.augmented)),
    examine=eq13_reduces_to_eq6,
    fault=Fault(r"$W_{\dot x}$ on the right-hand side of (13) alone", right_side_alone),
)
