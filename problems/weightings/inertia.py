"""W = M(q), the inertia matrix: 1/2 qdot'M qdot is kinetic energy."""

from __future__ import annotations

import numpy as np

from problems.robots.robot import Robot
from problems.weightings.definite import definite
from sandbox.weight import Weight

Array = np.ndarray


def inertia(robot: Robot, q: Array) -> Weight:
    """M (..., n, n) [kg m^2, kg m, kg], rotors included.

    Raises WeightNotPositiveDefiniteError where some joint moves no mass, AsymmetricWeightError.

    Source: O. Khatib, IEEE J. R&A 3(1), 1987.
    """
    W = Weight(robot.inertia(q))
    definite(W.base, f"the mass matrix M of {robot.name}", "every joint must move some inertia: give the links mass, or rotors")
    return W
