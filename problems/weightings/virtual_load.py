"""The kinetic energy of virtual bodies carried by the arm, as a weight."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cache
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from problems.robots.robot import Robot
from problems.robots.twin import Symbol, twin
from sandbox import check
from sandbox.errors import RangeError, ShapeError
from sandbox.parameters import number, told
from sandbox.tolerances import SYMMETRY
from sandbox.weight import Weight

Array = np.ndarray


class LoadError(RangeError):
    """No body has such a mass or inertia."""


class VirtualBody(NamedTuple):
    """A body on the link of `joint` (1..n): mass [kg], centre (3,) [m], inertia (3, 3) about it [kg m^2], in joint axes."""

    joint: int
    mass: float
    centre: Any = (0.0, 0.0, 0.0)
    inertia: Any = np.zeros((3, 3))


BALL_MASS, BALL_RADIUS = 1.0, 0.25
"""[kg], [m]"""


def balls(robot: Robot) -> tuple[VirtualBody, ...]:
    """A solid ball (1 kg, radius 0.25 m) at the origin of every joint: any motion of any joint moves one."""
    about_centre = 2 / 5 * BALL_MASS * BALL_RADIUS**2 * np.eye(3)
    return tuple(VirtualBody(joint, BALL_MASS, np.zeros(3), about_centre) for joint in robot.joints)


def hand_load(robot: Robot, mass: float, inertia: Any = np.zeros((3, 3))) -> VirtualBody:
    """A body whose centre is the hand's origin."""
    frame = robot.model.frames[robot.frame(robot.hand)]
    return VirtualBody(int(frame.parentJoint), mass, np.array(frame.placement.translation), inertia)


def virtual_load(robot: Robot, q: Array, bodies: Sequence[Any] | None = None) -> Weight:
    """W = K_p = sum_b J_b' M_b J_b, M_b = blkdiag(m_b I, I_b); `bodies` as VirtualBody has them, `balls` if left out.

    Kept factored: K_p = E'E, E the triangular factor of the stacked M_b^1/2 J_b, which is never squared. Positive
    semidefinite; definite if the stack has full column rank.

    Raises LoadError for a negative mass, or an inertia that is not positive semidefinite or breaks the triangle
    inequality of its principal moments; RangeError for a joint outside 1..n, AsymmetricWeightError.

    Source: methods M17 (the paper's reference is not identified).
    """
    given = balls(robot) if bodies is None else _given(bodies)
    if not given:
        raise LoadError("no virtual body is given: K_p would be zero")
    numbers = [_checked(robot, body) for body in given]
    rows = _rows(robot, tuple(body.joint for body in given))
    (stacked,) = rows(q, np.concatenate(numbers))
    E = np.asarray(np.linalg.qr(stacked, mode="r"))
    *lead, rank, n = E.shape
    return Weight(np.broadcast_to(np.zeros((n, n)), (*lead, n, n)), E, np.broadcast_to(np.eye(rank), (*lead, rank, rank)))


def _given(bodies: Any) -> tuple[VirtualBody, ...]:
    """`bodies` as VirtualBody, their joints as Python's numbers; ShapeError for what is no sequence of such rows."""
    if isinstance(bodies, str) or not isinstance(bodies, Iterable):
        raise ShapeError(f"bodies is {told(bodies)}; give (joint, mass, centre, inertia) for each", field="bodies")
    found = []
    for i, row in enumerate(bodies):
        try:
            body = VirtualBody(*row)
        except TypeError:
            raise ShapeError(f"bodies[{i}] is {told(row)}; give (joint, mass, centre, inertia)", index=i) from None
        integral = isinstance(body.joint, int | np.integer) and not isinstance(body.joint, bool)
        found.append(body._replace(joint=int(body.joint)) if integral else body)
    return tuple(found)


def _checked(robot: Robot, body: VirtualBody) -> Array:
    """sqrt(m), centre and S with I_b = S'S of one body, in one row (13,)."""
    if type(body.joint) is not int or body.joint not in robot.joints:
        raise RangeError(
            f"joint {told(body.joint)} of a virtual body is not one of 1..{robot.n} of {robot.name}", joint=body.joint
        )
    mass = number(body.mass, "mass of a virtual body")
    centre, about_centre = check.real(body.centre, "centre"), check.real(body.inertia, "inertia")
    for name, values, shape in (("centre", centre, (3,)), ("inertia", about_centre, (3, 3))):
        if values.shape != shape:
            raise ShapeError(f"the {name} of a virtual body has shape {values.shape}; it must be {shape}", shape=values.shape)
    moments, axes = np.linalg.eigh(check.symmetric(about_centre, "inertia"))
    if mass < 0:
        raise LoadError(f"the virtual body on joint {body.joint} has a mass of {mass:g} kg: none is negative", value=mass)
    rounding = SYMMETRY * np.abs(moments).max()
    if moments[0] < -rounding or moments[0] + moments[1] < moments[2] - rounding:
        raise LoadError(
            f"the virtual body on joint {body.joint} has principal moments {moments.tolist()} kg m^2: none may be negative, "
            "and none larger than the sum of the other two",
            joint=body.joint, moments=moments,
        )  # fmt: skip
    S = np.sqrt(np.maximum(moments, 0.0))[:, None] * axes.T
    return np.concatenate([[np.sqrt(mass)], centre, S.ravel()])


@cache
def _rows(robot: Robot, joints: tuple[int, ...]) -> Callable[..., tuple[Array, ...]]:
    """M_b^1/2 J_b of bodies on these joints, stacked: a function of q (..., n) and the numbers (13 b,) of `_checked`."""
    symbols, blocks = twin(robot), []
    numbers = ca.SX.sym("bodies", 13 * len(joints))
    for joint, body in zip(joints, ca.vertsplit(numbers, 13), strict=True):
        R = symbols.link(joint)
        centre = symbols.point(joint) + R @ body[1:4]
        S = ca.reshape(body[4:], 3, 3).T  # CasADi fills columns first
        blocks += [body[0] * ca.jacobian(centre, symbols.q), S @ R.T @ _turning(robot, joint)]
    return symbols.evaluator(ca.vertcat(*blocks), parameters=[numbers], axes=[2])


def _turning(robot: Robot, joint: int) -> Symbol:
    """Angular velocity (3, n) of the link of `joint` per joint rate, base axes."""
    J = ca.SX.zeros(3, robot.n)
    for i in robot.model.supports[joint]:
        if i > 0 and not robot.prismatic[i - 1]:
            J[:, robot.model.joints[i].idx_v] = twin(robot).axis(i)
    return J
