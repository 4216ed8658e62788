"""One case in full: what was kept comes back, and is told without loss."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from problems import sets
from sandbox.case import Case, as_json, read_case, repeat_command, text
from sandbox.errors import InputFileError, UnknownNameError
from sandbox.plan import chosen
from sandbox.problem import VelocityProblem
from sandbox.problem_set import Group, ProblemSet
from sandbox.records import read_table
from sandbox.run_folder import carry_out


@pytest.fixture(scope="module")
def problems() -> ProblemSet:
    """The textbook set: factored and plain weights, with and without Wx, all three tasks."""
    return sets.load("textbook")


@pytest.fixture(scope="module")
def run(problems: ProblemSet, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of it."""
    folder = tmp_path_factory.mktemp("case") / "run"
    carry_out(chosen([problems], ["numpy:lstsq", "closed_form:eq6"], None), folder, command="sandbox run textbook")
    return folder


@pytest.fixture(scope="module")
def case(run: Path) -> Case:
    """A case with a unique minimum and an answer that is not representable."""
    ids = [row["problem"] for row in read_table(run, "problems").to_pylist() if row["case"].startswith("M2: F1, first")]
    return read_case(run, ids[0])


def parts(problem: VelocityProblem) -> list[bytes | None]:
    """Every array of one problem, as bytes."""
    arrays = (problem.J, problem.xdot, problem.W.base, problem.W.E, problem.W.gamma, problem.a, problem.Wx)
    return [None if array is None else array.tobytes() for array in arrays]


def test_problems_come_back_bit_for_bit(problems: ProblemSet, run: Path) -> None:
    """Every problem of a run is rebuilt as it was posed, by its id and by the shortest beginning of one."""
    members = [(id, group.problem[i]) for group in problems.groups for i, id in enumerate(group.ids())]
    assert len(members) > 50
    everyone = {id for id, _ in members}
    for id, problem in members:
        length = next(k for k in range(1, 17) if sum(other.startswith(id[:k]) for other in everyone) == 1)
        found = read_case(run, id[:length])
        assert found.id == id
        assert parts(found.problem) == parts(problem)


def test_truth_is_that_of_the_run(run: Path) -> None:
    """The truth decided anew is the one that was kept, for every task."""
    kept = read_table(run, "truth").to_pylist()
    for row in kept[::5]:
        found = read_case(run, row["problem"]).truths[row["task"]]
        assert (found.expected, found.reason, found.rank) == (row["expected"], row["reason"], row["rank"])
        assert (None if found.x is None else found.x.tolist()) == row["x"]


def test_records_are_all_of_the_problem(run: Path, case: Case) -> None:
    """A case holds every record of its problem, and a choice of them by backend, formulation and level."""
    of_run = read_table(run, "records", ["problem"])["problem"].to_pylist().count(case.id)
    assert len(case.records) == of_run > 2
    assert {row["backend"] for row in case.chosen("closed_form", None, None)} == {"closed_form:eq6"}
    assert len(case.chosen("numpy:lstsq", "direct", "high_accuracy")) == 1


def test_unknown_ids_name_the_nearest(run: Path, case: Case) -> None:
    """A wrong id is refused with the ids that are nearest, and a beginning that several share with some of them."""
    wrong = case.id[:-1] + ("0" if case.id[-1] != "0" else "1")
    with pytest.raises(UnknownNameError, match=case.id):
        read_case(run, wrong)
    with pytest.raises(UnknownNameError, match=r"problems of .* begin with ''"):
        read_case(run, "")
    with pytest.raises(UnknownNameError, match=r"there are: .*numpy:lstsq"):
        case.chosen("osqp", None, None)


def test_no_run_folder_is_refused(tmp_path: Path) -> None:
    """A folder without run.json is no run, one without problems has no case."""
    with pytest.raises(InputFileError, match="no run folder"):
        read_case(tmp_path, "0")
    (tmp_path / "run.json").write_text('{"format": 1}')
    with pytest.raises(InputFileError, match="holds no problem"):
        read_case(tmp_path, "0")


def test_changed_numbers_are_noticed(run: Path, case: Case, tmp_path: Path) -> None:
    """Numbers that do not have the content hash of their id are refused."""
    damage(run, case.id, "problems", lambda row: row["xdot"].__setitem__(0, row["xdot"][0] + 2.0**-20), tmp_path)
    with pytest.raises(InputFileError, match="content hash"):
        read_case(tmp_path, case.id)


def damage(run: Path, id: str, kind: str, change: Callable[[dict[str, Any]], None], folder: Path) -> None:
    """A copy of `run` in `folder` in which the rows of problem `id` in one kind of file are changed."""
    shutil.copytree(run, folder, dirs_exist_ok=True)
    shutil.rmtree(folder / kind)
    (folder / kind).mkdir()
    table = read_table(run, kind)
    rows = table.to_pylist()
    for row in rows:
        if row["problem"] == id:
            change(row)
    pq.write_table(pa.Table.from_pylist(rows, schema=table.schema), folder / kind / "changed.parquet")


DAMAGE: dict[str, tuple[str, dict[str, Any], str]] = {
    "short J": ("problems", {"J": [1.0, 2.0]}, "is damaged: cannot reshape"),
    "no J": ("problems", {"J": None}, "is damaged: J must hold real numbers, but J is None"),
    "null in J": ("problems", {"J": [1.0, None, 1, 1, 1, 1]}, r"is damaged: J must hold real numbers, but J\[0, 1\] is None"),
    "NaN": ("problems", {"xdot": [float("nan"), 1.0]}, r"is damaged: xdot\[0\] is nan"),
    "no size": ("problems", {"m": None}, "is damaged: "),
    "half a factor": ("problems", {"k": 1, "W_gamma": [1.0]}, "is damaged: W_gamma is given without W_E"),
    "a task that is none": ("truth", {"task": "best"}, "has a task 'best'; there are: exact"),
    "no task": ("truth", {"task": None}, "has a task None"),
    "a status that is none": ("records", {"status": "happy"}, "has a status 'happy'; there are: solved"),
    "no status": ("records", {"status": None}, "has a status None"),
}


@pytest.mark.parametrize("name", DAMAGE)
def test_damage_is_told_with_run_and_problem(name: str, run: Path, case: Case, tmp_path: Path) -> None:
    """A row that cannot be what was kept is an InputFileError that names the run and the problem."""
    kind, change, words = DAMAGE[name]
    damage(run, case.id, kind, lambda row: row.update(change), tmp_path)
    with pytest.raises(InputFileError, match=words) as caught:
        read_case(tmp_path, case.id)
    assert str(caught.value).startswith(str(tmp_path)) and case.id in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_problem_without_id_is_told(run: Path, case: Case, tmp_path: Path) -> None:
    """A null in the column of ids is damage, not a crash."""
    damage(run, case.id, "problems", lambda row: row.update(problem=None), tmp_path)
    with pytest.raises(InputFileError, match="holds a problem without an id"):
        read_case(tmp_path, case.id)


def test_json_is_strict_and_loses_nothing(case: Case) -> None:
    """The JSON form has no NaN, and its numbers read back as the same floats."""
    content = json.loads(json.dumps(as_json(case), allow_nan=False))
    assert np.array(content["J"]).tobytes() == case.problem.J.tobytes()
    assert np.array(content["W"]).tobytes() == case.problem.W.dense().tobytes()
    right = case.truths["exact"]
    assert right.x is not None
    assert content["truth"]["exact"]["x"] == right.x.tolist()
    assert content["truth"]["exact"]["x_exact"] == ["1/6", "-7/6", "5/6"]  # methods.md M2, F1
    assert len(content["records"]) == len(case.records)
    assert len(as_json(case, formulation="direct")["records"]) == 1


def test_nan_becomes_null(case: Case) -> None:
    """A number that JSON cannot hold is null."""
    record = {**case.records[0], "error": float("nan"), "qdot": [1.0, float("inf")]}
    told = as_json(replace(case, records=[record]))["records"][0]
    assert told["error"] is None
    assert told["qdot"] == [1.0, None]


def test_text_shows_everything_with_seventeen_digits(case: Case) -> None:
    """The text names class, truth, exact fractions, and what each record says, digits and all."""
    shown = text(case)
    right = case.truths["exact"]
    assert right.x is not None
    for words in (case.id, "unique_minimum", "condition_7", "1/6  -7/6  5/6", f"{right.x[0]:.17g}", f"{right.margin:.17g}"):
        assert words in shown
    record = case.chosen("numpy:lstsq", "direct", None)[0]
    only = text(case, backend="numpy:lstsq", formulation="direct")
    for value in (*record["qdot"], record["error"], record["tolerance"], record["runtime"]):
        assert f"{value:.17g}" in only
    assert f"1 of {len(case.records)} records" in only
    assert str(repeat_command(case, record)) in only


def test_words_of_a_solver_cannot_steer_the_terminal(case: Case) -> None:
    """Control characters that a solver printed are not passed on."""
    record = {**case.records[0], "said": "\x1b[2Jall \x07clear\r\nverified"}
    shown = text(replace(case, records=[record]))
    assert "?[2Jall ?clear verified" in shown
    assert "\x1b" not in shown


def test_factored_weights_are_shown_by_their_factors(tmp_path: Path) -> None:
    """W_base, W_E and W_gamma come back and are shown, for a problem that has them."""
    factored = next(group for group in sets.load("textbook").groups if group.problem.W.factored)
    group = Group(factored.problem[:1], tasks=("exact",))
    carry_out(chosen([ProblemSet("one", (group,))], ["numpy:lstsq"], ["direct"]), tmp_path / "run", command="")
    found = read_case(tmp_path / "run", group.ids()[0])
    assert found.problem.W.factored
    assert "W = W_base + W_E' W_gamma W_E" in text(found)
