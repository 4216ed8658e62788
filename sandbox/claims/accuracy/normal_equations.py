"""The matrix that eqs. (2)-(5) factor, and its condition: cond(J J') = cond(J)^2."""

from __future__ import annotations

import numpy as np

from sandbox.claims.claim import Answer, Claim, CodePath, Evidence, Fault, Role, Trial, at_most
from sandbox.claims.exact_condition import exactly
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.single_compiled import factored
from sandbox.claims.situations import SIZES, positive
from sandbox.tolerances import FORWARD, UNIT

Array = np.ndarray


def matrix_of_the_normal_equations(trial: Trial, formed: Answer, exact: Answer) -> Evidence:
    """The matrix that the kernel factors for random W = L L', beside J W^-1 J' and J W J' in exact rationals."""
    rng = trial.rng("matrix_of_the_normal_equations")
    conditions: list[list[Array]] = [[], [], []]
    squared, read, literal, off, plain, rows = [], [], [], [], [], []
    for m, n in SIZES:
        count = trial.of(40, 4)
        J = rng.normal(size=(count, m, n))
        # eighths: W = L L' is exact
        L = np.tril(rng.integers(-8, 9, (count, n, n)) / 8.0, -1) + np.eye(n) * rng.integers(2, 17, (count, 1, n)) / 8.0
        W = L @ L.transpose(0, 2, 1)
        square, inverse, printed = exact(J, L)
        matrix, identity = formed(J, W), formed(J, np.broadcast_to(np.eye(n), W.shape))
        rounding = FORWARD * n * UNIT * np.linalg.cond(W)
        found = np.linalg.cond(matrix)
        squared.append(np.abs(found - square) / square / (FORWARD * n * UNIT * square + rounding * np.sqrt(square)))
        read.append(_apart(matrix, inverse) / rounding)
        off.append(_apart(matrix, printed))
        literal.append(off[-1] / rounding)
        plain.append(_apart(identity, J @ J.transpose(0, 2, 1)) / (FORWARD * n * UNIT))
        other = np.linalg.cond(printed)
        for whole, part in zip(conditions, (square, found, other), strict=True):
            whole.append(part)
        times = np.maximum(other / square, square / other)
        rows.append((f"{m} × {n}", count, (read[-1] * rounding).max(), off[-1].min(), np.median(times), times.max()))
    square, found, printed = (np.concatenate(part) for part in conditions)
    furthest, nearest = float(np.concatenate(read).max()), float(np.concatenate(off).min())
    checks = (
        at_most(
            r"$J W J^T$ is the matrix formed: its distance from the matrix factored / rounding",
            np.concatenate(literal),
            1.0,
            role=Role.PRINTED,
            range=(
                rf"Read $J W^{{-1}} J^T$, which (5) forms. This is the matrix factored, to {furthest:.2g} of its rounding "
                rf"bound; $J W J^T$ is {100 * nearest:.0f} % or more of its own size away. With $W = I$ the two are one."
            ),
        ),
        at_most(r"$J W^{-1} J^T$ is the matrix formed: distance / rounding", np.concatenate(read), 1.0),
        at_most(
            r"$\mathrm{cond}(J W^{-1} J^T) = \mathrm{cond}(J L^{-T})^2$: relative difference / bound",
            np.concatenate(squared),
            1.0,
        ),
        at_most(r"with $W = I$ both are $J J^T$: distance / rounding", np.concatenate(plain), 1.0),
    )
    line = np.geomspace(min(square.min(), printed.min()), max(square.max(), printed.max()), 30)
    plot = Plot(
        r"Condition of the matrix that (2)–(5) factor for random $W > 0$, and of $J W J^T$ as it is printed",
        Axis(r"$\mathrm{cond}(J L^{-T})^2$, $W = L L^T$ (exact)", log=True), Axis("condition number", log=True),
        (
            Series("the matrix factored", square, found), Series("$J W J^T$", square, printed, role="paper"),
            Series(r"$\mathrm{cond}(J L^{-T})^2$", line, line, "line", "bound"),
        ),
    )  # fmt: skip
    table = Table(
        r"Relative distance from the matrix factored, and by how many times the condition numbers of $J W J^T$ (printed) and "
        "$J W^{-1} J^T$ (formed) differ",
        (
            "m × n", "problems", "largest distance of $J W^{-1} J^T$", "smallest distance of $J W J^T$",
            "condition numbers differ: median, times", "largest, times",
        ), tuple(rows),
    )  # fmt: skip
    return Evidence(checks, (plot, table))


def _apart(A: Array, B: Array) -> Array:
    """Distance of A from B, relative, (B,)."""
    return np.linalg.norm(A - B, axis=(1, 2)) / np.linalg.norm(B, axis=(1, 2))


def weighted_by_the_inverse(formed: Answer) -> Answer:
    """W^-1 in the place of W."""
    return lambda J, W: formed(J, np.linalg.inv(W))


def condition_number_squared(trial: Trial, formed: Answer, exact: Answer) -> Evidence:
    """cond2 of the matrix that the kernel factors, W = I, beside the exact square of cond2(J)."""
    rng = trial.rng("condition_number_squared")
    checks, rows, parts = [], [], []
    for m, n in SIZES:
        J = positive(rng, m, n, trial.of(100, 6), decades=5.0).J
        square = exact(J, np.broadcast_to(np.eye(n), (len(J), n, n)))[0]
        factor = np.linalg.cond(formed(J, None))
        difference, bound = np.abs(factor - square) / square, FORWARD * n * UNIT * square
        says = r"$\mathrm{cond}_2(J J^T)$ of the matrix factored against the exact $\mathrm{cond}_2(J)^2$: difference / bound, "
        checks.append(at_most(rf"{says}$m = {m}$, $n = {n}$", difference / bound, 1.0))
        rows.append((f"{m} × {n}", len(J), np.sqrt(square.max()), square.max(), difference.max(), (difference / bound).max()))
        parts.append((np.sqrt(square), factor, difference, bound))
    x, found, off, limits = (np.concatenate(part) for part in zip(*parts, strict=True))
    line = np.geomspace(x.min(), x.max(), 30)
    squares = Plot(
        "Condition of the matrix that (2)–(5) factor, against that of $J$; one point a Jacobian, sizes from 1×2 to 6×8",
        Axis(r"$\mathrm{cond}\,J$ (exact)", log=True), Axis(r"condition of $J J^T$ as factored", log=True),
        (Series("factored in float64", x, found), Series(r"$\mathrm{cond}(J)^2$", line, line**2, "line", "bound")),
    )  # fmt: skip
    lost = Plot(
        r"What forming $J J^T$ in float64 loses: relative error of its condition number, beside the bound "
        r"$50\,n\,u\,\mathrm{cond}(J)^2$",
        Axis(r"$\mathrm{cond}\,J$ (exact)", log=True), Axis("relative error", log=True),
        (Series("relative error", x, off), Series("bound", x, limits, role="bound")),
    )  # fmt: skip
    columns = (
        "m × n",
        "Jacobians",
        "largest cond J",
        "its square",
        "largest relative difference",
        "largest share of the bound",
    )
    table = Table(
        r"The condition of $J J^T$ as (2)–(5) factor it, and the exact square of $\mathrm{cond}\,J$", columns, tuple(rows)
    )
    return Evidence(tuple(checks), (squares, lost, table))


def other_side(formed: Answer) -> Answer:
    """J'J in the place of JJ'."""
    return lambda J, W: J.transpose(0, 2, 1) @ J


FACTORED = (
    CodePath("the matrix whose Cholesky factor the compiled kernel of (2)–(5) leaves", factored),
    CodePath("exact rationals: singular values from the characteristic polynomial, $J J^T$ not formed", exactly),
)

CLAIMS = (
    Claim(
        name="matrix_of_the_normal_equations",
        title="The matrix that (2)–(5) factor",
        place="Section V, first paragraph",
        says=(
            r"(6) tends to suffer less from numerical errors than (2)–(5) because conditioning problems with $J$ are "
            r"compounded in forming $J W J^T$."
        ),
        formula=r"\mathrm{cond}(J W^{-1} J^T) = \mathrm{cond}(J L^{-T})^2, \quad W = L L^T",
        tested=(
            r"Which matrix is formed; how the errors grow has a claim of its own below. Random $J$ and $W = L L^T$ with $L$ in "
            r"eighths, in eight sizes from 1×2 to 6×8: the matrix that the kernel of (2)–(5) factors beside $J W J^T$ and "
            r"$J W^{-1} J^T$ in exact rationals."
        ),
        accepted=(
            r"To the letter: the matrix is $J W J^T$, up to rounding. Corrected: it is $J W^{-1} J^T$, as in (5), and its "
            r"condition number is the square of that of $J L^{-T}$."
        ),
        paths=FACTORED,
        examine=matrix_of_the_normal_equations,
        fault=Fault(r"$W^{-1}$ handed to the normal equations in the place of $W$", weighted_by_the_inverse),
    ),
    Claim(
        name="condition_number_squared",
        title="The normal equations square the condition number",
        place="Section V, first paragraph",
        says=r"With $W = I$ the two-norm condition number of $J W J^T$ is the square of that of $J$.",
        formula=r"\mathrm{cond}_2(J J^T) = \mathrm{cond}_2(J)^2",
        tested=r"Random $J$ with condition numbers up to $10^5$, in eight sizes from 1×2 to 6×8.",
        accepted=r"The relative difference is at most $50\,n\,u\,\mathrm{cond}(J)^2$: forming $J J^T$ in float64 may lose it.",
        paths=FACTORED,
        examine=condition_number_squared,
        fault=Fault(r"$J^T J$ in the place of $J J^T$", other_side),
    ),
)
