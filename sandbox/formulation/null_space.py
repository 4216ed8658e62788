"""null_space: qdot = q_p + N z, q_p = J^+ xdot; no constraint is left."""

from __future__ import annotations

import numpy as np

from sandbox.formulation.formulation import Formulation, Posed, Posing
from sandbox.problem import VelocityProblem
from sandbox.qp import QP
from sandbox.solution import Status
from sandbox.spectrum import Spectrum, reduced_weight
from sandbox.stacked import times, transpose
from sandbox.tolerances import CONSISTENCY, UNIT

Array = np.ndarray


def build(problem: VelocityProblem) -> Posing:
    """Minimise 1/2 z'(N'WN)z + (N'(a + W q_p))'z over z; xdot outside range J is refused."""
    spectrum = Spectrum.of(problem)
    parts: list[Posed] = []
    refused: dict[int, tuple[Status, str]] = {}
    for r, members in spectrum.by_rank():
        part = problem[members]
        q_p = spectrum.solve(r, members, part.xdot)
        miss = np.abs(times(part.J, q_p) - part.xdot).max(axis=-1)
        scale = spectrum.sigma[members, 0] * np.abs(q_p).max(axis=-1) + np.abs(part.xdot).max(axis=-1)
        consistent = miss <= CONSISTENCY * problem.n * UNIT * scale
        for i, value in zip(members[~consistent], miss[~consistent], strict=True):
            refused[int(i)] = (Status.INFEASIBLE, f"xdot misses the range of J by {value:.6g}")
        if r == problem.n:
            for i in members[consistent]:
                refused[int(i)] = (Status.NOT_RUN, "J leaves no null space: there is no QP to pose")
            continue
        keep = np.flatnonzero(consistent)
        if not len(keep):
            continue
        part, q_p = part[keep], q_p[keep]
        N = spectrum.null_basis(r, members[keep])
        g = times(transpose(N), part.a) + times(part.W.left(N), q_p)
        qp = QP(reduced_weight(part, N), g, np.zeros((len(keep), 0, problem.n - r)), np.zeros((len(keep), 0)))
        kept = {"q_p": q_p, "N": N}
        parts.append(Posed(members[keep], qp, kept))
    return Posing(parts, refused)


def recover(problem: VelocityProblem, posed: Posed, x: Array, y: Array) -> tuple[Array, Array]:
    """Joint rates q_p + N z; y from J'y = -(W qdot + a) through J^+'."""
    qdot = posed.keep["q_p"] + times(posed.keep["N"], x)
    gradient = problem.W.times(qdot[..., None])[..., 0] + problem.a
    r, members = problem.n - posed.qp.n, np.arange(len(problem))
    return qdot, -Spectrum.of(problem).solve_transposed(r, members, gradient)


NULL_SPACE = Formulation("null_space", "exact", "qdot = J^+ xdot + N z: no constraint is left", build, recover)
