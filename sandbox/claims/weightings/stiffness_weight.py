"""Joint stiffness as W."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems import robots
from problems.methods.draw import generic
from problems.original import joint_stiffness as springs
from problems.robots.robot import Robot
from sandbox.agreement import bounds
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_most
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.numbers import told
from sandbox.claims.postures import F1
from sandbox.claims.weightings.comparison import FRAMEWORK, PSEUDOINVERSE, ROBOTS, STIFFNESS, agreement, quadratic
from sandbox.law import rates
from sandbox.method import Method
from sandbox.tolerances import ORIGINAL, UNIT

Array = np.ndarray


def compliance_kept(framework: Answer) -> Answer:
    """Compliance put where its inverse belongs."""

    def planted(method: Method, robot: Robot, q: Array, xdot: Array, **parameters: Any) -> Array:
        given = {"compliance_as_printed" if name == "compliance" else name: values for name, values in parameters.items()}
        return framework(method, robot, q, xdot, **given)

    return planted


def stiffness_weight(trial: Trial, framework: Answer, wrench: Answer) -> Evidence:
    """Least elastic energy, by (6) with W = K = C^-1 and by the wrench that springs need; W = C beside it."""
    rng = trial.rng("stiffness_weight")
    ratios, above = [], []
    spreads, roundings, literal, equal = [], [], [], []
    for name in ROBOTS:
        robot = robots.load(name)
        count = trial.of(100, 10)
        q, xdot, _ = generic(robot, rng, count)
        C = compliances(rng, count, robot.n)
        x, ratio = agreement(STIFFNESS, robot, (q, xdot, {"compliance": C}), framework, wrench)
        ratios.append(ratio)
        K = np.linalg.inv(C)
        least = quadratic(K, wrench(robot, q, xdot, compliance=C))
        as_printed = framework(STIFFNESS, robot, q, xdot, compliance_as_printed=C)
        alike = framework(PSEUDOINVERSE, robot, q, xdot, alpha=0.0)
        spreads.append(np.linalg.cond(C))
        roundings.append(ORIGINAL * robot.n * UNIT * spreads[-1] * np.linalg.cond(robot.jacobian(q)))
        above.append((quadratic(K, x) / least - 1) / roundings[-1])
        literal.append(quadratic(K, as_printed) / least - 1)
        equal.append(quadratic(K, alike) / least - 1)
    spread, excess, plain = (np.concatenate(parts) for parts in (spreads, literal, equal))
    limit, lesser = kantorovich(spread**2), kantorovich(spread)
    checks = (
        at_most(r"$W = K = C^{-1}$: joint rates of (6) against those of the springs' wrench: difference / bound",
                np.concatenate(ratios), 1.0),
        at_most("$W = K$: elastic energy of the rates of (6) above the least / rounding", np.concatenate(above), 1.0),
        at_most("to the word, $W = C$, a compliance: elastic energy above the least / rounding",
                excess / np.concatenate(roundings), 1.0, role=Role.PRINTED,
                range=r"Read $W = K_\theta$, the joint stiffness, which the symbol stands for elsewhere: "
                r"$\frac{1}{2}\dot q^T K \dot q$ is then elastic energy. A few lines on the paper itself takes the "
                r"inverse $C^{-1}$ "
                r"of a compliance as a weight. With a compliance as $W$, eq. (6) answers too, but the springs store "
                f"{100 * np.median(excess):.0f} % more energy than need be (median; at worst {excess.max():.3g} times more)."),
        at_most(r"energy above the least with $W = C$ and $W = I$ / Kantorovich's limit $(\kappa - 1)^2/4\kappa$",
                np.concatenate([excess / limit, plain / lesser]), 1.0, role=Role.OURS),
    )  # fmt: skip
    order = np.argsort(spread)
    plot = Plot(
        "Elastic energy above the least for a motion of the hand, over how unlike the stiffnesses of the joints are; the "
        "limits follow from Kantorovich's inequality",
        Axis("condition number of C", log=True), Axis("energy above the least, relative", log=True),
        (
            Series("W = C, to the word", spread, excess), Series("W = I", spread, plain, role="other"),
            Series("limit for W = C", spread[order], limit[order], "line", "bound"),
            Series("limit for W = I", spread[order], lesser[order], "line", "bound"),
        ),
    )  # fmt: skip
    table, numbers = _stiffness_by_hand(framework, wrench)
    return Evidence((*checks, *numbers), (plot, table))


def kantorovich(kappa: Array) -> Array:
    """Most by which the minimiser in a metric of condition kappa against another exceeds the least in that other."""
    return (kappa - 1) ** 2 / (4 * kappa)


def compliances(rng: np.random.Generator, count: int, n: int) -> Array:
    """Compliances (count, n, n) [rad/Nm] of condition 1 to 100."""
    turn = np.linalg.qr(rng.standard_normal((count, n, n)))[0]
    C = (turn * 10.0 ** (rng.uniform(0, 1, (count, 1, 1)) * rng.uniform(-1, 1, (count, 1, n)))) @ np.swapaxes(turn, -1, -2)
    return (C + np.swapaxes(C, -1, -2)) / 2


def _stiffness_by_hand(framework: Answer, wrench: Answer) -> tuple[Table, list[Check]]:
    robot, K = robots.load("planar_3r"), np.array([1.0, 2.0, 3.0])
    expected = np.array([[1 / 6, 1 / 2], [-7 / 6, -1 / 2], [5 / 6, 1 / 2]])
    q, unit = np.repeat(F1[None], 2, axis=0), np.eye(2)
    found = framework(STIFFNESS, robot, q, unit, compliance=1 / K).T
    given = {"compliance": 1 / K}
    allowed = np.add(*bounds(STIFFNESS, STIFFNESS.cast(robot, q, unit, **given), found.T, given)).max()
    other = wrench(robot, q, unit, compliance=1 / K).T
    literal = framework(STIFFNESS, robot, q, unit, compliance_as_printed=1 / K).T
    rows = (
        ("W = K = diag(1, 2, 3)", told(expected, 4), told(found, 4), told(other, 4)),
        ("W = C = diag(1, 1/2, 1/3), to the word", None, told(literal, 4), None),
    )
    table = Table(
        "Planar 3R at q = (0, π/2, −π/2), K = diag(1, 2, 3) Nm/rad: G, by rows [rad/m]",
        ("weight", "by hand", "eq. (6)", "by the wrench"),
        rows,
    )
    return table, [
        at_most(
            r"$K = \mathrm{diag}(1, 2, 3)$: $G$ against that by hand: difference / bound",
            np.abs(found - expected).max() / allowed,
            1.0,
        )
    ]


CLAIM = Claim(
    name="stiffness_weight",
    title="Joint stiffness or compliance as a weight: which has the least elastic energy",
    place="Section III, other weightings",
    says=r"Other weightings for (6) include $W = K_\theta$, “a joint compliance matrix”.",
    formula=r"W = K_\theta = C^{-1}",
    tested="Compliances of condition up to 100 on four arms: (6) with $W = C^{-1}$ beside the wrench that linear springs "
    "need for "
    "the motion; elastic energies for $W = C^{-1}$, $C$ and $I$. The paper does not say what this weight is for: that it "
    "measures elastic energy, as $M$ measures kinetic energy, is our reading.",
    accepted="The elastic energy is the least, within bounds.",
    paths=(
        CodePath(f"compliance {FRAMEWORK}", rates),
        CodePath(r"the springs' wrench, $F = (JCJ^T)^{-1}\dot x$, $\dot q = CJ^TF$", springs.original),
    ),
    examine=stiffness_weight,
    fault=Fault("the compliance where its inverse, the stiffness, belongs", compliance_kept),
    sources=STIFFNESS.works,
)
