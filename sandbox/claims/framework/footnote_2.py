"""Footnote 2: any vector function for the gradient."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dgglse

from problems import robots
from problems.methods.draw import generic
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_least, at_most
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.framework.reach import reach
from sandbox.closed_form import CLOSED_FORMS
from sandbox.closed_form.eq6 import eq6
from sandbox.problem import VelocityProblem
from sandbox.solution import Solution
from sandbox.tolerances import FORWARD, UNIT
from sandbox.weight import Weight

Array = np.ndarray


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
    for name, arm in (("planar_4r", "planar 4R"), ("panda", "Panda")):
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
            columns.append(
                (
                    arm,
                    p,
                    "singular" if p < n else "W > 0",
                    np.abs(x - other).max(axis=-1) / np.abs(other).max(axis=-1),
                    ratios[-1],
                )
            )
            circulations.append((A, field, q[0]))
        checks.append(at_most(f"{arm}: difference / bounds, criteria of {n - robot.m} to {n + 2} rows", ratios, 1.0))
    radii = np.geomspace(1e-2, 1.0, 21)
    around = np.array([[abs(circulation(*one, radius)) for radius in radii] for one in circulations])
    rounding = [FORWARD * 64 * UNIT * 2 * np.pi * np.linalg.norm(A) * np.abs(field).sum() for A, field, _ in circulations]
    checks.append(at_least(
        "largest circulation of $a(q)$ / its rounding: no $f$ has it for its gradient", around.max(axis=1) / rounding, 1.0,
        role=Role.OURS,
    ))  # fmt: skip
    plot = Plot(
        "Line integral of $a(q)$ around circles in joint space, zero for the gradient of any $f$: it grows with the area "
        "enclosed. (6) minimises all the same.",
        Axis("radius [rad]", log=True), Axis("|∮ aᵀdq|", log=True),
        (
            *(
                Series(f"{arm}, {p} rows", radii, around[i], "line")
                for i, (arm, p, *_) in enumerate(columns) if i % 4 == 0
            ),
            Series("area π radius²", radii, np.pi * radii**2, "line", "bound"),
        ),
    )  # fmt: skip
    table = Table(
        "General quadratic criteria $|A\\dot q - c(q)|^2$, $A$ with $p$ rows: $W = A^TA$ (singular for $p < n$), $a = "
        "-A^Tc(q)$",
        ("arm", "rows $p$", "$W$", "problems", "largest relative difference", "largest difference / bounds"),
        tuple(
            (arm, p, weight, len(ratio), float(off.max()), float(ratio.max())) for arm, p, weight, off, ratio in columns
        ),
    )  # fmt: skip
    return Evidence(tuple(checks), (table, plot))


CLAIM = Claim(
    name="footnote_2",
    title="Any vector function may stand for the gradient",
    place="Section II, footnote 2",
    says=(
        r"$\nabla f$ could be replaced by any vector function of $q$, to optimise a general quadratic criterion subject to "
        r"$\dot x = J\dot q$."
    ),
    formula=r"\min |A\dot q - c(q)|^2, \quad J\dot q = \dot x: \qquad W = A^T A,\; \alpha\nabla f \to -A^T c(q)",
    tested=(
        r"Criteria $|A\dot q - c(q)|^2$ with random $A$ of $n - m$ to $n + 2$ rows and vector functions $c(q)$ that circulate, "
        r"so that no $f$ has $a(q) = -A^T c(q)$ for its gradient; planar 4R and Panda."
    ),
    accepted="(6) and LAPACK's constrained least squares differ by no more than the sum of their error bounds.",
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
)
