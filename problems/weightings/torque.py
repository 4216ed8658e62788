"""Joint torque as a weight of joint accelerations (Hollerbach, Suh 1987): W = M'QM."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.measures.gravity_torque import torque_weight
from problems.robots.robot import Robot
from problems.weightings.definite import definite
from sandbox.weight import Weight

Array = np.ndarray


def torque(robot: Robot, q: Array, Q: Any = None) -> Weight:
    """W = M'QM [unit of Q times (Nm s^2)^2], kept factored; Q (n, n) positive semidefinite, or (n,) a diagonal, else I.

    The unknown is qddot: 1/2 qddot'W qddot + c'QM qddot is half the squared torque M qddot + c but for a constant.

    Raises WeightNotPositiveDefiniteError where M is not positive definite, RangeError where Q is not semidefinite.
    Source: eq. (1) by footnote 2, English & Maciejewski; methods M6.
    """
    M = definite(robot.inertia(q), f"the mass matrix M of {robot.name}", "every joint must move some inertia")
    Q = torque_weight(robot, Q)
    return Weight(np.zeros(M.shape), M, np.broadcast_to(Q, M.shape))
