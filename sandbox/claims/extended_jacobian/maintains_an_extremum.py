"""A motion that begins at an extremum."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from problems import robots
from problems.methods import METHODS
from problems.paths.curves import circle
from problems.robots.robot import Robot
from problems.weightings.extended import extremum as condition_of
from problems.weightings.impedance import elastic
from sandbox.claims import constrained
from sandbox.claims.claim import Answer, Claim, CodePath, Evidence, Fault, Trial, at_most, every
from sandbox.claims.constrained import PLANAR, Springs
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.extended_jacobian.extrema import ROW, SOURCES, extrema, kinds, left_over, springs_of
from sandbox.method import Draw, Method
from sandbox.motion import follow
from sandbox.problem import VelocityProblem
from sandbox.tolerances import (
    CLOSED_CYCLE,
    INTEGRATION,
    UNIT,
)  # fmt: skip
from sandbox.weight import Weight

Array = np.ndarray


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
    whole: list[bool] = []
    shares: list[float] = []
    gaps: list[float] = []
    series: list[Series] = []
    rows: list[tuple[str, float, float | None, float]] = []
    for name in ("planar_3r", "planar_4r"):
        robot = robots.load(name)
        starts = _starts(robot, rng, path, trial.of(60, 20))
        for label, q0, g in starts if trial.full else [start for start in starts if start[0] == "minimum"]:
            given = {"stiffness": g.stiffness, "rest": g.rest}
            options = {"rtol": tolerance, "samples": trial.of(160, 24)}
            motion = following(ROW, robot, path, q0, **given, tolerance=np.inf, **options)
            share = np.array([left_over(robot, g, q) for q in motion.q])
            drawn_in = np.linspace(0, len(motion.t) - 1, trial.of(60, 8)).astype(int)
            guess, gap = q0, []
            for i in drawn_in:
                guess = extremum(PLANAR, g.gradient, motion.hand[i, :2], guess)
                gap.append(np.abs(motion.q[i] - guess).max())
            case = f"{name}, {label}"
            whole.append(not motion.stopped)
            shares += share.tolist()
            gaps += gap
            closed = float(np.abs(motion.q[-1] - q0).max())
            rows.append((case, float(share.max()), float(np.max(gap)), closed))
            series.append(Series(f"extended Jacobian, {case}", motion.t, np.maximum(share, UNIT), "line"))
            if label == "minimum":
                other = following(METHODS["gradient_projection"], robot, path, q0, alpha=0.0, **options)
                left = np.array([left_over(robot, g, q) for q in other.q])
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
            "largest share of the gradient left",
            "from the extremum by root finding [rad]",
            "joint drift after one round [rad]",
        ),
        tuple(rows),
    )
    checks = (
        every("the motion ends where the path does", whole),
        at_most(r"$|N_J^T \nabla g| / |\nabla g|$ along the path", shares, allowed),
        at_most("joints against the extremum found by itself at the same place of the hand: difference [rad]", gaps, allowed),
    )
    return Evidence(checks, (plot, table))


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


CLAIM = Claim(
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
)
