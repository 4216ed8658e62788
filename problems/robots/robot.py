"""A robot: a serial mechanism, its hand and the task rows that are asked of it; numbers by pinocchio, stacked over q."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import pinocchio as pin

from sandbox import check
from sandbox.errors import RangeError, ShapeError, UnknownNameError
from sandbox.parameters import chosen, text, told

Array = np.ndarray

TASKS = {
    "position": (0, 1, 2),
    "pose": (0, 1, 2, 3, 4, 5),
    "orientation": (3, 4, 5),
    "planar": (0, 1),
    "planar pose": (0, 1, 5),
}
"""Named choices of task rows, of (vx, vy, vz, wx, wy, wz): the hand's velocity in the axes of the base."""

AXES = pin.LOCAL_WORLD_ALIGNED

LARGEST = np.finfo(np.float64).max

SLIDES = {
    **dict.fromkeys(("JointModelRX", "JointModelRY", "JointModelRZ", "JointModelRevoluteUnaligned"), False),
    **dict.fromkeys(("JointModelPX", "JointModelPY", "JointModelPZ", "JointModelPrismaticUnaligned"), True),
}
"""Pinocchio's joints of one coordinate that are supported, and whether they slide."""


class _Workspace(threading.local):
    """Where pinocchio computes: one per thread, made when a thread first asks."""

    def __init__(self, model: pin.Model) -> None:
        self.data = model.createData()


@dataclass(frozen=True, eq=False)
class Robot:
    """n joints q [rad, m], one hand, m task rows; q is (..., n) everywhere and the results are stacked alike.

    It can be pickled, and threads may share it.

    name : how records call it
    model : pinocchio's model; every joint turns or slides by one coordinate
    hand : frame whose velocity is the task
    rows : which of (vx, vy, vz, wx, wy, wz) [m/s, rad/s], base axes, are the task
    about : what it is, and the source of its parameters

    Raises
    ------
    UnknownNameError
        for a hand that is no frame; lists those there are
    ShapeError
        for a joint that does not turn or slide by one coordinate, or no joint at all
    RangeError
        for task rows outside 0..5 or twice, a joint without an axis or without room to move, a negative or non-finite mass
    """

    name: str
    model: pin.Model = field(repr=False)
    hand: str
    rows: tuple[int, ...] = TASKS["pose"]
    about: str = field(default="", repr=False)
    _workspace: _Workspace = field(init=False, repr=False)
    _siblings: dict[tuple[int, ...], Robot] = field(init=False, repr=False, default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "rows", _rows(self.rows))
        text(self.name, "the name of a robot")
        if not self.n:
            raise ShapeError(f"{self.name} has no joint that moves")
        for i in self.joints:
            kind = self.model.joints[i].shortname()
            if kind not in SLIDES:
                raise ShapeError(
                    f"joint {self.model.names[i]!r} of {self.name} is a {kind}: only joints that turn or slide by one "
                    "coordinate are supported; lock it, or model it as one of these",
                    joint=self.model.names[i],
                )
        straight = np.linalg.norm(self.axes, axis=-1)
        for i, mass, centre, about_centre in self.bodies():
            if not straight[i - 1] > 0:
                raise RangeError(f"joint {self.model.names[i]!r} of {self.name} has no axis", joint=self.model.names[i])
            if not self.lower[i - 1] < self.upper[i - 1]:
                told = f"joint {self.model.names[i]!r} of {self.name} has lower limit {self.lower[i - 1]:g}"
                raise RangeError(
                    f"{told}, upper limit {self.upper[i - 1]:g}: lower < upper, -inf and inf where there is none", joint=i
                )
            if not (0 <= mass < np.inf and np.isfinite(centre).all() and np.isfinite(about_centre).all()):
                told = f"the link of joint {self.model.names[i]!r} of {self.name}"
                raise RangeError(f"{told} has mass {mass:g}: masses are at least 0, and inertias finite", joint=i, value=mass)
        self.frame(self.hand)
        object.__setattr__(self, "_workspace", _Workspace(self.model))
        self._siblings[self.rows] = self

    def __reduce__(self) -> tuple[Any, ...]:
        return Robot, (self.name, self.model, self.hand, self.rows, self.about)

    @property
    def n(self) -> int:
        """Number of joints."""
        return int(self.model.nv)

    @property
    def m(self) -> int:
        """Number of task rows."""
        return len(self.rows)

    @property
    def k(self) -> int:
        """Degrees of redundancy, n - m."""
        return self.n - self.m

    @property
    def lower(self) -> Array:
        """Lower joint limits (n,) [rad, m]; -inf where there is none."""
        return _open(self.model.lowerPositionLimit)

    @property
    def upper(self) -> Array:
        """Upper joint limits (n,) [rad, m]; inf where there is none."""
        return _open(self.model.upperPositionLimit)

    @property
    def rate_limits(self) -> Array:
        """Largest joint rates (n,) [rad/s, m/s]; inf where there is none."""
        return _open(self.model.velocityLimit)

    @property
    def joints(self) -> range:
        """Pinocchio's numbers of the joints, 1..n."""
        return range(1, self.model.njoints)

    @cached_property
    def prismatic(self) -> Array:
        """Which joints slide (n,) bool."""
        slides = np.array([SLIDES[self.model.joints[i].shortname()] for i in self.joints])
        slides.setflags(write=False)
        return slides

    @cached_property
    def axes(self) -> Array:
        """Axis (n, 3) of every joint, in its own axes, of length one."""
        return check.frozen([self._axis(i) for i in self.joints])

    def task(self, rows: str | Iterable[int]) -> Robot:
        """The same robot asked for other task rows, by a name in TASKS or by number; asked again, the same object.

        Raises UnknownNameError for a name that is none, RangeError for a row outside 0..5 or twice.
        """
        wanted = _rows(rows)
        if wanted not in self._siblings:
            sibling = replace(self, rows=wanted)
            object.__setattr__(sibling, "_siblings", self._siblings)
            self._siblings.setdefault(wanted, sibling)
        return self._siblings[wanted]

    def forward(self, q: Any) -> tuple[Array, Array]:
        """Position (..., 3) [m] and rotation (..., 3, 3) of the hand."""

        def one(data: pin.Data, q: Array) -> Array:
            pin.forwardKinematics(self.model, data, q)
            return pin.updateFramePlacement(self.model, data, frame).homogeneous[:3]

        frame = self.frame(self.hand)
        both = self._each(one, (3, 4), q)
        return both[..., 3], both[..., :3]

    def translating(self, velocity: Any) -> Array:
        """Task velocity (..., m) of a hand that moves at `velocity` (..., 3) [m/s], base axes, and does not turn."""
        velocity = np.asarray(velocity, dtype=float)
        return np.concatenate([velocity, np.zeros_like(velocity)], axis=-1)[..., self.rows]

    def jacobian(self, q: Any) -> Array:
        """J (..., m, n) of the task rows [m/rad, rad/rad, m/m]."""
        return self.geometric(q)[..., self.rows, :]

    def geometric(self, q: Any) -> Array:
        """All six rows of the hand's Jacobian (..., 6, n), base axes."""
        frame = self.frame(self.hand)
        return self._each(lambda data, q: pin.computeFrameJacobian(self.model, data, q, frame, AXES), (6, self.n), q)

    def jacobian_derivative(self, q: Any) -> Array:
        """dJ/dq (..., n, m, n): [..., k, :, :] = dJ/dq_k of the task rows."""

        def one(data: pin.Data, q: Array) -> Array:
            pin.computeJointKinematicHessians(self.model, data, q)
            pin.updateFramePlacement(self.model, data, frame)
            # the binding hands out the column-major numbers of (6, n, n) under a row-major shape
            return pin.getFrameKinematicHessian(self.model, data, frame, AXES).reshape(self.n, self.n, 6)

        frame = self.frame(self.hand)
        hessian = self._each(one, (self.n, self.n, 6), q)  # [k, i, row] = dJ[row, i]/dq_k
        return np.swapaxes(hessian, -1, -2)[..., self.rows, :]

    def inertia(self, q: Any) -> Array:
        """Inertia matrix M (..., n, n) [kg m^2, kg m, kg], rotors included."""
        return self._each(lambda data, q: pin.crba(self.model, data, q), (self.n, self.n), q)

    def gravity_torque(self, q: Any) -> Array:
        """Joint torque tau_g (..., n) [Nm, N] that holds the robot at rest: the gradient of its potential energy."""
        return self._each(lambda data, q: pin.computeGeneralizedGravity(self.model, data, q), (self.n,), q)

    def gravity_torque_derivative(self, q: Any) -> Array:
        """Derivative of tau_g by q (..., n, n) [Nm/rad], symmetric."""
        return self._each(lambda data, q: pin.computeGeneralizedGravityDerivatives(self.model, data, q), (self.n, self.n), q)

    def inverse_dynamics(self, q: Any, qdot: Any, qddot: Any, *, gravity: bool = True) -> Array:
        """Torque (..., n) [Nm, N] by the recursive Newton-Euler algorithm: M qddot + C qdot (+ tau_g)."""
        model = self.model if gravity else self._weightless
        return self._each(lambda data, *x: pin.rnea(model, data, *x), (self.n,), q, qdot, qddot)

    def bodies(self) -> list[tuple[int, float, Array, Array]]:
        """Moving bodies: joint number, mass [kg], centre (3,) [m], inertia about it (3, 3) [kg m^2], in joint axes."""
        inertias = [(i, self.model.inertias[i]) for i in self.joints]
        return [(i, float(body.mass), np.array(body.lever), np.array(body.inertia)) for i, body in inertias]

    def point(self, q: Any, joint: int, offset: Any = (0.0, 0.0, 0.0)) -> Array:
        """Position (..., 3) [m] of a point fixed to the link of `joint` (1..n), `offset` (3,) [m] in that joint's axes.

        Raises RangeError for a joint there is not, ShapeError for an offset that is not (3,).
        """

        def one(data: pin.Data, q: Array) -> Array:
            pin.forwardKinematics(self.model, data, q)
            return data.oMi[number].act(place.translation)

        number, place = self._place(joint, offset)
        return self._each(one, (3,), q)

    def point_jacobian(self, q: Any, joint: int, offset: Any = (0.0, 0.0, 0.0)) -> Array:
        """Jacobian (..., 6, n), base axes, of such a point; columns of joints it does not ride on are zero."""

        def one(data: pin.Data, q: Array) -> Array:
            pin.computeJointJacobians(self.model, data, q)
            return pin.getFrameJacobian(self.model, data, number, place, AXES)

        number, place = self._place(joint, offset)
        return self._each(one, (6, self.n), q)

    def frame(self, name: str) -> int:
        """Pinocchio's number of a frame; that of a link where a joint goes by the same name.

        Raises UnknownNameError for a name that is none; lists those there are.
        """
        return frame(self.model, name, self.name)

    @cached_property
    def _weightless(self) -> pin.Model:
        model = pin.Model(self.model)
        model.gravity.linear = np.zeros(3)
        return model

    def _axis(self, joint: int) -> Array:
        motion = self.model.joints[joint].createData()
        self.model.joints[joint].calc(motion, np.zeros(self.model.nq))
        linear, angular = np.split(np.array(motion.S).ravel(), 2)
        return linear if SLIDES[self.model.joints[joint].shortname()] else angular

    def _place(self, joint: Any, offset: Any) -> tuple[int, pin.SE3]:
        """Number of a joint, and where a point stands in its axes."""
        if not (isinstance(joint, int | np.integer) and not isinstance(joint, bool) and joint in self.joints):
            raise RangeError(f"joint {told(joint)} is not one of 1..{self.n} of {self.name}", joint=joint)
        offset = check.real(offset, "offset")
        if offset.shape != (3,):
            raise ShapeError(f"offset has shape {offset.shape}; it must be (3,)", shape=offset.shape)
        return int(joint), pin.SE3(np.eye(3), offset)

    def _each(self, function: Callable[..., Array], shape: tuple[int, ...], *arguments: Any) -> Array:
        """`function(data, *row)` of every row of the stacked arguments (..., n)."""
        given = {name: check.real(values, name) for name, values in zip(("q", "qdot", "qddot"), arguments, strict=False)}
        for name, values in given.items():
            check.shape(values, ("n",), {"n": self.n}, name)
        lead = check.leading({name: values.shape[:-1] for name, values in given.items()})
        rows = [np.broadcast_to(values, (*lead, self.n)).reshape(-1, self.n) for values in given.values()]
        results = np.empty((len(rows[0]), *shape))
        data = self._workspace.data
        for i, row in enumerate(zip(*rows, strict=True)):
            answer = function(data, *row)
            results[i] = answer if self.n > 1 else np.reshape(answer, shape)  # the binding drops an axis of length one
        return results.reshape((*lead, *shape))


def frame(model: pin.Model, name: str, owner: str) -> int:
    """Pinocchio's number of a frame of `owner`, as Robot.frame."""
    if not isinstance(name, str):
        raise UnknownNameError.of(f"frame of {owner}", told(name), {frame.name for frame in model.frames})
    if model.existFrame(name, pin.FrameType.BODY):
        return int(model.getFrameId(name, pin.FrameType.BODY))
    if not model.existFrame(name):
        raise UnknownNameError.of(f"frame of {owner}", name, {frame.name for frame in model.frames})
    return int(model.getFrameId(name))


def _open(limits: Array) -> Array:
    """A copy, pinocchio's "no limit", the largest float, as infinity."""
    return np.where(np.abs(limits) < LARGEST, limits, np.copysign(np.inf, limits))


def _rows(rows: str | Iterable[int]) -> tuple[int, ...]:
    if isinstance(rows, str):
        return TASKS[chosen("task", rows, TASKS)]
    given = tuple(rows) if isinstance(rows, Iterable) and not isinstance(rows, bytes) else ()
    numbers = [row for row in given if isinstance(row, int | np.integer) and not isinstance(row, bool) and 0 <= row <= 5]
    if not given or len(set(numbers)) < len(given):
        raise RangeError(
            f"task rows {told(rows)} must be different numbers of 0..5 (vx, vy, vz, wx, wy, wz), or one of "
            f"{', '.join(TASKS)}",
            rows=rows,
        )  # fmt: skip
    return tuple(int(row) for row in numbers)
