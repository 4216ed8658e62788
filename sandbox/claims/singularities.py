"""Section VI: near kinematic singularities no exact method is realizable; what damping and time scaling do instead."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.optimize import linprog

from problems import robots
from problems.methods import METHODS
from problems.methods.least_squares_rank_deficient import singular
from problems.original import damped_least_squares as damped_original
from problems.original import time_scaling as scaled_original
from problems.robots.robot import Robot
from sandbox.agreement import bounds
from sandbox.claims import equations
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_least, at_most, every
from sandbox.claims.exhibit import Axis, Plot, Series, SeriesKind, Table
from sandbox.closed_form import CLOSED_FORMS
from sandbox.closed_form.damped_least_squares import damped_least_squares
from sandbox.closed_form.eq2_5 import eq2_5
from sandbox.closed_form.eq6 import eq6
from sandbox.closed_form.eq13 import eq13
from sandbox.closed_form.time_scaling import time_scaling
from sandbox.errors import EmptyPlanError
from sandbox.law import rates
from sandbox.problem import VelocityProblem
from sandbox.solution import Solution, Status
from sandbox.task import task_weight
from sandbox.tolerances import EXPONENT, FORWARD, LINEAR_PROGRAM, ORIGINAL, RANK_GAP, UNIT

Array = np.ndarray

SPEED = 0.25
"""Of the hand, in every direction of the task space [m/s; rad/s]: slow for a robot beside people."""

ALONG = 0.6
"""Share of a task velocity along the direction that is being lost; the rest is across it."""

CLOSE = 1e-2
"""Distance [rad] from a singularity below which the smallest singular value is proportional to it."""

ATTEMPTS = 50
"""Lines drawn before giving up: hardly one in ten only touches its singularity."""

DEEPEST = 1e-10
"""Share of the largest singular value down to which a line is followed: below, J is lost in rounding."""

ARMS = ("planar_3r", "seven_joint", "panda")


class Approach(NamedTuple):
    """A straight line q0 + t direction through a singular configuration, and a task velocity with a part in the lost direction.

    q0, direction (n,) [rad]; lost (m,) the left singular vector at q0; xdot (m,) of length SPEED [m/s, rad/s]
    """

    robot: Robot
    q0: Array
    direction: Array
    lost: Array
    xdot: Array

    def q(self, t: Array) -> Array:
        """Configurations (T, n)."""
        return self.q0 + np.asarray(t)[:, None] * self.direction

    def problem(self, t: Array, W: Array | None = None, xdot: Array | None = None) -> VelocityProblem:
        """The task at every t; W is I and a zero if left out."""
        n = self.robot.n
        return VelocityProblem(
            J=self.robot.jacobian(self.q(t)), xdot=self.xdot if xdot is None else xdot, W=np.eye(n) if W is None else W
        )


def approach(robot: Robot, rng: np.random.Generator) -> Approach:
    """A random line through a random singular configuration, which it crosses: sigma_min falls in proportion to |t| there.

    Raises EmptyPlanError where hardly any line does.
    """
    for _ in range(ATTEMPTS):
        q0 = singular(robot, rng, 1)[0]
        lost = np.linalg.svd(robot.jacobian(q0))[0][:, -1]
        direction, across = rng.standard_normal(robot.n), rng.standard_normal(robot.m)
        across -= lost * (lost @ across)
        xdot = ALONG * lost + np.sqrt(1 - ALONG**2) * across / np.linalg.norm(across)
        one = Approach(robot, q0, direction / np.linalg.norm(direction), lost, SPEED * xdot)
        far, near = singular_values(robot.jacobian(one.q(np.array([CLOSE / 10, CLOSE / 100]))))[1][:, -1]
        if abs(np.log10(far / near) - 1) < CLOSE:
            return one
    raise EmptyPlanError(f"no line crosses a singularity of {robot.name}")


def stretching(turn: float = 0.0) -> Approach:
    """The planar 3R (turn + t, -t, -t): its hand moves straight out to the full stretch at t = 0 and straight back.

    The direction that is lost, and of the hand's path, is the radial one; the hand is 1 + 2 cos t from the base.
    """
    robot = robots.load("planar_3r")
    radial = np.array([np.cos(turn), np.sin(turn)])
    return Approach(robot, np.array([turn, 0.0, 0.0]), np.array([1.0, -1.0, -1.0]), radial, -SPEED * radial)


def singular_values(J: Array) -> tuple[Array, Array, Array]:
    """(u (B, m), sigma (B, m), v (B, n)): the singular vectors of the smallest singular value, and all values."""
    U, sigma, Vt = np.linalg.svd(J)
    return U[:, :, -1], sigma, Vt[:, sigma.shape[1] - 1]


def slope(x: Array, y: Array) -> float:
    """Exponent p of y ~ x^p, by least squares of the logarithms."""
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


def each(equation: Answer, problem: VelocityProblem) -> Array:
    """The rates (B, n) of a printed equation, one problem after the other; alpha = 1, grad f = a."""
    W = problem.W.dense()
    return np.stack([equation(problem.J[i], problem.xdot[i], W[i], problem.a[i], 1.0) for i in range(len(problem))])


def norms(x: Array) -> Array:
    """2-norm of every row."""
    return np.linalg.norm(x, axis=-1)


def shown(values: Iterable[float]) -> Array:
    """Values for a logarithmic axis: zeros are left out."""
    array = np.asarray(values, dtype=float)
    return np.where(array > 0, array, np.nan)


def drawn_as(method: str, *lines: str) -> SeriesKind:
    """A line for the methods named, points for the others."""
    return "line" if method in lines else "points"


def not_realizable_near_singularity(trial: Trial, six: Answer, printed: Answer) -> Evidence:
    """(6), (2)-(5) and (13) on lines into singular configurations of three arms, against what any exact method must do."""
    rng = trial.rng("not_realizable_near_singularity")
    reach = np.geomspace(1.5, 1e-9, trial.of(56, 20))
    checks: list[Check] = []
    rows: list[tuple[str | float | int | None, ...]] = []
    slopes: dict[str, list[float]] = {"(6)": [], "(2)–(5)": [], "(13)": []}
    growth: list[Series] = []
    shares, ratios, least, far = [], [], [], []
    for name in ARMS if trial.full else ("planar_3r", "panda"):
        robot = robots.load(name)
        for line in range(trial.of(5, 1)):
            one = approach(robot, rng)
            u, sigma, _ = singular_values(one.problem(reach).J)
            deep = sigma[:, -1] > DEEPEST * sigma[:, 0]
            t, u, sigma = reach[deep], u[deep], sigma[deep]
            problem = one.problem(t)
            lowest, x = sigma[:, -1], six(problem).x
            other = each(printed, problem)
            ratios.append(np.abs(x - other).max(axis=1) / np.abs(other).max(axis=1) / (2 * CLOSED_FORMS["eq6"].bound(problem)))
            # u'xdot = sigma v'qdot whatever the method: |qdot| >= |u'xdot| / sigma
            floor = np.abs(u @ one.xdot) / lowest
            rounding = FORWARD * robot.n * UNIT * sigma[:, 0] / lowest
            least.append((floor / norms(x) - 1) / (rounding + CLOSED_FORMS["eq6"].bound(problem)))
            by_method = {"(6)": norms(x), "(2)–(5)": norms(eq2_5(problem).x), "(13)": norms(eq13(problem).x)}
            for method, size in by_method.items():
                near = (t <= CLOSE) & np.isfinite(size)
                if method == "(2)–(5)":  # they say nothing where their own error bound is no longer small
                    near &= CLOSED_FORMS["eq2_5"].bound(problem) < CLOSE
                slopes[method].append(slope(lowest[near], size[near]))
            if name == "panda" and not line:
                ends, limit = [lowest[-1], lowest[0]], [robot.rate_limits.min()] * 2
                growth = [Series(method, lowest, size, drawn_as(method, "(6)", "(13)")) for method, size in by_method.items()]
                growth += [
                    Series("least of any exact method, |u'xdot| / sigma", lowest, floor, "line", "bound"),
                    Series("rate limit of the slowest joint", ends, limit, "line", "bound"),
                ]
            share = unrealizable(one, t, rng, six, trial.of(200, 60))
            far.append(share[t <= CLOSE**2])
            half = float(lowest[share >= 0.5].max(initial=0.0)) or None
            translation = float(one.lost[:3] @ one.lost[:3]) if robot.m == 6 else None
            power, end = slopes["(6)"][-1], float(norms(x)[-1])
            rows.append((f"{name}, singularity {line + 1}", translation, power, half, float(share[-1]), end))
            if not line:
                shares.append(Series(name, lowest, share, "line"))
    for method, found in slopes.items():
        words = rf"joint rates of {method} grow as $1/\sigma_{{\min}}$: |exponent + 1|"
        checks.append(at_most(words, np.abs(np.array(found) + 1), EXPONENT))
    checks += [
        at_least("share of random task directions whose rates by (6) exceed a rate limit, within "
                 f"{CLOSE**2:g} rad of a singularity: more than half", np.concatenate(far), 0.5),
        at_most("(6) of the sandbox and as printed: difference / sum of bounds", np.concatenate(ratios), 1.0),
        at_most(r"$|\dot q| \ge |u^T \dot x| / \sigma_{\min}$, $u$ the direction that is lost: what is short of it, / bound",
                np.concatenate(least), 1.0, role=Role.OURS),
    ]  # fmt: skip
    plots = (
        Plot(
            "Joint rates on a straight line into a singularity of the Panda, hand speed 0.25 (m/s, rad/s); (2)–(5) ends where "
            "forming J J' has lost the smallest singular value",
            Axis("smallest singular value of J", log=True), Axis("|qdot| [rad/s]", log=True), tuple(growth),
        ),
        Plot(
            "“Typically”: share of random task directions, hand speed 0.25, whose rates by (6) exceed a rate limit",
            Axis("smallest singular value of J", log=True), Axis("share of directions", low=0, high=1), tuple(shares),
        ),
    )  # fmt: skip
    columns = ("where", "translation in the lost "
                        "direction", "exponent of (6)", "σ_min where half of the directions exceed a limit",
               "share at the end", "|qdot| at the end [rad/s]")  # fmt: skip
    return Evidence(tuple(checks), (*plots, Table("Lines into singular configurations, W = I", columns, tuple(rows))))


def unrealizable(one: Approach, t: Array, rng: np.random.Generator, six: Answer, count: int) -> Array:
    """Share (T,) of `count` random task directions for which the rates of (6) exceed a limit."""
    xdot = rng.standard_normal((count, one.robot.m))
    xdot *= SPEED / norms(xdot)[:, None]
    # linear in xdot: m columns say it all
    columns = [six(one.problem(t, xdot=row)).x for row in np.eye(one.robot.m)]
    x = np.einsum("kbn,ck->bcn", np.stack(columns), xdot)
    return np.asarray((np.abs(x) > one.robot.rate_limits).any(axis=2).mean(axis=1))


def truncated(six: Answer) -> Answer:
    """The pseudoinverse with singular values below a hundredth of the largest dropped, in the place of (6)."""

    def planted(problem: VelocityProblem) -> Solution:
        x = (np.linalg.pinv(problem.J, rcond=CLOSE) @ problem.xdot[:, :, None])[:, :, 0]
        return replace(six(problem), x=x)

    return planted


TURN = 0.6
"""Direction of the stretched arm [rad] where rank tolerances are looked at: along an axis a row of J would vanish, and eq13,
which scales rows to one, would see no small singular value at all."""

TOLERANCES = (1e-5, 1e-4, 1e-3)
"""Declared rank tolerances; more than 1e-3 leaves no gap of 1000 to what is kept."""


def row_scale(J: Array) -> Array:
    """The powers of two (..., m, 1) at or above the largest entry of each row: eq13 scales rows by them first."""
    return np.asarray(np.exp2(np.ceil(np.log2(np.abs(J).max(axis=-1, keepdims=True)))))


def relative_sigma(J: Array) -> Array:
    """sigma_2 / sigma_1 (B,) of J (B, 2, n) with its rows scaled near one: what rank tolerances are compared with."""
    sigma = np.linalg.svd(J / row_scale(J), compute_uv=False)
    return np.asarray(sigma[:, 1] / sigma[:, 0])


def at_rank(printed: Answer, problem: VelocityProblem, rank: Array) -> Array:
    """(13) as printed (B, n) with J, its rows scaled, taken to have the given ranks (B,); N, R = V_r by singular values."""
    x = np.empty((len(problem), problem.n))
    W, Wx = problem.W.dense(), task_weight(problem)
    for i, r in enumerate(rank):
        scale = row_scale(problem.J[i])
        U, sigma, Vt = np.linalg.svd(problem.J[i] / scale)
        J = scale * U[:, :r] * sigma[:r] @ Vt[:r]
        x[i] = printed(J, problem.xdot[i], W[i], problem.a[i], 1.0, Wx[i], Vt[r:].T, Vt[:r].T)
    return x


def eq13_does_not_solve_it(trial: Trial, thirteen: Answer, printed: Answer) -> Evidence:
    """(13) against its rank tolerance beside a singularity, and across one: the planar 3R stretched out and back."""
    one = stretching(TURN)
    # neither along the lost direction nor across it
    one = one._replace(xdot=SPEED * np.array([np.cos(TURN + 2.0), np.sin(TURN + 2.0)]))
    tolerances = np.geomspace(1e-9, 0.5, trial.of(120, 40))
    checks, ratios, steps, jumps, located, series = [], [], [], [], [], []
    for t in (1e-6, 1e-5, 1e-4):
        problem = one.problem(np.array([t]))
        share = float(relative_sigma(problem.J)[0])
        found = [thirteen(problem, rank_tolerance=tolerance) for tolerance in tolerances]
        solved = np.array([solution.status[0] is Status.SOLVED for solution in found])
        size = np.array([norms(solution.x)[0] for solution in found])
        series += [Series(f"{t:g} rad from the stretch", tolerances, shown(size)),
                   Series(f"σ₂/σ₁ = {share:.1e}", [share], [1.0], "vertical", "bound")]  # fmt: skip
        full, less = solved & (tolerances < share), solved & (tolerances > share)
        ranks = np.where(tolerances < share, 2, 1)
        expected = at_rank(printed, VelocityProblem(J=np.repeat(problem.J, len(ranks), 0), xdot=one.xdot, W=np.eye(3)), ranks)
        x = np.concatenate([solution.x for solution in found])
        off = np.abs(x - expected).max(axis=1) / np.abs(expected).max(axis=1)
        ratios.append(off / (ORIGINAL * 3 * UNIT / share))
        located.append(bool(full.any() and less.any()))
        steps.append(size[full].min() / size[less].max() * share)
    checks.append(at_most("(13) of the sandbox and as printed, at the rank that the tolerance declares: difference / bound",
                          np.concatenate(ratios), 1.0))  # fmt: skip
    checks.append(
        every(r"beside a singularity (13) has one answer for tolerances below $\sigma_2/\sigma_1$ and one above", located)
    )
    checks.append(at_least(r"their ratio grows as $\sigma_1/\sigma_2$: ratio × $\sigma_2/\sigma_1$", steps, EXPONENT))
    distance = np.geomspace(1e-1, 1e-9, trial.of(33, 9))
    at_zero = thirteen(one.problem(np.zeros(1))).x[0]
    for side in (-1.0, 1.0):
        x = thirteen(one.problem(side * distance)).x
        six = eq6(one.problem(side * distance)).x
        bound = 2 * CLOSED_FORMS["eq13"].bound(one.problem(side * distance))
        ratios.append(np.abs(x - six).max(axis=1) / np.abs(six).max(axis=1) / bound)
        jumps.append(slope(distance[distance < CLOSE], norms(x - at_zero)[distance < CLOSE]))
    checks += [
        at_most("off the singularity (13) gives the rates of (6): difference / sum of "
                "bounds", np.concatenate(ratios[-2:]), 1.0),
        at_most("its jump at the singularity is infinite: |exponent + 1| of rates beside less rates at it, against the "
                "distance",
                np.abs(np.array(jumps) + 1), EXPONENT),
        *_tolerances_along(one, thirteen),
        *_ambiguous(one, thirteen),
    ]  # fmt: skip
    across, table = _across(one, thirteen, at_zero)
    step = Plot(
        "(13) close to a singularity against its rank tolerance: the small singular value is inverted, or it is dropped",
        Axis("rank tolerance, share of the largest singular value (rows of J scaled to one)", log=True),
        Axis("|qdot| [rad/s]", log=True), tuple(series),
    )  # fmt: skip
    return Evidence(tuple(checks), (across, step, table))


def _tolerances_along(one: Approach, thirteen: Answer) -> list[Check]:
    """The largest rates over the path for each declared tolerance: beside its window they are those of the edge."""
    t = np.concatenate([-np.geomspace(0.3, 1e-8, 200), [0.0], np.geomspace(1e-8, 0.3, 200)])
    problem = one.problem(t)
    largest, errors = [], []
    for tolerance in TOLERANCES:
        x = thirteen(problem, rank_tolerance=tolerance).x
        largest.append(np.nanmax(np.abs(x) / one.robot.rate_limits))
        error = norms((problem.J @ x[:, :, None])[:, :, 0] - problem.xdot)
        errors.append(np.nanmax(error) / abs(one.lost @ one.xdot))
    declared = ", ".join(f"{tolerance:g}" for tolerance in TOLERANCES)
    return [
        at_least(f"with rank tolerances {declared}: largest rate / limit on the way through, all the same", largest, 1.0),
        at_least("and the part of the task in the lost direction that is missed inside the window, of all of it",
                 errors, 1 - EXPONENT),
    ]  # fmt: skip


def _ambiguous(one: Approach, thirteen: Answer) -> list[Check]:
    """Where no gap of 1000 separates the singular values, and where rounding leaves the rank open."""
    open_rank = one.problem(np.array([1e-13]))
    small = one.problem(np.array([1e-2]))
    share = float(relative_sigma(small.J)[0])
    return [
        every("the sandbox refuses where rounding leaves the rank open, and answers once a tolerance is declared",
              [thirteen(open_rank).status[0] is Status.RANK_AMBIGUOUS,
               thirteen(open_rank, rank_tolerance=1e-6).status[0] is Status.SOLVED], role=Role.OURS),
        every(f"it refuses to drop a singular value that is not {RANK_GAP:g} times smaller than the next",
              [1 / share < RANK_GAP, thirteen(small, rank_tolerance=2 * share).status[0] is Status.RANK_AMBIGUOUS],
              role=Role.OURS),
    ]  # fmt: skip


def _across(one: Approach, thirteen: Answer, at_zero: Array) -> tuple[Plot, Table]:
    """|qdot| through the singularity for each tolerance, and the rates just before, at and after it."""
    t = np.linspace(-4e-3, 4e-3, 161)
    problem = one.problem(t)
    series = [Series("default tolerance", t, norms(thirteen(problem).x))]
    series += [Series(f"tolerance {tau:g}", t, norms(thirteen(problem, rank_tolerance=tau).x), "line") for tau in TOLERANCES]
    series.append(Series("rate limit", [t[0], t[-1]], [one.robot.rate_limits.min()] * 2, "line", "bound"))
    plot = Plot(
        "(13) across the singularity: the planar 3R through its full stretch, hand speed 0.25 m/s; gaps are refusals",
        Axis("t, from the full stretch [rad]"), Axis("|qdot| [rad/s]", log=True), tuple(series),
    )  # fmt: skip
    rows: list[tuple[str | float | int | None, ...]] = []
    for when in (-1e-2, -1e-4, -1e-6, -1e-8, 0.0, 1e-8, 1e-6, 1e-4, 1e-2):
        for tolerance in (None, 1e-3):
            options = {} if tolerance is None else {"rank_tolerance": tolerance}
            solution = thirteen(one.problem(np.array([when])), **options)
            x = solution.x[0]
            miss = one.robot.jacobian(one.q(np.array([when])))[0] @ x - one.xdot
            label = "default" if tolerance is None else f"{tolerance:g}"
            rows.append((when, label, *(float(v) for v in x), float(np.linalg.norm(miss))))
    columns = ("t [rad]", "rank tolerance", "joint 1 [rad/s]", "joint 2 [rad/s]", "joint 3 [rad/s]", "task error [m/s]")
    return plot, Table("(13) just before, at and after the singularity", columns, tuple(rows))


def undeclared(thirteen: Answer) -> Answer:
    """Eq. (13) to which the declared rank tolerance is not handed on."""

    def planted(problem: VelocityProblem, *, rank_tolerance: float | None = None) -> Solution:
        return thirteen(problem)

    return planted


DAMPINGS = (0.03, 0.1, 0.3)
"""lambda [m] along the paths; with hand speed 0.25 m/s, 0.1 keeps |qdot| below 1.25 rad/s."""

CHOSEN = 0.1


class Passage(NamedTuple):
    """What each method does on a way through a singularity; rates (B, n) [rad/s], t (B,) [rad]."""

    name: str
    one: Approach
    t: Array
    problem: VelocityProblem
    sigma: Array
    by: dict[str, Array]
    least: Array  # of max |rate| / limit, over all rates with J qdot = xdot
    floor: Array  # that such rates cannot go below

    @property
    def limits(self) -> Array:
        """Rate limits (n,)."""
        return self.one.robot.rate_limits

    def load(self, method: str) -> Array:
        """Largest |rate| / limit (B,)."""
        return np.asarray((np.abs(self.by[method]) / self.limits).max(axis=1))

    def missed(self, method: str) -> Array:
        """|J qdot - xdot| / |xdot| (B,)."""
        return np.asarray(norms(self.achieved(method) - self.problem.xdot) / norms(self.problem.xdot))

    def aside(self, method: str) -> Array:
        """Part of J qdot across xdot / |xdot| (B,): what leaves the path."""
        size, achieved = norms(self.problem.xdot)[:, None], self.achieved(method)
        unit = self.problem.xdot / size
        return np.asarray(norms(achieved - unit * (achieved * unit).sum(axis=1, keepdims=True)) / size[:, 0])

    def achieved(self, method: str) -> Array:
        """J qdot (B, m)."""
        return np.asarray((self.problem.J @ self.by[method][:, :, None])[:, :, 0])


def least_load(programme: Answer, J: Array, xdot: Array, limits: Array) -> float:
    """Least max |qdot_i| / limit_i of all qdot with J qdot = xdot, by linear programming; inf where there is none."""
    m, n = J.shape
    # unknowns (p, load), qdot = limits p: minimise load subject to J limits p = xdot, -load <= p <= load
    rows = np.block([[np.eye(n), -np.ones((n, 1))], [-np.eye(n), -np.ones((n, 1))]])
    found = programme(
        np.eye(1, n + 1, n)[0], A_ub=rows, b_ub=np.zeros(2 * n), A_eq=np.hstack([J * limits, np.zeros((m, 1))]), b_eq=xdot,
        bounds=(None, None), method="highs",
    )  # fmt: skip
    return float(found.fun) if found.status == 0 else np.inf


def passages(trial: Trial, six: Answer, programme: Answer, rng: np.random.Generator) -> list[Passage]:
    """The planar 3R straight out to its full stretch and back, and a line through a singularity of the Panda and the 7R."""
    found = []
    t = np.geomspace(0.8, 1e-4, trial.of(60, 16))
    t = np.concatenate([-t, t[::-1]])
    lines = [("planar 3R, out and back", stretching())]
    lines += [(f"{name}, a line through a singularity", approach(robots.load(name), rng)) for name in ("panda", "seven_joint")]
    for name, one in lines if trial.full else lines[:2]:
        limits = one.robot.rate_limits
        planar = one.robot.m == 2
        xdot = np.where(t[:, None] < 0, -one.xdot, one.xdot) if planar else one.xdot  # out, then back
        # W measures rates by their limits, so that (6) comes as near to the least load as a 2-norm does
        problem = one.problem(t, np.diag(limits**-2.0), xdot)
        u, sigma, v = singular_values(problem.J)
        x = six(problem).x
        plain = VelocityProblem(J=problem.J, xdot=problem.xdot, W=np.eye(one.robot.n))
        by = {
            "(6)": x, "(13)": eq13(problem).x, "damped": damped_least_squares(plain, damping=CHOSEN).x,
            "scaled": time_scaling(x, limits)[0],
        }  # fmt: skip
        least = np.array([least_load(programme, problem.J[i], problem.xdot[i], limits) for i in range(len(t))])
        floor = np.abs((u * problem.xdot).sum(axis=1)) / (sigma[:, -1] * (np.abs(v) @ limits))
        found.append(Passage(name, one, t, problem, sigma, by, least, floor))
    return found


NAMES = {
    "(6)": "(6), exact",
    "(13)": "(13)",
    "damped": f"damped least squares, λ = {CHOSEN:g}",
    "scaled": "time scaling",
}

LINES = ("(6)", "damped", "scaled")
"""Drawn as lines; (13), which is (6) there, as points upon its line."""


def must_give_up_exactness(trial: Trial, six: Answer, programme: Answer) -> Evidence:
    """The least load of all exact rates along a way through a singularity, beside (6), (13), damping and time scaling."""
    rng = trial.rng("must_give_up_exactness")
    beyond, within, order, exact, gap, floor = [], [], [], [], [], []
    rows: list[tuple[str | float | int | None, ...]] = []
    ways = passages(trial, six, programme, rng)
    for way in ways:
        over, n = way.floor > 1, way.one.robot.n
        beyond.append(way.least[over])
        within += [way.load("damped"), way.load("scaled")]
        load = way.load("(6)")
        order += [way.least / load, load / (np.sqrt(n) * way.least)]
        rounding = FORWARD * n * UNIT * way.sigma[:, 0] * norms(way.by["(6)"]) / norms(way.problem.xdot)
        exact.append(way.missed("(6)") / rounding)
        floor.append(way.floor / way.least)
        # rates within the limits miss at least |u'xdot| (1 - 1/floor)
        u = singular_values(way.problem.J)[0]
        must = np.abs((u * way.problem.xdot).sum(axis=1)) * (1 - 1 / way.floor) / norms(way.problem.xdot)
        gap += [(must - way.missed(method))[over] for method in ("damped", "scaled")]
        near = way.t[way.least > 1]
        rows.append((way.name, "least of all exact rates", float(way.least.max()), 0.0, 0.0, float(np.abs(near).max())))
        for method, label in NAMES.items():
            loaded = way.t[way.load(method) > 1 + LINEAR_PROGRAM]
            rows.append((way.name, label, float(way.load(method).max()), float(way.missed(method).max()),
                         float(way.aside(method).max()), float(np.abs(loaded).max()) if len(loaded) else None))  # fmt: skip
    stretched = stretching().problem(np.zeros(1))
    nothing = least_load(programme, stretched.J[0], stretched.xdot[0], stretching().robot.rate_limits)
    checks = (
        at_least("near the singularity even the least load of all exact rates exceeds the limits: largest |rate| / limit",
                 np.concatenate(beyond), 1.0),
        every("at the full stretch no rates are exact: the linear programme has no feasible point", [nothing == np.inf]),
        at_most("damped least squares and time scaling: largest |rate| / limit, all the way", np.concatenate(within),
                1 + FORWARD * UNIT),
        at_most("where exact rates exceed the limits both miss the task by no less than rates within the limits must: "
                "what is short of it", np.concatenate(gap), LINEAR_PROGRAM),
        at_most("(6) is one of the exact rates: task error / rounding", np.concatenate(exact), 1.0, role=Role.OURS),
        at_most(r"least load ≤ load of (6) ≤ $\sqrt n$ least load, $W = \mathrm{diag}(1/\dot q_{\max}^2)$: both ratios",
                np.concatenate(order), 1 + LINEAR_PROGRAM, role=Role.OURS),
        at_most(r"least load ≥ $|u^T\dot x| / (\sigma_{\min} \sum_i |v_i| \dot q_{\max,i})$: ratio", np.concatenate(floor),
                1 + LINEAR_PROGRAM, role=Role.OURS),
    )  # fmt: skip
    way = ways[0]
    loads = [Series("least of all exact rates, by linear programming", way.t, way.least, "line", "other")]
    loads += [Series(label, way.t, shown(way.load(method)), drawn_as(method, *LINES)) for method, label in NAMES.items()]
    loads.append(Series("limit", [way.t[0], way.t[-1]], [1.0, 1.0], "line", "bound"))
    missed = [Series(label, way.t, way.missed(method), drawn_as(method, *LINES)) for method, label in NAMES.items()]
    missed.append(Series("least that rates within the limits miss", way.t, np.maximum(1 - 1 / way.floor, 0.0), "line", "bound"))
    axis = Axis("t, joint angle from the full stretch [rad]; the hand is 2 (1 − cos t) m short of it")
    plots = (
        Plot("Planar 3R straight out to its full stretch and back, hand speed 0.25 m/s: joint rates", axis,
             Axis("largest |rate| / limit", log=True), tuple(loads)),
        Plot("The same: what each method misses of the task velocity", axis,
             Axis("|J qdot − xdot| / |xdot|", low=0, high=1), tuple(missed)),
    )  # fmt: skip
    columns = (
        "way",
        "method",
        "largest rate / limit",
        "largest task error / speed",
        "of it, off the path",
        "over the limits within [rad]",
    )
    return Evidence(checks, (*plots, Table("Four methods through three singularities", columns, tuple(rows))))


def transposed(six: Answer) -> Answer:
    """J'xdot, scaled to the task along its gradient, passed off as an exact solution."""

    def planted(problem: VelocityProblem) -> Solution:
        x = np.einsum("bmn,bm->bn", problem.J, problem.xdot)
        back = np.einsum("bmn,bn->bm", problem.J, x)
        gain = (problem.xdot * back).sum(axis=1) / np.maximum((back * back).sum(axis=1), UNIT)
        return replace(six(problem), x=gain[:, None] * x)

    return planted


BENT = (0.0, np.pi / 2, -np.pi / 2)
"""The planar 3R of the worked examples: J = [-1, -1, 0; 2, 1, 1]."""

DAMPED_BY_HAND = ((Fraction(-1, 12), Fraction(1, 4)), (Fraction(-1, 3), Fraction(0)), (Fraction(1, 4), Fraction(1, 4)))
"""(J'J + I)^-1 J' of that arm, lambda = 1 (methods C1)."""


def damped_least_squares_at_singularities(trial: Trial, damped: Answer, original: Answer) -> Evidence:
    """Damped least squares as (6) on the arm with slack joints, against its formula by singular values."""
    rng = trial.rng("damped_least_squares_at_singularities")
    method = METHODS["damped_least_squares"]
    agree, bound, change, lost, rows = [], [], [], [], []
    rate_plot, error_plot = [], []
    t = np.sort(np.concatenate([np.linspace(-0.5, 0.5, trial.of(161, 81)), np.linspace(-0.02, 0.02, trial.of(81, 41))]))
    ways = [("planar 3R through its full stretch", stretching(TURN))]
    ways += [(f"{name} through a singularity", approach(robots.load(name), rng)) for name in ("panda", "seven_joint")]
    for name, one in ways if trial.full else ways[:2]:
        q, n = one.q(t), one.robot.n
        problem = one.problem(t)
        u, sigma, _ = singular_values(problem.J)
        component = np.abs(u @ one.xdot)
        for damping in DAMPINGS:
            x = damped(problem, damping=damping).x
            other = original(one.robot, q, problem.xdot, damping=damping)
            agree.append(np.abs(x - other).max(axis=1) / sum(bounds(method, problem, x, {"damping": damping})))
            bound.append(norms(x) * 2 * damping / SPEED)
            step = np.linalg.norm(np.diff(problem.J, axis=0), 2, axis=(1, 2))
            moved = norms(np.diff(x, axis=0))
            # |d (J'(JJ' + l^2)^-1)| <= (1 + 1/4) |dJ| / l^2, and rounding
            smooth = 1.25 * step * SPEED / damping**2 + 2 * ORIGINAL * n * UNIT * SPEED / damping
            change.append(moved / np.maximum(smooth, UNIT))
            miss = (problem.J @ x[:, :, None])[:, :, 0] - problem.xdot
            share = damping**2 / (sigma[:, -1] ** 2 + damping**2)
            rounding = ORIGINAL * n * UNIT * (1 + sigma[:, 0] / damping)
            lost.append(np.abs(np.abs((u * miss).sum(axis=1)) - share * component) / rounding)
            rows.append((name, damping, float(norms(x).max()), SPEED / (2 * damping), float(norms(miss).max() / SPEED),
                         float((np.abs(x) / one.robot.rate_limits).max())))  # fmt: skip
            if name == ways[0][0]:
                ends, ceiling = [t[0], t[-1]], [SPEED / 2 / damping] * 2
                rate_plot.append(Series(f"λ = {damping:g}", t, norms(x), "line"))
                rate_plot.append(Series(f"bound |xdot| / (2λ), λ = {damping:g}", ends, ceiling, "line", "bound"))
                error_plot.append(Series(f"λ = {damping:g}", t, norms(miss) / SPEED, "line"))
                error_plot.append(Series(f"λ²/(σ² + λ²), λ = {damping:g}", t, share * component / SPEED, "line", "bound"))
        if name == ways[0][0]:
            size = norms(eq13(problem).x)
            rate_plot.append(Series("(13), exact off the singularity", t, size, "line", "other"))
    weighed = _weighed_draws(trial, damped, original, rng)
    checks = (
        at_most("(6) on the arm with slack joints and the formula by singular values: difference / sum of bounds",
                np.concatenate(agree), 1.0),
        at_most(r"the same with general $W$, $W_{\dot x}$ and gradient, at generic, nearly singular and singular "
                "configurations", weighed, 1.0),
        at_most(r"$|\dot q| \le |\dot x| / (2\lambda)$: ratio", np.concatenate(bound), 1 + FORWARD * UNIT),
        at_most(r"no jump: $|\Delta\dot q| \le \frac54 |\Delta J|\,|\dot x| / \lambda^2$ between neighbours, through the "
                "singularity: ratio", np.concatenate(change), 1.0),
        at_most(r"the price: of $u^T\dot x$ the share $\lambda^2/(\sigma^2 + \lambda^2)$ is missed, all of it at the "
                "singularity: difference / rounding", np.concatenate(lost), 1.0),
        *_damped_by_hand(damped, original),
    )  # fmt: skip
    axis = Axis("t, from the singularity [rad]")
    plots = (
        Plot("Planar 3R through its full stretch, xdot radial, 0.25 m/s: joint "
             "rates", axis, Axis("|qdot| [rad/s]", low=0, high=8),
             tuple(rate_plot)),
        Plot("The same: task error of damped least squares, on what the smallest singular value predicts", axis,
             Axis("|J qdot − xdot| / |xdot|", low=0, high=1), tuple(error_plot)),
    )  # fmt: skip
    columns = (
        "way",
        "λ",
        "largest |qdot| [rad/s]",
        "bound |xdot|/(2λ) [rad/s]",
        "largest task error / speed",
        "largest rate / limit",
    )
    return Evidence(
        checks, (*plots, Table("Damped least squares through singularities, hand speed 0.25", columns, tuple(rows)))
    )


def _weighed_draws(trial: Trial, damped: Answer, original: Answer, rng: np.random.Generator) -> Array:
    """Difference over bounds in the situations that the method draws for itself."""
    method, ratios = METHODS["damped_least_squares"], []
    for name in ARMS if trial.full else ARMS[:1]:
        robot = robots.load(name)
        drawn = method.draw(robot, rng, trial.of(60, 12))
        problem = method.cast(robot, drawn.q, drawn.xdot, **drawn.parameters)
        x = damped(problem, damping=drawn.parameters["damping"]).x
        other = original(robot, drawn.q, drawn.xdot, **drawn.parameters)
        ratios.append(np.abs(x - other).max(axis=1) / sum(bounds(method, problem, x, drawn.parameters)))
    return np.concatenate(ratios)


def _damped_by_hand(damped: Answer, original: Answer) -> list[Check]:
    """The numbers of methods C1: the damped inverse at lambda = 1, and what its null-space projector lets leak."""
    robot = robots.load("planar_3r")
    q = np.array([BENT, BENT])
    problem = VelocityProblem(J=robot.jacobian(q), xdot=np.eye(2), W=np.eye(3))
    hand = np.array([[float(entry) for entry in row] for row in DAMPED_BY_HAND])
    inverse = damped(problem, damping=1.0).x.T
    other = original(robot, q, np.eye(2), damping=1.0).T
    leak = (problem.J[0] @ (np.eye(3) - inverse @ problem.J[0]))[:, 0]
    tolerance = ORIGINAL * 3 * UNIT
    return [
        at_most(r"worked by hand, $\lambda = 1$: the damped inverse, both paths", np.abs(np.stack([inverse, other]) - hand),
                tolerance, role=Role.OURS),
        at_most(r"worked by hand: $J(I - J^* J)e_1 = (-1/12, 1/4)$, so the self-motion of a damped inverse moves the hand",
                np.abs(leak - hand[0]), tolerance, role=Role.OURS),
    ]  # fmt: skip


def unsquared(damped: Answer) -> Answer:
    """Damping by lambda in the place of lambda^2."""

    def planted(problem: VelocityProblem, *, damping: float) -> Solution:
        return damped(problem, damping=float(np.sqrt(damping)))

    return planted


def time_scaling_at_singularities(trial: Trial, scaled: Answer, original: Answer) -> Evidence:
    """Time scaling on lines into singularities and through the full stretch, against its original by bisection."""
    rng = trial.rng("time_scaling_at_singularities")
    method = METHODS["time_scaling"]
    t = np.geomspace(1.5, 1e-6, trial.of(50, 16))
    agree, load, straight, exponents, speeds, factors, rows = [], [], [], [], [], [], []
    ways = [("planar 3R, full stretch", stretching(TURN))]
    ways += [(f"{name}, singularity {i + 1}", approach(robots.load(name), rng))
             for name in (ARMS if trial.full else ("panda",)) for i in range(trial.of(3, 1))]  # fmt: skip
    for name, one in ways:
        robot, q = one.robot, one.q(t)
        problem = one.problem(t)
        x = scaled(method, robot, q, problem.xdot, alpha=0.0)
        other = original(robot, q, problem.xdot, alpha=0.0)
        agree.append(np.abs(x - other).max(axis=1) / sum(bounds(method, problem, x, {})))
        load.append((np.abs(x) / robot.rate_limits).max(axis=1))
        achieved = (problem.J @ x[:, :, None])[:, :, 0]
        s = (achieved @ one.xdot) / SPEED**2
        sigma = singular_values(problem.J)[1]
        rounding = FORWARD * robot.n * UNIT * sigma[:, 0] * norms(x)
        straight.append(norms(achieved - s[:, None] * one.xdot) / rounding)
        near = t <= CLOSE
        exponents.append(slope(sigma[near, -1], s[near]))
        speeds.append(s[-1])
        full = t[s >= 1 - CLOSE]
        begins = float(sigma[t == full.min(), -1][0]) if len(full) else None
        rows.append((name, exponents[-1], begins, float(s[-1]), float(load[-1].max())))
        if name.endswith(("stretch", " 1")):
            factors.append(Series(name, sigma[:, -1], s, "line"))
    numbers, table_rows = _scaled_by_hand(scaled, original)
    drawn = _scaled_draws(trial, scaled, original, rng)
    arrival, times = _time_to_stretch(scaled)
    checks = (
        at_most("time scaling in the framework and its original by bisection: difference / sum of "
                "bounds", np.concatenate(agree), 1.0),
        at_most("the same with a self-motion that takes its part of the limits, at generic configurations", drawn, 1.0),
        at_most("largest |rate| / limit, all the way to the singularity", np.concatenate(load), 1 + FORWARD * UNIT),
        at_most(r"the hand keeps its path: part of $J\dot q$ across $\dot x$ / rounding", np.concatenate(straight), 1.0),
        at_most(r"its speed goes to zero as $\sigma_{\min}$: |exponent − 1|", np.abs(np.array(exponents) - 1), EXPONENT),
        at_most(f"speed factor {t[-1]:g} rad from the singularity", speeds, CLOSE),
        *numbers, *arrival,
    )  # fmt: skip
    plots = (
        Plot("Speed factor s of time scaling on straight lines into singularities, hand speed 0.25 (m/s, rad/s)",
             Axis("smallest singular value of J", log=True), Axis("s, share of the speed asked for", log=True), tuple(factors)),
        times,
    )  # fmt: skip
    columns = ("way", "exponent of s", "σ_min where scaling begins", "s at the end", "largest rate / limit")
    table = Table("Time scaling into singularities; below, two examples worked by hand (planar 3R bent, limits 1 rad/s)",
                  (*columns, "by hand"), tuple((*row, None) for row in rows) + table_rows)  # fmt: skip
    return Evidence(checks, (*plots, table))


def _scaled_draws(trial: Trial, scaled: Answer, original: Answer, rng: np.random.Generator) -> Array:
    """Difference over bounds in the situations that the method draws for itself."""
    method, ratios = METHODS["time_scaling"], []
    for name in ARMS if trial.full else ARMS[:1]:
        robot = robots.load(name)
        drawn = method.draw(robot, rng, trial.of(60, 12))
        x = scaled(method, robot, drawn.q, drawn.xdot, **drawn.parameters)
        other = original(robot, drawn.q, drawn.xdot, **drawn.parameters)
        problem = method.cast(robot, drawn.q, drawn.xdot, **drawn.parameters)
        ratios.append(np.abs(x - other).max(axis=1) / sum(bounds(method, problem, x, drawn.parameters)))
    return np.concatenate(ratios)


SCALED_BY_HAND = (
    ("no self-motion", 0.0, 0.6, (0.2, -0.8, 1.0)),
    ("self-motion 0.3 (−1, 1, 1)", 0.3, 0.42, (-0.16, -0.26, 1.0)),
)
"""Name, self-motion, s and rates of methods C3: xdot = (1, 1), limits 1 rad/s."""


def _scaled_by_hand(scaled: Answer, original: Answer) -> tuple[list[Check], tuple[tuple[str | float | int | None, ...], ...]]:
    robot = robots.load("planar_3r")
    q, xdot, null = np.array([BENT]), np.ones((1, 2)), np.array([-1.0, 1.0, 1.0])
    J = robot.jacobian(q)[0]
    off, rows = [], []
    for name, own, s, hand in SCALED_BY_HAND:
        parameters = {"alpha": 0.5, "posture": q[0] + 2 * own * null, "rate_limits": np.ones(3)}  # -alpha (q - posture)
        found = [scaled(METHODS["time_scaling"], robot, q, xdot, **parameters)[0], original(robot, q, xdot, **parameters)[0]]
        off.append(np.abs(np.stack(found) - hand).max())
        factor = float((J @ found[0]).mean())
        off.append(abs(factor - s))
        rows.append((f"by hand: {name}", None, None, factor, float(np.abs(found[0]).max()), s))
    check = at_most("worked by hand: s = 0.6 and 0.42, and the rates, both paths", off, ORIGINAL * 3 * UNIT, role=Role.OURS)
    return [check], tuple(rows)


def _time_to_stretch(scaled: Answer) -> tuple[list[Check], Plot]:
    """How long the hand takes to the full stretch: its speed falls as the root of the distance, so it arrives.

    With the hand 2 (1 - cos t) from the stretch, dT = 2 sin t / (SPEED s) dt, and s falls as sin t.
    """
    one = stretching(TURN)
    t = np.linspace(0.15, 0.0, 400, endpoint=False)
    q = one.q(t)
    x = scaled(METHODS["time_scaling"], one.robot, q, np.broadcast_to(one.xdot, (len(t), 2)), alpha=0.0)
    s = ((one.robot.jacobian(q) @ x[:, :, None])[:, :, 0] @ one.xdot) / SPEED**2
    integrand = 2 * np.sin(t) / (SPEED * s)
    elapsed = np.concatenate([[0.0], np.cumsum((integrand[1:] + integrand[:-1]) / 2 * -np.diff(t))])
    left = 2 * (1 - np.cos(t))
    asked = (left[0] - left) / SPEED
    # in the last stretch of t the rates are at their limits, and t runs down at a constant rate
    last = np.array([a - b for b, a in pairwise(elapsed[-20:])])
    check = at_most("the hand comes to the full stretch in finite time, its joints at their limits: spread of the joint speed "
                    "there",
                    last.max() / last.min() - 1, CLOSE, role=Role.OURS)  # fmt: skip
    plot = Plot(
        f"The hand on the last {1000 * left[0]:.0f} mm to the full stretch: {elapsed[-1]:.3f} s instead of {asked[-1]:.3f} s",
        Axis("time [s]"), Axis("distance of the hand from the full stretch [mm]"),
        (Series("time scaling, rates within 2 "
                "rad/s", elapsed, 1000 * left, "line"), Series("asked for, 0.25 m/s", asked, 1000 * left, "line", "bound")),
    )  # fmt: skip
    return [check], plot


def clipped(scaled: Answer) -> Answer:
    """Every joint clipped at its own limit, in the place of one factor for all."""

    def planted(method: object, robot: Robot, q: Array, xdot: Array, **parameters: object) -> Array:
        x = equation_six(robot, q, xdot)
        limits = parameters.get("rate_limits", robot.rate_limits)
        return np.clip(x, -np.asarray(limits), np.asarray(limits))

    return planted


def equation_six(robot: Robot, q: Array, xdot: Array) -> Array:
    """Eq. (6) with W = I, alpha = 0."""
    return np.asarray(eq6(VelocityProblem(J=robot.jacobian(q), xdot=xdot, W=np.eye(robot.n))).x)


SIX = CodePath("eq. (6) of the sandbox, column-pivoted LU", eq6)

CLAIMS = (
    Claim(
        name="not_realizable_near_singularity",
        title="Near a singularity the rates of (6) and of (2)–(5) are not realizable",
        place="Section VI, last paragraph",
        says="(6) will typically not give physically realizable joint rates near a kinematic singularity, nor will (2)–(5).",
        formula=r"|\dot q| \ge \frac{|u_m^T \dot x|}{\sigma_m} \quad \text{for every } \dot q \text{ with } J \dot q = \dot x",
        tested="Straight lines into singular configurations of the planar 3R, the 7R and the Panda, to a billionth of a "
        "radian, hand speed 0.25 (m/s, rad/s), $W = I$; random task directions against the arms' rate limits.",
        accepted=r"Rates grow as $1/\sigma_{\min}$ by all three; near the singularity more than half of the task directions "
        "exceed a rate limit.",
        paths=(SIX, CodePath("eq. (6) as printed, in numpy", equations.augmented)),
        examine=not_realizable_near_singularity,
        fault=Fault("small singular values dropped on the quiet", truncated),
    ),
    Claim(
        name="eq13_does_not_solve_it",
        title="(13) does not solve the problem of singularities",
        place="Section VI, last paragraph",
        says="(13), which gives rates at a singularity, does not solve the problem of kinematic singularities.",
        tested="The planar 3R through its full stretch: (13) against its rank tolerance beside the singularity, and before, "
        "at and after it with four tolerances.",
        accepted="Off the singularity (13) is (6); at it the rates jump, the more the nearer; a rank tolerance moves the "
        "jump and does not keep the rates within the limits.",
        paths=(
            CodePath("eq. (13) of the sandbox with a declared rank tolerance", eq13),
            CodePath("eq. (13) as printed, in numpy, at a given rank", equations.rank_deficient),
        ),
        examine=eq13_does_not_solve_it,
        fault=Fault("the declared rank tolerance not handed on", undeclared),
    ),
    Claim(
        name="must_give_up_exactness",
        title="Near a singularity the desired task velocity must be given up",
        place="Section VI, last sentence",
        says=r"To go near a singularity a method must be used that does not give the desired $\dot x$, such as time scaling or "
        "damped least squares.",
        formula=r"\min_{J \dot q = \dot x} \max_i \frac{|\dot q_i|}{\dot q_{\max,i}} \ge \frac{|u_m^T \dot x|}{\sigma_m "
        r"\sum_i |v_{m,i}| \, \dot q_{\max,i}}",
        tested="The planar 3R straight out to its full stretch and back, and lines through singularities of the Panda and "
        "the 7R: the least load of all exact rates, by linear programming, beside (6), (13), damped least squares and time "
        "scaling.",
        accepted="Near the singularity no exact rates are within the limits; those of damped least squares and time scaling "
        "are, and miss the task.",
        paths=(SIX, CodePath("the least load of all exact rates, by linear programming (HiGHS)", linprog)),
        examine=must_give_up_exactness,
        fault=Fault("the Jacobian's transpose taken for its inverse", transposed),
    ),
    Claim(
        name="time_scaling_at_singularities",
        title="Time scaling keeps the path and gives up the speed",
        place="Section VI, last sentence",
        says=r"Time scaling is a method that does not give the desired $\dot x$ near a singularity.",
        formula=r"\dot q = s J^+ \dot x, \quad s = \min\left(1, \min_i \frac{\dot q_{\max,i}}{|(J^+ \dot x)_i|}\right)",
        tested="Straight lines into singularities of three arms; situations with a self-motion; two examples worked by hand; "
        "the time that the hand takes to the full stretch.",
        accepted=r"Rates stay within the limits, the hand on its path, and its speed falls to zero as $\sigma_{\min}$.",
        paths=(
            CodePath("time scaling on the rates of the framework", rates),
            CodePath("its original: pseudoinverse, and the factor by bisection", scaled_original.original),
        ),
        examine=time_scaling_at_singularities,
        fault=Fault("every joint clipped at its own limit", clipped),
    ),
    Claim(
        name="damped_least_squares_at_singularities",
        title="Damped least squares keeps the rates and gives up the task",
        place="Section VI, last sentence; Section I",
        says=r"Damped least squares is a method that does not give the exact prescribed $\dot x$.",
        formula=r"\dot q = J^T (J J^T + \lambda^2 I)^{-1} \dot x, \quad |\dot q| \le \frac{|\dot x|}{2 \lambda}",
        tested="The planar 3R, the Panda and the 7R through singularities with three dampings; situations with general $W$, "
        r"$W_{\dot x}$ and gradient; numbers worked by hand. The sandbox computes it by (6) on the arm with slack joints, "
        r"$[J\ I]$.",
        accepted=r"Both paths agree within their bounds, $|\dot q| \le |\dot x|/(2\lambda)$, the rates are continuous through "
        "the singularity, and the task error is what the smallest singular value predicts.",
        paths=(
            CodePath("(6) on the arm with slack joints $s = \\dot x - J \\dot q$", damped_least_squares),
            CodePath("its formula by singular values", damped_original.original),
        ),
        examine=damped_least_squares_at_singularities,
        fault=Fault(r"$\lambda$ in the place of $\lambda^2$", unsquared),
    ),
)
