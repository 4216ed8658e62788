"""The textbook's answers against exact arithmetic."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from problems.sets import load, textbook
from sandbox.reference import truth

CASES = {case.name: case for case in textbook.CASES}
PUBLISHED = 1e-8  # digits printed


def given():
    """Each case's name with its problem and task."""
    for group in load("textbook").groups:
        (task,) = group.tasks
        for name, problem in zip(group.labels["case"], group.problem, strict=True):
            yield name, problem, task


GIVEN = {name: (problem, task) for name, problem, task in given()}


def rational(matrix):
    """Entries as fractions."""
    return [[Fraction(float(x)) for x in row] for row in np.atleast_2d(matrix)]


def times(A, x):
    """A x in fractions."""
    return [sum((p * q for p, q in zip(row, x, strict=True)), Fraction(0)) for row in A]


def test_every_case_is_in_the_set_once():
    """The set holds the cases of the table, each under its own name."""
    assert sorted(GIVEN) == sorted(CASES) == sorted(textbook.ANSWERS)
    assert len(textbook.CASES) == len(CASES) == len(load("textbook"))


@pytest.mark.parametrize("name", CASES)
def test_answer_is_the_truth(name):
    """The stated answer is the exact truth, digit for digit; where it is one of many, it is among them."""
    problem, task = GIVEN[name]
    found, answer = truth(problem, task), textbook.ANSWERS[name]
    if answer is None:
        assert found.expected in ("no_minimum", "infeasible")
        return
    freedom = textbook.FREEDOM.get(name, 0)
    assert found.expected == ("minimum_not_unique" if freedom else "unique_minimum")
    assert found.freedom.shape == (problem.n, freedom)
    if not freedom:
        assert found.x_exact == answer
        return
    assert times(rational(problem.J), answer) == [Fraction(float(v)) for v in problem.xdot]
    W = rational(problem.W.dense())  # small integers: formed without rounding
    value = sum(p * (q / 2 + Fraction(float(a))) for p, q, a in zip(answer, times(W, answer), problem.a, strict=True))
    assert value == found.value_exact


@pytest.mark.parametrize("name", textbook.VALUES)
def test_published_value(name):
    """The optimal value is the published one."""
    published, constant = textbook.VALUES[name]
    problem, task = GIVEN[name]
    assert abs(truth(problem, task).value + constant - published) <= PUBLISHED


@pytest.mark.parametrize(
    "name, reason",
    [
        ("F1, W = diag(-2, 1, 1): algorithmic singularity, descending", "descending"),
        ("F1, W = diag(-3, 1, 1): maximum", "maximum"),
        ("F2, W = diag(1, 1, 1, -2): saddle", "saddle"),
        ("F2, W = 3 diag(-8/3, 1, 1, 1): singular, descending", "descending"),
        ("M18: F1, F = (-3/2, 0): buckling", "descending"),
        ("M18: F1, F = (-2, 0): unstable", "maximum"),
        ("F0: not achievable, asked exactly", "inconsistent"),
        ("F0: the target is unbounded below", "target_unbounded"),
        ("x^2 + 4xy + y^2, x + y = 4: maximum", "maximum"),
    ],
)
def test_reason_why_there_is_no_answer(name, reason):
    """Where nothing is to be found, the truth says why as the case does."""
    problem, task = GIVEN[name]
    assert truth(problem, task).reason == reason


def test_decimals_of_methods():
    """Weighted least norm at F1 has the printed decimals."""
    printed = [0.168251391478, -1.168251391478, 1.831748608522]
    answer = [float(x) for x in textbook.ANSWERS["M4: F1, weighted least norm"]]
    np.testing.assert_allclose(answer, printed, atol=1e-12)


def test_multipliers_of_methods():
    """F1 with W = diag(-1, 1, 1) has lam = (-3, -1); CasADi's equality row has 3.2."""
    assert truth(GIVEN["F1, W = diag(-1, 1, 1)"][0]).y_exact == (-3, -1)
    assert truth(GIVEN["CasADi, regression test of equality rows"][0]).y_exact == (Fraction(16, 5),)
