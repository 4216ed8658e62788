"""The extended Jacobian: W = H'H, H = dh/dq, h = N'grad g = 0 the condition for an extremum of g on the self-motion."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import casadi as ca
import numpy as np

from problems.measures.jacobian import decompose
from problems.measures.measure import Measure
from problems.robots.robot import Robot
from problems.robots.twin import twin
from problems.weightings.augmented import AlgorithmicSingularityError, redundancy
from sandbox import check
from sandbox.errors import RefusalError
from sandbox.parameters import configuration, number
from sandbox.tolerances import EXTREMAL, RANK, UNIT
from sandbox.weight import Weight

Array = np.ndarray


class OffManifoldError(RefusalError):
    """A configuration is no extremum of g on its self-motion: without feedback the motion would hold h at another value."""


@dataclass(frozen=True, eq=False)
class Extremum:
    """The condition h = N'grad g = 0 at q, and its derivative; leading axes are those of q.

    J (..., m, n); N (..., n, k) orthonormal; condition (...,) of J
    gradient (..., n), hessian (..., n, n) : of g
    multipliers (..., m) : lam = J^+'grad g; at an extremum grad g = J'lam
    T (..., n, n) : T_ij = sum_k lam_k dJ_ki/dq_j, not symmetric where rows of angular velocity take part
    """

    robot: Robot
    q: Array
    J: Array
    N: Array
    condition: Array
    gradient: Array
    hessian: Array
    multipliers: Array
    T: Array

    @property
    def h(self) -> Array:
        """N'grad g (..., k)."""
        return np.einsum("...nk,...n->...k", self.N, self.gradient)

    @property
    def H(self) -> Array:
        """dh/dq = N'(Hess g - T) (..., k, n), in the gauge N(q) = N_0 - J^+J N_0 with N_0 frozen; needs no derivative of N.

        Source: eq. (11), English & Maciejewski; methods 5.2.
        """
        return np.swapaxes(self.N, -1, -2) @ (self.hessian - self.T)

    @property
    def distance(self) -> Array:
        """|h| / |grad g| (...,), less what rounding of q makes of h; 0 where grad g vanishes to rounding."""
        size = np.linalg.norm(self.gradient, axis=-1)
        rounding = RANK * self.robot.n * UNIT * np.linalg.norm(self.hessian, axis=(-2, -1))
        rounding = rounding * np.maximum(1.0, np.linalg.norm(self.q, axis=-1))
        part = np.maximum(np.linalg.norm(self.h, axis=-1) - rounding, 0.0)
        return np.divide(part, size, out=np.zeros_like(size), where=part > 0)

    def on_manifold(self, tolerance: float = EXTREMAL) -> Extremum:
        """Itself.

        Raises OffManifoldError, naming the configuration, where |h| exceeds `tolerance` |grad g|.
        """
        tolerance = number(tolerance, "tolerance", least=0, infinite=True)
        bad = self.distance > tolerance
        if bad.any():
            index = check.first(bad)
            value = float(self.distance[index])
            raise OffManifoldError(
                f"{configuration(index)} of {self.robot.name}: |N'grad g| is {value:.3g} of |grad g|, above {tolerance:g}: it "
                "is no extremum of g on its self-motion; start on one, or feed h back (extremum_feedback)",
                index=index, distance=value, h=self.h[index],
            )  # fmt: skip
        return self

    def isolated(self) -> Extremum:
        """Itself.

        Raises AlgorithmicSingularityError, naming the configuration, where N'H' is singular: the extremum bifurcates.
        """
        H = self.H
        size = np.linalg.norm(self.hessian, axis=(-2, -1)) + np.linalg.norm(self.T, axis=(-2, -1))
        sigma = np.linalg.svd(H @ self.N, compute_uv=False)[..., -1]
        bad = ~(sigma > RANK * self.robot.n * UNIT * self.condition * size)
        if bad.any():
            index = check.first(bad)
            value = float(sigma[index])
            raise AlgorithmicSingularityError(
                f"{configuration(index)} of {self.robot.name}: sigma_min(N'H') is {value:.3g}: the extremum of g bifurcates, "
                "its reduced Hessian is singular; choose another g, or add a base (damped_secondary)",
                index=index, sigma_min=value,
            )  # fmt: skip
        return self


def extremum(robot: Robot, q: Array, g: Measure) -> Extremum:
    """The extremal condition of g at q (..., n), with the derivatives of J and g from expressions.

    Raises NotTwiceDifferentiableError where g has no Hessian, RankDeficientError where J has lost rank, NotRedundantError.
    """
    redundancy(robot)
    q = check.real(q, "q")
    hessian, gradient = g.curvature(robot, q), g.gradient(robot, q)
    J = robot.jacobian(q)
    found = decompose(robot, J)
    multipliers = np.einsum("...mi,...i->...m", found.U, np.einsum("...ni,...n->...i", found.V, gradient) / found.sigma)
    (T,) = _torsion(robot)(q, multipliers)
    return Extremum(robot, q, J, found.N, found.condition, gradient, hessian, multipliers, T)


def extended(condition: Extremum) -> Weight:
    """W = H'H (..., n, n), never multiplied out.

    Raises AlgorithmicSingularityError where the extremum bifurcates. Source: eqs. (11)-(12), English & Maciejewski.
    """
    H = condition.isolated().H
    return Weight(np.zeros_like(condition.hessian), H)


@cache
def _torsion(robot: Robot) -> Any:
    symbols = twin(robot)
    lam = ca.SX.sym("lam", robot.m)
    return symbols.evaluator(ca.jacobian(symbols.jacobian.T @ lam, symbols.q), parameters=(lam,), axes=[2])
