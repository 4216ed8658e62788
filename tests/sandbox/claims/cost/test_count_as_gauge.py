"""How time is taken."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from sandbox.claims.claim import Role, State, Trial
from sandbox.claims.cost import count_as_gauge
from sandbox.claims.operation_counts import ROWS
from sandbox.closed_form.compiled import compiled
from sandbox.closed_form.uncompiled import eq6_on


def test_the_stopwatch_times_what_is_solved() -> None:
    """Both kernels solve every problem of the stack as eq. (6) does in rationals; times are positive."""
    stack = count_as_gauge.drawn(np.random.default_rng(82), 4, 2, 5)
    seconds, answers = count_as_gauge.stopwatch(compiled, stack, 1)
    assert all(0 < seconds[row] < np.inf for row in ROWS)
    for row in ROWS:
        for i, (J, xdot, W, gradf) in enumerate(zip(*stack, strict=True)):
            _, x, *_ = eq6_on(Fraction, J, xdot, W if row[1] else None, gradf)
            np.testing.assert_allclose(answers[row][i], x.astype(float), rtol=1e-10)
    assert not np.array_equal(answers["eq6", False], answers["eq6", True])


def test_a_stack_with_a_refusal_has_no_answers() -> None:
    """A kernel that gives up early would be timed as fast: the whole stack then counts as not solved."""
    stack = count_as_gauge.drawn(np.random.default_rng(83), 4, 2, 5)
    stack[0][3] = 0
    _, answers = count_as_gauge.stopwatch(compiled, stack, 1)
    assert all(np.isnan(answers[row]).all() for row in ROWS)


def test_work_optimised_away_is_noticed() -> None:
    """Kernels that return at once leave no answers to agree on: the evidence does not stand."""
    claim = count_as_gauge.CLAIM
    evidence = claim.evidence(Trial(full=False), faulty=True)
    assert evidence.state is State.UNSOUND
    assert [check.holds for check in evidence.checks if check.role is Role.OURS] == [False]
