"""What eq. (6) from N'W and N'a alone may differ by from an explicit way."""

from __future__ import annotations

import numpy as np

from problems.methods import METHODS
from sandbox.agreement import bounds
from sandbox.closed_form.eq6_implicit import implicit_bound
from sandbox.problem import VelocityProblem

Array = np.ndarray


def norms(A: Array) -> Array:
    """Frobenius norm of every matrix."""
    return np.linalg.norm(A, axis=(-1, -2))


def within(problem: VelocityProblem, x: Array, N: Array, method: str) -> Array:
    """What eq6_implicit and the other side, of the accuracy of `method`'s original, may differ by (B,) [rad/s, m/s]."""
    framework, original = bounds(METHODS[method], problem, x, {})
    own = implicit_bound(problem.J, N, problem.W.left(N), size=norms(problem.W.dense()))
    allowed: Array = own * np.abs(x).max(axis=-1) + framework + original
    return allowed
