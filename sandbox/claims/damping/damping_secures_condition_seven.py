"""Condition (7) at exact algorithmic singularities."""

from __future__ import annotations

import numpy as np

from problems.methods.draw import scattered
from sandbox.claims import equations
from sandbox.claims.claim import Answer, Claim, CodePath, Evidence, Fault, Role, Trial, at_least, at_most, every
from sandbox.claims.damping.law import DAMPED
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.numbers import told
from sandbox.claims.postures import J1
from sandbox.closed_form import CLOSED_FORMS
from sandbox.closed_form.eq6 import eq6
from sandbox.closed_form.kernels import SOLVED
from sandbox.closed_form.uncompiled import eq6_exact
from sandbox.problem import VelocityProblem
from sandbox.solution import Solution
from sandbox.tolerances import ORIGINAL, UNIT
from sandbox.weight import Weight

Array = np.ndarray

SIZES = ((1, 2), (2, 3), (2, 4), (4, 6), (6, 7), (3, 7))


DECADES = np.arange(0, 11)
"""Exponents -s of the size of W~ beside grad g grad g'."""


TINY = 2.0**-300
"""A W~ that floats would not see beside E'E."""


def subtracted(six: Answer) -> Answer:
    """W = grad g grad g' - W~."""

    def planted(problem: VelocityProblem) -> Solution:
        W = Weight(-problem.W.base, problem.W.E, problem.W.gamma)
        return six(VelocityProblem(J=problem.J, xdot=problem.xdot, W=W, a=problem.a))

    return planted


def conflicting(rng: np.random.Generator, m: int, n: int, count: int, bases: Array) -> VelocityProblem:
    """Whole-number J of full row rank and E (n - m, n) with its first row in range J': N'E' is exactly singular."""
    k, J, E = n - m, np.empty((count, m, n)), np.empty((count, n - m, n))
    for i in range(count):
        while True:
            rows = rng.integers(-3, 4, (m, n)).astype(float)
            if np.linalg.matrix_rank(rows) == m:
                break
        J[i], E[i] = rows, rng.integers(-3, 4, (k, n))
        mixed = np.zeros(n)
        while not mixed.any():
            mixed = rng.integers(-2, 3, m) @ rows
        E[i, 0] = mixed
    gbar = rng.uniform(-1, 1, (count, k))
    a = -np.einsum("bkn,bk->bn", E, gbar)
    return VelocityProblem(J=J, xdot=rng.uniform(-1, 1, (count, m)), W=Weight(bases, E), a=a)


def damping_secures_condition_seven(trial: Trial, six: Answer, reduced: Answer) -> Evidence:
    """W~ + E'E at exact algorithmic singularities: the pivots of (6) and the eigenvalues of N'WN; without W~; cases by hand."""
    rng = trial.rng("damping_secures_condition_seven")
    accepted, positive, floor, sizes, lowest = [], [], [], [], []
    exact: list[bool] = []
    bare: list[bool] = []
    for m, n in SIZES:
        count = trial.of(40, 3)
        for s in DECADES:
            base = scattered(rng, n, count) * 10.0**-s
            problem = conflicting(rng, m, n, count, base)
            assert problem.W.E is not None
            W = problem.W.dense()
            curvature = np.array([np.linalg.eigvalsh(reduced(problem.J[i], W[i]))[0] for i in range(count)])
            least = np.linalg.eigvalsh(base)[:, 0]
            rounding = ORIGINAL * n * UNIT * np.linalg.norm(W, axis=(1, 2))
            accepted.append([status.answered for status in six(problem).status])
            positive.append(curvature > 0)
            floor.append((curvature + rounding) / least)
            sizes.append(np.linalg.norm(base, 2, axis=(1, 2)) / np.linalg.norm(problem.W.E, 2, axis=(1, 2)) ** 2)
            lowest.append(curvature / np.linalg.norm(problem.W.E, 2, axis=(1, 2)) ** 2)
            if s == DECADES[-1]:
                for i in range(trial.of(4, 1)):
                    for base, kept in ((np.zeros((n, n)), bare), (TINY * np.eye(n), exact)):
                        one = VelocityProblem(
                            J=problem.J[i], xdot=problem.xdot[i], W=Weight(base, problem.W.E[i]), a=problem.a[i]
                        )
                        code, _, _, pivots = eq6_exact(one)
                        kept.append(code == SOLVED and min(pivots[m:]) > 0)
    said, true = np.concatenate(accepted), np.concatenate(positive)
    xdot, W3 = np.array([0.3, -0.7]), 0.01 * np.diag([1.0, 2, 3])
    cases = (
        ("$g = q_1 + q_2 + q_3$, $\\tilde W = 0.01\\,\\mathrm{diag}(1, 2, 3)$", np.array([[1.0, 1, 1]]), W3,
         (-1.526415094340, 1.226415094340, 1.126415094340), 12),
        ("$g = q_1 + q_2$, algorithmic singularity, $\\tilde W = 0.01\\,I$", np.array([[1.0, 1, 0]]), 0.01 * np.eye(3),
         tuple(np.linalg.pinv(J1) @ xdot), 15),
    )  # fmt: skip
    rows, ratios = [], []
    for words, e, base, expected, decimals in cases:
        problem = VelocityProblem(J=J1, xdot=xdot, W=Weight(base, e), a=-0.9 * e[0]).stacked()
        x = six(problem).x[0]
        allowed = max(CLOSED_FORMS["eq6"].bound(problem)[0] * np.abs(expected).max(), 0.5 * 10.0**-decimals)
        ratios.append(np.abs(x - expected).max() / allowed)
        plain = six(VelocityProblem(J=J1, xdot=xdot, W=Weight(np.zeros((3, 3)), e), a=-0.9 * e[0]).stacked())
        rows.append((words, told(expected, 9), told(x, 9), told(plain.x[0]) if plain.status[0].answered else "refused",
                     float(np.linalg.eigvalsh(reduced(J1, base + e.T @ e))[0])))  # fmt: skip
    checks = (
        every("eq. (6) accepts $\\tilde W + E^T E$ at an exact algorithmic singularity, by its pivots", said),
        every(r"(6) accepts where, and only where, the eigenvalues of $N_J^T W N_J$ are positive", said == true),
        at_least(r"$(\lambda_{\min}(N_J^T W N_J)$ + rounding$) / \lambda_{\min}(\tilde W)$", np.concatenate(floor), 1.0),
        every(r"on rationals the last $n - m$ pivots are positive even for $\tilde W = 2^{-300} I$", exact, role=Role.OURS),
        every(r"and without $\tilde W$ one of them is not, in every situation", np.logical_not(bare), role=Role.OURS),
        at_most("cases worked out by hand: difference / bound", ratios, 1.0, role=Role.OURS),
    )  # fmt: skip
    size, low = np.concatenate(sizes), np.concatenate(lowest)
    guide = np.array([size.min(), size.max()])
    shown = slice(None, None, max(1, len(size) // 900))
    plot = Plot(
        r"At exact algorithmic singularities: the smallest eigenvalue of N'WN is in proportion to W̃; without W̃ it is zero",
        Axis("|W̃| / |E|²", log=True), Axis("smallest eigenvalue of N'WN, over |E|²", log=True),
        (Series("a situation", size[shown], low[shown], text=["accepted" if ok else "refused" for ok in said[shown]]),
         Series("W̃ = ε I: ε", guide, guide, "line", "bound"), Series("rounding, n u", guide, [7 * UNIT] * 2, "line", "bound")),
    )  # fmt: skip
    table = Table(
        r"$q = (0, \pi/2, -\pi/2)$, $\dot x = (0.3, -0.7)$, $\bar g = 0.9$: joint rates of the damped augmented Jacobian "
        r"[rad/s]",
        ("case", "by hand", "ours", "undamped", r"$\lambda_{\min}(N_J^T W N_J)$"), tuple(rows),
    )  # fmt: skip
    return Evidence(checks, (plot, table))


CLAIM = Claim(
    name="damping_secures_condition_seven",
    title="Damping makes condition (7) hold everywhere",
    place="Section III, last paragraph; eq. (7)",
    says=r"Methods whose $W$ is not positive definite can be made more robust by damping: $W = \tilde W + \nabla g "
    r"(\nabla g)^T$ with $\tilde W$ positive definite and of small relative norm.",
    formula=r"W = \tilde W + \nabla g (\nabla g)^T, \quad \tilde W > 0 \quad \Rightarrow \quad N_J^T W N_J > 0",
    tested=r"Whole-number $J$ and rows $E$ that are in conflict exactly, in six sizes with up to four degrees of redundancy; "
    r"$\tilde W$ over ten decades; and cases worked out by hand. The rows stand for $(\nabla g)^T$ and, in the damped "
    r"version of "
    r"Baillieul's method, for $(\nabla(n_J^T \nabla g))^T$ alike.",
    accepted=r"Eq. (6) accepts every one, and the eigenvalues of $N_J^T W N_J$ are at least $\lambda_{\min}(\tilde W)$.",
    paths=(
        CodePath("eq. (6), condition (7) read from the pivots of its LU", eq6),
        CodePath("eigenvalues of $N_J^T W N_J$, $N_J$ by singular values, numpy", equations.reduced_weight),
    ),
    examine=damping_secures_condition_seven,
    fault=Fault(r"$\tilde W$ subtracted", subtracted),
    sources=DAMPED.works,
)
