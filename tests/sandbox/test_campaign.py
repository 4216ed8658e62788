"""A campaign end to end: run folder, records, baseline, interruption, library use."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pytest

import sandbox
from problems import sets
from sandbox import baseline, records
from sandbox.backends import BACKENDS
from sandbox.backends.backend import Backend, Promise
from sandbox.campaign import Agenda
from sandbox.errors import InputFileError, UnknownNameError
from sandbox.plan import chosen
from sandbox.problem_set import problem_ids
from sandbox.run_folder import carry_out
from tests.fakes import unruly_

FAST = ["numpy", "osqp", "proxsuite:dense", "closed_form"]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Textbook and rank_deficient through fast backends and all closed forms, at two settings levels."""
    out = tmp_path_factory.mktemp("run") / "r"
    plan = chosen([sets.load("textbook"), sets.load("rank_deficient")], FAST, None, ["high_accuracy", "default"])
    carry_out(plan, out, command="test")
    return out


def column(table: pa.Table, name: str) -> list:
    return table[name].to_pylist()


def test_a_run_folder_is_complete(run: Path) -> None:
    """run.json says what was run, and the three kinds of tables agree on the problems."""
    content = records.read_run(run)
    assert content["complete"] and content["finished"]
    assert [s["name"] for s in content["sets"]] == ["textbook", "rank_deficient"]
    asked = [row for row in content["backends"] if BACKENDS[row["name"]].expected == "runs"]
    assert {row["name"] for row in asked} == {"numpy:lstsq", "osqp", "proxsuite:dense"}
    assert all(row["state"] == "ran" and row["engine_version"] for row in asked)
    assert all(row["state"] == "not_run" and row["why"] for row in content["backends"] if row not in asked)
    rows, problems, truths = (records.read_table(run, kind) for kind in ("records", "problems", "truth"))
    ids = set(column(problems, "problem"))
    assert len(ids) == problems.num_rows == len(sets.load("textbook")) + len(sets.load("rank_deficient"))
    assert set(column(rows, "problem")) == set(column(truths, "problem")) == ids
    assert rows.schema == records.RECORDS
    assert not list(run.rglob(".*"))  # no temporary file stays


def test_nothing_is_nan(run: Path) -> None:
    """Null where a column has no meaning, never NaN or infinity."""
    rows = records.read_table(run, "records")
    for field in rows.schema:
        if pa.types.is_floating(field.type):
            assert pc.all(pc.is_finite(pc.drop_null(rows[field.name]))).as_py() in (True, None), field.name


def test_every_posed_problem_has_its_record(run: Path) -> None:
    """Each backend, formulation of the task and level has one record per problem; each closed form one per problem."""
    rows = records.read_table(run, "records")
    keys = list(zip(*(column(rows, k) for k in ("problem", "task", "backend", "formulation", "settings")), strict=True))
    assert len(keys) == len(set(keys))
    exact = sum(len(g) for name in ("textbook", "rank_deficient") for g in sets.load(name).groups if "exact" in g.tasks)
    assert sum(1 for key in keys if key[2:] == ("osqp", "direct", "default")) == exact
    assert sum(1 for key in keys if key[2] == "closed_form:eq6") == exact


def test_closed_forms_do_not_fall(run: Path) -> None:
    """No closed form exceeds its bound, answers what has no answer, or refuses a problem of its domain."""
    assert baseline.fallen(run, run / "none.parquet") == []


def test_problems_are_kept_bit_for_bit(run: Path) -> None:
    """What is read back from the folder has the content hash it is filed under."""
    table = records.read_table(run, "problems").to_pylist()
    for row in table[:: len(table) // 20]:
        n, m = row["n"], row["m"]
        shaped = {"J": (m, n), "W_base": (n, n), "Wx": (m, m), "W_E": (-1, n), "W_gamma": (row["k"], row["k"])}
        parts = {k: None if row[k] is None else np.array(row[k]).reshape(s) for k, s in shaped.items()}
        weight = sandbox.Weight(parts["W_base"], parts["W_E"], parts["W_gamma"])
        problem = sandbox.VelocityProblem(J=parts["J"], xdot=row["xdot"], W=weight, a=row["a"], Wx=parts["Wx"])
        assert problem_ids(problem) == [row["problem"]]


def test_the_baseline_catches_a_fall(run: Path, tmp_path: Path) -> None:
    """A verified record that turns into a false success or crash is reported; another engine version is not compared."""
    file = tmp_path / "baseline.parquet"
    assert baseline.accept(run, file) > 500
    assert baseline.fallen(run, file) == []
    worse = tmp_path / "worse"
    part = next((run / "records").glob("textbook-osqp*"))
    table = records.read_part(part, records.RECORDS)
    at = column(table, "verdict").index("verified")
    changed = column(table, "verdict")
    changed[at] = "false_success"
    index = table.schema.get_field_index("verdict")
    table = table.set_column(index, records.RECORDS.field("verdict"), pa.array(changed).dictionary_encode())
    records.write_parquet(table.cast(records.RECORDS), worse / "records" / "a.parquet")
    records.write_json(records.read_run(run), worse / "run.json")
    fallen = baseline.fallen(worse, file)
    assert [(row["backend"], row["verdict"]) for row in fallen] == [("osqp", "false_success")]
    newer = column(table, "engine_version")
    newer[at] = "99"
    index = table.schema.get_field_index("engine_version")
    table = table.set_column(index, records.RECORDS.field("engine_version"), pa.array(newer).dictionary_encode())
    records.write_parquet(table.cast(records.RECORDS), worse / "records" / "a.parquet")
    assert baseline.fallen(worse, file) == []


@pytest.fixture
def unruly() -> Iterator[str]:
    """A backend that crashes on problems that ask for it."""
    promise = Promise("psd", "any", "solves everything", "nowhere", "1")
    BACKENDS["unruly"] = Backend("unruly", "unruly", "good", "none", "none", promise, package="tests.fakes")
    yield "unruly"
    del BACKENDS["unruly"]


def stack(*first: float) -> sandbox.VelocityProblem:
    a = np.zeros((len(first), 3))
    a[:, 0] = first
    return sandbox.VelocityProblem(J=[[1.0, 1.0, 1.0]], xdot=[1.0], W=np.eye(3), a=a)


def test_failures_become_verdicts(unruly: str) -> None:
    """A crash, a hang, an exception and NaN called solved are each judged for what they are."""
    problem = stack(0.0, unruly_.SEGFAULT, unruly_.HANG, unruly_.RAISE, unruly_.GARBAGE, 1.0)
    table = sandbox.cross_validate(problem, [unruly], ["direct"], time_limit=0.5)
    assert column(table, "verdict") == ["verified", "crashed", "timed_out", "wrong_refusal", "false_success", "verified"]
    assert column(table, "found") == [True, False, False, False, False, True]


def test_cross_validate_returns_records() -> None:
    """The library call gives a table of the published columns for one problem, closed forms and backends."""
    problem = sandbox.VelocityProblem(J=[[-1.0, -1, 0], [2, 1, 1]], xdot=[1.0, 1], W=np.diag([-1.0, 1, 1]))
    table = sandbox.cross_validate(problem, backends=["numpy", "closed_form:eq6"])
    assert table.schema == records.RECORDS
    assert set(column(table, "backend")) == {"numpy:lstsq", "closed_form:eq6"}
    for row in table.to_pylist():
        assert row["verdict"] == "verified" and np.allclose(row["qdot"], [1, -2, 1], atol=1e-12)
    with pytest.raises(UnknownNameError, match=r"there are: .*osqp"):
        sandbox.cross_validate(problem, backends=["gurobi"])


def test_library_use_as_documented() -> None:
    """The four calls of the README work as written, on the indefinite example of the paper's framework."""
    p = sandbox.VelocityProblem(J=[[-1.0, -1, 0], [2, 1, 1]], xdot=[1.0, 1], W=np.diag([-1.0, 1, 1]), a=np.zeros(3))
    s = sandbox.solve(p, method="eq6")
    assert np.allclose(s.x, [1, -2, 1], atol=1e-14) and np.allclose(s.y, [-3, -1], atol=1e-14)
    assert s.status is sandbox.Status.SOLVED
    t = sandbox.truth(p, task="exact")
    assert (t.expected, t.rank, t.inertia) == ("unique_minimum", 2, (1, 0, 0))
    assert [str(v) for v in t.x_exact] == ["1", "-2", "1"] and t.x.tolist() == [1, -2, 1] and t.y.tolist() == [-3, -1]
    assert t.reason == "condition_7" and 0 < t.margin < 1
    worse = sandbox.VelocityProblem(J=p.J, xdot=p.xdot, W=np.diag([-3.0, 1, 1]))
    with pytest.raises(sandbox.ConditionSevenError, match="maximum"):
        sandbox.solve(worse)


def test_agenda_never_runs_a_library_twice_at_once() -> None:
    """Two iterators over the same agenda get every item once, and never the same library together."""
    agenda = Agenda({"a": ["1", "2", "3"], "b": ["1"]})
    first, second = iter(agenda), iter(agenda)
    one, two = next(first), next(second)
    assert {one[0], two[0]} == {"a", "b"}
    given = [one, two, *(first if one[0] == "a" else second)]
    assert sorted(given) == [("a", "1"), ("a", "2"), ("a", "3"), ("b", "1")]


def test_overflow_in_posing_is_the_members_own() -> None:
    """A problem whose QP overflows float64 is refused by that formulation; its neighbours are answered."""
    J = np.ones((2, 1, 2))
    W = np.broadcast_to(np.eye(2), (2, 2, 2)).copy()
    J[1] *= 1e-148
    W[1] *= 1e147
    table = sandbox.cross_validate(sandbox.VelocityProblem(J=J, xdot=J[:, :, 0], W=W), ["numpy"]).to_pylist()
    told = {(row["formulation"], row["step"]): (row["status"], row["verdict"]) for row in table}
    assert told["augmented_lagrangian", 0] == ("solved", "verified")
    assert told["augmented_lagrangian", 1][0] == "failed"


def test_two_runs_do_not_share_a_folder(tmp_path: Path) -> None:
    """A folder that is being written is refused, and left as it was."""
    out = tmp_path / "r"
    plan = chosen([sets.load("textbook")], ["closed_form:eq6"], None)

    def second(phase: str, done: int, total: int) -> None:
        with pytest.raises(InputFileError, match="being written by another run"):
            carry_out(plan, out, command="second", overwrite=True)

    carry_out(plan, out, command="first", progress=second)
    assert records.read_run(out)["command"] == "first"
    assert records.read_table(out, "records").num_rows > 50


def test_an_interrupted_run_keeps_what_was_done(tmp_path: Path) -> None:
    """Ctrl-C: exit status 130, a folder that says it is incomplete, and readable records."""
    out = tmp_path / "r"
    words = [sys.executable, "-m", "sandbox.cli", "run", "manufactured", "--out", str(out), "--jobs", "1"]
    process = subprocess.Popen(
        [*words, "--backend", "closed_form", "--backend", "cvxpy"],
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, start_new_session=True,
        # a suite run in the background has SIGINT ignored, and hands that on
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    deadline = time.monotonic() + 60
    while not list(out.glob("records/*.parquet")) and time.monotonic() < deadline:
        time.sleep(0.1)
    time.sleep(3)
    os.killpg(process.pid, signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 130, said
    assert "Traceback" not in said
    content = records.read_run(out)
    assert content["complete"] is False and content["finished"]
    assert records.read_table(out, "records").num_rows >= len(sets.load("manufactured"))
    assert not [line for line in json.dumps(content).splitlines() if "NaN" in line]
