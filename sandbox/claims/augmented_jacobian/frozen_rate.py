"""The desired derivatives of (9), frozen or differentiated."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from problems import robots
from problems.measures.measure import Measure, symbolic
from problems.methods.augmented_jacobian import cast_functions
from problems.methods.draw import HEALTHY, generic
from problems.robots.twin import Symbol, Twin
from problems.weightings.augmented import clear
from sandbox.agreement import bounds
from sandbox.claims import equations
from sandbox.claims.augmented_jacobian.method import AUGMENTED, allowance
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_most
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.numbers import SUBSCRIPTS, told
from sandbox.claims.postures import F1, HAND_ANGLE
from sandbox.closed_form import CLOSED_FORMS
from sandbox.problem import VelocityProblem

Array = np.ndarray

Law = Callable[[Array, Array], Array]

GAIN, WANTED = 2.0, 0.3
"""k_p [1/s] and g_des [rad]; a constant c is added to g and g_des both."""


def _shifted_angle(twin: Twin, shift: Symbol) -> Symbol:
    return ca.sum1(twin.q) + shift


def _shifted_curved(twin: Twin, shift: Symbol) -> Symbol:
    return ca.sum1(twin.q) + ca.sumsqr(twin.q) / 2 + shift


def shifted(expression: Any, shift: float) -> Measure:
    """The function g + c as a measure."""
    return symbolic("function", "rad", "a secondary function", "", expression, parameters=[np.array([shift])])


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
    agreed, followed, frozen_moves, literal_moves = [], [], [], []
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
            followed.append(np.abs(np.einsum("bn,bn->b", E, x) - rate) / (np.linalg.norm(E, axis=-1) * allowed))
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
    exact = allowance(arm_3r, *there, expected[1:], E=HAND_ANGLE, gbar=np.array([GAIN * WANTED]))[0]
    range_ = (
        r"Read $\nabla f = \sum \gamma_i \bar g_i \nabla g_i$ with each $\bar g_i$ held at its value of this instant; "
        r"footnote 2 "
        r"allows any vector in place of $\nabla f$. It matters only where $\bar g_i$ is computed from $q$, as in a closed "
        r"loop. "
        rf"With $\bar g = k_p (g_{{des}} - g)$ differentiated too, a constant from ${constants[0]:g}$ to "
        rf"${constants[-1]:g}$ added to $g$ and $g_{{des}}$ moves the joint rates by {smallest:.3g} to {largest:.3g} rad/s."
    )
    moves = np.concatenate(literal_moves)
    checks = (
        at_most(r"(6) with $\bar g$ frozen, by CasADi, against (6) as printed: difference / bound",
                np.concatenate(agreed), 1.0),
        at_most(r"(6) with $\bar g$ frozen: $|\nabla g^T \dot q - \bar g|$ / bound", np.concatenate(followed), 1.0),
        Check(r"to the letter, $\bar g$ a function of $q$: joint rates from $\nabla \sum \gamma_i \bar g_i(q)\, g_i(q)$ do not "
              "depend on a constant added to $g$ and $g_{des}$", bool((moves == 0).all()), f"they move by {smallest:.3g} "
              f"to {largest:.3g} rad/s",
              "0 rad/s", moves.size, Role.PRINTED, range_),
        at_most(r"$\bar g$ frozen: what a constant moves / twice the bound", np.concatenate(frozen_moves), 1.0, role=Role.OURS),
        at_most("rates by hand, frozen with $c = 0$ and $1$ and differentiated with $c = 1$: difference / bound",
                [np.abs(zero - expected[0]).max() / exact, np.abs(one - expected[0]).max() / exact,
                 np.abs(differentiated[1] - expected[1]).max() / exact], 1.0, role=Role.OURS),
    )  # fmt: skip
    plot = Plot(
        "q = (0, π/2, −π/2), ẋ = (1, 1) m/s, g = q₁ + q₂ + q₃ + c, g_des = 0.3 + c, k_p = 2/s: joint rates over a "
        "constant that changes "
        "nothing "
        "of what is asked",
        Axis("c, added to g and to g_des [rad]"), Axis("joint rate [rad/s]"),
        (
            *(Series(f"q̇{SUBSCRIPTS[i]}, frozen", constants, lines["frozen"][i], "line") for i in range(3)),
            *(Series(f"q̇{SUBSCRIPTS[i]}, differentiated", constants, lines["literal"][i], "line", "other") for i in range(3)),
        ),
    )  # fmt: skip
    table = Table(
        r"$q = (0, \pi/2, -\pi/2)$, $\dot x = (1, 1)$, $g = q_1 + q_2 + q_3 + c$, $g_{des} = 0.3 + c$, $k_p = 2$/s",
        (r"$\bar g$", "$c$", "by hand [rad/s]", "ours [rad/s]"),
        (
            ("frozen", 0, told(expected[0]), told(zero)), ("frozen", 1, told(expected[0]), told(one)),
            ("differentiated", 0, told(expected[0]), told(differentiated[0])),
            ("differentiated", 1, told(expected[1]), told(differentiated[1])),
        ),
    )  # fmt: skip
    return Evidence(checks, (plot, table))


CLAIM = Claim(
    name="frozen_rate",
    title="The desired derivatives ḡ in (9) are numbers, not functions to be differentiated",
    place="Section III, eq. (9)",
    says=r"$f = \sum \gamma_i \bar g_i g_i$, whose gradient enters (6), where $\bar g_i$ are the desired derivatives of "
    "$g_i$.",
    formula=r"\nabla f = \sum_{i=1}^{n-m} \gamma_i \bar g_i \nabla g_i",
    tested=r"$\bar g = k_p (g_{des} - g)$ frozen, and differentiated with $f$, while a constant is added to $g$ and "
    "$g_{des}$, which changes nothing that is asked; on the planar arm and Panda, with a linear and a nonlinear $g$.",
    accepted=r"With $\bar g$ frozen (6) gives $\nabla g^T \dot q = \bar g$, whatever the constant.",
    paths=(
        CodePath(r"(8)–(10) with $\bar g$ frozen, gradients by CasADi, in eq. (6)", cast_functions),
        CodePath(r"eq. (6) as printed, $\nabla f$ by complex steps, numpy", equations.augmented),
    ),
    examine=frozen_rate,
    fault=Fault(r"$\bar g$ differentiated: $k_p \gamma g \nabla g$ added", differentiated_rate),
    sources=(*AUGMENTED.works,),
)
