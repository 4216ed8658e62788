"""Section II: eqs. (2)-(7) and what eq. (6) minimises."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from flint import fmpz_mat
from scipy.linalg.lapack import dgglse

from problems import robots
from problems.measures.manipulability import volume
from problems.methods.draw import generic
from problems.sets import construct as make
from problems.sets.textbook import F1, F2
from sandbox.claims import equations
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_least, at_most, every
from sandbox.claims.exhibit import Axis, Exhibit, Heat, Plot, Series, Table
from sandbox.claims.situations import SIZES, indefinite, positive
from sandbox.closed_form import CLOSED_FORMS
from sandbox.closed_form.eq2_5 import eq2_5
from sandbox.closed_form.eq6 import eq6
from sandbox.closed_form.eq6_implicit import eq6_implicit, implicit_bound
from sandbox.closed_form.finsler import finsler
from sandbox.closed_form.kernels import SOLVED
from sandbox.closed_form.null_basis import orthonormal, pivoted
from sandbox.closed_form.uncompiled import eq6_exact, eq6_implicit_on, eq6_on
from sandbox.errors import AsymmetricWeightError
from sandbox.problem import VelocityProblem
from sandbox.reference.exact import inertia
from sandbox.reference.truth import Truth, truth, truth_of_qp
from sandbox.solution import Solution, Status
from sandbox.stacked import eigenvalues, symmetric, times, transpose
from sandbox.tolerances import FORWARD, UNIT
from sandbox.weight import Weight

Array = np.ndarray

J1, J2 = np.array(F1.J, dtype=float), np.array(F2.J, dtype=float)
"""Jacobians of the planar 3R arm at (0, pi/2, -pi/2) and of the planar 4R arm at (0, pi/2, -pi/2, pi/2)."""

ASKED = np.array([1.0, 1.0])
"""The task velocity of the small examples [m/s]."""


def each(equation: Answer, problem: VelocityProblem) -> Array:
    """The rates (B, n) of a printed equation, one problem after the other; alpha = 1, grad f = a."""
    W = problem.W.dense()
    return np.stack([equation(problem.J[i], problem.xdot[i], W[i], problem.a[i], 1.0) for i in range(len(problem))])


def reach(problem: VelocityProblem, x: Array) -> Array:
    """What error bounds are relative to (B,): max(|x|_inf, s), s the largest of |X11||a| + |X12||xdot|, X the KKT inverse."""
    B, m, n = len(problem), problem.m, problem.n
    K = np.zeros((B, n + m, n + m))
    K[:, :n, :n], K[:, n:, :n], K[:, :n, n:] = problem.W.dense(), problem.J, transpose(problem.J)
    X = np.abs(np.linalg.inv(K)[:, :n])
    data = np.concatenate([np.abs(problem.a), np.abs(problem.xdot)], axis=-1)
    return np.maximum(np.abs(x).max(axis=-1), times(X, data).max(axis=-1))


def rational(values: Any) -> Array:
    """The same numbers as Fractions; every float is one."""
    return np.vectorize(Fraction, otypes=[object])(values)


def objective(W: Array, a: Array, x: Array) -> Any:
    """1/2 x'Wx + a'x in the arithmetic of its arguments."""
    return x @ (W @ x) / 2 + a @ x


def integer(A: Array) -> fmpz_mat:
    """A matrix of whole numbers, exactly."""
    return fmpz_mat([[int(v) for v in row] for row in A])


KINDS = ("minimum", "saddle", "maximum", "flat", "saddle and flat")
"""What N'WN makes of the stationary points: positive definite, both signs, negative definite, singular without and with a
negative eigenvalue."""

EXACT_KIND = {
    "condition_7": "minimum", "saddle": "saddle", "maximum": "maximum", "singular": "flat", "descending": "flat",
    "indefinite_singular": "saddle and flat",
}  # fmt: skip
"""The kinds in the words of the exact reference."""


class Curved(NamedTuple):
    """A problem of whole numbers, N with J N = 0 exactly, and its kind by construction."""

    problem: VelocityProblem
    N: Array
    kind: str


def curved(rng: np.random.Generator, m: int, n: int, kind: str) -> Curved:
    """A problem with N'WN of the kind asked for, exactly: N'WN = F' diag(pivots) F, F unimodular; W may be indefinite."""
    basis, k = make.integer_basis(rng, m, n), n - m
    pivots = rng.integers(1, 2, k, endpoint=True).astype(float)
    if kind in ("saddle", "saddle and flat"):
        pivots[0] *= -1
    if kind == "maximum":
        pivots *= -1
    if kind in ("flat", "saddle and flat"):
        pivots[-1] = 0
    S_N, _ = make.integer_form(rng, pivots)
    W = make.weight(basis, make.integer_symmetric(rng, m), make.nonzero_integers(rng, m, k), S_N)
    return Curved(VelocityProblem(J=basis.J, xdot=make.integers(rng, m), W=W, a=make.integers(rng, n)), basis.N, kind)


def curved_of_all_kinds(rng: np.random.Generator, m: int, n: int, count: int) -> list[Curved]:
    """`count` of every kind that the degree of redundancy has room for."""
    kinds = [kind for kind in KINDS if n - m > 1 or not kind.startswith("saddle")]
    return [curved(rng, m, n, kind) for kind in kinds for _ in range(count)]


def stack(members: list[VelocityProblem]) -> VelocityProblem:
    """Problems of one size as a stack."""
    parts = {name: np.stack([getattr(one, name) for one in members]) for name in ("J", "xdot", "a")}
    return VelocityProblem(**parts, W=np.stack([one.W.dense() for one in members]))


# (2)-(5) = (6)


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
        "Relative difference between (2)–(5) and (6), one point a problem, beside the sum of their error bounds",
        Axis("cond J", log=True), Axis("relative difference of the joint rates", log=True),
        (
            Series("difference", np.concatenate(conditions), np.maximum(np.concatenate(differences), UNIT / 8)),
            Series("sum of bounds", np.concatenate(conditions), np.concatenate(bounds), role="bound"),
        ),
    )  # fmt: skip
    return Evidence(tuple(checks), (plot,))


# any basis


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
        bases += [("N C, C random", N @ _mixing(rng, n - m, count, decades)) for decades in np.linspace(0.0, 5.0, 6)]
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
    checks.append(every("in rational arithmetic: every basis gives the same $\\dot q$, to the last digit", _exactly(trial)))
    series = []
    for name, parts in points.items():
        spread, error, bound = (np.concatenate(part) for part in zip(*parts, strict=True))
        series.append(Series(name, spread, np.maximum(error, UNIT / 8)))
        if name.startswith("N C"):
            series.append(Series("error bound of N C", spread, bound, role="bound"))
    plot = Plot(
        "Error of (6) against the exact minimiser. In exact arithmetic the basis has no effect; in float64 a basis of "
        "condition "
        "$\\kappa$ costs up to $\\log_{10}\\kappa$ digits",
        Axis("condition of the basis used", log=True), Axis("relative error of the joint rates", log=True), tuple(series),
    )  # fmt: skip
    return Evidence(tuple(checks), (plot,))


def _mixing(rng: np.random.Generator, k: int, count: int, decades: float) -> Array:
    """Random C (count, k, k) of condition 10^decades; of that size where k = 1."""
    left, right = (np.linalg.qr(rng.standard_normal((count, k, k)))[0] for _ in range(2))
    return left * 10.0 ** -np.linspace(0.0, decades, k) @ right if k > 1 else left * 10.0**-decades


def _known(problem: VelocityProblem) -> Truth:
    """The truth of one problem."""
    known = truth(problem)
    assert isinstance(known, Truth)
    return known


def _exactly(trial: Trial) -> list[bool]:
    """Whether (6) in Fractions is the exact minimiser: basis of the LU, N of whole numbers, and N C with C ill-conditioned."""
    rng, held = trial.rng("any_spanning_basis, exactly"), []
    for m, n in SIZES:
        for _ in range(trial.of(5, 1)):
            problem, N, _kind = curved(rng, m, n, "minimum")
            minimiser = list(_known(problem).x_exact or ())
            W, a, k = rational(problem.W.dense()), rational(problem.a), n - m
            # Hilbert's matrix, its columns from 1 down to 10^-9
            C = np.array([[Fraction(1, (i + j + 1) * 1000**j) for j in range(k)] for i in range(k)])
            for basis in (rational(N), rational(N) @ C):
                held.append(list(eq6_implicit_on(Fraction, problem.J, problem.xdot, basis.T @ W, basis.T @ a)[1]) == minimiser)
            held.append(list(eq6_exact(problem)[1]) == minimiser)
    return held


# beyond positive definite


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
    """c* = -lambda_min(S), S = Y'WY - Y'WN (N'WN)^-1 N'WY, Y = J^+: W + c J'J > 0 exactly for c > c* (methods 1.5)."""
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
        every("(5) by Cholesky, as Section IV computes it, refuses $W$", [one is Status.NOT_POSITIVE_DEFINITE for one in said]),
        at_most(
            "second look: (2)–(5) on the positive definite $W + cJ^TJ$, error / bound", np.concatenate(ratios), 1.0,
            role=Role.OURS,
        ),
        every("$W + cJ^TJ > 0$ for $c$ just above $c^*$, and not just below", sides, role=Role.OURS),
    ]  # fmt: skip
    example, rows = _indefinite_example(six)
    checks.append(example)
    plot = Plot(
        "Error of (6) with indefinite $W$ under (7), against the exact minimiser. However far $W$ reaches below zero along "
        "range "
        "$J^T$, the minimiser stays; only rounding grows",
        Axis("−λ_min(W)", log=True), Axis("relative error of the joint rates", log=True),
        (
            Series("error of (6)", np.concatenate(depth), np.maximum(np.concatenate(errors), UNIT / 8)),
            Series("error bound", np.concatenate(depth), np.concatenate(bounds), role="bound"),
        ),
    )  # fmt: skip
    share = np.linspace(0.0, 3.0, 61)
    lemma = Plot(
        "Why it works: under (7) some $c$ makes $W + cJ^TJ$ positive definite (Finsler), and $J\\dot q = \\dot x$ makes that "
        "addition a constant. The smallest eigenvalue turns positive at $c^*$",
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
        "What each path makes of indefinite weights, and the simplest example: planar 3R at (0, π/2, −π/2), $W$ = diag(−1, "
        "1, 1), "
        "$\\dot x$ = (1, 1)",
        ("quantity", "expected", "found"),
        (
            *(
                (f"{name}: largest relative error in {total:,}", None, float(np.concatenate(parts).max()))
                for name, parts in found.items()
            ),
            ("(2)–(5), Cholesky: answered", None, sum(one.answered for one in said)),
            *rows,
        ),
    )  # fmt: skip
    return Evidence(tuple(checks), (plot, lemma, table))


def _indefinite_example(six: Answer) -> tuple[Check, tuple[tuple[str, str, str], ...]]:
    """The arm F1 with W = diag(-1, 1, 1): numbers of methods 1.10's table beside ours."""
    W = np.diag([-1.0, 1, 1])
    found = six(VelocityProblem(J=[J1] * 3, xdot=[ASKED, [1, 0], [0, 1]], W=W))
    told = [
        ("qdot", "(1, −2, 1)", np.array([1, -2, 1]), found.x[0]),
        ("multipliers", "(−3, −1)", np.array([-3, -1]), found.y[0]),
        ("G, first column", "(0, −1, 1)", np.array([0, -1, 1]), found.x[1]),
        ("G, second column", "(1, −1, 0)", np.array([1, -1, 0]), found.x[2]),
        ("c*", "√2 − 1", np.array([np.sqrt(2) - 1]), np.array([finsler_threshold(J1, W)])),
    ]
    off = np.array([np.abs(ours - theirs).max() for _, _, theirs, ours in told])
    rows = tuple((name, words, _tuple(ours, 12)) for name, words, _, ours in told)
    return at_most("planar 3R, $W$ = diag(−1, 1, 1): numbers worked out by hand", off, FORWARD * 3 * 2 * UNIT), rows


# condition (7)


def accepted_unless_singular(six: Answer) -> Answer:
    """Condition (7) not looked at: whatever the linear system gives is called solved."""

    def planted(problem: VelocityProblem) -> Solution:
        found = six(problem)
        x, status = found.x.copy(), found.status.copy()
        for i in np.flatnonzero([not one.answered for one in status]):
            N = equations.null_space(problem.J[i])
            A = np.vstack([problem.J[i], N.T @ problem.W.dense()[i]])
            if np.linalg.cond(A) < 1e12:
                x[i] = np.linalg.solve(A, np.concatenate([problem.xdot[i], -N.T @ problem.a[i]]))
                status[i] = Status.SOLVED
        return replace(found, x=x, status=status)

    return planted


EXAMPLES = (
    ("planar 3R", J1, (-1.0, 1, 1), "minimum"), ("planar 3R", J1, (-2.0, 1, 1), "flat"),
    ("planar 3R", J1, (-3.0, 1, 1), "maximum"), ("planar 4R", J2, (-1.0, 1, 1, 1), "minimum"),
    ("planar 4R", J2, (1.0, 1, 1, -2), "saddle"), ("planar 4R", J2, (-8.0, 3, 3, 3), "flat"),
)  # fmt: skip
"""Arm, J, the diagonal of W, and what its stationary points are, worked out by hand (methods 1, simplest examples)."""


def condition_seven(trial: Trial, six: Answer, exact: Answer) -> Evidence:
    """What eq6 answers and refuses beside the exact class, and what (6) as printed returns where (7) fails."""
    rng, count = trial.rng("condition_seven"), trial.of(12, 2)
    right, pivots, solvable, identity, falls, solvable_without = [], [], [], [], [], []
    seen: Counter[tuple[str, str]] = Counter()
    for m, n in SIZES:
        drawn = curved_of_all_kinds(rng, m, n, count)
        found = six(stack([one.problem for one in drawn]))
        for one, status in zip(drawn, found.status, strict=True):
            problem, N, _ = one
            known = exact(problem)
            kind = EXACT_KIND[known.reason]
            seen[kind, status.name] += 1
            right.append((kind == one.kind) and status.answered == (kind == "minimum") and (status.answered or status.refused))
            pivots.append((eq6_exact(problem)[0] == SOLVED) == (known.inertia == (n - m, 0, 0)))
            W = problem.W.dense()
            det_A, det_S, det_JJ, det_NN = (
                integer(M).det() for M in (np.vstack([problem.J, N.T @ W]), N.T @ W @ N, problem.J @ problem.J.T, N.T @ N)
            )
            solvable.append((det_A != 0) == (det_S != 0))
            identity.append(det_A**2 * det_NN == det_S**2 * det_JJ)
            if kind != "minimum":
                solvable_without.append(det_A != 0)
            if kind in ("saddle", "maximum"):
                x = equations.augmented(problem.J, problem.xdot, W, problem.a, 1.0, N)
                step = N @ np.linalg.eigh(N.T @ W @ N)[1][:, 0] * (1 + np.abs(x).max())
                here = objective(W, problem.a, x)
                falls.append(max(objective(W, problem.a, x + step), objective(W, problem.a, x - step)) < here)
    examples = [(arm, J, w, kind, exact(VelocityProblem(J=J, xdot=ASKED, W=np.diag(w)))) for arm, J, w, kind in EXAMPLES]
    checks = (
        every("answered if and only if the exact minimum exists, refused otherwise", right),
        every(
            "in exact arithmetic: the trailing pivots of the LU are positive if and only if $N_J^TWN_J > 0$", pivots,
        ),
        every("where $N_J^TWN_J$ has a negative eigenvalue and (6) a solution, the objective falls from it, both ways", falls),
        every("worked examples: minimum, saddle, maximum or neither, as exact arithmetic says", [
            EXACT_KIND[known.reason] == kind for *_, kind, known in examples
        ]),
        every("$\\det A \\neq 0$ if and only if $\\det N_J^TWN_J \\neq 0$, $A$ the matrix of (6)", solvable, role=Role.OURS),
        every(
            "$\\det(A)^2 \\det(N^TN) = \\det(N^TWN)^2 \\det(JJ^T)$, exactly", identity, role=Role.OURS,
        ),
        Check(
            "(7) asks for more than a system that can be solved: $A$ can be regular without it", any(solvable_without),
            f"{sum(solvable_without)} of {len(solvable_without)}", "some", len(solvable_without), Role.OURS,
        ),
    )  # fmt: skip
    statuses = [
        name for name in ("SOLVED", "CONDITION_SEVEN", "ILL_CONDITIONED", "RANK_DEFICIENT") if any(s == name for _, s in seen)
    ]
    heat = Heat(
        "Problems by what they are, in exact arithmetic, and what eq. (6) of the sandbox said in float64",
        "what the sandbox said", "what the stationary points are", tuple(s.lower().replace("_", " ") for s in statuses), KINDS,
        [[float(seen[kind, s]) for s in statuses] for kind in KINDS], middle=0.5,
        words=[[str(seen[kind, s]) for s in statuses] for kind in KINDS],
    )  # fmt: skip
    return Evidence(checks, (_along_the_self_motion(), heat, _examples_table(six, examples)))


def _along_the_self_motion() -> Plot:
    """The objective on the self-motion of the arm F1, W = diag(w, 1, 1)."""
    n, start, y = np.array([-1.0, 1, 1]), np.linalg.pinv(J1) @ ASKED, np.linspace(-2.5, 2.5, 101)
    series = []
    for w in (-1.0, -2.0, -3.0):
        W = np.diag([w, 1, 1])
        name = f"W = diag({w:g}, 1, 1): n'Wn = {n @ W @ n:g}"
        series.append(Series(name, y, [objective(W, np.zeros(3), start + t * n) for t in y], "line"))
        if n @ W @ n:
            x = equations.augmented(J1, ASKED, W, np.zeros(3), 0.0, n[:, None])
            place = (x - start) @ n / (n @ n)
            series.append(Series(f"(6) as printed, {name}", (place,), (objective(W, np.zeros(3), x),)))
    return Plot(
        "The objective along the self-motion of a planar 3R arm, $\\dot q = J^+\\dot x + y\\,n$: a minimum under (7), no "
        "stationary "
        "point where $n^TWn = 0$, and a maximum beyond, which (6) as printed returns without a word",
        Axis("y [rad/s]"), Axis("½ qdot'W qdot"), tuple(series),
    )  # fmt: skip


def _examples_table(six: Answer, examples: list[Any]) -> Table:
    rows = []
    for arm, J, w, _, known in examples:
        N = equations.null_space(J)
        S = np.linalg.eigvalsh(N.T @ np.diag(w) @ N)
        regular = abs(S).min() > len(w) * UNIT * max(map(abs, w))
        printed = equations.augmented(J, ASKED, np.diag(w), np.zeros(len(w)), 0.0) if regular else None
        ours = six(VelocityProblem(J=J, xdot=ASKED, W=np.diag(w)).stacked())
        rows.append((
            arm, f"diag{_tuple(w)}", _tuple(np.where(abs(S) > 4 * UNIT * len(w), S, 0.0)), EXACT_KIND[known.reason],
            "singular" if printed is None else _tuple(printed),
            _tuple(ours.x[0]) if ours.status[0].answered else ours.status[0].sentence,
        ))  # fmt: skip
    return Table(
        "The simplest weights that are not positive definite, $\\dot x$ = (1, 1), $a = 0$; eigenvalues of $N^TWN$ for "
        "orthonormal $N$",
        ("arm", "W", "eigenvalues of N'WN", "the stationary point, exactly", "(6) as printed", "(6) of the sandbox"),
        tuple(rows),
    )  # fmt: skip


def _tuple(values: Any, digits: int = 6) -> str:
    """A vector in words; what rounds to zero in twelve digits is shown as zero."""
    return "(" + ", ".join(f"{round(v, 12) + 0.0:.{digits}g}" for v in values).replace("-", "−") + ")"


# the minimiser


def diagonal_alone(six: Answer) -> Answer:
    """Only the diagonal of W is used."""

    def planted(problem: VelocityProblem) -> Any:
        return six(VelocityProblem(J=problem.J, xdot=problem.xdot, W=np.diag(np.diag(problem.W.dense())), a=problem.a))

    return planted


def bordered(J: Array, W: Array) -> Array:
    """The KKT matrix [W J'; J 0]."""
    return np.block([[W, J.T], [J, np.zeros((len(J), len(J)))]])


def lagrange_minimiser(trial: Trial, six: Answer, signs: Answer) -> Evidence:
    """(6) in Fractions: stationary, minimal by I14 to the last digit, and the KKT inertia that says so."""
    rng, count = trial.rng("lagrange_minimiser"), trial.of(8, 1)
    decided, haynsworth, stationary, excess, multipliers = [], [], [], [], []
    shares: dict[tuple[str, str], list[tuple[int, int, int]]] = {}
    for m, n in SIZES:
        for problem, N, kind in curved_of_all_kinds(rng, m, n, count):
            code, x, y, _ = six(problem)
            W, J, a, xdot = (rational(part) for part in (problem.W.dense(), problem.J, problem.a, problem.xdot))
            counted = signs(integer(bordered(problem.J, problem.W.dense())))
            decided.append((code == SOLVED) == (counted == (n, m, 0)))
            S = N.T @ problem.W.dense() @ N
            curvatures = np.linalg.eigvalsh(S)
            rounding = FORWARD * n * UNIT * max(1.0, float(np.abs(S).max()))
            p, q = int((curvatures > rounding).sum()), int((curvatures < -rounding).sum())
            haynsworth.append(counted == (p + m, q + m, n - m - p - q))
            shares.setdefault((kind, f"{m} × {n}"), []).append(counted)
            if code != SOLVED:
                continue
            stationary.append(not (J @ x - xdot).any())
            multipliers.append(not (W @ x + a + J.T @ y).any())
            basis = rational(N)
            for _ in range(3):
                step = rational(rng.integers(-4, 4, n - m, endpoint=True))
                step[0] += 9  # not zero
                more = objective(W, a, x + basis @ step) - objective(W, a, x)
                excess.append(more == step @ (basis.T @ W @ basis) @ step / 2 and more > 0)
    checks = (
        every("$J\\dot q = \\dot x$, exactly", stationary),
        every("$W\\dot q + a + J^T\\lambda = 0$, exactly, with the multipliers of (6)", multipliers),
        every("$\\varphi(\\dot q + Ny) - \\varphi(\\dot q) = \\frac{1}{2}y^TN^TWNy > 0$, exactly, for random $y$", excess),
        every("(6) answers if and only if the KKT matrix has inertia $(n, m, 0)$, counted exactly", decided),
        every("inertia of the KKT matrix = that of $N^TWN$, by its eigenvalues, $+ (m, m, 0)$", haynsworth, role=Role.OURS),
    )
    sizes = [f"{m} × {n}" for m, n in SIZES]
    words = [[" ".join(sorted({_inertia(one) for one in shares.get((kind, size), ())})) for size in sizes] for kind in KINDS]
    values: list[list[float | None]] = [[_share(shares.get((kind, size), []), size) for size in sizes] for kind in KINDS]
    heat = Heat(
        "Inertia (positive, negative, zero) of the KKT matrix, counted over the integers. It is $(n, m, 0)$ in the first row "
        "alone",
        "m × n", "what the stationary points are", tuple(sizes), KINDS, values, middle=0.5, words=words,
    )  # fmt: skip
    return Evidence(checks, (_kkt_eigenvalues(), heat))


def _inertia(counted: tuple[int, int, int]) -> str:
    return "({}, {}, {})".format(*counted)


def _share(counted: list[tuple[int, int, int]], size: str) -> float | None:
    """Of the problems, that have the inertia of a minimum."""
    m, n = (int(part) for part in size.split(" × "))
    return sum(one == (n, m, 0) for one in counted) / len(counted) if counted else None


def _kkt_eigenvalues() -> Plot:
    w = np.linspace(-6.0, 3.0, 91)
    lines = np.array([np.linalg.eigvalsh(bordered(J1, np.diag([v, 1.0, 1.0]))) for v in w])
    return Plot(
        "Eigenvalues of the KKT matrix of a planar 3R arm, $W$ = diag(w, 1, 1). $W$ turns indefinite at $w = 0$ and nothing "
        "happens; at $w = -2$, where $n^TWn = 0$, an eigenvalue crosses zero, the inertia leaves (3, 2, 0), and the minimum "
        "is lost",
        Axis("w"), Axis("eigenvalue of the KKT matrix"),
        (
            *(Series(f"eigenvalue {i + 1}", w, lines[:, i], "line") for i in range(5)),
            Series("n'Wn = 0", (-2.0,), (0.0,), "vertical", "bound"),
            Series("zero", (0.0,), (0.0,), "horizontal", "bound"),
        ),
    )  # fmt: skip


# the trade-off


def weight_forgotten(six: Answer) -> Answer:
    """The joint-rate measure is taken for qdot'qdot."""

    def planted(problem: VelocityProblem) -> Solution:
        return six(VelocityProblem(J=problem.J, xdot=problem.xdot, W=np.eye(problem.n), a=problem.a))

    return planted


ALPHAS = (-1.0, 0.0, 0.25, 0.5, 1.0, 2.0, 4.0)


def tradeoff(trial: Trial, six: Answer, weighted_inverse: Answer) -> Evidence:
    """(6) for several alpha beside the least measure that any motion with the same fdot has."""
    rng, count = trial.rng("tradeoff"), trial.of(20, 3)
    checks: list[Check] = []
    affine, falling, slopes = [], [], []
    for m, n in SIZES:
        problem, ratios = positive(rng, m, n, count, decades=1.0), []
        W, J, gradf, N = problem.W.dense(), problem.J, problem.a, orthonormal(problem.J)
        swept = {alpha: VelocityProblem(J=J, xdot=problem.xdot, W=problem.W, a=alpha * gradf) for alpha in ALPHAS}
        rates = {alpha: six(one).x for alpha, one in swept.items()}
        bound = {alpha: CLOSED_FORMS["eq6"].bound(one) * reach(one, rates[alpha]) for alpha, one in swept.items()}
        steepness = np.einsum(
            "bi,bi->b", gradf, times(N @ np.linalg.solve(symmetric(problem.W.left(N) @ N), transpose(N)), gradf)
        )
        for alpha, x in rates.items():
            line = rates[0.0] + alpha * (rates[1.0] - rates[0.0])
            allowed = bound[alpha] + (1 + 2 * abs(alpha)) * (bound[0.0] + bound[1.0])
            affine.append(np.abs(x - line).max(axis=-1) / allowed)
            length = np.linalg.norm(gradf, axis=-1) * np.sqrt(n)
            drop = np.einsum("bi,bi->b", gradf, x - rates[0.0]) + alpha * steepness
            falling.append(np.abs(drop) / (length * (bound[alpha] + bound[0.0])) if alpha else drop * 0)
            rows = np.concatenate([J, gradf[:, None, :]], axis=1)
            target = np.concatenate([problem.xdot, np.einsum("bi,bi->b", gradf, x)[:, None]], axis=1)
            front = VelocityProblem(J=rows, xdot=target, W=problem.W)
            best = np.stack([weighted_inverse(rows[i], W[i]) @ target[i] for i in range(count)])
            limit = CLOSED_FORMS["eq2_5"].bound(front) * reach(front, best)
            ratios.append(np.abs(x - best).max(axis=-1) / (bound[alpha] + limit))
            # the multiplier of the last row: what fdot costs in 1/2 qdot'W qdot
            stiffness = np.linalg.inv(rows @ np.linalg.solve(W, transpose(rows)))
            price = np.linalg.norm(stiffness[:, -1], axis=-1) * np.linalg.norm(rows, 2, axis=(-1, -2)) * np.sqrt(n)
            slopes.append(np.abs(times(stiffness, target)[:, -1] + alpha) / (price * (bound[alpha] + limit)))
        checks.append(
            at_most(f"(6) = the least measure at its own $\\dot f$, difference / bounds, $m = {m}$, $n = {n}$", ratios, 1.0)
        )
    checks += [
        at_most(r"$\dot q(\alpha)$ is affine: distance from the line through $\alpha = 0, 1$ / bounds", affine, 1.0),
        at_most(r"$\dot f$ falls by $\alpha\nabla f^TN(N^TWN)^{-1}N^T\nabla f \geq 0$, difference / bounds", falling, 1.0),
        at_most(r"slope of the curve, $d(\frac{1}{2}\dot q^TW\dot q)/d\dot f = -\alpha$, difference / bounds", slopes, 1.0),
    ]
    return Evidence(tuple(checks), _tradeoff_of_an_arm(six, weighted_inverse, rng))


def _tradeoff_of_an_arm(six: Answer, weighted_inverse: Answer, rng: np.random.Generator) -> tuple[Exhibit, ...]:
    """A planar 4R arm that trades joint rates for manipulability: f = -w."""
    robot, q = robots.load("planar_4r"), np.array([0.3, 1.1, -0.7, 0.5])
    J, gradf, W, xdot = robot.jacobian(q), -volume().gradient(robot, q), np.diag([4.0, 3, 2, 1]), np.array([0.5, -0.3])
    alphas = np.linspace(0.0, 1.5, 31)
    x = six(VelocityProblem(J=J, xdot=xdot, W=W, a=alphas[:, None] * gradf)).x
    fdot, measure = x @ gradf, np.einsum("bi,ij,bj->b", x, W, x) / 2
    values = np.linspace(fdot.min() - 0.4, fdot.max() + 0.8, 61)
    rows = np.vstack([J, gradf])
    front = np.stack([weighted_inverse(rows, W) @ np.append(xdot, value) for value in values])
    cloud = x[rng.integers(0, len(x), 400)] + 0.6 * rng.standard_normal((400, 2)) @ equations.null_space(J).T
    shown = cloud[np.einsum("bi,ij,bj->b", cloud, W, cloud) / 2 < 2.5 * measure.max()]
    plot = Plot(
        "The trade-off of a planar 4R arm between the joint-rate measure and manipulability, $f = -w$. Every motion with "
        "$J\\dot q = \\dot x$ lies on or above the curve; (6) moves along it with $\\alpha$, and its slope there is "
        "$-\\alpha$. "
        "$\\dot f$ has no least value: it falls as long as $\\alpha$ grows",
        Axis("fdot = −dw/dt [m²/s]"), Axis("½ qdot'W qdot"),
        (
            Series("random motions with the same xdot", shown @ gradf, np.einsum("bi,ij,bj->b", shown, W, shown) / 2),
            Series("(6), α from 0 to 1.5", fdot, measure, text=[f"α = {alpha:.2f}" for alpha in alphas]),
            Series(
                "least measure at a given fdot, (5) on [J; grad f']", values, np.einsum("bi,ij,bj->b", front, W, front) / 2,
                "line", "other",
            ),
        ),
    )  # fmt: skip
    joints = Plot(
        "The same joint rates: each is a straight line in $\\alpha$",
        Axis("α"), Axis("joint rate [rad/s]"),
        tuple(Series(f"joint {i + 1}", alphas, x[:, i], "line") for i in range(4)),
    )  # fmt: skip
    return plot, joints


# footnote 1


def weight_not_inverted(five: Answer) -> Answer:
    """G = W J'(J W J')^-1: W in the place of W^-1."""

    def planted(problem: VelocityProblem) -> Solution:
        W = symmetric(np.linalg.inv(problem.W.dense()))
        return five(VelocityProblem(J=problem.J, xdot=problem.xdot, W=W, a=problem.a))

    return planted


def inverse_of(five: Answer, problem: VelocityProblem) -> Array:
    """G (B, n, m): the answers to unit task velocities, grad f left out."""
    columns = []
    for i in range(problem.m):
        unit = VelocityProblem(J=problem.J, xdot=np.eye(problem.m)[i], W=problem.W)
        columns.append(five(unit).x)
    return np.stack(columns, axis=-1)


def footnote_1(trial: Trial, five: Answer, exact: Answer) -> Evidence:
    """G xdot beside the exact minimiser of qdot'W qdot, and beside random motions with the same xdot."""
    rng, count = trial.rng("footnote_1"), trial.of(30, 4)
    checks: list[Check] = []
    excess, found = [], []
    for m, n in SIZES:
        drawn = positive(rng, m, n, count, decades=1.5)
        problem = VelocityProblem(J=drawn.J, xdot=drawn.xdot, W=drawn.W)
        G, W, N = inverse_of(five, problem), problem.W.dense(), orthonormal(problem.J)
        x, best = times(G, problem.xdot), np.stack([one.x for one in exact(problem)])
        allowed = CLOSED_FORMS["eq2_5"].bound(problem) * times(np.abs(G).max(axis=1, keepdims=True), np.abs(problem.xdot))[:, 0]
        checks.append(at_most(f"$G\\dot x$ and the exact minimiser, difference / bound, $m = {m}$, $n = {n}$",
                              np.abs(x - best).max(axis=-1) / allowed, 1.0))  # fmt: skip
        y = rng.standard_normal((10, count, n - m)) * 10.0 ** rng.uniform(-1.0, 1.0, (10, count, 1))
        step = np.einsum("bik,rbk->rbi", N, y)
        more = _measure(W, x + step) - _measure(W, x)
        rounding = FORWARD * n * UNIT * (_measure(W, x + step) + _measure(W, x))
        drift = 2 * n * np.linalg.norm(step, axis=-1) * np.linalg.norm(W, 2, axis=(-1, -2)) * allowed
        found.append(np.abs(more - _measure(W, step)) / (rounding + drift))
        excess.append(more / _measure(W, step))
    checks += [
        at_least("every other motion with this $\\dot x$ costs more: excess / $\\delta^TW\\delta$", excess, 0.5),
        at_most("its excess is $\\delta^TW\\delta$, $\\delta$ its distance from $G\\dot x$: difference / rounding", found, 1.0),
        _deficient(trial, exact),
    ]
    literal, table = _literal(five)
    return Evidence((*checks, *literal), (_competitors(five, rng), table))


def _measure(W: Array, x: Array) -> Array:
    """The measure qdot'W qdot (..., B) of rates (..., B, n)."""
    return np.einsum("...bi,bij,...bj->...b", x, W, x)


def _deficient(trial: Trial, exact: Answer) -> Check:
    """The footnote asks for a solution of J qdot = xdot, not for full rank: (13) gives the minimiser there."""
    rng, ratios = trial.rng("footnote_1, deficient"), []
    for m, n in ((2, 3), (3, 6), (6, 7)):
        for _ in range(trial.of(10, 2)):
            J = make.integer_basis(rng, m - 1, n).J
            J = np.vstack([J, J.sum(axis=0)])
            F = make.integers(rng, n, n)
            problem = VelocityProblem(J=J, xdot=J @ make.integers(rng, n), W=F.T @ F + np.eye(n)).stacked()
            (known,) = exact(problem)
            form = CLOSED_FORMS["eq13"]
            size = max(np.abs(known.x).max(), 1.0)
            ratios.append(np.abs(form(problem).x[0] - known.x).max() / (form.bound(problem)[0] * size))
    return at_most("$J$ of lower rank and $\\dot x$ in its range: the minimiser, by (13), difference / bound", ratios, 1.0)


def _literal(five: Answer) -> tuple[tuple[Check, ...], Table]:
    """What is printed, "G x": x the position of the hand of a planar 3R arm."""
    robot, W = robots.load("planar_3r"), np.diag([1.0, 2, 3])
    position = robot.forward(np.array(F1.q))[0][:2]
    G = inverse_of(five, VelocityProblem(J=J1, xdot=ASKED, W=W).stacked())[0]
    hand = np.array([["1/6", "1/2"], ["-7/6", "-1/2"], ["5/6", "1/2"]])
    off = np.abs(G - np.vectorize(lambda word: float(Fraction(word)))(hand))
    rounding = FORWARD * 3 * UNIT * np.linalg.cond(J1) ** 2 * 3
    moves = [J1 @ G @ v for v in (position, ASKED)]
    checks = (
        at_most("planar 3R, $W$ = diag(1, 2, 3): $G$ as worked out by hand", off, rounding),
        at_most(
            r"as printed, $\dot q = Gx$, $x$ the hand's position: $|J\dot q - \dot x|$",
            np.abs(moves[0] - ASKED).max(), rounding, role=Role.PRINTED,
            range=(
                f"read $G\\dot x$, with the dot: it moves the hand at {_tuple(moves[1])} as asked, $Gx$ at {_tuple(moves[0])}, "
                "which is where the hand is"
            ),
        ),
    )  # fmt: skip
    rows = [(f"G, row {i + 1}", ", ".join(hand[i]), _tuple(G[i])) for i in range(3)]
    rows += [
        ("J G x, as printed, x the hand's position", _tuple(ASKED), _tuple(moves[0])),
        ("J G xdot, with the dot", _tuple(ASKED), _tuple(moves[1])),
    ]
    return checks, Table(
        "Planar 3R at (0, π/2, −π/2), $W$ = diag(1, 2, 3), $\\dot x$ = (1, 1), hand at (2, 1)",
        ("quantity", "expected", "found"), tuple(rows),
    )  # fmt: skip


def _competitors(five: Answer, rng: np.random.Generator) -> Plot:
    problem = VelocityProblem(J=J2, xdot=ASKED, W=np.diag([1.0, 2, 3, 8])).stacked()
    W, N = problem.W.dense(), equations.null_space(J2)
    x = times(inverse_of(five, problem), problem.xdot)
    step = (rng.standard_normal((500, 2)) * 10.0 ** rng.uniform(-3.0, 1.0, (500, 1)) @ N.T)[:, None, :]
    length, ends = np.linalg.norm(step[:, 0], axis=-1), np.array([1e-3, 30.0])
    low, high = np.linalg.eigvalsh(N.T @ W[0] @ N)
    return Plot(
        "500 random motions of a planar 4R arm with the same $\\dot x$: what each costs beyond $G\\dot x$, against its "
        "distance",
        Axis("|qdot − G xdot| [rad/s]", log=True), Axis("qdot'W qdot − its value at G xdot", log=True),
        (
            Series("random motions", length, (_measure(W, x + step) - _measure(W, x))[:, 0]),
            Series("largest eigenvalue of N'WN × distance²", ends, high * ends**2, "line", "bound"),
            Series("smallest eigenvalue of N'WN × distance²", ends, low * ends**2, "line", "bound"),
        ),
    )  # fmt: skip


# footnote 2


def half_forgotten(six: Answer) -> Answer:
    """The factor 1/2 forgotten: qdot'W qdot + a'qdot."""

    def planted(problem: VelocityProblem) -> Solution:
        return six(VelocityProblem(J=problem.J, xdot=problem.xdot, W=problem.W, a=problem.a / 2))

    return planted


def constrained_least_squares(A: Array, J: Array, c: Array, xdot: Array) -> Array:
    """Minimise |A qdot - c| subject to J qdot = xdot: LAPACK's generalised RQ factorisation."""
    rates: Array = dgglse(A, J, c, xdot)[3]
    return rates


class Field(NamedTuple):
    """A vector function c(q) = C sin q + D cos q' of p entries, q' the joints in another order: no gradient of anything."""

    C: Array
    D: Array

    def __call__(self, q: Array) -> Array:
        """C(q) (..., p) at q (..., n)."""
        return np.sin(q) @ self.C.T + np.cos(np.roll(q, 1, axis=-1)) @ self.D.T


def circulation(A: Array, field: Field, q: Array, radius: float) -> float:
    """Line integral of a(q) = -A'c(q) around a circle of the first two joints about q; 0 for every gradient."""
    angle = np.arange(64) * (2 * np.pi / 64)  # the trapezoidal rule: exact to rounding for a smooth periodic function
    direction = np.zeros((64, len(q)))
    direction[:, 0], direction[:, 1] = -np.sin(angle), np.cos(angle)
    ring = np.broadcast_to(q, direction.shape).copy()
    ring[:, 0] += radius * np.cos(angle)
    ring[:, 1] += radius * np.sin(angle)
    return float(np.einsum("bi,bi->", -(field(ring) @ A), direction) * radius * 2 * np.pi / 64)


def footnote_2(trial: Trial, six: Answer, least_squares: Answer) -> Evidence:
    """(6) for |A qdot - c(q)|^2, c any function of q, beside LAPACK's constrained least squares."""
    rng, count = trial.rng("footnote_2"), trial.of(20, 2)
    checks: list[Check] = []
    circulations, columns = [], []
    for name in ("planar_4r", "panda"):
        robot = robots.load(name)
        n, ratios = robot.n, []
        for p in range(n - robot.m, n + 3):
            field = Field(*rng.uniform(-1.0, 1.0, (2, p, n)))
            A = rng.standard_normal((p, n))
            q, xdot, _ = generic(robot, rng, count)
            c, J = field(q), robot.jacobian(q)
            problem = VelocityProblem(J=J, xdot=xdot, W=Weight(np.zeros((count, n, n)), np.stack([A] * count)), a=-c @ A)
            x, other = six(problem).x, np.stack([least_squares(A, J[i], c[i], xdot[i]) for i in range(count)])
            allowed = (CLOSED_FORMS["eq6"].bound(problem) + CLOSED_FORMS["kkt"].bound(problem)) * reach(problem, other)
            ratios.append(np.abs(x - other).max(axis=-1) / allowed)
            columns.append((name, p, np.abs(x - other).max(axis=-1) / np.abs(other).max(axis=-1), ratios[-1]))
            circulations.append((A, field, q[0]))
        checks.append(at_most(f"{name}: difference / bounds, criteria of {n - robot.m} to {n + 2} rows", ratios, 1.0))
    radii = np.geomspace(1e-2, 1.0, 21)
    around = np.array([[abs(circulation(*one, radius)) for radius in radii] for one in circulations])
    rounding = [FORWARD * 64 * UNIT * 2 * np.pi * np.linalg.norm(A) * np.abs(field).sum() for A, field, _ in circulations]
    checks.append(at_least(
        "largest circulation of $a(q)$ / its rounding: no $f$ has it for its gradient", around.max(axis=1) / rounding, 1.0,
        role=Role.OURS,
    ))  # fmt: skip
    plot = Plot(
        "Line integral of $a(q)$ around circles in joint space: zero for the gradient of any $f$. These fields circulate, "
        "and (6) "
        "minimises all the same",
        Axis("radius [rad]", log=True), Axis("|∮ a · dq|", log=True),
        (
            *(
                Series(f"{robots_name}, {p} rows", radii, around[i], "line")
                for i, (robots_name, p, *_) in enumerate(columns) if i % 4 == 0
            ),
            Series("radius²", radii, np.pi * radii**2, "line", "bound"),
        ),
    )  # fmt: skip
    table = Table(
        "General quadratic criteria $|A\\dot q - c(q)|^2$, $A$ with $p$ rows: $W = A^TA$ (singular for $p < n$), $a = "
        "-A^Tc(q)$",
        ("arm", "rows p", "W", "problems", "largest relative difference", "largest difference / bounds"),
        tuple(
            (name, p, "singular" if p < robots.load(name).n else "W > 0", len(ratio), float(off.max()), float(ratio.max()))
            for name, p, off, ratio in columns
        ),
    )  # fmt: skip
    return Evidence(tuple(checks), (table, plot))


# symmetry of W


def half_left_out(six: Answer) -> Answer:
    """The symmetric part taken for W + W'."""

    def planted(number: Any, J: Any, xdot: Any, W: Any, *rest: Any, **options: Any) -> Any:
        return six(number, J, xdot, 2 * W, *rest, **options)

    return planted


SKEW = np.array([[10.0, 8, 0], [0, 20, -5], [3, 0, 30]])
"""Ten times the weight of methods 1.10: whole numbers, and the same motion for a = 0."""


def symmetric_weight(trial: Trial, six: Answer, exact: Answer) -> Evidence:
    """(6) in Fractions with W as it stands and with (W + W')/2, beside the exact minimiser of 1/2 qdot'W qdot + a'qdot."""
    rng, count = trial.rng("symmetric_weight"), trial.of(12, 2)
    printed, corrected, refused, asymmetry, errors = [], [], [], [], []
    for m, n in SIZES:
        for i in range(count):
            problem, _, _ = curved(rng, m, n, "minimum")
            upper = np.triu(make.nonzero_integers(rng, n, n), 1) * 2.0 ** -(i % 12)
            S = problem.W.dense()
            W = S + upper - upper.T
            minimiser = exact(W, problem.a, problem.J, problem.xdot).x_exact
            literal = six(Fraction, problem.J, problem.xdot, W, problem.a)[1]
            half = six(Fraction, problem.J, problem.xdot, (W + W.T) / 2, problem.a)[1]
            printed.append(tuple(literal) == minimiser)
            corrected.append(tuple(half) == minimiser)
            refused.append(_refuses(problem, W))
            asymmetry.append(np.linalg.norm(W - W.T) / np.linalg.norm(S))
            errors.append(
                max(abs(float(u - v)) for u, v in zip(literal, minimiser, strict=True)) / max(map(abs, map(float, minimiser)))
            )
    figures, rows = _skew_example(six, exact)
    ranged = (
        f"read $W$ symmetric, or put $(W + W^T)/2$ for it: exact in {sum(corrected)} of {len(corrected)}; as it stands, off "
        f"by up "
        f"to {100 * max(errors):.3g} % where $|W - W^T|$ is up to {100 * max(asymmetry):.2g} % of $|W|$"
    )
    checks = (
        every("with $(W + W^T)/2$, (6) gives the exact minimiser of $\\frac{1}{2}\\dot q^TW\\dot q + a^T\\dot q$", corrected),
        every("with $W$ as it stands, not symmetric, (6) gives it too", printed, role=Role.PRINTED, range=ranged),
        figures,
        every("the sandbox refuses a $W$ that is not symmetric", refused, role=Role.OURS),
    )
    ends = np.array([min(asymmetry), max(asymmetry)])
    plot = Plot(
        "What (6) with a $W$ that is not symmetric is off by: in proportion to $W - W^T$, for (6) sees $N^TW$ and the "
        "objective "
        "only $W + W^T$",
        Axis("|W − W'| / |W|", log=True), Axis("relative error of the joint rates", log=True),
        (
            Series("(6) with W as it stands, exact arithmetic", np.array(asymmetry), np.array(errors)),
            Series("slope 1, through the median", ends, np.median(np.divide(errors, asymmetry)) * ends, "line", "bound"),
        ),
    )  # fmt: skip
    table = Table(
        "Planar 3R at (0, π/2, −π/2), $\\dot x$ = (1, 1), $W$ = (1, .8, 0; 0, 2, −.5; .3, 0, 3)",
        ("quantity", "expected", "found"), rows,
    )  # fmt: skip
    return Evidence(checks, (plot, table))


def _refuses(problem: VelocityProblem, W: Array) -> bool:
    try:
        VelocityProblem(J=problem.J, xdot=problem.xdot, W=W, a=problem.a)
    except AsymmetricWeightError:
        return True
    return False


def _skew_example(six: Answer, exact: Answer) -> tuple[Check, tuple[tuple[str, str, str], ...]]:
    """The numbers of methods 1.10 beside ours."""
    zero = np.zeros(3)
    told = (
        ("(6) with W as it stands", (0.863636, -1.863636, 1.136364), six(Fraction, J1, ASKED, SKEW, zero)[1]),
        ("minimiser, exactly", (0.875, -1.875, 1.125), exact(SKEW, zero, J1, ASKED).x_exact),
        ("(6) with (W + W')/2", (0.875, -1.875, 1.125), six(Fraction, J1, ASKED, (SKEW + SKEW.T) / 2, zero)[1]),
    )
    off = [max(abs(float(u) - v) for u, v in zip(found, stated, strict=True)) for _, stated, found in told]
    rows = tuple((name, _tuple(stated), "(" + ", ".join(str(v) for v in found) + ")") for name, stated, found in told)
    return at_most("planar 3R: the numbers worked out before, six digits", off, 5e-7), rows


CLAIMS = (
    Claim(
        name="footnote_1",
        title="What a weighted generalised inverse is",
        place="Section II, footnote 1",
        says=(
            r"If $J\dot q = \dot x$ has a solution, the unique one minimising $\dot q^T W\dot q$ is $G\dot x$ (printed: $Gx$)."
        ),
        formula=r"G = W^{-1} J^T (J W^{-1} J^T)^{-1}",
        tested=(
            r"$G\dot x$ beside the exact minimiser and beside ten random motions with the same $\dot x$ for each problem, in "
            r"eight "
            r"sizes; $J$ of lower rank with $\dot x$ in its range; and $Gx$ to the letter, $x$ the position of the hand."
        ),
        accepted=(
            r"The difference to the exact minimiser is within the error bound; every other motion costs $\delta^T W\delta > "
            r"0$ more."
        ),
        paths=(
            CodePath("(5) by two Cholesky factorisations, asked for unit task velocities", eq2_5),
            CodePath("the minimiser by exact elimination over the rationals", truth),
        ),
        examine=footnote_1,
        fault=Fault("$W$ in the place of $W^{-1}$", weight_not_inverted),
    ),
    Claim(
        name="normal_equations_equal_augmented",
        title="(2)–(5) and (6) give the same joint rates",
        place="Section II, eqs. (2)–(6)",
        says=r"When $J$ has full row rank, the solution from (2)–(5) equals that from (6).",
        formula=(
            r"\dot q = \begin{bmatrix} J \\ N_J^T W \end{bmatrix}^{-1} "
            r"\begin{bmatrix} \dot x \\ -\alpha N_J^T \nabla f \end{bmatrix}"
        ),
        tested=(
            r"Random $J$ with condition up to $10^3$, random $W > 0$, $\nabla f$ and $\dot x$, in eight sizes from 1×2 to 3×7."
        ),
        accepted="The two answers differ by no more than the sum of their error bounds.",
        paths=(
            CodePath("eq. (6), column-pivoted LU extended by $N_J^T W$", eq6),
            CodePath("eqs. (2)–(5) as printed, explicit inverses in numpy", equations.liegeois),
        ),
        examine=normal_equations_equal_augmented,
        fault=Fault(r"the sign of $\alpha$ turned in (6)", wrong_sign),
    ),
    Claim(
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
        accepted="In rational arithmetic the answers are equal to the last digit; in float64 each is within its error bound.",
        paths=(
            CodePath(r"eq. (6) from $N_J$, $N_J^T W$ and $N_J^T\nabla f$ alone", eq6_implicit),
            CodePath("the minimiser by exact elimination over the rationals", truth),
        ),
        examine=any_spanning_basis,
        fault=Fault(r"columns of $N_J$ normalised in $N_J^T\nabla f$ and not in $N_J^T W$", right_side_normalised),
    ),
    Claim(
        name="beyond_positive_definite",
        title="(6) reaches beyond positive definite weights",
        place="Section II, eq. (7)",
        says=r"Provided $N_J^T W N_J > 0$, (6) can be used even when $W$ is not positive definite.",
        formula=r"N_J^T W N_J > 0",
        tested=(
            r"Random symmetric $W$ with $m$ or more negative eigenvalues and $N_J^T W N_J > 0$, the most negative from "
            r"$-0.5$ to "
            r"$-10^6$. Second look: (2)–(5) on $W + cJ^TJ$, which Finsler's lemma makes positive definite."
        ),
        accepted="(6) is within its error bound of the exact minimiser, where the Cholesky factorisation of (5) breaks down.",
        paths=(
            CodePath("eq. (6), column-pivoted LU extended by $N_J^T W$", eq6),
            CodePath("the minimiser by exact elimination over the rationals", truth),
        ),
        examine=beyond_positive_definite,
        fault=Fault("$W$ made positive definite by the absolute values of its eigenvalues", size_of_weight),
        sources=("Finsler's lemma",),
    ),
    Claim(
        name="symmetric_weight",
        title="The weight has to be symmetric, beyond positive definite too",
        place="Section II, eqs. (6), (7)",
        says=(
            r"(6) can be used when $W$ is not positive definite, provided (7). That $W$ stays symmetric is not said again, "
            r"and is "
            "needed."
        ),
        formula=r"\nabla\left(\tfrac{1}{2}\dot q^T W\dot q\right) = \tfrac{1}{2}(W + W^T)\dot q",
        tested=(
            r"Problems of whole numbers with $W$ made asymmetric, from slightly to much: (6) on fractions with $W$ as it "
            r"stands and "
            r"with $(W + W^T)/2$, beside the exact minimiser of $\frac{1}{2}\dot q^T W\dot q + a^T\dot q$."
        ),
        accepted=r"With $(W + W^T)/2$ the minimiser to the last digit; with $W$ as it stands, another motion.",
        paths=(
            CodePath("eq. (6) on fractions, any square $W$", eq6_on),
            CodePath("the quadratic programme by exact elimination over the rationals", truth_of_qp),
        ),
        examine=symmetric_weight,
        fault=Fault("$W + W^T$ taken for the symmetric part, the half left out", half_left_out),
    ),
    Claim(
        name="condition_seven",
        title="Condition (7) is for the minimum, not for a solution",
        place="Section II, eq. (7)",
        says=r"(7) is the condition under which (6) can be used. For solving (6) alone $\det N_J^T W N_J \neq 0$ is enough.",
        formula=r"\det\begin{bmatrix} J \\ N_J^T W \end{bmatrix}^2 = \frac{\det(N_J^T W N_J)^2 \det(JJ^T)}{\det(N_J^T N_J)}",
        tested=(
            r"Problems of whole numbers whose $N_J^T W N_J$ is exactly positive definite, negative definite, of both signs, or "
            "singular, in eight sizes; and six small arms worked out by hand."
        ),
        accepted=(
            "The sandbox's (6) answers exactly those that have a minimum; exact arithmetic decides which. Where (6) has a "
            "solution without (7), the objective falls away from it."
        ),
        paths=(
            CodePath("eq. (6), which reads (7) from its trailing pivots", eq6),
            CodePath("class of the problem by exact elimination over the rationals", truth),
        ),
        examine=condition_seven,
        fault=Fault("any nonsingular system of (6) accepted, (7) not looked at", accepted_unless_singular),
    ),
    Claim(
        name="lagrange_minimiser",
        title="(6) gives the constrained minimiser",
        place="Section II, after eq. (7)",
        says=(
            r"When (7) holds and $J$ has full row rank, (6) gives the $\dot q$ that minimises "
            r"$\frac{1}{2}\dot q^T W\dot q + \alpha\dot f$ while $J\dot q = \dot x$."
        ),
        formula=(
            r"\varphi(\dot q + N_J y) - \varphi(\dot q) = \tfrac{1}{2} y^T N_J^T W N_J\, y, \qquad "
            r"\mathrm{In}\begin{bmatrix} W & J^T \\ J & 0 \end{bmatrix} = (n, m, 0)"
        ),
        tested=(
            "Problems of whole numbers of every kind in eight sizes. (6) runs on fractions, so that nothing is rounded; random "
            "steps along the self-motion; the inertia of the KKT matrix by Sylvester's law over the integers."
        ),
        accepted=(
            r"Feasible, stationary and cheaper than every other motion by exactly $\frac{1}{2}y^T N_J^T W N_J y$; (6) "
            r"answers if "
            "and only if the inertia is $(n, m, 0)$."
        ),
        paths=(
            CodePath("eq. (6) on fractions, condition (7) from its pivots", eq6_exact),
            CodePath("inertia of the KKT matrix, fraction-free, over the integers", inertia),
        ),
        examine=lagrange_minimiser,
        fault=Fault("only the diagonal of $W$ used", diagonal_alone),
        sources=("Lagrange multiplier theorem", "Sylvester's law of inertia; Haynsworth's inertia additivity"),
    ),
    Claim(
        name="footnote_2",
        title="Any vector function may stand for the gradient",
        place="Section II, footnote 2",
        says=(
            r"$\nabla f$ could be replaced by any vector function of $q$, to optimise a general quadratic criterion subject to "
            r"$\dot x = J\dot q$."
        ),
        formula=r"\min |A\dot q - c(q)|^2, \quad J\dot q = \dot x: \qquad W = A^T A,\; \alpha\nabla f \to -A^T c(q)",
        tested=(
            r"$|A\dot q - c(q)|^2$ with random $A$ of $n - m$ to $n + 2$ rows and vector functions $c(q)$ that circulate, so "
            r"that "
            "no $f$ has them for its gradient; planar 4R and Panda."
        ),
        accepted="(6) and LAPACK's constrained least squares differ by no more than the sum of two error bounds.",
        paths=(
            CodePath("eq. (6), column-pivoted LU extended by $N_J^T W$", eq6),
            CodePath(
                "constrained least squares by generalised RQ factorisation (LAPACK gglse)",
                constrained_least_squares,
                "scipy.linalg.lapack:dgglse",
            ),
        ),
        examine=footnote_2,
        fault=Fault(r"the factor $\frac{1}{2}$ forgotten: $\dot q^T W\dot q + a^T\dot q$", half_forgotten),
    ),
    Claim(
        name="tradeoff",
        title="The scalar trades the joint-rate measure against the derivative of f",
        place="Section II, after eq. (7)",
        says=r"(6) makes a trade-off, by $\alpha$, between the joint-rate measure and $\dot f$.",
        formula=r"\dot q(\alpha) = \dot q(0) - \alpha\, N_J (N_J^T W N_J)^{-1} N_J^T \nabla f",
        tested=(
            r"Random problems in eight sizes at seven $\alpha$; each answer beside the least $\dot q^T W\dot q$ that any "
            r"motion with "
            r"the same $\dot x$ and the same $\dot f$ has. A planar 4R arm as a picture."
        ),
        accepted=(
            r"Every answer of (6) lies on the curve of least measure over $\dot f$, whose slope there is $-\alpha$; $\dot q$ "
            r"is "
            r"affine in $\alpha$, and $\dot f$ falls as $\alpha$ grows, by the amount predicted."
        ),
        paths=(
            CodePath(r"eq. (6) for each $\alpha$", eq6),
            CodePath(r"(5) as printed, with $\nabla f^T$ as one more task row", equations.generalized_inverse),
        ),
        examine=tradeoff,
        fault=Fault(r"the measure taken for $\dot q^T\dot q$, $W$ forgotten", weight_forgotten),
    ),
)
