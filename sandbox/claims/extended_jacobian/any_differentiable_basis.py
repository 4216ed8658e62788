"""The basis of the null space in (11)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from problems import robots
from problems.robots.robot import Robot
from problems.weightings.extended import extremum as condition_of
from problems.weightings.impedance import elastic
from sandbox.agreement import bounds
from sandbox.claims import constrained, equations
from sandbox.claims.claim import Answer, Check, Claim, Evidence, Fault, Role, Trial, at_least, at_most
from sandbox.claims.constrained import PLANAR, Springs, cross
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.extended_jacobian.extrema import (
    BY_BASIS,
    FRAMEWORK,
    REST,
    ROW,
    SOURCES,
    TASK,
    extrema,
    left_over,
    scaled,
    springs_of,
    torsion_share,
    unit,
    with_cast,
)
from sandbox.claims.numbers import told
from sandbox.closed_form import CLOSED_FORMS
from sandbox.problem import VelocityProblem
from sandbox.tolerances import (
    ORIGINAL,
    OTHER_MOTION,
    UNIT,
)  # fmt: skip
from sandbox.weight import Weight

Array = np.ndarray

OFF = np.array([0.2, 1.1, -0.6])
"""No extremum for REST."""


PRINTED_OFF = ((-0.4637, 0.4623, -0.3190), (-0.4901, 0.4663, -0.2549), (-0.4490, 0.4601, -0.3547), (-0.4868, 0.4657, -0.2631))
"""Rates at OFF for xdot = (.3, -.7) under the four scalings, by a separate program."""


PRINTED_DIGIT = 1e-4
"""The last digit of these."""


MOST_LINES = 200
"""Lines through joint space looked at for a sign flip."""


SCALINGS: tuple[tuple[str, Callable[[Array], Array]], ...] = (
    (r"$n$", scaled(lambda q: 1.0)),
    (r"$n/|n|$", scaled(unit)),
    (r"$(2 + \sin q_1 + q_2^2)\, n$", scaled(lambda q: 2 + np.sin(q[0]) + q[1] ** 2)),
    (r"$-e^{q_3} n$", scaled(lambda q: -np.exp(q[2]))),
)
"""Null vectors of the planar 3R, n the cross product of the rows of J."""


def bases(robot: Robot, q: Array) -> list[tuple[str, Callable[[Array], Array]]]:
    """Differentiable bases of null J near q."""
    if robot.n == 3:
        return list(SCALINGS)
    J = constrained.tip_jacobian(q)
    pairs = [(i, j) for i in range(4) for j in range(i) if abs(np.linalg.det(J[:, [i, j]])) > 0.2]
    frozen_pivots = [(f"joints {i + 1}, {j + 1} solved for", constrained.eliminated(PLANAR, (i, j), 4)) for i, j in pairs[:2]]
    smooth = constrained.projected(PLANAR, q)

    def mixed(z: Array) -> Array:
        return smooth(z) @ np.array([[1 + z[0] ** 2, np.sin(z[1])], [0 * z[0], np.exp(z[2])]])

    return [("projected", smooth), ("projected, mixed by C(q)", mixed), *frozen_pivots]


def sign_flips(framework: Answer) -> Answer:
    """H by differences of h with an orthonormal basis computed anew each time, its signs as they come."""

    def cast(robot: Robot, q: Array, xdot: Array, *, stiffness: Any = 1.0, rest: Any = None, tolerance: float = 0.0) -> Any:
        rng = np.random.default_rng(8)
        step = UNIT ** (1 / 3)
        g = elastic(robot, stiffness, rest)

        def h(q: Array) -> Array:
            condition = condition_of(robot, q, g)
            signs = rng.choice([-1.0, 1.0], (len(q), 1, robot.k))
            return np.einsum("bnk,bn->bk", condition.N * signs, condition.gradient)

        H = np.stack([(h(q + s) - h(q - s)) / (2 * step) for s in step * np.eye(robot.n)], axis=-1)
        return VelocityProblem(J=robot.jacobian(q), xdot=xdot, W=Weight(np.zeros((robot.n, robot.n)), H))

    return with_cast(cast)(framework)


def any_basis(trial: Trial, framework: Answer, by_basis: Answer) -> Evidence:
    """The same rates whatever the differentiable basis, on the manifold; not off it."""
    rng = trial.rng("any_differentiable_basis")
    checks = []
    for name, count in (("planar_3r", trial.of(100, 8)), ("planar_4r", trial.of(60, 6))):
        robot = robots.load(name)
        q, xdot, parameters = drawn = extrema(robot, rng, count)
        x = framework(ROW, robot, q, xdot, **parameters)
        problem = ROW.cast(robot, q, xdot, **parameters)
        allowed = bounds(ROW, problem, x, parameters)[0]
        cancelled = torsion_share(robot, drawn) * np.linalg.cond(robot.jacobian(q))
        ratios = []
        for i in range(count):
            g = springs_of(parameters, i)
            for _, basis in bases(robot, q[i]):
                other, condition = by_basis(PLANAR, g.gradient, q[i], xdot[i], basis)
                rounding = ORIGINAL * robot.n * UNIT * condition * cancelled[i] * np.abs(other).max()
                ratios.append(np.abs(x[i] - other).max() / (allowed[i] + rounding))
        words = f"{name}, {len(bases(robot, q[0]))} bases at extrema: rates against those of (6): difference / bound"
        checks.append(at_most(words, ratios, 1.0))
        dense = VelocityProblem(J=problem.J, xdot=problem.xdot, W=problem.W.dense())
        rounding = (2 * CLOSED_FORMS["eq6"].bound(dense) + CLOSED_FORMS["eq6"].bound(problem)) * np.abs(x).max(axis=-1)
        other = []
        for i in range(count):
            N = equations.null_space(problem.J[i]) @ (np.eye(robot.k) + 0.4 * rng.uniform(-1, 1, (robot.k, robot.k)))
            other.append(equations.augmented(problem.J[i], xdot[i], dense.W.dense()[i], np.zeros(robot.n), 0.0, N))
        words = rf"{name}: $N_J$ of (6) mixed anew, $\bar N_J$ kept: difference of the rates / bound"
        checks.append(at_most(words, np.abs(x - np.array(other)).max(axis=-1) / rounding, 1.0))

    springs = Springs(np.ones(3), REST)
    printed = [by_basis(PLANAR, springs.gradient, OFF, TASK, basis)[0] for _, basis in SCALINGS]
    h = float((cross(OFF).T @ springs.gradient(OFF))[0])
    digits = np.abs(np.array(printed) - PRINTED_OFF).max()
    words = f"at q = {told(OFF)}, no extremum, the four answers are those of a separate program, to four digits"
    checks.append(at_most(words, digits, PRINTED_DIGIT, role=Role.OURS))
    shares, spreads = _off_the_manifold(trial, rng, by_basis)
    slope = float(np.median(spreads / shares))
    spread = _spread(printed)
    words = f"beyond the paper's words, off an extremum, at q = {told(OFF)}: relative spread of the rates over the four bases"
    checks.append(at_least(words, spread, OTHER_MOTION, role=Role.OURS))
    flips, jump, spike = _flipping(trial, rng, springs)
    words = "a basis that is not differentiable: the last singular vector of J turns its sign on lines through joint space"
    checks.append(Check(words, flips > 0, flips, "≥ 1 turn", role=Role.OURS))
    checks.append(
        at_least("joint rates with H differenced across such a turn: relative error", jump, OTHER_MOTION, role=Role.OURS)
    )
    plot = Plot(
        "Relative spread of the joint rates over four scalings of the null vector: nothing at an extremum, and off it in "
        "proportion to "
        "the share of the gradient along the self-motion",
        Axis("share of the gradient of g along the self-motion", log=True),
        Axis("relative spread of the joint rates", log=True),
        (
            Series("planar 3R, drawn", shares, spreads),
            Series("q = (0.2, 1.1, −0.6)", [left_over(robots.load("planar_3r"), springs, OFF)], [spread], role="other"),
            Series("proportional", np.sort(shares), slope * np.sort(shares), "line", "bound"),
        ),
    )  # fmt: skip
    table = Table(
        f"Planar 3R at q = (0.2, 1.1, −0.6), no extremum (h = n'∇g = {h:.4f}), ẋ = (0.3, −0.7): rates [rad/s] of [J; H]",
        ("null vector", "by a separate program", "ours"),
        tuple(
            (words, told(given), told(found)) for (words, _), given, found in zip(SCALINGS, PRINTED_OFF, printed, strict=True)
        ),
    )
    return Evidence(tuple(checks), (plot, spike, table))


def _spread(answers: Any) -> float:
    """Largest distance from the first of some vectors, relative."""
    stack = np.array(answers)
    return float(np.abs(stack - stack[0]).max() / np.abs(stack[0]).max())


def _off_the_manifold(trial: Trial, rng: np.random.Generator, by_basis: Answer) -> tuple[Array, Array]:
    """Distances from the manifold, and how far the four scalings differ there."""
    robot = robots.load("planar_3r")
    q, xdot, parameters = extrema(robot, rng, trial.of(240, 24))
    shares, spreads = [], []
    for i, off in enumerate(10.0 ** rng.uniform(-9, -0.5, len(q))):
        g = springs_of(parameters, i)
        n = cross(q[i])[:, 0]
        moved = Springs(g.stiffness, g.rest - off * np.linalg.norm(g.gradient(q[i])) * n / np.linalg.norm(n) / g.stiffness)
        shares.append(left_over(robot, moved, q[i]))
        spreads.append(_spread([by_basis(PLANAR, moved.gradient, q[i], xdot[i], basis)[0] for _, basis in SCALINGS]))
    return np.array(shares), np.array(spreads)


def _flipping(trial: Trial, rng: np.random.Generator, g: Springs) -> tuple[int, float, Plot]:
    """Flips found on lines; the error of rates with H by differences across one; and h along that line."""

    def last(q: Array) -> Array:
        return np.linalg.svd(constrained.tip_jacobian(q))[2][2]

    least, s = trial.of(60, 5), np.linspace(0.0, 1.0, 121)
    flips, lines, chosen = 0, 0, None
    while lines < least or (chosen is None and lines < MOST_LINES):
        a, b = rng.uniform(-2.5, 2.5, (2, 3))
        J = np.array([constrained.tip_jacobian(a + t * (b - a)) for t in s])
        _, sigma, V = np.linalg.svd(J)
        turned = np.flatnonzero(np.einsum("ti,ti->t", V[1:, 2], V[:-1, 2]) < -0.5)
        lines, flips = lines + 1, flips + len(turned)
        for i in turned:
            if chosen is None and sigma[i, 1] > 0.3 and 0.1 < s[i] < 0.9 and np.linalg.norm(b - a) > 2:
                chosen = (a, b, i)
    if chosen is None:
        return flips, np.nan, Plot("", Axis(""), Axis(""), ())
    a, b, i = chosen
    low, high = s[i], s[i + 1]
    for _ in range(40):
        middle = (low + high) / 2
        same = last(a + low * (b - a)) @ last(a + middle * (b - a)) > 0
        low, high = (middle, high) if same else (low, middle)
    at, step = a + low * (b - a), 1e-4

    def h(q: Array) -> float:
        return float(last(q) @ g.gradient(q))

    H = np.array([(h(at + e) - h(at - e)) / (2 * step) for e in step * np.eye(3)])
    right = constrained.basis_rates(PLANAR, g.gradient, at, TASK, scaled(unit))[0]
    wrong = np.linalg.solve(np.vstack([constrained.tip_jacobian(at), H]), [*TASK, 0.0])
    error = float(np.abs(wrong - right).max() / np.abs(right).max())
    here = np.linspace(low - 0.05, low + 0.05, 201)
    n0 = last(at)
    smooth = []
    for t in here:
        n = cross(a + t * (b - a))[:, 0]
        smooth.append(float(n @ g.gradient(a + t * (b - a)) / np.linalg.norm(n) * np.sign(n0 @ cross(at)[:, 0])))
    rough = [h(a + t * (b - a)) for t in here]
    along = (here - low) * np.linalg.norm(b - a)
    plot = Plot(
        "h = n'∇g along a line through joint space: where the singular value decomposition turns the sign of its null "
        "vector, H by "
        f"differences gives joint rates wrong by {100 * error:.0f} %",
        Axis("distance from the turn [rad]"), Axis("h [Nm]"),
        (
            Series("null vector by singular value decomposition", along, rough),
            Series("cross product, scaled", along, smooth, "line", "other"),
        ),
    )  # fmt: skip
    return flips, error, plot


CLAIM = Claim(
    name="any_differentiable_basis",
    title="Any differentiable basis of the null space does for (11)",
    place="Section III, eq. (11)",
    says=r"$\bar N_J$ in (11) is any differentiable basis of the null space; it need not equal the $N_J$ used in (6).",
    tested="Four scalings of the null vector of the planar 3R and four bases of the planar 4R at extrema of $g$; $N_J$ "
    "mixed anew "
    "in (6). Beyond the paper's words: the same off extrema, and a basis by singular value decomposition, which is not "
    "differentiable.",
    accepted="At extrema of $g$, which the technique maintains, the joint rates agree within bounds.",
    paths=(FRAMEWORK, BY_BASIS),
    examine=any_basis,
    fault=Fault(r"$H$ by differences of $\bar N_J^T \nabla g$ with a basis computed anew each time, signs and all", sign_flips),
    sources=SOURCES,
)
