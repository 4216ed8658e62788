"""N' grad f by directional derivatives."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from problems import robots
from problems.implicit.directional import plain_along, symbolic_along
from problems.methods import METHODS
from problems.methods.draw import generic
from problems.original.gradient_projection import projected
from problems.robots.twin import Symbol, Twin
from sandbox.claims.claim import Answer, Claim, CodePath, Evidence, Fault, Role, Trial, at_least, at_most
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.implicit.allowance import norms, within
from sandbox.claims.numbers import told
from sandbox.claims.postures import F1B
from sandbox.closed_form import null_basis
from sandbox.closed_form.eq6_implicit import eq6_implicit
from sandbox.problem import VelocityProblem
from sandbox.stacked import times, transpose
from sandbox.tolerances import ORIGINAL, UNIT

Array = np.ndarray


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
    """Manipulability squared of the unit planar 3R arm, on real or complex numbers."""
    s3, s23, s2 = np.sin(q[..., 2]), np.sin(q[..., 1] + q[..., 2]), np.sin(q[..., 1])
    squared: Array = s3**2 + (s3 + s23) ** 2 + (s2 + s23) ** 2
    return squared


def directional_derivatives(trial: Trial, along: Answer, project: Answer) -> Evidence:
    """N' grad f by forward mode along N's columns in (6), against explicit gradients projected; by steps of any size."""
    rng = trial.rng("directional_derivatives")
    slopes, rates, levels = [], [], []
    clouds: dict[str, list[tuple[Array, Array]]] = {what: [] for what, *_ in MEASURES}
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
            clouds[what].append((np.linalg.cond(J), gap))
            levels.append((np.linalg.cond(J), level))
    robot, still, rows, cases = robots.load("planar_3r"), np.zeros((1, 2)), [], []
    slope, weight = 0.4 / np.sqrt(5), 6e-4 * np.linalg.norm(robot.model.gravity.linear) ** 2
    for what, expression, alpha, expected in (
        (r"$f = -w$, $\alpha = 1$", volume, -1.0, np.array([0.0, -slope, 2 * slope])),
        (r"$f = \frac12 \tau_g^T \tau_g$, $\alpha = 10^{-3}$", squared_torque, 1e-3, np.array([0.0, weight, -2 * weight])),
    ):
        J = robot.jacobian(F1B[None])
        N = null_basis.pivoted(J)
        found = along(robot, expression)(F1B[None], N)
        x = eq6_implicit(J, still, N, transpose(N), alpha * found, size=np.sqrt(3)).x[0]
        a = alpha * times(np.linalg.pinv(transpose(N)), found)
        allowed = within(VelocityProblem(J=J, xdot=still, W=np.eye(3), a=a), expected[None], N, "gradient_projection")[0]
        cases.append(np.abs(x - expected).max() / allowed)
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
        at_most(r"$N_J^T \nabla f$ by directional derivatives against $N_J^T$ times the explicit gradient: difference / "
        r"rounding",
                np.concatenate(slopes), 1.0),
        at_most("joint rates of (6) from it against the explicit gradient projected: difference / bound",
                np.concatenate(rates), 1.0),
        at_most("q = (0, π/2, 0): rates against those by hand: difference / bound", cases, 1.0, role=Role.OURS),
        at_most("a function known by its values alone, by complex steps along $N_J$: difference / rounding",
                [complex_ / (ORIGINAL * 3 * UNIT)], 1.0, role=Role.OURS),
        at_least("the same by real steps, whatever their length: difference / rounding",
                 np.array(gaps) / (ORIGINAL * 3 * UNIT), 1.0, role=Role.OURS),
    )  # fmt: skip
    series = [
        Series(what, np.concatenate([cond for cond, _ in cloud]), np.concatenate([gap for _, gap in cloud]))
        for what, cloud in clouds.items()
    ]
    condition, level = (np.concatenate(part) for part in zip(*levels, strict=True))
    order = np.argsort(condition)
    thin = order[:: max(1, len(order) // 100)]
    plots = (
        Plot("Directional derivatives along the columns of N against N' times the explicit gradient, over |N||∇f|; three arms",
             Axis("cond J", log=True), Axis("relative difference of N'∇f", log=True),
             (*series, Series("50 n u cond J", condition[thin], level[thin], role="bound"))),
        Plot("Planar 3R, f = det JJ' known by its values alone: slopes along N by steps of f, against forward mode",
             Axis("step [rad]", log=True), Axis("relative error of N'∇f", log=True),
             (Series("central differences", steps, gaps, "line", "other"),
              Series("complex step, 2⁻¹⁰⁰", [steps[0], steps[-1]], [max(complex_, UNIT / 16)] * 2, "line"),
              Series("50 n u", [steps[0], steps[-1]], [ORIGINAL * 3 * UNIT] * 2, "line", "bound"))),
    )  # fmt: skip
    table = Table(
        r"Planar 3R at $q = (0, \pi/2, 0)$, $\dot x = 0$: joint rates without $\nabla f$",
        ("measure", "by hand [rad/s]", "ours [rad/s]"), tuple(rows),
    )  # fmt: skip
    return Evidence(checks, (*plots, table))


def squared_volume(symbols: Twin) -> Symbol:
    """The determinant of JJ'."""
    return ca.det(symbols.jacobian @ symbols.jacobian.T)


CLAIM = Claim(
    name="directional_derivatives",
    title="Directional derivatives of f along the columns of N replace ∇f",
    place="Section III, after the weightings",
    says=r"Directional derivatives of $f$ along the columns of $N_J$ can be used to find $N_J^T \nabla f$ in lieu of "
    "explicit calculation.",
    tested="Gravity torque, manipulability and distance from a posture on three arms, by forward differentiation; and a "
    "function known by its values alone, by real and complex steps.",
    accepted=r"$N_J^T \nabla f$ agrees with the explicit gradient to rounding, and the joint rates agree within bounds.",
    paths=(
        CodePath("forward mode of CasADi along the columns of $N_J$", symbolic_along),
        CodePath(r"$z + J^+(\dot x - J z)$, $z = -\alpha \nabla f$ formed, numpy", projected),
    ),
    examine=directional_derivatives,
    fault=Fault("derivatives along directions of length one, not along the columns as they are", unit_directions),
    sources=METHODS["gradient_projection"].works,
)
