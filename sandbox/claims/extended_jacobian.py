"""Section III, eqs. (11)-(12): Baillieul's extended Jacobian and its feedback."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from problems import robots
from problems.measures.manipulability import volume
from problems.measures.measure import Measure
from problems.methods import METHODS
from problems.methods import extended_jacobian as cast_of
from problems.methods.draw import gathered, generic
from problems.paths.curves import circle
from problems.robots.robot import Robot
from problems.weightings.extended import extended
from problems.weightings.extended import extremum as condition_of
from problems.weightings.impedance import elastic
from sandbox.agreement import bounds
from sandbox.claims import constrained, equations
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_least, at_most, every
from sandbox.claims.constrained import PLANAR, Arm, Springs, cross
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.closed_form import CLOSED_FORMS
from sandbox.law import rates
from sandbox.method import Draw, Method
from sandbox.motion import follow
from sandbox.problem import VelocityProblem
from sandbox.tolerances import (
    CLOSED_CYCLE,
    INTEGRATION,
    LINEAR_SIZE,
    LINEARISED,
    ORIGINAL,
    OTHER_MOTION,
    SAME_MOTION,
    UNIT,
)  # fmt: skip
from sandbox.weight import Weight

Array = np.ndarray

ROW = METHODS["extended_jacobian"]
FEEDBACK = METHODS["extremum_feedback"]
OF_A_FUNCTION = replace(ROW, cast=cast_of.cast_function)
"""The same for any measure g."""

QUARTER = np.pi / 2
F1 = np.array([0.0, QUARTER, -QUARTER])
"""Planar 3R with its tip at (2, 1) (methods 0)."""

REST = np.array([1.0, QUARTER, 1.0 - QUARTER])
"""For which F1 is the minimum of 1/2 |q - rest|^2 with the hand held, lam = (-1, -1) (methods 5.6)."""

TOP = F1 - 2.0 * np.array([1.0, 1.0, 0.0])
"""For which F1 is a maximum: lam = (-2, 0), rest = q - J'lam, and (-1, -1, 0) is the first row of J."""

OFF = np.array([0.2, 1.1, -0.6])
"""No extremum for REST (methods 5.2)."""

PRINTED_OFF = ((-0.4637, 0.4623, -0.3190), (-0.4901, 0.4663, -0.2549), (-0.4490, 0.4601, -0.3547), (-0.4868, 0.4657, -0.2631))
"""Rates at OFF for xdot = (.3, -.7) under the four scalings (methods 5.2)."""

PRINTED_DIGIT = 1e-4
"""The last digit of these."""

TASK = np.array([0.3, -0.7])

MOST_LINES = 200
"""Lines through joint space looked at for a sign flip."""

STRONGEST = 16.0
"""Multipliers of drawn extrema, times |J| [Nm/rad]: the curvature of the task then often outdoes that of the springs."""


def written(values: Any, digits: int = 4) -> str:
    """A vector in words."""
    return "(" + ", ".join(f"{value:.{digits}g}" for value in np.where(np.abs(values) < 1e-12, 0.0, values)) + ")"


def arm_of(robot: Robot) -> Arm:
    """The robot as the other side knows it: a planar arm written out, or pinocchio's hand and Jacobian of its position."""
    return PLANAR if robot.name.startswith("planar") else Arm(lambda q: robot.forward(q)[0], robot.jacobian)


def with_cast(cast: Callable[..., VelocityProblem]) -> Callable[[Answer], Answer]:
    """A planted fault: the framework handed another cast of the same method."""

    def plant(framework: Answer) -> Answer:
        def planted(method: Method, robot: Robot, q: Array, xdot: Array, **parameters: Any) -> Array:
            return framework(replace(method, cast=cast), robot, q, xdot, **parameters)

        return planted

    return plant


def turned_torsion(factor: float) -> Callable[..., VelocityProblem]:
    """The cast of M12 with factor T for T, T_ij = sum_k lam_k dJ_ki/dq_j."""

    def cast(
        robot: Robot, q: Array, xdot: Array, *,
        stiffness: Any = 1.0, rest: Any = None, tolerance: float = np.inf, function: Measure | None = None,
    ) -> VelocityProblem:  # fmt: skip
        condition = condition_of(robot, q, elastic(robot, stiffness, rest) if function is None else function)
        changed = replace(condition, T=factor * condition.T)
        return VelocityProblem(J=condition.J, xdot=xdot, W=extended(changed))

    return cast


def basis_frozen(framework: Answer) -> Answer:
    """The derivative of Nbar left out."""
    return with_cast(turned_torsion(0.0))(framework)


def multipliers_turned(framework: Answer) -> Answer:
    """The multipliers of the wrong sign."""
    return with_cast(turned_torsion(-1.0))(framework)


def springs_of(parameters: Mapping[str, Any], i: int) -> Springs:
    """The function g of one drawn situation."""
    return Springs(np.asarray(parameters["stiffness"]), parameters["rest"][i])


def followed_by_both(robot: Robot, drawn: Draw, framework: Answer, followed: Answer) -> tuple[Array, Array, Array]:
    """Largest differences (B,) [rad/s] of the rates, what bounds and differences allow, and |qdot|."""
    q, xdot, parameters = drawn
    x = framework(ROW, robot, q, xdot, **parameters)
    allowed = bounds(ROW, ROW.cast(robot, q, xdot, **parameters), x, parameters)[0]
    arm = arm_of(robot)
    other = [followed(arm, springs_of(parameters, i).gradient, q[i], xdot[i]) for i in range(len(q))]
    difference = np.abs(x - np.array([rate for rate, _ in other])).max(axis=-1)
    return difference, allowed + np.array([error for _, error in other]), np.abs(x).max(axis=-1)


def extrema(robot: Robot, rng: np.random.Generator, count: int) -> Draw:
    """Minima, saddles and maxima of springs with the hand held: rest = q - J'F, F from slight to strong."""

    def once() -> tuple[Array, Array, Array]:
        q, xdot, _ = generic(robot, rng, count)
        J = robot.jacobian(q)
        F = rng.uniform(-STRONGEST, STRONGEST, (count, robot.m)) / np.linalg.norm(J, 2, axis=(1, 2))[:, None]
        rest = q - np.einsum("bmn,bm->bn", J, F)
        good = cast_of.transversal(condition_of(robot, q, elastic(robot, 1.0, rest)))
        return q[good], xdot[good], rest[good]

    q, xdot, rest = gathered(once, count, f"extrema of {robot.name}")
    return Draw(q, xdot, {"stiffness": np.ones(robot.n), "rest": rest})


def kinds(robot: Robot, drawn: Draw) -> Array:
    """Smallest and largest eigenvalue (B, 2) of N'(Hess g - T)N, N orthonormal: of one sign at minima and maxima."""
    condition = condition_of(robot, drawn.q, elastic(robot, **drawn.parameters))
    return np.linalg.eigvalsh(condition.H @ condition.N)[:, [0, -1]]


# one degree of redundancy


def volume_gradient(q: Array) -> Array:
    """Grad w (3,) of the planar arm, w = sqrt(det JJ'), by complex steps."""

    def w(q: Array) -> Array:
        J = constrained.tip_jacobian(q)
        return np.sqrt(np.linalg.det(J @ J.T))

    return constrained.slope(w, q)


def of_springs(xdot: Array) -> Array:
    """E1 of methods 5.6: qdot (3,) at F1."""
    return np.array([0.0, -xdot[0], xdot[0] + xdot[1]])


def of_volume(xdot: Array) -> Array:
    """E2 of methods 5.6."""
    return np.array([[-0.2, 0.4], [-0.8, -0.4], [1.2, 0.6]]) @ xdot


def one_degree(trial: Trial, framework: Answer, followed: Answer) -> Evidence:
    """Eq. (11) with n - m = 1 against the extremum itself, moved along with the hand."""
    robot = robots.load("planar_3r")
    drawn = extrema(robot, trial.rng("extended_jacobian"), trial.of(150, 10))
    difference, allowed, _ = followed_by_both(robot, drawn, framework, followed)
    checks = [at_most("joint rates less those of the extremum of springs, over bound and error", difference / allowed, 1.0)]

    tasks = np.array([[1.0, 0.0], [0.0, 1.0], TASK, [-1.0, 2.0]])
    at = np.tile(F1, (len(tasks), 1))
    elastic_energy = Springs(np.ones(3), REST)
    hand: list[tuple[str, Array, Array, Array]] = []
    for words, expected, gradient, method, given in (
        ("E1, $g = |q - q_0|^2/2$", of_springs, elastic_energy.gradient, ROW, {"rest": REST}),
        ("E2, $g = w$", of_volume, volume_gradient, OF_A_FUNCTION, {"function": volume()}),
    ):
        x = framework(method, robot, at, tasks, **given)
        problem = method.cast(robot, at, tasks, **given)
        bound = bounds(method, problem, x, given)[0]
        ratios = []
        for i, xdot in enumerate(tasks):
            rate, error = followed(PLANAR, gradient, F1, xdot)
            hand.append((rf"{words}, $\dot x = {written(xdot)}$", expected(xdot), x[i], rate))
            ratios += [np.abs(x[i] - expected(xdot)).max() / bound[i], np.abs(x[i] - rate).max() / (bound[i] + error)]
        checks.append(at_most(f"{words}: rates less those by hand, and less the extremum's, over bounds", ratios, 1.0))

    q, _, parameters = drawn
    W = ROW.cast(robot, *drawn[:2], **parameters).W.dense()
    rows = [constrained.slope(_condition(springs_of(parameters, i)), q[i]) for i in range(len(q))]
    size = np.linalg.norm([cross(one)[:, 0] for one in q], axis=-1)
    outer = np.einsum("bi,bj->bij", rows, rows) / size[:, None, None] ** 2
    gap = np.linalg.norm(W - outer, axis=(1, 2)) / np.linalg.norm(W, axis=(1, 2))
    rounding = ORIGINAL * robot.n * UNIT * np.linalg.cond(robot.jacobian(q)) * torsion_share(robot, drawn)
    words = r"$H^T H$ less $\nabla(\bar n^T \nabla g)(\nabla(\bar n^T \nabla g))^T$, $|\bar n| = 1$, over rounding"
    checks.append(at_most(words, gap / rounding, 1.0))

    table = Table(
        "Planar 3R at q = (0, π/2, −π/2): joint rates [rad/s] worked out by hand, by eq. (6), and by following the extremum",
        ("case", "by hand", "eq. (6) with (11)–(12)", "extremum followed"),
        tuple((words, written(expected), written(x, 7), written(np.round(rate, 9), 7)) for words, expected, x, rate in hand),
    )
    return Evidence(tuple(checks), (_steps(trial, robot, drawn, framework), table))


def _condition(g: Springs) -> Callable[[Array], Array]:
    """The function n'grad g, n the cross product of the rows of J."""
    return lambda q: cross(q)[:, 0] @ g.gradient(q)


def torsion_share(robot: Robot, drawn: Draw) -> Array:
    """What rounding of Hess g - T is to H (B,): cancellation in the row of eq. (11)."""
    condition = condition_of(robot, drawn.q, elastic(robot, **drawn.parameters))
    parts = np.linalg.norm(condition.hessian, 2, axis=(1, 2)) + np.linalg.norm(condition.T, 2, axis=(1, 2))
    return parts / np.linalg.svd(condition.H, compute_uv=False)[:, -1]


def _steps(trial: Trial, robot: Robot, drawn: Draw, framework: Answer) -> Plot:
    """The rates against differences of the extremum, over the step."""
    steps = np.logspace(-5, -1, trial.of(41, 9))
    cases = [("E1", F1, TASK, Springs(np.ones(3), REST), {"rest": REST})]
    for i in range(2):
        given = {"stiffness": drawn.parameters["stiffness"], "rest": drawn.parameters["rest"][i]}
        cases.append((f"drawn {i + 1}", drawn.q[i], drawn.xdot[i], springs_of(drawn.parameters, i), given))
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
        if name == "E1":
            rounded = [constrained.rounding(PLANAR, g.gradient, q, step) / np.abs(x).max() for step in steps]
            series.append(Series("bound on rounding, E1", steps, rounded, "line", "bound"))
    scale = np.nanmax(series[0].y[-1:]) if np.isfinite(series[0].y[-1]) else 1.0
    series.append(Series("slope 4: truncation", steps, scale * (steps / steps[-1]) ** 4, "line", "bound"))
    return Plot(
        "Relative difference between the rates of eq. (6) and the difference quotient of the constrained extremum: it falls "
        "with "
        "the fourth power of the step, as a derivative does, down to rounding",
        Axis("step of the hand [s at the velocity asked]", log=True), Axis("relative difference of the joint rates", log=True),
        tuple(series),
    )  # fmt: skip


# general redundancy


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
        words = f"{name}, $n = {robot.n}$, $m = {robot.m}$: joint rates less the extremum's, over bound and error"
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
        "extremum "
        r"bifurcates ($N_J^T H^T$ singular, (7) fails)",
        Axis("smallest singular value of HN over |H|", log=True), Axis("relative difference of the joint rates", log=True),
        (*series, Series("bound and error of the differences", hold, limit, role="bound")),
    )  # fmt: skip
    table = Table(
        "Situations drawn, by the kind of extremum, and the largest differences",
        ("arm", "n", "m", "minima", "saddles", "maxima", "largest relative difference", "largest share of bound and error"),
        tuple(rows),
    )
    return Evidence(tuple(checks), (plot, table))


# along a path


def frozen(following: Answer) -> Answer:
    """The motion with the rows H of where it began."""

    def planted(method: Method, robot: Robot, path: Any, q0: Array, **options: Any) -> Any:
        if method is not ROW:
            return following(method, robot, path, q0, **options)
        given = {name: options.pop(name) for name in ("stiffness", "rest") if name in options}
        H = condition_of(robot, q0, elastic(robot, **given)).H

        def cast(robot: Robot, q: Array, xdot: Array) -> VelocityProblem:
            return VelocityProblem(J=robot.jacobian(q), xdot=xdot, W=Weight(np.zeros((robot.n, robot.n)), H))

        options.pop("tolerance", None)
        return following(replace(ROW, cast=cast), robot, path, q0, **options)

    return planted


def along_a_path(trial: Trial, following: Answer, extremum: Answer) -> Evidence:
    """Whether h = N'grad g stays zero along a circle of the hand, and the posture that of the extremum."""
    rng = trial.rng("maintains_an_extremum")
    path, tolerance = circle(0.15, 4.0), trial.of(1, 100) * INTEGRATION
    allowed = CLOSED_CYCLE * tolerance / INTEGRATION
    checks: list[Check] = []
    series: list[Series] = []
    rows: list[tuple[str, float, float | None, float]] = []
    for name in ("planar_3r", "planar_4r"):
        robot = robots.load(name)
        starts = _starts(robot, rng, path, trial.of(60, 20))
        for label, q0, g in starts if trial.full else [start for start in starts if start[0] == "minimum"]:
            given = {"stiffness": g.stiffness, "rest": g.rest}
            options = {"rtol": tolerance, "samples": trial.of(160, 24)}
            motion = following(ROW, robot, path, q0, **given, tolerance=np.inf, **options)
            share = np.array([_left(robot, g, q) for q in motion.q])
            drawn_in = np.linspace(0, len(motion.t) - 1, trial.of(60, 8)).astype(int)
            guess, gap = q0, []
            for i in drawn_in:
                guess = extremum(PLANAR, g.gradient, motion.hand[i, :2], guess)
                gap.append(np.abs(motion.q[i] - guess).max())
            case = f"{name}, {label}"
            checks += [
                every(f"{case}: the motion ends where the path does", [not motion.stopped]),
                at_most(rf"{case}: $|N_J^T \nabla g| / |\nabla g|$ along the path", share, allowed),
                at_most(f"{case}: joints less the extremum by root finding at the same hand [rad]", gap, allowed),
            ]
            closed = float(np.abs(motion.q[-1] - q0).max())
            rows.append((case, float(share.max()), float(np.max(gap)), closed))
            series.append(Series(f"extended Jacobian, {case}", motion.t, np.maximum(share, UNIT), "line"))
            if label == "minimum":
                other = following(METHODS["gradient_projection"], robot, path, q0, alpha=0.0, **options)
                left = np.array([_left(robot, g, q) for q in other.q])
                series.append(Series(f"pseudoinverse, {name}", other.t, np.maximum(left, UNIT), "line", "other"))
                rows.append((f"{name}, pseudoinverse", float(left.max()), None, float(np.abs(other.q[-1] - q0).max())))
    ends = [0.0, path.duration]
    series.append(Series("error of the integration", ends, [allowed] * 2, "line", "bound"))
    plot = Plot(
        r"How far from extremal, $|N_J^T \nabla g| / |\nabla g|$, as the hand goes once round a circle of radius 0.15 m, "
        "from an extremum, without feedback",
        Axis("time [s]"), Axis("share of the gradient along the self-motion", log=True), tuple(series),
    )  # fmt: skip
    table = Table(
        "The largest deviation on the way, and what a closed path leaves in the joints",
        (
            "motion",
            "largest share of the gradient",
            "from the extremum by root finding [rad]",
            "joint drift after one round [rad]",
        ),
        tuple(rows),
    )
    return Evidence(tuple(checks), (plot, table))


def _left(robot: Robot, g: Springs, q: Array) -> float:
    """|N'grad g| / |grad g| by singular values of J alone."""
    gradient = g.gradient(q)
    return float(np.linalg.norm(equations.null_space(constrained.tip_jacobian(q)).T @ gradient) / np.linalg.norm(gradient))


def _starts(robot: Robot, rng: np.random.Generator, path: Any, count: int) -> list[tuple[str, Array, Springs]]:
    """Extrema that the circle does not lead to a bifurcation: of each kind the one that keeps clearest of it.

    Raises ArithmeticError where no minimum is among those drawn.
    """
    found: dict[str, tuple[float, Array, Springs]] = {}
    places = path.displacement(np.linspace(0.0, path.duration, 13))[:, :2]
    drawn = extrema(robot, rng, count)
    for i, q0 in enumerate(drawn.q):
        g, q = springs_of(drawn.parameters, i), [q0]
        try:
            for place in constrained.tip(q0) + places:
                q.append(constrained.extremum(PLANAR, g.gradient, place, q[-1]))
        except ArithmeticError:
            continue
        S = kinds(robot, Draw(np.array(q), np.empty(0), {"stiffness": g.stiffness, "rest": g.rest}))
        positive = bool((S[:, 0] > 0).all()), bool((S[:, 1] > 0).all())
        same = all((S[:, j] > 0).all() or (S[:, j] < 0).all() for j in (0, 1))
        clear = min(np.abs(S).min(), np.linalg.svd(robot.jacobian(np.array(q)), compute_uv=False).min())
        kind = {(True, True): "minimum", (False, False): "maximum"}.get(positive, "saddle")
        if same and np.abs(q[-1] - q0).max() < CLOSED_CYCLE and clear > found.get(kind, (0.1,))[0]:
            found[kind] = (float(clear), q0, g)
    if "minimum" not in found:
        raise ArithmeticError(f"no minimum of {robot.name} found that a circle does not leave")
    return [(kind, q0, g) for kind, (_, q0, g) in sorted(found.items())]


# any differentiable basis


def scaled(scale: Callable[[Array], Any]) -> Callable[[Array], Array]:
    """The basis scale(q) n(q), n the cross product of the rows of J."""
    return lambda q: scale(q) * cross(q)


def _unit(q: Array) -> Any:
    n = cross(q)[:, 0]
    return 1 / np.sqrt(n @ n)


SCALINGS: tuple[tuple[str, Callable[[Array], Array]], ...] = (
    (r"$n$", scaled(lambda q: 1.0)),
    (r"$n/|n|$", scaled(_unit)),
    (r"$(2 + \sin q_1 + q_2^2)\, n$", scaled(lambda q: 2 + np.sin(q[0]) + q[1] ** 2)),
    (r"$-e^{q_3} n$", scaled(lambda q: -np.exp(q[2]))),
)
"""Null vectors of the planar 3R, n the cross product of the rows of J (methods 5.2)."""


def bases(robot: Robot, q: Array) -> list[tuple[str, Callable[[Array], Array]]]:
    """Differentiable bases of null J near q."""
    if robot.n == 3:
        return list(SCALINGS)
    J = constrained.tip_jacobian(q)
    pairs = [(i, j) for i in range(4) for j in range(i) if abs(np.linalg.det(J[:, [i, j]])) > 0.2]
    frozen_pivots = [(f"joints {i + 1}, {j + 1} solved for", constrained.eliminated(PLANAR, (i, j), 4)) for i, j in pairs[:2]]
    smooth = constrained.projected(PLANAR, q)

    def mixed(z: Array) -> Array:
        return smooth(z) @ np.array([[1 + z[0] ** 2, np.sin(z[1])], [0 * z[0], np.exp(z[2])]])

    return [("projected", smooth), ("projected, mixed by C(q)", mixed), *frozen_pivots]


def sign_flips(framework: Answer) -> Answer:
    """H by differences of h with an orthonormal basis computed anew each time, its signs as they come."""

    def cast(robot: Robot, q: Array, xdot: Array, *, stiffness: Any = 1.0, rest: Any = None, tolerance: float = 0.0) -> Any:
        rng = np.random.default_rng(8)
        step = UNIT ** (1 / 3)
        g = elastic(robot, stiffness, rest)

        def h(q: Array) -> Array:
            condition = condition_of(robot, q, g)
            signs = rng.choice([-1.0, 1.0], (len(q), 1, robot.k))
            return np.einsum("bnk,bn->bk", condition.N * signs, condition.gradient)

        H = np.stack([(h(q + s) - h(q - s)) / (2 * step) for s in step * np.eye(robot.n)], axis=-1)
        return VelocityProblem(J=robot.jacobian(q), xdot=xdot, W=Weight(np.zeros((robot.n, robot.n)), H))

    return with_cast(cast)(framework)


def any_basis(trial: Trial, framework: Answer, by_basis: Answer) -> Evidence:
    """The same rates whatever the differentiable basis, on the manifold; not off it."""
    rng = trial.rng("any_differentiable_basis")
    checks = []
    for name, count in (("planar_3r", trial.of(100, 8)), ("planar_4r", trial.of(60, 6))):
        robot = robots.load(name)
        q, xdot, parameters = drawn = extrema(robot, rng, count)
        x = framework(ROW, robot, q, xdot, **parameters)
        problem = ROW.cast(robot, q, xdot, **parameters)
        allowed = bounds(ROW, problem, x, parameters)[0]
        cancelled = torsion_share(robot, drawn) * np.linalg.cond(robot.jacobian(q))
        ratios = []
        for i in range(count):
            g = springs_of(parameters, i)
            for _, basis in bases(robot, q[i]):
                other, condition = by_basis(PLANAR, g.gradient, q[i], xdot[i], basis)
                rounding = ORIGINAL * robot.n * UNIT * condition * cancelled[i] * np.abs(other).max()
                ratios.append(np.abs(x[i] - other).max() / (allowed[i] + rounding))
        words = f"{name}, {len(bases(robot, q[0]))} bases at extrema: rates less those of the framework, over bounds"
        checks.append(at_most(words, ratios, 1.0))
        dense = VelocityProblem(J=problem.J, xdot=problem.xdot, W=problem.W.dense())
        rounding = (2 * CLOSED_FORMS["eq6"].bound(dense) + CLOSED_FORMS["eq6"].bound(problem)) * np.abs(x).max(axis=-1)
        other = []
        for i in range(count):
            N = equations.null_space(problem.J[i]) @ (np.eye(robot.k) + 0.4 * rng.uniform(-1, 1, (robot.k, robot.k)))
            other.append(equations.augmented(problem.J[i], xdot[i], dense.W.dense()[i], np.zeros(robot.n), 0.0, N))
        words = rf"{name}: $N_J$ of (6) mixed anew, $\bar N_J$ kept: rates less the framework's, over bounds"
        checks.append(at_most(words, np.abs(x - np.array(other)).max(axis=-1) / rounding, 1.0))

    springs = Springs(np.ones(3), REST)
    printed = [by_basis(PLANAR, springs.gradient, OFF, TASK, basis)[0] for _, basis in SCALINGS]
    h = float((cross(OFF).T @ springs.gradient(OFF))[0])
    digits = np.abs(np.array(printed) - PRINTED_OFF).max()
    words = rf"at $q = {written(OFF)}$ the four answers are those worked out before, to their four digits"
    checks.append(at_most(words, digits, PRINTED_DIGIT, role=Role.OURS))
    shares, spreads = _off_the_manifold(trial, rng, by_basis)
    slope = float(np.median(spreads / shares))
    spread = _spread(printed)
    checks.append(
        at_most(
            "off the manifold too: spread of the rates over the four bases, relative", [spread, *spreads[shares > 1e-6]],
            SAME_MOTION, role=Role.REACH,
            range="It holds where h = 0, on the extremal manifold, where motions with α = 0 must begin. Off it the rates "
            "differ "
            f"by about {slope:.1g} times the share of the gradient that is left along the self-motion: at q = {written(OFF)}, "
            f"h = {h:.4f}, by {100 * spread:.0f} %.",
        )
    )  # fmt: skip
    flips, jump, spike = _flipping(trial, rng, springs)
    checks += [
        at_least(
            "sign flips of the last singular vector of J met on straight lines through joint space", flips, 1, role=Role.OURS
        ),
        at_least("joint rates with H differenced across such a flip: relative error", jump, OTHER_MOTION, role=Role.OURS),
    ]
    plot = Plot(
        "Spread of the joint rates over the four scalings of the null vector, over the distance from the extremal manifold",
        Axis("share of the gradient of g along the self-motion", log=True),
        Axis("relative spread of the joint rates", log=True),
        (
            Series("planar 3R, drawn", shares, spreads),
            Series("q = (.2, 1.1, −.6)", [_left(robots.load("planar_3r"), springs, OFF)], [spread], role="other"),
            Series("proportional", np.sort(shares), slope * np.sort(shares), "line", "bound"),
        ),
    )  # fmt: skip
    table = Table(
        f"Planar 3R at q = (0.2, 1.1, −0.6), off the manifold (h = {h:.4f}), ẋ = (0.3, −0.7): rates [rad/s] of [J; H]",
        ("null vector", "worked out before", "ours"),
        tuple(
            (words, written(given), written(found))
            for (words, _), given, found in zip(SCALINGS, PRINTED_OFF, printed, strict=True)
        ),
    )
    return Evidence(tuple(checks), (plot, spike, table))


def _spread(answers: Any) -> float:
    """Largest distance from the first of some vectors, relative."""
    stack = np.array(answers)
    return float(np.abs(stack - stack[0]).max() / np.abs(stack[0]).max())


def _off_the_manifold(trial: Trial, rng: np.random.Generator, by_basis: Answer) -> tuple[Array, Array]:
    """Distances from the manifold, and how far the four scalings differ there."""
    robot = robots.load("planar_3r")
    q, xdot, parameters = extrema(robot, rng, trial.of(240, 24))
    shares, spreads = [], []
    for i, off in enumerate(10.0 ** rng.uniform(-9, -0.5, len(q))):
        g = springs_of(parameters, i)
        n = cross(q[i])[:, 0]
        moved = Springs(g.stiffness, g.rest - off * np.linalg.norm(g.gradient(q[i])) * n / np.linalg.norm(n) / g.stiffness)
        shares.append(_left(robot, moved, q[i]))
        spreads.append(_spread([by_basis(PLANAR, moved.gradient, q[i], xdot[i], basis)[0] for _, basis in SCALINGS]))
    return np.array(shares), np.array(spreads)


def _flipping(trial: Trial, rng: np.random.Generator, g: Springs) -> tuple[int, float, Plot]:
    """Flips found on lines; the error of rates with H by differences across one; and h along that line."""

    def last(q: Array) -> Array:
        return np.linalg.svd(constrained.tip_jacobian(q))[2][2]

    least, s = trial.of(60, 5), np.linspace(0.0, 1.0, 121)
    flips, lines, chosen = 0, 0, None
    while lines < least or (chosen is None and lines < MOST_LINES):
        a, b = rng.uniform(-2.5, 2.5, (2, 3))
        J = np.array([constrained.tip_jacobian(a + t * (b - a)) for t in s])
        _, sigma, V = np.linalg.svd(J)
        turned = np.flatnonzero(np.einsum("ti,ti->t", V[1:, 2], V[:-1, 2]) < -0.5)
        lines, flips = lines + 1, flips + len(turned)
        for i in turned:
            if chosen is None and sigma[i, 1] > 0.3 and 0.1 < s[i] < 0.9 and np.linalg.norm(b - a) > 2:
                chosen = (a, b, i)
    if chosen is None:
        return flips, np.nan, Plot("", Axis(""), Axis(""), ())
    a, b, i = chosen
    low, high = s[i], s[i + 1]
    for _ in range(40):
        middle = (low + high) / 2
        same = last(a + low * (b - a)) @ last(a + middle * (b - a)) > 0
        low, high = (middle, high) if same else (low, middle)
    at, step = a + low * (b - a), 1e-4

    def h(q: Array) -> float:
        return float(last(q) @ g.gradient(q))

    H = np.array([(h(at + e) - h(at - e)) / (2 * step) for e in step * np.eye(3)])
    right = constrained.basis_rates(PLANAR, g.gradient, at, TASK, scaled(_unit))[0]
    wrong = np.linalg.solve(np.vstack([constrained.tip_jacobian(at), H]), [*TASK, 0.0])
    error = float(np.abs(wrong - right).max() / np.abs(right).max())
    here = np.linspace(low - 0.05, low + 0.05, 201)
    n0 = last(at)
    smooth = []
    for t in here:
        n = cross(a + t * (b - a))[:, 0]
        smooth.append(float(n @ g.gradient(a + t * (b - a)) / np.linalg.norm(n) * np.sign(n0 @ cross(at)[:, 0])))
    rough = [h(a + t * (b - a)) for t in here]
    along = (here - low) * np.linalg.norm(b - a)
    plot = Plot(
        f"h along a line through joint space, where the singular value decomposition turns the sign of its null vector: H by "
        f"differences across it gives joint rates wrong by {100 * error:.0f} %",
        Axis("distance from the flip [rad]"), Axis("h [Nm]"),
        (
            Series("null vector by singular value decomposition", along, rough),
            Series("cross product, scaled", along, smooth, "line", "other"),
        ),
    )  # fmt: skip
    return flips, error, plot


# feedback


def wrong_sign(framework: Answer) -> Answer:
    """Alpha for -alpha."""

    def planted(method: Method, robot: Robot, q: Array, xdot: Array, *, alpha: float = 0.0, **parameters: Any) -> Array:
        return framework(method, robot, q, xdot, alpha=-alpha, **parameters)

    return planted


def feedback(trial: Trial, framework: Answer, by_basis: Answer) -> Evidence:
    """Alpha != 0, f = g: where it drives g to, how fast, and where it does not."""
    rng = trial.rng("extremum_feedback")
    checks: list[Check] = []
    for name, count in (("planar_3r", trial.of(80, 8)), ("planar_4r", trial.of(60, 6))):
        robot = robots.load(name)
        q, xdot, parameters = FEEDBACK.draw(robot, rng, count)
        for words, gains in (
            (r"$\alpha$", {"alpha": parameters["alpha"], "kappa": 0.0}),
            (r"$\kappa$", {"kappa": parameters["kappa"]}),
        ):
            given = {**parameters, "alpha": 0.0, **gains}
            x = framework(FEEDBACK, robot, q, xdot, **given)
            allowed = np.add(*bounds(FEEDBACK, FEEDBACK.cast(robot, q, xdot, **given), x, given))
            ratios = []
            for i in range(count):
                g, basis = springs_of(parameters, i), constrained.projected(PLANAR, q[i])
                other, condition = by_basis(
                    PLANAR, g.gradient, q[i], xdot[i], basis, alpha=given["alpha"], kappa=given["kappa"]
                )
                rounding = ORIGINAL * robot.n * UNIT * condition**2 * np.abs(other).max()
                ratios.append(np.abs(x[i] - other).max() / (allowed[i] + rounding))
            role = Role.CLAIM if gains.get("alpha") else Role.OURS
            checks.append(
                at_most(
                    f"{name}, gain {words}: rates less those of $[J; H]$ with feedback, over bounds", ratios, 1.0, role=role
                )
            )
        still = np.zeros_like(xdot)
        gradient = np.stack([springs_of(parameters, i).gradient(q[i]) for i in range(count)])
        springs = {"stiffness": parameters["stiffness"], "rest": parameters["rest"], "kappa": 0.0}
        for alpha in (0.5, -0.5):
            x = framework(FEEDBACK, robot, q, still, alpha=alpha, **springs)
            rate = np.einsum("bn,bn->b", gradient, x)
            words = rf"{name}, hand at rest, $\alpha = {alpha}$: $\dot g$ has the sign of $-\alpha$"
            checks.append(every(words, rate * alpha < 0))
    near, close, table = _near_extrema(trial, framework)
    far, reached, landscape = _from_afar(trial, framework)
    return Evidence((*checks, *near, *far, _reach(reached)), (landscape, close, table))


Law = Callable[[float, Array], Array]


def _self_motion(framework: Answer, robot: Robot, g: Springs, **gains: float) -> Law:
    """Rates of the joints while the hand is at rest."""
    still = np.zeros((1, robot.m))

    def law(_: float, q: Array) -> Array:
        return framework(FEEDBACK, robot, q[None], still, stiffness=g.stiffness, rest=g.rest, **gains)[0]

    return law


def _tilted(q: Array, g: Springs, h: float) -> Springs:
    """The springs with rest moved so that |N'grad g| is h at the extremum q, the same along every principal direction."""
    robot = robots.load(f"planar_{len(q)}r")
    condition = condition_of(robot, q, elastic(robot, g.stiffness, g.rest))
    principal = condition.N @ np.linalg.eigh(condition.H @ condition.N)[1]
    return Springs(g.stiffness, g.rest - h * principal.sum(axis=1) / np.sqrt(robot.k) / g.stiffness)


def _residual(g: Springs, q: Array) -> float:
    return float(np.linalg.norm(equations.null_space(constrained.tip_jacobian(q)).T @ g.gradient(q)))


def _near_extrema(trial: Trial, framework: Answer) -> tuple[list[Check], Plot, Table]:
    """|h| over time from 1e-3 of a minimum, a maximum and a saddle, under feedback of both signs and the uniform one."""
    arm, four = robots.load("planar_3r"), robots.load("planar_4r")
    start, duration, alpha, kappa = 1e-3, 2.0, 0.4, 0.6
    drawn = extrema(four, trial.rng("extremum_feedback, saddle"), 60)
    low, high = kinds(four, drawn).T
    mixed = int(np.argmax(np.minimum(-low, high) / np.maximum(np.abs(low), np.abs(high))))
    steep = 2 * max(-low[mixed], high[mixed])
    cases = [
        ("minimum", arm, F1, Springs(np.ones(3), REST), 1 / 3, alpha),
        ("maximum", arm, F1, Springs(np.ones(3), TOP), -1 / 3, alpha),
        ("saddle", four, drawn.q[mixed], springs_of(drawn.parameters, mixed), np.nan, alpha * steep),
    ]
    checks, series, rows, grown = [], [], [], []
    times = np.linspace(0.0, duration, 41)
    for kind, robot, q0, g, reduced, gain in cases:
        tilted = _tilted(q0, g, start)
        for words, gains in (
            ("α > 0", {"alpha": gain, "kappa": 0.0}), ("α < 0", {"alpha": -gain, "kappa": 0.0}), ("κ", {"kappa": kappa}),
        ):  # fmt: skip
            path = solve_ivp(
                _self_motion(framework, robot, tilted, **gains), (0.0, duration), q0, rtol=1e-6, atol=1e-9, t_eval=times,
            )  # fmt: skip
            size = np.array([_residual(tilted, q) for q in path.y.T])
            series.append(Series(f"{kind}, {words}", path.t, size, "line"))
            expected = np.exp(-kappa * path.t) if words == "κ" else np.exp(-gains["alpha"] * path.t / reduced)
            known = words == "κ" or kind != "saddle"
            rows.append((kind, words, float(start * expected[-1]) if known else None, float(size[-1])))
            case = f"{kind}, {words}"
            if kind == "saddle" and words != "κ":
                grown.append(size[-1] > size[-2])
                continue
            linear = start * expected < LINEAR_SIZE
            gap = np.abs(np.log(size[linear] / (start * expected[linear])))
            if words == "κ":
                decay = rf"{case}: $\ln |h|$ less that of the uniform $\dot h = -\kappa h$"
                checks.append(at_most(decay, gap, LINEARISED, role=Role.OURS))
            else:
                settles = (gains["alpha"] > 0) == (kind == "minimum")
                turn = "falls" if settles else "grows"
                checks.append(every(f"{case}: $|h|$ {turn} on the way", (np.diff(size) < 0) == settles))
                decay = rf"{case}: $\ln |h|$ less that of $\dot h = -\alpha (N^T H^T)^{{-1}} h$"
                checks.append(at_most(decay, gap, LINEARISED))
    checks.append(every("a saddle: $|h|$ grows in the end under either sign", grown, role=Role.OURS))
    # numbers of methods 5.5, of the null vector |n|^2 = 3, for which W = H'H is three times that of an orthonormal one
    for alpha, printed in ((2.0, 1.8e-5), (-2.0, 5e-2)):
        g = Springs(np.ones(3), REST - start / 3 * cross(F1)[:, 0])
        law = _self_motion(framework, arm, g, alpha=alpha / 3, kappa=0.0)
        end = solve_ivp(law, (0.0, 2.0), F1, rtol=1e-6, atol=1e-10).y[:, -1]
        h = float(abs(cross(end)[:, 0] @ g.gradient(end)))
        rows.append((f"minimum, null vector |n|² = 3, h = {start:g}", f"α = {alpha:g}, 2 s", printed, h))
        checks.append(
            at_most(
                rf"$\alpha = {alpha:g}$: $h$ after 2 s against the number worked out before, relative",
                abs(h / printed - 1),
                0.2,
            )
        )
    series.append(Series(f"uniform decay, κ = {kappa:g} /s", times, start * np.exp(-kappa * times), "line", "bound"))
    plot = Plot(
        r"$|N_J^T \nabla g|$ over time with the hand at rest, begun $10^{-3}$ from an extremum: the feedback of the paper, "
        r"$f = g$, with both signs of $\alpha$, and feedback of $\kappa H^T h$ instead",
        Axis("time [s]"), Axis("|h|, N orthonormal [Nm]", log=True), tuple(series),
    )  # fmt: skip
    table = Table(
        "|h| [Nm] at the end: expected from the linear rate −α/(n'H'), or worked out before, beside ours",
        ("begun near a", "feedback", "expected", "ours"), tuple(rows),
    )  # fmt: skip
    return checks, plot, table


BLOWN_UP = 20.0
"""Joint rate [rad/s] at which a self-motion has met N'H' = 0: the hand is at rest and alpha is 1."""

BENT = 0.35
"""Curvature of g along the self-motion [J/rad^2] above which, with alpha = 1, rates are far from BLOWN_UP."""

STRIDE, MOST_STEPS = 0.04, 1000
"""Longest step of a self-motion [rad], and how many are taken."""


def _from_afar(trial: Trial, framework: Answer) -> tuple[list[Check], list[tuple[float, float, bool]], Plot]:
    """The whole self-motion of the planar 3R with its tip at (2, 1): where feedback from each point of it ends."""
    robot, g = robots.load("planar_3r"), Springs(np.ones(3), TOP)
    s, curve = _curve(trial.of(400, 200))
    energy = np.array([g(q) for q in curve])
    n = np.array([cross(q)[:, 0] / np.linalg.norm(cross(q)) for q in curve])
    h = np.einsum("si,si->s", n, np.array([g.gradient(q) for q in curve]))
    bend = np.array(
        [constrained.slope(lambda z: scaled(_unit)(z)[:, 0] @ g.gradient(z), q) @ v for q, v in zip(curve, n, strict=True)]
    )
    places = (np.arange(trial.of(48, 12)) + 0.5) * len(s) / trial.of(48, 12)
    places = places.astype(int)
    outcomes: list[tuple[float, float, bool]] = []
    points: dict[str, list[int]] = {}
    for alpha in (1.0, -1.0):
        settled = _settles(framework, robot, g, alpha, curve[places], trial.of(1, 2) * STRIDE)
        sign, goal = (">", "a minimum") if alpha > 0 else ("<", "a maximum")
        for i, there in zip(places, settled, strict=True):
            outcomes.append((alpha, _least_bend(int(i), h, bend, alpha), bool(there)))
            points.setdefault(f"α {sign} 0: {f'goes to {goal}' if there else 'rates without bound'}", []).append(int(i))
    checks = [
        every(
            rf"$\alpha {'>' if sign > 0 else '<'} 0$, begun where $g$ is {'convex' if sign > 0 else 'concave'} all the way "
            "to its "
            f"{'minimum' if sign > 0 else 'maximum'}: it gets there",
            [there for alpha, least, there in outcomes if alpha == sign and least > BENT],
        )
        for sign in (1.0, -1.0)
    ]
    words = f"with an inflection of $g$ on the way: the rates exceed {BLOWN_UP:g} rad/s"
    checks.append(every(words, [not there for _, least, there in outcomes if least < 0], role=Role.OURS))
    turns = np.flatnonzero(np.diff(np.sign(bend)))
    series = [Series("g", s, energy, "line")]
    series += [
        Series(words, s[found], energy[found] + 0.03 * np.ptp(energy) * (1 if ">" in words else -1))
        for words, found in points.items()
    ]
    series.append(Series("inflections of g: N′H′ = 0, (7) fails", s[turns], energy[turns], role="other"))
    plot = Plot(
        "Spring energy g along the self-motion of the planar 3R with its tip held at (2, 1); each start marked by where the "
        "feedback of the paper takes it",
        Axis("length along the self-motion [rad]"), Axis("g [J]"), tuple(series),
    )  # fmt: skip
    return checks, outcomes, plot


def _curve(count: int) -> tuple[Array, Array]:
    """Length (count,) and postures (count, 3) once round the self-motion through F1, the tip held by Newton's method."""

    def onwards(_: float, q: Array) -> Array:
        n = cross(q)[:, 0]
        return n / np.linalg.norm(n)

    def back(_: float, q: Array) -> float:
        return float(onwards(0.0, F1) @ (q - F1))

    motion = solve_ivp(onwards, (0.0, 20.0), F1, rtol=1e-9, atol=1e-11, events=back, dense_output=True)
    rounds = [t for t, q in zip(motion.t_events[0], motion.y_events[0], strict=True) if t > 1 and np.linalg.norm(q - F1) < 1e-3]
    lengths = np.linspace(0.0, rounds[0], count, endpoint=False)
    return lengths, np.array([constrained.held(PLANAR, q, constrained.tip(F1)) for q in motion.sol(lengths).T])


def _settles(framework: Answer, robot: Robot, g: Springs, alpha: float, starts: Array, stride: float) -> Array:
    """Whether |h| falls to a twentieth (B,) before the rates exceed BLOWN_UP; steps of Runge and Kutta, up to `stride`."""
    still, given = np.zeros((1, robot.m)), {"stiffness": g.stiffness, "rest": g.rest, "alpha": alpha, "kappa": 0.0}

    def law(q: Array) -> Array:
        return framework(FEEDBACK, robot, q, np.repeat(still, len(q), axis=0), **given)

    q, settled, going = starts.copy(), np.zeros(len(starts), dtype=bool), np.arange(len(starts))
    least = np.array([_residual(g, one) for one in q]) / 20
    for _ in range(MOST_STEPS):
        if not len(going):
            break
        first = law(q[going])
        settled[going] = [_residual(g, q[i]) < least[i] for i in going]
        speed = np.linalg.norm(first, axis=1)
        keep = (speed < BLOWN_UP) & ~settled[going]
        if not keep.any():
            break
        going, first, dt = going[keep], first[keep], np.minimum(0.1, stride / speed[keep])[:, None]
        second = law(q[going] + dt / 2 * first)
        third = law(q[going] + dt / 2 * second)
        last = law(q[going] + dt * third)
        q[going] += dt / 6 * (first + 2 * second + 2 * third + last)
        going = going[np.linalg.norm([second, third, last], axis=-1).max(axis=0) < BLOWN_UP]
    return settled


def _least_bend(i: int, h: Array, bend: Array, alpha: float) -> float:
    """Smallest alpha bend from place i of the closed curve on, downhill (uphill for alpha < 0), to where h changes sign."""
    towards = -int(np.sign(alpha * h[i]))
    way = (i + towards * np.arange(len(h))) % len(h)
    there = np.flatnonzero(h[way] * h[i] <= 0)
    return float((alpha * bend[way[: there[0] + 1]]).min())


def _reach(outcomes: list[tuple[float, float, bool]]) -> Check:
    up, down = ([there for alpha, _, there in outcomes if alpha == sign] for sign in (1.0, -1.0))
    return every(
        r"from anywhere: $\alpha > 0$ ends at a minimum, $\alpha < 0$ at a maximum", [*up, *down], role=Role.REACH,
        range=f"Along one self-motion of the planar 3R, α > 0 reaches a minimum from {sum(up)} of {len(up)} starts and α < 0 a "
        f"maximum from {sum(down)} of {len(down)}: from those where g is convex (concave) all the way there. g always falls "
        "(rises), "
        "but at an inflection N'H' = 0, (7) fails, and the rates grow without bound. The rate of h, −α (N'H')^-1, depends on q "
        "and on the length of the null vectors; at a saddle either sign drives h away. Feeding back κ H'h instead gives the "
        "rate κ at every extremum.",
    )  # fmt: skip


FRAMEWORK = CodePath("the method cast by (11)–(12), $H = N_J^T(\\nabla^2 g - T)$, answered by eq. (6)", rates)
EXTREMUM = CodePath(
    "the extremum of g with the hand held, by root finding on Lagrange's conditions, differenced", constrained.extremum_rates
)
BY_BASIS = CodePath(
    r"$[J; H]$ solved as Baillieul wrote it, $H$ from complex steps of $\bar N_J^T \nabla g$", constrained.basis_rates
)
SOURCES = (*ROW.works,)

CLAIMS = (
    Claim(
        name="extended_jacobian",
        title="The extended Jacobian for one degree of redundancy",
        place="Section III, eqs. (11)–(12)",
        says=r"Baillieul's extended Jacobian, which keeps $g$ at an extremum, is (6) with $\alpha = 0$ and $W = H^T H$; for "
        "one "
        r"degree of redundancy $W = \nabla(\bar n^T \nabla g)(\nabla(\bar n^T \nabla g))^T$.",
        formula=r"W = \left(\frac{\partial (\bar N_J^T \nabla g)}{\partial q}\right)^T \frac{\partial (\bar N_J^T \nabla "
        r"g)}{\partial q}"
        r",\qquad \alpha = 0",
        tested="Planar 3R at random extrema of spring energy, and at one of the manipulability: the rates of (6) beside the "
        "derivative of the constrained extremum, which root finding follows as the hand moves; both forms of $W$ beside each "
        "other.",
        accepted="Differences within the bound of (6) and the error of the difference quotient; numbers by hand within the "
        "bound.",
        paths=(FRAMEWORK, EXTREMUM),
        examine=one_degree,
        fault=Fault(r"the derivative of $\bar N_J$ left out: $H = \bar N_J^T \nabla^2 g$", basis_frozen),
        sources=SOURCES,
    ),
    Claim(
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
    ),
    Claim(
        name="maintains_an_extremum",
        title="The extended Jacobian maintains an extremum along a path",
        place="Section III, eqs. (11)–(12)",
        says=r"With $\alpha = 0$ a motion that begins at an extremum of $g$ stays at one: $\bar N_J^T \nabla g$ stays zero.",
        tested="The hand goes once round a circle, integrated to twelve digits, from minima, maxima and saddles of planar "
        "arms; at "
        "points on the way the extremum is found by itself, from the place of the hand.",
        accepted="The gradient along the self-motion, and the distance from the extremum found, stay below the error of the "
        "integration.",
        paths=(
            CodePath("the law of (11)–(12) followed along the path by an adaptive integrator", follow),
            CodePath("the extremum at the hand's place, by root finding on Lagrange's conditions", constrained.extremum),
        ),
        examine=along_a_path,
        fault=Fault("H computed once, at the start, and kept", frozen),
        sources=SOURCES,
    ),
    Claim(
        name="any_differentiable_basis",
        title="Any differentiable basis of the null space does for (11)",
        place="Section III, eq. (11)",
        says=r"$\bar N_J$ is any differentiable basis of the null space; it need not equal the $N_J$ used in (6).",
        tested="Four scalings of the null vector of the planar 3R and four bases of the planar 4R, at extrema and off them; "
        "$N_J$ "
        "mixed anew in (6); a basis by singular value decomposition, which is not differentiable.",
        accepted="At extrema the joint rates agree within bounds. Off them they would have to agree too, were the sentence "
        "to hold "
        "without a start on the manifold.",
        paths=(FRAMEWORK, BY_BASIS),
        examine=any_basis,
        fault=Fault("H by differences of h with a basis computed anew each time, signs and all", sign_flips),
        sources=SOURCES,
    ),
    Claim(
        name="extremum_feedback",
        title="Feedback of g drives it to a minimum or a maximum",
        place="Section III, after eq. (12)",
        says=r"With $f = g$ and $\alpha \ne 0$ a feedback term drives $g$ to a minimum or a maximum.",
        tested=r"Rates off extrema beside $[J; H]\dot q = [\dot x; -\alpha (N^T H^T)^{-1} h]$; motions from near minima, "
        "maxima and "
        "saddles; and from all along one self-motion of the planar 3R, with both signs.",
        accepted=r"$\alpha > 0$: $g$ falls and ends at a minimum; $\alpha < 0$: it rises to a maximum; from wherever it "
        "begins.",
        paths=(FRAMEWORK, BY_BASIS),
        examine=feedback,
        fault=Fault(r"the sign of $\alpha$ turned", wrong_sign),
        sources=SOURCES,
    ),
)
