"""The Jacobian-transpose law, shown beside the closed forms: it minimises nothing that they are judged by."""

from __future__ import annotations

import numpy as np

from sandbox.problem import VelocityProblem
from sandbox.stacked import times, transpose

Array = np.ndarray


@np.errstate(all="ignore")
def jacobian_transpose(problem: VelocityProblem) -> Array:
    """The rates (B, n) kappa J'xdot with the best kappa, <xdot, JJ'xdot> / |JJ'xdot|^2; 0 where J'xdot = 0 (it stalls).

    Source: methods C2; Wolovich & Elliott 1984.
    """
    step = times(transpose(problem.J), problem.xdot)
    reached = times(problem.J, step)
    square = np.square(reached).sum(axis=1)
    kappa = np.where(square > 0, (problem.xdot * reached).sum(axis=1) / square, 0.0)
    return kappa[:, None] * step
