"""Damped least squares through singularities."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from problems import robots
from problems.methods import METHODS
from problems.original import damped_least_squares as damped_original
from sandbox.agreement import bounds
from sandbox.claims.arms import ARMS
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_most
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.singularities.approach import BENT, NAMES, SPEED, TURN, approach, norms, singular_values, stretching
from sandbox.closed_form.damped_least_squares import damped_least_squares
from sandbox.closed_form.eq13 import eq13
from sandbox.problem import VelocityProblem
from sandbox.solution import Solution
from sandbox.tolerances import FORWARD, ORIGINAL, UNIT

Array = np.ndarray

DAMPINGS = (0.03, 0.1, 0.3)
"""lambda [m] along the paths; with hand speed 0.25 m/s, 0.1 keeps |qdot| below 1.25 rad/s."""

DAMPED_BY_HAND = ((Fraction(-1, 12), Fraction(1, 4)), (Fraction(-1, 3), Fraction(0)), (Fraction(1, 4), Fraction(1, 4)))
"""(J'J + I)^-1 J' of that arm, lambda = 1."""


def damped_least_squares_at_singularities(trial: Trial, damped: Answer, original: Answer) -> Evidence:
    """Damped least squares as (6) on the arm with slack joints, against its formula by singular values."""
    rng = trial.rng("damped_least_squares_at_singularities")
    method = METHODS["damped_least_squares"]
    agree, bound, change, lost, rows = [], [], [], [], []
    rate_plot, error_plot, predicted = [], [], []
    t = np.sort(np.concatenate([np.linspace(-0.5, 0.5, trial.of(161, 81)), np.linspace(-0.02, 0.02, trial.of(81, 41))]))
    ways = [("planar 3R through its full stretch", stretching(TURN))]
    ways += [(f"{ARMS[name]} through a singularity", approach(robots.load(name), rng)) for name in ("panda", "seven_joint")]
    for name, one in ways if trial.full else ways[:2]:
        q, n = one.q(t), one.robot.n
        problem = one.problem(t)
        u, sigma, _ = singular_values(problem.J)
        component = np.abs(u @ one.xdot)
        for damping in DAMPINGS:
            x = damped(problem, damping=damping).x
            other = original(one.robot, q, problem.xdot, damping=damping)
            agree.append(np.abs(x - other).max(axis=1) / sum(bounds(method, problem, x, {"damping": damping})))
            bound.append(norms(x) * 2 * damping / SPEED)
            step = np.linalg.norm(np.diff(problem.J, axis=0), 2, axis=(1, 2))
            moved = norms(np.diff(x, axis=0))
            # |d (J'(JJ' + l^2)^-1)| <= (1 + 1/4) |dJ| / l^2, and rounding
            smooth = 1.25 * step * SPEED / damping**2 + 2 * ORIGINAL * n * UNIT * SPEED / damping
            change.append(moved / np.maximum(smooth, UNIT))
            miss = (problem.J @ x[:, :, None])[:, :, 0] - problem.xdot
            share = damping**2 / (sigma[:, -1] ** 2 + damping**2)
            rounding = ORIGINAL * n * UNIT * (1 + sigma[:, 0] / damping)
            lost.append(np.abs(np.abs((u * miss).sum(axis=1)) - share * component) / rounding)
            rows.append((name, damping, float(norms(x).max()), SPEED / (2 * damping), float(norms(miss).max() / SPEED),
                         float((np.abs(x) / one.robot.rate_limits).max())))  # fmt: skip
            if name == ways[0][0]:
                ends, ceiling = [t[0], t[-1]], [SPEED / 2 / damping] * 2
                rate_plot.append(Series(rf"$\lambda = {damping:g}$", t, norms(x), "line"))
                rate_plot.append(Series(rf"$|\dot x|/(2\lambda)$, $\lambda = {damping:g}$", ends, ceiling, "line", "bound"))
                error_plot.append(Series(rf"$\lambda = {damping:g}$", t[::3], norms(miss)[::3] / SPEED))
                predicted += [*(share * component / SPEED), np.nan]
        if name == ways[0][0]:
            size = norms(eq13(problem).x)
            rate_plot.append(Series("(13), exact off the singularity", t, size, "line", "other"))
    line = np.tile([*t, np.nan], len(error_plot))
    error_plot.append(Series(r"$\lambda^2/(\sigma^2 + \lambda^2)$", line, predicted, "line", "bound"))
    weighed = _weighed_draws(trial, damped, original, rng)
    checks = (
        at_most("(6) on the arm with slack joints and the formula by singular values: difference / sum of bounds",
                np.concatenate(agree), 1.0),
        at_most(r"the same with general $W$, $W_{\dot x}$ and gradient, at generic, nearly singular and singular "
                "configurations", weighed, 1.0),
        at_most(r"$|\dot q| \le |\dot x| / (2\lambda)$: ratio", np.concatenate(bound), 1 + FORWARD * UNIT),
        at_most(r"no jump: $|\Delta\dot q| \le \frac54 |\Delta J|\,|\dot x| / \lambda^2$ between neighbours, through the "
                "singularity: ratio", np.concatenate(change), 1.0),
        at_most(r"the price: of $u^T\dot x$ the share $\lambda^2/(\sigma^2 + \lambda^2)$ is missed, all of it at the "
                "singularity: difference / rounding", np.concatenate(lost), 1.0),
        *_damped_by_hand(damped, original),
    )  # fmt: skip
    axis = Axis("$t$, from the singularity [rad]")
    plots = (
        Plot(r"Planar 3R through its full stretch, $\dot x$ radial, 0.25 m/s: joint rates", axis,
             Axis(r"$|\dot q|$ [rad/s]", low=0, high=8),
             tuple(rate_plot)),
        Plot("The same: task error of damped least squares, and what the smallest singular value predicts", axis,
             Axis(r"$|J\dot q - \dot x| \,/\, |\dot x|$", low=0, high=1), tuple(error_plot)),
    )  # fmt: skip
    columns = (
        "way",
        r"$\lambda$",
        r"largest $|\dot q|$ [rad/s]",
        r"$|\dot x|/(2\lambda)$ [rad/s]",
        "largest task error / speed",
        "largest rate / limit",
    )
    return Evidence(
        checks,
        (*plots, Table("Damped least squares through singularities, hand speed 0.25 (m/s, rad/s)", columns, tuple(rows))),
    )


def _weighed_draws(trial: Trial, damped: Answer, original: Answer, rng: np.random.Generator) -> Array:
    """Difference over bounds in the situations that the method draws for itself."""
    method, ratios = METHODS["damped_least_squares"], []
    for name in NAMES if trial.full else NAMES[:1]:
        robot = robots.load(name)
        drawn = method.draw(robot, rng, trial.of(60, 12))
        problem = method.cast(robot, drawn.q, drawn.xdot, **drawn.parameters)
        x = damped(problem, damping=drawn.parameters["damping"]).x
        other = original(robot, drawn.q, drawn.xdot, **drawn.parameters)
        ratios.append(np.abs(x - other).max(axis=1) / sum(bounds(method, problem, x, drawn.parameters)))
    return np.concatenate(ratios)


def _damped_by_hand(damped: Answer, original: Answer) -> list[Check]:
    """Numbers worked by hand: the damped inverse at lambda = 1, and what its null-space projector lets leak."""
    robot = robots.load("planar_3r")
    q = np.array([BENT, BENT])
    problem = VelocityProblem(J=robot.jacobian(q), xdot=np.eye(2), W=np.eye(3))
    hand = np.array([[float(entry) for entry in row] for row in DAMPED_BY_HAND])
    inverse = damped(problem, damping=1.0).x.T
    other = original(robot, q, np.eye(2), damping=1.0).T
    leak = (problem.J[0] @ (np.eye(3) - inverse @ problem.J[0]))[:, 0]
    tolerance = ORIGINAL * 3 * UNIT
    return [
        at_most(r"worked by hand, $\lambda = 1$: the damped inverse, both paths", np.abs(np.stack([inverse, other]) - hand),
                tolerance, role=Role.OURS),
        at_most(r"worked by hand: $J(I - J^* J)e_1 = (-1/12, 1/4)$, $J^*$ damped, so its self-motion moves the hand",
                np.abs(leak - hand[0]), tolerance, role=Role.OURS),
    ]  # fmt: skip


def unsquared(damped: Answer) -> Answer:
    """Damping by lambda in the place of lambda^2."""

    def planted(problem: VelocityProblem, *, damping: float) -> Solution:
        return damped(problem, damping=float(np.sqrt(damping)))

    return planted


CLAIM = Claim(
    name="damped_least_squares_at_singularities",
    title="Damped least squares keeps the rates and gives up the task",
    place="Section VI, last sentence; Section I",
    says=r"Damped least squares is a method that does not give the exact prescribed $\dot x$.",
    formula=r"\dot q = J^T (J J^T + \lambda^2 I)^{-1} \dot x, \quad |\dot q| \le \frac{|\dot x|}{2 \lambda}",
    tested=r"The planar 3R, the Panda and the 7R through singularities with three dampings $\lambda$; situations with "
    r"general $W$, $W_{\dot x}$ and gradient; numbers worked by hand. The sandbox computes it by (6) on the arm with slack "
    r"joints, $[J\ I]$.",
    accepted=r"Both paths agree within their bounds, $|\dot q| \le |\dot x|/(2\lambda)$, the rates do not jump at "
    "the singularity, and the task error is what the smallest singular value predicts.",
    paths=(
        CodePath("(6) on the arm with slack joints $s = \\dot x - J \\dot q$", damped_least_squares),
        CodePath("its formula by singular values", damped_original.original),
    ),
    examine=damped_least_squares_at_singularities,
    fault=Fault(r"$\lambda$ in the place of $\lambda^2$", unsquared),
)
