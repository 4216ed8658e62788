"""The cast (8)-(10) in (6) against [J; E]."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from problems import robots
from problems.methods.draw import generic
from problems.original.augmented_jacobian import original
from sandbox.claims.augmented_jacobian.method import ARMS, AUGMENTED, allowance, arm, words
from sandbox.claims.claim import Answer, Claim, CodePath, Evidence, Fault, Role, Trial, at_most
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.numbers import told
from sandbox.claims.postures import F1, F2, HAND_ANGLE
from sandbox.law import rates

Array = np.ndarray

Law = Callable[[Array, Array], Array]


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
    """One function, moving and at rest, another one, and two functions."""
    (x, y), b1, b2 = (0.3, -0.7), 0.9, -0.4
    row = np.array([[1.0, 0, 0]])
    two = np.array([[1.0, 0, 0, 0], [1, 1, 1, 1]])
    return (
        Printed(r"F1, $g = q_1 + q_2 + q_3$", "planar_3r", F1, HAND_ANGLE, (x, y), (b1,), (y - b1, b1 - x - y, b1 + x),
                r"$(\dot y - \bar g,\ \bar g - \dot x - \dot y,\ \bar g + \dot x)$"),
        Printed(r"F1, $g = q_1 + q_2 + q_3$ at rest", "planar_3r", F1, HAND_ANGLE, (x, y), (0.0,), (y, -x - y, x),
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
        "their error bounds; and the difference with α = +1",
        Axis("cond [J; E]", log=True), Axis("relative difference of the joint rates", log=True),
        (*series, Series("α = +1", others, gap, role="other"), Series("sum of bounds", condition, bound, role="bound")),
    )  # fmt: skip
    table = Table(
        r"Unit-link planar arms at F1, $q = (0, \pi/2, -\pi/2)$, and F2, $q = (0, \pi/2, -\pi/2, \pi/2)$: cases worked out by "
        "hand, beside (6)",
        ("case", r"$\dot x$ [m/s]", r"$\bar g$ [rad/s]", r"$\dot q$ by hand", "by hand [rad/s]", "ours [rad/s]"), tuple(rows),
    )  # fmt: skip
    return Evidence(tuple(checks), (plot, table))


CLAIM = Claim(
    name="augmented_jacobian",
    title="The augmented Jacobian technique is the framework with (8)–(10)",
    place="Section III, eqs. (8)–(10)",
    says=r"With $W$ of (8), $f$ of (9) and $\alpha = -1$, eq. (6) gives the joint rates of the augmented Jacobian "
    "technique.",
    formula=r"W = \sum_{i=1}^{n-m} \gamma_i \nabla g_i (\nabla g_i)^T, \quad f = \sum_{i=1}^{n-m} \gamma_i \bar g_i g_i, "
    r"\quad \alpha = -1",
    tested=r"Random gradients (the rows of $E$), rates $\bar g$ and $\gamma$ on four arms and five tasks, with one, two "
    r"and four "
    r"degrees of redundancy; four cases worked out by hand; and $\alpha = +1$ instead of $-1$.",
    accepted=r"Eq. (6) and $[J; E]\,\dot q = [\dot x; \bar g]$ differ by no more than the sum of their error bounds; with "
    r"$\alpha = +1$ the functions get $-\bar g$.",
    paths=(
        CodePath(r"(8)–(10) in eq. (6), $W$ kept factored", rates),
        CodePath(r"$[J; E]\,\dot q = [\dot x; \bar g]$ as it stands, numpy", original),
    ),
    examine=augmented_jacobian,
    fault=Fault(r"$\alpha = +1$ in (10)", turned_alpha),
    sources=(*AUGMENTED.works,),
)
