"""Task errors of a controller near algorithmic singularities."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from problems import paths, robots
from problems.original import damped_secondary
from sandbox.agreement import bounds
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_most
from sandbox.claims.damping.law import AUGMENTED, DAMPED, law
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.postures import F1, HAND_ANGLE
from sandbox.law import rates
from sandbox.motion import follow
from sandbox.tolerances import CLOSED_CYCLE, REDUCED_ERROR

Array = np.ndarray

LIMIT = 2.0
"""Largest joint rate [rad/s]: that of the planar arms."""


FEEDBACK = 5.0
"""Gain of the task [1/s]."""


class Example(NamedTuple):
    """A path that meets, or passes near, an algorithmic singularity, and whether joint rates are limited."""

    words: str
    path: Any
    start: Array
    limit: float


def examples() -> tuple[Example, ...]:
    """Through the outer singularity, with and without rate limits; and past the inner one at 0.1 m."""
    through = paths.load("through_algorithmic_singularity", 0.7, duration=1.5)
    past = paths.load("straight", 1.2, duration=1.5, direction=(1.0, 0.0, 0.0))
    return (
        Example("past it, rates limited", past, folded(-0.6, 0.1), LIMIT),
        Example("through it, rates limited", through, F1, LIMIT),
        Example("through it, no limits", through, F1, np.inf),
    )


def folded(x: float, y: float) -> Array:
    """Joint angles of the planar arm whose wrist is at (x, y) [m] and whose hand points along x."""
    square = x * x + y * y
    elbow = np.arccos((square - 2) / 2)
    first = np.arctan2(y, x) - np.arctan2(np.sin(elbow), 1 + np.cos(elbow))
    return np.array([first, elbow, -first - elbow])


def base_forgotten(framework: Answer) -> Answer:
    """W~ left out."""

    def planted(method: Any, robot: Any, q: Array, xdot: Array, **parameters: Any) -> Array:
        parameters.pop("base", None)
        return framework(AUGMENTED, robot, q, xdot, **parameters)

    return planted


class Run(NamedTuple):
    """A controller's run of T steps with B weights at once: t (T,); q, rates (T, B, n), xdot (T, B, m), error (T, B) [m]."""

    t: Array
    q: Array
    rates: Array
    xdot: Array
    error: Array


def controlled(rule: Callable[[Array, Array], Array], robot: Any, example: Example, count: int, steps: int) -> Run:
    """Held rates, each cut to the limit by itself, as drives do; the task is fed back.

    rule : (q (B, n), xdot (B, m)) -> rates (B, n)
    """
    t = np.linspace(0.0, example.path.duration, steps + 1)
    rows = list(robot.rows)
    wanted = robot.forward(example.start)[0][rows] + example.path.displacement(t)[:, rows]
    along, q = np.diff(wanted, axis=0) / t[1], np.repeat(example.start[None], count, axis=0)
    kept: list[tuple[Array, ...]] = []
    for i in range(steps):
        gap = robot.forward(q)[0][:, rows] - wanted[i]
        xdot = along[i] - FEEDBACK * gap
        held = np.clip(rule(q, xdot), -example.limit, example.limit)
        kept.append((q, held, xdot, np.linalg.norm(gap, axis=-1)))
        q = q + t[1] * held
    return Run(t[:-1], *(np.array(part) for part in zip(*kept, strict=True)))


def damping_reduces_task_errors(trial: Trial, framework: Answer, solved: Answer) -> Evidence:
    """A controller with held joint rates, with and without rate limits, near algorithmic singularities: the hand's error."""
    robot, chosen = robots.load("planar_3r"), examples() if trial.full else examples()[1:2]
    sizes = (1e-4, 1e-3, 1e-2, 1e-1, 1.0) if trial.full else (1e-3, 1e-1)
    shown, steps = examples()[1], trial.of(300, 100)
    agreed, best, ratios, rows, curves, dots = [], [], [], [], [], []
    given = {"E": HAND_ANGLE, "base": np.array(sizes)[:, None, None] * np.eye(robot.n)}

    def undamped(q: Array, xdot: Array) -> Array:
        return np.asarray(framework(AUGMENTED, robot, q, xdot, E=HAND_ANGLE))

    def damped(q: Array, xdot: Array) -> Array:
        return np.asarray(framework(DAMPED, robot, q, xdot, **given))

    for example in chosen:
        alone = controlled(undamped, robot, example, 1, steps)
        several = controlled(damped, robot, example, len(sizes), steps)
        for i, base in enumerate(sizes):
            own = {"E": HAND_ANGLE, "base": base}
            q, xdot = several.q[:, i], several.xdot[:, i]
            free = solved(robot, q, xdot, **own)
            cut = np.clip(free, -example.limit, example.limit)
            allowed = sum(bounds(DAMPED, DAMPED.cast(robot, q, xdot, **own), free, own))
            agreed.append(np.abs(several.rates[:, i] - cut).max(axis=-1) / allowed)
        both = Run(alone.t, *(np.concatenate([a, b], axis=1) for a, b in zip(alone[1:], several[1:], strict=True)))
        error, turn = both.error.max(axis=0), np.abs(both.q.sum(axis=-1) - example.start.sum()).max(axis=0)
        fastest = np.abs(both.rates).max(axis=(0, 2))
        names = ["undamped", *(f"W̃ = {base:g} I" for base in sizes)]
        rows += [(example.words, *row) for row in zip(names, error.tolist(), fastest.tolist(), turn.tolist(), strict=True)]
        if example.words == shown.words:
            curves = [
                Series(name, both.t[1:], both.error[1:, i], "line", "ours" if i else "other") for i, name in enumerate(names)
            ]
        ratio = error[1:] / error[0]
        best.append(ratio.min())
        ratios.append(ratio)
        dots.append(Series(example.words, list(sizes), error[1:], "line"))
        dots.append(Series(f"{example.words}, undamped", [sizes[0], sizes[-1]], error[[0, 0]], "line", "other"))
    motions = [
        follow(law(framework, robot, base), robot, examples()[0].path, examples()[0].start, samples=20) for base in (0.0, 0.1)
    ]
    free_of_error = [float(np.linalg.norm(done.task_error, axis=-1).max()) for done in motions]
    checks = (
        at_most(r"largest task error with the best $\tilde W$ tried, over the undamped one, in each "
        r"example", best, REDUCED_ERROR),
        at_most("joint rates on the way against least squares in the self-motion, cut to the same limits: difference / bound",
                np.concatenate(agreed), 1.0),
        Check("beyond the paper's words, where joint rates are neither cut nor held: the damped error is below the "
        "undamped one",
              free_of_error[1] < free_of_error[0] - CLOSED_CYCLE, f"{free_of_error[1]:.1e} m against {free_of_error[0]:.1e} m",
              "smaller", len(free_of_error), Role.REACH, where(sizes, ratios, free_of_error)),
        at_most("where rates are neither cut nor held, the task error is the integration's, damped or not [m]", free_of_error,
                CLOSED_CYCLE, role=Role.OURS),
    )  # fmt: skip
    plots = (
        Plot(f"Planar 3R through the singularity with rates limited to {LIMIT:g} rad/s: the error of the hand under a "
        f"controller that "
             "holds its rates over a step", Axis("time [s]"),
             Axis("task error [m]", log=True), tuple(curves)),
        Plot("Largest task error over the size of W̃, past an algorithmic singularity and through one", Axis("ε, W̃ = ε "
        "I", log=True),
             Axis("largest task error [m]", log=True), tuple(dots)),
    )  # fmt: skip
    table = Table(
        "Largest task errors, joint rates and turns of the hand",
        ("example", r"$\tilde W$", "task error [m]", "largest rate [rad/s]", "turn of the hand [rad]"),
        tuple(rows),
    )
    return Evidence(checks, (*plots, table))


def where(sizes: tuple[float, ...], ratios: list[Array], free: list[float]) -> str:
    """Which errors damping reduced, and with which bases; and where there is none to reduce."""
    shares = np.array(ratios)
    good = [f"{base:g}" for base, share in zip(sizes, shares.T, strict=True) if (share <= 1).all()]
    return (
        "It holds for errors of the hand that come from joint rates cut to their limits, or held over a controller's step: "
        rf"$\tilde W = \epsilon I$ with $\epsilon$ = {', '.join(good) or 'none tried'} reduced them in every example, at "
        rf"best to "
        f"{shares.min():.2g} of the undamped error. Where rates are followed as they are, $J \\dot q = \\dot x$ keeps the hand "
        f"within {told_power(max(free))} m, damped or not, and there is nothing to reduce. The paper says no more than "
        f"that there "
        "are examples."
    )


def told_power(value: float) -> str:
    """Two digits and a power of ten, in TeX."""
    mantissa, exponent = f"{value:.1e}".split("e")
    return rf"${mantissa} \times 10^{{{int(exponent)}}}$"


CLAIM = Claim(
    name="damping_reduces_task_errors",
    title="Damping can reduce task errors",
    place="Section III, last paragraph",
    says="Examples of using this damping technique to reduce task errors are given in [27].",
    tested=r"What [27] is we do not know for certain, and its examples are not repeated. As $J \dot q = \dot x$ holds "
    r"damped or not, "
    "a task error must come from elsewhere: from joint rates cut to their limits, or held over a controller's step. Three "
    "examples "
    "of that kind, past or through an algorithmic singularity, are ours.",
    accepted=r"In every example some $\tilde W$ at least halves the largest error of the hand.",
    paths=(
        CodePath(r"eq. (6) with $W = \tilde W + \nabla g (\nabla g)^T$, rates cut and held", rates),
        CodePath("a particular solution and least squares in the self-motion, numpy", damped_secondary.original),
    ),
    examine=damping_reduces_task_errors,
    fault=Fault(r"$\tilde W$ left out", base_forgotten),
    sources=("H. Seraji, R. Colbaugh, J. Robotic Systems 7(6), 1990 (plausible for [27])",),
)
