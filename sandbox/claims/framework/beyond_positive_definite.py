"""Eq. (6) with weights that are not positive definite, under condition (7)."""

from __future__ import annotations

import numpy as np

from problems.sets import construct as make
from sandbox.claims import equations
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_most, every
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.framework.reach import reach
from sandbox.claims.framework.small_arms import ASKED, J1
from sandbox.claims.numbers import told
from sandbox.claims.printed import each
from sandbox.claims.scatter import drawable
from sandbox.claims.situations import SIZES, indefinite
from sandbox.closed_form import CLOSED_FORMS
from sandbox.closed_form.eq2_5 import eq2_5
from sandbox.closed_form.eq6 import eq6
from sandbox.closed_form.finsler import finsler
from sandbox.problem import VelocityProblem
from sandbox.reference.truth import truth
from sandbox.solution import Solution, Status
from sandbox.stacked import eigenvalues, symmetric, transpose
from sandbox.tolerances import FORWARD, UNIT

Array = np.ndarray


def size_of_weight(six: Answer) -> Answer:
    """W made positive definite by the absolute values of its eigenvalues."""

    def planted(problem: VelocityProblem) -> Solution:
        values, vectors = np.linalg.eigh(problem.W.dense())
        W = symmetric(vectors * np.abs(values)[:, None, :] @ transpose(vectors))
        return six(VelocityProblem(J=problem.J, xdot=problem.xdot, W=W, a=problem.a))

    return planted


FINSLER_STEP = 1e-3
"""W + c J'J is looked at this share below and above the threshold c*: far beyond rounding."""


def finsler_threshold(J: Array, W: Array) -> float:
    """c* = -lambda_min(S), S = Y'WY - Y'WN (N'WN)^-1 N'WY, Y = J^+: W + c J'J > 0 exactly for c > c* (Finsler)."""
    Y, N = np.linalg.pinv(J), equations.null_space(J)
    across = Y.T @ W @ N
    return -float(np.linalg.eigvalsh(Y.T @ W @ Y - across @ np.linalg.solve(N.T @ W @ N, across.T))[0])


def beyond_positive_definite(trial: Trial, six: Answer, exact: Answer) -> Evidence:
    """(6) on indefinite weights under (7), from slightly to very indefinite, beside the exact minimiser."""
    rng, count = trial.rng("beyond_positive_definite"), trial.of(40, 4)
    checks: list[Check] = []
    depth, errors, bounds, lowest, said, sides, lines = [], [], [], [], [], [], []
    other: dict[str, list[Array]] = {"(2)–(5), explicit inverses": [], "(2)–(5) on W + c J'J, c > c*": []}
    ratios: list[Array] = []
    for m, n in SIZES:
        drawn = indefinite(rng, m, n, count, decades=1.0)
        lower = 10.0 ** rng.uniform(-1.0, 6.0, (count, 1, 1)) * symmetric(transpose(drawn.J) @ drawn.J)
        problem = VelocityProblem(J=drawn.J, xdot=drawn.xdot, W=drawn.W.dense() - lower, a=drawn.a)
        W, x = problem.W.dense(), np.stack([one.x for one in exact(problem)])
        size, scale = np.abs(x).max(axis=-1), reach(problem, x)
        error, bound = np.abs(six(problem).x - x).max(axis=-1), CLOSED_FORMS["eq6"].bound(problem) * scale
        checks.append(at_most(f"error / bound, $W$ indefinite, $m = {m}$, $n = {n}$", error / bound, 1.0))
        spread = eigenvalues(W)
        lowest.append(spread[:, 0] / np.abs(spread).max(axis=-1))
        depth.append(-spread[:, 0])
        errors.append(error / size)
        bounds.append(bound / size)
        said += list(eq2_5(problem).status)
        other["(2)–(5), explicit inverses"].append(np.abs(each(equations.liegeois, problem) - x).max(axis=-1) / size)
        look = finsler(problem).x
        other["(2)–(5) on W + c J'J, c > c*"].append(np.abs(look - x).max(axis=-1) / size)
        ratios.append(np.abs(look - x).max(axis=-1) / (CLOSED_FORMS["finsler"].bound(problem) * scale))
        for i, J in enumerate(problem.J):
            c = finsler_threshold(J, W[i])
            below, above = (
                float(np.linalg.eigvalsh(W[i] + c * (1 + side) * J.T @ J)[0]) for side in (-FINSLER_STEP, FINSLER_STEP)
            )
            sides.append(below < 0 < above)
        lines.append((f"{m} × {n}", problem.J[0], drawn.W.dense()[0]))
    checks += [
        at_most("$\\lambda_{min}(W) / |W|$: every weight is indefinite", np.concatenate(lowest), -1e-3, role=Role.OURS),
        every(
            "(5) by Cholesky factorisation, as Section IV computes it, cannot take $W$",
            [one is Status.NOT_POSITIVE_DEFINITE for one in said], role=Role.OURS,
        ),
        at_most(
            "(2)–(5) on the positive definite $W + cJ^TJ$ give the same: error / bound", np.concatenate(ratios), 1.0,
            role=Role.OURS,
        ),
        every("$W + cJ^TJ > 0$ for $c$ just above $c^*$, and not just below", sides, role=Role.OURS),
    ]  # fmt: skip
    example, rows = _indefinite_example(six)
    checks += [_singular(trial, six, exact), example]
    plot = Plot(
        "Error of (6) with indefinite $W$ under (7), against the exact minimiser; an error of zero is drawn at the foot. What "
        "is taken from $W$ along the range of $J^T$ does not move the minimiser; only rounding grows with it.",
        Axis("−λ_min(W)", log=True), Axis("relative error of the joint rates", log=True),
        (
            Series("error of (6)", np.concatenate(depth), drawable(np.concatenate(errors))),
            Series("error bound", np.concatenate(depth), np.concatenate(bounds), role="bound"),
        ),
    )  # fmt: skip
    share = np.linspace(0.0, 3.0, 61)
    lemma = Plot(
        "Why it works: under (7) some $c$ makes $W + cJ^TJ$ positive definite (Finsler), and $J\\dot q = \\dot x$ makes that "
        "addition a constant. The smallest eigenvalue turns positive at $c^*$.",
        Axis("c / c*"), Axis("λ_min(W + c J'J)"),
        (
            *(
                Series(name, share, [np.linalg.eigvalsh(W + c * J.T @ J)[0] for c in share * finsler_threshold(J, W)], "line")
                for name, J, W in [("planar 3R, diag(−1, 1, 1)", J1, np.diag([-1.0, 1, 1])), *lines[1:5]]
            ),
            Series("c*", (1.0,), (0.0,), "vertical", "bound"),
            Series("zero", (0.0,), (0.0,), "horizontal", "bound"),
        ),
    )  # fmt: skip
    total = sum(len(part) for part in errors)
    found = {"(6)": errors, **other}
    table = Table(
        "What each path makes of these indefinite weights, and below the simplest example: planar 3R at (0, π/2, −π/2), "
        "$W$ = diag(−1, 1, 1), $\\dot x$ = (1, 1). Explicit inverses need no Cholesky factor, but a $W$ that has an inverse",
        ("quantity", "by hand", "found"),
        (
            *(
                (f"{name}: largest relative error in {total:,}", None, float(np.concatenate(parts).max()))
                for name, parts in found.items()
            ),
            (f"(2)–(5), Cholesky: answered, of {total:,}", None, sum(one.answered for one in said)),
            *rows,
        ),
    )  # fmt: skip
    return Evidence(tuple(checks), (plot, lemma, table))


def _singular(trial: Trial, six: Answer, exact: Answer) -> Check:
    """Weights W = F'F of whole numbers, F with n - m rows: singular, and N'WN > 0 unless F N is singular."""
    rng, ratios = trial.rng("beyond_positive_definite, singular"), []
    for m, n in SIZES:
        for _ in range(trial.of(20, 3)):
            F = make.integers(rng, n - m, n)
            problem = VelocityProblem(
                J=make.integer_basis(rng, m, n).J, xdot=make.integers(rng, m), W=F.T @ F, a=F.T @ make.integers(rng, n - m)
            ).stacked()
            (known,) = exact(problem)
            if known.expected == "unique_minimum":
                error = np.abs(six(problem).x[0] - known.x).max()
                ratios.append(error / (CLOSED_FORMS["eq6"].bound(problem)[0] * reach(problem, known.x[None])[0]))
    return at_most("error / bound, $W$ singular, of rank $n - m$", ratios, 1.0)


def _indefinite_example(six: Answer) -> tuple[Check, tuple[tuple[str, str, str], ...]]:
    """The planar 3R arm with W = diag(-1, 1, 1): numbers worked out by hand beside ours."""
    W = np.diag([-1.0, 1, 1])
    found = six(VelocityProblem(J=[J1] * 3, xdot=[ASKED, [1, 0], [0, 1]], W=W))
    cases = [
        ("qdot", "(1, −2, 1)", np.array([1, -2, 1]), found.x[0]),
        ("multipliers", "(−3, −1)", np.array([-3, -1]), found.y[0]),
        ("G, first column", "(0, −1, 1)", np.array([0, -1, 1]), found.x[1]),
        ("G, second column", "(1, −1, 0)", np.array([1, -1, 0]), found.x[2]),
        ("c*", "√2 − 1", np.array([np.sqrt(2) - 1]), np.array([finsler_threshold(J1, W)])),
    ]
    off = np.array([np.abs(ours - theirs).max() for _, _, theirs, ours in cases])
    rows = tuple((name, words, told(ours, 12) if len(ours) > 1 else f"{ours[0]:.12g}") for name, words, _, ours in cases)
    return at_most("planar 3R, $W$ = diag(−1, 1, 1): numbers worked out by hand", off, FORWARD * 3 * 2 * UNIT), rows


CLAIM = Claim(
    name="beyond_positive_definite",
    title="(6) reaches beyond positive definite weights",
    place="Section II, eq. (7)",
    says=r"Provided $N_J^T W N_J > 0$, (6) can be used even when $W$ is not positive definite.",
    formula=r"N_J^T W N_J > 0",
    tested=(
        r"Random symmetric $W$ with $m$ or more negative eigenvalues and $N_J^T W N_J > 0$, the most negative from close to "
        r"zero down to $-10^6$; and singular $W$ of rank $n - m$. As a second look, (2)–(5) on $W + cJ^TJ$, which by "
        "Finsler's lemma is positive definite for some $c$."
    ),
    accepted="(6) is within its error bound of the exact minimiser, where the Cholesky factorisation of $W$ breaks down.",
    paths=(
        CodePath("eq. (6), column-pivoted LU extended by $N_J^T W$", eq6),
        CodePath("the minimiser by exact elimination over the rationals", truth),
    ),
    examine=beyond_positive_definite,
    fault=Fault("$W$ made positive definite by the absolute values of its eigenvalues", size_of_weight),
    sources=(
        "P. Finsler, Über das Vorkommen definiter und semidefiniter Formen in Scharen quadratischer Formen, Commentarii "
        "Mathematici Helvetici 9, 1937",
    ),
)
