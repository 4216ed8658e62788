"""The weight has to be symmetric."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np

from problems.sets import construct as make
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_most, every
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.framework.curved import curved, rational
from sandbox.claims.framework.small_arms import ASKED, J1
from sandbox.claims.numbers import half_unit, told
from sandbox.claims.scatter import drawable
from sandbox.claims.situations import SIZES
from sandbox.closed_form.uncompiled import eq6_on
from sandbox.errors import AsymmetricWeightError
from sandbox.problem import VelocityProblem
from sandbox.reference.truth import truth_of_qp

Array = np.ndarray


def half_left_out(six: Answer) -> Answer:
    """The symmetric part taken for W + W'."""

    def planted(number: Any, J: Any, xdot: Any, W: Any, *rest: Any, **options: Any) -> Any:
        return six(number, J, xdot, 2 * W, *rest, **options)

    return planted


SKEW = np.array([[10.0, 8, 0], [0, 20, -5], [3, 0, 30]])
"""Ten times the weight of the table, in whole numbers: for a = 0 the same motion."""


def symmetric_weight(trial: Trial, six: Answer, exact: Answer) -> Evidence:
    """(6) in Fractions with W as it stands and with (W + W')/2, beside the exact minimiser of 1/2 qdot'W qdot + a'qdot."""
    rng, count, sweep = trial.rng("symmetric_weight"), trial.of(2, 1), 2.0 ** -np.arange(trial.of(12, 3))
    symmetrised, other, refused = [], [], []
    lines: list[Series] = []
    for m, n in SIZES:
        for i in range(count):
            problem, N, _ = curved(rng, m, n, "minimum")
            upper = np.triu(make.nonzero_integers(rng, n, n), 1)
            S, asymmetry, errors = problem.W.dense(), [], []
            for share in sweep:
                W = S + share * (upper - upper.T)
                minimiser = exact(W, problem.a, problem.J, problem.xdot).x_exact
                literal = six(Fraction, problem.J, problem.xdot, W, problem.a)[1]
                half = six(Fraction, problem.J, problem.xdot, (W + W.T) / 2, problem.a)[1]
                symmetrised.append(tuple(half) == minimiser)
                if (rational(N.T @ (W - W.T)) @ np.array(minimiser)).any():
                    other.append(tuple(literal) != minimiser)
                refused.append(_refuses(problem, W))
                asymmetry.append(np.linalg.norm(W - W.T) / np.linalg.norm(S))
                off = max(abs(float(u - v)) for u, v in zip(literal, minimiser, strict=True))
                errors.append(off / max(map(abs, map(float, minimiser))))
            if i == 0:
                lines.append(Series(f"{m} × {n}", np.array(asymmetry), drawable(np.array(errors)), "line"))
    figures, rows = _skew_example(six, exact)
    checks = (
        every("$(W + W^T)/2$: (6) gives the exact minimiser of $\\frac{1}{2}\\dot q^TW\\dot q + a^T\\dot q$", symmetrised),
        figures,
        every("$W$ as it stands, $N_J^T(W - W^T)\\dot q \\neq 0$: (6) gives another motion", other, role=Role.OURS),
        every("the sandbox refuses a $W$ that is not symmetric", refused, role=Role.OURS),
    )
    plot = Plot(
        "How far (6) with a $W$ that is not symmetric is from the minimiser, one problem in each size $m × n$, in exact "
        "arithmetic: while that is small in proportion to $W - W^T$, which $N_J^TW$ holds and the objective does not.",
        Axis("|W − Wᵀ| / |S|, S = (W + Wᵀ)/2", log=True), Axis("relative error of the joint rates", log=True), tuple(lines),
    )  # fmt: skip
    table = Table(
        "Planar 3R at (0, π/2, −π/2), $\\dot x$ = (1, 1), $W$ = (1, 0.8, 0; 0, 2, −0.5; 0.3, 0, 3)",
        ("quantity", "by hand", "found"), rows,
    )  # fmt: skip
    return Evidence(checks, (plot, table))


def _refuses(problem: VelocityProblem, W: Array) -> bool:
    try:
        VelocityProblem(J=problem.J, xdot=problem.xdot, W=W, a=problem.a)
    except AsymmetricWeightError:
        return True
    return False


def _skew_example(six: Answer, exact: Answer) -> tuple[Check, tuple[tuple[str, str, str], ...]]:
    """Numbers worked out by hand beside ours."""
    zero = np.zeros(3)
    cases = (
        ("(6) with W as it stands", (0.863636, -1.863636, 1.136364), six(Fraction, J1, ASKED, SKEW, zero)[1]),
        ("minimiser, exactly", (0.875, -1.875, 1.125), exact(SKEW, zero, J1, ASKED).x_exact),
        ("(6) with (W + Wᵀ)/2", (0.875, -1.875, 1.125), six(Fraction, J1, ASKED, (SKEW + SKEW.T) / 2, zero)[1]),
    )
    off = [max(abs(float(u) - v) for u, v in zip(found, stated, strict=True)) for _, stated, found in cases]
    rows = tuple(
        (name, told(stated), "(" + ", ".join(str(v).replace("-", "−") for v in found) + ")") for name, stated, found in cases
    )
    return at_most("planar 3R: the numbers worked out by hand, to half a unit of their sixth decimal", off, half_unit(6)), rows


CLAIM = Claim(
    name="symmetric_weight",
    title="The weight stays symmetric where it need not be positive definite",
    place="Section II, before eq. (3) and eq. (7)",
    says=(
        "$W$ is a symmetric positive definite matrix; provided (7), (6) can be used even when it is not positive definite. "
        "(We read: symmetric it stays.)"
    ),
    formula=r"\nabla\left(\tfrac{1}{2}\dot q^T W\dot q\right) = \tfrac{1}{2}(W + W^T)\dot q",
    tested=(
        r"Problems of whole numbers with $W$ made asymmetric, from slightly to much: (6) on fractions with $W$ as it stands "
        r"and with $(W + W^T)/2$, beside the exact minimiser of $\frac{1}{2}\dot q^T W\dot q + a^T\dot q$."
    ),
    accepted=(
        r"With $(W + W^T)/2$ the exact minimiser. With $W$ as it stands another motion: the paper says symmetric once, where "
        "it says positive definite, and only the second can be dropped."
    ),
    paths=(
        CodePath("eq. (6) on fractions, any square $W$", eq6_on),
        CodePath("the quadratic programme by exact elimination over the rationals", truth_of_qp),
    ),
    examine=symmetric_weight,
    fault=Fault("$W + W^T$ taken for the symmetric part, the half left out", half_left_out),
)
