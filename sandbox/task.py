"""The three tasks as one canonical system: rows C x = d and a weight, on which truth, residuals and conditioning agree."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sandbox.problem import VelocityProblem
from sandbox.stacked import times, transpose

Array = np.ndarray

TASKS = ("exact", "least_squares", "damped")
"""exact: J qdot = xdot; least_squares: eq. (13); damped: methods C1 with its lambda."""


def task_weight(problem: VelocityProblem) -> Array:
    """Wx (..., m, m); the identity where none is given."""
    if problem.Wx is not None:
        return problem.Wx
    return np.broadcast_to(np.eye(problem.m), (*problem.lead, problem.m, problem.m))


@dataclass(frozen=True, eq=False)
class TaskView:
    """A stack of problems seen through one task; L = value + y' rows, stationarity  scale (W qdot + a) + J'y = 0.

    scale : 1, or lambda^2 for damped
    """

    problem: VelocityProblem
    task: str
    scale: float

    @classmethod
    def of(cls, problem: VelocityProblem, task: str, damping: float) -> TaskView:
        """`problem` as `task` sees it."""
        return cls(problem, task, damping**2 if task == "damped" else 1.0)

    def gradient(self, qdot: Array) -> Array:
        """Scale (W qdot + a) for qdot (B, n)."""
        return self.scale * (self.problem.W.times(qdot[..., None])[..., 0] + self.problem.a)

    def dual(self, qdot: Array, y: Array) -> Array:
        """Scale (W qdot + a) + J'y."""
        return self.gradient(qdot) + times(transpose(self.problem.J), y)

    def primal(self, qdot: Array, y: Array) -> Array:
        """What is left of the rows: J qdot - xdot, its part that Wx sees through J, or y + Wx(xdot - J qdot)."""
        miss = times(self.problem.J, qdot) - self.problem.xdot
        if self.task == "exact":
            return miss
        weighted = times(task_weight(self.problem), miss)
        if self.task == "least_squares":
            return times(transpose(self.problem.J), weighted)
        return y - weighted
