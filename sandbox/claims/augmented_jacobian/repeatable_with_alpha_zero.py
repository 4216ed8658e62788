"""Closed paths by (6) with W of (8) and alpha = 0."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy import optimize
from scipy.spatial.transform import Rotation

from problems import paths, robots
from problems.methods import METHODS
from sandbox.claims.augmented_jacobian.method import AUGMENTED
from sandbox.claims.claim import Answer, Claim, CodePath, Evidence, Fault, Role, Trial, at_least, at_most
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.numbers import half_unit, told
from sandbox.claims.postures import F1, F2, HAND_ANGLE
from sandbox.law import rates
from sandbox.motion import Motion, follow
from sandbox.repeatability import drift, lie_brackets
from sandbox.tolerances import CLOSED_CYCLE

Array = np.ndarray

Law = Callable[[Array, Array], Array]

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
    parts = np.linspace(0.0, 1.0, trial.of(33, 5))[1:]
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
        displaced = np.abs(along - course.start).max(axis=-1)
        series.append(Series(course.words, [0.0, *parts], [0.0, *displaced], "line"))
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
        law = plain(framework, "damped_secondary", arm_3r, base=base, E=HAND_ANGLE)
        done = follow(law, arm_3r, square, F1, cycles=cycles, samples=1)
        moved, found = float(np.abs(drift(done)[0]).max()), lie_brackets(law, arm_3r, F1)
        lost.append(moved)
        rows.append((f"(8) beside W̃ = {base:g} I", "square", None, told(drift(done)[0]), moved, found.value, found.error))
        lines.append(Series(f"(8) beside W̃ = {base:g} I", counted, far(done), "line", "ours"))
    lines.append(
        Series("first cycle, by a separate program", [1, 1], [max(np.abs(d[2])) for d in DRIFTS.values()], role="bound")
    )
    lines.append(Series("the integration's own error", [1, cycles], [CLOSED_CYCLE] * 2, "line", "bound"))
    checks = (
        at_most(r"joint angles on the way: integrated by (6), against the root of $x(q) = x(t)$, $g(q) = g(q_0)$ [rad]",
                gaps, CLOSED_CYCLE),
        at_most("drift of the joints over a closed path [rad]", closed, CLOSED_CYCLE),
        at_most("Lie brackets of the law outside range $G$ / error of their differences", brackets, 1.0),
        at_most("pseudoinverse and inertia drift as a separate program found: difference / half a unit of its last digit",
                seen, 1.0, role=Role.OURS),
        at_least("and their Lie brackets lie outside range $G$: size / error", outside, 1.0, role=Role.OURS),
        at_least(r"with a base $\tilde W$ beside (8) the joints drift [rad]", lost, CLOSED_CYCLE, role=Role.OURS),
    )  # fmt: skip
    plots = (
        Plot("Planar 3R, the hand around a square of 0.4 m from q = (0, π/2, −π/2): how far the joints are from where "
        "they began",
             Axis("cycles"), Axis("largest joint displacement after the cycle [rad]", log=True), tuple(lines)),
        Plot("(8) with α = 0 along one cycle: the joints move, and come back", Axis("share of the cycle"),
             Axis("largest joint displacement [rad]"), tuple(series)),
    )  # fmt: skip
    table = Table(
        r"One closed path: what it leaves in the joints, and Lie brackets of the law, $|(I - GJ)[G_i, G_j]|$ relative",
        ("law", "path", "drift by a separate program [rad]", "ours [rad]", "largest drift [rad]", "bracket", "its error"),
        tuple(rows), 
    )  # fmt: skip
    return Evidence(checks, (*plots, table))


def far(motion: Motion) -> Array:
    """Largest displacement (cycles,) [rad, m] of a joint from where it began, after each cycle; rounding at least."""
    return np.maximum(np.abs(motion.postures[1:] - motion.postures[0]).max(axis=-1), np.finfo(float).eps)


CLAIM = Claim(
    name="repeatable_with_alpha_zero",
    title="W of (8) with α = 0 inherits the repeatability of the augmented Jacobian",
    place="Section III, after eq. (10)",
    says=r"Using $W$ of (8) with $\alpha = 0$ gives an algorithm that inherits the repeatability of the corresponding "
    "augmented Jacobian form.",
    tested="The hand follows closed paths. The joints are integrated to $10^{-12}$, and compared on the way with the "
    r"posture in which $x(q)$ and $g(q)$ have the values they must have. Lie brackets of the law; the drift of laws that "
    "are not repeatable.",
    accepted=r"The joints come back to within the integration's error, $10^{-10}$ rad a cycle, and all brackets lie in "
    "range $G$; those of laws that are not repeatable do not.",
    paths=(
        CodePath(r"eq. (6) with $W$ of (8) and $\alpha = 0$, integrated", rates),
        CodePath(r"the root of $x(q) = x(t)$, $g(q) = g(q_0)$, nothing integrated", optimize.root, "scipy.optimize:root"),
    ),
    examine=repeatable_with_alpha_zero,
    fault=Fault(r"a regularisation $0.01\,I$ left in $W$", base_left_in),
    sources=(
        "R. G. Roberts, A. A. Maciejewski, IEEE Trans. Automatic Control 38(5), 1993",
        "T. Shamir, Y. Yomdin, IEEE Trans. Automatic Control 33(11), 1988",
    ),
)
