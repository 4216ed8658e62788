"""Differential inverse kinematics of pink and mink on the Panda against the same rates by eq. (6)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio as pin

from problems import robots
from problems.methods import METHODS
from problems.robots.robot import Robot
from sandbox.bench.measured import Measured, each, ratio
from sandbox.bench.race import Effort, one_core, race
from sandbox.errors import SandboxError
from sandbox.law import rates

Array = np.ndarray

STEP = 1e-2
"""Time step of the peers [s]: what they are asked for is the target's pose after it."""

SOLVER = "daqp"
"""QP solver of both: the fastest there is for them."""

AGREE = 1e-2
"""Largest difference of rates relative to the largest: the H = J'J + 1e-12 I of the peers leaves their self-motion loose."""

GENERIC = 0.05
"""Least singular value of J of the configurations."""

ROUNDS = 7
"""Of loops in Python: their times vary less."""

Loop = Callable[[], None]


def pink(robot: Robot, q: Array, targets: list[pin.SE3], out: Array) -> Loop:
    """pink.solve_ik with one FrameTask and no limits, its configuration updated in place."""
    from pink import Configuration, solve_ik
    from pink.tasks import FrameTask

    model = robot.model.copy()
    configuration = Configuration(model, model.createData(), q[0])
    task = FrameTask(robot.hand, position_cost=1.0, orientation_cost=1.0)

    def run() -> None:
        for i, target in enumerate(targets):
            configuration.update(q[i])
            task.set_target(target)
            out[i] = solve_ik(configuration, [task], STEP, solver=SOLVER, limits=[])

    return run


def mink(robot: Robot, q: Array, targets: list[pin.SE3], out: Array) -> Loop:
    """mink.solve_ik with one FrameTask and no limits, its configuration updated in place."""
    import mujoco
    from mink import SE3, Configuration, FrameTask, solve_ik

    configuration = Configuration(mujoco.MjModel.from_xml_string(mjcf(robot)), q[0])
    task = FrameTask("hand", "site", position_cost=1.0, orientation_cost=1.0)
    poses = [SE3.from_matrix(target.homogeneous) for target in targets]

    def run() -> None:
        for i, target in enumerate(poses):
            configuration.update(q[i])
            task.set_target(target)
            out[i] = solve_ik(configuration, [task], STEP, solver=SOLVER, limits=[])

    return run


PEERS = {"pink": pink, "mink": mink}


def against(peer: str, *, stacked: bool) -> Callable[[Effort], Measured]:
    """Times by which the peer takes longer for the least rates that move the Panda's hand by a given twist.

    Ours is `law.rates`, Jacobian, checks and refusals included: one configuration to a call, or, `stacked`, all in one call.
    Raises SandboxError where the two do not agree.
    """

    def measure(effort: Effort) -> Measured:
        robot = robots.load("panda")
        q, xdot, targets = motions(robot, effort.problems(4096 if stacked else 256))
        some = min(len(q), effort.problems(256))
        theirs, ours = np.full((some, robot.n), np.nan), np.full(q.shape, np.nan)
        method = METHODS["gradient_projection"]

        def together() -> None:
            ours[:] = rates(method, robot, q, xdot, alpha=0.0)

        def singly() -> None:
            for i in range(len(q)):
                ours[i] = rates(method, robot, q[i], xdot[i], alpha=0.0)

        with one_core():
            loop = PEERS[peer](robot, q[:some], targets[:some], theirs)
            times = race({"peer": loop, "ours": together if stacked else singly}, min(effort.rounds, ROUNDS))
        off = float(np.abs(theirs - ours[:some]).max() / np.abs(theirs).max())
        if not off <= AGREE:
            raise SandboxError(f"the rates of {peer} are off by {off:.1e} of the largest: it was not asked for the same motion")
        peers, own = times["peer"] / some, times["ours"] / len(q)
        return ratio(peers, own).with_(
            {f"{peer} us": each(peers, 1).value, "ours us": each(own, 1).value, "agree to": off, "configurations": len(q)}
        )

    return measure


def motions(robot: Robot, count: int, seed: int = 0) -> tuple[Array, Array, list[pin.SE3]]:
    """Configurations (B, n) away from singularities, twists (B, 6) of the hand in base axes, and its poses after STEP."""
    rng = np.random.default_rng(seed)
    kept: list[Array] = []
    while len(kept) < count:
        q = rng.uniform(robot.lower, robot.upper) * 0.8 + 0.1 * (robot.lower + robot.upper)
        if np.linalg.svd(robot.jacobian(q), compute_uv=False)[-1] > GENERIC:
            kept.append(q)
    q, twists = np.array(kept), 0.1 * rng.standard_normal((count, 6))
    data, hand = robot.model.createData(), robot.frame(robot.hand)
    xdot, targets = np.empty_like(twists), []
    for i, twist in enumerate(twists):
        pin.forwardKinematics(robot.model, data, q[i])
        pose = pin.updateFramePlacement(robot.model, data, hand).copy()
        targets.append(pose * pin.exp6(pin.Motion(STEP * twist)))  # the twist is in the hand's own axes
        xdot[i] = np.concatenate([pose.rotation @ twist[:3], pose.rotation @ twist[3:]])
    return q, xdot, targets


def mjcf(robot: Robot) -> str:
    """The same arm for MuJoCo: bodies, joints and a site at the hand; no geometry."""
    model = robot.model
    frame = model.frames[robot.frame(robot.hand)]
    lines, closing = ["<mujoco><compiler angle='radian' autolimits='false'/><worldbody>"], ""
    for i in robot.joints:
        place, axis = _placed(model.jointPlacements[i]), _numbers(robot.axes[i - 1])
        lines.append(f"<body {place}><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/><joint type='hinge' axis='{axis}'/>")
        closing += "</body>"
    lines.append(f"<site name='hand' {_placed(frame.placement)}/>{closing}</worldbody></mujoco>")
    return "".join(lines)


def _placed(pose: pin.SE3) -> str:
    x, y, z, w = pin.Quaternion(pose.rotation).coeffs()
    return f"pos='{_numbers(pose.translation)}' quat='{_numbers((w, x, y, z))}'"


def _numbers(values: Any) -> str:
    return " ".join(f"{float(value):.17g}" for value in values)
