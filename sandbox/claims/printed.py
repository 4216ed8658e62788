"""A printed equation of the paper, evaluated for a stack of problems."""

from __future__ import annotations

import numpy as np

from sandbox.claims.claim import Answer
from sandbox.problem import VelocityProblem

Array = np.ndarray


def each(equation: Answer, problem: VelocityProblem, alpha: float = 1.0) -> Array:
    """The rates (B, n) of an equation of `equations`, one problem after the other, grad f = a."""
    W = problem.W.dense()
    return np.stack([equation(problem.J[i], problem.xdot[i], W[i], problem.a[i], alpha) for i in range(len(problem))])
