"""Section III: the augmented Jacobian technique, eqs. (8)-(10)."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from scipy import optimize
from scipy.spatial.transform import Rotation

from problems import paths, robots
from problems.measures.measure import Measure, symbolic
from problems.methods import METHODS
from problems.methods.augmented_jacobian import cast_functions
from problems.methods.draw import HEALTHY, generic
from problems.original.augmented_jacobian import original
from problems.robots.twin import Symbol, Twin
from problems.weightings.augmented import clear
from sandbox.agreement import bounds
from sandbox.claims import equations
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_least, at_most, every
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.closed_form import CLOSED_FORMS
from sandbox.closed_form.kernels import SOLVED
from sandbox.closed_form.uncompiled import eq6_on
from sandbox.law import rates
from sandbox.motion import Motion, follow
from sandbox.problem import VelocityProblem
from sandbox.repeatability import drift, lie_brackets
from sandbox.tolerances import CLOSED_CYCLE
from sandbox.weight import Weight

Array = np.ndarray
Law = Callable[[Array, Array], Array]

AUGMENTED = METHODS["augmented_jacobian"]

QUARTER = np.pi / 2
F1 = np.array([0.0, QUARTER, -QUARTER])
F2 = np.array([0.0, QUARTER, -QUARTER, QUARTER])
SUM = np.ones((1, 3))
"""Gradient of the hand's angle g = q_1 + q_2 + q_3 of the planar arm, as a row."""

ARMS = (("planar_3r", None), ("planar_4r", None), ("panda", None), ("panda", "position"), ("seven_joint", "position"))
"""Robots and tasks with one, two, one, four and four degrees of redundancy."""


SUBSCRIPTS = "₁₂₃₄₅₆₇"


def told(values: Any, digits: int = 6) -> str:
    """A row of numbers as text."""
    rounded = np.round(np.asarray(values, dtype=float), 12) + 0.0
    return "(" + ", ".join(f"{value:.{digits}g}".replace("-", "−") for value in rounded) + ")"


def half_unit(decimals: int) -> float:
    """What a number printed with so many decimals may be off."""
    return 0.5 * 10.0**-decimals


def arm(name: str, task: str | None) -> Any:
    """The robot, asked for that task."""
    return robots.load(name, task)


def words(name: str, task: str | None) -> str:
    """What the robot is called on the page."""
    robot = arm(name, task)
    return f"{name}{', ' + task if task else ''} ({robot.m}×{robot.n})"


# eqs. (8)-(10) against [J; E]


class Printed(NamedTuple):
    """A case worked out by hand: configuration, gradients, rates asked, and the joint rates they lead to."""

    name: str
    robot: str
    q: Array
    E: Array
    xdot: tuple[float, float]
    gbar: tuple[float, ...]
    expected: tuple[float, ...]
    formula: str


def printed_cases() -> tuple[Printed, ...]:
    """Methods 4.2, 4.3, M8 (an escape rate as the secondary function) and M17 (a virtual load that turns)."""
    (x, y), b1, b2 = (0.3, -0.7), 0.9, -0.4
    row = np.array([[1.0, 0, 0]])
    two = np.array([[1.0, 0, 0, 0], [1, 1, 1, 1]])
    return (
        Printed(r"F1, $g = q_1 + q_2 + q_3$", "planar_3r", F1, SUM, (x, y), (b1,), (y - b1, b1 - x - y, b1 + x),
                r"$(\dot y - \bar g,\ \bar g - \dot x - \dot y,\ \bar g + \dot x)$"),
        Printed(r"F1, $g = q_1 + q_2 + q_3$ at rest", "planar_3r", F1, SUM, (x, y), (0.0,), (y, -x - y, x),
                r"$(\dot y,\ -\dot x - \dot y,\ \dot x)$"),
        Printed(r"F1, $g = q_1$", "planar_3r", F1, row, (x, y), (0.5,), (0.5, -x - 0.5, x + y - 0.5),
                r"$(\bar g,\ -\dot x - \bar g,\ \dot x + \dot y - \bar g)$"),
        Printed(r"F2, $g = (q_1,\ q_1 + q_2 + q_3 + q_4)$", "planar_4r", F2, two, (x, y), (b1, b2),
                (b1, -x - b1 - b2, x + y - b1 + b2, -y + b1 + b2),
                r"$(\bar g_1,\ -\dot x - \bar g_1 - \bar g_2,\ \dot x + \dot y - \bar g_1 + \bar g_2,\ "
                r"-\dot y + \bar g_1 + \bar g_2)$"),
    )  # fmt: skip


def turned_alpha(framework: Answer) -> Answer:
    """Eq. (10) with alpha = +1: the rates asked of the functions change sign."""

    def planted(method: Any, robot: Any, q: Array, xdot: Array, **parameters: Any) -> Array:
        gbar = parameters.get("gbar")
        return framework(method, robot, q, xdot, **parameters | ({} if gbar is None else {"gbar": -np.asarray(gbar)}))

    return planted


def augmented_jacobian(trial: Trial, framework: Answer, solved: Answer) -> Evidence:
    """The cast (8)-(10) in (6) and the square system [J; E], random gradients on five arms; alpha = +1; cases by hand."""
    rng = trial.rng("augmented_jacobian")
    checks, series, turned, missed, sizes = [], [], [], [], []
    for name, task in ARMS:
        robot, count = arm(name, task), trial.of(160, 12)
        q, xdot, _ = generic(robot, rng, count)
        E = rng.standard_normal((count, robot.k, robot.n))
        gbar, gamma = rng.uniform(-1, 1, (count, robot.k)), rng.uniform(0.1, 10.0, robot.k)
        given = {"E": E, "gbar": gbar, "gamma": gamma}
        x, other = framework(AUGMENTED, robot, q, xdot, **given), solved(robot, q, xdot, **given)
        allowed = allowance(robot, q, xdot, x, **given)
        checks.append(at_most(f"difference / bound, {words(name, task)}", np.abs(x - other).max(axis=-1) / allowed, 1.0))
        size = np.abs(other).max(axis=-1)
        condition = np.linalg.cond(np.concatenate([robot.jacobian(q), E], axis=1))
        series.append(Series(words(name, task), condition, np.abs(x - other).max(axis=-1) / size))
        sizes.append((condition, allowed / size))
        wrong = framework(AUGMENTED, robot, q, xdot, **{**given, "gbar": -gbar})  # alpha = +1
        turned.append(
            np.abs(np.einsum("bkn,bn->bk", E, wrong) + gbar).max(axis=-1) / (np.linalg.norm(E, axis=(1, 2)) * allowed)
        )
        missed.append((condition, np.abs(wrong - other).max(axis=-1) / size))
    checks.append(
        at_most(r"with $\alpha = +1$ the functions get $-\bar g$: $E \dot q + \bar g$ / bound", np.concatenate(turned), 1.0,
                role=Role.OURS)
    )  # fmt: skip
    rows, ratios = [], []
    for case in printed_cases():
        robot, q, xdot = robots.load(case.robot), case.q[None], np.array([case.xdot])
        given = {"E": case.E, "gbar": np.array(case.gbar)}
        x = framework(AUGMENTED, robot, q, xdot, **given)
        ratios.append(np.abs(x[0] - case.expected).max() / allowance(robot, q, xdot, x, **given)[0])
        rows.append((case.name, told(case.xdot), told(case.gbar), case.formula, told(case.expected), told(x[0])))
    checks.append(at_most("cases worked out by hand: difference / bound", ratios, 1.0))
    condition, bound = (np.concatenate(part) for part in zip(*sizes, strict=True))
    others, gap = (np.concatenate(part)[:: len(ARMS)] for part in zip(*missed, strict=True))
    plot = Plot(
        "Relative difference between (8)–(10) in (6) and the augmented Jacobian, one point a situation, beside the sum of "
        "their error bounds; and with α = +1",
        Axis("cond [J; E]", log=True), Axis("relative difference of the joint rates", log=True),
        (*series, Series("α = +1", others, gap, role="other"), Series("sum of bounds", condition, bound, role="bound")),
    )  # fmt: skip
    table = Table(
        r"Unit-link planar arms at F1, $q = (0, \pi/2, -\pi/2)$, and F2, $q = (0, \pi/2, -\pi/2, \pi/2)$: cases worked out by "
        "hand, and (6)",
        ("case", r"$\dot x$ [m/s]", r"$\bar g$ [rad/s]", r"$\dot q$ by hand", "by hand [rad/s]", "ours [rad/s]"), tuple(rows),
        paper=("by hand [rad/s]",),
    )  # fmt: skip
    return Evidence(tuple(checks), (plot, table))


def allowance(robot: Any, q: Array, xdot: Array, x: Array, **given: Any) -> Array:
    """What (6) and [J; E] may differ by (B,) [rad/s, m/s]: the sum of their bounds."""
    return sum(bounds(AUGMENTED, AUGMENTED.cast(robot, q, xdot, **given), x, given))  # type: ignore[return-value]


# any positive scalars

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
                by_hand(
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
                found = by_hand(kernel, float, J[i], xdot[i], E[i], gbar[i], gamma).astype(float)
                lost[j] = max(lost[j], np.abs(found - x).max() / np.abs(x).max())
        series.append(Series(words(name, task), ratios, lost))
        seen.append(words(name, task))
    arm_3r, xdot = robots.load("planar_3r"), np.array([0.3, -0.7])
    J, two, gbar = np.array([[-1.0, -1, 0], [2, 1, 1]]), np.array([[1.0, 1, 1], [1, 0, 0]]), np.array([0.9, 0.2])
    many = np.geomspace(1e-4, 1e4, trial.of(81, 9))
    over = np.array([by_hand(kernel, Fraction, J, xdot, two, gbar, [Fraction(g), Fraction(1)]).astype(float) for g in many])
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
    damped = np.array([by_hand(kernel, float, J, xdot, SUM, gbar[:1], [g], base).astype(float) for g in many])
    printed = {1.0: (-0.7, 0.4, 0.3), 10.0: (-1.436364, 1.136364, 1.036364)}  # methods 4.3
    ours = {g: by_hand(kernel, Fraction, J, xdot, two, gbar, [Fraction(g), Fraction(1)]).astype(float) for g in printed}
    most = {what: float(np.ptp(x, axis=0).max()) for what, x in (("two", over), ("base", damped))}
    moved = max(most.values())
    range_ = (
        rf"exactly $n - m$ functions, none damped, and $[J; E]$ nonsingular: there {sum(same)} of {len(same)} exact answers "
        rf"are the same for every $\gamma$. With one function more than $n - m$ the joint rates move by {most['two']:.3g} "
        rf"rad/s over eight decades of $\gamma$, beside $\tilde W = 0.01\,I$ by {most['base']:.3g} rad/s"
    )
    checks = (
        every(rf"rational answers of (6) the same for $\gamma_i$ from $10^{{{min(DECADES)}}}$ to $10^{{{max(DECADES)}}}$ on "
              f"{', '.join(seen)}", same),
        at_most("exact answer of (6) against $[J; E]$ in floats: difference / bound", agreed, 1.0),
        Check(r"$\gamma$ is without effect also with another number of functions, or beside a base $\tilde W$", moved == 0,
              moved, "0 rad/s", 2 * len(many), Role.REACH, range_),
        at_most("two functions on three joints: difference to the rates of methods 4.3",
                [np.abs(ours[g] - printed[g]).max() for g in printed], half_unit(6), role=Role.OURS),
        at_most(r"two functions on three joints: (6) against least squares weighted by $\gamma$, difference / bound",
                np.abs(over - witness).max(axis=-1) / sum(bounds(AUGMENTED, posed, over, {})), 1.0, role=Role.OURS),
        every(r"one function fewer than $n - m$, or $N_J^T \nabla g = 0$: refused, whatever $\gamma$", refused, role=Role.OURS),
    )  # fmt: skip
    lines = [Series(f"q̇{SUBSCRIPTS[i]}, two functions", many, over[:, i], "line") for i in range(3)]
    lines += [Series(f"q̇{SUBSCRIPTS[i]}, one, beside W̃", many, damped[:, i], "line", "other") for i in range(3)]
    held = by_hand(kernel, Fraction, J, xdot, SUM, gbar[:1], [Fraction(1)]).astype(float)
    flat = tuple(Series(f"q̇{SUBSCRIPTS[i]}, one function", many[[0, -1]], held[[i, i]], "line", "bound") for i in range(3))
    points = tuple(Series(f"methods 4.3, γ₁ = {g:g}", [g] * 3, printed[g], role="paper") for g in printed)
    plots = (
        Plot("Joint rates of the planar arm at F1 against γ₁ (γ₂ = 1): with one function they do not move, with two they do",
             Axis("γ₁", log=True), Axis("joint rate [rad/s]"), (*flat, *lines, *points)),
        Plot("In double precision: digits lost to the spread of γ, worst of the situations; with one function there is none",
             Axis("largest γ / smallest γ (with one function: γ)", log=True),
             Axis("relative error of the joint rates", log=True),
             tuple(series)),
    )  # fmt: skip
    table = Table(
        r"F1, $\dot x = (0.3, -0.7)$, $g = (q_1 + q_2 + q_3,\ q_1)$, $\bar g = (0.9, 0.2)$: two functions where one fits",
        (r"$\gamma$", "methods 4.3 [rad/s]", "ours [rad/s]"),
        tuple((f"({g:g}, 1)", told(printed[g]), told(ours[g])) for g in printed),
        paper=("methods 4.3 [rad/s]",),
    )
    return Evidence(checks, (*plots, table))


def by_hand(
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


# the desired rate, frozen

GAIN, WANTED = 2.0, 0.3
"""k_p [1/s] and g_des of methods 8.3; the constant c is added to g and g_des both."""


def _shifted_angle(twin: Twin, shift: Symbol) -> Symbol:
    return ca.sum1(twin.q) + shift


def _shifted_curved(twin: Twin, shift: Symbol) -> Symbol:
    return ca.sum1(twin.q) + ca.sumsqr(twin.q) / 2 + shift


def shifted(expression: Any, shift: float) -> Measure:
    """The function g + c as a measure."""
    return symbolic("function", "rad", "a secondary function", "methods 8.3", expression, parameters=[np.array([shift])])


def plain_angle(q: Array) -> Array:
    """The hand's angle, on real or complex numbers."""
    return q.sum(axis=-1)


def plain_curved(q: Array) -> Array:
    """The same and half the squared posture."""
    return q.sum(axis=-1) + (q * q).sum(axis=-1) / 2


def gradient(f: Callable[[Array], Array], q: Array) -> Array:
    """Gradient (B, n) of an analytic f by complex steps, without rounding."""
    step = 2.0**-100
    return np.stack([f(q + 1j * step * row).imag / step for row in np.eye(q.shape[-1])], axis=-1)


def differentiated_rate(cast: Answer) -> Answer:
    """Gradient of f, eq. (9), taken of gbar = k_p (g_des - g) too: k_p gamma g grad g is added to a."""

    def planted(robot: Any, q: Array, xdot: Array, *, functions: Any, gain: float, **more: Any) -> VelocityProblem:
        problem = cast(robot, q, xdot, functions=functions, gain=gain, **more)
        g = np.stack([one.value(robot, q) for one in functions], axis=-1)
        E = np.stack([one.gradient(robot, q) for one in functions], axis=-2)
        return VelocityProblem(
            J=problem.J, xdot=problem.xdot, W=problem.W, a=problem.a + gain * np.einsum("...k,...kn->...n", g, E)
        )

    return planted


def frozen_rate(trial: Trial, cast: Answer, printed: Answer) -> Evidence:
    """Eq. (9) with gbar = k_p (g_des - g), frozen and differentiated, while a constant is added to g and g_des."""
    rng = trial.rng("frozen_rate")
    constants = np.linspace(-2, 2, trial.of(41, 5))
    agreed, frozen_moves, literal_moves = [], [], []
    lines: dict[str, list[Array]] = {"frozen": [], "literal": []}
    for name, expression, plain in (
        ("planar_3r", _shifted_angle, plain_angle), ("planar_3r", _shifted_curved, plain_curved),
        ("panda", _shifted_curved, plain_curved),
    ):  # fmt: skip
        robot = robots.load(name)
        first = plain is plain_angle
        q, xdot, _ = generic(robot, rng, trial.of(20, 4))
        q, xdot = (F1[None], np.ones((1, 2))) if first else (q, xdot)
        g, J = plain(q), robot.jacobian(q)
        E = gradient(plain, q)
        clearance = clear(robot, q, E[:, None, :])[0] > HEALTHY
        q, xdot, g, J, E = (part[clearance] for part in (q, xdot, g, J, E))
        kept: dict[str, list[Array]] = {"frozen": [], "literal": []}
        for c in constants:
            problem = cast(robot, q, xdot, functions=[shifted(expression, c)], desired=WANTED + c, gain=GAIN)
            x = CLOSED_FORMS["eq6"](problem).x
            rate = GAIN * (WANTED - g)  # of g + c as of g

            def literal(z: Array, plain: Any = plain, c: float = c) -> Array:
                value = plain(z) + c
                return GAIN * (WANTED + c - value) * value

            slopes = gradient(literal, q)
            parts = [
                [printed(J[i], xdot[i], np.outer(E[i], E[i]), gradf, -1.0) for gradf in (rate[i] * E[i], slopes[i])]
                for i in range(len(q))
            ]
            other, wrong = np.swapaxes(np.array(parts), 0, 1)
            allowed = sum(bounds(AUGMENTED, problem, other, {}))
            agreed.append(np.abs(x - other).max(axis=-1) / allowed)
            kept["frozen"].append(x)
            kept["literal"].append(wrong)
        held, moved = (np.array(kept[which]) for which in kept)
        frozen_moves.append(np.ptp(held, axis=0).max(axis=-1) / (2 * sum(bounds(AUGMENTED, problem, held[0], {}))))
        literal_moves.append(np.ptp(moved, axis=0).max(axis=-1))
        if first:
            lines = {which: [np.array(kept[which])[:, 0, i] for i in range(3)] for which in kept}
    smallest = float(np.concatenate(literal_moves).min())
    largest = float(np.concatenate(literal_moves).max())
    arm_3r, there = robots.load("planar_3r"), (F1[None], np.ones((1, 2)))
    zero, one = (
        CLOSED_FORMS["eq6"](cast(arm_3r, *there, functions=[shifted(_shifted_angle, c)], desired=WANTED + c, gain=GAIN)).x[0]
        for c in (0.0, 1.0)
    )
    E, J = np.ones(3), np.array([[-1.0, -1, 0], [2, 1, 1]])
    differentiated = [printed(J, np.ones(2), np.outer(E, E), GAIN * ((WANTED - 0.0) - (0.0 + c)) * E, -1.0) for c in (0.0, 1.0)]
    expected = np.array([(0.4, -1.4, 1.6), (2.4, -3.4, -0.4)])
    exact = allowance(arm_3r, *there, expected[1:], E=SUM, gbar=np.array([GAIN * WANTED]))[0]
    range_ = (
        rf"$\nabla f = \sum \gamma_i \bar g_i \nabla g_i$ with $\bar g_i$ the number that it is at this instant (footnote 2 "
        rf"allows any vector for $\nabla f$). Differentiated with $\bar g = k_p (g_{{des}} - g)$, adding a constant between "
        rf"{constants[0]:g} and {constants[-1]:g} to $g$ and $g_{{des}}$ moved the joint rates by {smallest:.3g} to "
        rf"{largest:.3g} rad/s"
    )
    moves = np.concatenate(literal_moves)
    checks = (
        at_most(r"(6) with $\bar g$ frozen, by CasADi, against (6) as printed: difference / bound",
                np.concatenate(agreed), 1.0),
        Check(r"to the letter: joint rates from the gradient of $f = \sum \gamma_i \bar g_i(q)\, g_i(q)$ do not depend on a "
              "constant added to $g$", bool((moves == 0).all()), f"they move by {smallest:.3g} to {largest:.3g} rad/s",
              "0 rad/s", moves.size, Role.PRINTED, range_),
        at_most(r"$\bar g$ frozen: what a constant moves / twice the bound", np.concatenate(frozen_moves), 1.0, role=Role.OURS),
        at_most("rates of methods 8.3, frozen with $c = 0$ and $1$ and differentiated with $c = 1$: difference / bound",
                [np.abs(zero - expected[0]).max() / exact, np.abs(one - expected[0]).max() / exact,
                 np.abs(differentiated[1] - expected[1]).max() / exact], 1.0, role=Role.OURS),
    )  # fmt: skip
    plot = Plot(
        "F1, g = q₁ + q₂ + q₃ + c, g_des = 0.3 + c, k_p = 2/s: joint rates against a constant that changes nothing",
        Axis("c, added to g and to g_des [rad]"), Axis("joint rate [rad/s]"),
        (
            *(Series(f"q̇{SUBSCRIPTS[i]}, frozen", constants, lines["frozen"][i], "line") for i in range(3)),
            *(Series(f"q̇{SUBSCRIPTS[i]}, differentiated", constants, lines["literal"][i], "line", "other") for i in range(3)),
            *(Series(f"methods 8.3, {which}", [c] * 3, expected[i], role="paper")
              for i, (which, c) in enumerate((("frozen", 0), ("differentiated", 1)))),
        ),
    )  # fmt: skip
    table = Table(
        r"F1, $\dot x = (1, 1)$, $g = q_1 + q_2 + q_3 + c$, $g_{des} = 0.3 + c$, $k_p = 2$/s",
        (r"$\bar g$", "$c$", "methods 8.3 [rad/s]", "ours [rad/s]"),
        (
            ("frozen", 0, told(expected[0]), told(zero)), ("frozen", 1, told(expected[0]), told(one)),
            ("differentiated", 0, None, told(differentiated[0])),
            ("differentiated", 1, told(expected[1]), told(differentiated[1])),
        ),
        paper=("methods 8.3 [rad/s]",),
    )  # fmt: skip
    return Evidence(checks, (plot, table))


# repeatability

DRIFTS = {
    "gradient_projection": ("pseudoinverse, W = I", {"alpha": 0.0}, (0.03204222423, -0.03306882381, -0.03101509742), 11),
    "inertia_weighted": ("inertia, W = M", {}, (0.0738853123, -0.0793407944, -0.0684149084), 10),
}
"""Laws that drift: what they are called, their parameters, drift [rad] over one square of 0.4 m from F1, and its decimals."""

BASES = (1e-1, 1e-2, 1e-3)


class Course(NamedTuple):
    """A robot on a closed path, and the functions g whose gradients make up W of (8)."""

    words: str
    robot: Any
    path: Any
    start: Array
    g: Callable[[Array], Array]
    rows: Callable[[Array], Array]


POSTURE = np.array([0.4, 1.1, -0.2])


def hand_angle(q: Array) -> Array:
    """The sum of all joints (1,)."""
    return q.sum(keepdims=True)


def hand_angle_rows(q: Array) -> Array:
    """Its gradient (1, n)."""
    return np.ones((1, len(q)))


def nearness(q: Array) -> Array:
    """Half the squared distance from a posture, and joint 1 (1,): no linear function."""
    return np.array([((q - POSTURE) ** 2).sum() / 2 + q[0]])


def nearness_rows(q: Array) -> Array:
    """Its gradient (1, 3)."""
    return (q - POSTURE)[None] + np.eye(1, 3)


def pair(q: Array) -> Array:
    """Joint 1, and the sum of all (2,)."""
    return np.array([q[0], q.sum()])


def pair_rows(q: Array) -> Array:
    """Their gradients (2, n)."""
    return np.vstack([np.eye(1, len(q)), np.ones((1, len(q)))])


def first_joint(q: Array) -> Array:
    """Joint 1 (1,)."""
    return q[:1]


def first_joint_rows(q: Array) -> Array:
    """Its gradient (1, n)."""
    return np.eye(1, len(q))


def courses(full: bool) -> tuple[Course, ...]:
    """Closed paths on which [J; E] stays clear of singularity."""
    three, four = robots.load("planar_3r"), robots.load("planar_4r")
    square = paths.load("square", 0.4)
    both = (
        Course("planar 3R, hand angle", three, square, F1, hand_angle, hand_angle_rows),
        Course("planar 3R, a nonlinear g", three, square, F1, nearness, nearness_rows),
    )
    if not full:
        return both
    panda, ready = robots.load("panda"), np.array([0.1, -0.6, 0.2, -2.1, 0.15, 1.7, 0.6])
    return (
        *both,
        Course("planar 4R, two functions", four, paths.load("circle", 0.15), F2 + 0.1, pair, pair_rows),
        Course("Panda, joint 1", panda, paths.load("circle", 0.1, plane="yz"), ready, first_joint, first_joint_rows),
    )


def base_left_in(framework: Answer) -> Answer:
    """W = E' Gamma E + 0.01 I: a regularisation left in the weight."""

    def planted(method: Any, robot: Any, q: Array, xdot: Array, **parameters: Any) -> Array:
        if method is not AUGMENTED:
            return framework(method, robot, q, xdot, **parameters)
        return framework(METHODS["damped_secondary"], robot, q, xdot, base=0.01, **parameters)

    return planted


def with_alpha_zero(framework: Answer, course: Course) -> Law:
    """Eq. (6) with W of (8) and alpha = 0, as a law (q, xdot) -> qdot."""

    def law(q: Array, xdot: Array) -> Array:
        rows: Array = framework(AUGMENTED, course.robot, q[None], xdot[None], E=course.rows(q)[None])
        return rows[0]

    return law


def plain(framework: Answer, method: str, robot: Any, **parameters: Any) -> Law:
    """Another method as a law."""

    def law(q: Array, xdot: Array) -> Array:
        rows: Array = framework(METHODS[method], robot, q[None], xdot[None], **parameters)
        return rows[0]

    return law


def postures(course: Course, root: Answer, times: Array) -> Array:
    """Joint angles (T, n) that put the hand where the path has it with g as at the start: a root for each instant."""
    robot, (place, turned) = course.robot, course.robot.forward(course.start)
    kept = course.g(course.start)

    def missing(q: Array, t: float) -> Array:
        position, rotation = robot.forward(q)
        turn = Rotation.from_matrix(rotation @ turned.T).as_rotvec()
        gap = np.concatenate([position - place - course.path.displacement(np.array(t)), turn])[list(robot.rows)]
        return np.concatenate([gap, course.g(q) - kept])

    found, q = [], course.start
    for t in times:
        q = root(missing, q, args=(float(t),), tol=1e-14).x
        found.append(q)
    return np.array(found)


def repeatable_with_alpha_zero(trial: Trial, framework: Answer, root: Answer) -> Evidence:
    """Closed paths by (6) with W of (8), alpha = 0: postures against roots of x and g, drift, brackets; laws that drift."""
    cycles = trial.of(5, 1)
    parts = np.linspace(0.0, 1.0, trial.of(17, 5))[1:]
    gaps, closed, brackets, series = [], [], [], []
    rows: list[tuple[str | float | None, ...]] = []
    for course in courses(trial.full):
        law = with_alpha_zero(framework, course)
        done = follow(law, course.robot, course.path, course.start, samples=1)
        times = parts * course.path.duration
        along = np.array([done.between(t) for t in times])
        gaps.append(np.abs(along - postures(course, root, times)).max())
        moved = float(np.abs(drift(done)).max())
        found = lie_brackets(law, course.robot, course.start)
        closed.append(moved)
        brackets.append(found.value / found.error)
        rows.append((f"(8), {course.words}", course.path.name, None, None, moved, found.value, found.error))
        series.append(Series(f"position, {course.words}", parts, np.abs(along - course.start).max(axis=-1), "line"))
    square, arm_3r = paths.load("square", 0.4), robots.load("planar_3r")
    first, *_ = courses(trial.full)
    counted = np.arange(1, cycles + 1)
    lines = [Series("(8), hand angle", counted, far(follow(with_alpha_zero(framework, first), arm_3r, square, F1, cycles=cycles,
                                                           samples=1)), "line")]  # fmt: skip
    seen, outside = [], []
    for name, (called, given, printed, decimals) in DRIFTS.items():
        law = plain(framework, name, arm_3r, **given)
        done = follow(law, arm_3r, square, F1, cycles=cycles, samples=1)
        moved = drift(done)[0]
        found = lie_brackets(law, arm_3r, F1)
        seen.append(np.abs(moved - printed).max() / half_unit(decimals))
        outside.append(found.value / found.error)
        rows.append(
            (called, "square", told(printed, 10), told(moved, 10), float(np.abs(moved).max()), found.value, found.error)
        )
        lines.append(Series(called, counted, far(done), "line", "other"))
    lost = []
    for base in BASES[: trial.of(3, 1)]:
        law = plain(framework, "damped_secondary", arm_3r, base=base, E=SUM)
        done = follow(law, arm_3r, square, F1, cycles=cycles, samples=1)
        moved, found = float(np.abs(drift(done)[0]).max()), lie_brackets(law, arm_3r, F1)
        lost.append(moved)
        rows.append((f"(8) beside W̃ = {base:g} I", "square", None, told(drift(done)[0]), moved, found.value, found.error))
        lines.append(Series(f"(8) beside W̃ = {base:g} I", counted, far(done), "line", "ours"))
    lines.append(Series("methods, first cycle", [1, 1], [max(np.abs(d[2])) for d in DRIFTS.values()], role="paper"))
    lines.append(Series("the integration's own error", [1, cycles], [CLOSED_CYCLE] * 2, "line", "bound"))
    checks = (
        at_most(r"joint angles on the way: integrated by (6), against the root of $x(q) = x(t)$, $g(q) = g(q_0)$ [rad]",
                gaps, CLOSED_CYCLE),
        at_most("drift of the joints over a closed path [rad]", closed, CLOSED_CYCLE),
        at_most("second look: Lie brackets outside range $G$ / error of their differences", brackets, 1.0),
        at_most("pseudoinverse and inertia drift by the numbers of methods: difference / half a unit of the last digit",
                seen, 1.0, role=Role.OURS),
        at_least("and their Lie brackets lie outside range $G$: size / error", outside, 1.0, role=Role.OURS),
        at_least(r"with a base $\tilde W$ beside (8) the joints drift [rad]", lost, CLOSED_CYCLE, role=Role.OURS),
    )  # fmt: skip
    plots = (
        Plot("Planar 3R, the hand around a square of 0.4 m from F1: how far the joints are from where they began",
             Axis("cycles"), Axis("largest joint displacement after the cycle [rad]", log=True), tuple(lines)),
        Plot("(8) with alpha = 0 along one cycle: the joints move, and come back", Axis("share of the cycle"),
             Axis("largest joint displacement [rad]"), tuple(series)),
    )  # fmt: skip
    table = Table(
        r"One closed path: drift, and Lie brackets of the law, $|(I - GJ)[G_i, G_j]|$ relative",
        ("law", "path", "methods, drift [rad]", "ours, drift [rad]", "largest drift [rad]", "bracket", "its error"),
        tuple(rows), paper=("methods, drift [rad]",),
    )  # fmt: skip
    return Evidence(checks, (*plots, table))


def far(motion: Motion) -> Array:
    """Largest displacement (cycles,) [rad, m] of a joint from where it began, after each cycle; rounding at least."""
    return np.maximum(np.abs(motion.postures[1:] - motion.postures[0]).max(axis=-1), np.finfo(float).eps)


CLAIMS = (
    Claim(
        name="augmented_jacobian",
        title="The augmented Jacobian technique is the framework with (8)–(10)",
        place="Section III, eqs. (8)–(10)",
        says=r"With $W$ of (8), $f$ of (9) and $\alpha = -1$, eq. (6) gives the joint rates of the augmented Jacobian "
        "technique.",
        formula=r"W = \sum_{i=1}^{n-m} \gamma_i \nabla g_i (\nabla g_i)^T, \quad f = \sum_{i=1}^{n-m} \gamma_i \bar g_i g_i, "
        r"\quad \alpha = -1",
        tested=r"Random gradients $E$, rates $\bar g$ and $\gamma$ on five arms with one, two and four degrees of redundancy; "
        r"four cases worked out by hand; and $\alpha = +1$.",
        accepted=r"(6) and $[J; E]\,\dot q = [\dot x; \bar g]$ differ by no more than the sum of their error bounds; with "
        r"$\alpha = +1$ the functions get $-\bar g$.",
        paths=(
            CodePath(r"(8)–(10) in eq. (6), $W$ kept factored", rates),
            CodePath(r"$[J; E]\,\dot q = [\dot x; \bar g]$ as it stands, numpy", original),
        ),
        examine=augmented_jacobian,
        fault=Fault(r"$\alpha = +1$ in (10)", turned_alpha),
        sources=("Egeland 1987", "Seraji 1989", "methods.md 4.1–4.3, M8, M11, M17"),
    ),
    Claim(
        name="any_positive_gamma",
        title="The scalars γ may be any positive numbers",
        place="Section III, eqs. (8)–(10)",
        says=r"The $\gamma_i$ of (8) and (9) are any positive scalars: they have no effect on the joint rates.",
        tested=r"(6) carried out on rationals with $\gamma_i$ over 200 decades, without any rounding, and in floats over 24; "
        r"then with two functions where $n - m = 1$, and beside a base $\tilde W$.",
        accepted=r"The rational answers are the same for all $\gamma$, and those of $[J; E]$.",
        paths=(
            CodePath("eq. (6) as the paper computes it, run on rationals", eq6_on),
            CodePath(r"$[J; E]\,\dot q = [\dot x; \bar g]$, or least squares weighted by $\gamma$, numpy", original),
        ),
        examine=any_positive_gamma,
        fault=Fault(r"$\gamma$ left out of (8), though not of (9)", gamma_in_one_place),
        sources=("methods.md 4.1, 4.3, 8.4",),
    ),
    Claim(
        name="frozen_rate",
        title="The desired derivatives ḡ in (9) are numbers, not functions to be differentiated",
        place="Section III, eq. (9)",
        says=r"$f = \sum \gamma_i \bar g_i g_i$, whose gradient enters (6), where $\bar g_i$ are the desired derivatives of "
        "$g_i$.",
        formula=r"\nabla f = \sum_{i=1}^{n-m} \gamma_i \bar g_i \nabla g_i",
        tested=r"$\bar g = k_p (g_{des} - g)$ frozen, and differentiated with $f$, while a constant is added to $g$ and "
        "$g_{des}$, which changes nothing that is asked; on the planar arm and Panda, with a linear and a nonlinear $g$.",
        accepted=r"With $\bar g$ frozen (6) follows the desired derivatives whatever the constant.",
        paths=(
            CodePath(r"(8)–(10) with $\bar g$ frozen, gradients by CasADi, in eq. (6)", cast_functions),
            CodePath(r"eq. (6) as printed, $\nabla f$ by complex steps, numpy", equations.augmented),
        ),
        examine=frozen_rate,
        fault=Fault(r"$\bar g$ differentiated: $k_p \gamma g \nabla g$ added", differentiated_rate),
        sources=("methods.md 8.3",),
    ),
    Claim(
        name="repeatable_with_alpha_zero",
        title="W of (8) with α = 0 inherits the repeatability of the augmented Jacobian",
        place="Section III, after eq. (10)",
        says=r"Using $W$ of (8) with $\alpha = 0$ gives an algorithm that inherits the repeatability of the corresponding "
        "augmented Jacobian form.",
        tested="The hand follows closed paths; the joints are integrated to $10^{-12}$, and compared on the way with the "
        r"posture in which $x(q)$ and $g(q)$ have the values they must have. Lie brackets of the law; the drift of laws that "
        "are not repeatable.",
        accepted=r"The joints come back to within the integration's error, $10^{-10}$ rad a cycle, and all brackets lie in "
        "range $G$.",
        paths=(
            CodePath(r"eq. (6) with $W$ of (8) and $\alpha = 0$, integrated", rates),
            CodePath(r"the root of $x(q) = x(t)$, $g(q) = g(q_0)$, nothing integrated", optimize.root, "scipy.optimize:root"),
        ),
        examine=repeatable_with_alpha_zero,
        fault=Fault(r"a regularisation $0.01\,I$ left in $W$", base_left_in),
        sources=("Roberts, Maciejewski 1993", "Shamir, Yomdin 1988", "methods.md, Repeatability"),
    ),
)
