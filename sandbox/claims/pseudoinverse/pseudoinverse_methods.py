"""The methods with the Moore-Penrose pseudoinverse, W = I."""

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
from problems.methods.obstacle_potential import REACH, halfway
from problems.robots.robot import Robot
from sandbox.agreement import bounds
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Trial, at_most, every
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.numbers import told
from sandbox.claims.postures import F1, F1B
from sandbox.claims.scatter import beside, drawable, thinned
from sandbox.law import rates
from sandbox.method import Draw, Method
from sandbox.tolerances import GRADIENT_STEP

Array = np.ndarray

ROBOTS = ("planar_3r", "planar_4r", "panda")


@dataclass(frozen=True)
class Use:
    """One of the paper's uses of G = J^+: what for, the numbers it cites, the method and its measure, and which way f goes.

    draw : (robot, rng, count) -> Draw
    measure : its name, and what of the drawn parameters it takes; where it is to rise f is its negative
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
    """Each use of G = J^+ in its original form, and (6) with W = I and its alpha and f."""
    rng = trial.rng("pseudoinverse_methods")
    checks: list[Check] = []
    rows, points, identity = [], [], []
    fell: dict[bool, list[Array]] = {False: [], True: []}
    for place, use in enumerate(USES):
        ratios, relative = [], []
        for name in ROBOTS:
            robot = robots.load(name)
            q, xdot, parameters = use.draw(robot, rng, trial.of(40, 4))
            x = framework(use.method, robot, q, xdot, **parameters)
            problem = use.method.cast(robot, q, xdot, **parameters)
            allowed = sum(bounds(use.method, problem, x, parameters))
            difference = np.abs(x - original(use.method, robot, q, xdot, **parameters)).max(axis=-1)
            ratios.append(difference / allowed)
            relative.append(np.stack([difference, allowed]) / np.abs(x).max(axis=-1))
            identity += [np.array_equal(W, np.eye(robot.n)) for W in problem.W.dense()]
            f = measure_of(use, robot, parameters)
            along = framework(use.method, robot, q, 0 * xdot, **parameters)
            step = GRADIENT_STEP**2 * along / np.linalg.norm(along, axis=-1, keepdims=True)
            fell[use.rising].append(f.value(robot, q + step) - f.value(robot, q - step))
        ratio, (difference, allowed) = np.concatenate(ratios), np.concatenate(relative, axis=1)
        checks.append(at_most(f"joint rates less the original's, over the sum of bounds: {use.what} {use.cites}", ratio, 1.0))
        enters = "−measure" if use.rising else "measure"
        rows.append((
            place + 1, use.what, use.cites, use.method.certainty, use.method.title, enters, ratio.size,
            float(difference.max()), float(ratio.max()),
        ))  # fmt: skip
        points.append((beside(place, ratio.size), difference, allowed))
    checks += [
        every("$W = I$ in every cast", identity),
        every("$f$ = measure, $\\alpha > 0$: the self-motion lowers the measure", np.concatenate(fell[False]) < 0),
        every("$f$ = −measure, $\\alpha > 0$: the self-motion raises the measure", np.concatenate(fell[True]) > 0),
    ]
    places, differences, limits_ = (thinned(np.concatenate(part)) for part in zip(*points, strict=True))
    plot = Plot(
        "Relative difference of the joint rates between (6) with $W = I$ and each method in its original form, some of the "
        "situations; a difference of zero is drawn at the foot. The numbers are those of the table.",
        Axis("use", categories=tuple(str(row[0]) for row in rows)), Axis("relative difference of the joint rates", log=True),
        (Series("difference", places, drawable(differences)), Series("sum of bounds", places, limits_, role="bound")),
    )  # fmt: skip
    table = Table(
        "The uses of $G = J^+$ that the paper names, and the works it cites for them. Which work a number stands for is our "
        "reading, as sure as the fourth column says",
        (
            "no.", "use and measure", "cited", "attribution", "method", "$f$", "situations", "largest relative difference",
            "largest difference / bounds",
        ),
        tuple(rows), paper=("cited",),
    )  # fmt: skip
    worked, numbers = _by_hand(framework, original)
    return Evidence((*checks, *numbers), (plot, table, worked))


BY_HAND: tuple[tuple[str, str, Array, tuple[float, float], dict[str, Any], tuple[float, ...], float], ...] = (
    ("no secondary function, α = 0", "gradient_projection", F1, (1.0, 1.0), {"alpha": 0.0}, (1 / 3, -4 / 3, 5 / 3), 1e-14),
    (
        "joint limits ±(π, π, 2π), quadratic, α = 1", "joint_limit_gradient", F1, (0.0, 0.0),
        {"alpha": 1.0, "upper": np.pi * np.array([1.0, 1, 2]), "lower": -np.pi * np.array([1.0, 1, 2])},
        (0.0265258, -0.0265258, -0.0265258), 5e-8,
    ),
    (
        "f = −manipulability, α = 1", "manipulability_gradient", F1B, (0.0, 0.0), {"alpha": 1.0},
        (0.0, -0.178885438, 0.357770876), 5e-10,
    ),
    (
        "gravity torque, α = 0.001", "gravity_torque_gradient", F1B, (0.0, 0.0), {"alpha": 1e-3},
        (0.0, 0.05774166, -0.11548332), 5e-9,
    ),
    (
        "obstacle at (1, 1.4), reach 0.5 m, 100 N/m, α = 0.01", "obstacle_potential", F1, (0.0, 0.0),
        {"alpha": 0.01, "obstacle": np.array([1.0, 1.4, 0]), "reach": 0.5, "stiffness": 100.0, "points": ((2, (1.0, 0, 0)),)},
        (-1 / 30, 1 / 30, 1 / 30), 1e-14,
    ),
)  # fmt: skip
"""Joint rates worked out by hand, and half a unit of their last digit."""


def _by_hand(framework: Answer, original: Answer) -> tuple[Table, list[Check]]:
    robot, rows, checks = robots.load("planar_3r"), [], []
    for words, name, q, xdot, parameters, expected, digit in BY_HAND:
        found, other = (law(METHODS[name], robot, q[None], np.array([xdot]), **parameters)[0] for law in (framework, original))
        checks.append(
            at_most(
                f"by hand: {words}; joint rates less these, over half a unit of their last digit",
                np.abs(found - expected).max() / digit,
                1.0,
            )
        )
        rows.append((words, *(told(values, 8) for values in (expected, found, other))))
    table = Table(
        "Planar 3R, unit links, a point of 1 kg at the end of each: joint rates [rad/s]",
        ("case", "by hand", "(6)", "original form"), tuple(rows),
    )  # fmt: skip
    return table, checks


CLAIM = Claim(
    name="pseudoinverse_methods",
    title="The methods with the pseudoinverse are (6) with W = I",
    place="Section III, second paragraph",
    says=(
        "With $G$ set to $J^+$, Liégeois's method has served joint limits [1], [9], singularities [10], torque [11], obstacles "
        r"[12], [13] and fault tolerance [14], [15]. For these, (6) can be used with $W = I$ and the respective $\alpha$ and "
        r"$f$."
    ),
    formula=r"\dot q = J^+ \dot x - \alpha (I - J^+ J) \nabla f",
    tested=(
        "Twelve measures for these uses, each in its original form ($J^+$ by singular values, the gradient written out) beside "
        r"(6), on the planar 3R and 4R and the Panda; whether the self-motion lowers or raises the measure, by the measure's "
        "own values; five cases by hand. For torque the static gravity torque is taken, a function of configuration."
    ),
    accepted=(
        r"Differences within the sum of both bounds; with $\alpha > 0$, $f$ falls: a measure that is to rise enters as "
        r"$f$ = −measure. Numbers by hand are met to their last digit."
    ),
    paths=(
        CodePath("the method cast with $W = I$, $\\nabla f$ from its expression, answered by eq. (6)", rates),
        CodePath("the method in its original form: $J^+$ by singular values, $\\nabla f$ written out", Method.witness),
    ),
    examine=pseudoinverse_methods,
    fault=Fault(r"Liégeois's $k > 0$, which climbs, taken for $\alpha$, which descends", climbing),
    sources=tuple(dict.fromkeys(work for use in USES for work in use.method.works)),
)
