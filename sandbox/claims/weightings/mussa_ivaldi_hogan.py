"""Mussa-Ivaldi and Hogan's weight."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems import robots
from problems.paths.curves import square
from problems.robots.robot import Robot
from problems.weightings.extended import extremum as condition_of
from problems.weightings.impedance import elastic
from sandbox.agreement import bounds
from sandbox.claims import constrained
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_most, every
from sandbox.claims.constrained import PLANAR, Springs
from sandbox.claims.exhibit import Axis, Heat, Plot, Series, Table
from sandbox.claims.numbers import told
from sandbox.claims.postures import F1, NULL
from sandbox.claims.weightings.comparison import FRAMEWORK, IMPEDANCE, INERTIA, PSEUDOINVERSE, TASKS, cast_wrong
from sandbox.errors import ConditionSevenError
from sandbox.law import rates
from sandbox.method import Method
from sandbox.motion import follow
from sandbox.problem import VelocityProblem
from sandbox.repeatability import drift
from sandbox.tolerances import CLOSED_CYCLE, CURVATURE_DIFFERENCED, ORIGINAL, UNIT
from sandbox.weight import Weight

Array = np.ndarray


def force_of_the_tip(framework: Answer) -> Answer:
    """Gamma of the force that the tip exerts."""
    return cast_wrong(IMPEDANCE, force_turned)(framework)


def force_turned(
    robot: Robot, q: Array, xdot: Array, *, compliance: Any = 1.0, rest: Any = None, tolerance: float = np.inf
) -> VelocityProblem:
    """Gamma of the force that the tip exerts, not of that exerted on it: C^-1 + Gamma."""
    K = 1 / np.asarray(compliance, dtype=float)
    condition = condition_of(robot, q, elastic(robot, K, rest))
    T = (condition.T + np.swapaxes(condition.T, -1, -2)) / 2
    return VelocityProblem(J=condition.J, xdot=xdot, W=Weight(condition.hessian + T))


def balanced(robot: Robot, q: Array, F: Array) -> Array:
    """Rest postures (B, n) of unit springs for which q is in balance with the force F (B, 2) [N] on the tip."""
    return q - np.einsum("bmn,bm->bn", robot.jacobian(q), F)


def mussa_ivaldi_hogan(trial: Trial, framework: Answer, followed: Answer) -> Evidence:
    """W = C^-1 - Gamma against the equilibrium itself, moved along with the hand; definiteness, stability, repeatability."""
    rng = trial.rng("mussa_ivaldi_hogan")
    ratios: list[float] = []
    for name in ("planar_3r", "planar_4r"):
        robot = robots.load(name)
        q, xdot, parameters = IMPEDANCE.draw(robot, rng, trial.of(100, 8))
        x = framework(IMPEDANCE, robot, q, xdot, **parameters)
        allowed = bounds(IMPEDANCE, IMPEDANCE.cast(robot, q, xdot, **parameters), x, parameters)[0]
        found = [
            followed(PLANAR, Springs(1 / parameters["compliance"], parameters["rest"][i]).gradient, q[i], xdot[i])
            for i in range(len(q))
        ]
        gap = np.abs(x - np.array([rate for rate, _ in found])).max(axis=-1)
        ratios += (gap / (allowed + [error for _, error in found])).tolist()
    stable, line, heat = _stability(trial, framework, followed)
    forces, numbers = _forces(framework)
    repeat, table = _square(trial, framework)
    first = at_most("joint rates of (6) against those of the elastic equilibrium: difference / (bound + error)", ratios, 1.0)
    return Evidence((first, *stable, *numbers, *repeat), (line, heat, forces, table))


def _stability(trial: Trial, framework: Answer, followed: Answer) -> tuple[list[Check], Plot, Heat]:
    """N'Wn = 3 + 2 F_x at F1, beside the curvature of the energy along the self-motion, and the eigenvalues of W."""
    Fx = np.linspace(-2.5, 1.5, trial.of(81, 17))
    F = np.stack([Fx, np.full_like(Fx, -1.0)], axis=1)
    W, rest = _weight_at(F)
    curvature = np.einsum("i,bij,j->b", NULL, W, NULL)
    low = np.linalg.eigvalsh(W)[:, 0]
    energy = np.array([3 * constrained.curvature(PLANAR, Springs(np.ones(3), one), F1, NULL / np.sqrt(3)) for one in rest])
    answered = _answers(framework, rest)
    clear = np.abs(3 + 2 * Fx) > 1e-6
    xdot = TASKS[2]
    qdot, (rate, error) = (
        framework(
            IMPEDANCE,
            robots.load("planar_3r"),
            F1[None],
            xdot[None],
            rest=balanced(robots.load("planar_3r"), F1[None], np.array([[-1.0, -1.0]])),
        )[0],
        followed(PLANAR, Springs(np.ones(3), np.array([1.0, np.pi / 2, 1 - np.pi / 2])).gradient, F1, xdot),
    )
    expected = np.array([0.0, -xdot[0], xdot.sum()])
    rounding = ORIGINAL * 3 * UNIT * (1 + np.abs(F).max()) * 10
    both = (low < 0) & answered
    gap = max(np.abs(qdot - expected).max(), np.abs(qdot - rate).max())
    checks = [
        at_most(r"$F = (-1, -1)$ N at $q = (0, \pi/2, -\pi/2)$: rates against $(0, -\dot x, \dot x + \dot y)$ by hand and "
        r"the equilibrium's: "
        r"difference / "
                "bound", gap / (error + rounding), 1.0),
        at_most("$n^T W n$ against $3 + 2 F_x$ by hand: difference / "
        "rounding", np.abs(curvature - (3 + 2 * Fx)) / rounding, 1.0,
                role=Role.OURS),
        at_most("$n^T W n$ against the second derivative of the energy along the self-motion: difference [Nm/rad²]",
                np.abs(curvature - energy), CURVATURE_DIFFERENCED, role=Role.OURS),
        every("(6) answers where, and only where, the equilibrium with the hand held is "
        "stable", (answered == (energy > 0))[clear],
              role=Role.OURS),
        every("$W$ indefinite and (7) holding: the energy has a minimum along the "
        "self-motion", energy[both] > 0, role=Role.OURS),
    ]  # fmt: skip
    begins = Fx[low < 0]
    series = (
        Series("n'Wn", Fx, curvature), Series("3 + 2 Fx, by hand", Fx, 3 + 2 * Fx, "line", "bound"),
        Series("energy along the self-motion, differenced", Fx, energy, "line", "other"),
        Series("least eigenvalue of W", Fx, low, "line"),
        Series("zero", [Fx[0], Fx[-1]], [0.0, 0.0], "line", "bound"),
        Series("(7) fails below", [-1.5, -1.5], [low.min(), curvature.max()], "vertical", "bound"),
        Series("W indefinite below", [begins.max()] * 2, [low.min(), curvature.max()], "vertical", "bound"),
    )  # fmt: skip
    line = Plot(
        "Planar 3R at q = (0, π/2, −π/2), unit springs, a force (Fx, −1) N on the tip: W = C⁻¹ − Γ is indefinite long before "
        "(7) fails, which it does where the held arm buckles",
        Axis("Fx [N]"), Axis("Nm/rad"), series,
    )  # fmt: skip
    grid_x, grid_y = np.linspace(-3, 1.5, trial.of(19, 7)), np.linspace(2, -2, trial.of(17, 5))
    grid = np.array([[fx, fy] for fy in grid_y for fx in grid_x])
    W, rest = _weight_at(grid)
    kind = np.where(_answers(framework, rest), np.where(np.linalg.eigvalsh(W)[:, 0] > 0, 0.0, 1.0), 2.0).reshape(
        len(grid_y), len(grid_x)
    )
    names = {0.0: "W > 0", 1.0: "indefinite, (7) holds", 2.0: "(7) fails"}
    short = {0.0: ">0", 1.0: "±", 2.0: "✕"}
    key = "; ".join(f"{short[value]} {words}" for value, words in names.items())
    columns, lines = (tuple(f"{v:g}".replace("-", "−") for v in grid) for grid in (grid_x, grid_y))
    heat = Heat(
        f"The same posture over both components of the force: {key}", "Fx [N]", "Fy [N]", columns, lines, kind.tolist(), 1.0,
        [[short[value] for value in row] for row in kind],
    )  # fmt: skip
    return checks, line, heat


def _weight_at(F: Array) -> tuple[Array, Array]:
    """W (B, 3, 3) of unit springs at F1 in balance with F (B, 2), and the rest postures."""
    robot = robots.load("planar_3r")
    q = np.repeat(F1[None], len(F), axis=0)
    rest = balanced(robot, q, F)
    return IMPEDANCE.cast(robot, q, np.zeros((len(F), 2)), rest=rest).W.dense(), rest


def _answers(framework: Answer, rest: Array) -> Array:
    """Whether (6) answers (B,) at F1, unit springs of these rest postures."""
    answered = np.ones(len(rest), dtype=bool)
    for i, one in enumerate(rest):
        try:
            framework(IMPEDANCE, robots.load("planar_3r"), F1[None], TASKS[2:], rest=one[None])
        except ConditionSevenError:
            answered[i] = False
    return answered


FORCES = (
    ((-1.0, -1.0), 1.0, (-4.048917, 0.356896, 0.692021), 5e-7, "indefinite, stable"),
    ((-1.5, 0.0), 0.0, (-4.12, 0.12, 1.0), 5e-3, "buckles"),
    ((-2.0, 0.0), -1.0, None, 0.0, "unstable"),
)
"""Forces on the tip at F1 [N]; n'Wn, eigenvalues of W and half a unit of their last digit, by a separate program; what "
"follows."""


def _forces(framework: Answer) -> tuple[Table, list[Check]]:
    W, rest = _weight_at(np.array([F for F, *_ in FORCES]))
    curvature, eigenvalues, answered = np.einsum("i,bij,j->b", NULL, W, NULL), np.linalg.eigvalsh(W), _answers(framework, rest)
    rounding = ORIGINAL * 3 * UNIT * np.linalg.norm(W, 2, axis=(1, 2)) * 3
    digits = [
        np.abs(found - given).max() / digit for found, (_, _, given, digit, _) in zip(eigenvalues, FORCES, strict=True) if given
    ]
    by_hand = np.array([value for _, value, *_ in FORCES])
    checks = [
        at_most(
            "three forces: $n^T W n$ against 1, 0 and −1 by hand: difference / rounding",
            np.abs(curvature - by_hand) / rounding,
            1.0,
            role=Role.OURS,
        ),
        at_most(
            "three forces: eigenvalues of $W$ against those of a separate program: difference / its last digit",
            digits,
            1.0,
            role=Role.OURS,
        ),
        every(
            "three forces: (6) answers the first and refuses the two for which (7) fails",
            answered == (by_hand > 0),
            role=Role.OURS,
        ),
    ]
    rows = tuple(
        (
            told(F), value, float(curvature[i]), told(given, 7) if given else None, told(eigenvalues[i], 7), kind,
            "answers" if answered[i] else "refuses",
        )
        for i, (F, value, given, _, kind) in enumerate(FORCES)
    )  # fmt: skip
    columns = (
        "F [N]",
        "n'Wn by hand",
        "n'Wn",
        "eigenvalues of W by a separate program",
        "eigenvalues of W",
        "equilibrium",
        "(6)",
    )
    return Table("Planar 3R at q = (0, π/2, −π/2), unit springs in balance with F on the tip", columns, rows), checks


DRIFTS: tuple[tuple[str, Method, float, tuple[float, float, float], dict[str, Any]], ...] = (
    ("W = C⁻¹ − Γ", IMPEDANCE, 0.2, (0.0, 0.0, 0.0), {"rest": np.array([1.0, np.pi / 2, 1 - np.pi / 2]), "tolerance": np.inf}),
    ("W = I", PSEUDOINVERSE, 0.4, (0.03204222423, -0.03306882381, -0.03101509742), {"alpha": 0.0}),
    ("W = M", INERTIA, 0.4, (0.0738853123, -0.0793407944, -0.0684149084), {}),
)
"""Side of a square [m] that begins at F1, and the drift found by a separate program [rad]."""


def _square(trial: Trial, framework: Answer) -> tuple[list[Check], Table]:
    """What a closed square leaves in the joints."""
    robot = robots.load("planar_3r")
    rows, left = [], []
    for words, method, side, before, given in DRIFTS:

        def law(q: Array, xdot: Array, method: Method = method, given: dict[str, Any] = given) -> Array:
            return framework(method, robot, q[None], xdot[None], **given)[0]

        motion = follow(law, robot, square(side), F1, samples=8, rtol=1e-12 if trial.full else 1e-11)
        left.append(drift(motion)[0])
        rows.append(
            (
                words,
                side,
                told(before, 10),
                told(np.where(np.abs(left[-1]) < CLOSED_CYCLE, 0, left[-1]), 10),
                float(np.abs(left[-1]).max()),
            )
        )
    table = Table(
        "Planar 3R from q = (0, π/2, −π/2), the hand once round a square: what is left in the joints [rad]; zero below 1e-10",
        ("weight", "side [m]", "by hand, or by a separate program", "ours", "largest, ours"), tuple(rows),
    )  # fmt: skip
    gap = np.abs(np.array(left[1:]) - [before for _, _, _, before, _ in DRIFTS[1:]])
    return [
        at_most(
            "a closed square leaves the joints where they were: drift [rad]", np.abs(left[0]), CLOSED_CYCLE, role=Role.OURS
        ),
        at_most(
            "with $W = I$ and $W = M$ it does not: drift against that of a separate program: difference [rad]",
            gap,
            10 * CLOSED_CYCLE,
            role=Role.OURS,
        ),
    ], table


CLAIM = Claim(
    name="mussa_ivaldi_hogan",
    title="The modified pseudoinverse of Mussa-Ivaldi and Hogan",
    place="Section III, other weightings",
    says=r"The modified Moore–Penrose solution of Mussa-Ivaldi and Hogan uses $W = C^{-1} - \Gamma$, with $\Gamma$ of second "
    "derivatives of the forward kinematics.",
    formula=r"W = C^{-1} - \Gamma, \qquad \Gamma_{ij} = \sum_k F_k \frac{\partial^2 x_k}{\partial q_i \partial q_j}",
    tested="Planar arms of springs in balance with a force on the tip: (6) beside the equilibrium, followed by root finding as "
    "the hand moves. Of our own: the curvature of the energy along the self-motion, and a closed square.",
    accepted="The joint rates agree within bound and error.",
    paths=(
        CodePath(f"impedance {FRAMEWORK}", rates),
        CodePath(
            "the elastic equilibrium with the hand held, by root finding on Lagrange's conditions, differenced",
            constrained.extremum_rates,
        ),
    ),
    examine=mussa_ivaldi_hogan,
    fault=Fault(r"$C^{-1} + \Gamma$: the force taken as exerted by the tip, not on it", force_of_the_tip),
    sources=IMPEDANCE.works,
)
