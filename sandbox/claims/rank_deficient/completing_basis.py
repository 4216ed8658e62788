"""Any basis that completes N_J serves in eq. (13); what each costs."""

from __future__ import annotations

from itertools import product

import numpy as np
import scipy.linalg

from problems.sets import construct as make
from sandbox.claims import equations
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_most
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.power import fitted, scientific
from sandbox.claims.rank_deficient.posed import KINDS, SANDBOX, Posed, answered, drawn, error, posed, scaled_rows
from sandbox.problem import VelocityProblem
from sandbox.reference import truth
from sandbox.solution import Solution
from sandbox.task import task_weight
from sandbox.tolerances import EXPONENT, ORIGINAL, ROBOT_RANK, UNIT

Array = np.ndarray

PREDICTED = (r"$u\,\sigma_1/\sigma_r$", r"$u\,(\sigma_1/\sigma_r)^2$", r"$u\,(\sigma_1/\sigma_r)^3$")

KAPPAS = (10.0, 1e13)
"""Conditions between which their growth is fitted: above they end at 1/u."""


def _scaled(J: Array, r: int) -> Array:
    _, sigma, Vt = np.linalg.svd(J)
    return Vt[:r].T / sigma[:r]


def _row_space(J: Array, r: int) -> Array:
    return np.linalg.svd(J)[2][:r].T


def _generic(J: Array, r: int) -> Array:
    return np.random.default_rng(r).standard_normal((J.shape[1], r))


def _rows(J: Array, r: int) -> Array:
    """As many rows of J as its rank, those that a column-pivoted QR of J' takes first: J' itself where m = r."""
    return J[scipy.linalg.qr(J.T, pivoting=True)[2][:r]].T


CHOICES = {
    r"$V_r \Sigma_r^{-1}$": _scaled,
    "$V_r$": _row_space,
    "random": _generic,
    "$r$ rows of $J$": _rows,
}
"""R_J (n, r) by what it is made of."""

EXPONENTS = {
    r"$V_r \Sigma_r^{-1}$": 1,
    "$V_r$": 1,
    "random": 2,
    "$r$ rows of $J$": 3,
}
"""Power of sigma_1 / sigma_r in the condition of (13)'s matrix, rows scaled.

Its first rows are (R'J'U_r) U_r'Wx J: the right factor costs one power, the left one what cannot be scaled away by rows.
"""


def graded(rng: np.random.Generator, r: int, n: int, depth: float) -> VelocityProblem:
    """Rank r of r + 1 rows, for the last row is the first again; sigma_r near 10^-depth, and xdot achievable."""
    A = make.real_basis(rng, r, n, 10.0 ** -np.linspace(0, depth, r)).J
    J = np.vstack([A, A[:1]])
    xdot = A @ rng.uniform(-1, 1, n)
    W, Wx = make.positive_definite(rng, n), make.positive_definite(rng, r + 1)
    return VelocityProblem(J=J, xdot=[*xdot, xdot[0]], W=W, a=rng.uniform(-1, 1, n), Wx=Wx)


def any_completing_basis(trial: Trial, thirteen: Answer, printed: Answer) -> Evidence:
    """(13) as printed with R, R C + N D and random R against eq13; then the cost of four choices of R as sigma_r falls."""
    rng = trial.rng("any_completing_basis")
    checks, conditions, differences, bounds = [], [], [], []
    for m, n in ((3, 5), (4, 6), (6, 7), (4, 3)) if trial.full else ((3, 5), (4, 3)):
        ratios = []
        for r, kind in product(range(1, min(m, n) + 1), KINDS):
            for _ in range(trial.of(4, 1)):
                one = posed(drawn(rng, m, n, r, *kind))
                x = answered(thirteen, one.problem)[0]
                C, D = make.unimodular(rng, r)[0], make.integers(rng, n - r, r)
                for R in (one.R @ C + one.N @ D, rng.standard_normal((n, r))):
                    other = printed(*one.parts, one.N, R)
                    kappa = np.linalg.cond(scaled_rows(one.problem, one.N, R))
                    conditions.append(kappa)
                    differences.append(float(np.abs(x - other).max() / one.size))
                    bounds.append(one.bound + ORIGINAL * n * UNIT * kappa)
                    ratios.append(differences[-1] / bounds[-1])
        checks.append(
            at_most(
                f"difference of (13) with two other bases / sum of bounds, $m = {m}$, $n = {n}$",
                ratios,
                1.0,
            )
        )
    scan = Plot(
        "(13) with $R_J C + N_J D$ and with random $R_J$: difference from (13) of the sandbox, one point a basis",
        Axis("condition of the matrix of (13) with that basis, rows scaled", log=True),
        Axis("relative difference of the joint rates", log=True),
        (
            Series("difference", conditions, differences),
            Series("sum of bounds", conditions, bounds, role="bound"),
        ),
    )
    more, plot, table = _cost_of_bases(trial, thirteen, printed, rng)
    return Evidence((*checks, *more), (scan, plot, table))


def _attempted(printed: Answer, one: Posed, N: Array, R: Array) -> Array:
    """(13) as printed; no rates at all where its matrix is singular to the last bit."""
    try:
        return np.asarray(printed(*one.parts, N, R))
    except np.linalg.LinAlgError:
        return np.zeros(one.problem.n)


def _off(x: Array, one: Posed) -> float:
    """Error of x relative to the minimiser, max norm."""
    return float(np.abs(x - one.x).max() / np.abs(one.x).max())


def _cost_of_bases(
    trial: Trial, thirteen: Answer, printed: Answer, rng: np.random.Generator
) -> tuple[list[Check], Plot, Table]:
    """Condition and error of (13) for each choice of R on exactly rank-deficient J of growing condition."""
    depths = np.linspace(0.5, 9.0, trial.of(35, 12))
    errors: dict[str, list[float]] = {name: [] for name in (*CHOICES, "eq13")}
    conditions: dict[str, list[float]] = {name: [] for name in CHOICES}
    shares, ratios = [], []
    for depth in depths:
        row: dict[str, list[float]] = {name: [] for name in errors}
        kappa: dict[str, list[float]] = {name: [] for name in CHOICES}
        for r, n in ((2, 4), (3, 6)):
            for _ in range(trial.of(6, 2)):
                problem = graded(rng, r, n, depth)
                one = Posed(problem, equations.null_space(problem.J, r), np.zeros((n, r)), truth(problem, "least_squares"))  # type: ignore[arg-type]
                x = answered(thirteen, problem)[0]
                ratios.append(error(x, one) / one.bound)
                row["eq13"].append(_off(x, one))
                for name, choose in CHOICES.items():
                    R = choose(problem.J, r)
                    row[name].append(_off(_attempted(printed, one, one.N, R), one))
                    kappa[name].append(np.linalg.cond(scaled_rows(problem, one.N, R)))
        shares.append(10.0**-depth)
        for name, values in row.items():
            errors[name].append(float(np.median(values)))
        for name, values in kappa.items():
            conditions[name].append(float(np.median(values)))
    checks = [at_most("(13) of the sandbox as $\\sigma_r/\\sigma_1$ falls: error / bound", ratios, 1.0, role=Role.OURS)]
    rows: list[tuple[str | float | int | None, ...]] = []
    spread, middle = 1 / np.array(shares), len(shares) // 2
    for name, expected in EXPONENTS.items():
        kappas = np.array(conditions[name])
        told = (kappas > KAPPAS[0]) & (kappas < KAPPAS[1])  # before it ends at 1/u
        power = fitted(spread[told], kappas[told])
        words = rf"power of $\sigma_1/\sigma_r$ in the condition of (13), off the predicted {expected} by: {name}"
        checks.append(at_most(words, abs(power - expected), EXPONENT, role=Role.OURS))
        rows.append((name, expected, power, kappas[middle], errors[name][middle], errors[name][-1]))
    rows.append(("(13) of the sandbox", 1, None, None, errors["eq13"][middle], errors["eq13"][-1]))
    unit = tuple(Series(PREDICTED[p - 1], shares, np.minimum(UNIT * spread**p, 1.0), "line", "bound") for p in (1, 2, 3))
    plot = Plot(
        r"What the choice of $R_J$ costs: median relative error of (13) on exactly rank-deficient $J$, $\dot x$ achievable",
        Axis(r"$\sigma_r/\sigma_1$", log=True), Axis("relative error of the joint rates", log=True),
        (*(Series(name if name in CHOICES else "(13) of the sandbox", shares, values, "line")
           for name, values in errors.items()), *unit),
    )  # fmt: skip
    columns = (
        "$R_J$", "power predicted", "power measured", f"condition at $\\sigma_r/\\sigma_1$ = {scientific(shares[middle])}",
        "error there", f"error at {scientific(shares[-1])}",
    )  # fmt: skip
    return (
        checks,
        plot,
        Table(
            "Four bases that complete $N_J$ equally in exact arithmetic: condition of (13), rows scaled, and error",
            columns,
            tuple(rows),
        ),
    )


def one_sided(thirteen: Answer) -> Answer:
    """Sigma^-1 of R = V Sigma^-1 forgotten on the right: Sigma^-1 V'J'Wx J qdot = V'J'Wx xdot."""

    def planted(problem: VelocityProblem) -> Solution:
        U, sigma, _ = np.linalg.svd(problem.J)
        Wx, m = task_weight(problem), problem.m
        kept = np.zeros((len(problem), m))
        kept[:, : sigma.shape[1]] = np.where(sigma > ROBOT_RANK * sigma[:, :1], sigma, 0.0)
        # an xdot in range J with U'Wx xdot_planted = Sigma U'Wx xdot
        span = np.where(kept[:, None, :] > 0, U, 0.0)
        right = kept * np.einsum("bij,bik,bk->bj", U, Wx, problem.xdot)
        middle = np.einsum("bij,bik,bkl->bjl", span, Wx, span)
        xdot = np.einsum("bij,bjk,bk->bi", span, np.linalg.pinv(middle), right)
        return thirteen(VelocityProblem(J=problem.J, xdot=xdot, W=problem.W, a=problem.a, Wx=problem.Wx))

    return planted


CLAIM = Claim(
    name="any_completing_basis",
    title="Any completing basis serves in (13), at very different cost",
    place="Section VI, eq. (13)",
    says=r"$R_J$ is a matrix whose columns complete those of $N_J$ to a spanning set of the whole space. Any such matrix "
    r"will do.",
    formula=r"R_J \to R_J C + N_J D, \quad \det C \ne 0",
    tested=r"Integer problems of every rank from 1, with $R_J C + N_J D$ for integer $C$ and $D$ in the place of $R_J$, and "
    r"with random $R_J$. Then four choices of $R_J$ on exactly rank-deficient $J$ whose $\sigma_1/\sigma_r$ grows to $10^9$.",
    accepted="All bases give the joint rates of the sandbox's own within the sum of the bounds. Ours is what a basis costs: "
    r"the condition of (13) grows as $\sigma_1/\sigma_r$ for $V_r \Sigma_r^{-1}$ and $V_r$, as its square for random $R_J$, "
    r"and as "
    "its cube for rows of $J$.",
    paths=(SANDBOX, CodePath("eq. (13) as printed, any $R_J$ and $N_J$, in numpy", equations.rank_deficient)),
    examine=any_completing_basis,
    fault=Fault(r"$R_J = V_r \Sigma_r^{-1}$ on the left of (13), $V_r$ on its right", one_sided),
)
