"""What posing cost: the exact answer of a QP as posed in floats, held against the truth of the problem it came from."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from sandbox.formulation.formulation import Formulation
from sandbox.problem import VelocityProblem
from sandbox.qp import QP
from sandbox.reference.truth import Truth, truth_of_qp

Array = np.ndarray


class PosedTruth(NamedTuple):
    """Of B posed problems: expected class of the QP itself, and the exact answer carried back to joint rates (B, n)."""

    expected: list[str | None]
    qdot: Array


def posed_truth(problem: VelocityProblem, formulation: Formulation) -> PosedTruth:
    """Pose a stack and solve what was posed exactly; None and NaN where the formulation refused to pose."""
    posing = formulation.pose(problem)
    expected: list[str | None] = [None] * len(problem)
    qdot = np.full((len(problem), problem.n), np.nan)
    for posed in posing.parts:
        truths = _solve(posed.qp)
        if formulation.then is not None:
            good = np.flatnonzero([t.x is not None for t in truths])
            for i in np.flatnonzero([t.x is None for t in truths]):
                expected[int(posed.index[i])] = truths[i].expected
            if not len(good):
                continue
            first = np.array([truths[i].x for i in good])
            posed = posed[good]
            posed = formulation.then(problem[posed.index], posed, first)
            truths = _solve(posed.qp)
        part = problem[posed.index]
        x = _stack([t.x for t in truths], posed.qp.n)
        y = _stack([t.y for t in truths], posed.qp.p)
        qdot[posed.index], _ = formulation.recover(part, posed, x, y)
        for i, t in zip(posed.index, truths, strict=True):
            expected[int(i)] = t.expected
    return PosedTruth(expected, qdot)


def _solve(qp: QP) -> list[Truth]:
    truths = truth_of_qp(qp.H, qp.g, qp.A, qp.b)
    return truths if isinstance(truths, list) else [truths]


def _stack(vectors: list[Any], size: int) -> Array:
    """Vectors as one array, NaN where one is None."""
    return np.array([np.full(size, np.nan) if v is None else v for v in vectors]).reshape(len(vectors), size)
