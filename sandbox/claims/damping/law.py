"""The augmented Jacobian that holds the hand's angle, damped or not."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from problems.methods import METHODS
from sandbox.claims.claim import Answer
from sandbox.claims.postures import HAND_ANGLE

Array = np.ndarray

AUGMENTED, DAMPED = METHODS["augmented_jacobian"], METHODS["damped_secondary"]


def law(framework: Answer, robot: Any, base: float) -> Callable[[Array, Array], Array]:
    """The augmented Jacobian that holds the hand's angle, damped by `base` times I; undamped for 0."""
    method, given = (DAMPED, {"base": base}) if base else (AUGMENTED, {})

    def one(q: Array, xdot: Array) -> Array:
        found: Array = framework(method, robot, q[None], xdot[None], E=HAND_ANGLE, **given)
        return found[0]

    return one
