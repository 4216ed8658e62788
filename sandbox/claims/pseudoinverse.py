"""Section III: methods with the Moore-Penrose pseudoinverse, W = I, and what W = I implies."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from problems import measures, robots
from problems.methods import METHODS
from problems.methods import fault_tolerance as locked
from problems.methods import free_swinging as swinging
from problems.methods import joint_limit_gradient as limits
from problems.methods import manipulability_gradient as singularity
from problems.methods.draw import generic
from problems.methods.obstacle_potential import REACH, halfway
from problems.robots.robot import Robot
from sandbox.agreement import bounds
from sandbox.claims import equations
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_least, at_most, every
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.closed_form import CLOSED_FORMS
from sandbox.closed_form.eq6 import eq6
from sandbox.law import rates
from sandbox.method import Draw, Method
from sandbox.problem import VelocityProblem
from sandbox.solution import Solution
from sandbox.tolerances import GRADIENT_STEP, LIMIT_MOTION

Array = np.ndarray

ROBOTS = ("planar_3r", "planar_4r", "panda")

QUARTER = np.pi / 2
F1, F1B = np.array([[0.0, QUARTER, -QUARTER]]), np.array([[0.0, QUARTER, 0.0]])
"""Planar 3R with its tip at (2, 1) and at (1, 2) (methods 0)."""


@dataclass(frozen=True)
class Use:
    """One of the paper's uses of G = J^+: what for, the numbers it cites, the method and its measure, and which way f goes.

    draw : (robot, rng, count) -> Draw
    measure : name of f, and what of the drawn parameters it takes; rising where alpha > 0 drives it up (a = -alpha grad f)
    """

    what: str
    cites: str
    method: Method
    draw: Callable[..., Draw]
    measure: str
    rising: bool = False
    takes: tuple[str, ...] = field(default=())


def _use(what: str, cites: str, name: str, measure: str, module: Any = None, **more: Any) -> Use:
    draw = METHODS[name].draw if module is None else partial(module.draw, measure=measure)
    return Use(what, cites, METHODS[name], draw, measure, **more)


USES = (
    _use("a preferred posture", "[1], [16]", "gradient_projection", "posture"),
    _use("joint limits, quadratic", "[1], [9]", "joint_limit_gradient", limits.CHOICES[0], limits),
    _use("joint limits, p-norm", "[1], [9]", "joint_limit_gradient", limits.CHOICES[1], limits),
    _use("joint limits, barrier", "[1], [9]", "joint_limit_gradient", limits.CHOICES[2], limits),
    _use("singularities, manipulability", "[10]", "manipulability_gradient", "manipulability", singularity, rising=True),
    _use(
        "singularities, least singular value", "[10]", "manipulability_gradient", "smallest_singular_value", singularity,
        rising=True,
    ),
    _use("torque", "[11]", "gravity_torque_gradient", "gravity_torque"),
    _use("obstacles", "[12], [13]", "obstacle_potential", "obstacle_potential"),
    _use(
        "locked joints, relative manipulability", "[14], [15]", "fault_tolerance", "fault_tolerance", locked,
        takes=("joints", "failures"),
    ),
    _use("locked joints, kfm", "[14], [15]", "fault_tolerance", "kfm", locked, rising=True, takes=("joints", "failures")),
    _use("free-swinging joints, torque", "[14], [15]", "free_swinging", "swing_torque", swinging),
    _use("free-swinging joints, acceleration", "[14], [15]", "free_swinging", "swing_acceleration", swinging),
)  # fmt: skip


def climbing(framework: Answer) -> Answer:
    """Liegeois's k > 0, which climbs, taken for alpha: the self-motion of f runs backwards."""

    def planted(method: Method, robot: Robot, q: Array, xdot: Array, **parameters: Any) -> Array:
        still = framework(method, robot, q, xdot, **{**parameters, "alpha": 0.0})
        return 2 * still - framework(method, robot, q, xdot, **parameters)

    return planted


def measure_of(use: Use, robot: Robot, parameters: Mapping[str, Any]) -> Any:
    """The function f of a use, by the name it has among the measures."""
    given = {name: parameters[name] for name in use.takes}
    if use.measure == "obstacle_potential":
        given = {"obstacle": halfway(robot), "reach": REACH}
    return measures.load(use.measure, robot, **given)


def pseudoinverse_methods(trial: Trial, framework: Answer, original: Answer) -> Evidence:
    """Each use of G = J^+ as published, and (6) with W = I and its alpha and f."""
    rng = trial.rng("pseudoinverse_methods")
    checks: list[Check] = []
    series, rows, limit = [], [], []
    for use in USES:
        ratios, relative, directions, weights = [], [], [], []
        for name in ROBOTS:
            robot = robots.load(name)
            q, xdot, parameters = use.draw(robot, rng, trial.of(40, 4))
            x = framework(use.method, robot, q, xdot, **parameters)
            problem = use.method.cast(robot, q, xdot, **parameters)
            allowed = sum(bounds(use.method, problem, x, parameters))
            difference = np.abs(x - original(use.method, robot, q, xdot, **parameters)).max(axis=-1)
            size = np.abs(x).max(axis=-1)
            ratios.append(difference / allowed)
            relative.append(difference / size)
            limit.append((allowed / size, np.maximum(difference / size, 1e-18)))
            weights += [np.array_equal(W, np.eye(robot.n)) for W in problem.W.dense()]
            f = measure_of(use, robot, parameters)
            along = framework(use.method, robot, q, 0 * xdot, **parameters)
            step = GRADIENT_STEP**2 * along / np.linalg.norm(along, axis=-1, keepdims=True)
            directions.append(f.value(robot, q + step) - f.value(robot, q - step))
        change = np.concatenate(directions)
        checks += [
            every(f"{use.what}: $W = I$", weights),
            at_most(f"{use.what} {use.cites}: joint rates less the original's, over both bounds", np.concatenate(ratios), 1.0),
            every(
                f"{use.what}: at $\\alpha > 0$ the self-motion drives $f$ {'up' if use.rising else 'down'}",
                (change > 0) == use.rising,
            ),
        ]
        biggest, share = float(np.concatenate(relative).max()), float(np.concatenate(ratios).max())
        sign = "−α ∇f, f up" if use.rising else "α ∇f, f down"
        rows.append((use.cites, use.what, use.method.title, use.method.certainty, sign, len(change), biggest, share))
        series.append((use.what, limit[-3:]))
    ends = [min(a.min() for a, _ in limit), max(a.max() for a, _ in limit)]
    plot = Plot(
        "Relative difference of the joint rates between (6) with W = I and each method as published, over the sum of both "
        "error "
        "bounds; exact agreement is drawn at 1e-18",
        Axis("sum of both bounds", log=True), Axis("relative difference", log=True),
        (
            *(Series(what, *np.concatenate(points, axis=1)) for what, points in series),
            Series("difference = bounds", ends, ends, "line", "bound"),
        ),
    )  # fmt: skip
    table = Table(
        "The uses of G = J⁺ that the paper cites; which work a number stands for is known as surely as its column says",
        (
            "cited", "use", "method", "attribution", "enters as", "situations", "largest relative difference",
            "largest share of the bounds",
        ),
        tuple(rows), paper=("cited",),
    )  # fmt: skip
    worked, numbers = _by_hand(framework, original)
    return Evidence((*checks, *numbers), (plot, table, worked))


BY_HAND: tuple[tuple[str, str, Array, tuple[float, float], dict[str, Any], tuple[float, ...], float], ...] = (
    ("M1, α = 0", "gradient_projection", F1, (1.0, 1.0), {"alpha": 0.0}, (1 / 3, -4 / 3, 5 / 3), 1e-14),
    (
        "M3, limits ±(π, π, 2π), α = 1", "joint_limit_gradient", F1, (0.0, 0.0),
        {"alpha": 1.0, "upper": np.pi * np.array([1.0, 1, 2]), "lower": -np.pi * np.array([1.0, 1, 2])},
        (0.0265258, -0.0265258, -0.0265258), 5e-8,
    ),
    ("M5, f = w, α = 1", "manipulability_gradient", F1B, (0.0, 0.0), {"alpha": 1.0}, (0.0, -0.178885438, 0.357770876), 5e-10),
    ("M6, α = 0.001", "gravity_torque_gradient", F1B, (0.0, 0.0), {"alpha": 1e-3}, (0.0, 0.05774166, -0.11548332), 5e-9),
    (
        "M7, obstacle at (1, 1.4), d₀ = 0.5, k = 100, α = 0.01", "obstacle_potential", F1, (0.0, 0.0),
        {"alpha": 0.01, "obstacle": np.array([1.0, 1.4, 0]), "reach": 0.5, "stiffness": 100.0, "points": ((2, (1.0, 0, 0)),)},
        (-1 / 30, 1 / 30, 1 / 30), 1e-14,
    ),
)  # fmt: skip
"""Joint rates worked out by hand (methods M1, M3, M5, M6, M7), and half a unit of their last digit."""


def _by_hand(framework: Answer, original: Answer) -> tuple[Table, list[Check]]:
    robot, rows, checks = robots.load("planar_3r"), [], []
    for words, name, q, xdot, parameters, expected, digit in BY_HAND:
        found, other = (law(METHODS[name], robot, q, np.array([xdot]), **parameters)[0] for law in (framework, original))
        checks.append(
            at_most(
                f"{words}: joint rates less those by hand, over their last digit", np.abs(found - expected).max() / digit, 1.0
            )
        )
        rows.append((words, *(written(values) for values in (expected, found, other))))
    table = Table(
        "Planar 3R, unit links, a point of 1 kg at the end of each: joint rates [rad/s]",
        ("case", "by hand", "(6)", "as published"), tuple(rows),
    )  # fmt: skip
    return table, checks


def written(values: Any) -> str:
    """A vector in words."""
    return "(" + ", ".join(f"{value:.8g}" for value in np.where(np.abs(values) < 1e-15, 0.0, values)) + ")"


# W = I


def kept_identity(six: Answer) -> Answer:
    """The weight left at I whatever the joints are measured in."""

    def planted(problem: VelocityProblem) -> Solution:
        return six(VelocityProblem(J=problem.J, xdot=problem.xdot, W=np.eye(problem.n), a=problem.a))

    return planted


def in_units(J: Array, xdot: Array, W: Array, S: Array) -> VelocityProblem:
    """The same problem in joints p, q = S p: J S, and S'WS for W (methods I9)."""
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
    checks: list[Check] = []
    rows = []
    for name in ROBOTS:
        robot = robots.load(name)
        n, count = robot.n, trial.of(150, 8)
        q, xdot, _ = generic(robot, rng, count)
        J, eye = robot.jacobian(q), np.broadcast_to(np.eye(robot.n), (count, robot.n, robot.n))
        radians, own = printed_rates(printed, J, xdot, eye)
        for words, joint, unit in UNITS:
            S = np.diag(np.where(np.arange(n) == joint - 1, unit, 1.0))
            naive, bound = solved(six, VelocityProblem(J=J @ S, xdot=xdot, W=eye), S)
            carried, other = solved(six, in_units(J, xdot, eye, S), S)
            apart = np.abs(naive - radians).max(axis=-1)
            checks += [
                every(f"{name}, {words}: $W = I$ gives another motion, beyond all bounds", apart > 10 * (bound + own)),
                at_most(
                    f"{name}, {words}: $S^T W S$ gives the same, over the bounds",
                    np.abs(carried - radians).max(axis=-1) / (other + own),
                    1.0,
                ),
            ]
            meant, more = printed_rates(printed, J, xdot, np.broadcast_to(np.diag(np.diag(S) ** -2.0), eye.shape))
            checks.append(
                at_most(
                    f"{name}, {words}: $W = I$ there is $S^{{-T}}S^{{-1}}$ here, over the bounds",
                    np.abs(naive - meant).max(axis=-1) / (bound + more),
                    1.0,
                    role=Role.OURS,
                )
            )
            apart = apart / np.abs(radians).max(axis=-1)
            rows.append(
                (name, words, count, float(np.median(apart)), float(np.abs(carried - radians).max() / np.abs(radians).max()))
            )
        full = np.linalg.qr(rng.standard_normal((count, n, n)))[0] * rng.uniform(0.3, 3.0, (count, 1, n))
        W = make_definite(rng, count, n)
        rates_, own = printed_rates(printed, J, xdot, W)
        carried, other = solved(six, in_units(J, xdot, W, full), full)
        scale = np.linalg.cond(full)
        checks.append(
            at_most(
                f"{name}: any $S$, any $W$: $S^T W S$ gives the same, over the bounds",
                np.abs(carried - rates_).max(axis=-1) / (scale * (other + own)),
                1.0,
            )
        )
        turn = np.linalg.qr(rng.standard_normal((count, n, n)))[0]
        turned, other = solved(six, VelocityProblem(J=J @ turn, xdot=xdot, W=eye), turn)
        checks.append(
            at_most(
                f"{name}: an orthogonal $S$ leaves $W = I$ as it is, over the bounds",
                np.abs(turned - radians).max(axis=-1) / (other + own),
                1.0,
                role=Role.OURS,
            )
        )
    plot, limits_ = _over_units(trial, six, printed)
    table = Table(
        "One joint measured in something else: how far W = I moves the arm from what it did in radians, and WS carried over",
        ("arm", "unit", "situations", "median relative change, W = I", "largest relative change, SᵀWS"), tuple(rows),
    )  # fmt: skip
    return Evidence((*checks, *limits_), (plot, table))


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
            "joint 2 in ever smaller units: the motion nears that with joint 2 locked, relative",
            np.abs(x[0] - without).max() / np.abs(without).max(),
            LIMIT_MOTION,
            role=Role.OURS,
        ),
        at_most(
            "in ever larger units: that in which joint 2 costs nothing, relative",
            np.abs(x[-1] - free).max() / np.abs(free).max(),
            LIMIT_MOTION,
            role=Role.OURS,
        ),
        at_least(
            "spread of joint 2's rate over the units, relative to its rate in radians",
            np.ptp(x[:, 1]) / abs(x[len(units) // 2, 1]),
            0.1,
        ),
    ]
    ends = [units[0], units[-1]]
    series = [Series(f"joint {i + 1}", units, x[:, i], "line") for i in range(3)]
    series += [
        Series(
            f"joint {i + 1}, W carried over",
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
        "Planar 3R at q = (0.3, 1.1, −0.7), ẋ = (0.3, −0.7): joint rates for W = I, over the unit that joint 2 is measured in. "
        "Small units lock the joint, large ones leave it free; with SᵀWS for W nothing changes",
        Axis("unit of joint 2 [rad]", log=True), Axis("joint rate [rad/s]"), tuple(series),
    ), checks  # fmt: skip


CLAIMS = (
    Claim(
        name="pseudoinverse_methods",
        title="The methods with the pseudoinverse are (6) with W = I",
        place="Section III, first paragraph",
        says="For $G = J^+$, Liégeois's method serves joint limits, singularities, torque, obstacles and fault tolerance; "
        "(6) does "
        r"with $W = I$ and the respective $\alpha$ and $f$.",
        formula=r"\dot q = J^+ \dot x - \alpha (I - J^+ J) \nabla f",
        tested="Twelve measures of the works cited, each as published ($J^+$ by singular values, the gradient written out) "
        "beside "
        r"(6), on the planar 3R and 4R and the Panda; the sign of $\alpha$ by the measure's own values.",
        accepted="Differences within the sum of both bounds; $f$ falls for $\\alpha > 0$ where it enters as $\\alpha \\nabla "
        "f$; "
        "numbers by hand to their last digit.",
        paths=(
            CodePath("the method cast with $W = I$, $\\nabla f$ from its expression, answered by eq. (6)", rates),
            CodePath(
                "the method as published, problems/original: $J^+$ by singular values, $\\nabla f$ written out", Method.witness
            ),
        ),
        examine=pseudoinverse_methods,
        fault=Fault(r"Liégeois's $k > 0$, which climbs, taken for $\alpha$, which descends", climbing),
        sources=tuple(dict.fromkeys(work for use in USES for work in use.method.works)),
    ),
    Claim(
        name="identity_rarely_ideal",
        title="W = I sets the joints equal, and depends on their units",
        place="Section III, first paragraph",
        says="$W = I$ implies an equality between the effects of the joints that a practical design usually precludes.",
        formula=r"q = S p: \quad J \to J S, \quad W \to S^T W S",
        tested="One joint in degrees, in turns, or behind a gear: the motion of the arm for $W = I$ in each, and for the "
        "weight "
        "carried over; any nonsingular $S$, orthogonal ones, and units over six decades.",
        accepted="$W = I$ gives another motion, beyond all bounds; $S^T W S$ gives the same, within them.",
        paths=(
            CodePath("eq. (6), column-pivoted LU, in the joints $p$", eq6),
            CodePath("eqs. (2)–(5) as printed, explicit inverses in numpy, in radians", equations.liegeois),
        ),
        examine=identity_rarely_ideal,
        fault=Fault("$W = I$ kept where the weight was to be carried over", kept_identity),
    ),
)
