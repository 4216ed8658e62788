"""What the error bounds of a solution are relative to."""

from __future__ import annotations

import numpy as np

from sandbox.problem import VelocityProblem
from sandbox.stacked import times, transpose

Array = np.ndarray


def reach(problem: VelocityProblem, x: Array) -> Array:
    """What error bounds are relative to (B,): max(|x|_inf, s), s the largest of |X11||a| + |X12||xdot|, X the KKT inverse."""
    B, m, n = len(problem), problem.m, problem.n
    K = np.zeros((B, n + m, n + m))
    K[:, :n, :n], K[:, n:, :n], K[:, :n, n:] = problem.W.dense(), problem.J, transpose(problem.J)
    X = np.abs(np.linalg.inv(K)[:, :n])
    data = np.concatenate([np.abs(problem.a), np.abs(problem.xdot)], axis=-1)
    return np.maximum(np.abs(x).max(axis=-1), times(X, data).max(axis=-1))
