"""range_space, normal_equations, hierarchical: the least-squares sense of eq. (13) as a QP.

The minimisers of (J qdot - xdot)' Wx (J qdot - xdot) are the solutions of J'Wx (J qdot - xdot) = 0.
"""

from __future__ import annotations

import numpy as np

from sandbox.formulation.formulation import Formulation, Posed, Posing
from sandbox.problem import VelocityProblem
from sandbox.qp import QP
from sandbox.spectrum import Spectrum
from sandbox.stacked import symmetric, times, transpose
from sandbox.task import task_weight

Array = np.ndarray


def build_range_space(problem: VelocityProblem) -> Posing:
    """U_r'Wx J qdot = U_r'Wx xdot: r rows, of full rank where Wx is nondegenerate on range J."""
    spectrum = Spectrum.of(problem)
    dense = problem.W.dense()
    parts = []
    for r, members in spectrum.by_rank():
        part = problem[members]
        WxU = task_weight(part) @ spectrum.image_basis(r, members)
        qp = QP(dense[members], part.a, transpose(WxU) @ part.J, times(transpose(WxU), part.xdot))
        parts.append(Posed(members, qp, {"WxU": WxU}))
    return Posing(parts)


def recover_range_space(problem: VelocityProblem, posed: Posed, x: Array, y: Array) -> tuple[Array, Array]:
    """Y = Wx U_r y_r."""
    return x, times(posed.keep["WxU"], y)


def build_normal_equations(problem: VelocityProblem) -> Posing:
    """J'WxJ qdot = J'Wx xdot: n rows of rank r, redundant on purpose."""
    JWx = transpose(problem.J) @ task_weight(problem)
    qp = QP(problem.W.dense(), problem.a, JWx @ problem.J, times(JWx, problem.xdot))
    return Posing([Posed(np.arange(len(problem)), qp)])


def recover_normal_equations(problem: VelocityProblem, posed: Posed, x: Array, y: Array) -> tuple[Array, Array]:
    """Y = Wx J mu."""
    return x, times(task_weight(problem), times(problem.J, y))


def build_hierarchical(problem: VelocityProblem) -> Posing:
    """First QP: the least-squares target alone, H = J'WxJ singular, no rows."""
    JWx = transpose(problem.J) @ task_weight(problem)
    B, n = len(problem), problem.n
    qp = QP(symmetric(JWx @ problem.J), -times(JWx, problem.xdot), np.zeros((B, 0, n)), np.zeros((B, 0)))
    spectrum = Spectrum.of(problem)
    parts = []
    for r, members in spectrum.by_rank():
        WxU = task_weight(problem[members]) @ spectrum.image_basis(r, members)
        parts.append(Posed(members, qp[members], {"WxU": WxU}))
    return Posing(parts)


def then_hierarchical(problem: VelocityProblem, posed: Posed, x: Array) -> Posed:
    """Second QP: the weight, with U_r'Wx J qdot held at what the first reached."""
    rows = transpose(posed.keep["WxU"]) @ problem.J
    return Posed(posed.index, QP(problem.W.dense(), problem.a, rows, times(rows, x)), posed.keep)


RANGE_SPACE = Formulation("range_space", "least_squares", "U_r'Wx J qdot = U_r'Wx xdot", build_range_space, recover_range_space)
NORMAL_EQUATIONS = Formulation(
    "normal_equations",
    "least_squares",
    "J'WxJ qdot = J'Wx xdot, redundant rows",
    build_normal_equations,
    recover_normal_equations,
)
HIERARCHICAL = Formulation(
    "hierarchical", "least_squares", "first the target alone, then the weight with the target held",
    build_hierarchical, recover_range_space, then_hierarchical,
)  # fmt: skip
