"""The inertia matrix as W."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from problems import robots
from problems.methods import METHODS
from problems.methods.draw import generic, scattered
from problems.original import inertia_weighted as khatib
from problems.original import virtual_load as recursion
from problems.robots.planar import planar_arm
from problems.robots.robot import Robot
from sandbox.agreement import bounds
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_least, at_most, every
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.numbers import told
from sandbox.claims.postures import F1
from sandbox.claims.weightings.comparison import (
    FRAMEWORK,
    INERTIA,
    PSEUDOINVERSE,
    ROBOTS,
    TASKS,
    agreement,
    cast_wrong,
    quadratic,
)
from sandbox.law import rates
from sandbox.problem import VelocityProblem
from sandbox.tolerances import ORIGINAL, UNIT

Array = np.ndarray


def uncoupled(framework: Answer) -> Answer:
    """M without its couplings."""
    return cast_wrong(INERTIA, diagonal_inertia)(framework)


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
    ratios, gaps, margins = [], [], []
    series: list[Series] = []
    rows: list[tuple[Any, ...]] = []
    for name in ROBOTS:
        robot = robots.load(name)
        count = trial.of(120, 10)
        q, xdot, _ = generic(robot, rng, count)
        x, ratio = agreement(INERTIA, robot, (q, xdot, {}), framework, consistent)
        ratios.append(ratio)
        M, energy = robot.inertia(q), kinetic_energy(robot, q, x)
        rounding = ORIGINAL * robot.n * UNIT * np.linalg.norm(M, 2, axis=(1, 2)) * np.sum(x * x, axis=-1) / 2
        gaps.append(np.abs(quadratic(M, x) - energy) / rounding)
        rivals = {
            "W = I": framework(PSEUDOINVERSE, robot, q, xdot, alpha=0.0),
            "W = diag M": framework(replace(INERTIA, cast=diagonal_inertia), robot, q, xdot),
            "W random": framework(METHODS["weighted_pseudoinverse"], robot, q, xdot, weight=scattered(rng, robot.n, count)),
        }
        shares = {words: kinetic_energy(robot, q, rate) / energy for words, rate in rivals.items()}
        margins += [share - 1 + 2 * rounding / energy for share in shares.values()]
        rows.append((name, count, *(float(np.median(share)) for share in shares.values()), float(shares["W = I"].max())))
        sorted_share = np.sort(shares["W = I"])
        series.append(Series(name, sorted_share, (np.arange(count) + 1) / count, "line"))
    payload, weights = _payload(trial, framework, consistent, rng)
    table, numbers = _inertia_by_hand(framework)
    checks = (
        at_most(r"joint rates of (6) against $\bar J \dot x$, Khatib's dynamically consistent inverse: difference / bound",
                np.concatenate(ratios), 1.0),
        at_most(r"$\frac{1}{2}\dot q^T M \dot q$ against the kinetic energy by velocity recursion: difference / rounding",
                np.concatenate(gaps), 1.0),
        at_least(r"kinetic energy with $W = I$, $\mathrm{diag}\, M$ or random, over that with $W = M$, less 1, plus rounding",
                 np.concatenate(margins), 0.0),
    )  # fmt: skip
    plot = Plot(
        "Kinetic energy that the plain pseudoinverse, W = I, spends, over that of W = M, for the same motion of the hand: "
        "share of the situations drawn in which the ratio is at most so large",
        Axis("kinetic energy, W = I over W = M", log=True), Axis("share of situations", low=0.0, high=1.0),
        tuple(series),
    )  # fmt: skip
    energies = Table(
        "Kinetic energy over that of W = M",
        ("arm", "situations", "W = I, median", "W = diag M, median", "W random, median", "W = I, largest"),
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
    J, M = bare.jacobian(F1[None]), bare.inertia(F1[None])
    shifted = M - c[:, None, None] * (np.swapaxes(J, 1, 2) @ J)
    negative = (np.linalg.eigvalsh(shifted) < 0).sum(axis=1)
    at = np.array([framework(replace(INERTIA, cast=_with(W)), bare, F1[None], TASKS[2:])[0] for W in shifted])
    expected = np.array([0.0, -TASKS[2, 0], TASKS[2].sum()])
    checks = [
        at_most(
            f"a mass of 0 to {PAYLOADS[-1]:g} kg on the tip: joint rates against those without it: difference / bound",
            np.concatenate(ratios),
            1.0,
            role=Role.OURS,
        ),
        at_most(
            "$W = M - cJ^TJ$, indefinite for $c > 1$: rates against those of $M$: difference / rounding",
            np.abs(at - expected).max() / (ORIGINAL * 3 * UNIT * np.linalg.cond(M) * (1 + c[-1])),
            1.0,
            role=Role.OURS,
        ),
        every(
            r"negative eigenvalues of $M - cJ^TJ$: none up to $c = 1$, one up to 2, two above, the eigenvalues of $\Lambda$",
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
    found = framework(INERTIA, robot, np.repeat(F1[None], 3, axis=0), TASKS)
    expected = np.stack([0 * TASKS[:, 0], -TASKS[:, 0], TASKS.sum(axis=1)], axis=1)
    allowed = bounds(INERTIA, INERTIA.cast(robot, np.repeat(F1[None], 3, axis=0), TASKS), found, {})
    M = robot.inertia(F1[None])[0]
    Lambda = khatib.operational(robot, F1[None])[0][0]
    eigenvalues, before = np.linalg.eigvalsh(M), np.array([0.460519, 0.809493, 10.729988])
    rounding = ORIGINAL * 3 * UNIT * np.linalg.cond(M)
    words = r"unit masses at the link ends: joint rates against $(0, -\dot x, \dot x + \dot y)$ by hand: difference / bound"
    checks = [
        at_most(words, np.abs(found - expected).max(axis=-1) / sum(allowed), 1.0),
        at_most(
            r"$\Lambda = (JM^{-1}J^T)^{-1}$ against $\mathrm{diag}(2, 1)$ by hand: difference / rounding",
            np.abs(Lambda - np.diag([2.0, 1.0])).max() / rounding, 1.0, role=Role.OURS,
        ),
        at_most("eigenvalues of $M$ against those of a separate program: "
        "difference", np.abs(eigenvalues - before).max(), 5e-7, role=Role.OURS),
    ]  # fmt: skip
    rows = (
        ("M [kg m²]", "(8, 4, 2); (4, 3, 1); (2, 1, 1)", told(M)),
        ("its eigenvalues", told(before, 8), told(eigenvalues, 8)),
        ("Λ [kg]", "(2, 0); (0, 1)", told(Lambda)),
        ("rates for ẋ = (0.3, −0.7) [rad/s]", told(expected[2]), told(found[2])),
    )
    caption = "Planar 3R at q = (0, π/2, −π/2), a point of 1 kg at the end of each unit link"
    return Table(caption, ("quantity", "by hand; eigenvalues by a separate program", "ours"), rows), checks


CLAIM = Claim(
    name="inertia_weight",
    title="The inertia matrix as a weight: least kinetic energy",
    place="Section III, other weightings",
    says=r"$W = M$, the manipulator inertia matrix: $\frac{1}{2}\dot q^T M \dot q$ measures kinetic energy.",
    formula=r"W = M, \qquad G = \bar J = M^{-1}J^T(JM^{-1}J^T)^{-1}",
    tested="Four arms: (6) beside Khatib's dynamically consistent inverse; the energy of the links by velocity recursion; "
    "other weights; masses on the tip.",
    accepted="Rates agree within bounds and energies within rounding; no other weight spends less.",
    paths=(
        CodePath(f"the inertia matrix {FRAMEWORK}", rates),
        CodePath(r"Khatib's $\bar J = M^{-1}J^T\Lambda$ by explicit inverses", khatib.original),
    ),
    examine=inertia_weight,
    fault=Fault("the couplings of the joints left out of $M$", uncoupled),
    sources=INERTIA.works,
)
