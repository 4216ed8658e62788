"""Eq. (11) against the extremum itself, for one degree of redundancy and for more."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from problems import robots
from problems.measures.manipulability import volume
from problems.methods import extended_jacobian as cast_of
from problems.robots.robot import Robot
from problems.weightings.extended import extremum as condition_of
from problems.weightings.impedance import elastic
from sandbox.agreement import bounds
from sandbox.claims import constrained
from sandbox.claims.claim import Answer, Claim, Evidence, Fault, Trial, at_most
from sandbox.claims.constrained import PLANAR, Arm, Springs, cross
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.extended_jacobian.extrema import (
    EXTREMUM,
    FRAMEWORK,
    REST,
    ROW,
    SOURCES,
    TASK,
    extrema,
    kinds,
    springs_of,
    torsion_share,
    turned_torsion,
    with_cast,
)
from sandbox.claims.numbers import told
from sandbox.claims.postures import F1
from sandbox.method import Draw
from sandbox.tolerances import (
    ORIGINAL,
    UNIT,
)  # fmt: skip

Array = np.ndarray

OF_A_FUNCTION = replace(ROW, cast=cast_of.cast_function)
"""The same for any measure g."""


def arm_of(robot: Robot) -> Arm:
    """The robot as the other side knows it: a planar arm written out, or pinocchio's hand and Jacobian of its position."""
    return PLANAR if robot.name.startswith("planar") else Arm(lambda q: robot.forward(q)[0], robot.jacobian)


def basis_frozen(framework: Answer) -> Answer:
    """The derivative of Nbar left out."""
    return with_cast(turned_torsion(0.0))(framework)


def multipliers_turned(framework: Answer) -> Answer:
    """The multipliers of the wrong sign."""
    return with_cast(turned_torsion(-1.0))(framework)


def followed_by_both(robot: Robot, drawn: Draw, framework: Answer, followed: Answer) -> tuple[Array, Array, Array]:
    """Largest differences (B,) [rad/s] of the rates, what bounds and differences allow, and |qdot|."""
    q, xdot, parameters = drawn
    x = framework(ROW, robot, q, xdot, **parameters)
    allowed = bounds(ROW, ROW.cast(robot, q, xdot, **parameters), x, parameters)[0]
    arm = arm_of(robot)
    other = [followed(arm, springs_of(parameters, i).gradient, q[i], xdot[i]) for i in range(len(q))]
    difference = np.abs(x - np.array([rate for rate, _ in other])).max(axis=-1)
    return difference, allowed + np.array([error for _, error in other]), np.abs(x).max(axis=-1)


def volume_gradient(q: Array) -> Array:
    """Grad w (3,) of the planar arm, w = sqrt(det JJ'), by complex steps."""

    def w(q: Array) -> Array:
        J = constrained.tip_jacobian(q)
        return np.sqrt(np.linalg.det(J @ J.T))

    return constrained.slope(w, q)


def of_springs(xdot: Array) -> Array:
    """E1: qdot (3,) at F1."""
    return np.array([0.0, -xdot[0], xdot[0] + xdot[1]])


def of_volume(xdot: Array) -> Array:
    """E2."""
    return np.array([[-0.2, 0.4], [-0.8, -0.4], [1.2, 0.6]]) @ xdot


def one_degree(trial: Trial, framework: Answer, followed: Answer) -> Evidence:
    """Eq. (11) with n - m = 1 against the extremum itself, moved along with the hand."""
    robot = robots.load("planar_3r")
    drawn = extrema(robot, trial.rng("extended_jacobian"), trial.of(150, 10))
    difference, allowed, _ = followed_by_both(robot, drawn, framework, followed)
    checks = [
        at_most("joint rates against those of the extremum of springs: difference / (bound + error)", difference / allowed, 1.0)
    ]

    tasks = np.array([[1.0, 0.0], [0.0, 1.0], TASK, [-1.0, 2.0]])
    at = np.tile(F1, (len(tasks), 1))
    elastic_energy = Springs(np.ones(3), REST)
    hand: list[tuple[str, Array, Array, Array]] = []
    for words, expected, gradient, method, given in (
        ("$g = |q - q_0|^2/2$", of_springs, elastic_energy.gradient, ROW, {"rest": REST}),
        ("$g = w$", of_volume, volume_gradient, OF_A_FUNCTION, {"function": volume()}),
    ):
        x = framework(method, robot, at, tasks, **given)
        problem = method.cast(robot, at, tasks, **given)
        bound = bounds(method, problem, x, given)[0]
        ratios = []
        for i, xdot in enumerate(tasks):
            rate, error = followed(PLANAR, gradient, F1, xdot)
            hand.append((f"{words}, ẋ = {told(xdot)} m/s", expected(xdot), x[i], rate))
            ratios += [np.abs(x[i] - expected(xdot)).max() / bound[i], np.abs(x[i] - rate).max() / (bound[i] + error)]
        checks.append(
            at_most(f"{words}: rates against those by hand, and against the extremum's: difference / bound", ratios, 1.0)
        )

    q, _, parameters = drawn
    W = ROW.cast(robot, *drawn[:2], **parameters).W.dense()
    rows = [constrained.slope(_condition(springs_of(parameters, i)), q[i]) for i in range(len(q))]
    size = np.linalg.norm([cross(one)[:, 0] for one in q], axis=-1)
    outer = np.einsum("bi,bj->bij", rows, rows) / size[:, None, None] ** 2
    gap = np.linalg.norm(W - outer, axis=(1, 2)) / np.linalg.norm(W, axis=(1, 2))
    rounding = ORIGINAL * robot.n * UNIT * np.linalg.cond(robot.jacobian(q)) * torsion_share(robot, drawn)
    words = r"$H^T H$ against $\nabla(\bar n^T \nabla g)(\nabla(\bar n^T \nabla g))^T$, $|\bar n| = 1$: difference / rounding"
    checks.append(at_most(words, gap / rounding, 1.0))

    table = Table(
        "Planar 3R at q = (0, π/2, −π/2): joint rates [rad/s] worked out by hand, by eq. (6), and by following the extremum",
        ("case", "by hand", "eq. (6) with (11)–(12)", "extremum followed"),
        tuple((words, told(expected), told(x, 7), told(np.round(rate, 8), 7)) for words, expected, x, rate in hand),
    )
    return Evidence(tuple(checks), (_steps(trial, robot, drawn, framework), table))


def _condition(g: Springs) -> Callable[[Array], Array]:
    """The function n'grad g, n the cross product of the rows of J."""
    return lambda q: cross(q)[:, 0] @ g.gradient(q)


def _steps(trial: Trial, robot: Robot, drawn: Draw, framework: Answer) -> Plot:
    """The rates against differences of the extremum, over the step."""
    steps = np.logspace(-5, -1, trial.of(41, 9))
    cases = [("tip at (2, 1)", F1, TASK, Springs(np.ones(3), REST), {"rest": REST})]
    for i in range(2):
        given = {"stiffness": drawn.parameters["stiffness"], "rest": drawn.parameters["rest"][i]}
        cases.append((f"drawn at random, {i + 1}", drawn.q[i], drawn.xdot[i], springs_of(drawn.parameters, i), given))
    series = []
    for name, q, xdot, g, given in cases:
        x = framework(ROW, robot, q[None], xdot[None], **given)[0]
        found = []
        for step in steps:
            try:
                found.append(np.abs(constrained.difference(PLANAR, g.gradient, q, xdot, step) - x).max() / np.abs(x).max())
            except ArithmeticError:
                found.append(np.nan)
        series.append(Series(name, steps, np.array(found)))
        if name == "tip at (2, 1)":
            rounded = [constrained.rounding(PLANAR, g.gradient, q, step) / np.abs(x).max() for step in steps]
            series.append(Series("bound on rounding, tip at (2, 1)", steps, rounded, "line", "bound"))
    scale = np.nanmax(series[0].y[-1:]) if np.isfinite(series[0].y[-1]) else 1.0
    far = steps[steps > 1e-3]
    series.append(Series("slope 4: truncation", far, scale * (far / far[-1]) ** 4, "line", "bound"))
    return Plot(
        "Relative difference between the rates of eq. (6) and the difference quotient of the constrained extremum: it falls "
        "with "
        "the fourth power of the step, as a derivative does, down to rounding",
        Axis("step, time at the velocity asked [s]", log=True), Axis("relative difference of the joint rates", log=True),
        tuple(series),
    )  # fmt: skip


def general_redundancy(trial: Trial, framework: Answer, followed: Answer) -> Evidence:
    """Eq. (11) with n - m >= 2: planar 4R, and seven joints asked for a position."""
    rng = trial.rng("extended_jacobian_general")
    checks, series, rows, limits = [], [], [], []
    for name, task, count in (
        ("planar_4r", None, trial.of(150, 8)),
        ("panda", "position", trial.of(60, 4)),
        ("seven_joint", "position", trial.of(60, 2)),
    ):  # fmt: skip
        robot = robots.load(name, task)
        drawn = extrema(robot, rng, count)
        difference, allowed, size = followed_by_both(robot, drawn, framework, followed)
        words = f"{name}, $n = {robot.n}$, $m = {robot.m}$: joint rates against the extremum's: difference / (bound + error)"
        checks.append(at_most(words, difference / allowed, 1.0))
        condition = condition_of(robot, drawn.q, elastic(robot, **drawn.parameters))
        low, high = kinds(robot, drawn).T
        hold = np.linalg.svd(condition.H @ condition.N, compute_uv=False)[:, -1] / np.linalg.norm(condition.H, 2, axis=(1, 2))
        series.append(Series(name, hold, difference / size))
        limits.append((hold, allowed / size))
        minima, maxima = int((low > 0).sum()), int((high < 0).sum())
        largest, share = float((difference / size).max()), float((difference / allowed).max())
        rows.append((name, robot.n, robot.m, minima, count - minima - maxima, maxima, largest, share))
    hold, limit = (np.concatenate(part) for part in zip(*limits, strict=True))
    plot = Plot(
        "Relative difference between eq. (6) and the extremum followed by root finding, over the distance from where the "
        r"extremum bifurcates ($N_J^T H^T$ singular, (7) fails)",
        Axis("smallest singular value of HN over |H|", log=True, low=0.03), Axis("relative difference of the joint "
        "rates", log=True),
        (*series, Series("bound of (6) and error of the difference", hold, limit, role="bound")),
    )  # fmt: skip
    table = Table(
        "Situations drawn, by the kind of extremum, and the largest differences",
        ("arm", "n", "m", "minima", "saddles", "maxima", "largest relative difference", "largest difference / (bound + error)"),
        tuple(rows),
    )
    return Evidence(tuple(checks), (plot, table))


EXTENDED_JACOBIAN = Claim(
    name="extended_jacobian",
    title="The extended Jacobian for one degree of redundancy",
    place="Section III, eqs. (11)–(12)",
    says=r"Baillieul's extended Jacobian, which keeps $g$ at an extremum, is (6) with $\alpha = 0$ and $W = H^T H$, "
    r"$H = \partial(\bar N_J^T \nabla g)/\partial q$; for "
    "one "
    r"degree of redundancy $W = \nabla(\bar n^T \nabla g)(\nabla(\bar n^T \nabla g))^T$.",
    formula=r"W = \left(\frac{\partial (\bar N_J^T \nabla g)}{\partial q}\right)^T \frac{\partial (\bar N_J^T \nabla "
    r"g)}{\partial q}"
    r",\qquad \alpha = 0",
    tested="Planar 3R at random extrema of spring energy, and at q = (0, π/2, −π/2) also for the manipulability $w$: the "
    "rates of (6) "
    "beside the "
    "derivative of the constrained extremum, which root finding follows as the hand moves; both forms of $W$ beside each "
    "other.",
    accepted="Differences within the bound of (6) and the error of the difference quotient; numbers by hand within the bound.",
    paths=(FRAMEWORK, EXTREMUM),
    examine=one_degree,
    fault=Fault(r"the derivative of $\bar N_J$ left out: $H = \bar N_J^T \nabla^2 g$", basis_frozen),
    sources=SOURCES,
)

EXTENDED_JACOBIAN_GENERAL = Claim(
    name="extended_jacobian_general",
    title="The extended Jacobian for general redundancy",
    place="Section III, eqs. (11)–(12)",
    says=r"Eq. (11) casts the extended Jacobian for any redundancy: $\bar N_J^T \nabla g$ then has $n - m$ entries.",
    tested="Planar 4R (two degrees of redundancy), and two spatial arms of seven joints asked for a position (four), at "
    "random minima, saddles and maxima of spring energy with the hand held.",
    accepted="The rates of (6) are those of the extremum followed by root finding, within bound and error.",
    paths=(FRAMEWORK, EXTREMUM),
    examine=general_redundancy,
    fault=Fault(r"the multipliers with the wrong sign, $H = N_J^T(\nabla^2 g + T)$", multipliers_turned),
    sources=SOURCES,
)
