"""sandbox.solve: one problem or a stack, by a named closed form; refusals raise with their evidence and the way out."""

from __future__ import annotations

from typing import Any

import numpy as np

from sandbox.closed_form import CLOSED_FORMS
from sandbox.errors import (
    ConditionSevenError,
    IllConditionedError,
    RangeError,
    RankAmbiguousError,
    RankDeficientError,
    RefusalError,
    UnknownNameError,
    WeightNotPositiveDefiniteError,
)
from sandbox.problem import VelocityProblem, given
from sandbox.solution import Solution, Status
from sandbox.tolerances import DAMPING

Array = np.ndarray

REFUSALS: dict[Status, tuple[type[RefusalError], str]] = {
    Status.CONDITION_SEVEN: (
        ConditionSevenError, "make W positive along null J: W + c I does once c exceeds {lift:.3g}, or choose another weight"
    ),
    Status.RANK_DEFICIENT: (
        RankDeficientError, 'use method="eq13" for the least-squares sense, or method="damped_least_squares"'
    ),
    Status.RANK_AMBIGUOUS: (
        RankAmbiguousError, 'declare the rank by rank_tolerance=..., or use method="damped_least_squares"'
    ),
    Status.NOT_POSITIVE_DEFINITE: (
        WeightNotPositiveDefiniteError, "use method=\"eq6\", which asks for N'WN > 0 alone (condition (7))"
    ),
    Status.TARGET_UNBOUNDED: (WeightNotPositiveDefiniteError, "choose Wx positive definite on range J"),
    Status.ILL_CONDITIONED: (
        IllConditionedError, 'use method="damped_least_squares", scale the joints to comparable units, or move away'
    ),
}  # fmt: skip
"""What a refusal raises, and the way out of it."""


def solve(
    problem: VelocityProblem,
    method: str = "eq6",
    *,
    on_refusal: str = "raise",
    rank_tolerance: float | None = None,
    damping: float = DAMPING,
) -> Solution:
    """Solve one problem or a stack of any leading shape by the closed form `method`.

    Parameters
    ----------
    method : a name in CLOSED_FORMS; "eq13" for the least-squares sense
    on_refusal : "raise" for the first refused member, or "status" to return NaN and the status instead
    rank_tolerance : for eq13, the share of the largest singular value up to which one counts as zero
    damping : for damped_least_squares, lambda >= 0 [square root of the objective's unit]

    Returns
    -------
    Solution with x (..., n), y (..., m); `status` and `said` are a Status and a str for one problem, object arrays of
    them for a stack; `evidence` holds the eigenvalues of N'WN and singular values of J of refused members.

    Raises
    ------
    ConditionSevenError, RankDeficientError, RankAmbiguousError, WeightNotPositiveDefiniteError, IllConditionedError
        each with the member's index and the evidence.
    UnknownNameError, RangeError
        for an unknown method or option, or an option out of range.
    """
    problem = given(problem)
    if method not in CLOSED_FORMS:
        raise UnknownNameError.of("closed form", method, CLOSED_FORMS)
    if on_refusal not in ("raise", "status"):
        raise UnknownNameError.of("choice of on_refusal", on_refusal, ("raise", "status"))
    asked = {"rank_tolerance": None if rank_tolerance is None else (rank_tolerance, 1.0)}
    asked["damping"] = None if damping == DAMPING else (damping, np.inf)
    takes = {"eq13": ("rank_tolerance",), "damped_least_squares": ("damping",)}.get(method, ())
    options: dict[str, Any] = {}
    for name, value in asked.items():
        if value is None:
            continue
        if name not in takes:
            raise UnknownNameError.of(f"option of {method}", name, takes or ("none",))
        if not 0 <= value[0] < value[1]:
            raise RangeError(f"{name} is {value[0]}; it must be at least 0 and below {value[1]:g}", field=name, value=value[0])
        options[name] = value[0]
    lead = problem.lead
    answer = CLOSED_FORMS[method].function(problem.stacked(), **options)
    if on_refusal == "raise":
        refused = [i for i, status in enumerate(answer.status) if not status.answered]
        if refused:
            raise refusal(answer, refused[0], lead, len(refused))
    return Solution(
        x=answer.x.reshape((*lead, -1)), y=answer.y.reshape((*lead, -1)),
        status=answer.status.reshape(lead) if lead else answer.status[0],
        said=np.array(answer.said, dtype=object).reshape(lead) if lead else answer.said[0],
        evidence={name: values.reshape((*lead, *values.shape[1:])) for name, values in answer.evidence.items()},
    )  # fmt: skip


def refusal(answer: Solution, i: int, lead: tuple[int, ...], count: int) -> RefusalError:
    """The error for member i of a stack of shape `lead`, of which `count` were refused."""
    status: Status = answer.status[i]
    index = tuple(int(part) for part in np.unravel_index(i, lead)) if lead else ()
    evidence = {name: values[i] for name, values in answer.evidence.items()}
    low, high = evidence["lambda_min_reduced"], evidence["lambda_max_reduced"]
    kind, way_out = REFUSALS[status]
    place = f"member {list(index)} (the first of {count} refused): " if lead else ""
    words = answer.said[i]
    stationary = next((name for name in ("saddle", "maximum") if f"the stationary point is a {name}" in words), None)
    return kind(
        f"{place}{words}. Way out: {way_out.format(lift=abs(min(low, 0.0)))}.",
        index=index, status=status, lambda_min=float(low), lambda_max=float(high), stationary_point=stationary,
        singular_values=evidence["singular_values"],
    )  # fmt: skip
