"""The ledger: states are computed from checks, and what one claim does to its process is its own."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandbox.claims.claim import Check, Evidence, Role, State, Trial, at_least, at_most, every
from sandbox.claims.ledger import carry_out, chosen, noticed
from sandbox.errors import InputFileError, UnknownNameError
from sandbox.records import read_run, read_table
from tests.fakes import claims as fakes


def check(role: Role, holds: bool) -> Check:
    return Check("it", holds, 1, 1, role=role)


@pytest.mark.parametrize(
    "fallen, state",
    [
        ((), State.REPRODUCED),
        ((Role.REACH,), State.RANGE),
        ((Role.PRINTED,), State.CORRECTED),
        ((Role.PRINTED, Role.REACH), State.CORRECTED),
        ((Role.CLAIM,), State.NOT_REPRODUCED),
        ((Role.CLAIM, Role.PRINTED, Role.REACH), State.NOT_REPRODUCED),
        ((Role.OURS,), State.UNSOUND),
        (tuple(Role), State.UNSOUND),
    ],
)
def test_the_worst_role_that_falls_decides(fallen: tuple[Role, ...], state: State) -> None:
    """Evidence before claim, claim before letter, letter before reach; the order of the checks is without effect."""
    checks = tuple(check(role, role not in fallen) for role in Role)
    assert Evidence(checks, ()).state is state
    assert Evidence(checks[::-1], ()).state is state
    assert state.red == (state in (State.NOT_REPRODUCED, State.UNSOUND))


def test_nothing_examined_is_no_evidence() -> None:
    """No check at all, checks of our own alone, no case, or NaN: none of these reproduces a claim."""
    assert Evidence((), ()).state is State.UNSOUND
    assert Evidence((check(Role.OURS, True),), ()).state is State.UNSOUND
    assert not at_most("no case", np.zeros(0), 1.0).holds
    assert not at_least("no case", [], 0.0).holds
    assert not every("no case", np.zeros(0, bool)).holds
    assert not at_most("NaN", [0.0, math.nan], 1.0).holds
    assert not at_least("NaN", [2.0, math.nan], 1.0).holds
    assert not Check("NaN", True, math.nan, 1).holds


def test_checks_hold_up_to_their_limit() -> None:
    """The largest, the smallest, and all of a stack of any shape; the count is that of its entries."""
    assert at_most("", [[1.0], [2.0]], 2.0).holds and not at_most("", [[1.0], [2.0]], 1.9).holds
    assert at_least("", [1.0, 2.0], 1.0).holds and not at_least("", [1.0, 2.0], 1.1).holds
    assert every("", [True, True]).holds and not every("", [True, False]).holds
    assert at_most("", [[1.0], [2.0]], 2.0).count == 2 and at_most("", 1, 2).found == 1.0
    assert every("", [True, False]).found == "1 of 2"
    assert json.loads(json.dumps([at_most("", [math.inf], 1.0).found], allow_nan=False)) == ["∞"]


def carried(tmp_path: Path, *claims: Any, **trial: Any) -> dict[str, dict[str, Any]]:
    carry_out(claims, tmp_path / "run", command="sandbox paper", trial=Trial(**trial))
    return {row["claim"]: row for row in read_table(tmp_path / "run", "claims").sort_by("place").to_pylist()}


@pytest.mark.parametrize("jobs", [1, 2])
def test_states_and_planted_faults_are_recorded(tmp_path: Path, jobs: int) -> None:
    """Reproduced, not reproduced, broken off; a fault that changes nothing is told, in one process and in several."""
    rows = carried(
        tmp_path, fakes.claim("holds", fakes.agree), fakes.claim("falls", fakes.disagree), fakes.claim("breaks", fakes.breaks),
        fakes.claim("blind", fakes.agree, fakes.unnoticed), fakes.claim("alone", fakes.agree, alone=True), jobs=jobs,
    )  # fmt: skip
    assert list(rows) == ["holds", "falls", "breaks", "blind", "alone"]
    told = {name: (row["state"], row["fault_state"], row["noticed"]) for name, row in rows.items()}
    assert told == {
        "holds": ("reproduced", "not reproduced", True),
        "falls": ("not reproduced", "evidence fails", True),
        "breaks": ("evidence fails", "evidence fails", False),
        "blind": ("reproduced", "reproduced", False),
        "alone": ("reproduced", "not reproduced", True),
    }
    run = read_run(tmp_path / "run")
    assert run["complete"] and run["kind"] == "paper" and run["full"] and run["timing"]["wall"] > 0
    checks = read_table(tmp_path / "run", "checks").to_pylist()
    assert [json.loads(row["found"]) for row in checks if row["claim"] == "breaks"] == ["ValueError: out of cheese"]
    assert [row["count"] for row in checks if row["claim"] == "holds"] == [100]
    (plot, _, _) = read_table(tmp_path / "run", "exhibits").to_pylist()
    assert json.loads(plot["content"])["series"][0]["y"] == [1, 1]
    assert rows["holds"]["first"] == "tests.fakes.claims:one" and rows["holds"]["second"] == "tests.fakes.claims:other"


def test_a_reduced_trial_is_told(tmp_path: Path) -> None:
    """Its size, and the command that repeats it."""
    row = carried(tmp_path, fakes.claim("holds", fakes.agree), full=False, seed=7)["holds"]
    assert row["command"] == "sandbox paper --claim holds --seed 7 --quick" and not row["full"] and row["seed"] == 7


def test_a_process_that_dies_costs_its_own_claim_alone(tmp_path: Path) -> None:
    """Those of its file go on in another process; its evidence fails, with the reason."""
    breaker = fakes.claim("dies", fakes.dies)
    elsewhere = fakes.claim("elsewhere", _agree)
    rows = carried(tmp_path, fakes.claim("before", fakes.agree), breaker, fakes.claim("after", fakes.agree), elsewhere, jobs=2)
    assert {name: row["state"] for name, row in rows.items()} == {
        "before": "reproduced", "dies": "evidence fails", "after": "reproduced", "elsewhere": "reproduced",
    }  # fmt: skip
    (check,) = [row for row in read_table(tmp_path / "run", "checks").to_pylist() if row["claim"] == "dies"]
    assert "ProcessExpired" in check["found"] and rows["dies"]["seconds"] is None and not rows["dies"]["noticed"]


def _agree(*arguments: Any) -> Evidence:
    return fakes.agree(*arguments)


def test_an_interruption_keeps_what_was_done(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C in the second claim: the first is there, and the run says that it is not complete."""
    monkeypatch.setattr(fakes, "dawdles", _interrupt)
    claims = [fakes.claim("holds", fakes.agree), fakes.claim("stops", fakes.dawdles)]
    with pytest.raises(KeyboardInterrupt):
        carry_out(claims, tmp_path / "run", command="", trial=Trial())
    assert read_table(tmp_path / "run", "claims")["claim"].to_pylist() == ["holds"]
    assert not read_run(tmp_path / "run")["complete"] and read_run(tmp_path / "run")["finished"]


def _interrupt(*_: Any) -> Evidence:
    raise KeyboardInterrupt


def test_a_run_is_replaced_only_when_asked(tmp_path: Path) -> None:
    """Nothing of an earlier run stays; a folder of the user's is not touched."""
    carried(tmp_path, fakes.claim("first", fakes.agree), fakes.claim("second", fakes.agree))
    with pytest.raises(InputFileError, match="--overwrite"):
        carried(tmp_path, fakes.claim("third", fakes.agree))
    carry_out([fakes.claim("third", fakes.agree)], tmp_path / "run", command="", trial=Trial(), overwrite=True)
    for kind in ("claims", "checks", "exhibits"):
        assert read_table(tmp_path / "run", kind)["claim"].to_pylist() == ["third"]
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").write_text("mine")
    with pytest.raises(InputFileError, match="no run"):
        carry_out([], tmp_path / "mine", command="", trial=Trial(), overwrite=True)


def test_claims_are_chosen_in_the_order_of_the_paper() -> None:
    """By name; a name that is none is refused with those that are near."""
    table = {name: fakes.claim(name, fakes.agree) for name in ("first", "second", "third")}
    assert [one.name for one in chosen(table, ["third", "first"])] == ["first", "third"]
    assert [one.name for one in chosen(table, None)] == list(table) == [one.name for one in chosen(table, [])]
    with pytest.raises(UnknownNameError, match="second"):
        chosen(table, ["secnd"])


def test_a_fault_is_noticed_only_where_the_state_turns_red() -> None:
    """A range is not red; a claim that is red without its fault must turn to evidence that fails."""
    of = {state: _evidence(state) for state in State}
    assert [[noticed(of[sound], of[faulty]) for faulty in State] for sound in (State.REPRODUCED, State.NOT_REPRODUCED)] == [
        [False, False, False, True, True],
        [False, False, False, False, True],
    ]


def _evidence(state: State) -> Evidence:
    fallen = {
        State.REPRODUCED: None, State.RANGE: Role.REACH, State.CORRECTED: Role.PRINTED, State.NOT_REPRODUCED: Role.CLAIM,
        State.UNSOUND: Role.OURS,
    }[state]  # fmt: skip
    found = Evidence(tuple(check(role, role is not fallen) for role in Role), ())
    assert found.state is state
    return found
