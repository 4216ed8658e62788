"""Mussa-Ivaldi and Hogan's weight C^-1 - Gamma: elastic joints in equilibrium with a force on the hand."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.measures.measure import Measure
from problems.robots.robot import Robot
from problems.weightings.definite import positive_definite
from problems.weightings.extended import Extremum, extremum
from problems.weightings.hessian import hessian
from sandbox import check
from sandbox.errors import RefusalError
from sandbox.parameters import configuration, number, single, vectors, within
from sandbox.tolerances import EXTREMAL
from sandbox.weight import Weight

Array = np.ndarray


class OffEquilibriumError(RefusalError):
    """No force on the hand balances the joints' elastic torque: the weight would no longer be integrable."""


def elastic(robot: Robot, stiffness: Any = 1.0, rest: Any = None) -> Measure:
    """Measure g = 1/2 (q - rest)'K(q - rest) [J]: K a number, (n,) or (n, n), positive definite [Nm/rad]; rest (n,) or
    (..., n), one per configuration [rad], zero if left out.

    Raises WeightNotPositiveDefiniteError, AsymmetricWeightError, ShapeError.
    """  # fmt: skip
    K = single(positive_definite(stiffness, "stiffness", robot.n), "stiffness", robot.n)
    rest = vectors(np.zeros(robot.n) if rest is None else rest, "rest", robot.n)

    def gradient(robot: Robot, q: Array) -> Array:
        q = vectors(q, "q", robot.n)
        within(q.shape[:-1], rest.shape[:-1], "rest")
        return np.einsum("...ij,...j->...i", K, q - rest)

    def value(robot: Robot, q: Array) -> Array:
        q = check.real(q, "q")
        return np.einsum("...i,...i->...", q - rest, gradient(robot, q)) / 2

    def curvature(robot: Robot, q: Array) -> Array:
        return np.broadcast_to(K, (*np.shape(q)[:-1], robot.n, robot.n))

    about = "energy of linear joint springs"
    return Measure("elastic energy", "J", about, "methods M18", "everywhere", value, gradient, curvature)


def impedance(robot: Robot, q: Array, compliance: Any = 1.0, rest: Any = None, tolerance: float = EXTREMAL) -> Weight:
    """W = C^-1 - Gamma [Nm/rad], Gamma_ij = sum_k F_k dJ_ki/dq_j, F the force on the hand with C^-1 (q - rest) = J'F.

    compliance : C, a number, (n,) or (n, n), positive definite [rad/Nm]; rest : (n,) or (..., n) [rad]
    tolerance : share of the elastic torque that may be out of balance

    Raises
    ------
    WeightNotPositiveDefiniteError
        for C.
    OffEquilibriumError
        naming the configuration and the share out of balance.
    PartialOrientationError, RankDeficientError
        where no symmetric Gamma does, where J has lost rank.

    Source: Mussa-Ivaldi & Hogan 1991, the paper's reference [26].
    """
    C = single(positive_definite(compliance, "compliance", robot.n), "compliance", robot.n)
    K = np.linalg.inv(C)
    return hessian(balanced(extremum(robot, q, elastic(robot, (K + np.swapaxes(K, -1, -2)) / 2, rest)), tolerance))


def balanced(condition: Extremum, tolerance: float = EXTREMAL) -> Extremum:
    """The condition itself.

    Raises OffEquilibriumError where more than `tolerance` of the elastic torque is not J'F.
    """
    tolerance = number(tolerance, "tolerance", least=0, infinite=True)
    bad = condition.distance > tolerance
    if bad.any():
        index = check.first(bad)
        value = float(condition.distance[index])
        raise OffEquilibriumError(
            f"{configuration(index)} of {condition.robot.name}: {value:.3g} of the elastic torque C^-1 (q - rest) is not J'F "
            f"for any force F on the hand, above {tolerance:g}; choose rest = q - C J'F, or let it relax (extremum_feedback)",
            index=index, residual=value,
        )  # fmt: skip
    return condition
