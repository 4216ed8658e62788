"""The accuracy study beyond the paper: errors in twice the precision, slopes, and the records read back."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.backends import BACKENDS
from sandbox.case import read_case
from sandbox.claims import beyond
from sandbox.claims.beyond import Records, Situation
from sandbox.claims.claim import Claim, Role, State, Trial
from sandbox.claims.exhibit import Table
from sandbox.closed_form.eq6 import eq6
from sandbox.problem import VelocityProblem
from sandbox.problem_set import ProblemSet
from sandbox.records import read_run, read_table
from sandbox.tolerances import FORWARD, UNIT

Array = np.ndarray

TRIAL = Trial(full=False, seed=1)

NUMBERS = st.floats(-1e60, 1e60).filter(lambda value: value == 0 or abs(value) > 1e-60)


@pytest.fixture(scope="module")
def drawn() -> list[Situation]:
    """Every arm and weight at a few configurations."""
    return beyond.situations(np.random.default_rng(0), 40)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the reduced campaign was kept."""
    place = tmp_path_factory.mktemp("paper")
    beyond.campaign(replace(TRIAL, folder=place), _posed())
    return place / "accuracy"


@pytest.fixture(scope="module")
def records(folder: Path) -> Records:
    """Its records."""
    return Records.read(folder, _posed())


def _posed() -> ProblemSet:
    return beyond.section_v(beyond.situations(TRIAL.rng("backends_in_double"), 1), TRIAL.seed)


# ---- twice the precision -------------------------------------------------------------------------------------


@given(NUMBERS, NUMBERS)
def test_a_sum_and_a_product_lose_nothing(a: float, b: float) -> None:
    """What is rounded and what that lost add up to the exact sum, the exact product."""
    total, rest = beyond.two_sum(np.array(a), np.array(b))
    assert Fraction(float(total)) + Fraction(float(rest)) == Fraction(a) + Fraction(b)
    product, below = beyond.two_product(np.array(a), np.array(b))
    assert Fraction(float(product)) + Fraction(float(below)) == Fraction(a) * Fraction(b)


def test_the_residual_has_all_its_digits_where_plain_arithmetic_has_none(drawn: list[Situation]) -> None:
    """J qdot - xdot of an answer right to the last bit is all rounding; twice the digits leave it right to its own last bit."""
    plain_errors = []
    for situation in drawn:
        problem = situation.problem
        x = eq6(problem).x
        found, plain = beyond.residual(problem.J, x, problem.xdot), (problem.J @ x[..., None])[..., 0] - problem.xdot
        for i in range(len(problem)):
            exact = _exact_residual(problem.J[i], x[i], problem.xdot[i])
            terms = np.abs(problem.J[i]) @ np.abs(x[i]) + np.abs(problem.xdot[i])
            for j, value in enumerate(exact):
                off = abs(Fraction(float(found[i, j])) - value)
                assert off <= 2 * Fraction(UNIT) * abs(value) + Fraction((problem.n + 2) ** 2 * UNIT**2 * terms[j])
                if value:
                    plain_errors.append(float(abs(Fraction(float(plain[i, j])) - value) / abs(value)))
    assert np.median(plain_errors) > 0.1


def _exact_residual(J: Array, x: Array, xdot: Array) -> list[Fraction]:
    return [
        sum((Fraction(a) * Fraction(b) for a, b in zip(row, x.tolist(), strict=True)), -Fraction(right))
        for row, right in zip(J.tolist(), xdot.tolist(), strict=True)
    ]


def test_the_task_error_is_relative_and_missing_where_there_is_no_answer(drawn: list[Situation]) -> None:
    """Twice the velocity and twice the rates have the same error; NaN stays NaN."""
    problem = drawn[0].problem
    x = eq6(problem).x
    x[3] = np.nan
    double = VelocityProblem(J=problem.J, xdot=2 * problem.xdot, W=problem.W, a=problem.a)
    error = beyond.task_error(problem, x)
    assert np.array_equal(error, beyond.task_error(double, 2 * x), equal_nan=True)
    assert np.flatnonzero(np.isnan(error)).tolist() == [3]
    assert np.array_equal(beyond.task_error(problem, np.zeros_like(x)), np.ones(len(x)))


# ---- situations ----------------------------------------------------------------------------------------------


def test_situations_are_those_of_section_v(drawn: list[Situation]) -> None:
    """Three arms under three weights; unit velocities, no gradient, the same configurations under every weight."""
    assert [(one.arm, one.weight) for one in drawn] == [
        (arm, weight) for arm in beyond.ARMS for weight in ("identity", "random", "inertia")
    ]
    for plain, *others in (drawn[k : k + 3] for k in (0, 3, 6)):
        assert np.allclose(np.linalg.norm(plain.problem.xdot, axis=1), 1, rtol=4 * UNIT, atol=0)
        assert not plain.problem.a.any()
        assert np.array_equal(plain.problem.W.dense(), np.broadcast_to(np.eye(plain.problem.n), plain.problem.W.base.shape))
        for other in others:
            assert np.array_equal(other.problem.J, plain.problem.J) and np.array_equal(other.q, plain.q)


def test_random_weights_are_definite_over_the_decades_they_say(drawn: list[Situation]) -> None:
    """All eigenvalues lie within DECADES, and the draws use most of them."""
    for one in drawn:
        if one.weight == "random":
            values = np.linalg.eigvalsh(one.problem.W.dense())
            spread = np.log10(values[:, -1] / values[:, 0])
            assert values.min() > 0 and 0.6 * beyond.DECADES < spread.max() <= beyond.DECADES + 1e-9


def test_the_condition_that_is_compounded_is_that_of_the_normal_equations(drawn: list[Situation]) -> None:
    """cond(J L^-T)^2 = cond(J W^-1 J'), and cond J where W = I."""
    for one in drawn:
        J, found = one.problem.J, beyond.compounded(one.problem)
        squared = np.linalg.cond(J @ np.linalg.inv(one.problem.W.dense()) @ np.swapaxes(J, 1, 2))
        assert np.allclose(found**2, squared, rtol=FORWARD * one.problem.n * UNIT * squared.max(), atol=0)
        if one.weight == "identity":
            assert np.allclose(found, np.linalg.cond(J), rtol=FORWARD * one.problem.n * UNIT * found.max(), atol=0)


def test_the_set_is_made_of_short_numbers() -> None:
    """The same draw has the same ids, and last bits that differ between machines are cut off."""
    posed = _posed()
    assert beyond.ids(posed) == beyond.ids(_posed()) and len(set(beyond.ids(posed))) == len(posed) == 9
    for group in posed.groups:
        for part in (group.problem.J, group.problem.xdot, group.problem.W.base):
            assert np.array_equal(part * 2.0**30, np.round(part * 2.0**30))


# ---- statistics ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("power", [1.0, 2.0])
def test_the_slope_is_that_of_the_badly_conditioned(power: float) -> None:
    """Each stack has a factor of its own, and a floor under the well conditioned does not bend the slope."""
    condition = [np.geomspace(1, 1e4, 5000), np.geomspace(10, 1e6, 5000)]
    error = [1e-16 * np.maximum(condition[0] ** power, 10), 1e-13 * condition[1] ** power]
    error[1][-1] = np.nan
    assert beyond.slope(condition, error) == pytest.approx(power)


def test_only_problems_that_both_answered_are_compared() -> None:
    """NaN on either side leaves a problem out; where nothing is left there is no number."""
    nothing = np.nan
    six, other = np.array([1.0, 2.0, nothing, 4.0]), np.array([2.0, nothing, 3.0, 2.0])
    assert beyond.nearer(six, other) == 50
    assert beyond.ratios(six, other)[0] == 1.25
    assert np.isnan([beyond.nearer(six, six * nothing), *beyond.ratios(six, six * nothing)]).all()


def test_the_faulty_equation_is_right_but_for_rounding(drawn: list[Situation]) -> None:
    """Eq. (6) through its own normal equations gives the same rates, with the square of a condition in its error."""
    for one in drawn:
        problem = VelocityProblem(J=one.problem.J, xdot=one.problem.xdot, W=one.problem.W, a=np.ones_like(one.q))
        right, found = eq6(problem).x, beyond.normal_equations_of(eq6)(problem).x
        N = np.linalg.svd(problem.J)[2][:, problem.m :]
        condition = np.linalg.cond(np.concatenate([problem.J, N @ problem.W.dense()], axis=1))
        off = np.abs(found - right).max(axis=1) / np.abs(right).max(axis=1)
        assert (off <= FORWARD * problem.n * UNIT * condition**2).all()
        assert not np.array_equal(found, right)


# ---- records -------------------------------------------------------------------------------------------------


def test_every_case_of_the_campaign_can_be_opened(folder: Path) -> None:
    """It is an ordinary run: run.json, and each problem with what every backend and closed form made of it."""
    assert read_run(folder)["complete"] and [one["name"] for one in read_run(folder)["sets"]] == ["section_v"]
    for name in beyond.ids(_posed()):
        case = read_case(folder, name)
        answered = {row["backend"] for row in case.records}
        assert answered == {*beyond.FAST, *(f"closed_form:{form}" for form in beyond.FORMS)}


def test_records_are_read_back_to_their_own_problems(folder: Path, records: Records) -> None:
    """The task error of each is that of the exact arithmetic on the numbers in the files."""
    problems = {row["problem"]: row for row in read_table(folder, "problems").to_pylist()}
    kept = {(row["problem"], row["backend"]): row for row in read_table(folder, "records").to_pylist()}
    assert len(records.backend) == 9 * len(beyond.FAST)
    assert all(beyond.ids(_posed())[place] == name for place, name in zip(records.place, records.problem, strict=True))
    for name, backend, error, rate in zip(records.problem, records.backend, records.task, records.rates, strict=True):
        problem, row = problems[name], kept[name, backend]
        J = np.reshape(problem["J"], (problem["m"], problem["n"]))
        exact = _exact_residual(J, np.array(row["qdot"]), np.array(problem["xdot"]))
        size = sum(Fraction(value) ** 2 for value in problem["xdot"])
        assert error == pytest.approx(float(sum(value**2 for value in exact) / size) ** 0.5, rel=FORWARD * UNIT)
        assert rate == row["error"]
    assert (records.apart <= 1).all()


def test_an_answer_in_the_place_of_another_is_noticed(records: Records) -> None:
    """Records that went with the wrong problem do not agree with the residual that was kept."""
    posed = _posed()
    problem = posed.groups[3].problem
    x = eq6(posed.groups[4].problem).x
    recorded = np.abs(beyond.residual(posed.groups[4].problem.J, x, posed.groups[4].problem.xdot)).max(axis=-1)
    assert (beyond.disagreement(posed.groups[4].problem, x, recorded) == 0).all()
    assert (beyond.disagreement(problem, x + 1e-6, recorded) > 1).all()


def test_a_backend_that_never_answers_is_shown_and_counts_for_nobody(records: Records, monkeypatch: pytest.MonkeyPatch) -> None:
    """Time-outs and crashes leave the claim as it is; they stand in the table, after all that answered."""
    lost, some = records.backend == "osqp", records.place == 0
    nothing = np.where(lost | some, np.nan, records.task)
    struck = replace(
        records, verdict=np.where(lost | some, "timed_out", records.verdict), task=nothing, rates=nothing, apart=nothing
    )
    monkeypatch.setattr(beyond, "campaign", lambda trial, posed: struck)
    evidence = _claim("backends_in_double").evidence(TRIAL)
    assert not evidence.state.red
    reached = [check for check in evidence.checks if check.role is Role.REACH]
    assert [check.count for check in reached] == [len(beyond.FAST) - 1] * 2
    table = next(one for one in evidence.exhibits if isinstance(one, Table))
    assert table.rows[-1][0] == "osqp" and table.rows[-1][-2] == "timed_out 9" and table.rows[-1][3] is None
    assert sum("timed_out 1" in str(row[-2]) for row in table.rows) == len(beyond.FAST) - 1


def _claim(name: str) -> Claim:
    return next(claim for claim in beyond.CLAIMS if claim.name == name)


def test_the_range_counts_the_backends_and_names_the_better_ones(records: Records) -> None:
    """An error of (6) above all of theirs, below all of theirs, and between."""
    none = records[np.zeros(0, dtype=int)]
    assert not beyond.as_accurate_as_any("error", np.ones(9), none, none.task).holds
    for level, ahead, held in ((1e-30, 0, 6), (1e3, 6, 0)):
        check = beyond.as_accurate_as_any("error", np.full(9, level), records, records.task)
        assert check.count == 6 and check.holds == (ahead == 0) and f"{held} in both" in check.range
        assert sum(name in check.range for name in beyond.FAST) == ahead
    six = np.full(9, np.inf)
    one = records.backend == "numpy:lstsq"
    six[records.place[one]] = 1.5 * records.task[one]
    better = beyond.as_accurate_as_any("error", six, records, np.where(one, records.task, 1.0))
    assert "5 in both" in better.range and "numpy:lstsq (1.5 and 1.5)" in better.range


def test_every_backend_is_of_one_kind() -> None:
    """The nonlinear programming solvers are those whose method says nothing else."""
    kinds = {name: beyond.family(name) for name in BACKENDS}
    assert set(kinds.values()) == {*beyond.FAMILIES, "nonlinear programming"}
    assert {name for name, kind in kinds.items() if kind == "KKT system"} == {"numpy:lstsq"}
    assert kinds["casadi:ipopt"] == "interior point" and kinds["scipy:slsqp"] == "nonlinear programming"


# ---- claims --------------------------------------------------------------------------------------------------


def test_the_printed_equations_are_held_to_the_square_of_the_condition() -> None:
    """Both ways of computing (2)-(5) count: in the place of explicit inverses, a singular value decomposition is too good."""
    claim = _claim("closed_forms_in_double")
    evidence = claim.examine(Trial(full=False), eq6, lambda J, xdot, *_: np.linalg.pinv(J) @ xdot)
    assert evidence.state is State.NOT_REPRODUCED
