"""Time scaling into singularities."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from problems import robots
from problems.methods import METHODS
from problems.original import time_scaling as scaled_original
from problems.robots.robot import Robot
from sandbox.agreement import bounds
from sandbox.claims.arms import ARMS
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_most
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.power import fitted
from sandbox.claims.singularities.approach import BENT, CLOSE, NAMES, SPEED, TURN, approach, norms, singular_values, stretching
from sandbox.closed_form.eq6 import eq6
from sandbox.law import rates
from sandbox.problem import VelocityProblem
from sandbox.tolerances import EXPONENT, FORWARD, ORIGINAL, UNIT

Array = np.ndarray

SCALED_BY_HAND = (
    ("no self-motion", 0.0, 0.6, (0.2, -0.8, 1.0)),
    ("self-motion 0.3 (−1, 1, 1)", 0.3, 0.42, (-0.16, -0.26, 1.0)),
)
"""Name, self-motion, s and rates, worked by hand: xdot = (1, 1), limits 1 rad/s."""


def time_scaling_at_singularities(trial: Trial, scaled: Answer, original: Answer) -> Evidence:
    """Time scaling on lines into singularities and through the full stretch, against its original by bisection."""
    rng = trial.rng("time_scaling_at_singularities")
    method = METHODS["time_scaling"]
    t = np.geomspace(1.5, 1e-6, trial.of(50, 16))
    agree, load, straight, exponents, speeds, factors, rows = [], [], [], [], [], [], []
    ways = [("planar 3R, full stretch", stretching(TURN))]
    ways += [(f"{ARMS[name]}, line {i + 1}", approach(robots.load(name), rng))
             for name in (NAMES if trial.full else ("panda",)) for i in range(trial.of(3, 1))]  # fmt: skip
    for name, one in ways:
        robot, q = one.robot, one.q(t)
        problem = one.problem(t)
        x = scaled(method, robot, q, problem.xdot, alpha=0.0)
        other = original(robot, q, problem.xdot, alpha=0.0)
        agree.append(np.abs(x - other).max(axis=1) / sum(bounds(method, problem, x, {})))
        load.append((np.abs(x) / robot.rate_limits).max(axis=1))
        achieved = (problem.J @ x[:, :, None])[:, :, 0]
        s = (achieved @ one.xdot) / SPEED**2
        sigma = singular_values(problem.J)[1]
        rounding = FORWARD * robot.n * UNIT * sigma[:, 0] * norms(x)
        straight.append(norms(achieved - s[:, None] * one.xdot) / rounding)
        near = t <= CLOSE
        exponents.append(fitted(sigma[near, -1], s[near]))
        speeds.append(s[-1])
        full = t[s >= 1 - CLOSE]
        begins = float(sigma[t == full.min(), -1][0]) if len(full) else None
        rows.append((name, round(exponents[-1], 3), begins, float(s[-1]), float(load[-1].max())))
        if name.endswith(("stretch", " 1")):
            factors.append(Series(name, sigma[:, -1], s, "line"))
    numbers, table_rows = _scaled_by_hand(scaled, original)
    drawn = _scaled_draws(trial, scaled, original, rng)
    arrival, times = _time_to_stretch(scaled)
    checks = (
        at_most("time scaling in the framework and its original by bisection: difference / sum of bounds",
                np.concatenate(agree), 1.0),
        at_most("the same with a self-motion that takes its part of the limits, at generic configurations", drawn, 1.0),
        at_most("largest rate / limit, all the way to the singularity", np.concatenate(load), 1 + FORWARD * UNIT),
        at_most(r"the hand keeps its path: part of $J\dot q$ across $\dot x$ / rounding", np.concatenate(straight), 1.0),
        at_most(r"its speed goes to zero as $\sigma_{\min}$: size of exponent − 1", np.abs(np.array(exponents) - 1), EXPONENT),
        at_most("speed factor $10^{-6}$ rad from the singularity", speeds, CLOSE),
        *numbers, *arrival,
    )  # fmt: skip
    plots = (
        Plot("Speed factor $s$ of time scaling on straight lines into singularities, hand speed 0.25 (m/s, rad/s)",
             Axis("smallest singular value of $J$", log=True), Axis("$s$, share of the speed asked for", log=True),
             tuple(factors)),
        times,
    )  # fmt: skip
    columns = ("way", "exponent of $s$", r"$\sigma_{\min}$ where scaling begins", "$s$ at the end", "largest rate / limit")
    table = Table("Time scaling into singularities; below, two examples worked by hand (planar 3R bent, limits 1 rad/s)",
                  (*columns, "by hand"), tuple((*row, None) for row in rows) + table_rows)  # fmt: skip
    return Evidence(checks, (*plots, table))


def _scaled_draws(trial: Trial, scaled: Answer, original: Answer, rng: np.random.Generator) -> Array:
    """Difference over bounds in the situations that the method draws for itself."""
    method, ratios = METHODS["time_scaling"], []
    for name in NAMES if trial.full else NAMES[:1]:
        robot = robots.load(name)
        drawn = method.draw(robot, rng, trial.of(60, 12))
        x = scaled(method, robot, drawn.q, drawn.xdot, **drawn.parameters)
        other = original(robot, drawn.q, drawn.xdot, **drawn.parameters)
        problem = method.cast(robot, drawn.q, drawn.xdot, **drawn.parameters)
        ratios.append(np.abs(x - other).max(axis=1) / sum(bounds(method, problem, x, drawn.parameters)))
    return np.concatenate(ratios)


def _scaled_by_hand(scaled: Answer, original: Answer) -> tuple[list[Check], tuple[tuple[str | float | int | None, ...], ...]]:
    robot = robots.load("planar_3r")
    q, xdot, null = np.array([BENT]), np.ones((1, 2)), np.array([-1.0, 1.0, 1.0])
    J = robot.jacobian(q)[0]
    off, rows = [], []
    for name, own, s, hand in SCALED_BY_HAND:
        parameters = {"alpha": 0.5, "posture": q[0] + 2 * own * null, "rate_limits": np.ones(3)}  # -alpha (q - posture)
        found = [scaled(METHODS["time_scaling"], robot, q, xdot, **parameters)[0], original(robot, q, xdot, **parameters)[0]]
        off.append(np.abs(np.stack(found) - hand).max())
        factor = float((J @ found[0]).mean())
        off.append(abs(factor - s))
        rows.append((f"by hand: {name}", None, None, factor, float(np.abs(found[0]).max()), s))
    check = at_most("worked by hand: s = 0.6 and 0.42, and the rates, both paths", off, ORIGINAL * 3 * UNIT, role=Role.OURS)
    return [check], tuple(rows)


def _time_to_stretch(scaled: Answer) -> tuple[list[Check], Plot]:
    """How long the hand takes to the full stretch: its speed falls as the root of the distance, so it arrives.

    With the hand 2 (1 - cos t) from the stretch, dT = 2 sin t / (SPEED s) dt, and s falls as sin t.
    """
    one = stretching(TURN)
    t = np.linspace(0.15, 0.0, 400, endpoint=False)
    q = one.q(t)
    x = scaled(METHODS["time_scaling"], one.robot, q, np.broadcast_to(one.xdot, (len(t), 2)), alpha=0.0)
    s = ((one.robot.jacobian(q) @ x[:, :, None])[:, :, 0] @ one.xdot) / SPEED**2
    integrand = 2 * np.sin(t) / (SPEED * s)
    elapsed = np.concatenate([[0.0], np.cumsum((integrand[1:] + integrand[:-1]) / 2 * -np.diff(t))])
    left = 2 * (1 - np.cos(t))
    asked = (left[0] - left) / SPEED
    # in the last stretch of t the rates are at their limits, and t runs down at a constant rate
    last = np.array([a - b for b, a in pairwise(elapsed[-20:])])
    check = at_most("the hand comes to the full stretch in finite time, joints at their limits: spread of their speed there",
                    last.max() / last.min() - 1, CLOSE, role=Role.OURS)  # fmt: skip
    plot = Plot(
        f"The hand on the last {1000 * left[0]:.0f} mm to the full stretch: {elapsed[-1]:.3f} s instead of {asked[-1]:.3f} s",
        Axis("time [s]"), Axis("distance of the hand from the full stretch [mm]"),
        (Series("time scaling, rates within 2 rad/s", elapsed, 1000 * left, "line"),
         Series("asked for, 0.25 m/s", asked, 1000 * left, "line", "bound")),
    )  # fmt: skip
    return [check], plot


def clipped(scaled: Answer) -> Answer:
    """Every joint clipped at its own limit, in the place of one factor for all."""

    def planted(method: object, robot: Robot, q: Array, xdot: Array, **parameters: object) -> Array:
        x = equation_six(robot, q, xdot)
        limits = parameters.get("rate_limits", robot.rate_limits)
        return np.clip(x, -np.asarray(limits), np.asarray(limits))

    return planted


def equation_six(robot: Robot, q: Array, xdot: Array) -> Array:
    """Eq. (6) with W = I, alpha = 0."""
    return np.asarray(eq6(VelocityProblem(J=robot.jacobian(q), xdot=xdot, W=np.eye(robot.n))).x)


CLAIM = Claim(
    name="time_scaling_at_singularities",
    title="Time scaling keeps the path and gives up the speed",
    place="Section VI, last sentence",
    says=r"Time scaling is a method that does not give the desired $\dot x$ near a singularity.",
    formula=r"\dot q = s J^+ \dot x, \quad s = \min\left(1, \min_i \frac{\ell_i}{|(J^+ \dot x)_i|}\right)",
    tested="Straight lines into singularities of three arms; situations with a self-motion; two examples worked by hand; "
    "the time that the hand takes to the full stretch.",
    accepted=r"Rates stay within the limits $\ell_i$ of the joints, the hand on its path, and its speed falls to zero as "
    r"$\sigma_{\min}$.",
    paths=(
        CodePath("time scaling on the rates of the framework", rates),
        CodePath("its original: pseudoinverse, and the factor by bisection", scaled_original.original),
    ),
    examine=time_scaling_at_singularities,
    fault=Fault("every joint clipped at its own limit", clipped),
)
