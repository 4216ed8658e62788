"""The verdict table, every cell of it, against a second statement of the rules."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from sandbox.solution import STATUSES, Status
from sandbox.verdict import EXPECTED, GRADES, REASON_RIGHT, SAID, SAID_OF_STATUS, VERDICT_TABLE, VERDICTS, decide

CELLS = list(product(EXPECTED, SAID, (False, True), (False, True), (False, True), (False, True), GRADES))


def test_every_cell_follows_the_rules() -> None:
    """Each cell has exactly one verdict that its sentence permits, and it is the one in the table."""
    for place, cell in zip(np.ndindex(*VERDICT_TABLE.shape), CELLS, strict=True):
        expected, said, promised, finite, near, met, grade = cell
        minimum = expected.endswith(("minimum", "not_unique")) and expected != "no_minimum"
        permitted = {
            "crashed": said == "crashed",
            "timed_out": said == "timed_out",
            "not_run": said == "not_run",
            "verified": said == "solved" and finite and minimum and grade == "within",
            "false_success": said == "solved"
            and (
                not finite
                or (not (minimum and grade == "within") and not (near and met) and (not minimum or grade == "beyond"))
            ),
            "inaccurate": said == "solved" and finite and minimum and grade == "between" and not (near and met),
            "undecidable": near
            and (said in ("limit", "refused") or (said == "solved" and finite and met and not (minimum and grade == "within"))),
            "limit": said == "limit" and not near,
            "right_refusal": said == "refused" and not near and not minimum,
            "wrong_refusal": said == "refused" and not near and minimum and promised,
            "out_of_scope": said == "refused" and not near and minimum and not promised,
        }
        allowed = [verdict for verdict, holds in permitted.items() if holds]
        assert allowed == [decide(*cell)] == [VERDICTS[VERDICT_TABLE[place]]], cell


def test_table_is_complete() -> None:
    """Every verdict occurs, and the table has a cell for every combination."""
    assert set(VERDICT_TABLE.ravel()) == set(range(len(VERDICTS)))
    assert VERDICT_TABLE.size == len(CELLS)


@pytest.mark.parametrize(
    ("cell", "verdict"),
    [
        (("unique_minimum", "solved", True, True, False, True, "within"), "verified"),
        (("minimum_not_unique", "solved", False, True, True, True, "within"), "verified"),
        (("no_minimum", "solved", True, True, False, True, "within"), "false_success"),
        (("infeasible", "solved", True, True, False, False, "within"), "false_success"),
        (("unique_minimum", "solved", True, False, False, False, "within"), "false_success"),
        (("no_minimum", "solved", True, True, True, True, "beyond"), "undecidable"),
        (("no_minimum", "solved", True, True, True, False, "beyond"), "false_success"),
        (("unique_minimum", "refused", True, False, False, False, "beyond"), "wrong_refusal"),
        (("unique_minimum", "refused", False, False, False, False, "beyond"), "out_of_scope"),
        (("no_minimum", "refused", False, False, False, False, "beyond"), "right_refusal"),
        (("unique_minimum", "limit", True, True, False, False, "beyond"), "limit"),
    ],
)
def test_named_cells(cell: tuple, verdict: str) -> None:
    """The cells that design decisions were made about keep their verdict."""
    assert decide(*cell) == verdict


def test_every_status_says_something() -> None:
    """Each status amounts to one of SAID, and a refusal is a refusal."""
    for code, status in enumerate(STATUSES):
        said = SAID[SAID_OF_STATUS[code]]
        assert (said == "refused") == status.refused
        assert (said == "solved") == status.answered
        assert status.sentence


def test_reasons() -> None:
    """A reason is right where it is true: infeasible rows are no non-convexity, and the other way round."""
    codes = {status: i for i, status in enumerate(STATUSES)}
    right = {e: {s for s in STATUSES if REASON_RIGHT[i, codes[s]]} for i, e in enumerate(EXPECTED)}
    assert right["unique_minimum"] == right["minimum_not_unique"] == set()
    assert Status.INFEASIBLE in right["infeasible"] and Status.UNBOUNDED not in right["infeasible"]
    assert Status.UNBOUNDED in right["no_minimum"] and Status.INFEASIBLE not in right["no_minimum"]
    assert Status.FAILED not in right["infeasible"] | right["no_minimum"]
