"""The augmented Jacobian: W = E' Gamma E and a = -E' Gamma gbar, rows of E the gradients of secondary functions."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from problems.measures.jacobian import decompose
from problems.robots.robot import Robot
from sandbox import check
from sandbox.errors import RangeError, RefusalError, ShapeError
from sandbox.parameters import configuration, told, vectors
from sandbox.tolerances import RANK, UNIT
from sandbox.weight import Weight

Array = np.ndarray


class FunctionCountError(RefusalError):
    """Fewer secondary functions than degrees of redundancy: condition (7) fails."""


class NotRedundantError(RefusalError):
    """As many task rows as joints: nothing is left for a secondary task, and W and a have no effect."""


class AlgorithmicSingularityError(RefusalError):
    """The secondary task conflicts with the task itself: N'E' is singular although J is not."""


class OverdeterminedWarning(UserWarning):
    """More secondary functions than degrees of redundancy: they are met in the least-squares sense of gamma only."""


def augmented(E: Array, gamma: Any = None) -> Weight:
    """W = E' Gamma E, never multiplied out; E (..., k, n) [g_i/rad], gamma (k,) > 0, gamma_i [g_i]^2 of a common unit.

    Raises RangeError for a gamma that is not positive. Source: eqs. (8) and (10), English & Maciejewski.
    """
    *lead, count, n = E.shape
    Gamma = np.broadcast_to(np.diag(positive(gamma, count)), (*lead, count, count))
    return Weight(np.zeros((*lead, n, n)), E, Gamma)


def secondary_rate(E: Array, gbar: Any = None, gamma: Any = None) -> Array:
    """Vector a = -E' Gamma gbar (..., n): gbar (k,) or (..., k) [g_i/s], the rates asked of the secondary functions, is a
    number here and never differentiated. Source: eq. (9) in the sense of footnote 2; methods 8.3.
    """  # fmt: skip
    count = E.shape[-2]
    gbar = vectors(np.zeros(count) if gbar is None else gbar, "gbar", count, letter="k", lead=E.shape[:-2])
    return -np.einsum("...kn,...k->...n", E, positive(gamma, count) * gbar)


def closed_loop(g: Array, desired: Any, gain: Any, desired_rate: Any = 0.0) -> Array:
    """Rates gbar = gdot_des + kp (g_des - g) (..., k) [g_i/s]: gain kp [1/s] is a number or (k,)."""
    desired, gain = check.real(desired, "desired"), check.real(gain, "gain")
    desired_rate = check.real(desired_rate, "desired_rate")
    for name, values in (("desired", desired), ("gain", gain), ("desired_rate", desired_rate)):
        if values.shape[-1:] not in ((), g.shape[-1:]) or len(values.shape) > len(g.shape):
            raise ShapeError(f"{name} has shape {values.shape}; it must be ({g.shape[-1]},), one per function", field=name)
    return desired_rate + gain * (desired - g)


def positive(gamma: Any, count: int) -> Array:
    """Positive gamma (count,), ones if left out.

    Raises RangeError where one is not positive, ShapeError for a wrong number of them.
    """
    if gamma is None:
        return np.ones(count)
    gamma = vectors(gamma, "gamma", count, letter="k")
    if gamma.ndim > 1 or not (gamma > 0).all():
        raise RangeError(f"gamma is {told(gamma.tolist())}; it must be {count} positive numbers", field="gamma", value=gamma)
    return gamma


def clear(robot: Robot, q: Array, E: Array) -> tuple[Array, Array]:
    """(sigma_min(N'E') / |E|, cond J), each (...,), N orthonormal and the rows of E scaled to one.

    The first is the distance from an algorithmic singularity. Raises RankDeficientError where J has lost rank.
    """
    found = decompose(robot, robot.jacobian(q))
    length = np.linalg.norm(E, axis=-1, keepdims=True)
    rows = np.divide(E, length, out=np.zeros(np.shape(E)), where=length > 0)
    return np.linalg.svd(rows @ found.N, compute_uv=False)[..., -1], found.condition


def redundancy(robot: Robot) -> int:
    """Degrees of redundancy, k = n - m.

    Raises NotRedundantError where it is not positive.
    """
    if robot.k < 1:
        raise NotRedundantError(
            f"{robot.name} has {robot.n} joints for {robot.m} task rows: there is no self-motion for a secondary task; choose "
            "fewer rows (robot.task), or a method without one", redundancy=robot.k,
        )  # fmt: skip
    return robot.k


def check_rows(robot: Robot, q: Array, E: Array) -> None:
    """Refuse secondary rows E (..., p, n) that do not fix the self-motion.

    Raises
    ------
    FunctionCountError, NotRedundantError
        for p < k = n - m, k < 1; p > k warns (OverdeterminedWarning).
    AlgorithmicSingularityError, RankDeficientError
        where N'E' or J is singular to rounding, naming the configuration.

    Source: methods 4.1, M11.
    """
    count, k = E.shape[-2], redundancy(robot)
    if count < k:
        raise FunctionCountError(
            f"{robot.name} has {k} degrees of redundancy but {count} secondary functions: N'WN of rank {count} is singular; "
            f"give {k}, or add a positive definite base (damped_secondary)", functions=count, redundancy=k,
        )  # fmt: skip
    if count > k:
        warnings.warn(
            f"{count} secondary functions for {k} degrees of redundancy of {robot.name}: "
            "they are met in the least-squares sense that gamma weighs",
            OverdeterminedWarning, stacklevel=3,
        )  # fmt: skip
    distance, condition = clear(robot, q, E)
    bad = ~(distance > RANK * robot.n * UNIT * condition)
    if bad.any():
        index = check.first(bad)
        value = float(distance[index])
        raise AlgorithmicSingularityError(
            f"{configuration(index)} of {robot.name}: sigma_min(N'E') is {value:.3g} of |E|, an algorithmic singularity: the "
            "self-motion cannot move the secondary functions there; choose others, or add a base (damped_secondary)",
            index=index, sigma_min=value,
        )  # fmt: skip
