"""The symbolic twin of a robot: the same model written in CasADi, for derivatives of anything that is made of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, cached_property
from typing import Any

import casadi as ca
import numpy as np

from problems.robots.robot import Robot
from sandbox import check

Array = np.ndarray
Symbol = Any
"""A casadi.SX."""


class Twin:
    """Expressions in the joint coordinates q (n, 1), built from the placements, axes and inertias of the robot's model.

    q : the symbols, one column; everything else is an expression of them.
    """

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.q = ca.SX.sym("q", robot.n)
        model = robot.model
        identity = ca.SX.eye(3)
        self._R, self._p = [identity], [ca.SX.zeros(3)]  # of joint i, base axes; 0 is the base
        self._axis: list[Symbol] = [ca.SX.zeros(3)]
        for i in robot.joints:
            parent, place = model.parents[i], model.jointPlacements[i]
            R = self._R[parent] @ _constant(place.rotation)
            p = self._p[parent] + self._R[parent] @ _constant(place.translation)
            axis, coordinate = _constant(robot.axes[i - 1]), self.q[model.joints[i].idx_q]
            if robot.prismatic[i - 1]:
                p = p + R @ axis * coordinate
            else:
                R = R @ _turn(robot.axes[i - 1], coordinate)
            self._R.append(R)
            self._p.append(p)
            self._axis.append(R @ axis)

    @cached_property
    def position(self) -> Symbol:
        """Position (3, 1) [m] of the hand."""
        return self._hand[1]

    @cached_property
    def rotation(self) -> Symbol:
        """Rotation (3, 3) of the hand."""
        return self._hand[0]

    @cached_property
    def geometric(self) -> Symbol:
        """All six rows of the hand's Jacobian (6, n), base axes."""
        return self._columns(self.robot.model.frames[self.robot.frame(self.robot.hand)].parentJoint, self.position)

    @cached_property
    def jacobian(self) -> Symbol:
        """J (m, n) of the robot's task rows."""
        return self.geometric[list(self.robot.rows), :]

    @cached_property
    def inertia(self) -> Symbol:
        """Inertia matrix M (n, n): the sum over bodies of J_b' M_b J_b, and the rotors."""
        M = ca.diag(_constant(np.asarray(self.robot.model.armature)))
        for joint, mass, centre, about_centre in self.robot.bodies():
            J = self._columns(joint, self.point(joint, centre))
            turned = self._R[joint] @ _constant(about_centre) @ self._R[joint].T
            M = M + mass * J[:3, :].T @ J[:3, :] + J[3:, :].T @ turned @ J[3:, :]
        return M

    @cached_property
    def potential(self) -> Symbol:
        """Potential energy [J] of gravity, zero with every centre at the base."""
        gravity = _constant(np.asarray(self.robot.model.gravity.linear))
        return -sum(mass * ca.dot(gravity, self.point(joint, centre)) for joint, mass, centre, _ in self.robot.bodies())

    @cached_property
    def gravity_torque(self) -> Symbol:
        """tau_g (n, 1) [Nm, N], the gradient of the potential energy."""
        return ca.gradient(self.potential, self.q)

    def point(self, joint: int, offset: Sequence[float] | Array = (0.0, 0.0, 0.0)) -> Symbol:
        """Position (3, 1) [m] of a point fixed to the link of `joint`, 0 the base, at `offset` (3,) [m] in its axes."""
        return self._p[joint] + self._R[joint] @ _constant(np.asarray(offset, dtype=float))

    def axis(self, joint: int) -> Symbol:
        """Axis (3, 1) of a joint (1..n), base axes."""
        return self._axis[joint]

    def link(self, joint: int) -> Symbol:
        """Rotation (3, 3) of the link of a joint (1..n), base axes."""
        return self._R[joint]

    def evaluator(
        self, *expressions: Symbol, parameters: Sequence[Symbol] = (), axes: Sequence[int] | None = None
    ) -> Callable[..., tuple[Array, ...]]:
        """A function of q (..., n), and of one (..., p) per column of symbols in `parameters`, that gives numbers.

        They are stacked as q is: (...), (..., r) or (..., r, c), one array per expression. `axes` says how many of r and c
        each has; left out, those larger than one, so say it where n or m may be 1.
        """
        kept = [2 if e.shape[1] > 1 else int(e.shape[0] > 1) for e in expressions] if axes is None else axes
        shapes = [e.shape[:count] for e, count in zip(expressions, kept, strict=True)]
        sizes = [e.numel() for e in expressions]
        column = ca.densify(ca.vertcat(*(ca.vec(e.T) for e in expressions)))
        # one column in, one out, straight from and to numpy's memory: CasADi's own conversions cost more than the numbers
        compiled = ca.Function("f", [ca.vertcat(self.q, *parameters)], [column], {"cse": True})

        def evaluate(q: Any, *values: Any) -> tuple[Array, ...]:
            q = check.real(q, "q")
            check.shape(q, ("n",), {"n": self.robot.n}, "q")
            lead = q.shape[:-1]
            given = [q, *(np.broadcast_to(value, (*lead, np.shape(value)[-1])) for value in values)]
            rows = np.ascontiguousarray(np.concatenate(given, axis=-1, dtype=np.float64).reshape(-1, compiled.nnz_in(0)))
            results = np.empty((len(rows), sum(sizes)))
            buffer: Any
            buffer, run = compiled.buffer()
            for row, result in zip(rows, results, strict=True):
                buffer.set_arg(0, row.data)
                buffer.set_res(0, result.data)
                run()
            parts = np.split(results, np.cumsum(sizes)[:-1], axis=-1)
            return tuple(part.reshape((*lead, *shape)) for part, shape in zip(parts, shapes, strict=True))

        return evaluate

    @cached_property
    def _hand(self) -> tuple[Symbol, Symbol]:
        frame = self.robot.model.frames[self.robot.frame(self.robot.hand)]
        place = frame.placement
        R = self._R[frame.parentJoint]
        return R @ _constant(place.rotation), self._p[frame.parentJoint] + R @ _constant(place.translation)

    def _columns(self, joint: int, at: Symbol) -> Symbol:
        """Jacobian (6, n) of a point `at` moving with the link of `joint`."""
        model, J = self.robot.model, ca.SX.zeros(6, self.robot.n)
        for i in model.supports[joint]:
            if i == 0:
                continue
            axis, column = self._axis[i], model.joints[i].idx_v
            if self.robot.prismatic[i - 1]:
                J[:3, column] = axis
            else:
                J[:3, column], J[3:, column] = ca.cross(axis, at - self._p[i]), axis
        return J


@cache
def _twin(robot: Robot) -> Twin:
    return Twin(robot)


def twin(robot: Robot) -> Twin:
    """The twin of `robot`, built once."""
    return _twin(robot)


def _constant(values: Array) -> Symbol:
    """Numbers as an expression; zeros stay structural, so that they cost nothing."""
    return ca.SX(ca.sparsify(ca.DM(np.array(values, dtype=float))))


def _turn(axis: Array, angle: Symbol) -> Symbol:
    """Rotation (3, 3) by `angle` about a unit axis (Rodrigues)."""
    cross, outer = np.cross(np.eye(3), axis), np.outer(axis, axis)
    return _constant(outer) + ca.cos(angle) * _constant(np.eye(3) - outer) + ca.sin(angle) * _constant(cross)
