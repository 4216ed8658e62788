"""Eq. (6) gives the constrained minimiser."""

from __future__ import annotations

from typing import Any

import numpy as np

from sandbox.claims.claim import Answer, Claim, CodePath, Evidence, Fault, Role, Trial, every
from sandbox.claims.exhibit import Axis, Heat, Plot, Series
from sandbox.claims.framework.curved import KINDS, curved_of_all_kinds, integer, objective, rational
from sandbox.claims.framework.small_arms import J1
from sandbox.claims.situations import SIZES
from sandbox.closed_form.kernels import SOLVED
from sandbox.closed_form.uncompiled import eq6_exact
from sandbox.problem import VelocityProblem
from sandbox.reference.exact import inertia
from sandbox.tolerances import FORWARD, UNIT

Array = np.ndarray


def diagonal_alone(six: Answer) -> Answer:
    """Only the diagonal of W is used."""

    def planted(problem: VelocityProblem) -> Any:
        return six(VelocityProblem(J=problem.J, xdot=problem.xdot, W=np.diag(np.diag(problem.W.dense())), a=problem.a))

    return planted


def bordered(J: Array, W: Array) -> Array:
    """The KKT matrix [W J'; J 0]."""
    return np.block([[W, J.T], [J, np.zeros((len(J), len(J)))]])


def lagrange_minimiser(trial: Trial, six: Answer, signs: Answer) -> Evidence:
    """(6) in Fractions: stationary, minimal by the excess of every other motion, and the KKT inertia that says so."""
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
        "Inertia of the KKT matrix, how many of its eigenvalues are positive, negative and zero, counted over the integers. It "
        "is $(n, m, 0)$ in the first row alone.",
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
        "Eigenvalues of the KKT matrix of a planar 3R arm, $W$ = diag(w, 1, 1). Where $W$ turns indefinite, at $w = 0$, no "
        "sign changes; at $w = -2$, where $n^TWn = 0$, an eigenvalue crosses zero, the inertia is (3, 2, 0) no more, and the "
        "minimum is lost.",
        Axis("w"), Axis("eigenvalue of the KKT matrix"),
        (
            *(Series(f"eigenvalue {i + 1}", w, lines[:, i], "line") for i in range(5)),
            Series("nᵀWn = 0", (-2.0,), (0.0,), "vertical", "bound"),
            Series("zero", (0.0,), (0.0,), "horizontal", "bound"),
        ),
    )  # fmt: skip


CLAIM = Claim(
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
        "Problems of whole numbers in eight sizes, whose stationary points are minima, saddles, maxima or none. (6) runs on "
        "fractions, so that nothing is rounded. Its answers are compared with three random motions each of the same "
        r"$\dot x$; and the inertia of the KKT matrix, how many of its eigenvalues are positive, negative and zero, is counted "
        "over the integers by Sylvester's law."
    ),
    accepted=(
        r"Each answer is feasible, stationary, and cheaper than any other motion drawn by exactly $\frac{1}{2}y^T N_J^T W N_J "
        r"y$; (6) answers if and only if the inertia is $(n, m, 0)$."
    ),
    paths=(
        CodePath("eq. (6) on fractions, condition (7) from its pivots", eq6_exact),
        CodePath("inertia of the KKT matrix, fraction-free, over the integers", inertia),
    ),
    examine=lagrange_minimiser,
    fault=Fault("only the diagonal of $W$ used", diagonal_alone),
    sources=(
        "E. V. Haynsworth, Determination of the inertia of a partitioned Hermitian matrix, Linear Algebra and its Applications "
        "1, 1968",
        "N. I. M. Gould, On practical conditions for the existence and uniqueness of solutions to the general equality "
        "quadratic programming problem, Mathematical Programming 32, 1985",
    ),
)
