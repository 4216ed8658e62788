"""Maciejewski and Klein's second task, points of the arm escaping from an obstacle, as a weight."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np

from problems.measures.measure import compiled
from problems.measures.obstacle import Point, critical_points, distances, place
from problems.robots.robot import Robot
from problems.robots.twin import Symbol, Twin
from problems.weightings.augmented import clear
from problems.weightings.definite import positive_definite
from problems.weightings.identity import one_unit
from sandbox import check
from sandbox.errors import ConditionSevenError
from sandbox.parameters import configuration, number, single
from sandbox.tolerances import RANK, UNIT
from sandbox.weight import Weight

Array = np.ndarray


class NotControlledError(ConditionSevenError):
    """Some self-motion changes none of the distances: rank(Jd N) < n - m."""


def escape_rows(robot: Robot, q: Array, obstacle: Any, points: Sequence[Any]) -> Array:
    """Jd (..., p, n) [m/rad, m/m], row i the derivative u_i'Jc_i of point i's distance from the obstacle.

    obstacle : (3,) or (..., 3) [m], base axes; points : pairs (joint 1..n, (x, y, z) [m] in its axes)

    Raises ContactError where a distance is zero by rounding, RangeError for a point on no joint of the arm.
    """
    chosen, obstacle = critical_points(robot, points), place(obstacle)
    distances(robot, q, obstacle, chosen)  # refuses contact
    return np.stack([compiled(_distance, (point,), (3,), robot, 1)(q, obstacle)[0] for point in chosen], axis=-2)


def _distance(twin: Twin, point: Point, obstacle: Symbol) -> Symbol:
    return ca.norm_2(twin.point(*point) - obstacle)


def two_task(robot: Robot, q: Array, Jd: Array, Qd: Any = None, *, eps: float = 0.0) -> Weight:
    """W = Jd'Qd Jd + eps I (..., n, n), kept factored; Jd (..., p, n), Qd (p, p) or (p,) positive definite, I if left out.

    eps : lets self-motion that Jd does not control rest; Maciejewski and Klein's law is the limit eps -> 0, O(eps) away

    Raises NotControlledError where rank(Jd N) < n - m and eps = 0 (condition (7) fails), RangeError for eps < 0,
    WeightNotPositiveDefiniteError for Qd, RankDeficientError where J has lost rank and eps = 0, MixedUnitsError for eps I
    of revolute beside prismatic joints.

    Source: A. A. Maciejewski, C. A. Klein, IJRR 4(3), 1985; methods M8.
    """
    *lead, p, n = Jd.shape
    eps = number(eps, "eps", least=0)
    Qd = positive_definite(1.0 if Qd is None else Qd, "Qd", p, "every row of the second task must count")
    Qd = single(Qd, "Qd", p)
    if eps == 0:
        _controlled(robot, q, Jd)
    else:
        one_unit(robot, "choose points whose distances self-motion changes, so that eps = 0 will do")
    return Weight(np.broadcast_to(eps * np.eye(n), (*lead, n, n)), Jd, np.broadcast_to(Qd, (*lead, p, p)))


def _controlled(robot: Robot, q: Array, Jd: Array) -> None:
    """Refuse configurations where the rows Jd do not determine the self-motion."""
    p, k = Jd.shape[-2], robot.k
    least, condition = clear(robot, q, Jd) if p and k else (np.ones(np.shape(q)[:-1]), 1.0)
    lost = ~(least > RANK * robot.n * UNIT * condition) | (p < k)
    if lost.any():
        index = check.first(lost)
        value = 0.0 if p < k else float(least[index])
        raise NotControlledError(
            f"the second task (p = {p} rows) does not fix the self-motion (n - m = {k}) of {robot.name} at "
            f"{configuration(index)}: the least singular value of Jd N is {value:.3g} of |Jd|, so N'WN is singular; "
            "give eps > 0, or points whose distances self-motion changes",
            index=index, sigma_min=value, rows=p, redundancy=k,
        )  # fmt: skip
