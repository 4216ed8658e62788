"""The command for the paper: what it prints, keeps and writes; a wrong word is one line, status 2 and nothing written."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from sandbox import cli
from sandbox.claims import table
from sandbox.claims.claim import Claim
from sandbox.records import read_run, read_table
from tests.fakes import claims as fakes

QUICK = ["--quick", "--out", "new", "--page", "page.html"]
ONE = ["paper", "--claim", "footnote_2", *QUICK]
KINDS = ("claims", "checks", "exhibits")


class Done(NamedTuple):
    """What a command left behind."""

    status: int
    out: str
    err: str


Command = Callable[..., Done]


@pytest.fixture
def sandbox(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Iterator[Command]:
    """The command line, in this process, in a folder of its own that holds a folder and a file of the user's."""
    (tmp_path / "used").mkdir()
    (tmp_path / "used" / "thesis.tex").write_text("mine")
    (tmp_path / "notes.txt").write_text("mine")
    monkeypatch.chdir(tmp_path)
    kept = signal.getsignal(signal.SIGTERM)  # main takes it for itself

    def command(*words: str) -> Done:
        monkeypatch.setattr(sys, "argv", ["sandbox", *words])
        with pytest.raises(SystemExit) as stop:
            cli.main()
        assert isinstance(stop.value.code, int)
        return Done(stop.value.code, *capfd.readouterr())

    yield command
    signal.signal(signal.SIGTERM, kept)


def ledger(monkeypatch: pytest.MonkeyPatch, *claims: Claim) -> None:
    """These claims for those of the paper."""
    monkeypatch.setattr(table, "CLAIMS", {claim.name: claim for claim in claims})


def one_line(done: Done, said: str) -> None:
    """Status 2, one line of standard error that begins with "error: " and holds `said`, and no table."""
    lines = [text for text in done.err.splitlines() if text.strip()]
    assert done.status == 2 and done.out == "" and len(lines) == 1, done
    assert lines[0].startswith("error: ") and said in lines[0]


def test_all_claims_are_listed(sandbox: Command) -> None:
    """By the names that --claim takes, in the order of the paper, in letters and not in TeX."""
    done = sandbox("list", "claims", "--json")
    rows = json.loads(done.out)
    assert done.status == 0 and done.err == "" and [row["name"] for row in rows] == list(table.CLAIMS)
    for row in rows:
        assert set(row) == {"name", "where", "claim", "planted fault"}
        assert all(isinstance(value, str) and value for value in row.values())
        assert "$" not in row["planted fault"] and "\\" not in row["planted fault"]
    drawn = sandbox("list", "claims")
    assert drawn.status == 0 and all(f" {name} " in drawn.out for name in table.CLAIMS)


def test_a_claim_is_examined_kept_and_shown(sandbox: Command, tmp_path: Path) -> None:
    """State and fault in a table, a complete run folder, a page that says that it shows one claim of all."""
    done = sandbox(*ONE)
    assert done.status == 0 and "footnote_2" in done.out and "noticed" in done.out and "NOT" not in done.out
    assert "1 claim: 1 reproduced; " in done.out and "evidence in new" in done.out and "report: page.html" in done.out
    about = read_run(tmp_path / "new")
    assert about["complete"] and about["kind"] == "paper" and not about["full"]
    assert (about["planned"], about["ledger"]) == (1, len(table.CLAIMS))
    assert about["command"] == "sandbox paper --claim footnote_2 --quick --seed 0"
    (row,) = read_table(tmp_path / "new", "claims").to_pylist()
    assert (row["claim"], row["state"], row["noticed"], row["full"]) == ("footnote_2", "reproduced", True, False)
    for kind in KINDS:
        assert read_table(tmp_path / "new", kind).num_rows > 0
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert 'id="footnote_2"' in page and f"Only 1 of the {len(table.CLAIMS)} claims of the paper was asked for" in page


def test_claims_stand_in_the_order_of_the_paper(sandbox: Command, tmp_path: Path) -> None:
    """However they are named, and once where one is named twice; several processes make no difference."""
    named = [word for name in ("table_1", "footnote_2", "table_1") for word in ("--claim", name)]
    kept = []
    for jobs in ("1", "99"):
        done = sandbox("paper", *named, *QUICK, "--jobs", jobs, "--overwrite")
        assert done.status == 0 and 0 < done.out.index("footnote_2") < done.out.index("table_1")
        assert "2 claims: 2 reproduced; " in done.out
        assert read_run(tmp_path / "new")["command"] == ("sandbox paper --claim footnote_2 --claim table_1 --quick --seed 0")
        kept.append([read_table(tmp_path / "new", kind).to_pylist() for kind in ("checks", "exhibits")])
        page = (tmp_path / "page.html").read_text(encoding="utf-8")
        assert page.index('<article class="claim s-reproduced" id="footnote_2"') < page.index('id="table_1"')
    assert kept[0] == kept[1]


def test_report_knows_which_page_a_run_has(sandbox: Command, tmp_path: Path) -> None:
    """A run of claims its own, any other the verification page; each where it is told, or in reports/out."""
    assert sandbox(*ONE).status == 0
    assert sandbox("run", "textbook", "--backend", "numpy", "--out", "other").status == 0
    for run, name, words in (("new", "paper", 'id="footnote_2"'), ("other", "verification", "numpy:lstsq")):
        done = sandbox("report", run)
        assert done.status == 0 and done.out.startswith(f"report: reports/out/{name}.html")
        assert words in (tmp_path / "reports" / "out" / f"{name}.html").read_text(encoding="utf-8")
        assert sandbox("report", run, "--page", f"deep/er/{name}.html").status == 0
        assert (tmp_path / "deep" / "er" / f"{name}.html").read_bytes() == (
            tmp_path / "reports" / "out" / f"{name}.html"
        ).read_bytes()
        one_line(sandbox("report", run, "--page", "used"), "used is a folder; --page names a file")
    again = (tmp_path / "page.html").read_bytes()
    assert (tmp_path / "reports" / "out" / "paper.html").read_bytes() == again


WRONG: list[tuple[list[str], str]] = [
    (["--claim", "fotnote_2"], "no claim is called 'fotnote_2'; near it: footnote_2, footnote_1"),
    (["--claim", ""], "no claim is called ''; none is near it; `sandbox list claims` has them all"),
    (["--claim", "footnote_2", "--claim", "x\ny" * 999], "no claim is called "),
    (["--out", "used"], "used holds files that are no run"),
    (["--out", "used", "--overwrite"], "used holds files that are no run"),
    (["--out", "notes.txt"], "notes.txt is a file; --out names a folder"),
    (["--page", "used"], "used is a folder; --page names a file"),
    (["--page", "notes.txt/page.html"], "notes.txt is a file; --page notes.txt/page.html cannot lie in it"),
]


@pytest.mark.parametrize(("words", "said"), WRONG, ids=lambda value: " ".join(value)[:40] if isinstance(value, list) else "")
def test_what_is_wrong_is_one_line(sandbox: Command, tmp_path: Path, words: list[str], said: str) -> None:
    """Told before anything is examined: nothing is written, and what is the user's stays."""
    before = sorted(tmp_path.rglob("*"))
    done = sandbox("paper", "--quick", *(["--out", "new"] if "--out" not in words else []), *words)
    one_line(done, said)
    assert len(done.err) < 600
    assert sorted(tmp_path.rglob("*")) == before and (tmp_path / "used" / "thesis.tex").read_text() == "mine"


@pytest.mark.parametrize("words", [["--seed", "-1"], ["--seed", str(10**30)], ["--seed", "1.5"], ["--jobs", "0"]])
def test_a_number_out_of_range_is_refused(sandbox: Command, tmp_path: Path, words: list[str]) -> None:
    """With the usage, status 2, and nothing written; the largest seed is examined."""
    before = sorted(tmp_path.rglob("*"))
    done = sandbox(*ONE, *words)
    assert done.status == 2 and "Invalid value" in done.err and "Traceback" not in done.err and done.out == ""
    assert sorted(tmp_path.rglob("*")) == before


def test_the_largest_seed_is_kept(sandbox: Command, tmp_path: Path) -> None:
    """As it was given, in run.json and beside the claim."""
    assert sandbox(*ONE, "--seed", str(2**63 - 1)).status == 0
    assert read_run(tmp_path / "new")["seed"] == read_table(tmp_path / "new", "claims")["seed"][0].as_py() == 2**63 - 1


def test_a_folder_that_is_not_writable_is_told_first(sandbox: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Before anything is examined; where the page fails all the same, the evidence is kept and the way to its page is told."""
    with monkeypatch.context() as patch:
        patch.setattr(os, "access", lambda *_: False)  # root may write anywhere
        one_line(sandbox(*ONE), "cannot be written to; name another file with --page")
    assert not (tmp_path / "new").exists()

    def full(*_: Any) -> Path:
        raise OSError(28, "No space left on device", "page.html")

    monkeypatch.setattr("reports.paper.write_paper", full)
    done = sandbox(*ONE)
    assert done.status == 2 and "footnote_2" in done.out
    last = done.err.splitlines()[-1]
    assert "No space left on device" in last and "the evidence is kept: `sandbox report new --page FILE`" in last
    assert read_run(tmp_path / "new")["complete"]


def test_a_run_is_replaced_only_when_asked(sandbox: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Refused without a touch; with --overwrite nothing of the earlier run stays."""
    ledger(monkeypatch, fakes.claim("first", fakes.agree), fakes.claim("second", fakes.agree))
    assert sandbox("paper", *QUICK).status == 0
    before = {path: path.read_bytes() for path in (tmp_path / "new").rglob("*.parquet")}
    one_line(sandbox("paper", *QUICK), "new holds a run; name another folder with --out, or replace it with --overwrite")
    assert {path: path.read_bytes() for path in (tmp_path / "new").rglob("*.parquet")} == before
    assert sandbox("paper", "--claim", "second", *QUICK, "--overwrite").status == 0
    for kind in KINDS:
        assert set(read_table(tmp_path / "new", kind)["claim"].to_pylist()) == {"second"}


@pytest.mark.parametrize(
    ("claim", "status", "said"),
    [
        (fakes.claim("holds", fakes.agree), 0, "1 claim: 1 reproduced; "),
        (fakes.claim("falls", fakes.disagree), 0, "1 claim: 1 not reproduced; "),
        (fakes.claim("breaks", fakes.breaks), 1, "1 claim: 1 evidence fails; "),
        (fakes.claim("blind", fakes.agree, fakes.unnoticed), 1, "NOT NOTICED"),
    ],
    ids=lambda value: value.name if isinstance(value, Claim) else "",
)
def test_the_status_tells_of_evidence_that_fails(
    sandbox: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, claim: Claim, status: int, said: str
) -> None:
    """1 where evidence fails or a fault goes unnoticed; a claim that is not reproduced is a result. The page is written."""
    ledger(monkeypatch, claim, fakes.claim("beside", fakes.agree))
    done = sandbox("paper", "--claim", claim.name, *QUICK)
    assert done.status == status and said in done.out
    assert f'id="{claim.name}"' in (tmp_path / "page.html").read_text(encoding="utf-8")


def test_runs_that_a_claim_keeps_are_shown_and_replaced(sandbox: Command, tmp_path: Path) -> None:
    """Every case behind the claim about the backends, by `show`; the folder goes when another claim replaces the run."""
    assert sandbox("paper", "--claim", "backends_in_double", *QUICK).status == 0
    nested = read_table(tmp_path / "new" / "accuracy", "records").to_pylist()
    row = next(row for row in nested if row["backend"] == "osqp")
    done = sandbox("show", "new/accuracy", row["problem"], "--backend", "osqp")
    assert done.status == 0 and row["problem"] in done.out and "osqp" in done.out
    assert read_run(tmp_path / "new" / "accuracy")["command"] == ("sandbox paper --claim backends_in_double --seed 0 --quick")
    (tmp_path / "new" / "mine").mkdir()
    (tmp_path / "new" / "mine" / "run.json").write_text('{"format": 1, "command": "sandbox run textbook"}')
    assert sandbox(*ONE, "--overwrite").status == 0
    assert list((tmp_path / "new" / "accuracy").rglob("*.*")) == [] and (tmp_path / "new" / "mine" / "run.json").is_file()


SLOW = """
import sys
from sandbox import cli
from sandbox.claims import table
from tests.fakes import claims as fakes

def elsewhere(*arguments):
    return fakes.agree(*arguments)

rows = [fakes.claim("holds", fakes.agree), fakes.claim("slow", fakes.dawdles), fakes.claim("elsewhere", elsewhere)]
if __name__ == "__main__":
    table.CLAIMS = {row.name: row for row in rows}
    sys.argv = ["sandbox", "paper", *sys.argv[1:]]
    cli.main()
"""


def gone(group: int) -> bool:
    """Whether the processes of a group come to their end within ten seconds."""
    for _ in range(100):
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.1)
    return False


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_ctrl_c_keeps_what_was_done(sandbox: Command, tmp_path: Path, jobs: str) -> None:
    """Status 130, one line, no process left behind; `report` makes the page of what was done, which says it is incomplete."""
    (tmp_path / "slow.py").write_text(SLOW)
    process = subprocess.Popen(
        [sys.executable, "slow.py", "--out", "new", "--page", "page.html", "--jobs", jobs], cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(path for path in sys.path if path)},
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
        # a suite run in the background has SIGINT ignored, and hands that on
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    deadline = time.monotonic() + 60
    while not list(tmp_path.glob("new/claims/*-holds.parquet")) and time.monotonic() < deadline:
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to every process of the command
    out, said = process.communicate(timeout=60)
    assert process.returncode == 130, said
    assert out == "" and said.splitlines()[-1] == "interrupted; what was done is kept" and "Traceback" not in said
    assert gone(process.pid)
    about = read_run(tmp_path / "new")
    assert not about["complete"] and about["finished"] and about["planned"] == 3
    done = read_table(tmp_path / "new", "claims")["claim"].to_pylist()
    assert "holds" in done and "slow" not in done and not (tmp_path / "page.html").exists()
    assert sandbox("report", "new").status == 0
    page = (tmp_path / "reports" / "out" / "paper.html").read_text(encoding="utf-8")
    assert f"This run was broken off and is incomplete: {len(done)} of 3 claims had been examined by then" in page


def test_a_folder_being_written_is_not_touched(sandbox: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A second run into it is refused while the first one goes on."""
    refused: list[Done] = []

    def meanwhile(trial: Any, first: Any, second: Any) -> Any:
        refused or refused.append(sandbox("paper", *QUICK, "--overwrite"))
        return fakes.agree(trial, first, second)

    ledger(monkeypatch, fakes.claim("holds", meanwhile))
    assert sandbox("paper", *QUICK).status == 0
    one_line(refused[0], "new is being written by another run")


def damaged(run: Path, how: str) -> None:
    """Damage a run of claims."""
    about = json.loads((run / "run.json").read_text())
    (claims,), (checks,), (exhibits,) = (list((run / kind).glob("*.parquet")) for kind in KINDS)
    match how:
        case "claims cut short":
            claims.write_bytes(claims.read_bytes()[:200])
        case "exhibits cut short":
            exhibits.write_bytes(exhibits.read_bytes()[:-9])
        case "claims gone":
            claims.unlink()
        case "checks gone":
            checks.unlink()
        case "exhibits gone":
            exhibits.unlink()
        case "checks of another kind":
            checks.write_bytes(exhibits.read_bytes())
        case "claim twice":
            (run / "claims" / "01-again.parquet").write_bytes(claims.read_bytes())
            for part in (checks, exhibits):
                (part.parent / "01-again.parquet").write_bytes(part.read_bytes())
            (run / "run.json").write_text(json.dumps(about | {"planned": 2}))
        case "no JSON":
            (run / "run.json").write_text("{")
        case "a list":
            (run / "run.json").write_text("[]")
        case "another format":
            (run / "run.json").write_text(json.dumps(about | {"format": 2}))
        case "another kind":
            (run / "run.json").write_text(json.dumps(about | {"kind": ["paper"]}))
        case name:  # a field of another type
            (run / "run.json").write_text(json.dumps(about | {name: {"a": [1]} if name != "packages" else "<b>"}))


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ("claims cut short", "is no Parquet file of this kind"), ("exhibits cut short", "is no Parquet file of this kind"),
        ("claims gone", "new holds 0 of its 1 claim: parts are missing"), ("checks gone", "is missing"),
        ("exhibits gone", "is missing"), ("checks of another kind", "lacks the column 'says'"),
        ("claim twice", "new holds a claim twice"), ("no JSON", "run.json is no JSON"), ("a list", "is not of format 1"),
        ("another format", "is not of format 1"), ("packages", "packages is '<b>', which is no dict"),
        *((name, f"{name} is {{'a': [1]}}, which is no ") for name in ("started", "command", "planned", "complete", "cores")),
    ],
)  # fmt: skip
def test_a_damaged_run_is_one_line(
    sandbox: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, how: str, said: str
) -> None:
    """Whatever is missing, cut short or of another type: its name, status 2, no page, and the run as it was."""
    ledger(monkeypatch, fakes.claim("holds", fakes.agree))
    assert sandbox("paper", *QUICK).status == 0
    damaged(tmp_path / "new", how)
    before = {path: path.read_bytes() for path in sorted(tmp_path.rglob("*")) if path.is_file()}
    one_line(sandbox("report", "new", "--page", "other.html"), said)
    assert {path: path.read_bytes() for path in sorted(tmp_path.rglob("*")) if path.is_file()} == before
