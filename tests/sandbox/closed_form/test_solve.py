"""sandbox.solve: shapes, and errors that say what is wrong, where, and what to do."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from sandbox.closed_form import CLOSED_FORMS
from sandbox.closed_form.solve import REFUSALS, solve
from sandbox.errors import (
    ConditionSevenError,
    IllConditionedError,
    RangeError,
    RankAmbiguousError,
    RankDeficientError,
    UnknownNameError,
    WeightNotPositiveDefiniteError,
)
from sandbox.problem import VelocityProblem
from sandbox.solution import Status

J = [[-1, -1, 0], [2, 1, 1]]


def problem(**fields: object) -> VelocityProblem:
    """The arm F1 with W = I and xdot = (1, 1) unless told otherwise."""
    return VelocityProblem(**{"J": J, "xdot": [1, 1], "W": np.eye(3), **fields})


def test_one_problem_has_plain_shapes() -> None:
    """One problem: x (n,), y (m,), a Status, a str."""
    answer = solve(problem())
    assert answer.x.shape == (3,) and answer.y.shape == (2,)
    assert answer.status is Status.SOLVED and answer.said == ""
    assert answer.evidence["singular_values"].shape == (2,)


def test_a_stack_keeps_its_leading_axes() -> None:
    """A stack of shape (2, 3): every field has it, and each member is its own answer."""
    xdot = np.arange(12.0).reshape(2, 3, 2)
    answer = solve(problem(xdot=xdot), "kkt")
    assert answer.x.shape == (2, 3, 3) and answer.y.shape == (2, 3, 2)
    assert answer.status.shape == answer.said.shape == (2, 3)
    np.testing.assert_allclose(answer.x @ np.array(J).T, xdot, atol=1e-12)
    assert solve(problem(xdot=xdot[:1, :1])).x.shape == (1, 1, 3)


@pytest.mark.parametrize(
    ("fields", "method", "error", "words"),
    [
        ({"W": np.diag([-3, 1, 1])}, "eq6", ConditionSevenError, "smallest .* N'WN is -0.333333 .*maximum.*exceeds 0.333"),
        ({"W": np.diag([-2, 1, 1])}, "null_space", ConditionSevenError, "N'WN is singular"),
        ({"J": [[0, 0, 1]], "xdot": [1], "W": np.diag([-2, 1, 1])}, "kkt", ConditionSevenError, r"is -2 \(.* 1\).*saddle"),
        ({"J": [[1, 0, 0], [2, 0, 0]]}, "eq6", RankDeficientError, r'singular values are \(2.23607, 0\).*eq13'),
        ({"J": np.ones((4, 3)), "xdot": np.ones(4)}, "finsler", RankDeficientError, "4 x 3: more rows than joints.*eq13"),
        ({"J": [[1, 0, 0], [1, 1e-13, 0]]}, "eq13", RankAmbiguousError, "no gap of 1000.*rank_tolerance"),
        ({"W": np.diag([-1, 1, 1])}, "eq2_5", WeightNotPositiveDefiniteError, "not positive definite.*eq6.*condition"),
        ({"Wx": np.diag([1, -1])}, "eq13", WeightNotPositiveDefiniteError, "Wx is not positive definite on range J"),
        ({"J": [[1, 1, 0], [1, 1 + 1e-8, 0]]}, "eq2_5", IllConditionedError, "square the condition.*damped_least_squares"),
    ],
    ids=lambda value: value if isinstance(value, str) and len(value) < 20 else "",
)  # fmt: skip
def test_refusals_say_what_and_what_to_do(fields: dict, method: str, error: type, words: str) -> None:
    """Each refusal is its own error; its message holds the evidence and the way out; the status agrees with it."""
    with pytest.raises(error, match=words) as caught:
        solve(problem(**fields), method)
    assert "Way out" in str(caught.value) and caught.value.evidence["index"] == ()
    answer = solve(problem(**fields), method, on_refusal="status")
    assert REFUSALS[answer.status][0] is error and answer.status is caught.value.evidence["status"]
    assert answer.said in str(caught.value) and np.isnan(answer.x).all()


def test_the_first_refused_member_is_named() -> None:
    """In a stack the error names the first member refused and how many there are, with its own evidence."""
    W = np.broadcast_to(np.eye(3), (2, 3, 3, 3)).copy()
    W[0, 2], W[1, 1] = np.diag([-3, 1, 1]), np.diag([-4, 1, 1])
    with pytest.raises(ConditionSevenError, match=r"member \[0, 2\] \(the first of 2 refused\)") as caught:
        solve(problem(W=W))
    assert caught.value.evidence["index"] == (0, 2)
    assert caught.value.evidence["lambda_min"] == pytest.approx(-1 / 3)
    assert caught.value.evidence["stationary_point"] == "maximum"
    answer = solve(problem(W=W), on_refusal="status")
    assert np.isfinite(answer.x).all(axis=-1).sum() == 4
    assert answer.evidence["lambda_min_reduced"][1, 1] == pytest.approx(-2 / 3)


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"method": "eq7"}, UnknownNameError, "no closed form is called 'eq7'; there are: .*eq6"),
        ({"on_refusal": "ignore"}, UnknownNameError, "raise, status"),
        ({"rank_tolerance": 1e-6}, UnknownNameError, "no option of eq6 is called 'rank_tolerance'"),
        ({"method": "eq13", "damping": 0.5}, UnknownNameError, "'damping'; there are: rank_tolerance"),
        ({"method": "eq13", "rank_tolerance": 1.0}, RangeError, "rank_tolerance is 1.0"),
        ({"method": "damped_least_squares", "damping": -1.0}, RangeError, "damping is -1.0"),
        ({"method": "damped_least_squares", "damping": np.nan}, RangeError, "damping is nan"),
    ],
)  # fmt: skip
def test_options_are_not_lost_silently(options: dict, error: type, words: str) -> None:
    """An unknown name, or an option that the method does not take, is an error."""
    with pytest.raises(error, match=words):
        solve(problem(), **options)


def test_the_table_is_complete() -> None:
    """Every file with a closed form has its row, under its own name, with words in every column."""
    for name, form in CLOSED_FORMS.items():
        assert form.name == name == form.function.__name__
        assert form.task in ("exact", "least_squares", "damped")
        assert all((form.domain, form.bound_text, form.about, form.source))


def test_importing_loads_no_compiler() -> None:
    """`import sandbox.closed_form.solve` does not import numba: it is loaded by the first solve that needs it."""
    code = "import sys, sandbox.closed_form.solve; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
