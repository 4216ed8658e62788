"""When eq. (13) has a solution, and when that is the minimum."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from flint import fmpz_mat

from sandbox.claims import equations
from sandbox.claims.claim import Answer, Claim, CodePath, Evidence, Fault, Role, Trial, at_most, every
from sandbox.claims.exhibit import Axis, Heat, Plot, Series
from sandbox.claims.rank_deficient.posed import SANDBOX, Posed, answered, drawn, error, exact_bases, flat, posed
from sandbox.problem import VelocityProblem
from sandbox.reference import truth
from sandbox.reference.exact import Dyadic, inertia
from sandbox.solution import Solution, Status
from sandbox.task import task_weight

Array = np.ndarray

TASK_KINDS = (
    ("positive definite", "> 0"),
    ("indefinite off range J", "> 0 on range J"),
    ("P indefinite", "indefinite there"),
    ("P singular, target not unique", "singular there"),
)
WEIGHT_KINDS = (
    ("positive definite", "> 0"),
    ("indefinite", "> 0 on null J"),
    ("negative on null J", "not ≥ 0 there"),
    ("singular on null J", "singular there"),
)
"""Kinds of problems/sets/rank_deficient.py, and what they are called here; with the first two of each (13) has its minimum."""

WEIGHT_KINDS = (
    ("positive definite", "> 0"),
    ("indefinite", "> 0 on null J"),
    ("negative on null J", "not ≥ 0 there"),
    ("singular on null J", "singular there"),
)
"""Kinds of problems/sets/rank_deficient.py, and what they are called here; with the first two of each (13) has its minimum."""

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
            values[-1].append(2.0 - float(np.mean(cell)))
    good = sum(minima)
    checks = (
        every(r"$W_{\dot x} > 0$ on the range of $J$ and $N_J^T W N_J > 0$: (13) has one solution, and the sandbox gives it",
              right),
        at_most("there, error of (13) against the exact minimiser / bound", ratios, 1.0),
        every("wherever (13) has a solution it is the minimum", minima, role=Role.REACH, range=(
            f"In {good:,} of {len(minima):,} solvable cases, which are those with $W_{{\\dot x}}$ positive definite on the "
            f"range of $J$ and $N_J^T W N_J > 0$; the solution of the other {len(minima) - good:,} is only stationary."
        )),
        every(r"$N_J$ of the size $n \times (n-m)$ that it has under (6): (13) has a "
              r"solution", literal, role=Role.PRINTED, range=(
            f"Read $N_J$ as $n \\times (n-r)$ in (13), $r$ the rank of $J$: of {len(literal):,} problems that are solvable "
            f"with these columns, {sum(literal):,} are with $n-m$ of them."
        )),
        every(r"over the integers, $\det M \, \det[R\ N] = \det((JR)^T W_{\dot x} JR) \, \det(N^T W N)$, $M$ the matrix of "
              r"(13)",
              identity, role=Role.OURS),
        every("so (13) has one solution where both factors differ from zero, and nowhere else", solvable, role=Role.OURS),
        every("a solvable case is the minimum over the rationals where both are positive definite, and nowhere else", decided,
              role=Role.OURS),
        every("the sandbox refuses all others, and names the factor that fails", refused, role=Role.OURS),
        every("of these, where (13) as printed gives rates, other rates do better", wrongly, role=Role.OURS),
    )  # fmt: skip
    heat = Heat(
        rf"What (13) gives by what $W_{{\dot x}}$ is on the range of $J$ and $W$ on its null space, over integers: the same "
        rf"in all "
        f"{len(identity) // 16} cases of a kind",
        "task weight", "joint-rate weight", tuple(name for _, name in TASK_KINDS),
        tuple(name for _, name in WEIGHT_KINDS),
        values, 0.5, words,
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
    problems = [VelocityProblem(J=flat().J, xdot=flat().xdot, W=np.diag([1, 1, w])) for w in weights]
    rates = [_rates(p, N, R) for p in problems]
    given = [float(np.linalg.norm(answered(thirteen, p)[0])) for p in problems]
    first = Plot(
        r"Planar 3R stretched out, $W = \mathrm{diag}(1, 1, w)$: (13) as printed gives rates on both sides of $w = -1/13$, "
        r"where "
        "$N_J^T W N_J$ is singular; left of it they are no minimum, and the sandbox refuses",
        Axis("$w$, weight of joint 3"), Axis(r"$|\dot q|$ [rad/s]", low=0, high=20),
        (
            Series("(13) as printed", weights, [float(np.linalg.norm(x)) for x in rates], "line", "other"),
            Series("(13) of the sandbox", weights, given),
            Series("$w = -1/13$", [-1 / 13], [0.0], "vertical", "bound"),
        ),
    )  # fmt: skip
    corner = np.linspace(-3, 3, 121)
    problems = [flat(Wx=np.array([[2.0, 1.0], [1.0, c]])) for c in corner]
    target = [float(np.dot((3, 2, 1), _rates(p, N, R))) for p in problems]
    given = [float(np.dot((3, 2, 1), answered(thirteen, p)[0])) for p in problems]
    second = Plot(
        r"The same arm with $W_{\dot x} = [2, 1; 1, c]$, which is $c$ on the range of $J$: (13) as printed asks for $1 + "
        r"1/c$, and "
        "for $c < 0$ the weighted task error is largest there",
        Axis("$c$, weight of the task row that is left"),
        Axis(r"hand velocity $3\dot q_1 + 2\dot q_2 + \dot q_3$ [m/s]", low=-6, high=8),
        (
            Series("(13) as printed", corner, target, "line", "other"), Series("(13) of the sandbox", corner, given),
            Series("desired", [corner[0], corner[-1]], [1.0, 1.0], "line", "bound"),
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


CLAIM = Claim(
    name="eq13_conditions",
    title="When (13) has a solution, and when that is the minimum",
    place="Section VI, eq. (13)",
    says=r"(13) minimises $\frac{1}{2}\dot q^T W \dot q + \alpha\dot f$ among the least-squares solutions. The paper states no "
    r"condition on $W_{\dot x}$ and $W$, and defines $N_J$, under (6), as an $n \times (n-m)$ matrix.",
    formula=r"\det \begin{bmatrix} R_J^T J^T W_{\dot x} J \\ N_J^T W \end{bmatrix} \det \begin{bmatrix} R_J & N_J "
    r"\end{bmatrix} = \det\left( (J R_J)^T W_{\dot x} J R_J \right) \det\left( N_J^T W N_J \right)",
    tested=r"Integer problems of lower rank in sixteen kinds, $W_{\dot x}$ on the range of $J$ and $W$ on its null space being "
    "positive definite, indefinite or singular. Determinants and inertias are exact.",
    accepted=r"(13) has one solution where both are nonsingular, and it is the minimum where both are positive definite; "
    r"with $n-m$ columns in $N_J$ and a rank below $m$ it has none.",
    paths=(SANDBOX, CodePath("the class of each problem over the rationals", truth)),
    examine=eq13_conditions,
    fault=Fault("rates given wherever the matrix of (13) is nonsingular", any_nonsingular),
)
