"""Repulsive potential of an obstacle (methods M7)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np

from problems.measures.measure import Card, Measure, OutsideDomainError, compiled, symbolic
from problems.robots.robot import Robot
from problems.robots.twin import Symbol, Twin
from sandbox import check
from sandbox.errors import RangeError, ShapeError
from sandbox.parameters import configuration, number, told, vectors, whole, within
from sandbox.tolerances import KINK, UNIT

Array = np.ndarray

Point = tuple[int, tuple[float, float, float]]
"""Joint 1..n whose link carries the point, and where it stands in that joint's axes [m]."""

OBSTACLE = Card(
    "obstacle_potential", "J", "elastic potential of the nearest critical point's approach to an obstacle", "methods M7",
    "off contact; piecewise smooth where the nearest critical point switches",
)  # fmt: skip

STIFFNESS = 100.0
"""k [N/m]."""


class ContactError(OutsideDomainError):
    """The arm touches the obstacle: the direction away from it is undefined."""


def obstacle_potential(
    robot: Robot, *, obstacle: Any, reach: float, stiffness: float = STIFFNESS, points: Sequence[Any] | None = None
) -> Measure:
    """Measure f = 1/2 k (d0 - d)^2 [J] where d < d0, else 0; d the distance from the obstacle to the nearest critical point.

    obstacle : (3,) [m], or (B, 3), one per configuration
    reach : d0 [m], how far the obstacle is felt; stiffness : k [N/m]
    points : critical points fixed to links, see `critical_points`

    f is continuous with its gradient at d = d0. Where the nearest point switches it is only piecewise so: at a tie the
    gradient is that of the first of the nearest; `nearest` tells how close the next one is.

    Raises ContactError where d <= 0 by rounding, RangeError for d0 <= 0, k <= 0 or a point on no joint of the arm.
    """
    chosen = critical_points(robot, points)
    obstacle = place(obstacle)
    d0, k = number(reach, "reach", above=0), number(stiffness, "stiffness", above=0)

    def guard(robot: Robot, q: Array) -> None:
        distances(robot, q, obstacle, chosen)

    return symbolic(
        *OBSTACLE[:4], _potential, constants=(chosen,), parameters=(obstacle, *np.array([[d0], [k]])),
        domain=OBSTACLE.domain, guard=guard,
    )  # fmt: skip


def critical_points(robot: Robot, points: Sequence[Any] | None = None) -> tuple[Point, ...]:
    """Critical points: pairs (joint 1..n, (x, y, z) [m] in its axes); the inner ends of the links if left out.

    Raises RangeError for a joint that the arm does not have, ShapeError for a point that is no such pair.
    """
    if points is None:
        return inner_ends(robot)
    if isinstance(points, str) or not isinstance(points, Iterable):
        raise ShapeError(f"points is {told(points)}; give pairs (joint, (x, y, z))", field="points")
    chosen = []
    for row, point in enumerate(points):
        try:
            given, offset = point
        except (TypeError, ValueError):
            raise ShapeError(f"points[{row}] is {told(point)}; give (joint, (x, y, z))", index=row) from None
        where = check.real(offset, f"points[{row}]")
        if where.shape != (3,):
            raise ShapeError(f"the offset of points[{row}] has shape {where.shape}; it must be (3,)", index=row)
        try:
            joint = whole(given, f"the joint of points[{row}]", 1, robot.n)
        except RangeError:
            raise RangeError(
                f"points[{row}] is fixed to joint {told(given)}, which is not on the arm: {robot.name} has joints 1..{robot.n}",
                joint=given, index=row,
            ) from None  # fmt: skip
        chosen.append((joint, (float(where[0]), float(where[1]), float(where[2]))))
    if not chosen:
        raise ShapeError("points is empty; give at least one critical point")
    return tuple(chosen)


@cache
def inner_ends(robot: Robot) -> tuple[Point, ...]:
    """The ends of the links between base and hand that move: where the next joint of the chain stands."""
    model = robot.model
    chain = [int(i) for i in model.supports[model.frames[robot.frame(robot.hand)].parentJoint] if i]
    q = np.sin(1.0 + np.arange(robot.n))  # not special
    ends = []
    for joint, following in pairwise(chain):
        offset = model.jointPlacements[following].translation
        moves = np.abs(robot.point_jacobian(q, joint, offset)[:3]).max() > KINK * robot.n * UNIT * _length(robot)
        if moves and np.linalg.norm(offset) > 0:  # or else it is the end before
            ends.append((joint, (float(offset[0]), float(offset[1]), float(offset[2]))))
    if not ends:
        raise ShapeError(f"{robot.name} has no link between base and hand that moves; give the critical points")
    return tuple(ends)


def place(obstacle: Any) -> Array:
    """An obstacle's place (3,) or (B, 3) [m], checked."""
    return vectors(obstacle, "obstacle", 3, letter="3")


def distances(robot: Robot, q: Array, obstacle: Any, points: Sequence[Any] | None = None) -> Array:
    """Distance (..., P) [m] of every critical point from the obstacle.

    Raises ContactError where one of them is 0 by rounding, naming configuration, joint and distance.
    """
    chosen, obstacle = critical_points(robot, points), place(obstacle)
    q = check.real(q, "q")
    within(q.shape[:-1], obstacle.shape[:-1], "obstacle")
    d = np.sqrt(compiled(_squares, (chosen,), (3,), robot)(q, obstacle)[0])
    d = d.reshape(*q.shape[:-1], len(chosen))
    size = KINK * robot.n * UNIT * (np.linalg.norm(obstacle, axis=-1) + _length(robot))
    bad = ~(d > np.asarray(size)[..., None])
    if bad.any():
        *where, point = check.first(bad)
        index, distance = tuple(where), float(d[tuple(where)][point])
        raise ContactError(
            f"the critical point on link {chosen[point][0]} of {robot.name} touches the obstacle at {configuration(index)} "
            f"(distance {distance:.3g} m): the direction away from it is undefined; start off contact",
            index=index, joint=chosen[point][0], distance=distance,
        )  # fmt: skip
    return d


def nearest(robot: Robot, q: Array, obstacle: Any, points: Sequence[Any] | None = None) -> tuple[Array, Array]:
    """Which critical point is nearest (...,), 0..P-1, and how much further the next one is (...,) [m], inf for a lone one."""
    d = distances(robot, q, obstacle, points)
    ordered = np.sort(d, axis=-1)
    gap = ordered[..., 1] - ordered[..., 0] if d.shape[-1] > 1 else np.full(d.shape[:-1], np.inf)
    return d.argmin(axis=-1), gap


def _length(robot: Robot) -> float:
    """Length of the arm stretched out [m], about."""
    model = robot.model
    hand = model.frames[robot.frame(robot.hand)]
    places = [model.jointPlacements[i] for i in model.supports[hand.parentJoint] if i]
    return float(sum(np.linalg.norm(p.translation) for p in [*places, hand.placement]))


def _squares(twin: Twin, points: tuple[Point, ...], obstacle: Symbol) -> Symbol:
    return ca.vertcat(*(ca.sumsqr(twin.point(joint, offset) - obstacle) for joint, offset in points))


def _potential(twin: Twin, points: tuple[Point, ...], obstacle: Symbol, d0: Symbol, k: Symbol) -> Symbol:
    squares = _squares(twin, points, obstacle)
    least = squares[0]
    for i in range(1, len(points)):
        least = ca.if_else(least <= squares[i], least, squares[i])  # fmin would average the gradients of a tie
    return k * ca.fmax(0, d0 - ca.sqrt(least)) ** 2 / 2
