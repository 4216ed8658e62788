"""Distance from the joint limits: quadratic (Liegeois 1977), p-norm (Klein) and barrier (Zghal, Dubey, Euler); methods M3."""

from __future__ import annotations

from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from problems.measures.measure import Card, Measure, NotDifferentiableError, OutsideDomainError, symbolic
from problems.robots.robot import Robot
from problems.robots.twin import Symbol, Twin
from sandbox import check
from sandbox.errors import RangeError, ShapeError
from sandbox.parameters import configuration, extended, whole
from sandbox.tolerances import KINK, UNIT

Array = np.ndarray

QUADRATIC = Card(
    "joint_limits_quadratic", "1", "mean squared distance from mid-range, 1 at the limits", "Liegeois 1977; methods M3",
    "everywhere, beyond limits too",
)  # fmt: skip
P_NORM = Card(
    "joint_limits_p_norm", "1", "p-norm of the distances from mid-range, p even: nearly the largest of them",
    "Klein; methods M3", "everywhere, beyond limits too; no gradient with all joints at mid-range",
)  # fmt: skip
BARRIER = Card(
    "joint_limits_barrier", "1", "barrier that grows without bound towards the limits",
    "Zghal, Dubey, Euler 1990; Chan, Dubey 1995; methods M3", "strictly inside the joint limits",
)  # fmt: skip

EXPONENT = 6
LARGEST_EXPONENT = 20
"""Powers of joint positions that are told from mid-range at all stay in the range of floats."""


class Limits(NamedTuple):
    """Which joints count (their places, 0..n-1), and their limits and weights, one each per joint that counts."""

    joints: tuple[int, ...]
    lower: Array
    upper: Array
    weights: Array


def limits(robot: Robot, lower: Any = None, upper: Any = None, weights: Any = None) -> Limits:
    """Joint limits (n,) [rad, m], the robot's own where left out; a joint without two finite limits is dropped.

    weights : (n,), at least 0; without them 1

    Raises
    ------
    ShapeError, NonFiniteError
        for limits or weights that are not (n,), or masked
    RangeError
        where a limit is NaN, a lower one not below its upper one, a weight negative, a weight is given to a joint
        without two finite limits, or no joint is left
    """
    lower = _numbers(robot, "lower", robot.lower if lower is None else lower)
    upper = _numbers(robot, "upper", robot.upper if upper is None else upper)
    bounded = np.isfinite(lower) & np.isfinite(upper)
    bad = ~(lower < upper)  # NaN is below nothing
    if bad.any():
        joint = int(np.flatnonzero(bad)[0]) + 1
        raise RangeError(
            f"joint {joint} of {robot.name} has the limits {lower[joint - 1]:g} and {upper[joint - 1]:g}: the lower one must "
            "lie below the upper one",
            joint=joint, lower=float(lower[joint - 1]), upper=float(upper[joint - 1]),
        )  # fmt: skip
    w = _numbers(robot, "weights", bounded.astype(float) if weights is None else weights)
    bad = ~((w >= 0) & (w < np.inf))
    if bad.any():
        joint = int(np.flatnonzero(bad)[0]) + 1
        raise RangeError(f"the weight of joint {joint} is {w[joint - 1]:g}; weights are at least 0", joint=joint)
    bad = (w > 0) & ~bounded
    if bad.any():
        joint = int(np.flatnonzero(bad)[0]) + 1
        raise RangeError(
            f"joint {joint} of {robot.name} has no two finite limits ({lower[joint - 1]:g}, {upper[joint - 1]:g}), so no "
            f"distance from them to weigh; give it the weight 0, or limits",
            joint=joint, lower=float(lower[joint - 1]), upper=float(upper[joint - 1]),
        )  # fmt: skip
    counted = np.flatnonzero(w > 0)
    if not len(counted):
        raise RangeError(f"no joint of {robot.name} has both finite limits and a weight: there is nothing to avoid")
    return Limits(tuple(int(i) for i in counted), lower[counted], upper[counted], w[counted])


def _numbers(robot: Robot, name: str, values: Any) -> Array:
    """Numbers (n,), infinite or NaN ones too."""
    array = extended(values, name)
    if array.shape != (robot.n,):
        raise ShapeError(f"{name} has shape {array.shape}; it must be (n,) = ({robot.n},)", field=name, shape=array.shape)
    return array


def quadratic(robot: Robot, *, lower: Any = None, upper: Any = None, weights: Any = None) -> Measure:
    """Measure f = 1/n sum w_i x_i^2, x_i = (q_i - c_i)/(upper_i - c_i), c_i mid-range; arguments and refusals as `limits`."""
    kept = limits(robot, lower, upper, weights)
    return symbolic(
        *QUADRATIC[:4], _quadratic, constants=(kept.joints,), parameters=(kept.lower, kept.upper, kept.weights),
        domain=QUADRATIC.domain,
    )  # fmt: skip


def p_norm(robot: Robot, *, p: int = EXPONENT, lower: Any = None, upper: Any = None, weights: Any = None) -> Measure:
    """Measure f = (sum w_i x_i^p)^(1/p), x as in `quadratic`: nearly the largest |x_i|; p even, 2..20.

    Raises RangeError for another p, and what `limits` raises; the gradient refuses mid-range (NotDifferentiableError).
    """
    p = whole(p, "p", 2, LARGEST_EXPONENT, of="an even number")
    if p % 2:
        raise RangeError(f"p is {p}; it must be an even number of 2..{LARGEST_EXPONENT}", p=p)
    kept = limits(robot, lower, upper, weights)
    middle, half, counted = (kept.lower + kept.upper) / 2, (kept.upper - kept.lower) / 2, list(kept.joints)
    known = KINK * UNIT * (np.abs(kept.lower) + np.abs(kept.upper))  # what rounding leaves of mid-range

    def smooth(robot: Robot, q: Array) -> None:
        bad = (np.abs(q[..., counted] - middle) <= known).all(axis=-1, keepdims=True)
        if bad.any():
            index = check.first(bad[..., 0])
            raise NotDifferentiableError(
                f"every joint of {configuration(index)} is at mid-range: the p-norm has no gradient there; "
                "use the quadratic measure",
                index=index, distance=float(np.abs((q[index][counted] - middle) / half).max()),
            )  # fmt: skip

    return symbolic(
        *P_NORM[:4], _p_norm, constants=(kept.joints, p), parameters=(kept.lower, kept.upper, kept.weights),
        domain=P_NORM.domain, smooth=smooth,
    )  # fmt: skip


def barrier(robot: Robot, *, lower: Any = None, upper: Any = None, weights: Any = None) -> Measure:
    """Measure f = sum w_i (upper_i - lower_i)^2 / (4 (upper_i - q_i)(q_i - lower_i)): w_i at mid-range, infinite at the limits.

    Refuses configurations at or beyond a limit (OutsideDomainError); arguments and other refusals as `limits`.
    """
    kept = limits(robot, lower, upper, weights)
    counted = list(kept.joints)

    def guard(robot: Robot, q: Array) -> None:
        bad = ~((q[..., counted] > kept.lower) & (q[..., counted] < kept.upper))
        if bad.any():
            *where, place = check.first(bad)
            index = tuple(where)
            joint, low, high = kept.joints[place] + 1, kept.lower[place], kept.upper[place]
            value = float(q[index][joint - 1])
            raise OutsideDomainError(
                f"joint {joint} of {configuration(index)} is at {value:.17g}, not between its limits {low:.17g} and "
                f"{high:.17g}: the barrier is infinite there; start inside, or use the quadratic measure",
                index=index, joint=joint, value=value, lower=float(low), upper=float(high),
            )  # fmt: skip

    return symbolic(
        *BARRIER[:4], _barrier, constants=(kept.joints,), parameters=(kept.lower, kept.upper, kept.weights),
        domain=BARRIER.domain, guard=guard,
    )  # fmt: skip


def _share(twin: Twin, joints: tuple[int, ...], lower: Symbol, upper: Symbol) -> Symbol:
    return (twin.q[list(joints)] - (lower + upper) / 2) / ((upper - lower) / 2)


def _quadratic(twin: Twin, joints: tuple[int, ...], lower: Symbol, upper: Symbol, weights: Symbol) -> Symbol:
    return ca.dot(weights, _share(twin, joints, lower, upper) ** 2) / twin.robot.n


def _p_norm(twin: Twin, joints: tuple[int, ...], p: int, lower: Symbol, upper: Symbol, weights: Symbol) -> Symbol:
    return ca.dot(weights, (_share(twin, joints, lower, upper) ** 2) ** (p // 2)) ** (1 / p)


def _barrier(twin: Twin, joints: tuple[int, ...], lower: Symbol, upper: Symbol, weights: Symbol) -> Symbol:
    q = twin.q[list(joints)]
    return ca.dot(weights, (upper - lower) ** 2 / ((upper - q) * (q - lower))) / 4
