"""The kinetic energy of virtual loads as W."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems import robots
from problems.methods.draw import generic
from problems.original import virtual_load as recursion
from problems.robots.robot import Robot
from problems.weightings.virtual_load import VirtualBody, hand_load
from sandbox.agreement import bounds
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_most, every
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.numbers import told
from sandbox.claims.postures import F1
from sandbox.claims.weightings.comparison import FRAMEWORK, LOAD, ROBOTS, TASKS, agreement, cast_wrong, quadratic
from sandbox.errors import RefusalError
from sandbox.law import rates
from sandbox.problem import VelocityProblem
from sandbox.tolerances import ORIGINAL, UNIT

Array = np.ndarray


def at_the_joints(framework: Answer) -> Answer:
    """Every load hung at the origin of its joint."""
    return cast_wrong(LOAD, centres_forgotten)(framework)


def centres_forgotten(robot: Robot, q: Array, xdot: Array, *, bodies: Any) -> VelocityProblem:
    """Every load hung at the origin of its joint."""
    return LOAD.cast(robot, q, xdot, bodies=[VirtualBody(*body)._replace(centre=np.zeros(3)) for body in bodies])


def virtual_load_weight(trial: Trial, framework: Answer, polarised: Answer) -> Evidence:
    """W = K_p against the energy of the load by recursion; where the load hangs, and where (7) fails for it."""
    rng = trial.rng("virtual_load_weight")
    ratios, gaps = [], []
    for name in ROBOTS:
        robot = robots.load(name)
        q, xdot, parameters = LOAD.draw(robot, rng, trial.of(80, 8))
        x, ratio = agreement(LOAD, robot, (q, xdot, dict(parameters)), framework, polarised)
        W = LOAD.cast(robot, q, xdot, **parameters).W.dense()
        energy = recursion.kinetic_energy(robot, q, x, parameters["bodies"])
        rounding = ORIGINAL * robot.n * UNIT * np.linalg.norm(W, 2, axis=(1, 2)) * np.sum(x * x, axis=-1) / 2
        ratios.append(ratio)
        gaps.append(np.abs(quadratic(W, x) - energy) / rounding)
    series: list[Series] = []
    rows: list[tuple[str, str, float, float]] = []
    failing, right, still = [], [], ORIGINAL * 7 * UNIT
    for name in ("planar_3r", "planar_4r", "panda"):
        robot = robots.load(name)
        q, xdot, _ = generic(robot, rng, trial.of(60, 6))
        loads = [(f"link {joint}", VirtualBody(joint, 1.0, (0.05, 0.02, 0.03), 0.01 * np.eye(3))) for joint in robot.joints]
        loads += [("hand", hand_load(robot, 1.0, 0.01 * np.eye(3))), ("hand, a point", hand_load(robot, 1.0))]
        shares = []
        for where, body in loads:
            refused, share = alone(framework, robot, q, xdot, body)
            shares.append(share)
            right.append(refused == (share <= still))
            rows.append((name, where, float((share > still).mean()), float(np.median(share))))
            if not (share > still).all():
                failing.append(f"{name}, {where}")
        places = np.repeat(np.arange(robot.n) + 0.12 * (len(series) - 1), len(q))
        series.append(Series(name, places, np.maximum(np.concatenate(shares[: robot.n]), 1e-18)))
    checks = (
        at_most("loads on every link: joint rates of (6) against those of the least energy: difference / bound",
                np.concatenate(ratios), 1.0),
        at_most(r"$\frac{1}{2}\dot q^T K_p \dot q$ against the energy of the loads by velocity recursion: difference / "
        r"rounding",
                np.concatenate(gaps), 1.0),
        every("condition (7) holds wherever a single load hangs", [row[2] == 1 for row in rows], role=Role.REACH,
              range=r"It holds where the load moves with every self-motion: $K_p$ is positive semidefinite, and (7) is "
              r"the paper's "
              "own condition on a weight. With a load on every link it held everywhere. With a single load it fails where some "
              "self-motion leaves the load at rest, as on a hand whose whole motion the task fixes: "
              f"{'; '.join(failing)}."),
        every("a single load: (6) refuses where, and only where, $N_J^T K_p N_J$ is singular to "
        "rounding", np.concatenate(right),
              role=Role.OURS),
    )  # fmt: skip
    plot = Plot(
        "A single load: smallest eigenvalue of N'KₚN over |Kₚ|, one point a situation; at rounding, some self-motion "
        "leaves the "
        "load at rest and (7) fails",
        Axis("link that carries the load", categories=tuple(f"{i}" for i in range(1, 8))), Axis("λmin(N'KₚN) / |Kₚ|", log=True),
        (*series, Series("rounding", [-0.4, 6.4], [still] * 2, "line", "bound")),
    )  # fmt: skip
    where_it_holds = Table(
        "A single load: where (7) holds",
        ("arm", "load on", "share of situations where (7) holds", "median λmin(N'KₚN) / |Kₚ|"), tuple(rows),
    )  # fmt: skip
    table, numbers = _load_by_hand(framework, polarised)
    return Evidence((*checks, *numbers), (plot, table, where_it_holds))


def alone(framework: Answer, robot: Robot, q: Array, xdot: Array, body: VirtualBody) -> tuple[Array, Array]:
    """Whether (6) refuses (B,), and the smallest eigenvalue of N'K_pN over |K_p| (B,)."""
    refused = np.zeros(len(q), dtype=bool)
    for i in range(len(q)):
        try:
            framework(LOAD, robot, q[i : i + 1], xdot[i : i + 1], bodies=[body])
        except RefusalError:
            refused[i] = True
    problem = LOAD.cast(robot, q, xdot, bodies=[body])
    N = np.swapaxes(np.linalg.svd(problem.J)[2][:, robot.m :], 1, 2)
    low = np.abs(np.linalg.eigvalsh(np.swapaxes(N, 1, 2) @ problem.W.dense() @ N)[:, 0])
    return refused, low / np.linalg.norm(problem.W.dense(), 2, axis=(1, 2))


def _load_by_hand(framework: Answer, polarised: Answer) -> tuple[Table, list[Check]]:
    robot, q = robots.load("planar_3r"), np.repeat(F1[None], 3, axis=0)
    expected = np.stack([TASKS[:, 1], -TASKS.sum(axis=1), TASKS[:, 0]], axis=1)
    rows: list[tuple[Any, ...]] = []
    ratios = []
    for mass, inertia in ((1.0, 1.0), (0.0, 1.0), (100.0, 0.25), (0.5, 30.0)):
        given = {"bodies": [hand_load(robot, mass, inertia * np.eye(3))]}
        x, other = (law(robot, q, TASKS, **given) for law in (lambda *a, **k: framework(LOAD, *a, **k), polarised))
        allowed = sum(bounds(LOAD, LOAD.cast(robot, q, TASKS, **given), x, given))
        ratios.append(np.maximum(np.abs(x - expected), np.abs(other - expected)).max(axis=-1) / allowed)
        rows.append((mass, inertia, *(told(values[2], 8) for values in (expected, x, other))))
    words = r"a load with inertia on the hand: rates against $(\dot y, -\dot x - \dot y, \dot x)$ by hand: difference / bound"
    return Table(
        "Planar 3R at q = (0, π/2, −π/2), a load on the hand, ẋ = (0.3, −0.7): joint rates [rad/s]. Its mass is "
        "without effect, its inertia holds the hand's angle",
        ("mass [kg]", "inertia [kg m²]", "by hand", "eq. (6)", "least energy by recursion"), tuple(rows),
    ), [at_most(words, np.concatenate(ratios), 1.0)]  # fmt: skip


CLAIM = Claim(
    name="virtual_load_weight",
    title="The kinetic energy of a virtual load as a weight",
    place="Section III, other weightings",
    says="$W = K_p$, where $K_p$ measures the kinetic energy of a virtual load, is a weight for (6).",
    formula=r"K_p = \sum_b J_b^T M_b J_b",
    tested="Random boxes on every link of four arms: (6) beside $K_p$ from kinetic energies by velocity recursion and "
    "polarisation; then a single load, link by link.",
    accepted="Rates agree within bounds and energies within rounding, with loads on every link. For a single load, (7) is "
    "asked "
    "too.",
    paths=(
        CodePath(f"loads, $K_p$ by Jacobians, {FRAMEWORK}", rates),
        CodePath(
            "$K_p$ by polarisation of kinetic energies from a velocity recursion; minimum along null $J$",
            recursion.original,
        ),
    ),
    examine=virtual_load_weight,
    fault=Fault("every load hung at the origin of its joint", at_the_joints),
    sources=("[25] is not identified; the weight is that of rigid bodies carried by the links",),
)
