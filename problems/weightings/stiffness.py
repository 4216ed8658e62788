"""Joint elasticity as a weight: stiffness and compliance are two things, and neither is an unlabelled matrix."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from problems.robots.robot import Robot
from problems.weightings.definite import positive_definite
from sandbox import check
from sandbox.errors import RangeError, ShapeError
from sandbox.parameters import told, within
from sandbox.weight import Weight

Array = np.ndarray


class UnitMismatchError(RangeError):
    """A stiffness is given in the unit of a compliance, or one of revolute joints to sliding ones."""


@dataclass(frozen=True, eq=False)
class _Elasticity(ABC):
    """A symmetric positive definite matrix (n, n), its diagonal (n,) or a number, and its unit."""

    matrix: Any
    unit: str | None = None
    """SI of the robot's joints if left out."""

    letter: ClassVar[str] = ""
    units: ClassVar[dict[str, str]] = {}
    """Of revolute, sliding and mixed joints."""

    def checked(self, robot: Robot) -> Array:
        """The matrix (..., n, n), symmetric and positive definite, in the robot's units."""
        slides = robot.prismatic
        joints = "revolute" if not slides.any() else "sliding" if slides.all() else "mixed"
        if self.unit is not None and not (isinstance(self.unit, str) and self.unit == self.units[joints]):
            unit = self.unit if isinstance(self.unit, str) else told(self.unit)
            raise UnitMismatchError(
                f"{type(self).__name__} of {robot.name} is in {self.units[joints]} ({joints} joints), not {check.line(unit)}; "
                "convert it, or give it as what it is: JointStiffness or JointCompliance",
                unit=self.unit,
            )
        way_out = "elastic energy must grow in every direction: give a positive definite matrix"
        return positive_definite(self.matrix, self.letter, robot.n, way_out)

    @abstractmethod
    def weight(self, robot: Robot) -> Array:
        """W (..., n, n)."""


class JointStiffness(_Elasticity):
    """K [Nm/rad, N/m]: W = K, and 1/2 dq'K dq is elastic energy [J]."""

    letter = "K"
    units: ClassVar[dict[str, str]] = {"revolute": "Nm/rad", "sliding": "N/m", "mixed": "Nm/rad, N/m"}

    def weight(self, robot: Robot) -> Array:
        """W = K."""
        return self.checked(robot)


class JointCompliance(_Elasticity):
    """C [rad/Nm, m/N]: W = C^-1, which is the stiffness."""

    letter = "C"
    units: ClassVar[dict[str, str]] = {"revolute": "rad/Nm", "sliding": "m/N", "mixed": "rad/Nm, m/N"}

    def weight(self, robot: Robot) -> Array:
        """W = C^-1, by C's Cholesky factor."""
        inverse = np.linalg.inv(np.linalg.cholesky(self.checked(robot)))
        return np.swapaxes(inverse, -1, -2) @ inverse


class ComplianceAsPrinted(JointCompliance):
    """C taken for W itself, as the paper's "W = K_theta, a joint compliance matrix" may be read; 1/2 dq'C dq is no energy."""

    def weight(self, robot: Robot) -> Array:
        """W = C."""
        return self.checked(robot)


def stiffness(robot: Robot, q: Array, elasticity: Any = None) -> Weight:
    """W of a JointStiffness, JointCompliance or ComplianceAsPrinted; JointStiffness(diag(n, ..., 2, 1)) if left out.

    Raises UnitMismatchError, WeightNotPositiveDefiniteError, ShapeError; ShapeError for a matrix that does not say which.

    Source: J. K. Salisbury, CDC 1980 (the attribution is a guess); F. A. Mussa-Ivaldi, N. Hogan, IJRR 10(5), 1991, for C.
    """
    if elasticity is None:
        elasticity = JointStiffness(np.arange(robot.n, 0, -1))
    if not isinstance(elasticity, _Elasticity):
        raise ShapeError(
            f"a {type(elasticity).__name__} may be a stiffness or a compliance; give JointStiffness(K), JointCompliance(C), "
            "or ComplianceAsPrinted(C) for W = C"
        )
    W = elasticity.weight(robot)
    lead = np.shape(q)[:-1]
    within(lead, W.shape[:-2], elasticity.letter)
    return Weight(np.broadcast_to(W, (*lead, robot.n, robot.n)))
