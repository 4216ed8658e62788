"""Eq. (13) gives the minimiser among the least-squares solutions, at every rank."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise, product

import numpy as np
import scipy.linalg

from sandbox.claims import equations
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_least, at_most, every
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.rank_deficient.posed import KINDS, SANDBOX, Posed, answered, drawn, error, flat, posed
from sandbox.problem import VelocityProblem
from sandbox.reference import truth
from sandbox.solution import Solution
from sandbox.tolerances import FORWARD, ORIGINAL, TIKHONOV, UNIT

Array = np.ndarray

THIRTEEN = (
    r"\dot q = \begin{bmatrix} R_J^T J^T W_{\dot x} J \\ N_J^T W \end{bmatrix}^{-1} \begin{bmatrix} R_J^T J^T W_{\dot x} "
    r"\dot x \\ -\alpha N_J^T \nabla f \end{bmatrix}"
)

SHAPES = ((1, 2), (2, 3), (3, 3), (3, 5), (4, 6), (6, 7), (3, 2), (4, 3), (5, 4))
"""(m, n), n < m among them; every rank 0..min(m, n) is examined."""

HAND = r"$3\dot q_1 + 2\dot q_2 + \dot q_3$"
"""Velocity of the hand that the stretched planar 3R still has."""

COUPLED = np.array([[2.0, 1.0], [1.0, 1.0]])
"""Wx of that example."""

BY_HAND = {
    "coupled": (Fraction(2), (Fraction(-6, 7), Fraction(-4, 7), Fraction(40, 7))),
    "identity": (Fraction(1), (Fraction(-3, 7), Fraction(-2, 7), Fraction(20, 7))),
}
"""3 q1 + 2 q2 + q3 and qdot of that example, worked by hand for W = diag(1, 1, -1/20) over the rationals."""

DECADES = tuple(range(1, 13))
"""Tikhonov's eps is 10^-d."""

SHOWN = (0, 2, 5)
"""Places of the problems whose regularisation is drawn."""


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
        "Relative error of (13) against the exact rational minimiser, one point a problem, all ranks",
        Axis("condition of the matrix of (13), rows scaled", log=True),
        Axis("relative error of the joint rates", log=True),
        (
            Series("(13) of the sandbox", conditions, ours),
            Series("its error bound", conditions, bounds, role="bound"),
        ),
    )
    return Evidence((*checks, *limits, *by_hand), (plot, limit_plot, table))


def _tikhonov_limit(examined: Sequence[Posed], trial: Trial, exact: Answer) -> tuple[list[Check], Plot]:
    """Errors of (J'WxJ + eps W)^-1 (J'Wx xdot - eps a), over the rationals and in floats."""
    picked = examined[:: max(len(examined) // trial.of(24, 6), 1)]
    ratios, series, exactly = [], [], []
    for place, one in enumerate(picked):
        # damped truth minimises eps (1/2 x'Wx + a'x) + 1/2 |J x - xdot|^2_Wx, eps the square of its damping
        limit = [exact(one.problem, "damped", damping=10 ** (-d / 2)).x_exact for d in DECADES]
        errors = np.array([_apart(x, one.told.x_exact) for x in limit]) / one.size
        ratios.append([b / a for a, b in pairwise(errors[-5:])])
        if place in SHOWN:
            epsilon = 10.0 ** -np.array(DECADES)
            name = f"rank {one.r} of {one.problem.m} × {one.problem.n}"
            series.append(Series(f"float64, {name}", epsilon, [error(tikhonov(one, e), one) for e in epsilon]))
            exactly += [*errors, np.nan]
    deviation = np.abs(10 * np.array(ratios) - 1)
    check = at_most(
        r"error of $(J^T W_{\dot x} J + \varepsilon W)^{-1}(J^T W_{\dot x} \dot x - \varepsilon\alpha\nabla f)$ falls "
        r"tenfold per decade of $\varepsilon$ over the rationals: size of 10 × ratio − 1", deviation, TIKHONOV, role=Role.OURS,
    )  # fmt: skip
    caption = "Tikhonov's regularisation tends to the solution of (13), and is no way to compute it: float64 loses it again"
    return [check], Plot(
        caption,
        Axis(r"regularisation $\varepsilon$", log=True),
        Axis("relative distance from the minimiser", log=True),
        (*series, Series("exact", np.tile([*(10.0 ** -np.array(DECADES)), np.nan], len(series)), exactly, "line", "bound")),
    )


def _apart(x: Sequence[Fraction] | None, y: Sequence[Fraction] | None) -> float:
    """|x - y|, max norm, rounded once; NaN where there is no minimiser."""
    return np.nan if x is None or y is None else float(max(abs(p - q) for p, q in zip(x, y, strict=True)))


def _worked_example(thirteen: Answer, exact: Answer) -> tuple[list[Check], Table]:
    """An indefinite W whose restriction is positive, and a Wx that couples the lost row to the other."""
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
        rows.append(
            (
                f"{words}: {HAND} [m/s]",
                str(target),
                *(float(np.dot((3, 2, 1), x)) for x in answers),
            )
        )
        for i in range(3):
            rows.append((f"{words}: joint {i + 1} [rad/s]", str(hand[i]).replace("-", "−"), *(float(x[i]) for x in answers)))
    checks = [
        every(rf"worked by hand, the stretched planar 3R: {HAND} is 2 with a coupled $W_{{\dot x}}$, 1 with $I$", held,
              role=Role.OURS),
        at_most("worked by hand, the same: joint rates, relative", off, one.bound, role=Role.OURS),
    ]  # fmt: skip
    return checks, Table(
        r"Planar 3R stretched out, $q = 0$, rank 1: $\dot x = (1, 1)$ and $W = \mathrm{diag}(1, 1, -1/20)$, which is "
        r"indefinite, "
        "but positive on the null space of $J$",
        ("quantity", "by hand", "exact", "(13)", "(13) as printed", "scipy", r"Tikhonov, $\varepsilon = 10^{-8}$"),
        tuple(rows),
    )


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


def unweighted(thirteen: Answer) -> Answer:
    """Eq. (13) with Wx left out of its first rows."""

    def planted(problem: VelocityProblem) -> Solution:
        return thirteen(VelocityProblem(J=problem.J, xdot=problem.xdot, W=problem.W, a=problem.a))

    return planted


CLAIM = Claim(
    name="eq13_minimises_within_least_squares",
    title="(13) minimises within the least-squares solutions, at every rank",
    place="Section VI, eq. (13)",
    says=r"When $J$ is not of full rank, (13) minimises $\frac{1}{2}\dot q^T W \dot q + \alpha\dot f$ over the rates that "
    r"minimise $(J\dot q - \dot x)^T W_{\dot x} (J\dot q - \dot x)$.",
    formula=THIRTEEN,
    tested=r"Integer problems of every rank 0 to $\min(m, n)$ in nine sizes, $n < m$ among them; $W_{\dot x}$ the identity, "
    r"positive definite, and indefinite off the range of $J$; $W$ definite and indefinite; $\dot x$ in the range of $J$ and "
    "outside. Besides: (13) as printed, a formulation by scipy that knows nothing of (13), and the limit of Tikhonov's "
    "regularisation.",
    accepted=r"Each answer is the rational minimiser within its error bound. Ours: the regularised one tends to it in "
    r"proportion to $\varepsilon$.",
    paths=(SANDBOX, CodePath("the minimiser over the rationals, by exact elimination", truth)),
    examine=eq13_minimises_within_least_squares,
    fault=Fault(r"$W_{\dot x}$ left out of the first rows of (13)", unweighted),
)
