"""A robot's kinematics and statics written in numpy from its model's numbers, one configuration, real or complex q.

And every measure written from it: values only, so that a complex step or a difference gives gradients to compare with.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pinocchio as pin

from problems.robots.robot import TASKS, Robot


def mixed():
    """Four joints in space, the second slides, gravity along -z; task: position."""
    model = pin.Model()
    model.name = "mixed"
    place = [
        pin.SE3(np.eye(3), np.zeros(3)),
        pin.SE3(pin.rpy.rpyToMatrix(0.3, -0.4, 0.2), np.array([0.1, 0.2, 0.3])),
        pin.SE3(pin.rpy.rpyToMatrix(-0.5, 0.1, 0.7), np.array([0.4, -0.1, 0.2])),
        pin.SE3(pin.rpy.rpyToMatrix(0.2, 0.9, -0.3), np.array([0.3, 0.3, -0.2])),
    ]
    kinds = [pin.JointModelRY(), pin.JointModelPX(), pin.JointModelRZ(), pin.JointModelRX()]
    joint = 0
    for i, (kind, where) in enumerate(zip(kinds, place, strict=True), start=1):
        joint = model.addJoint(joint, kind, where, f"joint_{i}")
        inertia = pin.Inertia(1.0 + 0.3 * i, np.array([0.1, 0.05 * i, 0.2]), np.diag([0.02, 0.03, 0.04]))
        model.appendBodyToJoint(joint, inertia, pin.SE3.Identity())
    model.addFrame(pin.Frame("hand", joint, 0, pin.SE3(np.eye(3), np.array([0.2, 0.5, 0.1])), pin.FrameType.OP_FRAME))
    model.lowerPositionLimit, model.upperPositionLimit = np.array([-2.0, -0.5, -2.5, -1.0]), np.array([2.0, 0.7, 1.5, 2.0])
    return Robot("mixed", model, "hand", TASKS["position"])


MIXED = mixed()


def cross(a):
    """[a]x."""
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


class Chain:
    """Places, axes and bodies of a serial robot at q."""

    def __init__(self, robot, q):
        self.robot, model = robot, robot.model
        self.gravity = np.array(model.gravity.linear)
        R, p = np.eye(3), np.zeros(3)
        self.R, self.p, self.z = [], [], []
        for i in robot.joints:
            assert model.parents[i] == i - 1
            place, axis = model.jointPlacements[i], robot.axes[i - 1]
            p, R = p + R @ place.translation, R @ place.rotation
            if robot.prismatic[i - 1]:
                p = p + R @ axis * q[i - 1]
            else:
                K = cross(axis)
                R = R @ (np.eye(3) + np.sin(q[i - 1]) * K + (1 - np.cos(q[i - 1])) * K @ K)
            self.R.append(R)
            self.p.append(p)
            self.z.append(R @ axis)
        self.centres = [self.point(i, c) for i, _, c, _ in robot.bodies()]
        self.masses = [m for _, m, _, _ in robot.bodies()]
        self.inertias = [self.R[i - 1] @ about @ self.R[i - 1].T for i, _, _, about in robot.bodies()]
        hand = model.frames[robot.frame(robot.hand)]
        self.hand = self.point(hand.parentJoint, hand.placement.translation)

    def point(self, joint, offset):
        """Place of a point of a link, joint 1..n."""
        return self.p[joint - 1] + self.R[joint - 1] @ offset

    def column(self, i, at):
        """Linear and angular velocity at a point per unit rate of joint i (0..n-1)."""
        if self.robot.prismatic[i]:
            return np.concatenate([self.z[i], 0 * self.z[i]])
        return np.concatenate([np.cross(self.z[i], at - self.p[i]), self.z[i]])

    @property
    def J(self):
        """The task rows."""
        return np.stack([self.column(i, self.hand) for i in range(self.robot.n)], axis=1)[list(self.robot.rows)]

    @property
    def torque(self):
        """Holds the robot at rest."""
        n = self.robot.n
        return np.array([-sum(self.masses[b] * self.gravity @ self.column(i, self.centres[b])[:3] for b in range(i, n))
                         for i in range(n)])  # fmt: skip

    @property
    def own_inertia(self):
        """Diagonal of M."""
        n, found = self.robot.n, []
        for i in range(n):
            total = self.robot.model.armature[i]
            for b in range(i, n):
                c = self.column(i, self.centres[b])
                total = total + self.masses[b] * c[:3] @ c[:3] + c[3:] @ self.inertias[b] @ c[3:]
            found.append(total)
        return np.array(found)

    def angle(self, i):
        """From the outboard centre of mass to gravity, about joint i: coordinates in the plane normal to its axis."""
        mass = sum(self.masses[i:])
        c = sum(m * x for m, x in zip(self.masses[i:], self.centres[i:], strict=True)) / mass - self.p[i]
        z = self.z[i]
        e1 = np.cross(z, [0.36, 0.48, 0.8])
        e1 = e1 / np.linalg.norm(e1)
        e2 = np.cross(z, e1)
        turn = np.arctan2(self.gravity @ e2, self.gravity @ e1) - np.arctan2(c @ e2, c @ e1)
        return (turn + np.pi) % (2 * np.pi) - np.pi


def volume(J):
    return np.sqrt(np.linalg.det(J @ J.T))


def smallest(J):
    return np.sqrt(np.linalg.eigvalsh(J @ J.T)[0])


def without(J, gone):
    return J[:, [i for i in range(J.shape[1]) if i not in gone]]


def relative(J, joints, failures=1):
    return np.array([volume(without(J, s)) / volume(J) for s in combinations([j - 1 for j in joints], failures)])


def left(J, joints, failures=1):
    return np.array([smallest(without(J, s)) for s in combinations([j - 1 for j in joints], failures)])


def share(robot, q):
    return (q - (robot.lower + robot.upper) / 2) / ((robot.upper - robot.lower) / 2)


OBSTACLE, REACH = np.array([0.35, 0.25, 0.4]), 3.0
"""Felt everywhere."""


def nearest(chain):
    """Distance of the nearest joint beyond the first that another moves."""
    robot, n = chain.robot, chain.robot.n
    ends = [robot.model.jointPlacements[i + 1].translation for i in range(1, n)]
    places = [chain.point(i, ends[i - 1]) for i in range(1, n) if np.linalg.norm(ends[i - 1]) > 0]
    if robot.name == "seven_joint":
        places = places[1:]  # the shoulder stands on the first axis
    squares = [(x - OBSTACLE) @ (x - OBSTACLE) for x in places]
    return np.sqrt(min(squares, key=np.real))


def weights(robot):
    """Joints that turn and that gravity turns: the first of an upright arm does not, nor a tool on the last axis."""
    w = np.ones(robot.n) * ~robot.prismatic
    if robot.name in ("panda", "seven_joint"):
        w[0] = 0
    if robot.name == "seven_joint":
        w[6] = 0
    return w


def failing(robot):
    """Joints whose failure does not cost the task: not the elbow, where shoulder and wrist are spherical."""
    return [j for j in robot.joints if not (robot.name == "seven_joint" and j == 4)]


ANALYTIC = {
    "posture": lambda r, q: q @ q / 2,
    "joint_limits_quadratic": lambda r, q: np.mean(share(r, q) ** 2),
    "joint_limits_p_norm": lambda r, q: np.sum(share(r, q) ** 6) ** (1 / 6),
    "joint_limits_barrier": lambda r, q: np.sum((r.upper - r.lower) ** 2 / ((r.upper - q) * (q - r.lower))) / 4,
    "manipulability": lambda r, q: volume(Chain(r, q).J),
    "log_manipulability": lambda r, q: np.log(volume(Chain(r, q).J)),
    "gravity_torque": lambda r, q: Chain(r, q).torque @ Chain(r, q).torque / 2,
    "obstacle_potential": lambda r, q: 50 * (REACH - nearest(Chain(r, q))) ** 2,
    "least_relative_manipulability": lambda r, q: min(relative(Chain(r, q).J, failing(r)), key=np.real),
    "fault_tolerance": lambda r, q: -np.sum(np.log(relative(Chain(r, q).J, failing(r)))),
    "swing_torque": lambda r, q: np.sum(Chain(r, q).torque ** 2) / 2,
    "swing_acceleration": lambda r, q: np.sum((Chain(r, q).torque / Chain(r, q).own_inertia) ** 2) / 2,
}
"""Values (robot, q) that continue to complex q."""

REAL = {
    "smallest_singular_value": lambda r, q: smallest(Chain(r, q).J),
    "kfm": lambda r, q: left(Chain(r, q).J, failing(r)).min(),
    "swing_angle": lambda r, q: sum(w * Chain(r, q).angle(i) ** 2 for i, w in enumerate(weights(r)) if w) / 2,
}
"""Values that do not."""

PARAMETERS = {
    "obstacle_potential": lambda r: {"obstacle": OBSTACLE, "reach": REACH},
    "kfm": lambda r: {"joints": failing(r)},
    "least_relative_manipulability": lambda r: {"joints": failing(r)},
    "fault_tolerance": lambda r: {"joints": failing(r)},
}
"""What the measures are made with here."""


def complex_step(f, q):
    """Gradient of f at q, to rounding."""
    return np.array([f(q + 1e-30j * e).imag / 1e-30 for e in np.eye(len(q))])


def difference(f, q, h=1e-3):
    """Fourth-order central difference of f at q, the joint on the last axis."""
    return np.stack([(8 * (f(q + h * e) - f(q - h * e)) - f(q + 2 * h * e) + f(q - 2 * h * e)) / (12 * h)
                     for e in np.eye(len(q))], axis=-1)  # fmt: skip
