"""Section III: damping a weight that is not positive definite."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from problems import paths, robots
from problems.methods import METHODS
from problems.methods.draw import scattered
from problems.original import damped_secondary
from sandbox.agreement import bounds
from sandbox.claims import equations
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_least, at_most, every
from sandbox.claims.exhibit import Axis, Plot, Series, SeriesRole, Table
from sandbox.closed_form import CLOSED_FORMS
from sandbox.closed_form.eq6 import eq6
from sandbox.closed_form.kernels import SOLVED
from sandbox.closed_form.uncompiled import eq6_exact
from sandbox.law import rates
from sandbox.motion import Motion, follow
from sandbox.problem import VelocityProblem
from sandbox.solution import Solution
from sandbox.tolerances import CLOSED_CYCLE, MOTION_END, ORIGINAL, REDUCED_ERROR, THROUGH, UNIT
from sandbox.weight import Weight

Array = np.ndarray

AUGMENTED, DAMPED = METHODS["augmented_jacobian"], METHODS["damped_secondary"]

F1 = np.array([0.0, np.pi / 2, -np.pi / 2])
J1 = np.array([[-1.0, -1, 0], [2, 1, 1]])
"""The Jacobian at F1."""

ANGLE = np.ones((1, 3))
"""Gradient of the hand's angle q_1 + q_2 + q_3, as a row."""


def told(values: Any, digits: int = 6) -> str:
    """A row of numbers as text."""
    rounded = np.round(np.asarray(values, dtype=float), 12) + 0.0
    return "(" + ", ".join(f"{value:.{digits}g}".replace("-", "−") for value in rounded) + ")"


# condition (7)

SIZES = ((1, 2), (2, 3), (2, 4), (4, 6), (6, 7), (3, 7))

DECADES = np.arange(0, 11)
"""Exponents -s of the size of W~ beside grad g grad g'."""

TINY = 2.0**-300
"""A W~ that floats would not see beside E'E."""


def subtracted(six: Answer) -> Answer:
    """W = grad g grad g' - W~."""

    def planted(problem: VelocityProblem) -> Solution:
        W = Weight(-problem.W.base, problem.W.E, problem.W.gamma)
        return six(VelocityProblem(J=problem.J, xdot=problem.xdot, W=W, a=problem.a))

    return planted


def conflicting(rng: np.random.Generator, m: int, n: int, count: int, bases: Array) -> VelocityProblem:
    """Whole-number J of full row rank and E (n - m, n) with its first row in range J': N'E' is exactly singular."""
    k, J, E = n - m, np.empty((count, m, n)), np.empty((count, n - m, n))
    for i in range(count):
        while True:
            rows = rng.integers(-3, 4, (m, n)).astype(float)
            if np.linalg.matrix_rank(rows) == m:
                break
        J[i], E[i] = rows, rng.integers(-3, 4, (k, n))
        mixed = np.zeros(n)
        while not mixed.any():
            mixed = rng.integers(-2, 3, m) @ rows
        E[i, 0] = mixed
    gbar = rng.uniform(-1, 1, (count, k))
    a = -np.einsum("bkn,bk->bn", E, gbar)
    return VelocityProblem(J=J, xdot=rng.uniform(-1, 1, (count, m)), W=Weight(bases, E), a=a)


def damping_secures_condition_seven(trial: Trial, six: Answer, reduced: Answer) -> Evidence:
    """W~ + E'E at exact algorithmic singularities: the pivots of (6) and the eigenvalues of N'WN; without W~; cases by hand."""
    rng = trial.rng("damping_secures_condition_seven")
    accepted, positive, floor, sizes, lowest = [], [], [], [], []
    exact: list[bool] = []
    bare: list[bool] = []
    for m, n in SIZES:
        count = trial.of(40, 3)
        for s in DECADES:
            base = scattered(rng, n, count) * 10.0**-s
            problem = conflicting(rng, m, n, count, base)
            assert problem.W.E is not None
            W = problem.W.dense()
            curvature = np.array([np.linalg.eigvalsh(reduced(problem.J[i], W[i]))[0] for i in range(count)])
            least = np.linalg.eigvalsh(base)[:, 0]
            rounding = ORIGINAL * n * UNIT * np.linalg.norm(W, axis=(1, 2))
            accepted.append([status.answered for status in six(problem).status])
            positive.append(curvature > 0)
            floor.append((curvature + rounding) / least)
            sizes.append(np.linalg.norm(base, 2, axis=(1, 2)) / np.linalg.norm(problem.W.E, 2, axis=(1, 2)) ** 2)
            lowest.append(curvature / np.linalg.norm(problem.W.E, 2, axis=(1, 2)) ** 2)
            if s == DECADES[-1]:
                for i in range(trial.of(4, 1)):
                    for base, kept in ((np.zeros((n, n)), bare), (TINY * np.eye(n), exact)):
                        one = VelocityProblem(
                            J=problem.J[i], xdot=problem.xdot[i], W=Weight(base, problem.W.E[i]), a=problem.a[i]
                        )
                        code, _, _, pivots = eq6_exact(one)
                        kept.append(code == SOLVED and min(pivots[m:]) > 0)
    said, true = np.concatenate(accepted), np.concatenate(positive)
    xdot, W3 = np.array([0.3, -0.7]), 0.01 * np.diag([1.0, 2, 3])
    cases = (
        ("$g = q_1 + q_2 + q_3$, $\\tilde W = 0.01\\,\\mathrm{diag}(1, 2, 3)$", np.array([[1.0, 1, 1]]), W3,
         (-1.526415094340, 1.226415094340, 1.126415094340), 12),
        ("$g = q_1 + q_2$, algorithmic singularity, $\\tilde W = 0.01\\,I$", np.array([[1.0, 1, 0]]), 0.01 * np.eye(3),
         tuple(np.linalg.pinv(J1) @ xdot), 15),
    )  # fmt: skip
    rows, ratios = [], []
    for words, e, base, expected, decimals in cases:
        problem = VelocityProblem(J=J1, xdot=xdot, W=Weight(base, e), a=-0.9 * e[0]).stacked()
        x = six(problem).x[0]
        allowed = max(CLOSED_FORMS["eq6"].bound(problem)[0] * np.abs(expected).max(), 0.5 * 10.0**-decimals)
        ratios.append(np.abs(x - expected).max() / allowed)
        plain = six(VelocityProblem(J=J1, xdot=xdot, W=Weight(np.zeros((3, 3)), e), a=-0.9 * e[0]).stacked())
        rows.append((words, told(expected, 12), told(x, 12), told(plain.x[0]) if plain.status[0].answered else "refused",
                     float(np.linalg.eigvalsh(reduced(J1, base + e.T @ e))[0])))  # fmt: skip
    checks = (
        every("eq. (6) accepts $\\tilde W + E^T E$ at an exact algorithmic singularity, by its pivots", said),
        every(r"it says what the eigenvalues of $N_J^T W N_J$ say", said == true),
        at_least(r"$(\lambda_{\min}(N_J^T W N_J)$ + rounding$) / \lambda_{\min}(\tilde W)$", np.concatenate(floor), 1.0),
        every(r"on rationals the last $n - m$ pivots are positive even for $\tilde W = 2^{-300} I$", exact, role=Role.OURS),
        every(r"and without $\tilde W$ one of them is not, in each", np.logical_not(bare), role=Role.OURS),
        at_most("cases worked out by hand (M19): difference / bound", ratios, 1.0, role=Role.OURS),
    )  # fmt: skip
    size, low = np.concatenate(sizes), np.concatenate(lowest)
    guide = np.array([size.min(), size.max()])
    shown = slice(None, None, max(1, len(size) // 900))
    plot = Plot(
        r"At exact algorithmic singularities: the smallest eigenvalue of N'WN grows with W̃, and is nothing without it",
        Axis("|W̃| / |E|²", log=True), Axis("smallest eigenvalue of N'WN, over |E|²", log=True),
        (Series("one situation", size[shown], low[shown], text=["accepted" if ok else "refused" for ok in said[shown]]),
         Series("W̃ = ε I: ε", guide, guide, "line", "bound"), Series("rounding, n u", guide, [7 * UNIT] * 2, "line", "bound")),
    )  # fmt: skip
    table = Table(
        r"F1, $\dot x = (0.3, -0.7)$, $\bar g = 0.9$ (methods M19): joint rates of the damped augmented Jacobian [rad/s]",
        ("case", "methods", "ours", "undamped", r"$\lambda_{\min}(N_J^T W N_J)$"), tuple(rows), paper=("methods",),
    )  # fmt: skip
    return Evidence(checks, (plot, table))


# through an algorithmic singularity

SIZES_OF_BASE = (1.0, 0.3, 0.1, 0.03, 0.01, 0.001)

REACHED = 2 - np.sqrt(2)
"""Way [m] of the hand along (1, 1) from F1 at which the first two links are in line, q_2 = 0 = det [J; 1 1 1]."""

BEFORE = 0.4
"""Way [m] at which the secondary error is read, well before that."""


def everything_damped(framework: Answer) -> Answer:
    """Damped least squares on the whole of [J; E] (Seraji, Colbaugh): the task itself is no longer met."""

    def planted(method: Any, robot: Any, q: Array, xdot: Array, **parameters: Any) -> Array:
        if method is not DAMPED:
            return framework(method, robot, q, xdot, **parameters)
        E = np.broadcast_to(parameters["E"], (len(q), 1, robot.n))
        A = np.concatenate([robot.jacobian(q), E], axis=1)
        b = np.concatenate([xdot, np.zeros((len(q), 1))], axis=1)
        At, W = np.swapaxes(A, 1, 2), parameters["base"] * np.eye(robot.n)
        return np.linalg.solve(At @ A + W, At @ b[..., None])[..., 0]

    return planted


def law(framework: Answer, robot: Any, base: float) -> Callable[[Array, Array], Array]:
    """The augmented Jacobian that holds the hand's angle, damped by `base` times I; undamped for 0."""
    method, given = (DAMPED, {"base": base}) if base else (AUGMENTED, {})

    def one(q: Array, xdot: Array) -> Array:
        found: Array = framework(method, robot, q[None], xdot[None], E=ANGLE, **given)
        return found[0]

    return one


def damping_at_algorithmic_singularities(trial: Trial, framework: Answer, solved: Answer) -> Evidence:
    """One path through an algorithmic singularity, undamped and damped by six sizes: rates, task, hand angle."""
    robot = robots.load("planar_3r")
    path = paths.load("through_algorithmic_singularity")
    sizes = SIZES_OF_BASE if trial.full else (1.0, 1e-2)
    agreed, exact, under, turned, early, wholes, rows = [], [], [], [], [], [], []
    curves, angles, peaks = [], [], []
    ended = 0.0
    for base in (0.0, *sizes):
        done = follow(law(framework, robot, base), robot, path, F1, samples=trial.of(200, 40), rtol=THROUGH)
        way = np.linalg.norm(path.displacement(done.t), axis=-1)
        speed, J = np.linalg.norm(done.qdot, axis=-1), robot.jacobian(done.q)
        residual = np.linalg.norm(np.einsum("tmn,tn->tm", J, done.qdot) - done.xdot, axis=-1)
        angle = np.abs(done.q.sum(axis=-1) - F1.sum())
        error = float(np.linalg.norm(done.task_error, axis=-1).max())
        label = f"W̃ = {base:g} I" if base else "undamped"
        before = float(np.interp(BEFORE, way, angle))
        least = rate_bound(done, robot, base)
        if base:
            given = {"base": base, "E": ANGLE}
            problem = DAMPED.cast(robot, done.q, done.xdot, **given)
            other = solved(robot, done.q, done.xdot, **given)
            agreed.append(np.abs(done.qdot - other).max(axis=-1) / sum(bounds(DAMPED, problem, done.qdot, given)))
            exact.append(residual / (ORIGINAL * robot.n * UNIT * np.linalg.norm(J, axis=(1, 2)) * speed))
            under.append(speed / least)
            turned.append(float(angle.max()))
            early.append(before)
            wholes.append(not done.stopped)
            peaks.append(float(speed.max()))
        else:
            ended, undamped_peak = float(way[-1]), float(speed.max())
        rows.append((label, float(way[-1]), float(speed.max()), float(least.max()) if base else None, error, before,
                     float(angle.max())))  # fmt: skip
        kept = thinned(speed, way)
        role: SeriesRole = "ours" if base else "other"
        curves.append(Series(label, way[kept], speed[kept], "line", role))
        angles.append(Series(label, way[kept], angle[kept], "line", role))
    singular = Series("algorithmic singularity", [REACHED], [0], "vertical", "bound")
    checks = (
        every("damped, the hand follows the whole path", wholes),
        at_most("damped, joint rates against least squares in the self-motion: difference / bound",
                np.concatenate(agreed), 1.0),
        at_most(r"damped, the task itself is exact: $|J \dot q - \dot x|$ / rounding", np.concatenate(exact), 1.0),
        at_most(r"damped, joint rates / $\sqrt{|J^+ \dot x|^2 + (\bar g - \nabla g^T J^+ \dot x)^2 / 4 \epsilon}$",
                np.concatenate(under), 1.0 + ORIGINAL * robot.n * UNIT),
        at_most(r"undamped, the motion ends at $2 - \sqrt 2$ m: distance [m]", [abs(ended - REACHED)], MOTION_END,
                role=Role.OURS),
        at_least("undamped, largest joint rate over the largest damped one", [undamped_peak / peak for peak in peaks], 1.0,
                 role=Role.OURS),
        every(rf"the smaller $\tilde W$, the faster the joints, the less the hand turns by {BEFORE:g} m, and at most",
              [all(np.diff(peaks) > 0), all(np.diff(early) < 0), all(np.diff(turned) < 0)], role=Role.OURS),
    )  # fmt: skip
    plots = (
        Plot("Planar 3R, the hand along (1, 1) from F1 with its angle held: joint rates through an algorithmic singularity",
             Axis("way of the hand [m]"), Axis("joint rates, 2-norm [rad/s]", log=True), (*curves, singular)),
        Plot("What it costs: beyond the singularity the angle cannot be held, before it a small W̃ holds it better",
             Axis("way of the hand [m]"), Axis("turn of the hand [rad]"), (*angles, singular)),
    )  # fmt: skip
    table = Table(
        "The same motions", ("weight", "way [m]", "largest rate [rad/s]", r"its bound", "task error [m]",
                             f"turn at {BEFORE:g} m [rad]", "largest turn [rad]"), tuple(rows),
    )  # fmt: skip
    return Evidence(checks, (*plots, table))


def rate_bound(done: Motion, robot: Any, base: float) -> Array:
    """What the joint rates (T,) cannot exceed for W~ = base I.

    Qdot = q_p + n y, q_p = J^+ xdot, y = s (gbar - e'q_p) / (s^2 + base) with s = e'n: |y| <= |gbar - e'q_p| / (2 base^(1/2)).
    """
    particular = (np.linalg.pinv(robot.jacobian(done.q)) @ done.xdot[..., None])[..., 0]
    missing = particular.sum(axis=-1)  # gbar = 0
    bound: Array = np.sqrt((particular**2).sum(axis=-1) + (missing**2 / (4 * base) if base else np.inf))
    return bound


def thinned(speed: Array, way: Array, most: int = 160) -> Array:
    """Members that show a curve: evenly along the way, and the fastest."""
    even = np.unique(np.searchsorted(way, np.linspace(way[0], way[-1], most)))
    return np.unique(np.concatenate([np.minimum(even, len(way) - 1), np.argsort(speed)[-10:]]))


# task errors

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
        Example("past, rates limited", past, folded(-0.6, 0.1), LIMIT),
        Example("through, rates limited", through, F1, LIMIT),
        Example("through, no limits", through, F1, np.inf),
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
    given = {"E": ANGLE, "base": np.array(sizes)[:, None, None] * np.eye(robot.n)}

    def undamped(q: Array, xdot: Array) -> Array:
        return np.asarray(framework(AUGMENTED, robot, q, xdot, E=ANGLE))

    def damped(q: Array, xdot: Array) -> Array:
        return np.asarray(framework(DAMPED, robot, q, xdot, **given))

    for example in chosen:
        alone = controlled(undamped, robot, example, 1, steps)
        several = controlled(damped, robot, example, len(sizes), steps)
        for i, base in enumerate(sizes):
            own = {"E": ANGLE, "base": base}
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
        at_most("largest task error with the best of the $\\tilde W$ tried, over the undamped one", best, REDUCED_ERROR),
        at_most("joint rates on the way against least squares in the self-motion, cut to the same limits: difference / bound",
                np.concatenate(agreed), 1.0),
        at_most(r"every $\tilde W$ tried: largest task error over the undamped one", np.concatenate(ratios), 1.0,
                role=Role.REACH, range=where(chosen, sizes, ratios, free_of_error)),
        Check("the same where joint rates are neither cut nor held: the damped error is below the undamped one",
              free_of_error[1] < free_of_error[0] - CLOSED_CYCLE, f"{free_of_error[1]:.1e} m against {free_of_error[0]:.1e} m",
              "smaller", len(free_of_error), Role.REACH, where(chosen, sizes, ratios, free_of_error)),
        at_most("where they are neither cut nor held, the task error is the integration's, damped or not [m]", free_of_error,
                CLOSED_CYCLE, role=Role.OURS),
    )  # fmt: skip
    plots = (
        Plot(f"Planar 3R {shown.words} of {LIMIT:g} rad/s: the hand's error under control by held rates", Axis("time [s]"),
             Axis("task error [m]", log=True), tuple(curves)),
        Plot("Largest task error against the size of the base W̃", Axis("ε, W̃ = ε I", log=True),
             Axis("largest task error [m]", log=True), tuple(dots)),
    )  # fmt: skip
    table = Table(
        "Largest task errors, joint rates and turns of the hand",
        ("example", r"$\tilde W$", "task error [m]", "largest rate [rad/s]", "turn of the hand [rad]"),
        tuple(rows),
    )
    return Evidence(checks, (*plots, table))


def where(chosen: tuple[Example, ...], sizes: tuple[float, ...], ratios: list[Array], free: list[float]) -> str:
    """For which bases the task error shrank, by example; and where there is none to shrink."""
    parts = []
    for example, ratio in zip(chosen, ratios, strict=True):
        good = [f"{base:g}" for base, share in zip(sizes, ratio, strict=True) if share <= 1]
        parts.append(
            rf"{example.words}: with $\epsilon$ of {', '.join(good) or 'none'}, to between {ratio.min():.2g} and "
            f"{ratio.max():.2g} of the undamped error"
        )
    return (
        rf"errors of the hand that come from joint rates cut to their limits, or held over a controller's step "
        rf"($\tilde W = \epsilon I$; {'; '.join(parts)}). Without these $J \dot q = \dot x$ keeps the hand within "
        f"{max(free):.1e} m, damped or not, and damping has nothing to reduce"
    )


CLAIMS = (
    Claim(
        name="damping_secures_condition_seven",
        title="Damping makes condition (7) hold everywhere",
        place="Section III, last paragraph; eq. (7)",
        says=r"A weight that is not positive definite can be made more robust by damping: $W = \tilde W + \nabla g "
        r"(\nabla g)^T$ with $\tilde W$ positive definite and of small relative norm.",
        formula=r"W = \tilde W + \nabla g (\nabla g)^T, \quad \tilde W > 0 \quad \Rightarrow \quad N_J^T W N_J > 0",
        tested=r"Whole-number $J$ and gradients that are in conflict exactly, in six sizes with up to four degrees of "
        r"redundancy; $\tilde W$ over ten decades; and cases worked out by hand.",
        accepted=r"(6) accepts every one, as do the eigenvalues of $N_J^T W N_J$, which are at least "
        r"$\lambda_{\min}(\tilde W)$.",
        paths=(
            CodePath("eq. (6), condition (7) read from the pivots of its LU", eq6),
            CodePath("eigenvalues of $N_J^T W N_J$, $N_J$ by singular values, numpy", equations.reduced_weight),
        ),
        examine=damping_secures_condition_seven,
        fault=Fault(r"$\tilde W$ subtracted", subtracted),
        sources=("methods.md M19",),
    ),
    Claim(
        name="damping_at_algorithmic_singularities",
        title="Damping takes the arm through algorithmic singularities",
        place="Section III, last paragraph",
        says="Damping moderates the joint rates; it is a method to address the occurrence of algorithmic singularities.",
        tested=r"The hand of the planar arm along a line on which its angle cannot be held beyond $2 - \sqrt 2$ m, undamped "
        r"and with $\tilde W = \epsilon I$ of six sizes.",
        accepted="Damped, the whole path is followed at bounded joint rates and the task is exact; undamped, the motion ends.",
        paths=(
            CodePath(r"eq. (6) with $W = \tilde W + \nabla g (\nabla g)^T$", rates),
            CodePath("a particular solution and least squares in the self-motion, numpy", damped_secondary.original),
        ),
        examine=damping_at_algorithmic_singularities,
        fault=Fault(r"$\tilde W$ put on the whole of $[J; E]$: $J \dot q \neq \dot x$", everything_damped),
        sources=("methods.md M19",),
    ),
    Claim(
        name="damping_reduces_task_errors",
        title="Damping can reduce task errors",
        place="Section III, last paragraph",
        says="Examples of using this damping technique to reduce task errors are given in [27].",
        tested=r"[27] is not known for certain, and its examples are not repeated. As $J \dot q = \dot x$ holds damped or not, "
        "a task error must come from elsewhere: from joint rates cut to their limits, or held over a controller's step. Three "
        "examples of that kind are ours.",
        accepted=r"In every example some $\tilde W$ at least halves the largest error of the hand.",
        paths=(
            CodePath(r"eq. (6) with $W = \tilde W + \nabla g (\nabla g)^T$, rates cut and held", rates),
            CodePath("a particular solution and least squares in the self-motion, numpy", damped_secondary.original),
        ),
        examine=damping_reduces_task_errors,
        fault=Fault(r"$\tilde W$ left out", base_forgotten),
        sources=("Seraji, Colbaugh 1990 (plausible for [27])", "methods.md M19"),
    ),
)
