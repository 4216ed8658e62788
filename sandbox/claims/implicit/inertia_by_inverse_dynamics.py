"""The inertia matrix by inverse dynamics."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems import robots
from problems.implicit.inertia import inertia_along
from problems.methods.draw import generic
from problems.original import inertia_weighted
from problems.robots.example_robots import MissingExtraError
from problems.robots.robot import Robot
from problems.robots.twin import twin
from sandbox.claims.claim import Answer, Claim, CodePath, Evidence, Fault, Role, Trial, at_most
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.implicit.allowance import norms, within
from sandbox.claims.numbers import told
from sandbox.claims.postures import F1
from sandbox.closed_form import null_basis
from sandbox.closed_form.eq6_implicit import eq6_implicit
from sandbox.errors import AsymmetricWeightError
from sandbox.implicit_study import LONGEST_GRADIENT
from sandbox.problem import VelocityProblem
from sandbox.stacked import transpose
from sandbox.tolerances import ORIGINAL, UNIT

Array = np.ndarray


def gravity_left_in(along: Answer) -> Answer:
    """The torques of N's columns with gravity among them."""

    def planted(robot: Any, q: Array, N: Array) -> Array:
        return np.stack([robot.inverse_dynamics(q, np.zeros_like(q), N[..., c]) for c in range(N.shape[-1])], axis=-2)

    return planted


def arms(trial: Trial) -> list[tuple[str, Robot | None]]:
    """Every robot of the table, and longer planar arms; None for one whose files are not installed."""
    longer = [f"planar_{n}r" for n in ((7, 10, 16, 30) if trial.full else (7,))]
    names = [*robots.ROBOTS, *longer] if trial.full else ["planar_3r", "planar_4r", "seven_joint", "panda", *longer]
    found: list[tuple[str, Robot | None]] = []
    for name in names:
        try:
            found.append((name, robots.load(name)))
        except MissingExtraError:
            found.append((name, None))
    return found


def solved(J: Array, xdot: Array, N: Array, NtW: Array, size: Array) -> Array:
    """Joint rates (B, n) of (6) from N'W alone, a = 0; NaN where N'WN is not symmetric, so that W is no weight."""
    try:
        return np.asarray(eq6_implicit(J, xdot, N, NtW, np.zeros(NtW.shape[:-1]), size=size).x)
    except AsymmetricWeightError:
        return np.full((len(J), J.shape[-1]), np.nan)


def inertia_by_inverse_dynamics(trial: Trial, along: Answer, explicit: Answer) -> Evidence:
    """Rows of N'M by inverse dynamics and M by composite bodies; rates of (6) and of Khatib's formula, on every robot."""
    rng = trial.rng("inertia_by_inverse_dynamics")
    matrix, rates, apart, sizes, shown = [], [], [], [], []
    rows: list[tuple[str | float | int | None, ...]] = []
    for name, robot in arms(trial):
        if robot is None:
            rows.append((name, None, None, "not installed", None))
            continue
        q, xdot, _ = generic(robot, rng, trial.of(100, 6))
        J, M = robot.jacobian(q), robot.inertia(q)
        N = null_basis.pivoted(J)
        NtW = along(robot, q, N)
        gap = norms(NtW - transpose(N) @ M) / (norms(N) * norms(M))
        x = solved(J, xdot, N, NtW, norms(M))
        other = explicit(robot, q, xdot)
        problem = VelocityProblem(J=J, xdot=xdot, W=M)
        ratio = np.abs(x - other).max(axis=-1) / within(problem, other, N, "inertia_weighted")
        matrix.append(gap / (ORIGINAL * robot.n * UNIT))
        rates.append(ratio)
        if robot.n <= LONGEST_GRADIENT:  # the twin sums J'MJ over bodies: n^3 operations
            symbols = twin(robot)
            (summed,) = symbols.evaluator(symbols.inertia)(q)
            apart.append(norms(NtW - transpose(N) @ summed) / (norms(N) * norms(M)) / (ORIGINAL * robot.n * UNIT))
        sizes.append(robot.n)
        shown.append(gap)
        rows.append((name, robot.m, robot.n, float(gap.max()), float(ratio.max())))
    robot = robots.load("planar_3r")
    J, xdot = robot.jacobian(F1[None]), np.array([[0.3, -0.7]])
    N = null_basis.pivoted(J) * np.sign(null_basis.pivoted(J)[:, 2:])
    NtW = along(robot, F1[None], N)
    x = solved(J, xdot, N, NtW, norms(robot.inertia(F1[None])))
    expected, row = np.array([0.0, -0.3, -0.4]), np.array([-2.0, 0.0, 0.0])
    exact = within(VelocityProblem(J=J, xdot=xdot, W=robot.inertia(F1[None])), expected[None], N, "inertia_weighted")[0]
    matrix_by_hand = np.array([[8.0, 4, 2], [4, 3, 1], [2, 1, 1]])
    checks = (
        at_most("rows $N_J^T M$ by inverse dynamics against $N_J^T$ times $M$ by composite bodies: difference / rounding",
                np.concatenate(matrix), 1.0),
        at_most(r"joint rates against $M^{-1} J^T (J M^{-1} J^T)^{-1} \dot x$: difference / bound", np.concatenate(rates), 1.0),
        at_most(r"rows against $N_J^T$ times $M = \sum J_b^T M_b J_b$ over the bodies, by CasADi: difference / rounding",
                np.concatenate(apart), 1.0, role=Role.OURS),
        at_most("q = (0, π/2, −π/2), unit masses at the link ends: rates against those by hand: difference / bound",
                [np.abs(x[0] - expected).max() / exact], 1.0, role=Role.OURS),
    )  # fmt: skip
    spread = np.concatenate([np.full(len(gap), n) for n, gap in zip(sizes, shown, strict=True)])
    steps = np.unique(sizes)
    plot = Plot(
        "N'M by inverse dynamics against M formed: difference over |N||M|, one point a posture",
        Axis("number of joints n"), Axis("relative difference of N'M", log=True),
        (Series("difference", spread, np.concatenate(shown)),
         Series("50 n u", steps, ORIGINAL * steps * UNIT, "line", "bound")),
    )  # fmt: skip
    table = Table(
        "Largest differences by robot",
        ("robot", "$m$", "$n$", "of $N_J^T M$, relative", "of the joint rates / bound"),
        tuple(rows),
    )
    case = Table(
        r"$q = (0, \pi/2, -\pi/2)$, unit masses at the link ends, $N_J = (-1, 1, 1)^T$, $\dot x = (0.3, -0.7)$",
        ("quantity", "by hand", "ours"),
        (("$M$", told(matrix_by_hand), told(robot.inertia(F1[None])[0])),
         ("$N_J^T M$", told(row), told(NtW[0, 0])), (r"$\dot q$ [rad/s]", told(expected), told(x[0]))),
    )  # fmt: skip
    return Evidence(checks, (plot, table, case))


CLAIM = Claim(
    name="inertia_by_inverse_dynamics",
    title="With W = M, inverse dynamics gives N'W without M",
    place="Section III, after the weightings",
    says=r"When $W = M$, $N_J^T W$ can be calculated by treating the columns of $N_J$ as joint accelerations in an "
    "inverse-dynamics algorithm.",
    tested="All robots of this project and planar arms of up to 30 joints; the torques are those at rest and without gravity.",
    accepted="The rows are $N_J^T M$ to rounding, and the joint rates are within bounds those of the formula with $M^{-1}$.",
    paths=(
        CodePath("recursive Newton–Euler algorithm on the columns of $N_J$", inertia_along),
        CodePath(r"$M^{-1} J^T (J M^{-1} J^T)^{-1} \dot x$ with $M$ by composite bodies, numpy", inertia_weighted.original),
    ),
    examine=inertia_by_inverse_dynamics,
    fault=Fault("gravity left in the inverse dynamics", gravity_left_in),
    sources=("J. Y. S. Luh, M. W. Walker, R. P. C. Paul, ASME J. Dynamic Systems, Measurement, and Control 102, 1980",),
)
