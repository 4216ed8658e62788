"""Eq. (6) with any basis of the null space."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np

from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Trial, at_most, every
from sandbox.claims.exhibit import Axis, Plot, Series
from sandbox.claims.framework.curved import curved, rational
from sandbox.claims.framework.reach import reach
from sandbox.claims.scatter import drawable
from sandbox.claims.situations import SIZES, positive
from sandbox.closed_form.eq6_implicit import eq6_implicit, implicit_bound
from sandbox.closed_form.null_basis import orthonormal, pivoted
from sandbox.closed_form.uncompiled import eq6_exact, eq6_implicit_on
from sandbox.reference.truth import truth
from sandbox.solution import Solution
from sandbox.stacked import times, transpose

Array = np.ndarray


def right_side_normalised(six: Answer) -> Answer:
    """Columns of N scaled to one in N'grad f, and not in N'W: two bases in one equation."""

    def planted(J: Any, xdot: Any, N: Any, NtW: Any, Nta: Any) -> Solution:
        return six(J, xdot, N, NtW, Nta / np.linalg.norm(N, axis=-2))

    return planted


def any_spanning_basis(trial: Trial, six: Answer, exact: Answer) -> Evidence:
    """(6) with the basis of the LU, of the SVD, and with N C for C of every condition, beside the exact minimiser."""
    rng, count = trial.rng("any_spanning_basis"), trial.of(12, 2)
    checks: list[Check] = []
    points: dict[str, list[tuple[Array, Array, Array]]] = {"basis of the LU": [], "basis of the SVD": [], "N C, C random": []}
    for m, n in SIZES:
        problem = positive(rng, m, n, count, decades=1.5)
        x, N, ratios = np.stack([one.x for one in exact(problem)]), orthonormal(problem.J), []
        bases = [("basis of the LU", pivoted(problem.J)), ("basis of the SVD", N)]
        bases += [("N C, C random", N @ _mixing(rng, n - m, count, decades)) for decades in rng.uniform(0.0, 5.0, 6)]
        for name, basis in bases:
            NtW, Nta = problem.W.left(basis), times(transpose(basis), problem.a)
            found = six(problem.J, problem.xdot, basis, NtW, Nta).x
            size = np.abs(x).max(axis=-1)
            bound = implicit_bound(problem.J, basis, NtW) * reach(problem, x) / size
            error = np.abs(found - x).max(axis=-1) / size
            # of one column only the length can be chosen
            spread = np.linalg.cond(basis) if n - m > 1 else np.ones(count)
            points[name].append((spread, error, bound))
            ratios.append(error / bound)
        checks.append(at_most(f"error / bound over all bases, $m = {m}$, $n = {n}$", ratios, 1.0))
    checks.append(every("in rational arithmetic: every basis gives the same $\\dot q$, exactly", _exactly(trial, exact)))
    series = []
    for name, parts in points.items():
        spread, error, bound = (np.concatenate(part) for part in zip(*parts, strict=True))
        series.append(Series(name, spread, drawable(error)))
        if name.startswith("N C"):
            series.append(Series("error bound of N C", spread, bound, role="bound"))
    plot = Plot(
        "Error of (6) against the exact minimiser; an error of zero is drawn at the foot. In exact arithmetic the basis has no "
        "effect; in float64 the error grows with the condition of the basis, and so does its bound.",
        Axis("condition of the basis used", log=True), Axis("relative error of the joint rates", log=True), tuple(series),
    )  # fmt: skip
    return Evidence(tuple(checks), (plot,))


def _mixing(rng: np.random.Generator, k: int, count: int, decades: float) -> Array:
    """Random C (count, k, k) of condition 10^decades; of that size where k = 1."""
    left, right = (np.linalg.qr(rng.standard_normal((count, k, k)))[0] for _ in range(2))
    return left * 10.0 ** -np.linspace(0.0, decades, k) @ right if k > 1 else left * 10.0**-decades


def _exactly(trial: Trial, exact: Answer) -> list[bool]:
    """Whether (6) in Fractions is the exact minimiser: basis of the LU, N of whole numbers, and N C with C ill-conditioned."""
    rng, held = trial.rng("any_spanning_basis, exactly"), []
    for m, n in SIZES:
        for _ in range(trial.of(5, 1)):
            problem, N, _kind = curved(rng, m, n, "minimum")
            minimiser = list(exact(problem).x_exact or ())
            W, a, k = rational(problem.W.dense()), rational(problem.a), n - m
            # Hilbert's matrix, its columns from 1 down to 10^-9
            C = np.array([[Fraction(1, (i + j + 1) * 1000**j) for j in range(k)] for i in range(k)])
            for basis in (rational(N), rational(N) @ C):
                held.append(list(eq6_implicit_on(Fraction, problem.J, problem.xdot, basis.T @ W, basis.T @ a)[1]) == minimiser)
            held.append(list(eq6_exact(problem)[1]) == minimiser)
    return held


CLAIM = Claim(
    name="any_spanning_basis",
    title="Any basis of the null space will do",
    place="Section II, eq. (6)",
    says=r"In (6) $N_J$ is any $n \times (n - m)$ matrix whose columns span the null space of $J$.",
    formula=(
        r"N_J \to N_J C: \quad \begin{bmatrix} J \\ C^T N_J^T W \end{bmatrix} \dot q = "
        r"\begin{bmatrix} \dot x \\ -\alpha C^T N_J^T \nabla f \end{bmatrix}"
    ),
    tested=(
        "Random problems in eight sizes, each solved with the basis of the paper's LU, with that of the singular value "
        r"decomposition, and with $N_J C$, $C$ random of condition 1 to $10^5$; and in rational arithmetic with $C$ a "
        r"scaled "
        r"Hilbert matrix."
    ),
    accepted="In rational arithmetic the answers are equal; in float64 each is within its error bound.",
    paths=(
        CodePath(r"eq. (6) from $N_J$, $N_J^T W$ and $N_J^T\nabla f$ alone", eq6_implicit),
        CodePath("the minimiser by exact elimination over the rationals", truth),
    ),
    examine=any_spanning_basis,
    fault=Fault(r"columns of $N_J$ normalised in $N_J^T\nabla f$ and not in $N_J^T W$", right_side_normalised),
)
