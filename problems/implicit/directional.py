"""N' grad f by derivatives of f along the columns of N: grad f itself is never formed."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import casadi as ca
import numpy as np

from problems.robots.robot import Robot
from problems.robots.twin import Symbol, Twin, twin
from sandbox import check
from sandbox.errors import RefusalError, ShapeError
from sandbox.tolerances import DIFFERENCE, UNIT

Array = np.ndarray

STEP = 2.0**-100
"""Imaginary step [rad, m]: its square is below rounding of anything, and a power of two divides without error."""


class NotAnalyticError(RefusalError):
    """A function whose complex step is not its derivative: abs, max, comparisons or real parts stand in it."""


def symbolic_along(robot: Robot, expression: Callable[[Twin], Symbol]) -> Callable[[Any, Any], Array]:
    """A function of q (..., n) and N (..., n, k) that gives N' grad f (..., k), f = expression(twin) a scalar.

    Forward mode of CasADi: one sweep per column, with what they share computed once. A column f (p, 1) gives
    (..., k, p): the derivatives of each entry, rows N'(df/dq)'.
    """
    symbols = twin(robot)
    f = expression(symbols)

    @cache
    def evaluator(k: int) -> Callable[..., tuple[Array, ...]]:
        along = ca.SX.sym("along", robot.n * k)
        slopes = ca.jtimes(f, symbols.q, ca.reshape(along, robot.n, k))  # (p, k)
        return symbols.evaluator(ca.vec(slopes), parameters=[along])

    def function(q: Any, N: Any) -> Array:
        q, N = _given(q, N)
        lead, k = check.leading({"q": q.shape[:-1], "N": N.shape[:-2]}), N.shape[-1]
        columns = np.swapaxes(np.broadcast_to(N, (*lead, robot.n, k)), -1, -2).reshape(*lead, k * robot.n)
        flat = evaluator(k)(np.broadcast_to(q, (*lead, robot.n)), columns)[0]
        p = int(f.shape[0])
        return flat.reshape(*lead, k) if p == 1 else flat.reshape(*lead, k, p)

    return function


def plain_along(f: Callable[[Array], Array], q: Any, N: Any) -> Array:
    """N' grad f (..., k) of a plain function by complex steps along the columns of N (..., n, k): no difference, no rounding.

    f : q (..., n) -> (...,), written with operations that take complex numbers; called k + 3 times on whole stacks, not n

    Raises NotAnalyticError where the complex step along the sum of the columns is not the central difference, with the
    first configuration that shows it; ShapeError where f does not give one number per configuration.
    """
    q, N = _given(q, N)
    lead, k = check.leading({"q": q.shape[:-1], "N": N.shape[:-2]}), N.shape[-1]
    q = np.broadcast_to(q, (*lead, q.shape[-1]))
    N = np.broadcast_to(N, (*lead, *N.shape[-2:]))
    slopes = np.stack([_value(f, q + 1j * STEP * N[..., c], lead).imag / STEP for c in range(k)], axis=-1)
    whole, size = N.sum(axis=-1), np.abs(_value(f, q, lead))
    step = UNIT ** (1 / 3) / np.maximum(np.linalg.norm(whole, axis=-1), 1.0)[..., None]
    ahead, behind = _value(f, q + step * whole, lead), _value(f, q - step * whole, lead)
    difference = ((ahead - behind).real) / (2 * step[..., 0])
    miss = np.abs(difference - slopes.sum(axis=-1))
    bad = ~(miss <= DIFFERENCE * (np.abs(difference) + np.abs(slopes).sum(axis=-1) + size))
    if bad.any():
        at = check.first(bad)
        raise NotAnalyticError(
            f"f does not take complex numbers as an analytic function does: at configuration {list(at)} its complex step is "
            f"{slopes.sum(axis=-1)[at]:.6g} where its difference is {difference[at]:.6g}; write it without abs, max, real "
            "parts or comparisons of its argument, or give f as a CasADi expression",
            index=at, value=float(miss[at]),
        )  # fmt: skip
    return slopes


def _value(f: Callable[[Array], Array], q: Array, lead: tuple[int, ...]) -> Array:
    value = np.asarray(f(q))
    if value.shape != lead:
        raise ShapeError(f"f gives an array of shape {value.shape}; it must be {lead}, one number per configuration", field="f")
    return value


def _given(q: Any, N: Any) -> tuple[Array, Array]:
    q, N = check.real(q, "q"), check.matrices(N, "N")
    if q.ndim == 0:
        raise ShapeError("q must be a vector or a stack of them", field="q")
    check.shape(q, ("n",), {}, "q")
    check.shape(N, ("n", "k"), {"n": q.shape[-1]}, "N")
    return q, N
