"""slack: damped least squares as the framework's own problem on a slack-augmented arm (methods C1)."""

from __future__ import annotations

import numpy as np

from sandbox.formulation.formulation import Formulation, Posed, Posing
from sandbox.problem import VelocityProblem
from sandbox.qp import QP
from sandbox.task import task_weight
from sandbox.tolerances import DAMPING

Array = np.ndarray


def build(problem: VelocityProblem) -> Posing:
    """Minimise 1/2 lambda^2 qdot'W qdot + lambda^2 a'qdot + 1/2 s'Wx s subject to J qdot + s = xdot."""
    B, m, n = len(problem), problem.m, problem.n
    H = np.zeros((B, n + m, n + m))
    H[:, :n, :n] = DAMPING**2 * problem.W.dense()
    H[:, n:, n:] = task_weight(problem)
    g = np.concatenate([DAMPING**2 * problem.a, np.zeros((B, m))], axis=-1)
    A = np.concatenate([problem.J, np.broadcast_to(np.eye(m), (B, m, m))], axis=-1)
    return Posing([Posed(np.arange(B), QP(H, g, A, problem.xdot))])


def recover(problem: VelocityProblem, posed: Posed, x: Array, y: Array) -> tuple[Array, Array]:
    """The joint rates are the first n; y is that of the slack rows."""
    return x[:, : problem.n], y


SLACK = Formulation("slack", "damped", "slack joints s = xdot - J qdot make damping a problem of the framework", build, recover)
