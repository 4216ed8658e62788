"""The verdict on one answer: a table from what was expected, what was said, what was promised and how good it was.

The rules stand once, in `decide`; `VERDICT_TABLE` holds its value in every cell, so that stacks are judged by look-up.

| verdict | when |
|---|---|
| not_run, crashed, timed_out | with the reason |
| false_success | said solved, and: the answer is not finite; or there is nothing to solve; or it is wrong beyond excuse |
| verified | said solved, a minimum exists: within its tolerance, and right to a share (1e-3; default: 2e-2) of its own size |
| undecidable | the margin is within rounding or the solver's tolerance: a refusal, or an answer that meets its own conditions |
| inaccurate | said solved, otherwise |
| limit | ran out of iterations |
| right_refusal | refused, nothing to solve |
| out_of_scope | refused a solvable problem that its documentation does not promise to solve |
| wrong_refusal | refused a solvable problem that its documentation promises to solve |

A margin of 0 excuses what nobody can know, not what anybody can check: an answer that misses its own optimality
conditions is false on either side of the boundary, and one within its tolerance is right on both.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from sandbox.solution import STATUSES, Status

Array = np.ndarray

VERDICTS = (
    "verified", "inaccurate", "false_success", "limit", "right_refusal", "wrong_refusal", "out_of_scope", "undecidable",
    "crashed", "timed_out", "not_run",
)  # fmt: skip
"""All verdicts, in the order in which tables show them."""

EXPECTED = ("unique_minimum", "minimum_not_unique", "no_minimum", "infeasible")
"""What the exact truth says of a problem."""

SAID = ("solved", "limit", "refused", "crashed", "timed_out", "not_run")
"""What a status amounts to."""

GRADES = ("within", "between", "beyond")
"""An error within its tolerance, beyond excuse (`false_by_error`), or between the two."""


def decide(
    expected: str, said: str, promised: bool, finite: bool, near_boundary: bool, conditions_met: bool, grade: str
) -> str:
    """The verdict; first rule that applies.

    expected, said, grade : see EXPECTED, SAID, GRADES
    promised : the documentation promises to solve such a problem
    finite : the answer has no NaN and no infinity
    near_boundary : the margin is below what rounding or the tolerance can decide
    conditions_met : the answer meets its own primal and dual conditions (`residuals_met`)
    """
    solvable = expected in ("unique_minimum", "minimum_not_unique")
    if said in ("crashed", "timed_out", "not_run"):
        return said
    if said == "solved":
        if not finite:
            return "false_success"
        if solvable and grade == "within":
            return "verified"
        if near_boundary and conditions_met:
            return "undecidable"
        if not solvable or grade == "beyond":
            return "false_success"
        return "inaccurate"
    if near_boundary:
        return "undecidable"
    if said == "limit":
        return "limit"
    if not solvable:
        return "right_refusal"
    return "wrong_refusal" if promised else "out_of_scope"


_AXES = (EXPECTED, SAID, (False, True), (False, True), (False, True), (False, True), GRADES)

VERDICT_TABLE = np.array([VERDICTS.index(decide(*cell)) for cell in product(*_AXES)], dtype=np.int8).reshape(
    [len(axis) for axis in _AXES]
)
"""Code into VERDICTS for every cell, axes in the order of decide's arguments."""

SAID_OF_STATUS = np.array(
    [
        SAID.index(
            {
                Status.SOLVED: "solved",
                Status.LIMIT: "limit",
                Status.CRASHED: "crashed",
                Status.TIMED_OUT: "timed_out",
                Status.NOT_RUN: "not_run",
            }.get(status, "refused")
        )
        for status in STATUSES
    ],
    dtype=np.int8,
)
"""Code into SAID for every status code."""

_TRUE_REASONS = {
    "infeasible": {Status.INFEASIBLE, Status.RANK_DEFICIENT},
    "no_minimum": {
        Status.UNBOUNDED,
        Status.NONCONVEX,
        Status.CONDITION_SEVEN,
        Status.NOT_POSITIVE_DEFINITE,
        Status.TARGET_UNBOUNDED,
    },
}
"""Reasons that are true of a problem with nothing to solve: an infeasible xdot needs deficient rows, and where a
minimum is missing W is not positive definite."""

REASON_RIGHT = np.array([[status in _TRUE_REASONS.get(e, set()) for status in STATUSES] for e in EXPECTED])
"""Whether a status gives a true reason, by code of EXPECTED and of status."""


def verdicts(
    expected: Array, status: Array, promised: Array, finite: Array, near_boundary: Array, conditions_met: Array, grade: Array
) -> Array:
    """Codes into VERDICTS for a stack: `expected`, `status` and `grade` as codes, the rest boolean."""
    flags = [np.asarray(flag, dtype=np.int8) for flag in (promised, finite, near_boundary, conditions_met)]
    codes: Array = VERDICT_TABLE[expected, SAID_OF_STATUS[status], *flags, grade]
    return codes
