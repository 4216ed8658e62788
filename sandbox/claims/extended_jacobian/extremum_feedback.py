"""Feedback of g."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from problems import robots
from problems.methods import METHODS
from problems.robots.robot import Robot
from problems.weightings.extended import extremum as condition_of
from problems.weightings.impedance import elastic
from sandbox.agreement import bounds
from sandbox.claims import constrained
from sandbox.claims.claim import Answer, Check, Claim, Evidence, Fault, Role, Trial, at_most, every
from sandbox.claims.constrained import PLANAR, Springs, cross
from sandbox.claims.exhibit import Axis, Plot, Series, SeriesKind, Table
from sandbox.claims.extended_jacobian.extrema import (
    BY_BASIS,
    FRAMEWORK,
    REST,
    SOURCES,
    TOP,
    extrema,
    kinds,
    residual,
    scaled,
    springs_of,
    unit,
)
from sandbox.claims.postures import F1
from sandbox.method import Method
from sandbox.tolerances import (
    LINEAR_SIZE,
    LINEARISED,
    ORIGINAL,
    UNIT,
)  # fmt: skip

Array = np.ndarray

FEEDBACK = METHODS["extremum_feedback"]


def wrong_sign(framework: Answer) -> Answer:
    """Alpha for -alpha."""

    def planted(method: Method, robot: Robot, q: Array, xdot: Array, *, alpha: float = 0.0, **parameters: Any) -> Array:
        return framework(method, robot, q, xdot, alpha=-alpha, **parameters)

    return planted


def feedback(trial: Trial, framework: Answer, by_basis: Answer) -> Evidence:
    """Alpha != 0, f = g: where it drives g to, how fast, and where it does not."""
    rng = trial.rng("extremum_feedback")
    ratios: dict[str, list[float]] = {"alpha": [], "kappa": []}
    falls: list[bool] = []
    for name, count in (("planar_3r", trial.of(80, 8)), ("planar_4r", trial.of(60, 6))):
        robot = robots.load(name)
        q, xdot, parameters = FEEDBACK.draw(robot, rng, count)
        for gain, kept in ratios.items():
            given = {**parameters, "alpha": 0.0, "kappa": 0.0, gain: parameters[gain]}
            x = framework(FEEDBACK, robot, q, xdot, **given)
            allowed = np.add(*bounds(FEEDBACK, FEEDBACK.cast(robot, q, xdot, **given), x, given))
            for i in range(count):
                g, basis = springs_of(parameters, i), constrained.projected(PLANAR, q[i])
                other, condition = by_basis(
                    PLANAR, g.gradient, q[i], xdot[i], basis, alpha=given["alpha"], kappa=given["kappa"]
                )
                rounding = ORIGINAL * robot.n * UNIT * condition**2 * np.abs(other).max()
                kept.append(np.abs(x[i] - other).max() / (allowed[i] + rounding))
        still = np.zeros_like(xdot)
        gradient = np.stack([springs_of(parameters, i).gradient(q[i]) for i in range(count)])
        springs = {"stiffness": parameters["stiffness"], "rest": parameters["rest"], "kappa": 0.0}
        for alpha in (0.5, -0.5):
            x = framework(FEEDBACK, robot, q, still, alpha=alpha, **springs)
            falls += (np.einsum("bn,bn->b", gradient, x) * alpha < 0).tolist()
    words = r"joint rates against $[J; H]\dot q = [\dot x; "
    checks = [
        at_most(words + r"-\alpha (N_J^T H^T)^{-1} h]$: difference / bound", ratios["alpha"], 1.0),
        at_most(
            words + r"-\kappa h]$, for $\nabla f = \kappa H^T h$: difference / bound", ratios["kappa"], 1.0, role=Role.OURS
        ),
        every(r"hand at rest: $\dot g$ has the sign of $-\alpha$", falls),
    ]
    near, close, table = _near_extrema(trial, framework)
    far, reached, landscape = _from_afar(trial, framework)
    return Evidence((*checks, *near, *far, _reach(reached)), (landscape, close, table))


Law = Callable[[float, Array], Array]


def _self_motion(framework: Answer, robot: Robot, g: Springs, **gains: float) -> Law:
    """Rates of the joints while the hand is at rest."""
    still = np.zeros((1, robot.m))

    def law(_: float, q: Array) -> Array:
        return framework(FEEDBACK, robot, q[None], still, stiffness=g.stiffness, rest=g.rest, **gains)[0]

    return law


def _tilted(q: Array, g: Springs, h: float) -> Springs:
    """The springs with rest moved so that |N'grad g| is h at the extremum q, the same along every principal direction."""
    robot = robots.load(f"planar_{len(q)}r")
    condition = condition_of(robot, q, elastic(robot, g.stiffness, g.rest))
    principal = condition.N @ np.linalg.eigh(condition.H @ condition.N)[1]
    return Springs(g.stiffness, g.rest - h * principal.sum(axis=1) / np.sqrt(robot.k) / g.stiffness)


def _near_extrema(trial: Trial, framework: Answer) -> tuple[list[Check], Plot, Table]:
    """|h| over time from 1e-3 of a minimum, a maximum and a saddle, under feedback of both signs and the uniform one."""
    arm, four = robots.load("planar_3r"), robots.load("planar_4r")
    start, duration, alpha, kappa = 1e-3, 2.0, 0.4, 0.6
    drawn = extrema(four, trial.rng("extremum_feedback, saddle"), 60)
    low, high = kinds(four, drawn).T
    mixed = int(np.argmax(np.minimum(-low, high) / np.maximum(np.abs(low), np.abs(high))))
    steep = 2 * max(-low[mixed], high[mixed])
    cases = [
        ("minimum", arm, F1, Springs(np.ones(3), REST), 1 / 3, alpha),
        ("maximum", arm, F1, Springs(np.ones(3), TOP), -1 / 3, alpha),
        ("saddle", four, drawn.q[mixed], springs_of(drawn.parameters, mixed), np.nan, alpha * steep),
    ]
    series, rows, grown = [], [], []
    turned: list[bool] = []
    gaps: dict[str, list[float]] = {"α": [], "κ": []}
    times = np.linspace(0.0, duration, 41)
    for kind, robot, q0, g, reduced, gain in cases:
        tilted = _tilted(q0, g, start)
        for words, gains in (
            ("α > 0", {"alpha": gain, "kappa": 0.0}), ("α < 0", {"alpha": -gain, "kappa": 0.0}), ("κ", {"kappa": kappa}),
        ):  # fmt: skip
            path = solve_ivp(
                _self_motion(framework, robot, tilted, **gains), (0.0, duration), q0, rtol=1e-6, atol=1e-9, t_eval=times,
            )  # fmt: skip
            size = np.array([residual(tilted, q) for q in path.y.T])
            which = {"minimum": slice(None), "maximum": slice(None, None, 2), "saddle": slice(None)}[kind]
            drawn_as: SeriesKind = "points" if kind == "maximum" else "line"
            series.append(
                Series(f"{kind}, {words}", path.t[which], size[which], drawn_as, "other" if kind == "saddle" else "ours")
            )
            expected = np.exp(-kappa * path.t) if words == "κ" else np.exp(-gains["alpha"] * path.t / reduced)
            known = words == "κ" or kind != "saddle"
            rows.append((kind, words, float(start * expected[-1]) if known else None, float(size[-1])))
            if kind == "saddle" and words != "κ":
                grown.append(size[-1] > size[-2])
                continue
            linear = start * expected < LINEAR_SIZE
            gaps[words[0]] += np.abs(np.log(size[linear] / (start * expected[linear]))).tolist()
            if words != "κ":
                turned += ((np.diff(size) < 0) == ((gains["alpha"] > 0) == (kind == "minimum"))).tolist()
    checks = [
        every(r"near a minimum $|h|$ falls for $\alpha > 0$ and grows for $\alpha < 0$, near a maximum the other way", turned),
        at_most(r"near both $\ln |h|$ against that of the linear $\dot h = -\alpha (N_J^T H^T)^{-1} h$: "
        r"difference", gaps["α"], LINEARISED),
        at_most(r"feedback of $\kappa H^T h$: $\ln |h|$ against that of the uniform $\dot h = -\kappa h$: "
        r"difference", gaps["κ"], LINEARISED,
                role=Role.OURS),
        every("near a saddle $|h|$ grows in the end under either sign", grown, role=Role.OURS),
    ]  # fmt: skip
    series.append(Series(f"uniform decay, κ = {kappa:g} /s", times, start * np.exp(-kappa * times), "line", "bound"))
    plot = Plot(
        r"$|h| = |N_J^T \nabla g|$ with the hand at rest, begun near an extremum: the feedback of the paper, $f = g$, "
        r"with both "
        r"signs of $\alpha$, and that of $\kappa H^T h$ instead",
        Axis("time [s]"), Axis("|h|, N orthonormal [Nm]", log=True), tuple(series),
    )  # fmt: skip
    table = Table(
        f"|h| [Nm] after {duration:g} s, begun with {start:g}: expected from the linear rate, beside ours",
        ("begun near a", "feedback", "expected", "ours"), tuple(rows),
    )  # fmt: skip
    return checks, plot, table


BLOWN_UP = 20.0
"""Joint rate [rad/s] at which a self-motion has met N'H' = 0: the hand is at rest and alpha is 1."""


BENT = 0.35
"""Curvature of g along the self-motion [J/rad^2] above which, with alpha = 1, rates are far from BLOWN_UP."""


STRIDE, MOST_STEPS = 0.04, 1000
"""Longest step of a self-motion [rad], and how many are taken."""


def _from_afar(trial: Trial, framework: Answer) -> tuple[list[Check], list[tuple[float, float, bool]], Plot]:
    """The whole self-motion of the planar 3R with its tip at (2, 1): where feedback from each point of it ends."""
    robot, g = robots.load("planar_3r"), Springs(np.ones(3), TOP)
    s, curve = _curve(trial.of(400, 200))
    energy = np.array([g(q) for q in curve])
    n = np.array([cross(q)[:, 0] / np.linalg.norm(cross(q)) for q in curve])
    h = np.einsum("si,si->s", n, np.array([g.gradient(q) for q in curve]))
    bend = np.array(
        [constrained.slope(lambda z: scaled(unit)(z)[:, 0] @ g.gradient(z), q) @ v for q, v in zip(curve, n, strict=True)]
    )
    places = (np.arange(trial.of(48, 12)) + 0.5) * len(s) / trial.of(48, 12)
    places = places.astype(int)
    outcomes: list[tuple[float, float, bool]] = []
    points: dict[str, list[int]] = {}
    for alpha in (1.0, -1.0):
        settled = _settles(framework, robot, g, alpha, curve[places], trial.of(1, 2) * STRIDE)
        sign, goal = (">", "a minimum") if alpha > 0 else ("<", "a maximum")
        for i, there in zip(places, settled, strict=True):
            outcomes.append((alpha, _least_bend(int(i), h, bend, alpha), bool(there)))
            points.setdefault(f"α {sign} 0: {f'goes to {goal}' if there else 'rates without bound'}", []).append(int(i))
    checks = [
        every(
            rf"$\alpha {'>' if sign > 0 else '<'} 0$, begun where $g$ is {'convex' if sign > 0 else 'concave'} all the way "
            "to its "
            f"{'minimum' if sign > 0 else 'maximum'}: it gets there",
            [there for alpha, least, there in outcomes if alpha == sign and least > BENT],
        )
        for sign in (1.0, -1.0)
    ]
    words = f"with an inflection of $g$ on the way: the rates exceed {BLOWN_UP:g} rad/s"
    checks.append(every(words, [not there for _, least, there in outcomes if least < 0], role=Role.OURS))
    height = {">": energy.max() + 0.1 * np.ptp(energy), "<": energy.min() - 0.1 * np.ptp(energy)}
    series = [Series("g", s, energy, "line", "bound")]
    series += [
        Series(
            words,
            s[found],
            np.full(len(found), height[">" if ">" in words else "<"]),
            role="ours" if "goes" in words else "other",
        )
        for words, found in sorted(points.items())
    ]
    turns = np.flatnonzero(np.diff(np.sign(bend)))
    series.append(Series("inflections of g: N′H′ = 0, (7) fails", s[turns], energy[turns]))
    plot = Plot(
        "Spring energy g along the self-motion of the planar 3R, its tip held at (2, 1): where the feedback of the paper, "
        "begun at "
        "each point, ends; α > 0 above, α < 0 below",
        Axis("length along the self-motion [rad]"), Axis("g [J]"), tuple(series),
    )  # fmt: skip
    return checks, outcomes, plot


def _curve(count: int) -> tuple[Array, Array]:
    """Length (count,) and postures (count, 3) once round the self-motion through F1, the tip held by Newton's method."""

    def onwards(_: float, q: Array) -> Array:
        n = cross(q)[:, 0]
        return n / np.linalg.norm(n)

    def back(_: float, q: Array) -> float:
        return float(onwards(0.0, F1) @ (q - F1))

    motion = solve_ivp(onwards, (0.0, 20.0), F1, rtol=1e-9, atol=1e-11, events=back, dense_output=True)
    rounds = [t for t, q in zip(motion.t_events[0], motion.y_events[0], strict=True) if t > 1 and np.linalg.norm(q - F1) < 1e-3]
    lengths = np.linspace(0.0, rounds[0], count, endpoint=False)
    return lengths, np.array([constrained.held(PLANAR, q, constrained.tip(F1)) for q in motion.sol(lengths).T])


def _settles(framework: Answer, robot: Robot, g: Springs, alpha: float, starts: Array, stride: float) -> Array:
    """Whether |h| falls to a twentieth (B,) before the rates exceed BLOWN_UP; steps of Runge and Kutta, up to `stride`."""
    still, given = np.zeros((1, robot.m)), {"stiffness": g.stiffness, "rest": g.rest, "alpha": alpha, "kappa": 0.0}

    def law(q: Array) -> Array:
        return framework(FEEDBACK, robot, q, np.repeat(still, len(q), axis=0), **given)

    q, settled, going = starts.copy(), np.zeros(len(starts), dtype=bool), np.arange(len(starts))
    least = np.array([residual(g, one) for one in q]) / 20
    for _ in range(MOST_STEPS):
        if not len(going):
            break
        first = law(q[going])
        settled[going] = [residual(g, q[i]) < least[i] for i in going]
        speed = np.linalg.norm(first, axis=1)
        keep = (speed < BLOWN_UP) & ~settled[going]
        if not keep.any():
            break
        going, first, dt = going[keep], first[keep], np.minimum(0.1, stride / speed[keep])[:, None]
        second = law(q[going] + dt / 2 * first)
        third = law(q[going] + dt / 2 * second)
        last = law(q[going] + dt * third)
        q[going] += dt / 6 * (first + 2 * second + 2 * third + last)
        going = going[np.linalg.norm([second, third, last], axis=-1).max(axis=0) < BLOWN_UP]
    return settled


def _least_bend(i: int, h: Array, bend: Array, alpha: float) -> float:
    """Smallest alpha bend from place i of the closed curve on, downhill (uphill for alpha < 0), to where h changes sign."""
    towards = -int(np.sign(alpha * h[i]))
    way = (i + towards * np.arange(len(h))) % len(h)
    there = np.flatnonzero(h[way] * h[i] <= 0)
    return float((alpha * bend[way[: there[0] + 1]]).min())


def _reach(outcomes: list[tuple[float, float, bool]]) -> Check:
    up, down = ([there for alpha, _, there in outcomes if alpha == sign] for sign in (1.0, -1.0))
    return every(
        r"from anywhere, which the paper does not say: $\alpha > 0$ ends at a minimum, $\alpha < 0$ at a maximum", [*up, *down],
        role=Role.REACH,
        range=r"It holds from where condition (7) holds all the way to the extremum, that is where $g$ is convex along the "
        r"self-motion for $\alpha > 0$, concave for $\alpha < 0$. On one self-motion of the planar 3R these were "
        rf"{sum(up)} of {len(up)} starts for $\alpha > 0$ and {sum(down)} of {len(down)} for $\alpha < 0$. From the others $g$ "
        r"also falls (rises), but at an inflection $N_J^T H^T = 0$, and the rates grow without bound. Near a saddle "
        r"either sign "
        r"drives $h = N_J^T \nabla g$ away from zero.",
    )  # fmt: skip


CLAIM = Claim(
    name="extremum_feedback",
    title="Feedback of g drives it to a minimum or a maximum",
    place="Section III, after eq. (12)",
    says=r"With $f = g$, a nonzero $\alpha$ introduces a feedback term that drives $g$ specifically to a minimum or a maximum.",
    tested=r"Rates off extrema beside $[J; H]\dot q = [\dot x; -\alpha (N_J^T H^T)^{-1} h]$, $h = N_J^T \nabla g$; "
    r"motions from "
    "near a minimum, a maximum and a saddle; and from all along one self-motion of the planar 3R, with both signs.",
    accepted=r"$\alpha > 0$: $g$ falls, and near a minimum ends there; $\alpha < 0$: it rises, and near a maximum ends there.",
    paths=(FRAMEWORK, BY_BASIS),
    examine=feedback,
    fault=Fault(r"the sign of $\alpha$ turned", wrong_sign),
    sources=SOURCES,
)
