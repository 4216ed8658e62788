"""Task errors evaluated with twice the digits, errors of the joint rates, and how those of two methods compare."""

from __future__ import annotations

import numpy as np

from sandbox.problem import VelocityProblem
from sandbox.reference import truth
from sandbox.stacked import times
from sandbox.tolerances import FORWARD, UNIT
from sandbox.yardstick import Yardstick

Array = np.ndarray

SPLITTER = 2.0**27 + 1.0
"""Cuts the 53 bits of a float64 into halves whose products are exact (Dekker)."""


def residual(J: Array, x: Array, xdot: Array) -> Array:
    """J x - xdot (B, m) as if in twice the precision, then rounded: off by u |J x - xdot| + (n u)^2 (|J||x| + |xdot|).

    Source: T. Ogita, S. M. Rump, S. Oishi, Accurate sum and dot product, SIAM J. Sci. Comput. 26(6), 2005 (Dot2).
    """
    total, lost = -xdot, np.zeros_like(xdot)
    for j in range(x.shape[-1]):
        product, below = two_product(J[..., j], x[..., j, None])
        total, rest = two_sum(total, product)
        lost = lost + (below + rest)
    return total + lost


def two_sum(a: Array, b: Array) -> tuple[Array, Array]:
    """fl(a + b) and what it lost: their sum is a + b exactly (Knuth)."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def two_product(a: Array, b: Array) -> tuple[Array, Array]:
    """fl(a b) and what it lost: their sum is a b exactly (Dekker), far from overflow and underflow."""
    product = a * b
    (a1, a2), (b1, b2) = halves(a), halves(b)
    return product, a2 * b2 - (((product - a1 * b1) - a2 * b1) - a1 * b2)


def halves(a: Array) -> tuple[Array, Array]:
    """The number a as the sum of two numbers of 26 bits (Dekker, Veltkamp)."""
    big = SPLITTER * a
    high = big - (big - a)
    return high, a - high


def task_error(problem: VelocityProblem, x: Array) -> Array:
    """|J x - xdot| / |xdot| (B,), 2-norms; NaN where there is no answer."""
    off: Array = np.linalg.norm(residual(problem.J, x, problem.xdot), axis=-1)
    return off / np.linalg.norm(problem.xdot, axis=-1)


def disagreement(problem: VelocityProblem, x: Array, recorded: Array) -> Array:
    """Largest entry of |J x - xdot| as `recorded` (B,) against twice the digits, over what rounding explains of it (B,)."""
    found = np.abs(residual(problem.J, x, problem.xdot)).max(axis=-1)
    terms = (times(np.abs(problem.J), np.abs(x)) + np.abs(problem.xdot)).max(axis=-1)
    share: Array = np.abs(recorded - found) / (FORWARD * problem.n * UNIT * terms)
    return share


def exact(problem: VelocityProblem) -> Yardstick:
    """The exact minimisers, and what errors are relative to in the records and in the bounds of the closed forms."""
    return Yardstick.of(problem, "exact", truth(problem))  # type: ignore[arg-type]


def rate_error(yardstick: Yardstick, x: Array) -> Array:
    """Distance of x (B, n) from the exact minimisers, relative (B,)."""
    off: Array = np.abs(x - yardstick.x).max(axis=-1)
    return off / yardstick.size


def ratios(six: Array, other: Array) -> tuple[float, float]:
    """Median and 99 % of the error of (6), each divided by the other's, over the problems that both answered."""
    both = np.isfinite(six) & np.isfinite(other)
    if not both.any():
        return float("nan"), float("nan")
    ours, theirs = (np.quantile(error[both], (0.5, 0.99)) for error in (six, other))
    return float(ours[0] / theirs[0]), float(ours[1] / theirs[1])


def nearer(six: Array, other: Array) -> float:
    """Share of the problems that both answered at which (6) has the smaller error [%]."""
    both = np.isfinite(six) & np.isfinite(other)
    return 100 * float(np.mean(six[both] < other[both])) if both.any() else float("nan")


def worst(error: Array) -> tuple[float, float, float]:
    """Median, 99 % and largest of the answers there are."""
    found = error[np.isfinite(error)]
    if not len(found):
        return (float("nan"),) * 3
    median, high, largest = np.quantile(found, (0.5, 0.99, 1))
    return float(median), float(high), float(largest)
