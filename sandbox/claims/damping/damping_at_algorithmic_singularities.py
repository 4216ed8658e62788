"""One path through an algorithmic singularity."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems import paths, robots
from problems.original import damped_secondary
from sandbox.agreement import bounds
from sandbox.claims.claim import Answer, Claim, CodePath, Evidence, Fault, Role, Trial, at_least, at_most, every
from sandbox.claims.damping.law import DAMPED, law
from sandbox.claims.exhibit import Axis, Plot, Series, SeriesRole, Table
from sandbox.claims.postures import F1, HAND_ANGLE
from sandbox.law import rates
from sandbox.motion import Motion, follow
from sandbox.tolerances import MOTION_END, ORIGINAL, THROUGH, UNIT

Array = np.ndarray

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
            given = {"base": base, "E": HAND_ANGLE}
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
    singular = Series("singularity", [REACHED], [0], "vertical", "bound")
    checks = (
        every("damped, the hand follows the whole path", wholes),
        at_most("damped, joint rates against least squares in the self-motion: difference / bound",
                np.concatenate(agreed), 1.0),
        at_most(r"damped, the task itself is exact: $|J \dot q - \dot x|$ / rounding", np.concatenate(exact), 1.0),
        at_most(r"damped, joint rates / their bound $\sqrt{|J^+ \dot x|^2 + (\bar g - \nabla g^T J^+ \dot x)^2 / 4 \epsilon}$",
                np.concatenate(under), 1.0 + ORIGINAL * robot.n * UNIT),
        at_most(r"undamped, the motion ends at $2 - \sqrt 2$ m: distance [m]", [abs(ended - REACHED)], MOTION_END,
                role=Role.OURS),
        at_least("undamped, largest joint rate over the largest damped one", [undamped_peak / peak for peak in peaks], 1.0,
                 role=Role.OURS),
        every(rf"the smaller $\tilde W$, the faster the joints and the less the hand turns, by {BEFORE:g} m and at most",
              [all(np.diff(peaks) > 0), all(np.diff(early) < 0), all(np.diff(turned) < 0)], role=Role.OURS),
    )  # fmt: skip
    plots = (
        Plot("Planar 3R, the hand along (1, 1) from q = (0, π/2, −π/2) with its angle held: joint rates through an algorithmic "
        "singularity, where "
             rf"those of the undamped motion exceed $10^{{{int(np.log10(undamped_peak))}}}$ rad/s",
             Axis("way of the hand [m]", high=0.75), Axis("joint rates, 2-norm "
             "[rad/s]", log=True, low=1.0, high=100.0), (*curves, singular)),
        Plot("What damping costs: beyond the singularity the angle cannot be held at all; before it a small W̃ holds it better",
             Axis("way of the hand [m]", high=0.75), Axis("turn of the hand [rad]"), (*angles, singular)),
    )  # fmt: skip
    table = Table(
        "The same motions, and what the joint rates cannot exceed", ("weight", "way [m]", "largest rate [rad/s]", "its "
        "bound [rad/s]", "task error [m]",
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


CLAIM = Claim(
    name="damping_at_algorithmic_singularities",
    title="Damping takes the arm through algorithmic singularities",
    place="Section III, last paragraph",
    says="Damping moderates the joint rates. It is a method to address the occurrence of algorithmic singularities.",
    tested=r"The hand of the planar arm along a line on which its angle cannot be held beyond $2 - \sqrt 2$ m, undamped "
    r"and with $\tilde W = \epsilon I$ of six sizes.",
    accepted="Damped, the whole path is followed at bounded joint rates and the task is exact; undamped, the motion ends.",
    paths=(
        CodePath(r"eq. (6) with $W = \tilde W + \nabla g (\nabla g)^T$", rates),
        CodePath("a particular solution and least squares in the self-motion, numpy", damped_secondary.original),
    ),
    examine=damping_at_algorithmic_singularities,
    fault=Fault(r"$\tilde W$ put on the whole of $[J; E]$: $J \dot q \neq \dot x$", everything_damped),
    sources=DAMPED.works,
)
