"""Every closed form on every problem of every standard set, held against exact truth by its own error bound."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from problems import sets
from sandbox.closed_form import CLOSED_FORMS
from sandbox.closed_form.form import POSITIVE_WEIGHT
from sandbox.reference.truth import truth
from sandbox.solution import Status
from sandbox.tolerances import UNDECIDABLE_CLOSED_FORM, UNIT
from sandbox.yardstick import Yardstick

Case = tuple[str, Yardstick]


@pytest.fixture(scope="module")
def cases() -> dict[str, list[Case]]:
    """By task: each group of each set with its truth."""
    found: dict[str, list[Case]] = {"exact": [], "least_squares": [], "damped": []}
    for name in sets.SETS:
        for group in sets.load(name).groups:
            for task in group.tasks:
                found[task].append((name, Yardstick.of(group.problem, task, truth(group.problem, task))))
    return found


@pytest.mark.parametrize("name", CLOSED_FORMS)
def test_within_its_own_bound_or_refused(cases: dict[str, list[Case]], name: str) -> None:
    """Inside its domain it answers within its bound; where there is nothing to solve it refuses."""
    form = CLOSED_FORMS[name]
    count: Counter[str] = Counter()
    for set_name, yardstick in cases[form.task]:
        problem = yardstick.view.problem
        solution, bound = form.function(problem), form.bound(problem)
        solved = np.array([status is Status.SOLVED for status in solution.status])
        decided = yardstick.margin >= UNDECIDABLE_CLOSED_FORM * (problem.n + problem.m) * UNIT
        nothing = ~yardstick.solvable & decided
        assert not solved[nothing].any(), (set_name, "answered where there is nothing to solve")
        inside = yardstick.solvable & decided & (bound < 1)
        if form.domain == POSITIVE_WEIGHT:
            inside &= yardstick.lambda_min_W > UNIT * yardstick.norm_W
        assert solved[inside].all(), (
            set_name,
            "refused inside its domain",
            [solution.said[i] for i in np.flatnonzero(inside & ~solved)],
        )
        answered = solved & yardstick.solvable
        offset = solution.x - yardstick.x
        offset -= (yardstick.freedom @ offset[..., None])[..., 0]
        error = np.abs(offset).max(axis=-1) / np.where(yardstick.size > 0, yardstick.size, 1)
        assert (error <= bound)[answered].all(), (set_name, "beyond its bound", (error / bound)[answered].max())
        count.update(refused=int(nothing.sum()), inside=int(inside.sum()))
    assert count["inside"] >= (100 if form.task == "least_squares" else 250)
    assert count["refused"] >= 9


def test_manufactured_problems_are_covered(cases: dict[str, list[Case]]) -> None:
    """The manufactured set has at least a hundred problems inside the domain of eq. (6), W indefinite in a third of them."""
    inside = [y for name, y in cases["exact"] if name == "manufactured"]
    lowest = np.concatenate([y.lambda_min_W[y.solvable] for y in inside])
    assert len(lowest) >= 100 and (lowest < 0).mean() > 1 / 3
