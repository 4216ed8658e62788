"""Section III: stiffness, inertia, virtual loads and Mussa-Ivaldi & Hogan's weight as W of eq. (6)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from problems import robots
from problems.methods import METHODS
from problems.methods.draw import generic, scattered
from problems.original import inertia_weighted as khatib
from problems.original import joint_stiffness as springs
from problems.original import virtual_load as recursion
from problems.paths.curves import square
from problems.robots.planar import planar_arm
from problems.robots.robot import Robot
from problems.weightings.extended import extremum as condition_of
from problems.weightings.impedance import elastic
from problems.weightings.virtual_load import VirtualBody, hand_load
from sandbox.agreement import bounds
from sandbox.claims import constrained
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_least, at_most, every
from sandbox.claims.constrained import PLANAR, Springs
from sandbox.claims.exhibit import Axis, Heat, Plot, Series, Table
from sandbox.errors import ConditionSevenError, RefusalError
from sandbox.law import rates
from sandbox.method import Method
from sandbox.motion import follow
from sandbox.problem import VelocityProblem
from sandbox.repeatability import drift
from sandbox.tolerances import CLOSED_CYCLE, CURVATURE_DIFFERENCED, ORIGINAL, UNIT
from sandbox.weight import Weight

Array = np.ndarray

STIFFNESS, INERTIA = METHODS["joint_stiffness"], METHODS["inertia_weighted"]
LOAD, IMPEDANCE = METHODS["virtual_load"], METHODS["mussa_ivaldi_hogan"]
PSEUDOINVERSE = METHODS["gradient_projection"]

ROBOTS = ("planar_3r", "planar_4r", "seven_joint", "panda")

QUARTER = np.pi / 2
F1 = np.array([[0.0, QUARTER, -QUARTER]])
"""Planar 3R with its tip at (2, 1) (methods 0)."""

NULL = np.array([-1.0, 1.0, 1.0])
"""Null vector of J there."""

TASKS = np.array([[1.0, 0.0], [0.0, 1.0], [0.3, -0.7]])


def written(values: Any, digits: int = 7) -> str:
    """A vector or matrix in words."""
    values = np.asarray(values, dtype=float)
    if values.ndim > 1:
        return "[" + ", ".join(written(row, digits) for row in values) + "]"
    return "(" + ", ".join(f"{value:.{digits}g}" for value in np.where(np.abs(values) < 1e-14, 0.0, values)) + ")"


def quadratic(W: Array, x: Array) -> Array:
    """Measure 1/2 x'W x of each row (B,)."""
    return np.einsum("...i,...ij,...j->...", x, W, x) / 2


def agreement(
    method: Method, robot: Robot, given: tuple[Array, Array, dict[str, Any]], first: Answer, second: Answer
) -> tuple[Array, Array]:
    """The first path's rates (B, n), and their difference (B,) from the second's over the sum of both bounds."""
    q, xdot, parameters = given
    x = first(method, robot, q, xdot, **parameters)
    allowed = sum(bounds(method, method.cast(robot, q, xdot, **parameters), x, parameters))
    return x, np.abs(x - second(robot, q, xdot, **parameters)).max(axis=-1) / allowed


def cast_wrong(row: Method, cast: Callable[..., VelocityProblem]) -> Callable[[Answer], Answer]:
    """A planted fault: the framework handed another cast of the method `row`."""

    def plant(framework: Answer) -> Answer:
        def planted(method: Method, robot: Robot, q: Array, xdot: Array, **parameters: Any) -> Array:
            return framework(replace(method, cast=cast) if method is row else method, robot, q, xdot, **parameters)

        return planted

    return plant


def uncoupled(framework: Answer) -> Answer:
    """M without its couplings."""
    return cast_wrong(INERTIA, diagonal_inertia)(framework)


def at_the_joints(framework: Answer) -> Answer:
    """Every load hung at the origin of its joint."""
    return cast_wrong(LOAD, centres_forgotten)(framework)


def force_of_the_tip(framework: Answer) -> Answer:
    """Gamma of the force that the tip exerts."""
    return cast_wrong(IMPEDANCE, force_turned)(framework)


# joint stiffness


def compliance_kept(framework: Answer) -> Answer:
    """Compliance put where its inverse belongs."""

    def planted(method: Method, robot: Robot, q: Array, xdot: Array, **parameters: Any) -> Array:
        given = {"compliance_as_printed" if name == "compliance" else name: values for name, values in parameters.items()}
        return framework(method, robot, q, xdot, **given)

    return planted


def stiffness_weight(trial: Trial, framework: Answer, wrench: Answer) -> Evidence:
    """Least elastic energy, by (6) with W = K = C^-1 and by the wrench that springs need; W = C beside it."""
    rng = trial.rng("stiffness_weight")
    checks: list[Check] = []
    spreads, roundings, literal, equal = [], [], [], []
    for name in ROBOTS:
        robot = robots.load(name)
        count = trial.of(100, 10)
        q, xdot, _ = generic(robot, rng, count)
        C = _compliances(rng, count, robot.n)
        x, ratios = agreement(STIFFNESS, robot, (q, xdot, {"compliance": C}), framework, wrench)
        checks.append(
            at_most(
                f"{name}, $W = C^{{-1}}$: joint rates less those of the wrench $F = (JCJ^T)^{{-1}}\\dot x$, over bounds",
                ratios,
                1.0,
            )
        )
        K = np.linalg.inv(C)
        least = quadratic(K, wrench(robot, q, xdot, compliance=C))
        as_printed = framework(STIFFNESS, robot, q, xdot, compliance_as_printed=C)
        alike = framework(PSEUDOINVERSE, robot, q, xdot, alpha=0.0)
        spreads.append(np.linalg.cond(C))
        roundings.append(ORIGINAL * robot.n * UNIT * spreads[-1] * np.linalg.cond(robot.jacobian(q)))
        own = (quadratic(K, x) / least - 1) / roundings[-1]
        checks.append(at_most(f"{name}: elastic energy of the rates of (6) above the least, over rounding", own, 1.0))
        literal.append(quadratic(K, as_printed) / least - 1)
        equal.append(quadratic(K, alike) / least - 1)
    spread, excess, plain = (np.concatenate(parts) for parts in (spreads, literal, equal))
    limit, lesser = _kantorovich(spread**2), _kantorovich(spread)
    words = "energy above the least of the weight $C$ itself, and of $I$, over Wielandt's limit $(\\kappa - 1)^2/4\\kappa$"
    checks.append(at_most(words, [(excess / limit).max(), (plain / lesser).max()], 1.0, role=Role.OURS))
    checks.append(
        at_most(
            "$W = C$, a compliance, as it is printed: elastic energy above the least, over rounding",
            excess / np.concatenate(roundings), 1.0, role=Role.PRINTED,
            range="Read W = K, the joint stiffness, which is C^-1: 1/2 q̇'Kq̇ is then elastic energy. With the compliance "
            "itself as "
            f"W the springs store {100 * np.median(excess):.0f} % more than need be (median; at worst {excess.max():.3g} "
            "times more).",
        )
    )  # fmt: skip
    order = np.argsort(spread)
    plot = Plot(
        "Elastic energy above the least for a motion of the hand, over how unlike the joints' stiffnesses are; the limits "
        "follow "
        "from Wielandt's inequality",
        Axis("condition number of C", log=True), Axis("energy above the least, relative", log=True),
        (
            Series("W = C, as printed", spread, excess), Series("W = I", spread, plain, role="other"),
            Series("limit for W = C", spread[order], limit[order], "line", "bound"),
            Series("limit for W = I", spread[order], lesser[order], "line", "bound"),
        ),
    )  # fmt: skip
    table, numbers = _stiffness_by_hand(framework, wrench)
    return Evidence((*checks, *numbers), (plot, table))


def _kantorovich(kappa: Array) -> Array:
    """Most by which the minimiser in a metric of condition kappa against another exceeds the least in that other."""
    return (kappa - 1) ** 2 / (4 * kappa)


def _compliances(rng: np.random.Generator, count: int, n: int) -> Array:
    """Compliances (count, n, n) [rad/Nm] of condition 1 to 100."""
    turn = np.linalg.qr(rng.standard_normal((count, n, n)))[0]
    C = (turn * 10.0 ** (rng.uniform(0, 1, (count, 1, 1)) * rng.uniform(-1, 1, (count, 1, n)))) @ np.swapaxes(turn, -1, -2)
    return (C + np.swapaxes(C, -1, -2)) / 2


def _stiffness_by_hand(framework: Answer, wrench: Answer) -> tuple[Table, list[Check]]:
    robot, K = robots.load("planar_3r"), np.array([1.0, 2.0, 3.0])
    expected = np.array([[1 / 6, 1 / 2], [-7 / 6, -1 / 2], [5 / 6, 1 / 2]])
    q, unit = np.repeat(F1, 2, axis=0), np.eye(2)
    found = framework(STIFFNESS, robot, q, unit, compliance=1 / K).T
    given = {"compliance": 1 / K}
    allowed = np.add(*bounds(STIFFNESS, STIFFNESS.cast(robot, q, unit, **given), found.T, given)).max()
    other = wrench(robot, q, unit, compliance=1 / K).T
    literal = framework(STIFFNESS, robot, q, unit, compliance_as_printed=1 / K).T
    rows = (
        ("W = K = diag(1, 2, 3)", written(expected, 4), written(found), written(other)),
        ("W = C = diag(1, 1/2, 1/3), as printed", None, written(literal), None),
    )
    table = Table(
        "Planar 3R at q = (0, π/2, −π/2), K = diag(1, 2, 3) Nm/rad: G, by rows [rad/m]",
        ("weight", "by hand", "(6)", "by the wrench"),
        rows,
    )
    return table, [
        at_most("$K = diag(1, 2, 3)$: $G$ less that by hand, over bounds", np.abs(found - expected).max() / allowed, 1.0)
    ]


# inertia


def diagonal_inertia(robot: Robot, q: Array, xdot: Array) -> VelocityProblem:
    """M without its couplings."""
    M = robot.inertia(q)
    return VelocityProblem(J=robot.jacobian(q), xdot=xdot, W=M * np.eye(robot.n))


def kinetic_energy(robot: Robot, q: Array, qdot: Array) -> Array:
    """Kinetic energy (B,) [J] of the links by velocity recursion, rotors included."""
    rotors = quadratic(np.diag(np.asarray(robot.model.armature)), qdot)
    return recursion.kinetic_energy(robot, q, qdot, robot.bodies()) + rotors


def inertia_weight(trial: Trial, framework: Answer, consistent: Answer) -> Evidence:
    """W = M: kinetic energy, Khatib's inverse, least energy, and payloads that change nothing."""
    rng = trial.rng("inertia_weight")
    checks: list[Check] = []
    series: list[Series] = []
    rows: list[tuple[Any, ...]] = []
    for name in ROBOTS:
        robot = robots.load(name)
        count = trial.of(120, 10)
        q, xdot, _ = generic(robot, rng, count)
        x, ratios = agreement(INERTIA, robot, (q, xdot, {}), framework, consistent)
        checks.append(
            at_most(
                f"{name}: joint rates less $\\bar J \\dot x$, Khatib's dynamically consistent inverse, over bounds", ratios, 1.0
            )
        )
        M, energy = robot.inertia(q), kinetic_energy(robot, q, x)
        rounding = ORIGINAL * robot.n * UNIT * np.linalg.norm(M, 2, axis=(1, 2)) * np.sum(x * x, axis=-1) / 2
        words = rf"{name}: $\dot q^T M \dot q / 2$ less the kinetic energy by velocity recursion, over rounding"
        checks.append(at_most(words, np.abs(quadratic(M, x) - energy) / rounding, 1.0))
        rivals = {
            "W = I": framework(PSEUDOINVERSE, robot, q, xdot, alpha=0.0),
            "W = diag M": framework(replace(INERTIA, cast=diagonal_inertia), robot, q, xdot),
            "W random": framework(METHODS["weighted_pseudoinverse"], robot, q, xdot, weight=scattered(rng, robot.n, count)),
        }
        shares = {words: kinetic_energy(robot, q, rate) / energy for words, rate in rivals.items()}
        more = [share - 1 + 2 * rounding / energy for share in shares.values()]
        checks.append(
            at_least(f"{name}: kinetic energy of {', '.join(rivals)} above that of $W = M$, relative, plus rounding", more, 0.0)
        )
        rows.append((name, count, *(float(np.median(share)) for share in shares.values()), float(shares["W = I"].max())))
        sorted_share = np.sort(shares["W = I"])
        series.append(Series(name, sorted_share, (np.arange(count) + 1) / count, "line"))
    payload, weights = _payload(trial, framework, consistent, rng)
    table, numbers = _inertia_by_hand(framework)
    plot = Plot(
        "Kinetic energy that the plain pseudoinverse, W = I, spends, over that of W = M, for the same motion of the hand: "
        "share of "
        "the situations drawn in which the ratio is at most so large",
        Axis("kinetic energy, W = I over W = M", log=True), Axis("share of situations", low=0.0, high=1.0),
        (*series, Series("least", [1.0, 1.0], [0.0, 1.0], "vertical", "bound")),
    )  # fmt: skip
    energies = Table(
        "Kinetic energy over that of W = M",
        ("arm", "situations", "W = I, median", "W = diag M, median", "W random, median", "W = I, most"),
        tuple(rows),
    )  # fmt: skip
    return Evidence((*checks, *payload, *numbers), (plot, weights, table, energies))


PAYLOADS = (0.0, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
"""Point masses on the tip [kg]."""


def _payload(trial: Trial, framework: Answer, consistent: Answer, rng: np.random.Generator) -> tuple[list[Check], Plot]:
    """A mass on the tip adds mu J'J to M, which null J does not see: the motion stays."""
    bare = robots.load("planar_3r")
    q, xdot, _ = generic(bare, rng, trial.of(40, 6))
    x = framework(INERTIA, bare, q, xdot)
    ratios, moved, apart = [], [], []
    for mass in PAYLOADS:
        arm = planar_arm((1.0, 1.0, 1.0), (1.0, 1.0, 1.0 + mass))
        loaded = consistent(arm, q, xdot)
        problem = INERTIA.cast(arm, q, xdot)
        allowed = sum(bounds(INERTIA, problem, x, {}))
        ratios.append(np.abs(x - loaded).max(axis=-1) / allowed)
        moved.append(loaded[0])
        apart.append(framework(replace(INERTIA, cast=diagonal_inertia), arm, q[:1], xdot[:1])[0])
    c = 0.05 + np.linspace(0.0, 12.0, trial.of(49, 13))
    J, M = bare.jacobian(F1), bare.inertia(F1)
    shifted = M - c[:, None, None] * (np.swapaxes(J, 1, 2) @ J)
    negative = (np.linalg.eigvalsh(shifted) < 0).sum(axis=1)
    at = np.array([framework(replace(INERTIA, cast=_with(W)), bare, F1, TASKS[2:])[0] for W in shifted])
    expected = np.array([0.0, -TASKS[2, 0], TASKS[2].sum()])
    checks = [
        at_most(
            f"a mass of 0 to {PAYLOADS[-1]:g} kg on the tip: joint rates less those without, over bounds",
            np.concatenate(ratios),
            1.0,
            role=Role.OURS,
        ),
        at_most(
            "$M - cJ^TJ$, indefinite from $c = 1$ on: rates less those of $M$, relative to rounding",
            np.abs(at - expected).max() / (ORIGINAL * 3 * UNIT * np.linalg.cond(M) * (1 + c[-1])),
            1.0,
            role=Role.OURS,
        ),
        every(
            "$M - cJ^TJ$ has the negative eigenvalues that $\\Lambda = diag(2, 1)$ tells: none, one above 1, two above 2",
            negative == (c > 1).astype(int) + (c > 2),
            role=Role.OURS,
        ),
    ]
    series = [Series(f"joint {i + 1}", PAYLOADS, np.array(moved)[:, i], "line") for i in range(3)]
    series += [Series(f"joint {i + 1}, W = diag M", PAYLOADS, np.array(apart)[:, i], "line", "other") for i in range(3)]
    plot = Plot(
        "Planar 3R: joint rates of least kinetic energy, over a mass on the tip. It adds μJᵀJ to M, which no self-motion "
        "feels; with the couplings of M left out the motion depends on it",
        Axis("mass on the tip [kg]"), Axis("joint rate [rad/s]"), tuple(series),
    )  # fmt: skip
    return checks, plot


def _with(W: Array) -> Callable[..., VelocityProblem]:
    def cast(robot: Robot, q: Array, xdot: Array) -> VelocityProblem:
        return VelocityProblem(J=robot.jacobian(q), xdot=xdot, W=(W + W.T) / 2)

    return cast


def _inertia_by_hand(framework: Answer) -> tuple[Table, list[Check]]:
    robot = robots.load("planar_3r")
    found = framework(INERTIA, robot, np.repeat(F1, 3, axis=0), TASKS)
    expected = np.stack([0 * TASKS[:, 0], -TASKS[:, 0], TASKS.sum(axis=1)], axis=1)
    allowed = bounds(INERTIA, INERTIA.cast(robot, np.repeat(F1, 3, axis=0), TASKS), found, {})
    M = robot.inertia(F1)[0]
    Lambda = khatib.operational(robot, F1)[0][0]
    eigenvalues, before = np.linalg.eigvalsh(M), np.array([0.460519, 0.809493, 10.729988])
    rounding = ORIGINAL * 3 * UNIT * np.linalg.cond(M)
    words = r"unit masses at the link ends: $\dot q = (0, -\dot x, \dot x + \dot y)$ by hand, over bounds"
    checks = [
        at_most(words, np.abs(found - expected).max(axis=-1) / sum(allowed), 1.0),
        at_most(
            r"$\Lambda = (JM^{-1}J^T)^{-1}$ less $diag(2, 1)$, over rounding",
            np.abs(Lambda - np.diag([2.0, 1.0])).max() / rounding, 1.0, role=Role.OURS,
        ),
        at_most("eigenvalues of $M$ less those worked out before", np.abs(eigenvalues - before).max(), 5e-7, role=Role.OURS),
    ]  # fmt: skip
    rows = (
        ("M [kg m²]", "[(8, 4, 2), (4, 3, 1), (2, 1, 1)]", written(M)),
        ("its eigenvalues", written(before, 8), written(eigenvalues, 8)),
        ("Λ [kg]", "[(2, 0), (0, 1)]", written(Lambda)),
        ("rates for ẋ = (0.3, −0.7) [rad/s]", written(expected[2]), written(found[2])),
    )
    caption = "Planar 3R at q = (0, π/2, −π/2), a point of 1 kg at the end of each unit link"
    return Table(caption, ("quantity", "by hand", "ours"), rows), checks


# virtual loads


def centres_forgotten(robot: Robot, q: Array, xdot: Array, *, bodies: Any) -> VelocityProblem:
    """Every load hung at the origin of its joint."""
    return LOAD.cast(robot, q, xdot, bodies=[VirtualBody(*body)._replace(centre=np.zeros(3)) for body in bodies])


def virtual_load_weight(trial: Trial, framework: Answer, polarised: Answer) -> Evidence:
    """W = K_p against the energy of the load by recursion; where the load hangs, and where (7) fails for it."""
    rng = trial.rng("virtual_load_weight")
    checks: list[Check] = []
    for name in ROBOTS:
        robot = robots.load(name)
        q, xdot, parameters = LOAD.draw(robot, rng, trial.of(80, 8))
        x, ratios = agreement(LOAD, robot, (q, xdot, dict(parameters)), framework, polarised)
        checks.append(
            at_most(f"{name}: joint rates less those of the energy by recursion and polarisation, over bounds", ratios, 1.0)
        )
        W = LOAD.cast(robot, q, xdot, **parameters).W.dense()
        energy = recursion.kinetic_energy(robot, q, x, parameters["bodies"])
        rounding = ORIGINAL * robot.n * UNIT * np.linalg.norm(W, 2, axis=(1, 2)) * np.sum(x * x, axis=-1) / 2
        checks.append(
            at_most(
                rf"{name}: $\dot q^T K_p \dot q / 2$ less the load's energy by recursion, over rounding",
                np.abs(quadratic(W, x) - energy) / rounding,
                1.0,
            )
        )
    series: list[Series] = []
    rows: list[tuple[str, str, float, float, float]] = []
    failing, right, still = [], [], ORIGINAL * 7 * UNIT
    for name in ("planar_3r", "planar_4r", "panda"):
        robot = robots.load(name)
        q, xdot, _ = generic(robot, rng, trial.of(60, 6))
        loads = [(f"link {joint}", VirtualBody(joint, 1.0, (0.05, 0.02, 0.03), 0.01 * np.eye(3))) for joint in robot.joints]
        loads += [("hand", hand_load(robot, 1.0, 0.01 * np.eye(3))), ("hand, a point", hand_load(robot, 1.0))]
        shares = []
        for where, body in loads:
            refused, share = _alone(framework, robot, q, xdot, body)
            shares.append(share)
            right.append(refused == (share <= still))
            rows.append((name, where, float((share > still).mean()), float(np.median(share)), float(refused.mean())))
            if not (share > still).all():
                failing.append(f"{name}, {where}")
        places = np.repeat(np.arange(robot.n) + 0.12 * (len(series) - 1), len(q))
        series.append(Series(name, places, np.maximum(np.concatenate(shares[: robot.n]), 1e-18)))
    words = "one load alone: (6) refuses where, and only where, $N^T K_p N$ is singular to rounding"
    checks.append(every(words, np.concatenate(right), role=Role.OURS))
    checks.append(
        every(
            "condition (7) holds wherever one load alone hangs", [row[2] == 1 for row in rows], role=Role.REACH,
            range="K_p is positive semidefinite: (7) asks that some load moves with every self-motion. It fails for a single "
            f"load at: {'; '.join(failing)}. There some self-motion leaves the load at rest, such as a load on the "
            "hand whose whole motion the task fixes. A load on every link holds it everywhere that was drawn.",
        )
    )  # fmt: skip
    plot = Plot(
        "Smallest eigenvalue of N'KₚN over |Kₚ| for one load alone, over the link that it hangs on: at rounding, a self-motion "
        "leaves it at rest and (7) fails",
        Axis("link", categories=tuple(f"{i}" for i in range(1, 8))), Axis("λmin(N'KₚN) / |Kₚ|", log=True),
        (*series, Series("rounding", [-0.4, 6.4], [still] * 2, "line", "bound")),
    )  # fmt: skip
    where_it_holds = Table(
        "One load alone: where (7) holds",
        ("arm", "load on", "share of situations with (7)", "median λmin(N'KₚN) / |Kₚ|", "share refused by (6)"), tuple(rows),
    )  # fmt: skip
    table, numbers = _load_by_hand(framework, polarised)
    return Evidence((*checks, *numbers), (plot, table, where_it_holds))


def _alone(framework: Answer, robot: Robot, q: Array, xdot: Array, body: VirtualBody) -> tuple[Array, Array]:
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
    robot, q = robots.load("planar_3r"), np.repeat(F1, 3, axis=0)
    expected = np.stack([TASKS[:, 1], -TASKS.sum(axis=1), TASKS[:, 0]], axis=1)
    rows: list[tuple[Any, ...]] = []
    ratios = []
    for mass, inertia in ((1.0, 1.0), (0.0, 1.0), (100.0, 0.25), (0.5, 30.0)):
        given = {"bodies": [hand_load(robot, mass, inertia * np.eye(3))]}
        x, other = (law(robot, q, TASKS, **given) for law in (lambda *a, **k: framework(LOAD, *a, **k), polarised))
        allowed = sum(bounds(LOAD, LOAD.cast(robot, q, TASKS, **given), x, given))
        ratios.append(np.maximum(np.abs(x - expected), np.abs(other - expected)).max(axis=-1) / allowed)
        rows.append((mass, inertia, *(written(values[2], 8) for values in (expected, x, other))))
    words = r"load with inertia on the hand: $\dot q = (\dot y, -\dot x - \dot y, \dot x)$ by hand, over bounds"
    return Table(
        "Planar 3R at q = (0, π/2, −π/2), a load on the hand, ẋ = (0.3, −0.7): joint rates [rad/s]; the inertia alone "
        "decides, and "
        "holds the hand's angle", ("mass [kg]", "inertia [kg m²]", "by hand", "(6)", "energy by recursion"), tuple(rows),
    ), [at_most(words, np.concatenate(ratios), 1.0)]  # fmt: skip


# Mussa-Ivaldi and Hogan


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
    checks: list[Check] = []
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
        checks.append(
            at_most(
                f"{name}: joint rates less those of the elastic equilibrium followed, over bound and error",
                gap / (allowed + [error for _, error in found]),
                1.0,
            )
        )
    stable, line, heat = _stability(trial, framework, followed)
    forces, numbers = _forces(framework)
    repeat, table = _square(trial, framework)
    return Evidence((*checks, *stable, *numbers, *repeat), (line, heat, forces, table))


def _weight_at(F: Array) -> tuple[Array, Array]:
    """W (B, 3, 3) of unit springs at F1 in balance with F (B, 2), and the rest postures."""
    robot = robots.load("planar_3r")
    q = np.repeat(F1, len(F), axis=0)
    rest = balanced(robot, q, F)
    return IMPEDANCE.cast(robot, q, np.zeros((len(F), 2)), rest=rest).W.dense(), rest


def _answers(framework: Answer, rest: Array) -> Array:
    """Whether (6) answers (B,) at F1, unit springs of these rest postures."""
    answered = np.ones(len(rest), dtype=bool)
    for i, one in enumerate(rest):
        try:
            framework(IMPEDANCE, robots.load("planar_3r"), F1, TASKS[2:], rest=one[None])
        except ConditionSevenError:
            answered[i] = False
    return answered


def _stability(trial: Trial, framework: Answer, followed: Answer) -> tuple[list[Check], Plot, Heat]:
    """N'Wn = 3 + 2 F_x at F1, beside the curvature of the energy along the self-motion, and the eigenvalues of W."""
    Fx = np.linspace(-2.5, 1.5, trial.of(81, 17))
    F = np.stack([Fx, np.full_like(Fx, -1.0)], axis=1)
    W, rest = _weight_at(F)
    curvature = np.einsum("i,bij,j->b", NULL, W, NULL)
    low = np.linalg.eigvalsh(W)[:, 0]
    energy = np.array([3 * constrained.curvature(PLANAR, Springs(np.ones(3), one), F1[0], NULL / np.sqrt(3)) for one in rest])
    answered = _answers(framework, rest)
    clear = np.abs(3 + 2 * Fx) > 1e-6
    xdot = TASKS[2]
    qdot, (rate, error) = (
        framework(
            IMPEDANCE,
            robots.load("planar_3r"),
            F1,
            xdot[None],
            rest=balanced(robots.load("planar_3r"), F1, np.array([[-1.0, -1.0]])),
        )[0],
        followed(PLANAR, Springs(np.ones(3), np.array([1.0, QUARTER, 1 - QUARTER])).gradient, F1[0], xdot),
    )
    expected = np.array([0.0, -xdot[0], xdot.sum()])
    rounding = ORIGINAL * 3 * UNIT * (1 + np.abs(F).max()) * 10
    both = (low < 0) & answered
    checks = [
        at_most(r"$n^T W n$ less $3 + 2 F_x$, over rounding", np.abs(curvature - (3 + 2 * Fx)) / rounding, 1.0),
        at_most(
            "$n^T W n$ less the second derivative of the energy along the self-motion [Nm/rad²]",
            np.abs(curvature - energy),
            CURVATURE_DIFFERENCED,
        ),
        every(
            "(6) answers where, and only where, the equilibrium with the hand held is stable", (answered == (energy > 0))[clear]
        ),
        at_least("situations with $W$ indefinite and (7) holding: the equilibrium is stable", both.sum(), 1),
        every("of these the energy has a minimum along the self-motion", energy[both] > 0),
        at_most(
            "$F = (-1, -1)$: joint rates less $(0, -\\dot x, \\dot x + \\dot y)$ by hand and the equilibrium's, over bounds",
            max(np.abs(qdot - expected).max(), np.abs(qdot - rate).max()) / (error + rounding),
            1.0,
        ),
    ]
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
    kind = np.where(_answers(framework, rest), np.where(np.linalg.eigvalsh(W)[:, 0] > 0, 2.0, 1.0), 0.0).reshape(
        len(grid_y), len(grid_x)
    )
    names = {2.0: "W > 0", 1.0: "indefinite, (7) holds", 0.0: "(7) fails"}
    short = {2.0: ">0", 1.0: "±", 0.0: "✕"}
    heat = Heat(
        "The same over both components of the force: " + "; ".join(f"{short[value]} {words}" for value, words in names.items()),
        "Fx [N]", "Fy [N]", tuple(f"{v:g}" for v in grid_x), tuple(f"{v:g}" for v in grid_y), kind.tolist(), 1.0,
        [[short[value] for value in row] for row in kind],
    )  # fmt: skip
    return checks, line, heat


FORCES = (
    ((-1.0, -1.0), 1.0, (-4.048917, 0.356896, 0.692021), 5e-7, "indefinite, stable"),
    ((-1.5, 0.0), 0.0, (-4.12, 0.12, 1.0), 5e-3, "buckles"),
    ((-2.0, 0.0), -1.0, None, 0.0, "unstable"),
)
"""Forces on the tip at F1 [N]; n'Wn, eigenvalues of W and half a unit of their last digit (methods M18); what follows."""


def _forces(framework: Answer) -> tuple[Table, list[Check]]:
    W, rest = _weight_at(np.array([F for F, *_ in FORCES]))
    curvature, eigenvalues, answered = np.einsum("i,bij,j->b", NULL, W, NULL), np.linalg.eigvalsh(W), _answers(framework, rest)
    rounding = ORIGINAL * 3 * UNIT * np.linalg.norm(W, 2, axis=(1, 2)) * 3
    digits = [
        np.abs(found - given).max() / digit for found, (_, _, given, digit, _) in zip(eigenvalues, FORCES, strict=True) if given
    ]
    by_hand = np.array([value for _, value, *_ in FORCES])
    checks = [
        at_most("three forces: $n^T W n$ less 1, 0 and −1, over rounding", np.abs(curvature - by_hand) / rounding, 1.0),
        at_most(
            "three forces: eigenvalues of $W$ less those worked out before, over their last digit", digits, 1.0, role=Role.OURS
        ),
        every("three forces: (6) answers the first and refuses the two for which (7) fails", answered == (by_hand > 0)),
    ]
    rows = tuple(
        (
            written(F), value, float(curvature[i]), written(given) if given else None, written(eigenvalues[i]), kind,
            "answers" if answered[i] else "refuses",
        )
        for i, (F, value, given, _, kind) in enumerate(FORCES)
    )  # fmt: skip
    columns = ("F [N]", "n'Wn by hand", "n'Wn", "eigenvalues of W, worked out before", "eigenvalues of W", "equilibrium", "(6)")
    return Table("Planar 3R at q = (0, π/2, −π/2), unit springs in balance with F on the tip", columns, rows), checks


DRIFTS: tuple[tuple[str, Method, float, tuple[float, float, float], dict[str, Any]], ...] = (
    ("W = C⁻¹ − Γ", IMPEDANCE, 0.2, (0.0, 0.0, 0.0), {"rest": np.array([1.0, QUARTER, 1 - QUARTER]), "tolerance": np.inf}),
    ("W = I", PSEUDOINVERSE, 0.4, (0.03204222423, -0.03306882381, -0.03101509742), {"alpha": 0.0}),
    ("W = M", INERTIA, 0.4, (0.0738853123, -0.0793407944, -0.0684149084), {}),
)
"""Side of a square [m] that begins at F1, and the drift worked out before [rad] (methods, Repeatability)."""


def _square(trial: Trial, framework: Answer) -> tuple[list[Check], Table]:
    """What a closed square leaves in the joints."""
    robot = robots.load("planar_3r")
    rows, left = [], []
    for words, method, side, before, given in DRIFTS:

        def law(q: Array, xdot: Array, method: Method = method, given: dict[str, Any] = given) -> Array:
            return framework(method, robot, q[None], xdot[None], **given)[0]

        motion = follow(law, robot, square(side), F1[0], samples=8, rtol=1e-12 if trial.full else 1e-11)
        left.append(drift(motion)[0])
        rows.append(
            (
                words,
                side,
                written(before, 10),
                written(np.where(np.abs(left[-1]) < CLOSED_CYCLE, 0, left[-1]), 10),
                float(np.abs(left[-1]).max()),
            )
        )
    table = Table(
        "Planar 3R from q = (0, π/2, −π/2), the hand once round a square: what is left in the joints [rad]; zero below 1e-10",
        ("weight", "side [m]", "worked out before", "ours", "largest, ours"), tuple(rows),
    )  # fmt: skip
    gap = np.abs(np.array(left[1:]) - [before for _, _, _, before, _ in DRIFTS[1:]])
    return [
        at_most("a closed square leaves the joints where they were: drift [rad]", np.abs(left[0]), CLOSED_CYCLE),
        at_most(
            "with $W = I$ and $W = M$ it does not: drift less that worked out before [rad]",
            gap,
            10 * CLOSED_CYCLE,
            role=Role.OURS,
        ),
    ], table


FRAMEWORK = "cast as $W$, answered by eq. (6)"

CLAIMS = (
    Claim(
        name="stiffness_weight",
        title="The joint stiffness as a weight: least elastic energy",
        place="Section III, other weightings",
        says=r"$W = K_\theta$, “a joint compliance matrix”, is a weight for (6).",
        formula=r"W = K_\theta = C^{-1}",
        tested="Compliances of condition up to 100 on four arms: (6) with $W = C^{-1}$ beside the wrench that linear springs "
        "need for "
        "the motion; elastic energies for $W = C^{-1}$, $C$ and $I$.",
        accepted="Least elastic energy, within bounds, by (6) with the weight as printed.",
        paths=(
            CodePath(f"compliance {FRAMEWORK}", rates),
            CodePath(r"the springs' wrench, $F = (JCJ^T)^{-1}\dot x$, $\dot q = CJ^TF$", springs.original),
        ),
        examine=stiffness_weight,
        fault=Fault("the compliance where its inverse, the stiffness, belongs", compliance_kept),
        sources=STIFFNESS.works,
    ),
    Claim(
        name="inertia_weight",
        title="The inertia matrix as a weight: least kinetic energy",
        place="Section III, other weightings",
        says=r"$W = M$, the manipulator inertia matrix: $\frac{1}{2}\dot q^T M \dot q$ measures kinetic energy.",
        formula=r"W = M, \qquad G = \bar J = M^{-1}J^T(JM^{-1}J^T)^{-1}",
        tested="Four arms: (6) beside Khatib's dynamically consistent inverse; the energy of the links by velocity "
        "recursion; rival "
        "weights; masses on the tip.",
        accepted="Rates within bounds, energies within rounding, no rival spends less.",
        paths=(
            CodePath(f"the inertia matrix {FRAMEWORK}", rates),
            CodePath(r"Khatib's $\bar J = M^{-1}J^T\Lambda$ by explicit inverses", khatib.original),
        ),
        examine=inertia_weight,
        fault=Fault("the couplings of the joints left out of $M$", uncoupled),
        sources=INERTIA.works,
    ),
    Claim(
        name="virtual_load_weight",
        title="The kinetic energy of a virtual load as a weight",
        place="Section III, other weightings",
        says="$W = K_p$, where $K_p$ measures the kinetic energy of a virtual load, is a weight for (6).",
        formula=r"K_p = \sum_b J_b^T M_b J_b",
        tested="Random boxes on every link of four arms: (6) beside $K_p$ from kinetic energies by velocity recursion and "
        "polarisation; then a single load, link by link.",
        accepted="Rates within bounds, energies within rounding; (7) holds wherever the load hangs.",
        paths=(
            CodePath(f"loads, $K_p$ by Jacobians, {FRAMEWORK}", rates),
            CodePath(
                "$K_p$ by polarisation of kinetic energies from a velocity recursion; minimum along null $J$",
                recursion.original,
            ),
        ),
        examine=virtual_load_weight,
        fault=Fault("every load hung at the origin of its joint", at_the_joints),
        sources=LOAD.works,
    ),
    Claim(
        name="mussa_ivaldi_hogan",
        title="The modified pseudoinverse of Mussa-Ivaldi and Hogan",
        place="Section III, other weightings",
        says=r"The modified Moore-Penrose solution uses $W = C^{-1} - \Gamma$, $\Gamma$ of second derivatives of the forward "
        "kinematics.",
        formula=r"W = C^{-1} - \Gamma, \qquad \Gamma_{ij} = \sum_k F_k \frac{\partial^2 x_k}{\partial q_i \partial q_j}",
        tested="Planar arms of springs in balance with a force on the tip: (6) beside the equilibrium followed by root "
        "finding; "
        "curvature of the energy along the self-motion; a closed square.",
        accepted="Rates within bound and error; (6) answers exactly where the equilibrium is stable, $W$ indefinite or not; "
        "no drift.",
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
    ),
)
