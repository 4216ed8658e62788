"""The augmented Jacobian without W."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np

from problems import robots
from problems.implicit.augmented import augmented_along
from problems.methods import METHODS
from problems.methods.draw import generic
from sandbox.claims import equations
from sandbox.claims.claim import Answer, Claim, CodePath, Evidence, Fault, Role, Trial, at_most, every
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.implicit.allowance import norms, within
from sandbox.closed_form import null_basis
from sandbox.closed_form.eq6_implicit import eq6_implicit
from sandbox.problem import VelocityProblem
from sandbox.stacked import transpose
from sandbox.tolerances import ORIGINAL, UNIT

Array = np.ndarray

ONE_DEGREE = ("planar_3r", "seven_joint", "panda")


def half_projected(along: Answer) -> Answer:
    """N'W = (N' grad g) grad g' as it should be, but gbar as it is on the right, without N' grad g before it."""

    def planted(E: Array, N: Array, gbar: Array, gamma: Any = None) -> tuple[Array, Array]:
        NtW, _ = along(E, N, gbar, gamma)
        return NtW, -gbar

    return planted


def weight_not_needed_augmented(trial: Trial, along: Answer, printed: Answer) -> Evidence:
    """(N' grad g) grad g' in (6) against the explicit W of (8), k = 1; and both near an algorithmic singularity."""
    rng = trial.rng("weight_not_needed_augmented")
    rows, agreed, series = [], [], []
    for name in ONE_DEGREE:
        robot, count = robots.load(name), trial.of(200, 12)
        q, xdot, _ = generic(robot, rng, count)
        e, gbar = rng.standard_normal((count, 1, robot.n)), rng.uniform(-1, 1, (count, 1))
        J, W = robot.jacobian(q), transpose(e) @ e
        N = null_basis.pivoted(J)
        NtW, Nta = along(e, N, gbar)
        x = eq6_implicit(J, xdot, N, NtW, Nta, size=norms(W)).x
        other = np.array([printed(J[i], xdot[i], W[i], gbar[i] * e[i, 0], -1.0) for i in range(count)])
        problem = VelocityProblem(J=J, xdot=xdot, W=W, a=-gbar * e[:, 0])
        ratio = np.abs(x - other).max(axis=-1) / within(problem, other, N, "augmented_jacobian")
        agreed.append(ratio)
        gap = norms(NtW - transpose(N) @ W) / (norms(N) * norms(W))
        rows.append(gap / (ORIGINAL * robot.n * UNIT))
        series.append(Series(name, np.linalg.cond(np.concatenate([J, e], axis=1)), np.abs(x - other).max(axis=-1)
                             / np.abs(other).max(axis=-1)))  # fmt: skip
    distances, errors = near_singular(trial, along, printed, rng)
    bound = ORIGINAL * 3 * UNIT * np.array([np.linalg.cond(system(d)) for d in distances])
    # explicit W is exactly singular, or has lost every digit, where 1/d^2 meets 1/u
    far = distances <= FAR
    singular = ~np.isfinite(errors["explicit"])
    table = Table(
        r"$q = (0, \pi/2, -\pi/2)$, $g = (1 + d) q_1 + q_2$: largest relative error of the joint rates, against exact "
        r"rationals",
        ("$d$", "cond $[J; E]$", "$u/d^2$", "$W$ formed", r"$(N_J^T \nabla g)(\nabla g)^T$"),
        tuple(
            (f"1e−{exponent}", float(np.linalg.cond(system(10.0**-exponent))), UNIT * 10.0 ** (2 * exponent),
             *(nearest(distances, errors[which], 10.0**-exponent) for which in ("explicit", "factored")))
            for exponent in (2, 4, 6, 8)
        ),
    )  # fmt: skip
    checks = (
        at_most("joint rates without and with $W$: difference / bound", np.concatenate(agreed), 1.0),
        at_most(r"rows $(N_J^T \nabla g)(\nabla g)^T$ against $N_J^T W$: difference / rounding", np.concatenate(rows), 1.0),
        at_most(f"without $W$, near an algorithmic singularity: error / ({ORIGINAL:g} n u cond [J; E])",
                errors["factored"] / bound, 1.0, role=Role.OURS),
        every(r"and with $W$ formed, $d \le 10^{-4}$: more than that, or singular",
              singular[far] | (errors["explicit"][far] > bound[far]), role=Role.OURS),
    )  # fmt: skip
    guide = np.array([distances.min(), distances.max()])
    plots = (
        Plot("q = (0, π/2, −π/2), g = (1 + d) q₁ + q₂: where W is formed the error grows with the square of 1/d; [J; E] "
        "is singular at d = 0",
             Axis("d, distance from the algorithmic singularity", log=True),
             Axis("relative error of the joint rates", log=True),
             (Series("(N'∇g)(∇g)ᵀ", distances, errors["factored"]),
              Series("W formed first", distances, errors["explicit"], role="other"),
              Series("50 n u cond [J; E]", distances, bound, "line", "bound"),
              Series("u / d²", guide, UNIT / guide**2, "line", "bound"))),
        Plot("Random situations: relative difference between (6) without and with W formed",
             Axis("cond [J; E]", log=True), Axis("relative difference of the joint rates", log=True), tuple(series)),
    )  # fmt: skip
    return Evidence(checks, (*plots, table))


FAR = 1e-4
"""So near an algorithmic singularity the explicit W's error, u/d^2, stands clear of the bound of the other side, 50 n u/d."""


def system(d: float) -> Array:
    """The matrix [J; E] at F1 with g = (1 + d) q_1 + q_2; in floats exactly."""
    return np.array([[-1.0, -1, 0], [2, 1, 1], [1 + d, 1, 0]])


def near_singular(trial: Trial, along: Answer, printed: Answer, rng: np.random.Generator) -> tuple[Array, dict[str, Array]]:
    """Distances d (D,), and the largest relative errors (D,) over some xdot and gbar; inf where W formed is singular."""
    distances = 10.0 ** -np.arange(0, 8.1, 0.25 if trial.full else 1.0)
    asked = np.round(rng.uniform(-1, 1, (trial.of(20, 6), 3)), 3)
    errors: dict[str, list[float]] = {"explicit": [], "factored": []}
    for d in distances:
        A = system(d)
        J, e = A[:2], A[2:]
        worst = {"explicit": 0.0, "factored": 0.0}
        for x, y, b in asked:
            first = (Fraction(b) + Fraction(x)) / (Fraction(e[0, 0]) - 1)  # q1 + q2 = -x
            exact = np.array([float(v) for v in (first, -Fraction(x) - first, Fraction(y) + Fraction(x) - first)])
            N = null_basis.pivoted(J)
            NtW, Nta = along(e, N, np.array([b]))
            found = {"factored": eq6_implicit(J, [x, y], N, NtW, Nta).x}
            try:
                found["explicit"] = printed(J, np.array([x, y]), e.T @ e, b * e[0], -1.0)
            except np.linalg.LinAlgError:
                found["explicit"] = np.full(3, np.inf)
            for which, rates in found.items():
                worst[which] = max(worst[which], float(np.abs(rates - exact).max() / np.abs(exact).max()))
        for which in errors:
            errors[which].append(worst[which])
    return distances, {which: np.array(values) for which, values in errors.items()}


def nearest(distances: Array, errors: Array, d: float) -> float | str:
    """The error at the distance nearest to d, as text where there is none."""
    found = float(errors[int(np.argmin(np.abs(np.log(distances / d))))])
    return found if np.isfinite(found) else "singular"


CLAIM = Claim(
    name="weight_not_needed_augmented",
    title="The augmented Jacobian with one degree of redundancy needs no W",
    place="Section III, after the weightings",
    says=r"For the augmented Jacobian technique with a single degree of redundancy, $N_J^T W$ can be calculated as "
    r"$(N_J^T \nabla g)(\nabla g)^T$.",
    formula=r"N_J^T W = (N_J^T \nabla g)(\nabla g)^T",
    tested=r"Random gradients on three arms with $n - m = 1$; and $g = (1 + d) q_1 + q_2$ at $q = (0, \pi/2, -\pi/2)$, "
    r"where $d = 0$ is an "
    "algorithmic singularity, against exact rationals.",
    accepted="The joint rates with and without $W$ differ by no more than the sum of their error bounds.",
    paths=(
        CodePath(r"rows $(N_J^T \nabla g)(\nabla g)^T$, $W$ not formed", augmented_along),
        CodePath("eq. (6) as printed, with $W$ of (8) formed, numpy", equations.augmented),
    ),
    examine=weight_not_needed_augmented,
    fault=Fault(r"$\bar g$ on the right-hand side without $N_J^T \nabla g$ before it", half_projected),
    sources=METHODS["augmented_jacobian"].works,
)
