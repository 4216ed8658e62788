"""Sequences are solved twice: cold, and each member started from the answer to the one before."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest

import sandbox
from sandbox import baseline, verdict_table
from sandbox.backends import BACKENDS, SILENCE
from sandbox.backends.backend import Backend, WarmStart
from sandbox.campaign import STRETCH, Campaign, Plan
from sandbox.case import read_case, text
from sandbox.errors import ShapeError
from sandbox.plan import chosen, standard
from sandbox.preparation import prepare
from sandbox.problem_set import Group, ProblemSet
from sandbox.records import read_table
from sandbox.run_folder import carry_out
from sandbox.script import script
from tests.fakes import unruly_
from tests.trajectories import lines

STEPS = 12
BACKENDS_RUN = ("osqp", "proxsuite:dense", "scipy:slsqp", "numpy:lstsq")
KEYS = ("problem", "task", "backend", "formulation", "settings", "mode")

Row = dict[str, Any]


@pytest.fixture(scope="module")
def sequence() -> ProblemSet:
    """Two trajectories of a planar 3R arm."""
    return ProblemSet("lines", (lines(1, 2, steps=STEPS),))


@pytest.fixture(scope="module")
def run(sequence: ProblemSet, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """They, through backends that can be warm and one that cannot, every formulation, two levels."""
    out = tmp_path_factory.mktemp("warm") / "run"
    plan = chosen([sequence], [*BACKENDS_RUN, "closed_form"], None, ["high_accuracy", "default"])
    carry_out(plan, out, command="test")
    return out


@pytest.fixture(scope="module")
def rows(run: Path) -> list[Row]:
    """Its records."""
    found: list[Row] = read_table(run, "records").to_pylist()
    return found


def of(rows: list[Row], **wanted: str | None) -> list[Row]:
    """The rows with these values, in the order of the trajectories."""
    kept = [row for row in rows if all(row[name] == value for name, value in wanted.items())]
    return sorted(kept, key=lambda row: (row["seed"], row["step"]))


# ---- which member follows which -------------------------------------------------------------------------------


def test_members_follow_along_their_trajectory() -> None:
    """A member follows the one before it where seed, robot and method are the same and its step is later."""
    group = lines(1, 2, steps=3)
    assert group.follows().tolist() == [False, True, True, False, True, True]
    assert group[[0, 2, 4]].follows().tolist() == [False, True, False]
    assert group[::-1].follows().tolist() == [False] * 6
    same_seed = Group(group.problem, {**group.labels, "seed": [1] * 6}, sequence=True)
    assert same_seed.follows().tolist() == [False, True, True, False, True, True]  # the step starts again
    counted = Group(group.problem, {"step": list(range(6)), "method": list("aaabbb")}, sequence=True)
    assert counted.follows().tolist() == [False, True, True, False, True, True]


def test_what_is_no_sequence_has_no_order() -> None:
    """Nothing follows in a group that is not declared a sequence, and a sequence without steps is refused."""
    group = lines(1, steps=3)
    assert not replace(group, sequence=False).follows().any()
    assert ProblemSet("s", (group,)).narrowed(("exact",)).groups[0].sequence
    with pytest.raises(ShapeError, match="need the label 'step'"):
        Group(group.problem, {"seed": [1, 1, 1]}, sequence=True)
    with pytest.raises(ShapeError, match="need the label 'step'"):
        Group(group.problem, {"step": [0, None, 2]}, sequence=True)


# ---- what is run ----------------------------------------------------------------------------------------------


def test_warm_is_one_more_batch(rows: list[Row]) -> None:
    """Every member has one warm record by each backend that can be, of `direct` at high accuracy; the cold ones stay."""
    keys = [tuple(row[name] for name in KEYS) for row in rows]
    assert len(keys) == len(set(keys))
    warm = {(row["backend"], row["formulation"], row["settings"]) for row in of(rows, mode="warm")}
    assert warm == {(name, "direct", "high_accuracy") for name in BACKENDS_RUN if BACKENDS[name].warm}
    assert {name for name, _, _ in warm} == {"osqp", "proxsuite:dense", "scipy:slsqp"}
    for name in BACKENDS_RUN:
        for mode, count in (("cold", 2 * STEPS), ("warm", 2 * STEPS if BACKENDS[name].warm else 0)):
            assert len(of(rows, backend=name, formulation="direct", settings="high_accuracy", mode=mode)) == count
    assert {row["mode"] for row in rows if row["backend"].startswith("closed_form:")} == {None}


def test_warm_is_verified_and_saves(rows: list[Row]) -> None:
    """Warm answers are judged as the cold ones; the first of a trajectory costs what it costs cold, the rest less."""
    cold, warm = (of(rows, backend="osqp", formulation="direct", settings="high_accuracy", mode=m) for m in ("cold", "warm"))
    assert {row["verdict"] for row in warm} == {"verified"}
    for c, w in zip(cold, warm, strict=True):
        assert c["problem"] == w["problem"]
        if w["step"] == 0:
            assert (w["iterations"], w["qdot"]) == (c["iterations"], c["qdot"])
    assert sum(w["iterations"] for w in warm) < sum(c["iterations"] for c in cold)


def test_warm_can_be_left_out(sequence: ProblemSet, rows: list[Row]) -> None:
    """Without warm starts, or where the problems are no sequence, all is cold, and the cold answers are the same."""
    problem = sequence.groups[0].problem
    table = sandbox.cross_validate(problem, ["osqp"], ["direct"]).to_pylist()
    assert {row["mode"] for row in table} == {"cold"}
    with_warm = of(rows, backend="osqp", formulation="direct", settings="high_accuracy", mode="cold")
    assert [row["qdot"] for row in table] == [row["qdot"] for row in with_warm]
    both = sandbox.cross_validate(problem, ["osqp"], ["direct"], sequence=True)
    assert both.num_rows == 2 * len(table)
    for plan in (chosen([sequence], ["osqp"], None, warm=False), standard([sequence], jobs=1, warm=False)):
        assert rounds(plan, "osqp").isdisjoint({("high_accuracy", "direct", "warm")})
    for plan in (chosen([sequence], ["osqp"], None), standard([sequence], jobs=1)):
        assert ("high_accuracy", "direct", "warm") in rounds(plan, "osqp")
    other = chosen([sequence], ["osqp"], ["convexified", "null_space"])
    assert {mode for _, _, mode in rounds(other, "osqp")} == {"cold"}


def rounds(plan: Plan, backend: str) -> set[tuple[str, str, str]]:
    """What a plan has a backend do with the first group of its sets."""
    work = prepare(plan.sets, plan.formulations, 1, lambda *_: None)[0]
    return set(Campaign(plan, lambda *_: None)._rounds(work, backend))


def test_slow_backends_see_stretches() -> None:
    """A sampled backend gets members that follow each other, as many as its share, from the start of the sequence."""
    sequence = ProblemSet("lines", (lines(1, steps=5 * STRETCH),))
    plan = replace(chosen([sequence], ["casadi:ipopt", "osqp"], ["direct"]), sample_every=2)
    work = prepare(plan.sets, plan.formulations, 1, lambda *_: None)[0]
    campaign = Campaign(plan, lambda *_: None)
    assert BACKENDS["casadi:ipopt"].sampled
    seen = campaign._members(work, "casadi:ipopt")
    assert seen.tolist() == [i for i in range(5 * STRETCH) if i // STRETCH in (0, 2, 4)]
    assert len(campaign._members(work, "osqp")) == 5 * STRETCH
    plain = replace(work, group=replace(work.group, sequence=False))
    assert campaign._members(plain, "casadi:ipopt").tolist() == list(range(0, 5 * STRETCH, 2))


@pytest.fixture
def unruly() -> Iterator[str]:
    """A backend that fails on request and tells where it was started."""
    start = WarmStart("start")
    BACKENDS["unruly"] = Backend("unruly", "unruly", "good", "none", "none", SILENCE, package="tests.fakes", start=start)
    yield "unruly"
    del BACKENDS["unruly"]


def test_failures_break_the_chain(unruly: str) -> None:
    """After a crash the next member starts cold, in the records too; the others start from qdot and y of the one before."""
    a = np.zeros((5, 3))
    a[:, 0] = 0.0, 1.0, unruly_.SEGFAULT, 2.0, 3.0
    problem = sandbox.VelocityProblem(J=[[1.0, 1.0, 1.0]], xdot=[1.0], W=np.eye(3), a=a)
    table = sandbox.cross_validate(problem, [unruly], ["direct"], time_limit=0.5, sequence=True).to_pylist()
    cold, warm = (of(table_rows(table), mode=mode) for mode in ("cold", "warm"))
    assert [row["verdict"] for row in cold] == [row["verdict"] for row in warm]
    assert warm[2]["verdict"] == "crashed"
    assert {row["said"] for row in cold if row is not cold[2]} == {"solved"}
    expected = ["solved", 0, None, "solved", 3]
    for row, start in zip(warm, expected, strict=True):
        if isinstance(start, int):
            assert row["said"] == f"solved from {warm[start]['qdot']}, {warm[start]['y']}"
        elif start:
            assert row["said"] == start


def table_rows(table: list[Row]) -> list[Row]:
    """Records of problems that were given no seed, which `of` sorts by."""
    return [{**row, "seed": 0} for row in table]


# ---- what is made of the records ------------------------------------------------------------------------------


def test_the_baseline_tells_modes_apart(run: Path, tmp_path: Path) -> None:
    """A verified warm answer that becomes a false success has fallen, and the cold one beside it has not."""
    from sandbox.records import RECORDS, read_run, write_json, write_parquet

    file, worse = tmp_path / "baseline.parquet", tmp_path / "worse"
    baseline.accept(run, file)
    assert baseline.fallen(run, file) == []
    table = read_table(run, "records")
    changed = [
        "false_success" if (row["backend"], row["mode"], row["step"], row["seed"]) == ("osqp", "warm", 5, 1) else row["verdict"]
        for row in table.select(["backend", "mode", "step", "seed", "verdict"]).to_pylist()
    ]
    index = table.schema.get_field_index("verdict")
    table = table.set_column(index, RECORDS.field("verdict"), pa.array(changed).dictionary_encode())
    write_parquet(table.cast(RECORDS), worse / "records" / "a.parquet")
    write_json(read_run(run), worse / "run.json")
    assert [(row["backend"], row["mode"], row["verdict"]) for row in baseline.fallen(worse, file)] == [
        ("osqp", "warm", "false_success")
    ]


def test_verdicts_are_counted_by_mode(run: Path) -> None:
    """The table of verdicts has a row per mode, and a column that names it where anything was warm."""
    found = verdict_table.counts(run)
    by_mode = {row["mode"]: row for row in found if row["backend"] == "osqp" and row["settings"] == "high_accuracy"
               and row["formulation"] == "direct"}  # fmt: skip
    assert {mode: row["verified"] for mode, row in by_mode.items()} == {"cold": 2 * STEPS, "warm": 2 * STEPS}
    assert "mode" in [column.header for column in verdict_table.table(found).columns]
    cold = [row for row in found if row["mode"] != "warm"]
    assert "mode" not in [column.header for column in verdict_table.table(cold).columns]


def test_a_warm_record_is_repeated_cold_and_says_so(run: Path, rows: list[Row]) -> None:
    """Case and script tell warm from cold, and that the repetition is cold."""
    warm = of(rows, backend="osqp", mode="warm")[5]
    case = read_case(run, warm["problem"])
    told = text(case, backend="osqp", formulation="direct", settings="high_accuracy")
    assert told.count("osqp, direct, high_accuracy, exact: verified") == 1
    assert told.count("osqp, direct, high_accuracy, exact, warm: verified") == 1
    assert told.count("repeat cold with") == 1 and told.count("repeat with") == 1
    header = [line for line in script(case, "osqp").splitlines() if line.startswith("# recorded")]
    assert sorted(line.split(": verified")[0] for line in header) == [
        "# recorded", "# recorded, warm: started from the answer to the step before, repeated cold here"
    ]  # fmt: skip
