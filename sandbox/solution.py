"""What came back from a solver or closed form: why it stopped, and the point it gave."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np

Array = np.ndarray


class Status(Enum):
    """Why it stopped. Each member carries its sentence; what the point is worth is the verdict's business."""

    SOLVED = "says that it solved the problem"
    LIMIT = "ran out of iterations, or stopped short of its tolerance"
    INFEASIBLE = "refused: says that no point satisfies the equality rows"
    UNBOUNDED = "refused: says that the objective is unbounded below"
    NONCONVEX = "refused: says that H is not convex enough for it"
    CONDITION_SEVEN = "refused: N'WN is not positive definite, condition (7) fails"
    NOT_POSITIVE_DEFINITE = "refused: the weight it factors is not positive definite"
    RANK_DEFICIENT = "refused: the rows are not of full rank"
    RANK_AMBIGUOUS = "refused: the singular values show no clear rank"
    ILL_CONDITIONED = "refused: the decision lies within rounding error"
    TARGET_UNBOUNDED = "refused: the least-squares target is not bounded below or not unique"
    FAILED = "refused: stopped with an error or gave no reason"
    CRASHED = "died with its process"
    TIMED_OUT = "overran the time limit"
    NOT_RUN = "was not run"

    @property
    def sentence(self) -> str:
        """The status in words."""
        return self.value

    @property
    def answered(self) -> bool:
        """Whether it claims to have solved the problem."""
        return self is Status.SOLVED

    @property
    def refused(self) -> bool:
        """Whether it declined to answer."""
        return self.value.startswith("refused")


STATUSES = tuple(Status)
"""Statuses by code: stacks carry the int8 position in this tuple."""

CODE = {status: code for code, status in enumerate(STATUSES)}
"""Code of each status."""


@dataclass(frozen=True, eq=False)
class Solution:
    """The answer of one method to one problem or a stack of them.

    x (..., n) joint rates [rad/s, m/s], NaN where refused; y (..., m) multipliers of the task rows
    (W x + a + J'y = 0), NaN where there are none. `status` is a Status for one problem, an object array
    of them for a stack; `said` are the solver's own words or the refusal's reason.
    """

    x: Array
    y: Array
    status: Any
    said: Any = ""
    settings: dict[str, Any] = field(default_factory=dict)
    iterations: Any = None
    build_time: Any = None
    solve_time: Any = None
    evidence: dict[str, Any] = field(default_factory=dict)


def statuses(codes: Array) -> Array:
    """Object array of Status for an integer array of codes."""
    return np.array(STATUSES, dtype=object)[codes]
