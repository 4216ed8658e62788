"""Free-swinging failures: what happens when a joint lets go (English, Maciejewski 1998; methods M10)."""

from __future__ import annotations

from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from problems.measures.gravity_torque import WeightlessError, require_heavy
from problems.measures.measure import Card, Measure, NotDifferentiableError, OutsideDomainError, compiled, symbolic
from problems.robots.robot import Robot
from problems.robots.twin import Symbol, Twin
from sandbox import check
from sandbox.errors import RangeError, ShapeError
from sandbox.parameters import configuration
from sandbox.tolerances import KINK, UNIT

Array = np.ndarray

SOURCE = "English, Maciejewski 1998; methods M10"
TORQUE = Card(
    "swing_torque", "(Nm)^2", "half the squared torques that gravity puts on joints that let go", SOURCE,
    "everywhere, on a robot that gravity pulls at",
)  # fmt: skip
ACCELERATION = Card(
    "swing_acceleration", "(rad/s^2)^2", "half the squared accelerations of joints that let go, the others locked", SOURCE,
    "where every weighted joint moves some inertia",
)  # fmt: skip
ANGLE = Card(
    "swing_angle", "rad^2", "half the squared angles by which joints that let go would swing", SOURCE,
    "axes neither parallel to gravity nor through the outboard centre of mass; no gradient upright",
)  # fmt: skip


def swing_torque(robot: Robot, *, weights: Any = None) -> Measure:
    """Measure f = 1/2 sum w_i T_i^2, T_i = |tau_g,i| [Nm] the torque that a free joint no longer holds.

    weights : w (n,), at least 0; 1 if left out

    Raises WeightlessError without mass or gravity, RangeError for a negative weight, ShapeError for a wrong number of them.
    """
    require_heavy(robot)
    w = _weights(robot, np.ones(robot.n) if weights is None else weights)
    return symbolic(*TORQUE[:4], _torque, parameters=(w,), domain=TORQUE.domain)


def swing_acceleration(robot: Robot, *, weights: Any = None) -> Measure:
    """Measure f = 1/2 sum w_i A_i^2, A_i = |tau_g,i|/M_ii [rad/s^2] the acceleration of a joint let go, the others locked.

    weights : w (n,), at least 0; 1 if left out

    Raises as `swing_torque`; refuses, at a weighted joint, an axis that no inertia turns about (OutsideDomainError).
    """
    require_heavy(robot)
    w = _weights(robot, np.ones(robot.n) if weights is None else weights)
    counted = tuple(int(i) for i in np.flatnonzero(w))

    def guard(robot: Robot, q: Array) -> None:
        inertia = np.diagonal(robot.inertia(q), axis1=-2, axis2=-1)
        bad = (inertia <= KINK * robot.n * UNIT * inertia.max(axis=-1, keepdims=True))[..., list(counted)]
        if bad.any():
            index, joint = _found(bad, counted)
            raise OutsideDomainError(
                f"joint {joint} of {robot.name} moves no inertia at {configuration(index)}: let go, it would accelerate "
                "without bound; give it the weight 0, or the links their inertia",
                index=index, joint=joint, value=float(inertia[index][joint - 1]),
            )  # fmt: skip

    return symbolic(
        *ACCELERATION[:4], _acceleration, constants=(counted,), parameters=(w,), domain=ACCELERATION.domain, guard=guard
    )


def swing_angle(robot: Robot, *, weights: Any = None) -> Measure:
    """Measure f = 1/2 sum w_i theta_i^2, theta_i [rad] how far a joint that lets go would turn until it hangs.

    theta_i is the angle about the joint's axis from the outboard centre of mass to gravity, both projected onto the plane
    normal to the axis, within (-pi, pi]; see `swing`. weights (n,) >= 0; without them 1, and 0 for joints that slide or that
    gravity never turns.

    Raises WeightlessError as `swing_torque`; refuses, at a weighted joint, an axis parallel to gravity or through the outboard
    centre of mass (OutsideDomainError); the gradient refuses |theta_i| = pi (NotDifferentiableError), where it jumps.
    """
    require_heavy(robot)
    w = _weights(robot, turned(robot).astype(float) if weights is None else weights)
    sliding = np.flatnonzero((w > 0) & robot.prismatic)
    if len(sliding):
        raise RangeError(f"joint {sliding[0] + 1} of {robot.name} slides: it swings by no angle; give it the weight 0")
    counted = tuple(int(i) for i in np.flatnonzero(w))
    if not counted:
        raise WeightlessError(f"no joint of {robot.name} with a weight is one that gravity turns")

    def guard(robot: Robot, q: Array) -> None:
        _refuse_flat(robot, swing(robot, q), counted)

    def smooth(robot: Robot, q: Array) -> None:
        theta, arm, tilt = swing(robot, q)
        near = _rounding(robot, arm, tilt)
        bad = (np.pi - np.abs(theta) <= near)[..., list(counted)]
        if bad.any():
            index, joint = _found(bad, counted)
            raise NotDifferentiableError(
                f"joint {joint} of {configuration(index)} stands upright over its axis: its swing angle jumps between pi and "
                "-pi there; leave the upright pose first",
                index=index, joint=joint, angle=float(theta[index][joint - 1]),
            )  # fmt: skip

    return symbolic(
        *ANGLE[:4], _angle, constants=(counted,), parameters=(w[list(counted)],), domain=ANGLE.domain,
        guard=guard, smooth=smooth,
    )  # fmt: skip


class Swing(NamedTuple):
    """Per joint (..., n): theta [rad]; arm [m], outboard centre of mass off the axis; tilt, sine of axis and gravity."""

    theta: Array
    arm: Array
    tilt: Array


def swing(robot: Robot, q: Array) -> Swing:
    """How every joint of a robot with mass and gravity would swing at q; where arm or tilt is 0 theta means nothing."""
    require_heavy(robot)
    parts = [compiled(part, (), (), robot)(q)[0] for part in (_thetas, _arms, _tilts)]
    return Swing(*(part.reshape(np.shape(q)) for part in parts))


def turned(robot: Robot) -> Array:
    """Which joints (n,) turn and feel gravity at some configuration, of three that are not special."""
    q = np.sin(np.outer([1.0, 2.0, 3.0], 1.0 + np.arange(robot.n)))
    _, arm, tilt = swing(robot, q)
    near = KINK * robot.n * UNIT
    return ~robot.prismatic & ((arm > near * _size(robot)) & (tilt > near)).all(axis=0)


def _weights(robot: Robot, weights: Any) -> Array:
    weights = check.real(weights, "weights")
    if weights.shape != (robot.n,):
        raise ShapeError(f"weights has shape {weights.shape}; it must be (n,) = ({robot.n},)", field="weights")
    if (weights < 0).any():
        joint = int(np.flatnonzero(weights < 0)[0]) + 1
        raise RangeError(f"the weight of joint {joint} is {weights[joint - 1]:g}; weights are at least 0", joint=joint)
    return weights


def _refuse_flat(robot: Robot, found: Swing, counted: tuple[int, ...]) -> None:
    near = KINK * robot.n * UNIT
    cases = (
        (found.tilt <= near, "turns about an axis parallel to gravity", "sine of their angle", found.tilt),
        (found.arm <= near * _size(robot), "has its outboard centre of mass on its axis", "distance [m]", found.arm),
    )
    for mask, what, name, values in cases:
        bad = mask[..., list(counted)]
        if bad.any():
            index, joint = _found(bad, counted)
            value = float(values[index][joint - 1])
            raise OutsideDomainError(
                f"joint {joint} of {robot.name} {what} at {configuration(index)} ({name} {value:.3g}): it has no swing angle; "
                "give it the weight 0, or keep away",
                index=index, joint=joint, value=value,
            )  # fmt: skip


def _found(bad: Array, counted: tuple[int, ...]) -> tuple[tuple[int, ...], int]:
    *where, place = check.first(bad)
    return tuple(where), counted[place] + 1


def _rounding(robot: Robot, arm: Array, tilt: Array) -> Array:
    """What rounding of the kinematics leaves of theta (..., n) [rad]."""
    with np.errstate(divide="ignore"):
        return KINK * robot.n * UNIT * (_size(robot) / arm + 1 / tilt)


def _size(robot: Robot) -> float:
    """Length scale [m] of the robot: what its links and centres of mass add up to."""
    places = sum(np.linalg.norm(robot.model.jointPlacements[i].translation) for i in robot.joints)
    return float(places + max(np.linalg.norm(centre) for _, _, centre, _ in robot.bodies()))


def _moment(twin: Twin, joint: int) -> tuple[Symbol, float]:
    """Outboard mass times its centre's place off the joint (3, 1) [kg m], and the mass [kg]."""
    outboard = set(twin.robot.model.subtrees[joint])
    moment, total = ca.SX.zeros(3), 0.0
    for body, mass, centre, _ in twin.robot.bodies():
        if body in outboard and mass:
            moment = moment + mass * (twin.point(body, centre) - twin.point(joint))
            total += mass
    return moment, total


def _theta(twin: Twin, joint: int) -> Symbol:
    moment, _ = _moment(twin, joint)
    axis, gravity = twin.axis(joint), ca.SX(ca.DM(np.array(twin.robot.model.gravity.linear)))
    across = ca.dot(axis, ca.cross(moment, gravity))
    along = ca.dot(moment, gravity) - ca.dot(axis, moment) * ca.dot(axis, gravity)
    return ca.atan2(across, along)


def _thetas(twin: Twin) -> Symbol:
    return ca.vertcat(*(_theta(twin, joint) for joint in twin.robot.joints))


def _arms(twin: Twin) -> Symbol:
    arms = []
    for joint in twin.robot.joints:
        moment, mass = _moment(twin, joint)
        arms.append(ca.norm_2(ca.cross(twin.axis(joint), moment)) / mass if mass else ca.SX(0))
    return ca.vertcat(*arms)


def _tilts(twin: Twin) -> Symbol:
    gravity = np.array(twin.robot.model.gravity.linear)
    down = ca.SX(ca.DM(gravity / np.linalg.norm(gravity)))
    return ca.vertcat(*(ca.norm_2(ca.cross(twin.axis(joint), down)) for joint in twin.robot.joints))


def _torque(twin: Twin, weights: Symbol) -> Symbol:
    return ca.dot(weights, twin.gravity_torque**2) / 2


def _acceleration(twin: Twin, joints: tuple[int, ...], weights: Symbol) -> Symbol:
    places = list(joints)
    return ca.dot(weights[places], (twin.gravity_torque[places] / ca.diag(twin.inertia)[places]) ** 2) / 2


def _angle(twin: Twin, joints: tuple[int, ...], weights: Symbol) -> Symbol:
    return ca.dot(weights, ca.vertcat(*(_theta(twin, i + 1) for i in joints)) ** 2) / 2
