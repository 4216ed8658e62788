"""The scalars gamma of (8) and (9)."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np

from problems import robots
from problems.methods.draw import generic
from problems.original.augmented_jacobian import original
from sandbox.agreement import bounds
from sandbox.claims.augmented_jacobian.method import AUGMENTED, allowance, arm, words
from sandbox.claims.claim import Answer, Claim, CodePath, Evidence, Fault, Role, Trial, at_least, at_most, every
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.numbers import SUBSCRIPTS, told
from sandbox.claims.postures import F1, F2, HAND_ANGLE, J1
from sandbox.closed_form.kernels import SOLVED
from sandbox.closed_form.uncompiled import eq6_on
from sandbox.problem import VelocityProblem
from sandbox.weight import Weight

Array = np.ndarray


MOVED = 0.1
"""Joint rates [rad/s] that stand clear of any rounding."""

DECADES = (-100, -10, -3, 0, 2, 12, 100)
"""Exponents of ten that gamma_1 takes where nothing is rounded; gamma_2, ... take them in another order."""


def gamma_in_one_place(kernel: Answer) -> Answer:
    """Gamma left out of the weight (8), though it stands in f, eq. (9)."""

    def planted(number: Any, J: Array, xdot: Array, W: Array, gradf: Array, alpha: Any, E: Array, gamma: Array) -> Any:
        return kernel(number, J, xdot, W, gradf, alpha, E, np.eye(len(E)))

    return planted


def any_positive_gamma(trial: Trial, kernel: Answer, solved: Answer) -> Evidence:
    """Eq. (6) on rationals with gammas over 200 decades, on floats over 24; one function too many; a base beside (8)."""
    rng = trial.rng("any_positive_gamma")
    same, agreed, series, seen = [], [], [], []
    ratios = 10.0 ** np.arange(0, 25, 1 if trial.full else 4)
    for name, task in (("planar_3r", None), ("planar_4r", None), ("panda", "position"), ("seven_joint", "position")):
        robot, count = arm(name, task), trial.of(12, 2)
        k, n = robot.k, robot.n
        q, xdot, _ = generic(robot, rng, count)
        E, gbar = rng.standard_normal((count, k, n)), rng.uniform(-1, 1, (count, k))
        J, other = robot.jacobian(q), solved(robot, q, xdot, E=E, gbar=gbar)
        lost = np.zeros(len(ratios))
        for i in range(count):
            exact = [
                rates_of(
                    kernel, Fraction, J[i], xdot[i], E[i], gbar[i], [Fraction(10) ** int(e) for e in np.roll(DECADES, s)[:k]]
                )
                for s in range(len(DECADES))
            ]
            same.append(all((x == exact[0]).all() for x in exact))
            x = exact[0].astype(float)
            allowed = allowance(robot, q[i : i + 1], xdot[i : i + 1], x[None], E=E[i], gbar=gbar[i])[0]
            agreed.append(np.abs(x - other[i]).max() / allowed)
            for j, ratio in enumerate(ratios):
                gamma = np.geomspace(1.0, ratio, k) if k > 1 else np.array([ratio])
                found = rates_of(kernel, float, J[i], xdot[i], E[i], gbar[i], gamma).astype(float)
                lost[j] = max(lost[j], np.abs(found - x).max() / np.abs(x).max())
        series.append(Series(words(name, task), ratios, lost))
        seen.append(words(name, task))
    arm_3r, xdot = robots.load("planar_3r"), np.array([0.3, -0.7])
    J, two, gbar = J1, np.array([[1.0, 1, 1], [1, 0, 0]]), np.array([0.9, 0.2])
    many = np.geomspace(1e-4, 1e4, trial.of(81, 9))
    over = np.array([rates_of(kernel, Fraction, J, xdot, two, gbar, [Fraction(g), Fraction(1)]).astype(float) for g in many])
    witness = np.array([solved(arm_3r, F1[None], xdot[None], E=two, gbar=gbar, gamma=np.array([g, 1.0]))[0] for g in many])
    Gamma = many[:, None, None] * np.diag([1.0, 0.0]) + np.diag([0.0, 1.0])
    posed = VelocityProblem(
        J=J, xdot=xdot, W=Weight(np.zeros((len(many), 3, 3)), two, Gamma), a=-np.einsum("bpq,q,pn->bn", Gamma, gbar, two)
    )
    conflict, fewer = np.array([[1.0, 1, 0]]), np.ones((1, 4))
    refused = [
        run(kernel, Fraction, rows, xdot, E, gbar[:1], [Fraction(g)])[0] != SOLVED
        for rows, E in ((J, conflict), (robots.load("planar_4r").jacobian(F2), fewer))
        for g in many
    ]
    base = 0.01 * np.eye(3)
    damped = np.array([rates_of(kernel, float, J, xdot, HAND_ANGLE, gbar[:1], [g], base).astype(float) for g in many])
    middle = two_functions(many, xdot, gbar)
    allowed_over = sum(bounds(AUGMENTED, posed, over, {}))
    moved = [float(np.ptp(x, axis=0).max()) for x in (over, damped)]
    checks = (
        every(rf"rational answers of (6) the same for $\gamma_i$ from $10^{{{min(DECADES)}}}$ to $10^{{{max(DECADES)}}}$ on "
              f"{', '.join(seen)}", same),
        at_most("exact answer of (6) against $[J; E]$ in floats: difference / bound", agreed, 1.0),
        at_least(r"beyond the paper's words, one function more than $n - m$, or one beside a base $\tilde W$: $\gamma$ "
        r"moves the "
                 "joint rates [rad/s]", moved, MOVED, role=Role.OURS),
        at_most(r"two functions on three joints: (6) against the answer by hand, difference / bound",
                np.abs(over - middle).max(axis=-1) / allowed_over, 1.0, role=Role.OURS),
        at_most(r"two functions on three joints: (6) against least squares weighted by $\gamma$, difference / bound",
                np.abs(over - witness).max(axis=-1) / allowed_over, 1.0, role=Role.OURS),
        every(r"one function fewer than $n - m$, or $N_J^T \nabla g = 0$: refused, whatever $\gamma$", refused, role=Role.OURS),
    )  # fmt: skip
    lines = [Series(f"q̇{SUBSCRIPTS[i]}, two functions", many, over[:, i], "line") for i in range(3)]
    lines += [Series(f"q̇{SUBSCRIPTS[i]}, one, beside W̃", many, damped[:, i], "line", "other") for i in range(3)]
    held = rates_of(kernel, Fraction, J, xdot, HAND_ANGLE, gbar[:1], [Fraction(1)]).astype(float)
    flat = tuple(Series(f"q̇{SUBSCRIPTS[i]}, one function", many[[0, -1]], held[[i, i]], "line", "bound") for i in range(3))
    plots = (
        Plot("Planar 3R at q = (0, π/2, −π/2), joint rates against γ₁: with n − m = 1 function they do not move; with two "
        "(γ₂ = 1), or beside "
             "W̃ = 0.01 I, they do",
             Axis("γ₁", log=True), Axis("joint rate [rad/s]"), (*flat, *lines)),
        Plot("In double precision the spread of γ costs digits, the more the wider; with one function there is no spread",
             Axis("largest γ / smallest γ (with one function: γ)", log=True),
             Axis("relative error of the joint rates", log=True),
             tuple(series)),
    )  # fmt: skip
    told_for = [int(np.argmin(np.abs(np.log(many / g)))) for g in (1e-2, 1.0, 1e2)]
    table = Table(
        r"$q = (0, \pi/2, -\pi/2)$, $\dot x = (0.3, -0.7)$, $g = (q_1 + q_2 + q_3,\ q_1)$, $\bar g = (0.9, 0.2)$: two "
        r"functions where one fits",
        (r"$\gamma$", "by hand [rad/s]", "ours [rad/s]"),
        tuple((f"({many[i]:g}, 1)", told(middle[i]), told(over[i])) for i in told_for),
    )
    return Evidence(checks, (*plots, table))


def two_functions(gamma: Array, xdot: Array, gbar: Array) -> Array:
    """Joint rates (G, 3) at F1 by hand for g = (q_1 + q_2 + q_3, q_1), weighted gamma_1 and 1: one number t = qdot_1 is free.

    There (t, -xdot - t, xdot + ydot - t) meets the task and turns the hand by ydot - t.
    """
    x, y = xdot
    t = (gamma * (y - gbar[0]) + gbar[1]) / (gamma + 1)
    return np.stack([t, -x - t, x + y - t], axis=-1)


def rates_of(
    kernel: Answer, number: Any, J: Array, xdot: Array, E: Array, gbar: Array, gamma: Any, base: Array | None = None
) -> Array:
    """Joint rates (n,) of (8)-(10) in (6)."""
    rates: Array = run(kernel, number, J, xdot, E, gbar, gamma, base)[1]
    return rates


def run(
    kernel: Answer, number: Any, J: Array, xdot: Array, E: Array, gbar: Array, gamma: Any, base: Array | None = None
) -> tuple[int, Array]:
    """Code and rates of (6) on any kind of number, W = E' Gamma E, grad f = E' Gamma gbar, alpha = -1."""
    p, n = E.shape
    gamma = [number(g) for g in gamma]
    gradf = np.array([sum(number(E[i, j]) * gamma[i] * number(gbar[i]) for i in range(p)) for j in range(n)], dtype=object)
    Gamma = np.full((p, p), number(0), dtype=object)
    Gamma[np.arange(p), np.arange(p)] = gamma
    code, rates, *_ = kernel(number, J, xdot, np.zeros((n, n)) if base is None else base, gradf, -1, E, Gamma)
    return code, rates


CLAIM = Claim(
    name="any_positive_gamma",
    title="The scalars γ may be any positive numbers",
    place="Section III, eqs. (8)–(10)",
    says=r"The $\gamma_i$ of (8) and (9) are any positive scalars: they have no effect on the joint rates.",
    tested=r"Eq. (6) carried out on rationals with $\gamma_i$ over 200 decades, without any rounding, and in floats over "
    r"24. Beyond the paper's words: two functions where $n - m = 1$, one too few, and one beside a base $\tilde W$.",
    accepted=r"The rational answers are the same for all $\gamma$, and are those of $[J; E]$: with exactly $n - m$ "
    r"functions, none damped, and $[J; E]$ nonsingular, as the paper has it.",
    paths=(
        CodePath("eq. (6) as the paper computes it, run on rationals", eq6_on),
        CodePath(r"$[J; E]\,\dot q = [\dot x; \bar g]$, or least squares weighted by $\gamma$, numpy", original),
    ),
    examine=any_positive_gamma,
    fault=Fault(r"$\gamma$ left out of (8), though not of (9)", gamma_in_one_place),
    sources=(*AUGMENTED.works,),
)
