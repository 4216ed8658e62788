"""What condition (7) decides."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np

from sandbox.claims import equations
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, every
from sandbox.claims.exhibit import Axis, Heat, Plot, Series, Table
from sandbox.claims.framework.curved import EXACT_KIND, KINDS, curved_of_all_kinds, integer, objective, stack
from sandbox.claims.framework.small_arms import ASKED, J1, J2
from sandbox.claims.numbers import told
from sandbox.claims.situations import SIZES
from sandbox.closed_form.eq6 import eq6
from sandbox.closed_form.kernels import SOLVED
from sandbox.closed_form.uncompiled import eq6_exact
from sandbox.problem import VelocityProblem
from sandbox.reference.truth import truth
from sandbox.solution import Solution, Status
from sandbox.tolerances import UNIT

Array = np.ndarray


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
"""Arm, J, the diagonal of W, and what its stationary points are, worked out by hand."""


SAID = {
    "SOLVED": "solved", "CONDITION_SEVEN": "refused: (7) fails", "ILL_CONDITIONED": "refused: ill-conditioned",
    "RANK_DEFICIENT": "refused: rank of J",
}  # fmt: skip
"""What (6) of the sandbox may say of a problem, in short."""


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
        every("(6) answers if and only if (7) holds, by exact arithmetic, and refuses otherwise", right),
        every(
            "in exact arithmetic: the trailing pivots of the LU are positive if and only if $N_J^TWN_J > 0$", pivots,
            role=Role.OURS,
        ),
        every(
            "where $N_J^TWN_J$ has a negative eigenvalue and (6) a solution, the objective falls from it, both ways", falls,
            role=Role.OURS,
        ),
        every(
            "examples worked out by hand: minimum, saddle, maximum or none, as exact arithmetic says",
            [EXACT_KIND[known.reason] == kind for *_, kind, known in examples], role=Role.OURS,
        ),
        every("$\\det A \\neq 0$ if and only if $\\det N_J^TWN_J \\neq 0$, $A$ the matrix of (6)", solvable, role=Role.OURS),
        every(
            "$\\det(A)^2 \\det(N^TN) = \\det(N^TWN)^2 \\det(JJ^T)$, exactly", identity, role=Role.OURS,
        ),
        Check(
            "(7) asks for more than a system that can be solved: $A$ can be regular without it", any(solvable_without),
            f"{sum(solvable_without)} of {len(solvable_without)}", "some", len(solvable_without), Role.OURS,
        ),
    )  # fmt: skip
    statuses = [name for name in SAID if any(s == name for _, s in seen)]
    heat = Heat(
        "Problems by what their stationary points are, in exact arithmetic (flat: $N_J^TWN_J$ is singular), and what (6) of "
        "the sandbox said of them in float64",
        "what the sandbox said", "what the stationary points are", tuple(SAID[s] for s in statuses), KINDS,
        [[float(seen[kind, s]) for s in statuses] for kind in KINDS], middle=0.5,
        words=[[str(seen[kind, s]) for s in statuses] for kind in KINDS],
    )  # fmt: skip
    return Evidence(checks, (_along_the_self_motion(), heat, _examples_table(six, examples)))


def _along_the_self_motion() -> Plot:
    """The objective on the self-motion of the arm F1, W = diag(w, 1, 1)."""
    n, start, y = np.array([-1.0, 1, 1]), np.linalg.pinv(J1) @ ASKED, np.linspace(-2.5, 2.5, 101)
    series, places, heights = [], [], []
    for w in (-1.0, -2.0, -3.0):
        W = np.diag([w, 1, 1])
        name = f"W = diag{told([w, 1, 1])}: nᵀWn = {n @ W @ n:g}".replace("-", "−")
        series.append(Series(name, y, [objective(W, np.zeros(3), start + t * n) for t in y], "line"))
        if n @ W @ n:
            x = equations.augmented(J1, ASKED, W, np.zeros(3), 0.0, n[:, None])
            places.append((x - start) @ n / (n @ n))
            heights.append(objective(W, np.zeros(3), x))
    return Plot(
        "The objective along the self-motion of a planar 3R arm, $\\dot q = J^+\\dot x + y\\,n$: a minimum under (7), no "
        "stationary point where $n^TWn = 0$, and beyond it a maximum, which (6) as printed returns as if it were the minimum.",
        Axis("y [rad/s]"), Axis("½ q̇ᵀW q̇"), (*series, Series("(6) as printed", places, heights, role="other")),
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
            arm, f"diag{told(w)}", told(np.where(abs(S) > 4 * UNIT * len(w), S, 0.0)), EXACT_KIND[known.reason],
            "no solution" if printed is None else told(printed),
            told(ours.x[0]) if ours.status[0].answered else ours.status[0].sentence,
        ))  # fmt: skip
    return Table(
        "The simplest weights that are not positive definite, $\\dot x$ = (1, 1), $a = 0$; eigenvalues of $N^TWN$ for "
        "orthonormal $N$",
        ("arm", "$W$", "eigenvalues of $N^TWN$", "stationary point, exactly", "(6) as printed", "(6) of the sandbox"),
        tuple(rows),
    )  # fmt: skip


CLAIM = Claim(
    name="condition_seven",
    title="Condition (7) is what (6) needs, for the minimum",
    place="Section II, eq. (7)",
    says=r"The condition under which (6) can be used is (7): $N_J^T W N_J$ is positive definite.",
    formula=r"\det\begin{bmatrix} J \\ N_J^T W \end{bmatrix}^2 = \frac{\det(N_J^T W N_J)^2 \det(JJ^T)}{\det(N_J^T N_J)}",
    tested=(
        r"Problems of whole numbers whose $N_J^T W N_J$ is exactly positive definite, negative definite, of both signs, or "
        r"singular, in eight sizes; and six small arms worked out by hand. A solution of (6) alone needs less than (7): by the "
        r"formula above, $\det N_J^T W N_J \neq 0$."
    ),
    accepted=(
        "The sandbox's (6) answers exactly those problems that have a minimum; exact arithmetic decides which. Where (6) has a "
        "solution without (7), it is no minimum: the objective falls away from it."
    ),
    paths=(
        CodePath("eq. (6), which reads (7) from its trailing pivots", eq6),
        CodePath("class of the problem by exact elimination over the rationals", truth),
    ),
    examine=condition_seven,
    fault=Fault("any nonsingular system of (6) accepted, (7) not looked at", accepted_unless_singular),
)
