"""Inverse dynamics and inertia matrix of a serial arm as plain scalar loops, on any kind of number.

Numbers run both beside pinocchio; on CasADi's symbols zeros and ones of a robot's constants drop out, as they do in
generated code, so that what is left can be counted. Vectors and matrices are lists, in the axes of the link they belong to;
the axis of every joint is turned to z beforehand.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from problems.robots.robot import Robot
from sandbox.errors import ShapeError
from sandbox.tolerances import QUARTER_TURN

Vector = list[Any]
Matrix = list[list[Any]]


@dataclass(frozen=True, eq=False)
class Link:
    """One link: turned by R (3, 3) about its parent, its joint at p (3,) [m] in the parent's axes; then the joint, about z.

    mass [kg]; first = mass times centre (3,) [kg m]; second (3, 3) [kg m^2] inertia about the joint's origin; rotor [kg m^2]
    """

    R: Matrix
    p: Vector
    mass: float
    first: Vector
    second: Matrix
    rotor: float


def chain(robot: Robot) -> list[Link]:
    """The links of a serial arm with revolute joints.

    Raises ShapeError for a tree or a prismatic joint: pinocchio has those.
    """
    model = robot.model
    if robot.prismatic.any() or any(model.parents[i] != i - 1 for i in robot.joints):
        raise ShapeError(f"{robot.name} is no serial arm of revolute joints; use problems.implicit.inertia")
    links, before = [], np.eye(3)  # `before` turns the parent's z-axes to pinocchio's
    for i in robot.joints:
        motion = model.joints[i].createData()
        model.joints[i].calc(motion, np.zeros(model.nq))
        turn = _to_z(np.array(motion.S).ravel()[3:])
        place, body = model.jointPlacements[i], model.inertias[i]
        centre = turn.T @ body.lever
        mass = float(body.mass)
        cross = np.cross(np.eye(3), centre)  # its square is the same for either sign
        second = turn.T @ body.inertia @ turn - mass * cross @ cross
        R, p = before.T @ place.rotation @ turn, before.T @ place.translation
        parts = (_clean(v).tolist() for v in (R, p, mass * centre, (second + second.T) / 2))
        R, p, first, second = parts
        links.append(Link(R, p, mass, first, second, float(model.armature[model.joints[i].idx_v])))
        before = turn
    return links


def newton_euler(links: list[Link], cosines: Vector, sines: Vector, qddot: Vector) -> Vector:
    """Torques M qddot of the arm at rest without gravity: one row of N'M for a column of N.

    Source: Luh, Walker and Paul's recursion with qdot = 0, in link axes.
    """
    n = len(links)
    turning: Vector = [0.0, 0.0, 0.0]
    moving: Vector = [0.0, 0.0, 0.0]
    forces, moments = [], []
    for i, link in enumerate(links):
        c, s = cosines[i], sines[i]
        moving = _into(link, c, s, _plus(moving, _cross(turning, link.p)))
        turning = _into(link, c, s, turning)
        turning = [turning[0], turning[1], turning[2] + qddot[i]]
        forces.append(_plus(_times(link.mass, moving), _cross(turning, link.first)))
        moments.append(_plus(_apply(link.second, turning), _cross(link.first, moving)))
    torques: Vector = [0.0] * n
    for i in range(n - 1, -1, -1):
        link = links[i]
        torques[i] = moments[i][2] + link.rotor * qddot[i]
        if i:
            force, moment = _onto_parent(link, cosines[i], sines[i], forces[i], moments[i])
            forces[i - 1] = _plus(forces[i - 1], force)
            moments[i - 1] = _plus(moments[i - 1], moment)
    return torques


def composite(links: list[Link], cosines: Vector, sines: Vector) -> Matrix:
    """Inertia matrix M, both triangles.

    Source: Walker and Orin's composite-rigid-body recursion, in link axes.
    """
    n = len(links)
    M: Matrix = [[0.0] * n for _ in range(n)]
    mass, first, second = [x.mass for x in links], [x.first for x in links], [x.second for x in links]
    for i in range(n - 1, -1, -1):
        c, s = cosines[i], sines[i]
        M[i][i] = second[i][2][2] + links[i].rotor
        force: Vector = [-first[i][1], first[i][0], 0.0]  # z x first: joint i alone accelerates, by one
        moment: Vector = [second[i][0][2], second[i][1][2], second[i][2][2]]
        for j in range(i, 0, -1):
            force, moment = _onto_parent(links[j], cosines[j], sines[j], force, moment)
            M[i][j - 1] = M[j - 1][i] = moment[2]
        if i:
            h, about = _moved(links[i], c, s, mass[i], first[i], second[i])
            mass[i - 1] = mass[i - 1] + mass[i]
            first[i - 1] = _plus(first[i - 1], h)
            second[i - 1] = [_plus(a, b) for a, b in zip(second[i - 1], about, strict=True)]
    return M


def _moved(link: Link, c: Any, s: Any, mass: Any, first: Vector, second: Matrix) -> tuple[Vector, Matrix]:
    """First and second moment of a body in `link`'s axes, about and in the axes of its parent."""
    h = _out_of(link, c, s, first)
    half = [_out_of(link, c, s, [second[r][k] for r in range(3)]) for k in range(3)]  # columns of R I
    columns = [[half[k][r] for k in range(3)] for r in range(3)]  # rows of R I
    turned = [_out_of(link, c, s, columns[r]) for r in range(3)]  # rows of R I R'
    p = link.p
    g = [h[i] + (0.5 * mass) * p[i] for i in range(3)]  # sum of m (d + p)(d + p)' = ... + g p' + p g'
    outer = [[g[i] * p[j] for j in range(3)] for i in range(3)]
    trace = 2 * (outer[0][0] + outer[1][1] + outer[2][2])
    about: Matrix = [[0.0] * 3 for _ in range(3)]
    for i in range(3):
        for j in range(i, 3):
            both = outer[i][j] + outer[j][i]
            about[i][j] = about[j][i] = turned[i][j] - both + (trace if i == j else 0.0)
    return _plus(h, _times(mass, p)), about


def _onto_parent(link: Link, c: Any, s: Any, force: Vector, moment: Vector) -> tuple[Vector, Vector]:
    force, moment = _out_of(link, c, s, force), _out_of(link, c, s, moment)
    return force, _plus(moment, _cross(link.p, force))


def _out_of(link: Link, c: Any, s: Any, v: Vector) -> Vector:
    """Vector v of link axes in the parent's."""
    return _apply(link.R, [c * v[0] - s * v[1], s * v[0] + c * v[1], v[2]])


def _into(link: Link, c: Any, s: Any, v: Vector) -> Vector:
    """Vector v of the parent's axes in the link's."""
    w = [link.R[0][k] * v[0] + link.R[1][k] * v[1] + link.R[2][k] * v[2] for k in range(3)]
    return [c * w[0] + s * w[1], c * w[1] - s * w[0], w[2]]


def _apply(A: Matrix, v: Vector) -> Vector:
    return [row[0] * v[0] + row[1] * v[1] + row[2] * v[2] for row in A]


def _cross(u: Vector, v: Vector) -> Vector:
    return [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]


def _plus(u: Vector, v: Vector) -> Vector:
    return [a + b for a, b in zip(u, v, strict=True)]


def _times(factor: Any, v: Vector) -> Vector:
    return [factor * a for a in v]


def _to_z(axis: np.ndarray) -> np.ndarray:
    """A rotation whose third column is the unit vector `axis`; the identity for z."""
    if axis[2] > 1 - QUARTER_TURN:
        return np.eye(3)
    other = np.eye(3)[int(np.argmin(np.abs(axis)))]
    x = np.cross(other, axis)
    x = x / np.linalg.norm(x)
    return np.column_stack([x, np.cross(axis, x), axis])


def _clean(values: np.ndarray) -> np.ndarray:
    """Entries that are zero or one but for the rounding of a quarter turn made so: sine and cosine of pi/2 are not exact."""
    whole = np.round(values)
    return np.where(np.abs(values - whole) < QUARTER_TURN, whole + 0.0, values)
