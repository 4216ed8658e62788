"""What W = I implies."""

from __future__ import annotations

import numpy as np

from problems import robots
from problems.methods.draw import generic
from sandbox.claims import equations
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_least, at_most, every
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.closed_form import CLOSED_FORMS
from sandbox.closed_form.eq6 import eq6
from sandbox.problem import VelocityProblem
from sandbox.solution import Solution
from sandbox.tolerances import LIMIT_MOTION

Array = np.ndarray

ARMS = {"planar_3r": "planar 3R", "planar_4r": "planar 4R", "panda": "Panda"}


def kept_identity(six: Answer) -> Answer:
    """The weight left at I whatever the joints are measured in."""

    def planted(problem: VelocityProblem) -> Solution:
        return six(VelocityProblem(J=problem.J, xdot=problem.xdot, W=np.eye(problem.n), a=problem.a))

    return planted


def in_units(J: Array, xdot: Array, W: Array, S: Array) -> VelocityProblem:
    """The same problem in joints p, q = S p: J S, and S'WS for W."""
    W = np.swapaxes(S, -1, -2) @ W @ S
    return VelocityProblem(J=J @ S, xdot=xdot, W=(W + np.swapaxes(W, -1, -2)) / 2)


def solved(six: Answer, problem: VelocityProblem, S: Array) -> tuple[Array, Array]:
    """Rates qdot = S pdot (B, n) [rad/s] and their relative bound (B,), in the joints p."""
    x = six(problem).x
    bound = CLOSED_FORMS["eq6"].bound(problem) * np.abs(x).max(axis=-1)
    return np.einsum("...ij,...j->...i", S, x), bound * np.linalg.norm(S, np.inf, axis=(-2, -1))


UNITS = (
    ("joint 2 in degrees", 2, np.pi / 180),
    ("joint 2 behind a gear of 100", 2, 1 / 100),
    ("joint 2 in turns", 2, 2 * np.pi),
)
"""What one joint is measured in, its number, and radians per unit."""


def printed_rates(printed: Answer, J: Array, xdot: Array, W: Array) -> tuple[Array, Array]:
    """Rates (B, n) of (2)-(5) as printed, in radians, and their bound (B,)."""
    x = np.stack([printed(J[i], xdot[i], W[i], np.zeros(J.shape[-1]), 0.0) for i in range(len(J))])
    bound = CLOSED_FORMS["eq2_5"].bound(VelocityProblem(J=J, xdot=xdot, W=W))
    return x, bound * np.abs(x).max(axis=-1)


def identity_rarely_ideal(trial: Trial, six: Answer, printed: Answer) -> Evidence:
    """W = I in other units is another motion; W carried over is the same."""
    rng = trial.rng("identity_rarely_ideal")
    rows: list[tuple[str | int | float, ...]] = []
    other_motion: list[Array] = []
    ratios: dict[str, list[Array]] = {name: [] for name in ("carried", "meant", "any", "turned")}
    for name, arm in ARMS.items():
        robot = robots.load(name)
        n, count = robot.n, trial.of(150, 8)
        q, xdot, _ = generic(robot, rng, count)
        J, eye = robot.jacobian(q), np.broadcast_to(np.eye(n), (count, n, n))
        radians, own = printed_rates(printed, J, xdot, eye)
        for words, joint, unit in UNITS:
            S = np.diag(np.where(np.arange(n) == joint - 1, unit, 1.0))
            naive, bound = solved(six, VelocityProblem(J=J @ S, xdot=xdot, W=eye), S)
            carried, other = solved(six, in_units(J, xdot, eye, S), S)
            meant, more = printed_rates(printed, J, xdot, np.broadcast_to(np.diag(np.diag(S) ** -2.0), eye.shape))
            apart, off = np.abs(naive - radians).max(axis=-1), np.abs(carried - radians).max(axis=-1)
            other_motion.append(apart > 10 * (bound + own))
            ratios["carried"].append(off / (other + own))
            ratios["meant"].append(np.abs(naive - meant).max(axis=-1) / (bound + more))
            size = np.abs(radians).max(axis=-1)
            rows.append((arm, words, count, float(np.median(apart / size)), float((off / size).max())))
        full = np.linalg.qr(rng.standard_normal((count, n, n)))[0] * rng.uniform(0.3, 3.0, (count, 1, n))
        W = make_definite(rng, count, n)
        expected, own_of_W = printed_rates(printed, J, xdot, W)
        carried, other = solved(six, in_units(J, xdot, W, full), full)
        ratios["any"].append(np.abs(carried - expected).max(axis=-1) / (np.linalg.cond(full) * (other + own_of_W)))
        turn = np.linalg.qr(rng.standard_normal((count, n, n)))[0]
        turned, other = solved(six, VelocityProblem(J=J @ turn, xdot=xdot, W=eye), turn)
        ratios["turned"].append(np.abs(turned - radians).max(axis=-1) / (other + own))
    plot, limits_ = _over_units(trial, six, printed)
    checks = (
        every(
            "one joint in another unit: $W = I$ gives another motion, beyond ten times the bounds",
            np.concatenate(other_motion),
        ),
        at_most("one joint in another unit: $S^T W S$ gives the same, difference / bounds", ratios["carried"], 1.0),
        at_most("any $S$, any $W$: $S^T W S$ gives the same, difference / bounds", ratios["any"], 1.0),
        at_most(
            "one joint in another unit: $W = I$ there is $S^{-T}S^{-1}$ in radians, difference / bounds", ratios["meant"], 1.0,
            role=Role.OURS,
        ),
        at_most("an orthogonal $S$ leaves $W = I$ as it is, difference / bounds", ratios["turned"], 1.0, role=Role.OURS),
        *limits_,
    )  # fmt: skip
    table = Table(
        "One joint measured in something else: how far $W = I$ then moves the arm from what it did in radians, and how far the "
        "weight carried over does",
        ("arm", "unit", "situations", "median relative change, $W = I$", "largest relative change, $S^T W S$"), tuple(rows),
    )  # fmt: skip
    return Evidence(checks, (plot, table))


def make_definite(rng: np.random.Generator, count: int, n: int) -> Array:
    """Positive definite matrices (count, n, n), eigenvalues in [1/2, 2)."""
    turn = np.linalg.qr(rng.standard_normal((count, n, n)))[0]
    W = (turn * rng.uniform(0.5, 2.0, (count, 1, n))) @ np.swapaxes(turn, -1, -2)
    return (W + np.swapaxes(W, -1, -2)) / 2


def _over_units(trial: Trial, six: Answer, printed: Answer) -> tuple[Plot, list[Check]]:
    """Rates of the planar 3R at a generic configuration for W = I, over what joint 2 is measured in."""
    q, xdot = np.array([[0.3, 1.1, -0.7]]), np.array([[0.3, -0.7]])
    J = robots.load("planar_3r").jacobian(q)
    units = np.logspace(-3, 3, trial.of(121, 25))
    found = []
    for unit in units:
        S = np.diag([1.0, unit, 1.0])
        found.append(solved(six, VelocityProblem(J=J @ S, xdot=xdot, W=np.eye(3)[None]), S)[0][0])
    x = np.array(found)
    without = np.zeros(3)
    without[[0, 2]] = np.linalg.solve(J[0][:, [0, 2]], xdot[0])
    # joint 2 for nothing: the others move as little as they can
    N = equations.null_space(J[0])[:, 0]
    particular = np.linalg.pinv(J[0]) @ xdot[0]
    free = particular - N * (N[[0, 2]] @ particular[[0, 2]]) / (N[[0, 2]] @ N[[0, 2]])
    checks = [
        at_most(
            "planar 3R, joint 2 in ever smaller units: the motion nears that with joint 2 locked, relative",
            np.abs(x[0] - without).max() / np.abs(without).max(),
            LIMIT_MOTION,
            role=Role.OURS,
        ),
        at_most(
            "planar 3R, joint 2 in ever larger units: it nears that in which joint 2 costs nothing, relative",
            np.abs(x[-1] - free).max() / np.abs(free).max(),
            LIMIT_MOTION,
            role=Role.OURS,
        ),
        at_least(
            "planar 3R: spread of joint 2's rate over the units, relative to its rate in radians",
            np.ptp(x[:, 1]) / abs(x[len(units) // 2, 1]),
            0.1,
        ),
    ]
    ends = [units[0], units[-1]]
    series = [Series(f"joint {i + 1}", units, x[:, i], "line") for i in range(3)]
    series += [
        Series(
            f"joint {i + 1}, SᵀWS",
            ends,
            [printed(J[0], xdot[0], np.eye(3), np.zeros(3), 0.0)[i]] * 2,
            "line",
            "other",
        )
        for i in range(3)
    ]
    series += [
        Series(words, [unit] * 2, [x.min(), x.max()], "vertical", "bound")
        for words, unit in (("radians", 1.0), ("degrees", np.pi / 180), ("turns", 2 * np.pi))
    ]
    return Plot(
        "Planar 3R at q = (0.3, 1.1, −0.7), $\\dot x$ = (0.3, −0.7): joint rates for $W = I$, over the unit that joint 2 is "
        "measured in. Small units lock the joint, large ones leave it free; with $S^T W S$ nothing changes.",
        Axis("unit of joint 2 [rad]", log=True), Axis("joint rate [rad/s]"), tuple(series),
    ), checks  # fmt: skip


CLAIM = Claim(
    name="identity_rarely_ideal",
    title="W = I sets the joints equal, and depends on their units",
    place="Section III, second paragraph",
    says=(
        "$W = I$ is useful for examples but in practice rarely ideal: it implies an equality between the effects of the joints "
        "that a practical manipulator design usually precludes."
    ),
    formula=r"q = S p: \quad J \to J S, \quad W \to S^T W S",
    tested=(
        r"What is equal depends on what joints are measured in. One joint in degrees, in turns, or behind a gear: the motion "
        r"for $W = I$ in each, and for the weight carried over; any nonsingular $S$, orthogonal ones, and units over six "
        "decades. How often a design precludes the equality is a judgement, and is not tested."
    ),
    accepted="$W = I$ gives another motion, beyond ten times the error bounds; $S^T W S$ gives the same, within them.",
    paths=(
        CodePath("eq. (6), column-pivoted LU, in the joints $p$", eq6),
        CodePath("eqs. (2)–(5) as printed, explicit inverses in numpy, in radians", equations.liegeois),
    ),
    examine=identity_rarely_ideal,
    fault=Fault("$W = I$ kept where the weight was to be carried over", kept_identity),
)
