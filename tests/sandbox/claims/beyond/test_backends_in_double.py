"""The campaign: its set, its records read back, and what they count for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from sandbox.backends import BACKENDS
from sandbox.case import read_case
from sandbox.claims.beyond import backends_in_double, beside_six, deviation, situation
from sandbox.claims.beyond.backends_in_double import Records
from sandbox.claims.claim import Role, Trial
from sandbox.claims.exhibit import Table
from sandbox.closed_form.eq6 import eq6
from sandbox.problem_set import ProblemSet
from sandbox.records import read_run, read_table
from sandbox.tolerances import FORWARD, UNIT

Array = np.ndarray
Exact = Callable[[Array, Array, Array], list[Fraction]]

TRIAL = Trial(full=False, seed=1)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the reduced campaign was kept."""
    place = tmp_path_factory.mktemp("paper")
    backends_in_double.campaign(replace(TRIAL, folder=place), _posed())
    return place / "accuracy"


@pytest.fixture(scope="module")
def records(folder: Path) -> Records:
    """Its records."""
    return Records.read(folder, _posed())


def _posed() -> ProblemSet:
    return backends_in_double.section_v(situation.situations(TRIAL.rng("backends_in_double"), 1), TRIAL.seed)


def test_the_set_is_made_of_short_numbers() -> None:
    """The same draw has the same ids, and last bits that differ between machines are cut off."""
    posed = _posed()
    assert (
        backends_in_double.ids(posed) == backends_in_double.ids(_posed())
        and len(set(backends_in_double.ids(posed))) == len(posed) == 9
    )
    for group in posed.groups:
        for part in (group.problem.J, group.problem.xdot, group.problem.W.base):
            assert np.array_equal(part * 2.0**30, np.round(part * 2.0**30))


def test_every_case_of_the_campaign_can_be_opened(folder: Path) -> None:
    """It is an ordinary run: run.json, and each problem with what every backend and closed form made of it."""
    assert read_run(folder)["complete"] and [one["name"] for one in read_run(folder)["sets"]] == ["section_v"]
    for name in backends_in_double.ids(_posed()):
        case = read_case(folder, name)
        answered = {row["backend"] for row in case.records}
        assert answered == {*backends_in_double.FAST, *(f"closed_form:{form}" for form in beside_six.FORMS)}


def test_records_are_read_back_to_their_own_problems(folder: Path, records: Records, exact_residual: Exact) -> None:
    """The task error of each is that of the exact arithmetic on the numbers in the files."""
    problems = {row["problem"]: row for row in read_table(folder, "problems").to_pylist()}
    kept = {(row["problem"], row["backend"]): row for row in read_table(folder, "records").to_pylist()}
    assert len(records.backend) == 9 * len(backends_in_double.FAST)
    assert all(
        backends_in_double.ids(_posed())[place] == name for place, name in zip(records.place, records.problem, strict=True)
    )
    for name, backend, error, rate in zip(records.problem, records.backend, records.task, records.rates, strict=True):
        problem, row = problems[name], kept[name, backend]
        J = np.reshape(problem["J"], (problem["m"], problem["n"]))
        exact = exact_residual(J, np.array(row["qdot"]), np.array(problem["xdot"]))
        size = sum(Fraction(value) ** 2 for value in problem["xdot"])
        assert error == pytest.approx(float(sum(value**2 for value in exact) / size) ** 0.5, rel=FORWARD * UNIT)
        assert rate == row["error"]
    assert (records.apart <= 1).all()


def test_an_answer_in_the_place_of_another_is_noticed(records: Records) -> None:
    """Records that went with the wrong problem do not agree with the residual that was kept."""
    posed = _posed()
    problem = posed.groups[3].problem
    x = eq6(posed.groups[4].problem).x
    recorded = np.abs(deviation.residual(posed.groups[4].problem.J, x, posed.groups[4].problem.xdot)).max(axis=-1)
    assert (deviation.disagreement(posed.groups[4].problem, x, recorded) == 0).all()
    assert (deviation.disagreement(problem, x + 1e-6, recorded) > 1).all()


def test_a_backend_that_never_answers_is_shown_and_counts_for_nobody(records: Records, monkeypatch: pytest.MonkeyPatch) -> None:
    """Time-outs and crashes leave the claim as it is; they stand in the table, after all that answered."""
    lost, some = records.backend == "osqp", records.place == 0
    nothing = np.where(lost | some, np.nan, records.task)
    struck = replace(
        records, verdict=np.where(lost | some, "timed_out", records.verdict), task=nothing, rates=nothing, apart=nothing
    )
    monkeypatch.setattr(backends_in_double, "campaign", lambda trial, posed: struck)
    evidence = backends_in_double.CLAIM.evidence(TRIAL)
    assert not evidence.state.red
    reached = [check for check in evidence.checks if check.role is Role.REACH]
    assert [check.count for check in reached] == [len(backends_in_double.FAST) - 1] * 2
    table = next(one for one in evidence.exhibits if isinstance(one, Table))
    assert table.rows[-1][0] == "osqp" and table.rows[-1][-2] == "timed_out 9" and table.rows[-1][3] is None
    assert sum("timed_out 1" in str(row[-2]) for row in table.rows) == len(backends_in_double.FAST) - 1


def test_the_range_counts_the_backends_and_names_the_better_ones(records: Records) -> None:
    """An error of (6) above all of theirs, below all of theirs, and between."""
    none = records[np.zeros(0, dtype=int)]
    assert not backends_in_double.as_accurate_as_any("error", np.ones(9), none, none.task).holds
    for level, ahead, held in ((1e-30, 0, 6), (1e3, 6, 0)):
        check = backends_in_double.as_accurate_as_any("error", np.full(9, level), records, records.task)
        assert check.count == 6 and check.holds == (ahead == 0) and f"{held} in both" in check.range
        assert sum(name in check.range for name in backends_in_double.FAST) == ahead
    six = np.full(9, np.inf)
    one = records.backend == "numpy:lstsq"
    six[records.place[one]] = 1.5 * records.task[one]
    better = backends_in_double.as_accurate_as_any("error", six, records, np.where(one, records.task, 1.0))
    assert "5 in both" in better.range and "numpy:lstsq (1.5 and 1.5)" in better.range


def test_every_backend_is_of_one_kind() -> None:
    """The nonlinear programming solvers are those whose method says nothing else."""
    kinds = {name: backends_in_double.family(name) for name in BACKENDS}
    assert set(kinds.values()) == {*backends_in_double.FAMILIES, "nonlinear programming"}
    assert {name for name, kind in kinds.items() if kind == "KKT system"} == {"numpy:lstsq"}
    assert kinds["casadi:ipopt"] == "interior point" and kinds["scipy:slsqp"] == "nonlinear programming"
