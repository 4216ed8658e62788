"""Slopes over the condition that is compounded, and the fault."""

from __future__ import annotations

import numpy as np
import pytest

from sandbox.claims.beyond import closed_forms_in_double
from sandbox.claims.beyond.situation import Situation
from sandbox.claims.claim import State, Trial
from sandbox.closed_form.eq6 import eq6
from sandbox.problem import VelocityProblem
from sandbox.tolerances import FORWARD, UNIT

Array = np.ndarray


def test_the_condition_that_is_compounded_is_that_of_the_normal_equations(drawn: list[Situation]) -> None:
    """cond(J L^-T)^2 = cond(J W^-1 J'), and cond J where W = I."""
    for one in drawn:
        J, found = one.problem.J, closed_forms_in_double.compounded(one.problem)
        squared = np.linalg.cond(J @ np.linalg.inv(one.problem.W.dense()) @ np.swapaxes(J, 1, 2))
        assert np.allclose(found**2, squared, rtol=FORWARD * one.problem.n * UNIT * squared.max(), atol=0)
        if one.weight == "identity":
            assert np.allclose(found, np.linalg.cond(J), rtol=FORWARD * one.problem.n * UNIT * found.max(), atol=0)


@pytest.mark.parametrize("power", [1.0, 2.0])
def test_the_slope_is_that_of_the_badly_conditioned(power: float) -> None:
    """Each stack has a factor of its own, and a floor under the well conditioned does not bend the slope."""
    condition = [np.geomspace(1, 1e4, 5000), np.geomspace(10, 1e6, 5000)]
    error = [1e-16 * np.maximum(condition[0] ** power, 10), 1e-13 * condition[1] ** power]
    error[1][-1] = np.nan
    assert closed_forms_in_double.slope(condition, error) == pytest.approx(power)


def test_the_faulty_equation_is_right_but_for_rounding(drawn: list[Situation]) -> None:
    """Eq. (6) through its own normal equations gives the same rates, with the square of a condition in its error."""
    for one in drawn:
        problem = VelocityProblem(J=one.problem.J, xdot=one.problem.xdot, W=one.problem.W, a=np.ones_like(one.q))
        right, found = eq6(problem).x, closed_forms_in_double.normal_equations_of(eq6)(problem).x
        N = np.linalg.svd(problem.J)[2][:, problem.m :]
        condition = np.linalg.cond(np.concatenate([problem.J, N @ problem.W.dense()], axis=1))
        off = np.abs(found - right).max(axis=1) / np.abs(right).max(axis=1)
        assert (off <= FORWARD * problem.n * UNIT * condition**2).all()
        assert not np.array_equal(found, right)


def test_the_printed_equations_are_held_to_the_square_of_the_condition() -> None:
    """Both ways of computing (2)-(5) count: in the place of explicit inverses, a singular value decomposition is too good."""
    claim = closed_forms_in_double.CLAIM
    evidence = claim.examine(Trial(full=False), eq6, lambda J, xdot, *_: np.linalg.pinv(J) @ xdot)
    assert evidence.state is State.NOT_REPRODUCED
