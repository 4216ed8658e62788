"""Section III: eq. (6) without forming W or grad f, and what that saves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

import casadi as ca
import numpy as np

from problems import robots
from problems.implicit.augmented import augmented_along
from problems.implicit.directional import plain_along, symbolic_along
from problems.implicit.inertia import inertia_along
from problems.methods import METHODS
from problems.methods.draw import generic
from problems.original import inertia_weighted
from problems.original.gradient_projection import projected
from problems.robots.example_robots import MissingExtraError
from problems.robots.robot import Robot
from problems.robots.twin import Symbol, Twin, twin
from sandbox.agreement import bounds
from sandbox.claims import equations
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_least, at_most, every
from sandbox.claims.exhibit import Axis, Heat, Plot, Series, Table
from sandbox.closed_form import null_basis
from sandbox.closed_form.eq6_implicit import eq6_implicit, implicit_bound
from sandbox.closed_form.uncompiled import Operations, operations
from sandbox.errors import AsymmetricWeightError
from sandbox.implicit_study import COUNTS, LONGEST_GRADIENT, ROWS
from sandbox.problem import VelocityProblem
from sandbox.stacked import times, transpose
from sandbox.tolerances import ORIGINAL, UNIT

Array = np.ndarray

F1 = np.array([[0.0, np.pi / 2, -np.pi / 2]])
F1B = np.array([[0.0, np.pi / 2, 0.0]])


def told(values: Any, digits: int = 6) -> str:
    """A row of numbers as text."""
    rounded = np.round(np.asarray(values, dtype=float), 12) + 0.0
    return "(" + ", ".join(f"{value:.{digits}g}".replace("-", "−") for value in rounded) + ")"


def norms(A: Array) -> Array:
    """Frobenius norm of every matrix."""
    return np.linalg.norm(A, axis=(-1, -2))


def within(problem: VelocityProblem, x: Array, N: Array, method: str) -> Array:
    """What eq6_implicit and the other side, of the accuracy of `method`'s original, may differ by (B,) [rad/s, m/s]."""
    framework, original = bounds(METHODS[method], problem, x, {})
    own = implicit_bound(problem.J, N, problem.W.left(N), size=norms(problem.W.dense()))
    allowed: Array = own * np.abs(x).max(axis=-1) + framework + original
    return allowed


# the augmented Jacobian without W

ONE_DEGREE = ("planar_3r", "seven_joint", "panda")


def half_projected(along: Answer) -> Answer:
    """N'W = (N' grad g) grad g' as it should be, but gbar as it is on the right, without N' grad g before it."""

    def planted(E: Array, N: Array, gbar: Array, gamma: Any = None) -> tuple[Array, Array]:
        NtW, _ = along(E, N, gbar, gamma)
        return NtW, -gbar

    return planted


def weight_not_needed_augmented(trial: Trial, along: Answer, printed: Answer) -> Evidence:
    """(N' grad g) grad g' in (6) against the explicit W of (8), k = 1; and both near an algorithmic singularity."""
    rng = trial.rng("weight_not_needed_augmented")
    rows, agreed, series = [], [], []
    for name in ONE_DEGREE:
        robot, count = robots.load(name), trial.of(200, 12)
        q, xdot, _ = generic(robot, rng, count)
        e, gbar = rng.standard_normal((count, 1, robot.n)), rng.uniform(-1, 1, (count, 1))
        J, W = robot.jacobian(q), transpose(e) @ e
        N = null_basis.pivoted(J)
        NtW, Nta = along(e, N, gbar)
        x = eq6_implicit(J, xdot, N, NtW, Nta, size=norms(W)).x
        other = np.array([printed(J[i], xdot[i], W[i], gbar[i] * e[i, 0], -1.0) for i in range(count)])
        problem = VelocityProblem(J=J, xdot=xdot, W=W, a=-gbar * e[:, 0])
        ratio = np.abs(x - other).max(axis=-1) / within(problem, other, N, "augmented_jacobian")
        agreed.append(at_most(f"joint rates without and with $W$, {name}: difference / bound", ratio, 1.0))
        gap = norms(NtW - transpose(N) @ W) / (norms(N) * norms(W))
        rows.append(gap / (ORIGINAL * robot.n * UNIT))
        series.append(Series(name, np.linalg.cond(np.concatenate([J, e], axis=1)), np.abs(x - other).max(axis=-1)
                             / np.abs(other).max(axis=-1)))  # fmt: skip
    distances, errors = near_singular(trial, along, printed, rng)
    bound = ORIGINAL * 3 * UNIT * np.array([np.linalg.cond(system(d)) for d in distances])
    # explicit W is exactly singular, or has lost every digit, where 1/d^2 meets 1/u
    far = distances <= FAR
    singular = ~np.isfinite(errors["explicit"])
    table = Table(
        r"F1, $g = (1 + d) q_1 + q_2$: largest relative error of the joint rates, against exact rationals",
        ("$d$", "$W$ formed, methods 4.4", "$W$ formed, ours", r"$(N_J^T \nabla g)(\nabla g)^T$, methods 4.4",
         r"$(N_J^T \nabla g)(\nabla g)^T$, ours"),
        tuple(
            (f"{d:g}", formed, nearest(distances, errors["explicit"], d), factored, nearest(distances, errors["factored"], d))
            for d, formed, factored in ((1e-4, "6e-9", "3e-13"), (1e-6, "9e-5", "2e-11"), (1e-8, "singular", "4e-9"))
        ),
        paper=("$W$ formed, methods 4.4", r"$(N_J^T \nabla g)(\nabla g)^T$, methods 4.4"),
    )  # fmt: skip
    checks = (
        *agreed,
        at_most(r"rows $(N_J^T \nabla g)(\nabla g)^T$ against $N_J^T W$: difference / rounding", np.concatenate(rows), 1.0),
        at_most("without $W$, near an algorithmic singularity: error / (50 n u cond [J; E])", errors["factored"] / bound, 1.0,
                role=Role.OURS),
        every(rf"and with $W$ formed, $d \le {FAR:g}$: more than that, or singular",
              singular[far] | (errors["explicit"][far] > bound[far]), role=Role.OURS),
    )  # fmt: skip
    guide = np.array([distances.min(), distances.max()])
    plots = (
        Plot("F1, g = (1 + d) q₁ + q₂: forming W loses the square of the conditioning; [J; E] is singular at d = 0",
             Axis("d, distance from the algorithmic singularity", log=True),
             Axis("relative error of the joint rates", log=True),
             (Series("(N'∇g)(∇g)ᵀ", distances, errors["factored"]),
              Series("W formed first", distances, errors["explicit"], role="other"),
              Series("50 n u cond [J; E]", distances, bound, "line", "bound"),
              Series("u / d²", guide, UNIT / guide**2, "line", "bound"),
              Series("methods 4.4, W formed", [1e-4, 1e-6], [6e-9, 9e-5], role="paper"),
              Series("methods 4.4, not formed", [1e-4, 1e-6, 1e-8], [3e-13, 2e-11, 4e-9], role="paper"))),
        Plot("Generic configurations: relative difference between (6) without and with an explicit W, one point a situation",
             Axis("cond [J; E]", log=True), Axis("relative difference of the joint rates", log=True), tuple(series)),
    )  # fmt: skip
    return Evidence(checks, (*plots, table))


FAR = 1e-4
"""So near an algorithmic singularity the explicit W's error, u/d^2, stands clear of the bound of the other side, 50 n u/d."""


def system(d: float) -> Array:
    """The matrix [J; E] at F1 with g = (1 + d) q_1 + q_2; in floats exactly."""
    return np.array([[-1.0, -1, 0], [2, 1, 1], [1 + d, 1, 0]])


def near_singular(trial: Trial, along: Answer, printed: Answer, rng: np.random.Generator) -> tuple[Array, dict[str, Array]]:
    """Distances d (D,), and the largest relative errors (D,) over some xdot and gbar; inf where W formed is singular."""
    distances = 10.0 ** -np.arange(0, 8.1, 0.25 if trial.full else 1.0)
    asked = np.round(rng.uniform(-1, 1, (trial.of(20, 6), 3)), 3)
    errors: dict[str, list[float]] = {"explicit": [], "factored": []}
    for d in distances:
        A = system(d)
        J, e = A[:2], A[2:]
        worst = {"explicit": 0.0, "factored": 0.0}
        for x, y, b in asked:
            first = (Fraction(b) + Fraction(x)) / (Fraction(e[0, 0]) - 1)  # q1 + q2 = -x
            exact = np.array([float(v) for v in (first, -Fraction(x) - first, Fraction(y) + Fraction(x) - first)])
            N = null_basis.pivoted(J)
            NtW, Nta = along(e, N, np.array([b]))
            found = {"factored": eq6_implicit(J, [x, y], N, NtW, Nta).x}
            try:
                found["explicit"] = printed(J, np.array([x, y]), e.T @ e, b * e[0], -1.0)
            except np.linalg.LinAlgError:
                found["explicit"] = np.full(3, np.inf)
            for which, rates in found.items():
                worst[which] = max(worst[which], float(np.abs(rates - exact).max() / np.abs(exact).max()))
        for which in errors:
            errors[which].append(worst[which])
    return distances, {which: np.array(values) for which, values in errors.items()}


def nearest(distances: Array, errors: Array, d: float) -> float | str:
    """The error at the distance nearest to d, as text where there is none."""
    found = float(errors[int(np.argmin(np.abs(np.log(distances / d))))])
    return found if np.isfinite(found) else "singular"


# the inertia matrix by inverse dynamics


def gravity_left_in(along: Answer) -> Answer:
    """The torques of N's columns with gravity among them."""

    def planted(robot: Any, q: Array, N: Array) -> Array:
        return np.stack([robot.inverse_dynamics(q, np.zeros_like(q), N[..., c]) for c in range(N.shape[-1])], axis=-2)

    return planted


def arms(trial: Trial) -> list[tuple[str, Robot | None]]:
    """Every robot of the table, and longer planar arms; None for one whose files are not installed."""
    longer = [f"planar_{n}r" for n in ((7, 10, 16, 30) if trial.full else (7,))]
    names = [*robots.ROBOTS, *longer] if trial.full else ["planar_3r", "planar_4r", "seven_joint", "panda", *longer]
    found: list[tuple[str, Robot | None]] = []
    for name in names:
        try:
            found.append((name, robots.load(name)))
        except MissingExtraError:
            found.append((name, None))
    return found


def solved(J: Array, xdot: Array, N: Array, NtW: Array, size: Array) -> Array:
    """Joint rates (B, n) of (6) from N'W alone, a = 0; NaN where N'WN is not symmetric, so that W is no weight."""
    try:
        return np.asarray(eq6_implicit(J, xdot, N, NtW, np.zeros(NtW.shape[:-1]), size=size).x)
    except AsymmetricWeightError:
        return np.full((len(J), J.shape[-1]), np.nan)


def inertia_by_inverse_dynamics(trial: Trial, along: Answer, explicit: Answer) -> Evidence:
    """Rows of N'M by inverse dynamics and M by composite bodies; rates of (6) and of Khatib's formula, on every robot."""
    rng = trial.rng("inertia_by_inverse_dynamics")
    matrix, rates, apart, sizes, shown = [], [], [], [], []
    rows: list[tuple[str | float | int | None, ...]] = []
    for name, robot in arms(trial):
        if robot is None:
            rows.append((name, None, None, "not installed", None))
            continue
        q, xdot, _ = generic(robot, rng, trial.of(100, 6))
        J, M = robot.jacobian(q), robot.inertia(q)
        N = null_basis.pivoted(J)
        NtW = along(robot, q, N)
        gap = norms(NtW - transpose(N) @ M) / (norms(N) * norms(M))
        x = solved(J, xdot, N, NtW, norms(M))
        other = explicit(robot, q, xdot)
        problem = VelocityProblem(J=J, xdot=xdot, W=M)
        ratio = np.abs(x - other).max(axis=-1) / within(problem, other, N, "inertia_weighted")
        matrix.append(gap / (ORIGINAL * robot.n * UNIT))
        rates.append(ratio)
        if robot.n <= LONGEST_GRADIENT:  # the twin sums J'MJ over bodies: n^3 operations
            symbols = twin(robot)
            (summed,) = symbols.evaluator(symbols.inertia)(q)
            apart.append(norms(NtW - transpose(N) @ summed) / (norms(N) * norms(M)) / (ORIGINAL * robot.n * UNIT))
        sizes.append(robot.n)
        shown.append(gap)
        rows.append((name, robot.m, robot.n, float(gap.max()), float(ratio.max())))
    robot = robots.load("planar_3r")
    J, xdot = robot.jacobian(F1), np.array([[0.3, -0.7]])
    N = null_basis.pivoted(J) * np.sign(null_basis.pivoted(J)[:, 2:])
    NtW = along(robot, F1, N)
    x = solved(J, xdot, N, NtW, norms(robot.inertia(F1)))
    expected, row = np.array([0.0, -0.3, -0.4]), np.array([-2.0, 0.0, 0.0])
    exact = within(VelocityProblem(J=J, xdot=xdot, W=robot.inertia(F1)), expected[None], N, "inertia_weighted")[0]
    printed_matrix = np.array([[8.0, 4, 2], [4, 3, 1], [2, 1, 1]])
    checks = (
        at_most("rows $N_J^T M$ by inverse dynamics against $N_J^T$ times $M$ by composite bodies: difference / rounding",
                np.concatenate(matrix), 1.0),
        at_most(r"joint rates against $M^{-1} J^T (J M^{-1} J^T)^{-1} \dot x$: difference / bound", np.concatenate(rates), 1.0),
        at_most(r"and against $M = \sum J_b^T M_b J_b$ over the bodies, by CasADi: difference / rounding",
                np.concatenate(apart), 1.0, role=Role.OURS),
        at_most("F1, unit masses at the link ends: rates of methods M16, difference / bound",
                [np.abs(x[0] - expected).max() / exact], 1.0, role=Role.OURS),
    )  # fmt: skip
    spread = np.concatenate([np.full(len(gap), n) for n, gap in zip(sizes, shown, strict=True)])
    steps = np.unique(sizes)
    plot = Plot(
        "N'M by inverse dynamics against explicit M: difference over |N||M|, one point a configuration",
        Axis("number of joints n"), Axis("relative difference of N'M", log=True),
        (Series("difference", spread, np.maximum(np.concatenate(shown), UNIT / 4)),
         Series("50 n u", steps, ORIGINAL * steps * UNIT, "line", "bound")),
    )  # fmt: skip
    table = Table(
        "Largest differences by robot",
        ("robot", "$m$", "$n$", "of $N_J^T M$, relative", "of the joint rates, over the bound"),
        tuple(rows),
    )
    case = Table(
        r"F1, unit masses at the link ends, $N_J = (-1, 1, 1)^T$, $\dot x = (0.3, -0.7)$",
        ("quantity", "methods M16", "ours"),
        (("$M$", "; ".join(told(row) for row in printed_matrix), "; ".join(told(row) for row in robot.inertia(F1)[0])),
         ("$N_J^T M$", told(row), told(NtW[0, 0])), (r"$\dot q$ [rad/s]", told(expected), told(x[0]))),
        paper=("methods M16",),
    )  # fmt: skip
    return Evidence(checks, (plot, table, case))


# grad f by directional derivatives


def unit_directions(along: Answer) -> Answer:
    """Derivatives along directions of length one, where the columns of N have other lengths."""

    def planted(robot: Any, expression: Any) -> Callable[[Array, Array], Array]:
        slopes = along(robot, expression)
        return lambda q, N: slopes(q, N / np.linalg.norm(N, axis=-2, keepdims=True))

    return planted


def squared_torque(symbols: Twin) -> Symbol:
    """Half the squared gravity torque [(Nm)^2]."""
    return ca.sumsqr(symbols.gravity_torque) / 2


def volume(symbols: Twin) -> Symbol:
    """Manipulability w = sqrt(det JJ'): the product of the diagonal of the triangular factor of J'."""
    diagonal, product = ca.diag(ca.qr(symbols.jacobian.T)[1]), ca.SX(1)
    for i in range(diagonal.numel()):
        product = product * diagonal[i]
    return product


def distance(symbols: Twin) -> Symbol:
    """Half the squared distance from the posture 0.3 [rad^2]."""
    return ca.sumsqr(symbols.q - 0.3) / 2


def torque_gradient(robot: Any, q: Array) -> Array:
    """Gradient of the squared torque, by pinocchio's derivatives."""
    return times(transpose(robot.gravity_torque_derivative(q)), robot.gravity_torque(q))


def volume_gradient(robot: Any, q: Array) -> Array:
    """Derivatives dw/dq_k = w tr(dJ/dq_k J^+)."""
    J = robot.jacobian(q)
    w = np.prod(np.linalg.svd(J, compute_uv=False), axis=-1, keepdims=True)
    slopes: Array = w * np.einsum("...kmn,...nm->...k", robot.jacobian_derivative(q), np.linalg.pinv(J))
    return slopes


def distance_gradient(robot: Any, q: Array) -> Array:
    """The vector from the posture."""
    return q - 0.3


MEASURES = (
    ("squared gravity torque", squared_torque, torque_gradient, 1e-3),
    ("manipulability", volume, volume_gradient, -1.0),
    ("distance from a posture", distance, distance_gradient, 0.5),
)
"""Name, expression, explicit gradient, and alpha."""


def plain_volume(q: Array) -> Array:
    """Manipulability squared of the unit planar 3R arm, on real or complex numbers (methods M5)."""
    s3, s23, s2 = np.sin(q[..., 2]), np.sin(q[..., 1] + q[..., 2]), np.sin(q[..., 1])
    squared: Array = s3**2 + (s3 + s23) ** 2 + (s2 + s23) ** 2
    return squared


def directional_derivatives(trial: Trial, along: Answer, project: Answer) -> Evidence:
    """N' grad f by forward mode along N's columns in (6), against explicit gradients projected; by steps of any size."""
    rng = trial.rng("directional_derivatives")
    slopes, rates, series, levels = [], [], [], []
    for name in ("planar_3r", "planar_4r", "panda"):
        robot = robots.load(name)
        for what, expression, explicit, alpha in MEASURES:
            q, xdot, _ = generic(robot, rng, trial.of(60, 6))
            J, gradient = robot.jacobian(q), explicit(robot, q)
            N = null_basis.pivoted(J)
            found = along(robot, expression)(q, N)
            size = np.linalg.norm(gradient, axis=-1) * norms(N)
            gap = np.abs(found - times(transpose(N), gradient)).max(axis=-1) / size
            level = ORIGINAL * robot.n * UNIT * np.linalg.cond(J)
            slopes.append(gap / level)
            x = eq6_implicit(J, xdot, N, transpose(N), alpha * found, size=np.sqrt(robot.n)).x
            other = project(robot, q, xdot, -alpha * gradient)
            problem = VelocityProblem(J=J, xdot=xdot, W=np.eye(robot.n), a=alpha * gradient)
            rates.append(np.abs(x - other).max(axis=-1) / within(problem, other, N, "gradient_projection"))
            series.append(Series(f"{name}, {what}", np.linalg.cond(J), np.maximum(gap, UNIT / 16)))
            levels.append((np.linalg.cond(J), level))
    robot, still, rows, cases = robots.load("planar_3r"), np.zeros((1, 2)), [], []
    for what, expression, alpha, expected, decimals in (
        (r"$f = -w$, $\alpha = 1$ (M5)", volume, -1.0, (0.0, -0.178885438, 0.357770876), 9),
        (r"$f = \frac12 \tau_g^T \tau_g$, $\alpha = 10^{-3}$ (M6)", squared_torque, 1e-3, (0.0, 0.05774166, -0.11548332), 8),
    ):
        J = robot.jacobian(F1B)
        N = null_basis.pivoted(J)
        x = eq6_implicit(J, still, N, transpose(N), alpha * along(robot, expression)(F1B, N)).x[0]
        cases.append(np.abs(x - expected).max() / (0.5 * 10.0**-decimals))
        rows.append((what, told(expected, 9), told(x, 9)))
    steps = 10.0 ** -np.arange(1, 15.1, 0.5 if trial.full else 2.0)
    q = generic(robot, rng, trial.of(20, 4)).q
    N = null_basis.orthonormal(robot.jacobian(q))
    exact = along(robot, squared_volume)(q, N)[:, 0]
    scale = np.abs(exact).max()
    complex_ = np.abs(plain_along(plain_volume, q, N)[:, 0] - exact).max() / scale
    gaps = [
        np.abs((plain_volume(q + h * N[..., 0]) - plain_volume(q - h * N[..., 0])) / (2 * h) - exact).max() / scale
        for h in steps
    ]
    checks = (
        at_most(r"$N_J^T \nabla f$ by directional derivatives against the explicit gradient: difference / rounding",
                np.concatenate(slopes), 1.0),
        at_most("joint rates of (6) from it against the explicit gradient projected: difference / bound",
                np.concatenate(rates), 1.0),
        at_most("F1b: rates of methods M5 and M6, difference / half a unit of the last digit", cases, 1.0, role=Role.OURS),
        at_most("a function known by its values alone, by complex steps along $N_J$: difference / rounding",
                [complex_ / (ORIGINAL * 3 * UNIT)], 1.0, role=Role.OURS),
        at_least("and by real steps, however long: difference / rounding", np.array(gaps) / (ORIGINAL * 3 * UNIT), 1.0,
                 role=Role.OURS),
    )  # fmt: skip
    condition, level = (np.concatenate(part) for part in zip(*levels, strict=True))
    order = np.argsort(condition)
    thin = order[:: max(1, len(order) // 100)]
    plots = (
        Plot("Directional derivatives along N's columns against N' times the explicit gradient, over |N||∇f|",
             Axis("cond J", log=True), Axis("relative difference of N'∇f", log=True),
             (*series, Series("50 n u cond J", condition[thin], level[thin], role="bound"))),
        Plot("Planar 3R, f = det JJ' known by its values alone: slopes along N by steps of f, against CasADi's forward mode",
             Axis("step [rad]", log=True), Axis("relative error of N'∇f", log=True),
             (Series("central differences", steps, gaps, "line", "other"),
              Series("complex step, 2⁻¹⁰⁰", [steps[0], steps[-1]], [max(complex_, UNIT / 16)] * 2, "line"),
              Series("50 n u", [steps[0], steps[-1]], [ORIGINAL * 3 * UNIT] * 2, "line", "bound"))),
    )  # fmt: skip
    table = Table(
        r"Planar 3R at F1b, $q = (0, \pi/2, 0)$, $\dot x = 0$: joint rates without $\nabla f$",
        (r"measure", "methods [rad/s]", "ours [rad/s]"), tuple(rows), paper=("methods [rad/s]",),
    )  # fmt: skip
    return Evidence(checks, (*plots, table))


def squared_volume(symbols: Twin) -> Symbol:
    """The determinant of JJ'."""
    return ca.det(symbols.jacobian @ symbols.jacobian.T)


# what it saves

SIZES = (5, 6, 7, 8, 10, 12, 16, 20, 25, 30)
"""Numbers of joints from which on the counts below are polynomials in n."""

RECURSION = {"planar": ((15, -18), (12, -18)), "spatial": ((49, -75), (42, -73))}
"""Multiplications and additions of one recursion of Newton and Euler on n links at rest: coefficients in n."""

SMALLEST = (2, 3, 4, 5)
"""Numbers of joints among which one column of N begins to save."""

MATRIX = {"planar": ((2.5, -3.5, -3), (1.5, 3.5, -11)), "spatial": ((5.5, 2.5, -6), (4, 19, -38))}
"""Of the inertia matrix by composite bodies."""

GRADIENT = {"planar": ((76, -114), (77, -114), (53, -80)), "spatial": ((79, -235), (80, -236), (53, -163))}
"""All operations of grad f in reverse mode, of the first column of N in forward mode, and of each further one."""

VALUE = {"planar": (25, -34), "spatial": (28, -74)}
"""All operations of f, half the squared gravity torque."""

Poly = Callable[[Any, Any], Any]


def formulas(poly: Poly, form: str, family: str, n: int, k: int) -> tuple[float, float]:
    """All operations (explicit, implicit) of a form on n joints for k columns of N, from polynomials in n."""
    family = "spatial" if family == "spatial" else "planar"
    product = poly((2, -1, 0), n)  # N'W, one column
    slope = poly((2, -1), n)  # N'a, one column
    if form == "inertia":
        matrix, recursion = (sum(poly(part, n) for part in table[family]) for table in (MATRIX, RECURSION))
        return matrix + k * product, k * recursion
    if form == "augmented":
        return k * poly((3, 1, 0), n) - poly((0.5, 0.5, 0), n), poly((4 * n, -n, 0), k)
    if form == "gradient":
        reverse, first, further = (poly(part, n) for part in GRADIENT[family])
        return reverse + k * slope, first + (k - 1) * further
    return n * poly(VALUE[family], n) + k * slope, k * poly(VALUE[family], n)


def counted(form: str, family: str, n: int, k: int) -> tuple[int, int]:
    """The same, counted on the symbols of the generated code, or by running plain loops on counting numbers."""
    explicit, implicit, _ = COUNTS[form](family, n, k)
    return total(explicit), total(implicit)


def total(count: Operations) -> int:
    """Multiplications and additions together."""
    return count.multiplications + count.additions


def one_column(count: Answer) -> Answer:
    """One recursion, one slope, one function evaluated, however many columns N has."""

    def planted(form: str, family: str, n: int, k: int) -> tuple[int, int]:
        return count(form, family, n, k)[0], count(form, family, n, 1)[1]

    return planted


FORMS = {
    "inertia": "$W = M$ by inverse dynamics",
    "augmented": r"$(N_J^T E^T) \Gamma E$, augmented Jacobian",
    "gradient": r"$N_J^T \nabla f$ by forward derivatives",
    "black_box": r"$N_J^T \nabla f$, $f$ known by its values",
}


def explicit_weight_costs_more(trial: Trial, count: Answer, poly: Answer) -> Evidence:
    """Operations of N'W and N' grad f with and without W and grad f, counted, over n and k; and from formulas."""
    wrong: list[float] = []
    saved: dict[str, dict[tuple[str, int, int], float]] = {form: {} for form in FORMS}
    sizes = SIZES if trial.full else (5, 7)
    for form in FORMS:
        for family in ROWS:
            for n in sizes:
                if form in ("gradient", "black_box") and n > LONGEST_GRADIENT:
                    continue
                for k in sorted({1, 2, 3, n // 2, n - ROWS[family]} & set(range(1, n))):
                    explicit, implicit = count(form, family, n, k)
                    wrong.append(np.abs(np.subtract((explicit, implicit), formulas(poly, form, family, n, k))).max())
                    saved[form][family, n, k] = 1 - implicit / explicit
    one = {form: [share for (_, _, k), share in saved[form].items() if k == 1] for form in FORMS}
    everywhere = [share for form in FORMS for share in saved[form].values()]
    checks = (
        at_most("operations counted against closed formulas in $n$ and $k$: difference", wrong, 0.0),
        *(
            at_least(f"one degree of redundancy, share of operations saved: {words}", one[form], 0.0)
            for form, words in FORMS.items()
        ),
        at_least("a function known by its values alone, any $k$: share saved", list(saved["black_box"].values()), 0.0),
        Check("any of these saves operations for every $n$ and $k$", min(everywhere) > 0,
              f"{sum(share > 0 for share in everywhere)} of {len(everywhere)}", "all", len(everywhere), Role.REACH,
              reach(count, sizes[-1:] if not trial.full else (7, 10, 16, 30))),
    )  # fmt: skip
    return Evidence(checks, exhibits(trial, count, saved))


def reach(count: Answer, sizes: Sequence[int]) -> str:
    """Up to how many columns each form saves on a spatial arm, in words made of what is counted."""
    parts = []
    for form, words in FORMS.items():
        found = []
        least = next(n for n in SMALLEST if np.less(*count(form, "spatial", n, 1)[::-1]))
        for n in sizes:
            if form in ("gradient", "black_box") and n > LONGEST_GRADIENT:
                continue
            k = 0
            while k + 1 < n and np.less(*count(form, "spatial", n, k + 1)[::-1]):
                k += 1
            found.append(f"{'any k' if k + 1 == n else f'k ≤ {k}' if k > 1 else 'k = 1'} (n = {n})")
        parts.append(f"{words} saves from n = {least} on, for {', '.join(found)}")
    return "on a spatial arm " + "; ".join(parts)


def percent(share: float) -> str:
    """A share in per cent."""
    return f"{100 * share:.3g} %".replace("-", "−")


def exhibits(trial: Trial, count: Answer, saved: dict[str, Any]) -> tuple[Any, ...]:
    """Shares saved with k = 1 over n; the inertia form over n and k; and operations beside those of the rest of (6)."""
    lines = []
    for form in FORMS:
        for family in ("planar", "spatial"):
            points = sorted((n, share) for (f, n, k), share in saved[form].items() if f == family and k == 1)
            if form == "augmented" and family == "spatial":
                continue  # the same matrices
            name = form.replace("_", " ") + ("" if form == "augmented" else f", {family}")
            lines.append(Series(name, [n for n, _ in points], [100 * share for _, share in points], "line"))
    plot = Plot(
        "One degree of redundancy: operations saved by not forming W or ∇f", Axis("number of joints n"),
        Axis("saved, of forming N'W or N'∇f [%]"),
        (*lines, Series("nothing saved", [min(SIZES), max(SIZES)], [0, 0], "line", "bound")),
    )  # fmt: skip
    columns = (7, 10, 16, 20, 25, 30) if trial.full else (7,)
    degrees = (1, 2, 3, 4, 6, 8, 12, 16, 24)
    ratio = []
    for k in degrees:
        pairs = [count("inertia", "spatial", n, k) if k < n else None for n in columns]
        ratio.append([None if pair is None else pair[1] / pair[0] for pair in pairs])
    heat = Heat(
        "N'M of a spatial arm: operations by k inverse dynamics over those of forming M and multiplying; below 1 it saves",
        "number of joints n", "degrees of redundancy k", tuple(str(n) for n in columns), tuple(str(k) for k in degrees), ratio,
    )  # fmt: skip
    rows = []
    for form, words in FORMS.items():
        for n, k in ((7, 1), (10, 4), (30, 1)) if trial.full else ((7, 1), (7, 3)):
            if form in ("gradient", "black_box") and n > LONGEST_GRADIENT:
                continue
            explicit, implicit = count(form, "spatial", n, k)
            rest = total(operations("eq6", n, n - k, weighted=False))
            rows.append((words, n, k, explicit, implicit, percent(1 - implicit / explicit), rest,
                         percent((explicit - implicit) / (explicit + rest))))  # fmt: skip
    table = Table(
        "Spatial arms: operations with and without forming $W$ or $\\nabla f$",
        ("form", "$n$", "$k$", "explicit", "implicit", "saved", "rest of (6)", "saved of all"),
        tuple(rows),
    )
    return plot, heat, table


CLAIMS = (
    Claim(
        name="weight_not_needed_augmented",
        title="The augmented Jacobian needs no W",
        place="Section III, after the weightings",
        says=r"For the augmented Jacobian technique with a single degree of redundancy, $N_J^T W$ can be calculated as "
        r"$(N_J^T \nabla g)(\nabla g)^T$.",
        formula=r"N_J^T W = (N_J^T \nabla g)(\nabla g)^T",
        tested=r"Random gradients on three arms with $n - m = 1$; and $g = (1 + d) q_1 + q_2$ at F1, where $d = 0$ is an "
        "algorithmic singularity, against exact rationals.",
        accepted="The joint rates with and without $W$ differ by no more than the sum of their error bounds.",
        paths=(
            CodePath(r"rows $(N_J^T \nabla g)(\nabla g)^T$, $W$ not formed", augmented_along),
            CodePath("eq. (6) as printed, with $W$ of (8) formed, numpy", equations.augmented),
        ),
        examine=weight_not_needed_augmented,
        fault=Fault(r"$\bar g$ on the right-hand side without $N_J^T \nabla g$ before it", half_projected),
        sources=("methods.md 4.4",),
    ),
    Claim(
        name="inertia_by_inverse_dynamics",
        title="With W = M, inverse dynamics gives N'W without M",
        place="Section III, after the weightings",
        says=r"When $W = M$, $N_J^T W$ can be calculated by treating the columns of $N_J$ as joint accelerations in an "
        "inverse-dynamics algorithm.",
        tested="Every robot there is and planar arms of up to 30 joints; torques at rest and without gravity.",
        accepted="The rows are $N_J^T M$ to rounding, and the joint rates within the bounds those of the formula with "
        "$M^{-1}$.",
        paths=(
            CodePath("recursive Newton–Euler algorithm on the columns of $N_J$", inertia_along),
            CodePath(r"$M^{-1} J^T (J M^{-1} J^T)^{-1} \dot x$ with $M$ by composite bodies, numpy", inertia_weighted.original),
        ),
        examine=inertia_by_inverse_dynamics,
        fault=Fault("gravity left in the inverse dynamics", gravity_left_in),
        sources=("methods.md M16",),
    ),
    Claim(
        name="directional_derivatives",
        title="Directional derivatives of f along N's columns replace ∇f",
        place="Section III, after the weightings",
        says=r"Directional derivatives of $f$ along the columns of $N_J$ can be used to find $N_J^T \nabla f$ in lieu of "
        "explicit calculation.",
        tested="Gravity torque, manipulability and distance from a posture on three arms, by forward differentiation; and a "
        "function known by its values alone, by real and complex steps.",
        accepted=r"$N_J^T \nabla f$ agrees with the explicit gradient to rounding, the joint rates within the bounds.",
        paths=(
            CodePath("forward mode of CasADi along the columns of $N_J$", symbolic_along),
            CodePath(r"$z + J^+(\dot x - J z)$, $z = -\alpha \nabla f$ formed, numpy", projected),
        ),
        examine=directional_derivatives,
        fault=Fault("derivatives along directions of length one, not along the columns as they are", unit_directions),
        sources=("methods.md M5, M6",),
    ),
    Claim(
        name="explicit_weight_costs_more",
        title="Not forming W or ∇f can be what matters most",
        place="Section III, after the weightings; Section VII",
        says=r"For problems in which $W$ or $\nabla f$ are very costly to evaluate, the ability to find the solution without "
        "them can be the most important characteristic of (6).",
        tested="Operations of four forms with and without $W$ or $\\nabla f$, counted on generated code (sines and cosines "
        "shared, zeros and ones dropped) over the number of joints and of degrees of redundancy.",
        accepted=r"With one degree of redundancy every form takes fewer operations; a function known by its values alone is "
        "asked $k$ times and not $n$.",
        paths=(
            CodePath("operations counted instruction by instruction", counted),
            CodePath("closed formulas in $n$ and $k$", np.polyval, "numpy:polyval"),
        ),
        examine=explicit_weight_costs_more,
        fault=Fault("one inverse dynamics, slope or evaluation counted for all columns of $N_J$", one_column),
        sources=("Luh, Walker, Paul 1980", "Walker, Orin 1982"),
    ),
)
