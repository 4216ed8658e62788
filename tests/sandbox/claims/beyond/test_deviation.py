"""Errors in twice the precision, and how those of two methods compare."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sandbox.claims.beyond import deviation
from sandbox.claims.beyond.situation import Situation
from sandbox.closed_form.eq6 import eq6
from sandbox.problem import VelocityProblem
from sandbox.tolerances import UNIT

Array = np.ndarray
Exact = Callable[[Array, Array, Array], list[Fraction]]

NUMBERS = st.floats(-1e60, 1e60).filter(lambda value: value == 0 or abs(value) > 1e-60)


@given(NUMBERS, NUMBERS)
def test_a_sum_and_a_product_lose_nothing(a: float, b: float) -> None:
    """What is rounded and what that lost add up to the exact sum, the exact product."""
    total, rest = deviation.two_sum(np.array(a), np.array(b))
    assert Fraction(float(total)) + Fraction(float(rest)) == Fraction(a) + Fraction(b)
    product, below = deviation.two_product(np.array(a), np.array(b))
    assert Fraction(float(product)) + Fraction(float(below)) == Fraction(a) * Fraction(b)


def test_the_residual_has_all_its_digits_where_plain_arithmetic_has_none(drawn: list[Situation], exact_residual: Exact) -> None:
    """J qdot - xdot of an answer right to the last bit is all rounding; twice the digits leave it right to its own last bit."""
    plain_errors = []
    for one in drawn:
        problem = one.problem
        x = eq6(problem).x
        found, plain = deviation.residual(problem.J, x, problem.xdot), (problem.J @ x[..., None])[..., 0] - problem.xdot
        for i in range(len(problem)):
            exact = exact_residual(problem.J[i], x[i], problem.xdot[i])
            terms = np.abs(problem.J[i]) @ np.abs(x[i]) + np.abs(problem.xdot[i])
            for j, value in enumerate(exact):
                off = abs(Fraction(float(found[i, j])) - value)
                assert off <= 2 * Fraction(UNIT) * abs(value) + Fraction((problem.n + 2) ** 2 * UNIT**2 * terms[j])
                if value:
                    plain_errors.append(float(abs(Fraction(float(plain[i, j])) - value) / abs(value)))
    assert np.median(plain_errors) > 0.1


def test_the_task_error_is_relative_and_missing_where_there_is_no_answer(drawn: list[Situation]) -> None:
    """Twice the velocity and twice the rates have the same error; NaN stays NaN."""
    problem = drawn[0].problem
    x = eq6(problem).x
    x[3] = np.nan
    double = VelocityProblem(J=problem.J, xdot=2 * problem.xdot, W=problem.W, a=problem.a)
    error = deviation.task_error(problem, x)
    assert np.array_equal(error, deviation.task_error(double, 2 * x), equal_nan=True)
    assert np.flatnonzero(np.isnan(error)).tolist() == [3]
    assert np.array_equal(deviation.task_error(problem, np.zeros_like(x)), np.ones(len(x)))


def test_only_problems_that_both_answered_are_compared() -> None:
    """NaN on either side leaves a problem out; where nothing is left there is no number."""
    nothing = np.nan
    six, other = np.array([1.0, 2.0, nothing, 4.0]), np.array([2.0, nothing, 3.0, 2.0])
    assert deviation.nearer(six, other) == 50
    assert deviation.ratios(six, other)[0] == 1.25
    assert np.isnan([deviation.nearer(six, six * nothing), *deviation.ratios(six, six * nothing)]).all()
