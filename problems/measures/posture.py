"""Distance from a posture."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from problems.measures.measure import Card, Measure, symbolic
from problems.robots.robot import Robot
from problems.robots.twin import Symbol, Twin
from sandbox import check
from sandbox.errors import ShapeError

Array = np.ndarray

POSTURE = Card("posture", "rad^2", "half the squared distance from a posture", "methods 0", "everywhere")


def posture(target: Any) -> Measure:
    """Measure f = 1/2 |q - target|^2 [rad^2]; target (n,) [rad], or (B, n), one per configuration."""
    target = check.real(target, "posture")
    if not target.ndim:
        raise ShapeError(f"posture is one number, {float(target):g}; give one angle per joint (n,)", field="posture")

    def guard(robot: Robot, q: Array) -> None:
        check.shape(target, ("n",), {"n": robot.n}, "posture")

    return symbolic(*POSTURE[:4], _expression, parameters=(target,), domain=POSTURE.domain, guard=guard)


def _expression(twin: Twin, target: Symbol) -> Symbol:
    return ca.sumsqr(twin.q - target) / 2
