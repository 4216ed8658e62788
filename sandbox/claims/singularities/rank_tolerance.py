"""Eq. (13) beside, at and across a singularity, whatever its rank tolerance."""

from __future__ import annotations

import numpy as np

from sandbox.claims import equations
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_least, at_most, every
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.power import fitted
from sandbox.claims.singularities.approach import CLOSE, SPEED, TURN, Approach, norms, stretching
from sandbox.closed_form import CLOSED_FORMS
from sandbox.closed_form.eq6 import eq6
from sandbox.closed_form.eq13 import eq13
from sandbox.problem import VelocityProblem
from sandbox.solution import Solution, Status
from sandbox.task import task_weight
from sandbox.tolerances import EXPONENT, ORIGINAL, RANK_GAP, UNIT

Array = np.ndarray

TOLERANCES = (1e-5, 1e-4, 1e-3)
"""Declared rank tolerances; more than 1e-3 leaves no gap of 1000 to what is kept."""


def power_of_ten(value: float) -> str:
    """10^k, in TeX, for a whole k."""
    return f"$10^{{{round(np.log10(value))}}}$"


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
        series += [Series(f"{power_of_ten(t)} rad from the stretch", tolerances, size),
                   Series(rf"$\sigma_2/\sigma_1$ at {power_of_ten(t)} rad", [share], [1.0], "vertical", "bound")]  # fmt: skip
        full, less = solved & (tolerances < share), solved & (tolerances > share)
        ranks = np.where(tolerances < share, 2, 1)
        expected = at_rank(printed, VelocityProblem(J=np.repeat(problem.J, len(ranks), 0), xdot=one.xdot, W=np.eye(3)), ranks)
        x = np.concatenate([solution.x for solution in found])
        off = np.abs(x - expected).max(axis=1) / np.abs(expected).max(axis=1)
        ratios.append(off / (ORIGINAL * 3 * UNIT / share))
        located.append(bool(full.any() and less.any()))
        steps.append((1 / share, size[full].min() / size[less].max()))
    checks.append(at_most("(13) of the sandbox and as printed, at the rank that the tolerance declares: difference / bound",
                          np.concatenate(ratios), 1.0))  # fmt: skip
    checks.append(
        every(r"beside a singularity (13) has one answer for tolerances below $\sigma_2/\sigma_1$ and one above", located)
    )
    power = fitted(*np.transpose(steps))
    checks.append(at_most(r"their ratio grows as $\sigma_1/\sigma_2$: size of exponent − 1", abs(power - 1), EXPONENT))
    distance = np.geomspace(1e-1, 1e-9, trial.of(33, 9))
    at_zero = thirteen(one.problem(np.zeros(1))).x[0]
    for side in (-1.0, 1.0):
        x = thirteen(one.problem(side * distance)).x
        six = eq6(one.problem(side * distance)).x
        bound = 2 * CLOSED_FORMS["eq13"].bound(one.problem(side * distance))
        ratios.append(np.abs(x - six).max(axis=1) / np.abs(six).max(axis=1) / bound)
        jumps.append(fitted(distance[distance < CLOSE], norms(x - at_zero)[distance < CLOSE]))
    checks += [
        at_most("off the singularity (13) gives the rates of (6): difference / sum of bounds",
                np.concatenate(ratios[-2:]), 1.0),
        at_most("rates beside the singularity less those at it grow as one over the distance: size of exponent + 1",
                np.abs(np.array(jumps) + 1), EXPONENT),
        *_tolerances_along(one, thirteen),
        *_ambiguous(one, thirteen),
    ]  # fmt: skip
    across, table = _across(one, thirteen, at_zero)
    step = Plot(
        "(13) close to a singularity against its rank tolerance: the small singular value is inverted, or it is dropped",
        Axis("rank tolerance / largest singular value, rows of $J$ scaled to one", log=True),
        Axis(r"$|\dot q|$ [rad/s]", log=True), tuple(series),
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
    declared = ", ".join(map(power_of_ten, TOLERANCES))
    return [
        at_least(f"with rank tolerances {declared}: largest rate / limit on the way through", largest, 1.0),
        at_least("and where the small singular value is dropped: task error / part of the task in the lost direction",
                 errors, 1 - CLOSE),
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
    series += [
        Series(f"tolerance {power_of_ten(tau)}", t, norms(thirteen(problem, rank_tolerance=tau).x), "line")
        for tau in TOLERANCES
    ]
    series.append(Series("rate limit", [t[0], t[-1]], [one.robot.rate_limits.min()] * 2, "line", "bound"))
    plot = Plot(
        "(13) across the singularity: the planar 3R through its full stretch, hand speed 0.25 m/s; gaps are refusals",
        Axis("$t$, from the full stretch [rad]"), Axis(r"$|\dot q|$ [rad/s]", log=True), tuple(series),
    )  # fmt: skip
    rows: list[tuple[str | float | int | None, ...]] = []
    for when in (-1e-2, -1e-4, -1e-8, 0.0, 1e-8, 1e-4, 1e-2):
        for tolerance in (None, 1e-3):
            options = {} if tolerance is None else {"rank_tolerance": tolerance}
            solution = thirteen(one.problem(np.array([when])), **options)
            x = solution.x[0]
            miss = one.robot.jacobian(one.q(np.array([when])))[0] @ x - one.xdot
            label = "default" if tolerance is None else power_of_ten(tolerance)
            rows.append((when, label, *(float(v) for v in x), float(np.linalg.norm(miss))))
    columns = ("$t$ [rad]", "rank tolerance", "joint 1 [rad/s]", "joint 2 [rad/s]", "joint 3 [rad/s]", "task error [m/s]")
    return plot, Table("(13) just before, at and after the singularity", columns, tuple(rows))


def undeclared(thirteen: Answer) -> Answer:
    """Eq. (13) to which the declared rank tolerance is not handed on."""

    def planted(problem: VelocityProblem, *, rank_tolerance: float | None = None) -> Solution:
        return thirteen(problem)

    return planted


CLAIM = Claim(
    name="eq13_does_not_solve_it",
    title="(13) does not solve the problem of singularities",
    place="Section VI, last paragraph",
    says="(13) does not solve the problem of kinematic singularities.",
    tested="The planar 3R through its full stretch: (13) against its rank tolerance beside the singularity, and before, "
    "at and after it with four tolerances.",
    accepted="Off the singularity (13) is (6), whose rates grow without bound, and at it they jump. A rank tolerance moves the "
    "jump, and does not keep the rates within the limits; where it drops the small singular value the task is missed.",
    paths=(
        CodePath("eq. (13) of the sandbox with a declared rank tolerance", eq13),
        CodePath("eq. (13) as printed, in numpy, at a given rank", equations.rank_deficient),
    ),
    examine=eq13_does_not_solve_it,
    fault=Fault("the declared rank tolerance not handed on", undeclared),
)
