"""What holds for every method: framework and original agree, shifts of W change nothing, casts are fast."""

from __future__ import annotations

import time

import numpy as np
import pytest

from problems import robots
from problems.methods import METHODS, load
from sandbox.agreement import SHIFTS, study
from sandbox.closed_form import CLOSED_FORMS
from sandbox.errors import UnknownNameError

ROBOTS = ("planar_3r", "planar_4r", "panda")
SITUATIONS = 200
MANY = 10_000
SECONDS = 2.0

EACH = pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)


def test_all_rows_are_there():
    """M1 to M20 and C1 to C3, each once, found by name and by id."""
    assert [m.id for m in METHODS.values()] == [f"M{i}" for i in range(1, 21)] + [f"C{i}" for i in range(1, 4)]
    assert all(load(m.id) is load(m.name) is load(m.id.lower()) is m for m in METHODS.values())
    with pytest.raises(UnknownNameError, match="no method is called 'M21'"):
        load("M21")


@EACH
def test_a_row_says_what_it_is(method):
    """Formula, W, a, condition (7), attribution and refusals stand in the row; what is certain names its number."""
    assert all((method.formula, method.weight, method.vector, method.condition, method.works, method.refuses))
    assert method.number or method.certainty != "certain"
    assert (method.form in CLOSED_FORMS and CLOSED_FORMS[method.form].task == method.task) or method.id in ("C2", "C3")


@EACH
@pytest.mark.parametrize("robot", ROBOTS)
def test_framework_and_original_agree(method, robot):
    """Within the sum of their bounds, as cast and after J'AJ and J'B + B'J shifts, in every generic situation."""
    rows = study(method, robots.load(robot), count=SITUATIONS)
    assert {row["shift"] for row in rows} == ({None, *SHIFTS} if method.form == "eq6" else {None})
    for row in rows:
        assert row["held"] + row["refused"] == SITUATIONS
        assert row["agreed"] == row["held"]
        assert row["held"] > 0
        if row["shift"]:
            assert row["indefinite"] > 0.9 * SITUATIONS


@EACH
def test_ten_thousand_panda_configurations_are_cast_in_seconds(method):
    """J, W and a of 10,000 configurations, compiled functions being there already."""
    panda = robots.load("panda")
    drawn = method.draw(panda, np.random.default_rng(1), MANY)
    method.cast(panda, drawn.q, drawn.xdot, **drawn.parameters)
    start = time.perf_counter()
    method.cast(panda, drawn.q, drawn.xdot, **drawn.parameters)
    assert time.perf_counter() - start < SECONDS
