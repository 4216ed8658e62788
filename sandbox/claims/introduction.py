"""Section I, and what Section III shows of it: which methods the framework takes, and which it leaves out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from problems import robots
from problems.methods import METHODS
from sandbox.agreement import bounds
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Trial, at_least, at_most, every
from sandbox.claims.exhibit import Axis, Plot, Series, SeriesRole, Table
from sandbox.claims.scatter import beside, drawable, thinned
from sandbox.law import answer, rates
from sandbox.method import Draw, Method, Robot
from sandbox.problem import VelocityProblem
from sandbox.solution import Solution
from sandbox.stacked import eigenvalues, symmetric, times, transpose
from sandbox.tolerances import FORWARD, TASK_MISSED, UNIT

Array = np.ndarray

ARMS = ("planar_3r", "planar_4r", "panda")
ON_ARMS = "planar 3R, planar 4R and Panda"
"""One degree of redundancy in the plane, two, and one of a real arm."""

EXACT = tuple(method for method in METHODS.values() if method.task == "exact")
"""The methods that give J qdot = xdot: M1 to M19."""

OUTSIDE = (METHODS["damped_least_squares"], METHODS["jacobian_transpose"])
"""The exceptions that the paper names."""


class Situation(NamedTuple):
    """A method on an arm in B seeded situations, as cast."""

    method: Method
    robot: Robot
    drawn: Draw
    problem: VelocityProblem


def situations(methods: Sequence[Method], arms: Sequence[str], rng: np.random.Generator, count: int) -> Iterator[Situation]:
    """Every method on every arm, in `count` situations that the method draws inside its own domain."""
    for method in methods:
        for arm in arms:
            robot = robots.load(arm)
            drawn = method.draw(robot, rng, count)
            yield Situation(method, robot, drawn, method.cast(robot, drawn.q, drawn.xdot, **drawn.parameters))


def listed(methods: Sequence[Method]) -> tuple[str, ...]:
    """Their ids, for an axis."""
    return tuple(method.id for method in methods)


def task_error(problem: VelocityProblem, qdot: Array) -> Array:
    """|J qdot - xdot| (B,) [m/s, rad/s]."""
    return np.linalg.norm(times(problem.J, qdot) - problem.xdot, axis=-1)


def damped_a_little(law: Answer) -> Answer:
    """Every law answered through J'(JJ' + lambda^2 I)^-1 J, lambda = 1e-3, to be on the safe side of singularities."""

    def planted(method: Method, robot: Robot, q: Array, xdot: Array, **parameters: Any) -> Array:
        J = robot.jacobian(q)
        step = times(J, law(method, robot, q, xdot, **parameters))
        gram = J @ transpose(J) + 1e-6 * np.eye(robot.m)
        return times(transpose(J), np.linalg.solve(gram, step[..., None])[..., 0])

    return planted


def exceptions(trial: Trial, law: Answer, original: Answer) -> Evidence:
    """|J qdot - xdot| of every exact method and of the two exceptions, as the framework and as their authors find it."""
    rng, methods = trial.rng("exceptions"), (*EXACT, *OUTSIDE)
    kept: dict[str, list[tuple[Array, Array, Array, Array]]] = {method.id: [] for method in methods}
    for method, robot, drawn, problem in situations(methods, ("planar_3r", "panda"), rng, trial.of(30, 3)):
        x = law(method, robot, drawn.q, drawn.xdot, **drawn.parameters)
        other = original(method, robot, drawn.q, drawn.xdot, **drawn.parameters)
        size = np.linalg.norm(problem.J, 2, axis=(-1, -2))
        rounding = FORWARD * problem.n * UNIT * (size * np.linalg.norm(x, axis=-1) + np.linalg.norm(problem.xdot, axis=-1))
        # an original may be off by its bound in every joint, and J carries that to the hand
        theirs = rounding + size * np.sqrt(problem.n) * bounds(method, problem, x, drawn.parameters)[1]
        kept[method.id].append((task_error(problem, x), task_error(problem, other), rounding, theirs))
    found = {name: tuple(np.concatenate(parts) for parts in zip(*rows, strict=True)) for name, rows in kept.items()}
    inside, outside = ([found[method.id] for method in part] for part in (EXACT, OUTSIDE))
    checks: list[Check] = [
        at_most(
            r"exact methods, sandbox: $|J\dot q - \dot x|$ / rounding of $J\dot q$",
            np.concatenate([ours / rounding for ours, _, rounding, _ in inside]), 1.0,
        ),
        at_most(
            r"exact methods, original formulation: $|J\dot q - \dot x|$ / its bound",
            np.concatenate([other / theirs for _, other, _, theirs in inside]), 1.0,
        ),
    ]  # fmt: skip
    for method, (ours, other, rounding, theirs) in zip(OUTSIDE, outside, strict=True):
        checks += [
            at_least(rf"{method.title}: $|J\dot q - \dot x|$ / rounding of $J\dot q$", ours / rounding, TASK_MISSED),
            at_most(
                f"{method.title}: task error, sandbox and original formulation differ / sum of bounds",
                np.abs(ours - other) / (rounding + theirs), 1.0,
            ),
        ]  # fmt: skip
    spread = [(place, found[method.id]) for place, method in enumerate(methods)]
    abscissae = np.concatenate([beside(place, len(parts[0])) for place, parts in spread])
    roles: tuple[tuple[str, int, SeriesRole], ...] = (
        ("sandbox", 0, "ours"),
        ("original formulation", 1, "other"),
        ("rounding of Jq̇", 2, "bound"),
    )
    series = tuple(
        Series(name, thinned(abscissae), thinned(drawable(np.concatenate([parts[i] for _, parts in spread]))), role=role)
        for name, i, role in roles
    )
    plot = Plot(
        "Task error of the exact methods M1–M19, of damped least squares (C1) and of the Jacobian transpose (C2), in some of "
        "the situations; an error of zero is drawn at the foot. Whatever $W$ and $a$ are, (6) gives $J\\dot q = \\dot x$: no "
        "$W$ and $a$ give the answers of C1 and C2.",
        Axis("method", categories=listed(methods)), Axis("|Jq̇ − ẋ| [m/s, rad/s]", log=True), series,
    )  # fmt: skip
    table = Table(
        "Task error $|J\\dot q - \\dot x|$ of the sandbox, over planar 3R and Panda [m/s, rad/s]",
        ("id", "method", "reference in the paper", "situations", "largest", "smallest"),
        tuple(
            (m.id, m.title, m.number, len(found[m.id][0]), float(found[m.id][0].max()), float(found[m.id][0].min()))
            for m in (*OUTSIDE, *EXACT)
        ),
        paper=("reference in the paper",),
    )
    return Evidence(tuple(checks), (plot, table))


def compliance_for_stiffness(six: Answer) -> Answer:
    """The inverse of W in its place: a compliance where a stiffness is meant."""

    def planted(method: Method, robot: Robot, problem: VelocityProblem, *rest: Any, **options: Any) -> Solution:
        W = symmetric(np.linalg.pinv(problem.W.dense(), hermitian=True))
        turned = VelocityProblem(J=problem.J, xdot=problem.xdot, W=W, a=problem.a)
        return six(method, robot, turned, *rest, **options)

    return planted


def methods_can_be_cast(trial: Trial, six: Answer, original: Answer) -> Evidence:
    """Every exact method as cast beside its own original formulation, measured by the sum of two bounds."""
    rng, count = trial.rng("methods_can_be_cast"), trial.of(60, 3)
    ratios: dict[str, list[Array]] = {method.id: [] for method in EXACT}
    differences: dict[str, list[Array]] = {method.id: [] for method in EXACT}
    allowed: dict[str, list[Array]] = {method.id: [] for method in EXACT}
    indefinite: dict[str, list[Array]] = {method.id: [] for method in EXACT}
    for method, robot, drawn, problem in situations(EXACT, ARMS, rng, count):
        x = six(method, robot, problem, drawn.parameters, on_refusal="status").x
        other = original(method, robot, drawn.q, drawn.xdot, **drawn.parameters)
        size = np.abs(other).max(axis=-1)
        differences[method.id].append(np.abs(x - other).max(axis=-1) / size)
        allowed[method.id].append(sum(bounds(method, problem, other, drawn.parameters)) / size)
        ratios[method.id].append(differences[method.id][-1] / allowed[method.id][-1])
        spread = eigenvalues(problem.W.dense())
        indefinite[method.id].append(spread[:, 0] < -FORWARD * problem.n * UNIT * np.abs(spread).max(axis=-1))
    agreed = {name: np.concatenate(parts) <= 1 for name, parts in ratios.items()}  # NaN, a refusal, does not agree
    checks = tuple(every(f"framework = original within the sum of bounds: {m.id}, {m.title}", agreed[m.id]) for m in EXACT)
    rows = tuple(
        (
            m.id, m.title, m.number, m.certainty, m.weight, m.vector, f"{int(agreed[m.id].sum())} of {agreed[m.id].size}",
            float(np.concatenate(ratios[m.id]).max()), int(np.concatenate(indefinite[m.id]).sum()),
        )
        for m in EXACT
    )  # fmt: skip
    table = Table(
        f"Every exact method, in {count} situations on each of {ON_ARMS}. The numbers in brackets are the paper's; which works "
        "they stand for is our reading, as sure as the fourth column says",
        (
            "id", "method", "reference in the paper", "attribution", "$W$", "$a$", "agreed", "largest difference / bounds",
            "$W$ indefinite in",
        ),
        rows, paper=("reference in the paper",),
    )  # fmt: skip
    abscissae = thinned(np.concatenate([beside(place, agreed[m.id].size) for place, m in enumerate(EXACT)]))
    difference, bound = (
        thinned(np.concatenate([part for m in EXACT for part in parts[m.id]])) for parts in (differences, allowed)
    )
    plot = Plot(
        "Relative difference between framework and original formulation, in some of the situations; one of zero is drawn at "
        "the foot",
        Axis("method", categories=listed(EXACT)), Axis("relative difference of the joint rates", log=True),
        (
            Series("difference", abscissae, drawable(difference)),
            Series("sum of bounds", abscissae, bound, role="bound"),
        ),
    )  # fmt: skip
    return Evidence(checks, (table, plot))


CLAIMS = (
    Claim(
        name="methods_can_be_cast",
        title="Many well-known velocity-control methods are one framework",
        place="Section I, Section III and Section VII",
        says=r"Many well-known velocity-control methods can be cast as (2), and as (6), by a choice of $W$, $f$ and $\alpha$.",
        tested=(
            r"Each of 19 methods is written twice: cast as $W$ and $a = \alpha\nabla f$ and solved by (6), and in its original "
            "formulation, as published or, where it is not known which work the paper cites, as we read it. On planar 3R, "
            "planar 4R and Panda, in configurations, task velocities and parameters drawn at random inside the method's own "
            "domain."
        ),
        accepted="In every situation the two differ by no more than the sum of their error bounds.",
        paths=(
            CodePath("the method as cast, answered by eq. (6)", answer),
            CodePath("the original formulation, from numpy and the arm alone", Method.witness),
        ),
        examine=methods_can_be_cast,
        fault=Fault("the inverse of $W$ in its place, a compliance for a stiffness", compliance_for_stiffness),
    ),
    Claim(
        name="exceptions",
        title="The exceptions are the methods that miss the task velocity",
        place="Section I",
        says=(
            r"Exceptions are methods that do not give the exact prescribed $\dot x$, such as damped least squares [2], [3] and "
            "Jacobian transpose schemes [4]."
        ),
        formula=r"\dot x = J\dot q",
        tested=(
            r"$|J\dot q - \dot x|$ of 19 exact methods and of the two exceptions, in situations of their own on planar 3R and "
            "Panda; once as the sandbox computes them and once by their original formulations. The sandbox finds damped least "
            "squares by (6) too, but on another arm: one with a slack joint for every task row."
        ),
        accepted=(
            r"Exact methods: within rounding of $J\dot q$. Exceptions: a million times beyond it, by the same amount in both "
            r"formulations. No $W$ and $a$ can then have that answer, for (6) always meets its first rows."
        ),
        paths=(
            CodePath("the sandbox's law: a cast answered by its closed form", rates),
            CodePath("the original formulation, from numpy and the arm alone", Method.witness),
        ),
        examine=exceptions,
        fault=Fault(r"every law damped a little, $\lambda = 10^{-3}$, to be safe near singularities", damped_a_little),
    ),
)
