"""Section VI: eq. (13), where J is not of full rank."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np
import scipy.linalg
from flint import fmpz_mat

from problems import robots
from problems.methods.least_squares_rank_deficient import singular
from problems.sets import construct as make
from problems.sets.rank_deficient import Case, member
from sandbox.claims import equations
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_least, at_most, every
from sandbox.claims.exhibit import Axis, Heat, Plot, Series, Table
from sandbox.claims.situations import SIZES, indefinite, positive
from sandbox.closed_form import CLOSED_FORMS
from sandbox.closed_form.eq13 import eq13
from sandbox.problem import VelocityProblem
from sandbox.reference import Truth, truth
from sandbox.reference.exact import Dyadic, inertia, kernel
from sandbox.solution import Solution, Status
from sandbox.task import task_weight
from sandbox.tolerances import EXPONENT, FORWARD, ORIGINAL, ROBOT_RANK, TIKHONOV, UNIT
from sandbox.weight import Weight

Array = np.ndarray

SHAPES = ((1, 2), (2, 3), (3, 3), (3, 5), (4, 6), (6, 7), (3, 2), (4, 3), (5, 4))
"""(m, n), n < m among them; every rank 0..min(m, n) is examined."""

KINDS = (
    ("achievable", "identity", "positive definite"),
    ("achievable", "indefinite off range J", "indefinite"),
    ("unachievable", "identity", "indefinite"),
    ("unachievable", "positive definite", "positive definite"),
    ("unachievable", "positive definite", "indefinite"),
    ("unachievable", "indefinite off range J", "indefinite"),
)
"""(xdot, Wx, W) of problems/sets/rank_deficient.py for which eq. (13) has its minimum."""


KAPPAS = (10.0, 1e13)
"""Conditions between which their growth is fitted: above they end at 1/u."""


def shown(errors: Iterable[float]) -> Array:
    """Errors for a logarithmic axis: what is exactly zero is left out."""
    values = np.asarray(list(errors) if not isinstance(errors, np.ndarray) else errors, dtype=float)
    return np.where(values > 0, values, np.nan)


def slope(x: Array, y: Array) -> float:
    """Exponent p of y ~ x^p, by least squares of the logarithms."""
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


class Posed(NamedTuple):
    """One exactly rank-deficient problem, and what the rationals say of it.

    N (n, n - r) spans null J, R (n, r) completes it: unit vectors of the independent columns of J; both exact.
    """

    problem: VelocityProblem
    N: Array
    R: Array
    told: Truth

    @property
    def r(self) -> int:
        """Rank of J."""
        return int(self.R.shape[1])

    @property
    def x(self) -> Array:
        """The minimiser (n,), rounded once; NaN where there is none."""
        return np.full(self.problem.n, np.nan) if self.told.x is None else self.told.x

    @property
    def parts(self) -> tuple[Array, Array, Array, Array, float, Array]:
        """J, xdot, W, grad f, alpha = 1, Wx, as `equations.rank_deficient` takes them."""
        p = self.problem
        return p.J, p.xdot, p.W.dense(), p.a, 1.0, task_weight(p)

    @property
    def matrix(self) -> Array:
        """The matrix of eq. (13) with R and N, rows scaled to one."""
        return scaled_rows(self.problem, self.N, self.R)

    @property
    def size(self) -> float:
        """max(|x|, s), s the largest entry of |X11||a| + |X12||xdot|: what errors of the closed forms are relative to."""
        J, xdot, W, a, _, Wx = self.parts
        V = np.linalg.svd(J)[2]
        V, N = V[: self.r].T, V[self.r :].T
        move = N @ np.linalg.solve(N.T @ W @ N, N.T)
        to_range = V @ np.linalg.solve((J @ V).T @ Wx @ (J @ V), (J @ V).T @ Wx)
        s = np.abs(move) @ np.abs(a) + np.abs(to_range - move @ W @ to_range) @ np.abs(xdot)
        return float(max(np.abs(self.x).max(), s.max()))

    @property
    def bound(self) -> float:
        """Relative error bound of eq13."""
        return float(CLOSED_FORMS["eq13"].bound(self.problem.stacked())[0])


def scaled_rows(problem: VelocityProblem, N: Array, R: Array) -> Array:
    """[R'J'Wx J; N'W], rows scaled to one."""
    J, W, Wx = problem.J, problem.W.dense(), task_weight(problem)
    matrix = np.vstack([R.T @ J.T @ Wx @ J, N.T @ W])
    return matrix / np.linalg.norm(matrix, axis=1, keepdims=True)


def exact_bases(J: Array) -> tuple[Array, Array]:
    """(N, R) for one J (m, n), without rounding: N integer, R unit vectors of independent columns of J."""
    n = J.shape[1]
    found = kernel(Dyadic.of(np.column_stack([J, np.zeros(len(J))])).integers)
    N = np.array([[int(v) for v in row] for row in found.directions.tolist()], dtype=float).reshape(n + 1, -1)[:n]
    return N / np.maximum(np.gcd.reduce(N.astype(np.int64), axis=0), 1), np.eye(n)[:, found.pivots]


def posed(problem: VelocityProblem, exact: Answer = truth) -> Posed:
    """One problem with its exact bases and its truth."""
    return Posed(problem, *exact_bases(problem.J), exact(problem, "least_squares"))


def drawn(rng: np.random.Generator, m: int, n: int, r: int, xdot: str, Wx: str, W: str) -> VelocityProblem:
    """One problem of integer data with rank J = r exactly."""
    one = member(Case(m, n, r, xdot, Wx, W), rng)
    return VelocityProblem(J=one.J, xdot=one.xdot, W=one.W, a=one.a, Wx=one.Wx)


def answered(thirteen: Answer, problem: VelocityProblem) -> tuple[Array, Status]:
    """(x, status) of eq. (13) on one problem."""
    solution = thirteen(problem.stacked())
    return solution.x[0], solution.status[0]


def error(x: Array, one: Posed) -> float:
    """Error of x, max norm, relative to `size`; where that is 0, J, xdot and a being so, only 0 is right."""
    off = float(np.abs(x - one.x).max())
    size = one.size
    return off / size if size else np.inf if off else 0.0


def by_scipy(one: Posed) -> tuple[Array, float]:
    """(x, relative bound): scipy's least-squares solution, moved along its null space to the least objective."""
    J, xdot, W, a, _, Wx = one.parts
    normal = J.T @ Wx @ J
    x = scipy.linalg.lstsq(normal, J.T @ Wx @ xdot)[0]
    N = scipy.linalg.null_space(J) if one.r else np.eye(len(x))
    kappa = 1.0
    if one.r:
        sigma = np.linalg.svd(normal, compute_uv=False)[: one.r]
        kappa = sigma[0] / sigma[-1]
    if N.shape[1]:
        S = N.T @ W @ N
        x = x - N @ scipy.linalg.solve(S, N.T @ (W @ x + a), assume_a="sym")
        kappa = kappa * (1 + np.linalg.norm(W, 2) / np.linalg.eigvalsh(S)[0])
    return x, ORIGINAL * len(x) * UNIT * kappa


def tikhonov(one: Posed, epsilon: float) -> Array:
    """(J'Wx J + eps W)^-1 (J'Wx xdot - eps a) in floats."""
    J, xdot, W, a, _, Wx = one.parts
    return np.linalg.solve(J.T @ Wx @ J + epsilon * W, J.T @ Wx @ xdot - epsilon * a)


def flat(*, Wx: Array | None = None) -> VelocityProblem:
    """The stretched planar 3R (0, 0, 0) with W = diag(1, 1, -1/20), xdot = (1, 1) (methods 6.6)."""
    return VelocityProblem(J=[[0, 0, 0], [3, 2, 1]], xdot=[1, 1], W=np.diag([1, 1, -1 / 20]), Wx=Wx)


COUPLED = np.array([[2.0, 1.0], [1.0, 1.0]])
"""Wx of that example."""

BY_HAND = {
    "coupled": (Fraction(2), (Fraction(-6, 7), Fraction(-4, 7), Fraction(40, 7))),
    "identity": (Fraction(1), (Fraction(-3, 7), Fraction(-2, 7), Fraction(20, 7))),
}
"""3 q1 + 2 q2 + q3 and qdot of that example, worked by hand for W = diag(1, 1, -1/20) over the rationals."""

DECADES = tuple(range(1, 13))
"""Tikhonov's eps is 10^-d."""


def eq13_minimises_within_least_squares(trial: Trial, thirteen: Answer, exact: Answer) -> Evidence:
    """(13) on integer data of every rank against the rational minimiser; as printed, by scipy, and as Tikhonov's limit."""
    rng = trial.rng("eq13_minimises_within_least_squares")
    found: dict[int, list[float]] = {}
    conditions, ours, printed, by_other, bounds, negative, examined = [], [], [], [], [], 0, []
    for m, n in SHAPES if trial.full else SHAPES[1::3]:
        for r, kind in product(range(min(m, n) + 1), KINDS):
            for _ in range(trial.of(2, 1)):
                one = posed(drawn(rng, m, n, r, *kind), exact)
                examined.append(one)
                matrix = np.linalg.cond(one.matrix)
                own = error(answered(thirteen, one.problem)[0], one)
                numpy_bound = FORWARD * n * UNIT * matrix
                x, scipy_bound = by_scipy(one)
                conditions.append(matrix)
                ours.append(own)
                bounds.append(one.bound)
                printed.append(error(equations.rank_deficient(*one.parts, one.N, one.R), one) / numpy_bound)
                by_other.append(error(x, one) / scipy_bound)
                negative += int(np.linalg.eigvalsh(one.problem.W.dense())[0] < 0)
                found.setdefault(r, []).append(own / one.bound)
    checks = [
        at_most(f"error of (13) against the exact minimiser / bound, rank {r}", ratio, 1.0)
        for r, ratio in sorted(found.items())
    ]
    checks += [
        at_most(r"the same for (13) as printed, $N_J$ and $R_J$ from the exact null space, in numpy", printed, 1.0),
        at_most("the same for a formulation without (13): scipy's least-squares solution moved along its null space", by_other,
                1.0, role=Role.OURS),
        at_least("problems with an indefinite $W$ among them", negative, 1, role=Role.OURS),
    ]  # fmt: skip
    limits, limit_plot = _tikhonov_limit([one for one in examined if 0 < one.r < one.problem.n], trial, exact)
    by_hand, table = _worked_example(thirteen, exact)
    plot = Plot(
        "Relative error of (13) against the exact rational minimiser, one point a problem, all ranks (exact answers not shown)",
        Axis("condition of the matrix of (13), rows scaled", log=True),
        Axis("relative error of the joint rates", log=True),
        (
            Series("eq. (13) of the sandbox", conditions, shown(ours)),
            Series("its error bound", conditions, bounds, role="bound"),
        ),
    )
    return Evidence((*checks, *limits, *by_hand), (plot, limit_plot, table))


def _tikhonov_limit(examined: Sequence[Posed], trial: Trial, exact: Answer) -> tuple[list[Check], Plot]:
    """Errors of (J'WxJ + eps W)^-1 (J'Wx xdot - eps a), over the rationals and in floats."""
    picked = examined[:: max(len(examined) // trial.of(24, 6), 1)]
    ratios, series = [], []
    for place, one in enumerate(picked):
        # damped truth minimises eps (1/2 x'Wx + a'x) + 1/2 |J x - xdot|^2_Wx, eps the square of its damping
        limit = [exact(one.problem, "damped", damping=10 ** (-d / 2)).x_exact for d in DECADES]
        errors = np.array([_apart(x, one.told.x_exact) for x in limit]) / one.size
        ratios.append([b / a for a, b in pairwise(errors[-5:])])
        if place < 3:
            epsilon = 10.0 ** -np.array(DECADES)
            name = f"rank {one.r} of {one.problem.m} × {one.problem.n}"
            series += [
                Series(f"{name}, exact", epsilon, shown(errors), "line"),
                Series(f"{name}, float64", epsilon, shown([error(tikhonov(one, e), one) for e in epsilon])),
            ]
    deviation = np.abs(10 * np.array(ratios) - 1)
    check = at_most(
        r"error of $(J^T W_{\dot x} J + \varepsilon W)^{-1}(J^T W_{\dot x} \dot x - \varepsilon\alpha\nabla f)$ falls "
        r"tenfold per decade of $\varepsilon$ over the rationals: |10 × ratio − 1|", deviation, TIKHONOV, role=Role.OURS,
    )  # fmt: skip
    caption = "Tikhonov's regularisation tends to the solution of (13), and is no way to compute it: float64 loses it again"
    return [check], Plot(
        caption, Axis("regularisation eps", log=True), Axis("relative distance to the minimiser", log=True), tuple(series)
    )


def _apart(x: Sequence[Fraction] | None, y: Sequence[Fraction] | None) -> float:
    """|x - y|, max norm, rounded once; NaN where there is no minimiser."""
    return np.nan if x is None or y is None else float(max(abs(p - q) for p, q in zip(x, y, strict=True)))


def _worked_example(thirteen: Answer, exact: Answer) -> tuple[list[Check], Table]:
    """Methods 6.6: an indefinite W whose restriction is positive, and a Wx that couples the lost row to the other."""
    rows: list[tuple[str | float | int | None, ...]] = []
    held, off = [], []
    for name, Wx in (("coupled", COUPLED), ("identity", None)):
        one = posed(flat(Wx=Wx), exact)
        target, hand = BY_HAND[name]
        found = one.told.x_exact or ()
        answers = [
            one.x, answered(thirteen, one.problem)[0], equations.rank_deficient(*one.parts, one.N, one.R),
            by_scipy(one)[0], tikhonov(one, 1e-8),
        ]  # fmt: skip
        # -1/20 is no float: the hand's fractions are met to its rounding
        held.append(sum((c * x for c, x in zip((3, 2, 1), found, strict=True)), Fraction()) == target)
        off.append(max(abs(float(x - h)) for x, h in zip(found, hand, strict=True)) / one.size)
        off.append(np.abs(answers[1] - np.array([float(h) for h in hand])).max() / one.size)
        words = r"$W_{\dot x} = [2, 1; 1, 1]$" if name == "coupled" else r"$W_{\dot x} = I$"
        rows.append((f"{words}: 3 q1 + 2 q2 + q3", str(target), *(float(np.dot((3, 2, 1), x)) for x in answers)))
        for i in range(3):
            rows.append((f"{words}: joint {i + 1} [rad/s]", str(hand[i]), *(float(x[i]) for x in answers)))
    checks = [
        every("the stretched planar 3R: exact least-squares target 2 with the coupled task weight, 1 with the identity", held,
              role=Role.OURS),
        at_most("the stretched planar 3R: joint rates against those worked by hand", off, one.bound, role=Role.OURS),
    ]  # fmt: skip
    return checks, Table(
        "Planar 3R stretched out, q = (0, 0, 0), rank 1: xdot = (1, 1), W = diag(1, 1, −1/20), indefinite but positive on "
        "null J",
        ("quantity", "by hand", "exact", "eq. (13)", "(13) as printed", "scipy", "Tikhonov, eps = 1e-8"),
        tuple(rows),
    )


def unweighted(thirteen: Answer) -> Answer:
    """Eq. (13) with Wx left out of its first rows."""

    def planted(problem: VelocityProblem) -> Solution:
        return thirteen(VelocityProblem(J=problem.J, xdot=problem.xdot, W=problem.W, a=problem.a))

    return planted


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
        words = f"(13) − (6), difference / bound, $m = {m}$, $n = {n}$, $W$ definite and indefinite"
        checks.append(at_most(words, np.array(differences[-2 * count :]) / np.array(bounds[-2 * count :]), 1.0))
    checks.append(
        at_most(r"(13) as printed, $R_J = V$, its $W_{\dot x}$ of condition up to $10^6$ left in: difference from (6) / bound",
                literal, 1.0)
    )  # fmt: skip
    plot = Plot(
        "(13) where J has full row rank: relative difference from (6), one point a problem",
        Axis("cond J", log=True), Axis("relative difference of the joint rates", log=True),
        (
            Series("difference", conditions, shown(differences)),
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
    same, ratios, series, rows, exponents = [], [], [], [], []
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
            exponents.append(slope(shares[5:15], np.array(exact_gap[5:15])))
            if not repeat:
                name = f"rank {r} of {m} × {n}"
                series += [
                    Series(name, shares, shown(gap[:-1])),
                    Series(f"{name}, exact", shares, exact_gap[:-1], "line", "other"),
                ]
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
        "What the task weight Wx does where J has lost rank: nothing to an achievable xdot, more the further xdot is from "
        "range J",
        Axis("part of xdot outside the range of J [unit of xdot]", log=True),
        Axis("change of the joint rates by Wx, relative", log=True), tuple(series),
    )  # fmt: skip
    columns = ("case", "change by Wx, part outside 1", "part outside 2^-20", "part outside 0, exact", "part outside 0, by (13)")
    return checks, plot, Table("Relative change of the joint rates when I is replaced by Wx", columns, tuple(rows))


def right_side_alone(thirteen: Answer) -> Answer:
    """Wx in the right-hand side of the first rows but not in their matrix: R'J'J qdot = R'J'Wx xdot."""

    def planted(problem: VelocityProblem) -> Solution:
        weighed = (task_weight(problem) @ problem.xdot[..., None])[..., 0]
        return thirteen(VelocityProblem(J=problem.J, xdot=weighed, W=problem.W, a=problem.a))

    return planted


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
    "V_r Σ_r⁻¹": _scaled,
    "V_r": _row_space,
    "random": _generic,
    "r rows of J": _rows,
}
"""R_J (n, r) by what it is made of."""

EXPONENTS = {"V_r Σ_r⁻¹": 1, "V_r": 1, "random": 2, "r rows of J": 3}
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
        checks.append(at_most(f"difference / sum of bounds, $m = {m}$, $n = {n}$, every rank from 1", ratios, 1.0))
    scan = Plot(
        "(13) with R C + N D, and with R drawn at random: difference from eq13, one point a basis",
        Axis("condition of the matrix of (13) with that R, rows scaled", log=True),
        Axis("relative difference of the joint rates", log=True),
        (
            Series("difference", conditions, shown(differences)),
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
    checks = [at_most("(13) of the sandbox along this scan: error / bound", ratios, 1.0, role=Role.OURS)]
    rows: list[tuple[str | float | int | None, ...]] = []
    spread, middle = 1 / np.array(shares), len(shares) // 2
    for name, expected in EXPONENTS.items():
        kappas = np.array(conditions[name])
        told = (kappas > KAPPAS[0]) & (kappas < KAPPAS[1])  # before it ends at 1/u
        power = slope(spread[told], kappas[told])
        words = rf"power of $\sigma_1/\sigma_r$ in the condition of (13), $R_J$ = {name}: |power − {expected}|"
        checks.append(at_most(words, abs(power - expected), EXPONENT, role=Role.OURS))
        rows.append((name, expected, power, kappas[middle], errors[name][middle], errors[name][-1]))
    rows.append(("eq13 of the sandbox", 1, None, None, errors["eq13"][middle], errors["eq13"][-1]))
    unit = tuple(Series(f"u (σ₁/σ_r)^{p}", shares, np.minimum(UNIT * spread**p, 1.0), "line", "bound") for p in (1, 2, 3))
    plot = Plot(
        "What the choice of R_J costs: median relative error of (13) on exactly rank-deficient J, xdot achievable, generic Wx",
        Axis("sigma_r / sigma_1", log=True), Axis("relative error of the joint rates", log=True),
        (*(Series(name if name in CHOICES else "eq13 of the sandbox", shares, shown(values), "line")
           for name, values in errors.items()), *unit),
    )  # fmt: skip
    columns = (
        "R_J", "power expected", "power measured", f"condition at σ_r/σ₁ = {shares[middle]:.1e}",
        f"error at σ_r/σ₁ = {shares[middle]:.1e}", f"error at σ_r/σ₁ = {shares[-1]:.1e}",
    )  # fmt: skip
    return checks, plot, Table("Four bases that complete N_J equally, in exact arithmetic", columns, tuple(rows))


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


TASK_KINDS = (
    ("positive definite", "Wx > 0"),
    ("indefinite off range J", "Wx > 0 on range J"),
    ("P indefinite", "indefinite there"),
    ("P singular, target not unique", "singular there"),
)
WEIGHT_KINDS = (
    ("positive definite", "W > 0"),
    ("indefinite", "N'WN > 0"),
    ("negative on null J", "N'WN not ≥ 0"),
    ("singular on null J", "N'WN singular"),
)
"""Kinds of problems/sets/rank_deficient.py, and what they are called here; the first two of each fulfil methods 6.1."""

REFUSAL = {True: Status.TARGET_UNBOUNDED, False: Status.CONDITION_SEVEN}
"""Why eq13 refuses, by whether it is Wx that fails."""


def determinants(problem: VelocityProblem, N: Array, R: Array) -> tuple[int, int, int, int]:
    """Determinants: det [R'J'Wx J; N'W], det [R N], det (JR)'Wx(JR) and det N'WN of integer data, exactly."""
    J, W, Wx = problem.J, problem.W.dense(), task_weight(problem)
    image, matrix = J @ R, np.vstack([R.T @ J.T @ Wx @ J, N.T @ W])
    found = [_determinant(A) for A in (matrix, np.hstack([R, N]), image.T @ Wx @ image, N.T @ W @ N)]
    return found[0], found[1], found[2], found[3]


def _determinant(A: Array) -> int:
    return int(fmpz_mat(len(A), len(A), [int(v) for v in A.ravel()]).det()) if len(A) else 1


def eq13_conditions(trial: Trial, thirteen: Answer, exact: Answer) -> Evidence:
    """Sixteen kinds of Wx and W, each over integers: is (13) solvable, is it the minimum, does eq13 answer."""
    rng = trial.rng("eq13_conditions")
    shapes = ((3, 5, 2), (4, 6, 3), (6, 7, 4), (4, 3, 2)) if trial.full else ((3, 5, 2), (4, 3, 2))
    identity, solvable, decided, right, refused, wrongly, minima, ratios = [], [], [], [], [], [], [], []
    literal: list[bool] = []
    words: list[list[str]] = []
    values: list[list[float]] = []
    for W_kind, _ in WEIGHT_KINDS:
        words.append([])
        values.append([])
        for Wx_kind, _ in TASK_KINDS:
            cell = []
            for m, n, r in shapes:
                for _ in range(trial.of(5, 2)):
                    one = posed(drawn(rng, m, n, r, "unachievable", Wx_kind, W_kind), exact)
                    det, basis, det_P, det_S = determinants(one.problem, one.N, one.R)
                    fine_target, fine_weight = _positive_on(one)
                    identity.append(det * basis == det_P * det_S)
                    solvable.append((det != 0) == (det_P != 0 and det_S != 0))
                    if det:
                        minima.append(fine_target and fine_weight)
                        decided.append(minima[-1] == (one.told.expected == "unique_minimum"))
                    x, status = answered(thirteen, one.problem)
                    if fine_target and fine_weight:
                        right.append(det != 0 and status is Status.SOLVED)
                        ratios.append(error(x, one) / one.bound)
                    else:
                        refused.append(status is REFUSAL[not fine_target])
                        if det:
                            wrongly.append(_beaten(one))
                    if det and n > m:
                        basis_6, completing = one.N[:, : n - m], np.hstack([one.R, one.N[:, n - m :]])
                        literal.append(determinants(one.problem, basis_6, completing)[0] != 0)
                    cell.append((det != 0) + (fine_target and fine_weight))
            kinds = {0: "singular", 1: "no minimum", 2: "minimum"}
            words[-1].append(", ".join(kinds[kind] for kind in sorted(set(cell))))
            values[-1].append(float(np.mean(cell)))
    good = sum(minima)
    checks = (
        every(r"$W_{\dot x} > 0$ on the range of $J$ and $N_J^T W N_J > 0$: (13) has one solution, and eq13 gives it", right),
        at_most("there, error of (13) against the exact minimiser / bound", ratios, 1.0),
        every("wherever (13) has a solution it is the minimum", minima, role=Role.REACH, range=(
            f"in {good:,} of {len(minima):,} solvable cases, which are those with $W_{{\\dot x}}$ positive definite on the "
            f"range of $J$ and $N_J^T W N_J > 0$; the solution of the other {len(minima) - good:,} is stationary only"
        )),
        every(r"$N_J$ of the size $n \times (n-m)$ that it has under (6): (13) has a "
              r"solution", literal, role=Role.PRINTED, range=(
            f"$N_J$ is $n \\times (n-r)$ in (13), $r$ the rank of $J$: of {len(literal):,} problems that are solvable with "
            f"these columns, {sum(literal):,} are with $n-m$ of them"
        )),
        every(r"over the integers, $\det M \, \det[R\ N] = \det((JR)^T W_{\dot x} JR) \, \det(N^T W N)$, $M$ the matrix of "
              r"(13)",
              identity, role=Role.OURS),
        every("so (13) has one solution where both factors differ from zero, and nowhere else", solvable, role=Role.OURS),
        every("a solvable case is the minimum over the rationals where both are positive definite, and nowhere else", decided,
              role=Role.OURS),
        every("eq13 refuses all others, and names the factor that fails", refused, role=Role.OURS),
        every("of these, where (13) as printed gives rates, other rates do better", wrongly, role=Role.OURS),
    )  # fmt: skip
    heat = Heat(
        f"What (13) gives by what Wx is on range J and W on null J, over integers: the same in all {len(identity) // 16} "
        f"cases of a kind",
        "task weight Wx", "joint-rate weight W", tuple(name for _, name in TASK_KINDS), tuple(name for _, name in WEIGHT_KINDS),
        values, 1.5, words,
    )  # fmt: skip
    return Evidence(checks, (heat, *_scans(thirteen)))


def _positive_on(one: Posed) -> tuple[bool, bool]:
    """Whether Wx > 0 on range J and N'WN > 0, by the exact inertia of both."""
    J, _, W, _, _, Wx = one.parts
    image = J @ one.R
    P, S = Dyadic.of(image.T @ Wx @ image).integers, Dyadic.of(one.N.T @ W @ one.N).integers
    return inertia(P)[0] == one.r, inertia(S)[0] == one.N.shape[1]


def _beaten(one: Posed) -> bool:
    """Whether rates beside the solution of (13) have a lower target, or the same target and a lower objective.

    Both are quadratic with zero slope at the solution, along R the one and along N the other: the sign of the curvature
    decides. Some direction of negative curvature is shown by the eigenvector of the lowest eigenvalue.
    """
    J, xdot, W, a, alpha, Wx = one.parts
    x = equations.rank_deficient(J, xdot, W, a, alpha, Wx, one.N, one.R)
    image = J @ one.R
    for curvature, basis, function in (
        (image.T @ Wx @ image, one.R, lambda v: (J @ v - xdot) @ Wx @ (J @ v - xdot)),
        (one.N.T @ W @ one.N, one.N, lambda v: v @ W @ v / 2 + a @ v),
    ):
        lowest, vectors = np.linalg.eigh(curvature) if len(curvature) else (np.ones(1), np.ones((1, 1)))
        if lowest[0] < 0:
            step = basis @ vectors[:, 0]
            return bool(function(x + (1 + np.linalg.norm(x)) * step) < function(x))
    return False


def _scans(thirteen: Answer) -> tuple[Plot, Plot]:
    """The stretched planar 3R with W = diag(1, 1, w), and with Wx = [2, 1; 1, c]: (13) as printed beside eq13."""
    N, R = exact_bases(flat().J)
    weights = np.concatenate([np.linspace(-0.25, 0.1, 141), -1 / 13 + np.geomspace(1e-5, 1e-2, 15)])
    weights = np.sort(weights)
    curvature = [float(np.linalg.eigvalsh(equations.reduced_weight(flat().J[1:], np.diag([1, 1, w])))[0]) for w in weights]
    problems = [VelocityProblem(J=flat().J, xdot=flat().xdot, W=np.diag([1, 1, w])) for w in weights]
    rates = [_rates(p, N, R) for p in problems]
    given = [float(np.linalg.norm(answered(thirteen, p)[0])) for p in problems]
    first = Plot(
        "Planar 3R stretched out, W = diag(1, 1, w): (13) as printed gives rates on both sides of w = −1/13, where N'WN is "
        "singular; left of it they are no minimum, and eq13 refuses",
        Axis("w, weight of joint 3"), Axis("|qdot| [rad/s]; smallest eigenvalue of N'WN", low=-2, high=20),
        (
            Series("(13) as printed", weights, [float(np.linalg.norm(x)) for x in rates], "line", "other"),
            Series("eq13", weights, given),
            Series("smallest eigenvalue of N'WN, N orthonormal", weights, curvature, "line"),
            Series("w = −1/13", [-1 / 13], [0.0], "vertical", "bound"),
        ),
    )  # fmt: skip
    corner = np.linspace(-3, 3, 121)
    problems = [flat(Wx=np.array([[2.0, 1.0], [1.0, c]])) for c in corner]
    target = [float(np.dot((3, 2, 1), _rates(p, N, R))) for p in problems]
    given = [float(np.dot((3, 2, 1), answered(thirteen, p)[0])) for p in problems]
    second = Plot(
        "The same arm, Wx = [2, 1; 1, c], which is c on the range of J: (13) as printed asks for 1 + 1/c; for c < 0 that is "
        "where the weighted task error is largest",
        Axis("c, weight of the task row that is left"), Axis("hand velocity 3 q1 + 2 q2 + q3 [m/s]", low=-6, high=8),
        (
            Series("(13) as printed", corner, target, "line", "other"), Series("eq13", corner, given),
            Series("asked for", [corner[0], corner[-1]], [1.0, 1.0], "line", "bound"),
        ),
    )  # fmt: skip
    return first, second


def _rates(problem: VelocityProblem, N: Array, R: Array) -> Array:
    """(13) as printed (n,); NaN where its matrix is singular to the last bit."""
    parts = problem.J, problem.xdot, problem.W.dense(), problem.a, 1.0, task_weight(problem)
    try:
        return np.asarray(equations.rank_deficient(*parts, N, R))
    except np.linalg.LinAlgError:
        return np.full(problem.n, np.nan)


def any_nonsingular(thirteen: Answer) -> Answer:
    """Eq. (13) answered wherever its matrix is nonsingular, definite or not."""

    def planted(problem: VelocityProblem) -> Solution:
        solution = thirteen(problem)
        x, status = solution.x.copy(), np.array(solution.status)
        for i in np.flatnonzero([said.refused for said in status]):
            N, R = exact_bases(problem.J[i])
            found = _rates(problem[i], N, R)
            if np.isfinite(found).all():
                x[i], status[i] = found, Status.SOLVED
        return replace(solution, x=x, status=status)

    return planted


DAMPING = 2.0**-6
"""W~ = DAMPING I, beside gradients of whole numbers: small, and exact."""


class Weighed(NamedTuple):
    """Where an undamped weight W = E' Gamma E, k rows in E, meets a Jacobian of rank r: n - r directions are to be weighed."""

    name: str
    m: int
    n: int
    r: int
    rank: int  # of N'WN, exactly; -1 where J is not exact
    undamped: bool
    damped: bool


def rank_k_weights_never_qualify(trial: Trial, thirteen: Answer, exact: Answer) -> Evidence:
    """Weights (8) and (11) at kinematic singularities: over integers with the rationals beside, and on robots."""
    rng = trial.rng("rank_k_weights_never_qualify")
    found: list[Weighed] = []
    sound, reasons, ratios, ranks, regular, series = [], [], [], [], [], []
    for m, n in ((2, 3), (2, 4), (4, 6), (6, 7)) if trial.full else ((2, 3), (4, 6)):
        for r in range(m + 1):
            for repeat in range(trial.of(8, 3)):
                plain = drawn(rng, m, n, r, "unachievable" if r < m else "achievable", "identity", "positive definite")
                problem = augmented(plain, make.nonzero_integers(rng, n - m, n), make.nonzero_integers(rng, n - m), rng)
                told, status = exact(problem, "least_squares"), answered(thirteen, problem)[1]
                if r == m:
                    regular.append((status is Status.SOLVED) == (told.expected == "unique_minimum"))
                    found.append(Weighed("full rank", m, n, r, told.inertia[0], status is Status.SOLVED, True))
                    continue
                one = posed(damped(problem, DAMPING), exact)
                x, then = answered(thirteen, one.problem)
                ranks.append(told.inertia[0] + told.inertia[1] <= n - m < n - r and told.expected != "unique_minimum")
                reasons.append(status is Status.CONDITION_SEVEN)
                sound.append(then is Status.SOLVED and one.told.expected == "unique_minimum")
                ratios.append(error(x, one) / one.bound)
                found.append(Weighed("integers, (8)", m, n, r, told.inertia[0], status is Status.SOLVED, sound[-1]))
                if not repeat and r == m - 1:
                    series += _damping_scan(problem, thirteen)
    for problem in stretched_extended(rng, trial.of(8, 3)):
        told, status = exact(problem, "least_squares"), answered(thirteen, problem)[1]
        one = posed(damped(problem, DAMPING), exact)
        x, then = answered(thirteen, one.problem)
        ranks.append(told.inertia[0] + told.inertia[1] <= 1 and told.expected != "unique_minimum")
        reasons.append(status is Status.CONDITION_SEVEN)
        sound.append(then is Status.SOLVED and one.told.expected == "unique_minimum")
        ratios.append(error(x, one) / one.bound)
        found.append(Weighed("planar 3R in a line, (11)", 2, 3, 1, told.inertia[0], status is Status.SOLVED, sound[-1]))
    for name in ("planar_3r", "planar_4r", "seven_joint", "panda") if trial.full else ("planar_3r", "panda"):
        weighed = _on_robot(name, rng, trial.of(20, 4), thirteen)
        found += weighed
        reasons += [not one.undamped for one in weighed]
        sound += [one.damped for one in weighed]
    lost = [one for one in found if one.r < one.m]
    usable = sum(one.undamped for one in lost)
    checks = (
        every("at a kinematic singularity, (13) can be used with the weights (8) and (11) as (6) "
              "can", [w.undamped for w in lost],
              role=Role.REACH, range=(
            f"(13) is solvable with undamped weights (8) and (11) at {usable:,} of {len(lost):,} singularities: $N_J^T W "
            f"N_J$ has rank $n-m$ at most and size $n-r$; damped by $\\tilde W > 0$ at {sum(w.damped for w in lost):,}"
        )),
        every(r"damped by $\tilde W > 0$, as the paper does at algorithmic singularities, they can", sound),
        at_most("damped, over integers: error of (13) against the exact minimiser / bound", ratios, 1.0),
        every("over the rationals, the rank of $N_J^T W N_J$ is at most $n - m < n - r$, and there is no unique minimum", ranks,
              role=Role.OURS),
        every(r"(13) refuses each of them, for $N_J^T W N_J$ not being positive definite", reasons, role=Role.OURS),
        every("where $J$ keeps its rank the same weights are answered just where the rationals have one minimum", regular,
              role=Role.OURS),
    )  # fmt: skip
    rule = Series("damping of the cases above", [DAMPING], [1.0], "vertical", "bound")
    plot = Plot(
        "What damping W~ = w I does at a kinematic singularity (rank one less than full): N'WN becomes positive definite, "
        "and the secondary task is missed in proportion",
        Axis("damping w, as a share of |W|", log=True), Axis("share of |W|; share of the rate asked for", log=True),
        (*series, rule),
    )  # fmt: skip
    return Evidence(checks, (plot, _weighed_table(found)))


def augmented(plain: VelocityProblem, E: Array, gbar: Array, rng: np.random.Generator) -> VelocityProblem:
    """W = E' Gamma E of eq. (8) and a = -E' Gamma gbar of eqs. (9)-(10), Gamma of small whole numbers, kept factored."""
    gamma = rng.integers(1, 3, len(E), endpoint=True).astype(float)
    W = Weight(np.zeros((plain.n, plain.n)), E, gamma)
    return VelocityProblem(J=plain.J, xdot=plain.xdot, W=W, a=-E.T @ (gamma * gbar), Wx=plain.Wx)


def damped(problem: VelocityProblem, base: float) -> VelocityProblem:
    """The same with W~ = base I added to W."""
    W = Weight(problem.W.base + base * np.eye(problem.n), problem.W.E, problem.W.gamma)
    return VelocityProblem(J=problem.J, xdot=problem.xdot, W=W, a=problem.a, Wx=problem.Wx)


def stretched_extended(rng: np.random.Generator, count: int) -> list[VelocityProblem]:
    """Weights (11) of the planar 3R with its links in one line: H = d(n'grad g)/dq, n the cross product of the rows of J.

    g = 1/2 |q - q0|^2 has grad g = whole numbers here, n = (s3, -s3 - s23, s2 + s23) vanishes, and so H = grad g' dn/dq.
    """
    problems = []
    for _ in range(count):
        c2, c3 = rng.choice([-1.0, 1.0], 2)  # cosines of q2 and q3, each 0 or pi
        c23 = c2 * c3
        J = np.array([[0.0, 0.0, 0.0], [1 + c2 + c23, c2 + c23, c23]])
        H = make.nonzero_integers(rng, 3) @ null_vector_derivative(c2, c3)
        W = Weight(np.zeros((3, 3)), H[None], np.ones(1))
        problems.append(VelocityProblem(J=J, xdot=make.nonzero_integers(rng, 2), W=W))
    return problems


def null_vector_derivative(c2: float, c3: float) -> Array:
    """dn/dq (3, 3) of n(q) = (sin q3, -sin q3 - sin(q2 + q3), sin q2 + sin(q2 + q3)), by cosines where the sines vanish."""
    c23 = c2 * c3
    return np.array([[0.0, 0.0, c3], [0.0, -c23, -c3 - c23], [0.0, c2 + c23, c23]])


def _on_robot(name: str, rng: np.random.Generator, count: int, thirteen: Answer) -> list[Weighed]:
    """Random gradients as E at singular configurations of a robot."""
    robot = robots.load(name)
    J = robot.jacobian(singular(robot, rng, count))
    # what rounding leaves of a row of J is no row: eq13 scales all rows to one
    size = np.linalg.norm(J, 2, axis=(1, 2))[:, None, None]
    J = np.where(np.linalg.norm(J, axis=2, keepdims=True) > ROBOT_RANK * size, J, 0.0)
    E, xdot = rng.uniform(-1, 1, (count, robot.k, robot.n)), rng.uniform(-1, 1, (count, robot.m))
    W = Weight(np.zeros((count, robot.n, robot.n)), E, np.ones((count, robot.k)))
    problem = VelocityProblem(J=J, xdot=xdot, W=W, a=-E.sum(axis=1))
    plain, more = (thirteen(p, rank_tolerance=ROBOT_RANK).status for p in (problem, damped(problem, DAMPING)))
    sigma = np.linalg.svd(J, compute_uv=False)
    rank = (sigma > ROBOT_RANK * sigma[:, :1]).sum(axis=1)
    return [
        Weighed(f"{name}, (8)", robot.m, robot.n, int(r), -1, one.answered, other.answered)
        for r, one, other in zip(rank, plain, more, strict=True)
    ]


def _damping_scan(problem: VelocityProblem, thirteen: Answer) -> list[Series]:
    """Smallest eigenvalue of N'WN and error of the secondary task by the damping, as shares of |W| and |gbar|."""
    N, _ = exact_bases(problem.J)
    N = np.linalg.qr(N)[0]
    E, gamma = problem.W.E, problem.W.gamma
    assert E is not None and gamma is not None
    gbar = -np.linalg.solve(gamma, np.linalg.lstsq(E.T, problem.a)[0])
    size = np.linalg.norm(problem.W.dense(), 2)
    shares = np.geomspace(1e-9, 1.0, 28)
    lowest, missed = [], []
    for share in shares:
        more = damped(problem, share * size)
        lowest.append(float(np.linalg.eigvalsh(more.W.left(N) @ N)[0] / size))
        missed.append(float(np.linalg.norm(E @ answered(thirteen, more)[0] - gbar) / np.linalg.norm(gbar)))
    name = f"{problem.m} × {problem.n}"
    return [
        Series(f"secondary rate missed, {name}", shares, shown(missed)),
        Series(f"smallest eigenvalue of N'WN, {name}", shares, shown(lowest), "line", "other"),
    ]


def _weighed_table(found: Sequence[Weighed]) -> Table:
    """One row for every place, size and rank."""
    kinds: dict[tuple[str, int, int, int], list[Weighed]] = {}
    for one in found:
        kinds.setdefault((one.name, one.m, one.n, one.r), []).append(one)
    rows = tuple(
        (
            name, m, n, r, n - r, max(one.rank for one in ones) if ones[0].rank >= 0 else None, len(ones),
            sum(one.undamped for one in ones), sum(one.damped for one in ones) if r < m else None,
        )
        for (name, m, n, r), ones in sorted(kinds.items(), key=lambda item: (item[0][0] == "full rank", item[0]))
    )  # fmt: skip
    columns = (
        "weight", "m", "n", "rank of J", "rank wanted of N'WN", "largest rank found", "cases", "answered undamped",
        "answered damped",
    )  # fmt: skip
    return Table("Weights of rank n − m in (13): the last rows are the same weights where J keeps its rank", columns, rows)


def jittered(thirteen: Answer) -> Answer:
    """Condition (7) tested, and (13) solved, with 1e-8 |W| I slipped in."""

    def planted(problem: VelocityProblem, **options: float) -> Solution:
        size = np.linalg.norm(problem.W.dense(), 2, axis=(-2, -1))[:, None, None]
        W = Weight(problem.W.base + ROBOT_RANK * size * np.eye(problem.n), problem.W.E, problem.W.gamma)
        return thirteen(VelocityProblem(J=problem.J, xdot=problem.xdot, W=W, a=problem.a, Wx=problem.Wx), **options)

    return planted


THIRTEEN = (
    r"\dot q = \begin{bmatrix} R_J^T J^T W_{\dot x} J \\ N_J^T W \end{bmatrix}^{-1} \begin{bmatrix} R_J^T J^T W_{\dot x} "
    r"\dot x \\ -\alpha N_J^T \nabla f \end{bmatrix}"
)

SANDBOX = CodePath("eq. (13) of the sandbox, $R_J$ from the singular value decomposition, rows of $J$ scaled", eq13)

CLAIMS = (
    Claim(
        name="eq13_minimises_within_least_squares",
        title="(13) minimises within the least-squares solutions, at every rank",
        place="Section VI, eq. (13)",
        says=r"When $J$ is not of full rank, (13) minimises $\frac{1}{2}\dot q^T W \dot q + \alpha\dot f$ over the rates that "
        r"minimise $(J\dot q - \dot x)^T W_{\dot x} (J\dot q - \dot x)$.",
        formula=THIRTEEN,
        tested=r"Integer problems of every rank 0 to $\min(m, n)$ in nine sizes, $n < m$ among them; $W_{\dot x} \ne I$, also "
        r"indefinite off the range of $J$; $W$ also indefinite; $\dot x$ in the range of $J$ and outside. Besides: (13) as "
        "printed, a formulation by scipy that knows nothing of (13), and the limit of Tikhonov's regularisation.",
        accepted="Each answer is the rational minimiser within its error bound; the regularised one tends to it in proportion "
        r"to $\varepsilon$.",
        paths=(SANDBOX, CodePath("the minimiser over the rationals, by exact elimination", truth)),
        examine=eq13_minimises_within_least_squares,
        fault=Fault(r"$W_{\dot x}$ left out of the first rows of (13)", unweighted),
    ),
    Claim(
        name="eq13_reduces_to_eq6",
        title="(13) is (6) where J has full row rank",
        place="Section VI, eq. (13)",
        says=r"(13) is the augmented form of (6), modified: where $J$ has full row rank both give the same joint rates, "
        r"whatever $W_{\dot x} > 0$.",
        tested=r"Random $J$ of full row rank in eight sizes, $W$ definite and indefinite, $W_{\dot x}$ of condition up to "
        r"$10^6$. Then, over integers, $J$ that has lost rank: the effect of $W_{\dot x}$ as $\dot x$ leaves the range of "
        r"$J$.",
        accepted=r"(13) and (6) differ by no more than the sum of their bounds; $W_{\dot x}$ changes nothing, to the last "
        r"rational, where $\dot x$ is achievable.",
        paths=(SANDBOX, CodePath("eq. (6) as printed, in numpy", equations.augmented)),
        examine=eq13_reduces_to_eq6,
        fault=Fault(r"$W_{\dot x}$ on the right-hand side of (13) alone", right_side_alone),
    ),
    Claim(
        name="any_completing_basis",
        title="Any basis R_J that completes N_J serves in (13), at very different cost",
        place="Section VI, eq. (13)",
        says=r"$R_J$ is a matrix whose columns complete those of $N_J$ to a spanning set of the whole space: any such matrix.",
        formula=r"R_J \to R_J C + N_J D, \quad \det C \ne 0",
        tested=r"Integer problems of every rank from 1: $R_J C + N_J D$ with integer $C$, $D$, and $R_J$ drawn at random. "
        r"Then four choices of $R_J$ on exactly rank-deficient $J$ whose $\sigma_1/\sigma_r$ grows to $10^9$.",
        accepted="All bases give the joint rates of the sandbox's own within the sum of the bounds. What a basis costs is "
        r"measured: the condition of (13) grows as $\sigma_1/\sigma_r$ for $V_r \Sigma_r^{-1}$, and up to its cube for rows "
        r"of $J$.",
        paths=(SANDBOX, CodePath("eq. (13) as printed, any $R_J$ and $N_J$, in numpy", equations.rank_deficient)),
        examine=any_completing_basis,
        fault=Fault(r"$R_J = V_r \Sigma_r^{-1}$ on the left of (13), $V_r$ on its right", one_sided),
    ),
    Claim(
        name="eq13_conditions",
        title="When (13) has a solution, and when that is the minimum",
        place="Section VI, eq. (13)",
        says=r"(13) minimises; the paper states no condition on $W_{\dot x}$ and $W$, and defines $N_J$, under (6), as an "
        r"$n \times (n-m)$ matrix.",
        formula=r"\det \begin{bmatrix} R_J^T J^T W_{\dot x} J \\ N_J^T W \end{bmatrix} \det \begin{bmatrix} R_J & N_J "
        r"\end{bmatrix} = \det\left( (J R_J)^T W_{\dot x} J R_J \right) \det\left( N_J^T W N_J \right)",
        tested=r"Integer problems of lower rank in sixteen kinds: $W_{\dot x}$ on the range of $J$ and $W$ on its null space "
        "positive definite, indefinite and singular. Determinants and inertias are exact.",
        accepted=r"(13) has one solution where both are nonsingular, and it is the minimum where both are positive definite; "
        r"with $n-m$ columns in $N_J$ and a rank below $m$ it has none.",
        paths=(SANDBOX, CodePath("the class of each problem over the rationals", truth)),
        examine=eq13_conditions,
        fault=Fault("rates given wherever the matrix of (13) is nonsingular", any_nonsingular),
    ),
    Claim(
        name="rank_k_weights_never_qualify",
        title="The weights (8) and (11) do not serve in (13) unless damped",
        place="Section VI, eq. (13), with eqs. (8) and (11)",
        says=r"(13) takes the place of (6) when $J$ is not of full rank; nothing is said of the weights (8) and (11), whose "
        "rank is $n-m$.",
        formula=r"\operatorname{rank} N_J^T W N_J \le n - m < n - r",
        tested="Weights (8) on integer problems of every rank, (11) on the planar 3R with its links in one line, both over the "
        "rationals; (8) at singular configurations of four robots. Each also damped as Section III suggests.",
        accepted="Undamped weights leave (13) singular at every kinematic singularity; damped ones give the minimum.",
        paths=(SANDBOX, CodePath("rank and class of each problem over the rationals", truth)),
        examine=rank_k_weights_never_qualify,
        fault=Fault("a small multiple of the identity slipped into the test of condition (7)", jittered),
    ),
)
