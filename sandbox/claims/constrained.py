"""Extrema of a function g with the hand held in place, found as what they are; numpy and scipy alone.

The other side of the claims about extended Jacobians and elastic joints: Lagrange's conditions by root finding, rates as
differences of the extremum, derivatives of null vectors by complex steps. No Hessian, no W and no eq. (6) in here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import null_space
from scipy.optimize import root

from sandbox.tolerances import DIFFERENCE, EXTREMUM_ROUNDING, EXTREMUM_STEP, UNIT

Array = np.ndarray

Function = Callable[[Array], Array]

IMAGINARY = 1e-40
"""Complex steps truncate nothing: the derivative is as exact as the function."""

CUTS = 5
"""Steps tried, each an eighth of the one before."""


@dataclass(frozen=True)
class Arm:
    """Where the hand is, place (n,) -> (m,) [m], and its Jacobian (n,) -> (m, n) [m/rad]."""

    place: Function
    jacobian: Function


def tip(q: Array) -> Array:
    """Tip (2,) [m] of a planar arm of unit links, relative joint angles (n,) [rad], real or complex."""
    angles = np.cumsum(q)
    return np.array([np.cos(angles).sum(), np.sin(angles).sum()])


def tip_jacobian(q: Array) -> Array:
    """Its Jacobian (2, n): every joint carries the links from it on."""
    angles = np.cumsum(q)
    return np.array([-np.cumsum(np.sin(angles)[::-1])[::-1], np.cumsum(np.cos(angles)[::-1])[::-1]])


PLANAR = Arm(tip, tip_jacobian)


@dataclass(frozen=True)
class Springs:
    """Function g = 1/2 (q - rest)'K(q - rest) [J]; stiffness K (n,) or (n, n) [Nm/rad], rest (n,) [rad]."""

    stiffness: Array
    rest: Array

    def __call__(self, q: Array) -> float:
        """Energy g [J]."""
        return float((q - self.rest) @ self.gradient(q) / 2)

    def gradient(self, q: Array) -> Array:
        """Grad g (n,) = K (q - rest) [Nm], real or complex."""
        K = np.asarray(self.stiffness)
        return K @ (q - self.rest) if K.ndim == 2 else K * (q - self.rest)


def slope(function: Function, q: Array) -> Array:
    """Derivative (..., n) of a function of q by complex steps."""
    steps = 1j * IMAGINARY * np.eye(len(q))
    return np.stack([np.imag(function(q + step)) / IMAGINARY for step in steps], axis=-1)


def conditions(arm: Arm, gradient: Function, x: Array, z: Array, n: int) -> Array:
    """Lagrange's conditions (n + m,) of an extremum of g on place(q) = x, at z = (q, lam)."""
    q, lam = z[:n], z[n:]
    return np.concatenate([gradient(q) - arm.jacobian(q).T @ lam, arm.place(q) - x])


def extremum(arm: Arm, gradient: Function, x: Array, q: Array) -> Array:
    """The extremum (n,) of g on place(q) = x near q, a minimum or not.

    Raises ArithmeticError where root finding does not end at one.
    """
    n = len(q)
    start = np.concatenate([q, np.linalg.lstsq(arm.jacobian(q).T, gradient(q))[0]])
    found = root(lambda z: conditions(arm, gradient, x, z, n), start, tol=UNIT)
    if not np.abs(found.fun).max() <= EXTREMUM_ROUNDING * UNIT * (1 + np.abs(found.x).max() ** 2):
        raise ArithmeticError(f"no extremum of g on x(q) = {x}: {found.fun} is left")
    return found.x[:n]


def difference(arm: Arm, gradient: Function, q: Array, xdot: Array, step: float) -> Array:
    """Rates (n,) of the extremum as the hand leaves place(q) along xdot: its difference of fourth order over `step` [s]."""
    x = arm.place(q)
    near = {i: extremum(arm, gradient, x + i * step * xdot, q) for i in (-2, -1, 1, 2)}
    return (8 * (near[1] - near[-1]) - (near[2] - near[-2])) / (12 * step)


def extremum_rates(arm: Arm, gradient: Function, q: Array, xdot: Array) -> tuple[Array, float]:
    """The same (n,), with its error: by halving the step, which is 15 times what is left, and by rounding.

    The step is cut where the extremum bends so fast that it tells too little. Raises ArithmeticError where none tells any.
    """
    unit = EXTREMUM_STEP / max(1.0, float(np.abs(xdot).max()))
    best, least = np.full(len(q), np.nan), np.inf
    for cut in range(CUTS):
        step = unit / 8**cut
        try:
            coarse, fine = (difference(arm, gradient, q, xdot, size) for size in (step, step / 2))
        except ArithmeticError:
            continue
        truncated, rounded = float(np.abs(fine - coarse).max()), rounding(arm, gradient, q, step / 2)
        if truncated + rounded < least:
            best, least = fine, truncated + rounded
        if truncated <= max(rounded, DIFFERENCE * np.abs(fine).max()):
            break
    if not np.isfinite(least):
        raise ArithmeticError(f"the extremum of g near {q} cannot be followed")
    return best, least


def rounding(arm: Arm, gradient: Function, q: Array, step: float) -> float:
    """What rounding of Lagrange's conditions makes of a difference of their root over `step`."""
    n, x = len(q), arm.place(q)
    z = np.concatenate([q, np.linalg.lstsq(arm.jacobian(q).T, gradient(q))[0]])
    h = UNIT ** (1 / 3)
    K = np.stack(
        [conditions(arm, gradient, x, z + h * e, n) - conditions(arm, gradient, x, z - h * e, n) for e in np.eye(len(z))],
        axis=-1,
    )
    size = 1 + np.abs(gradient(q)).max() + np.abs(z).max() ** 2
    return float(EXTREMUM_ROUNDING * UNIT * np.linalg.norm(np.linalg.inv(K / (2 * h)), 2) * size / step)


def cross(q: Array) -> Array:
    """Null vector (3, 1) of the planar 3R: the cross product of the rows of J, of length w."""
    return np.cross(*tip_jacobian(q))[:, None]


def projected(arm: Arm, q: Array) -> Function:
    """Basis N(q) = N_0 - J^+J N_0 of null J, N_0 that of `q`, orthonormal and frozen."""
    N = null_space(arm.jacobian(q))

    def basis(q: Array) -> Array:
        J = arm.jacobian(q)
        return N - J.T @ np.linalg.solve(J @ J.T, J @ N)

    return basis


def eliminated(arm: Arm, basic: tuple[int, ...], n: int) -> Function:
    """Basis N(q) (n, k) of null J: the identity in the free joints, the `basic` ones solved for."""
    free = [i for i in range(n) if i not in basic]

    def basis(q: Array) -> Array:
        J = arm.jacobian(q)
        N = np.zeros((n, len(free)), dtype=J.dtype)
        N[free] = np.eye(len(free))
        N[list(basic)] = -np.linalg.solve(J[:, list(basic)], J[:, free])
        return N

    return basis


def basis_rates(
    arm: Arm, gradient: Function, q: Array, xdot: Array, basis: Function, *, alpha: float = 0.0, kappa: float = 0.0
) -> tuple[Array, float]:
    """Rates (n,) of [J; H] qdot = [xdot; -kappa h - alpha (N'H')^-1 h], h = N'grad g, N = basis(q); and cond [J; H]."""
    H = slope(lambda z: basis(z).T @ gradient(z), q)
    N = basis(q)
    h = N.T @ gradient(q)
    matrix = np.vstack([arm.jacobian(q), H])
    pull = -kappa * h - alpha * np.linalg.solve(N.T @ H.T, h)
    scaled = matrix / np.linalg.norm(matrix, axis=1, keepdims=True)
    return np.linalg.solve(matrix, np.concatenate([xdot, pull])), float(np.linalg.cond(scaled))


def held(arm: Arm, q: Array, x: Array) -> Array:
    """The posture nearest q, along J^+, that holds the hand at x: Newton's method."""
    for _ in range(50):
        J = arm.jacobian(q)
        step = J.T @ np.linalg.solve(J @ J.T, arm.place(q) - x)
        q = q - step
        if np.abs(step).max() <= UNIT:
            break
    return q


def curvature(arm: Arm, g: Callable[[Array], float], q: Array, direction: Array, step: float = EXTREMUM_STEP) -> float:
    """Second derivative of g along the self-motion that leaves an extremum q in `direction` (n,), by differences."""
    x = arm.place(q)
    g0, near = g(q), {i: g(held(arm, q + i * step * direction, x)) for i in (-2, -1, 1, 2)}
    return (16 * (near[1] + near[-1]) - (near[2] + near[-2]) - 30 * g0) / (12 * step**2)
