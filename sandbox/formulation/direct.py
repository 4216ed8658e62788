"""direct: H = W, g = a, A = J, b = xdot, nothing done to it."""

from __future__ import annotations

import numpy as np

from sandbox.formulation.formulation import Formulation, Posed, Posing
from sandbox.problem import VelocityProblem
from sandbox.qp import QP

Array = np.ndarray


def build(problem: VelocityProblem) -> Posing:
    """The framework's problem word for word."""
    qp = QP(problem.W.dense(), problem.a, problem.J, problem.xdot)
    return Posing([Posed(np.arange(len(problem)), qp)])


def recover(problem: VelocityProblem, posed: Posed, x: Array, y: Array) -> tuple[Array, Array]:
    """The answer as it is."""
    return x, y


DIRECT = Formulation("direct", "exact", "H = W, g = a, A = J, b = xdot", build, recover)
