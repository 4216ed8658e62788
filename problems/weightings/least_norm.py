"""Chan and Dubey's weighted least norm: a joint on its way to a limit weighs more, the nearer it is."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.measures.joint_limits import barrier
from problems.robots.robot import Robot
from problems.weightings.identity import one_unit
from sandbox.parameters import vectors
from sandbox.weight import Weight

Array = np.ndarray


def least_norm(robot: Robot, q: Array, qdot_previous: Any = None, *, lower: Any = None, upper: Any = None) -> Weight:
    """W = diag(1 + |dH/dq_i|) of the joints whose |dH/dq_i| is not falling, 1 of the others; H the joint-limit barrier.

    qdot_previous : (n,) or (..., n) [rad/s, m/s], rates of the step before, whose signs tell; without them every joint
        counts as moving towards its nearer limit
    lower, upper : (n,) [rad, m], the robot's own if left out; a joint without two finite limits weighs 1

    H is convex, so |dH/dq_i| grows where qdot_i has the sign of dH/dq_i. W is therefore no function of q: it jumps where
    a joint turns round, and with `qdot_previous` it is one step late; iterating on the answer's own signs need not end.

    Raises OutsideDomainError for a joint at or beyond its limit, RangeError for limits in the wrong order or none at all,
    MixedUnitsError for revolute beside prismatic joints: the 1 has no unit there.

    Source: T. F. Chan, R. V. Dubey, IEEE Trans. R&A 11(2), 1995.
    """
    one_unit(robot, "weigh its joints yourself: weighted_pseudoinverse with a weight (n,) made of 1 + |dH/dq_i|")
    slope = barrier(robot, lower=lower, upper=upper).gradient(robot, q)
    weighs = np.abs(slope)
    if qdot_previous is not None:
        qdot = vectors(qdot_previous, "qdot_previous", robot.n, lead=slope.shape[:-1])
        weighs = np.where(np.sign(slope) * np.sign(qdot) >= 0, weighs, 0.0)
    return Weight((1 + weighs)[..., None] * np.eye(robot.n))
