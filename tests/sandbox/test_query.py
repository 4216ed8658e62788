"""`sandbox query` answers one SELECT over the parts of a run, and reads nothing else and writes nothing at all."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import duckdb
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from sandbox import query
from sandbox.errors import InputFileError, QueryError
from sandbox.records import KINDS, RECORDS, read_table
from tests.reports.synthetic_run import write_run


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small run with every kind of table but the claims."""
    folder = tmp_path_factory.mktemp("query") / "run"
    write_run(folder, scale=0.03, backends=("osqp", "qpsolvers:piqp"))
    return folder


def rows(run: Path, statement: str, limit: int | None = None) -> list[tuple[Any, ...]]:
    """All rows of an answer."""
    with query.answered(run, statement, limit) as answer:
        return list(answer.rows())


def command(*words: object) -> subprocess.CompletedProcess[str]:
    """The command in a process of its own."""
    return subprocess.run(
        [sys.executable, "-m", "sandbox.cli", "query", *map(str, words)], capture_output=True, text=True, timeout=120
    )


def held(run: Path) -> dict[str, tuple[bytes, int]]:
    """Every file of a folder: its bytes and when it was written."""
    return {str(p): (p.read_bytes(), p.stat().st_mtime_ns) for p in sorted(run.rglob("*")) if p.is_file()}


def test_counts_are_those_of_the_records(run: Path) -> None:
    """A group-by over all parts counts what the parts hold."""
    counted = dict(rows(run, "select backend, count(*) from records group by 1"))
    names = read_table(run, "records", ["backend"])["backend"].to_pylist()
    assert counted == {name: names.count(name) for name in set(names)} and len(counted) > 3


@pytest.mark.parametrize("kind", ["records", "problems", "truth", "methods", "motions"])
def test_every_table_has_its_columns_and_rows(run: Path, kind: str) -> None:
    """A view shows all the columns of its kind, in their order, and every row."""
    with query.answered(run, f"from {kind}") as answer:
        assert answer.names == KINDS[kind].names
        assert sum(1 for _ in answer.rows()) == read_table(run, kind, KINDS[kind].names[:1]).num_rows > 0


def test_a_statement_may_be_any_select(run: Path) -> None:
    """WITH, FROM first, VALUES, unions, windows, comments and a semicolon at the end are answered."""
    for statement, n in (
        ("with a as (select 1 as x union all select 2) select * from a order by x desc;", 2),
        ("from range(3) -- of three", 3),
        ("values (1), (2)", 2),
        ("(select 1)", 1),
        ("select ';' as x ;\n ;", 1),
        ("select problem, row_number() over (partition by backend order by error) as k from records qualify k = 1", 0),
        ("describe records", len(RECORDS)),
    ):
        assert len(rows(run, statement)) >= max(n, 1), statement


def test_order_and_limit_hold(run: Path) -> None:
    """Rows come in the order asked for; a limit takes the first of them."""
    whole = [row[0] for row in rows(run, "select error from records where error is not null order by error desc")]
    assert whole == sorted(whole, reverse=True) and len(whole) > 100
    assert [row[0] for row in rows(run, "select error from records order by error desc nulls last", 7)] == whole[:7]


WRITES = [
    "insert into records values (1)", "delete from records", "update records set error = 0", "drop view records",
    "create table t as select 1", "create view v as select 1", "create macro f() as 1", "alter view records rename to r",
    "comment on view records is 'x'", "truncate records", "copy (select 1) to '{out}/a.csv'",
    "copy (select 1 as a) to '{part}' (format parquet)", "copy records to '{out}/a.parquet'", "copy records from '{part}'",
    "export database '{out}/b'", "import database '{out}'", "attach '{out}/c.db'", "attach '{out}/c.db' as c (read_only)",
    "detach memory", "install httpfs", "load httpfs", "load '{out}/x.duckdb_extension'", "set memory_limit = '64GB'",
    "set enable_external_access = true", "reset lock_configuration", "pragma database_list", "pragma enable_profiling",
    "call pragma_version()", "checkpoint", "vacuum", "begin", "prepare p as select 1", "execute p", "use memory",
    "explain select 1", "explain analyze copy (select 1) to '{out}/d.csv'", "select 1; select 2",
    "select 1; copy (select 1) to '{out}/e.csv'", "create secret s (type s3)", "",
    "-- nothing", "pivot records on backend using count(*)",
    "merge into records using records r on true when matched then delete",
    # a statement that writes, inside a WITH: to DuckDB the whole is a SELECT
    "with x as (copy (select 1 as a) to '{part}' (format parquet, use_tmp_file false)) select 1",
    "with x as (copy (select 1 as a) to '{out}/f.csv') from x",
    "with x as (insert into records values (1) returning 1) select * from x",
    "with x as (delete from records returning 1) select * from x",
    "select * from (with x as (copy (select 1 as a) to '{part}' (use_tmp_file false)) select 1)",
    "with y as (with x as (copy (select 1) to '{part}' (use_tmp_file false)) select 1) select * from y",
    "select (with x as (copy (select 1) to '{part}' (use_tmp_file false)) select 1)",
    "select * from query('with x as (copy (select 1) to ''{part}'' (use_tmp_file false)) select 1')",
    "select * from query('copy (select 1) to ''{part}''')",
    # out of the brackets that it is put in
    "select 1) ; copy (select 1 as a) to '{part}' (use_tmp_file false); select * from (select 1",
    "select 1) limit 0; drop view records; select (1",
]  # fmt: skip

READS = [
    "select * from '{secret}'", "select * from read_csv('{secret}')", "select * from read_text('{secret}')",
    "select * from read_blob('{secret}')", "select * from read_json('{secret}')", "select * from glob('{folder}/*')",
    "select * from sniff_csv('{secret}')", "select * from read_parquet('{parquet}')", "select * from '{parquet}'",
    "select * from parquet_metadata('{parquet}')", "select * from parquet_schema('{parquet}')",
    "select * from parquet_scan(['{part}', '{parquet}'])", "select * from read_parquet('{folder}/*.parquet')",
    "select * from 'http://localhost:1/a.parquet'", "select * from read_csv('https://localhost:1/a.csv')",
    "select * from 's3://bucket/a.parquet'", "select getenv('HOME')", "select * from duckdb_secrets()",
    "select * from query('select * from read_text(''{secret}'')')", "select * from query_table('{parquet}')",
    "select * from sqlite_scan('{secret}', 'a')", "select * from given", "select * from enable_logging()",
    "select * from file:{secret}",
]  # fmt: skip


@pytest.fixture
def outside(run: Path, tmp_path: Path) -> dict[str, Path]:
    """A copy of a run, and what lies beside it."""
    own = tmp_path / "run"
    shutil.copytree(run, own)
    (tmp_path / "secret.csv").write_text("a,b\n1,2\n")
    pq.write_table(pa.table({"a": [1]}), tmp_path / "other.parquet")
    (tmp_path / "out").mkdir()
    return {
        "run": own, "part": own / "records" / "part-0.parquet", "out": tmp_path / "out", "folder": tmp_path,
        "secret": tmp_path / "secret.csv", "parquet": tmp_path / "other.parquet",
    }  # fmt: skip


def test_nothing_is_written(outside: dict[str, Path]) -> None:
    """Every statement that writes or sets is refused, however it is wrapped, and no file changes or appears."""
    before, there = held(outside["run"]), sorted(outside["folder"].rglob("*"))
    for statement in WRITES:
        with pytest.raises(QueryError):
            rows(outside["run"], statement.format(**outside))
        assert held(outside["run"]) == before, statement
        assert sorted(outside["folder"].rglob("*")) == there, statement


def test_nothing_is_read_but_the_parts(outside: dict[str, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    """Files beside the run, the net, the environment and Python's variables are out of reach."""
    monkeypatch.chdir(outside["folder"])
    given = pa.table({"a": [1]})
    for statement in [*READS, "select * from 'secret.csv'", "select * from 'other.parquet'"]:
        with pytest.raises(QueryError):
            rows(outside["run"], statement.format(**outside))
    assert given.num_rows == 1
    assert rows(outside["run"], f"select count(*) from read_parquet('{outside['part']}')")[0][0] > 0


def test_what_is_out_of_reach_is_there(outside: dict[str, Path]) -> None:
    """The statements that are refused do read, and write, on a connection without the guard: the test can fail."""
    with duckdb.connect() as free:
        for statement in READS[:4]:
            assert free.execute(f"select count(*) from ({statement.format(**outside)})").fetchall()[0][0] > 0
        before = outside["part"].read_bytes()
        free.execute(next(s for s in WRITES if s.startswith("with x as (copy")).format(**outside)).fetchall()
    assert outside["part"].read_bytes() != before


@pytest.mark.parametrize(
    ("statement", "said"),
    [
        ("selec 1", "line 1, column 1: syntax error"),
        ("select nocol from records", r'line 1, column 8: Referenced column "nocol" not found'),
        ("select 'é',\n  backend,\n  nocol\nfrom records", "line 3, column 3: "),
        ("select 'é', nocol from records", "line 1, column 13: "),
        ("select * from recrds", "column 15: no table is called 'recrds'; this run has: problems, truth, records"),
        ("select * from claims", "no table is called 'claims'"),
        ("select foo(1)", "column 8: Scalar Function with name foo does not exist"),
        ("select sum(backend) from records", "column 8: "),
        ("select 'x'::int", "Could not convert"),
        ("select problem::int from records", "Could not convert"),
        ("select * from read_csv('/etc/hosts')", "reads the parts of its run and nothing else"),
        ("select $1", "Values were not provided"),
        ("select 1; select 2", "2 statements are given"),
        ("copy (select 1) to 'x'", "of the kind COPY is not answered: a query is one SELECT"),
        ("select 'a", "unterminated"),
    ],
)
def test_a_wrong_statement_gives_one_line_with_its_place(run: Path, statement: str, said: str) -> None:
    """Line and column, in characters, of the statement as it was typed, and what is wrong there."""
    with pytest.raises(QueryError, match=said) as raised:
        rows(run, statement)
    assert "\n" not in str(raised.value)


def test_the_command_prints_a_bounded_table_json_or_parquet(run: Path, tmp_path: Path) -> None:
    """A table of at most the limit's rows that says so, JSON of all rows, a Parquet file of all rows."""
    statement = "select problem, backend, error, qdot from records order by problem, backend, error"
    shown = command(statement, run, "--limit", 3)
    assert shown.returncode == 0 and "the first 3 rows" in shown.stdout and shown.stdout.count("│ osqp") <= 3
    told = command(statement, run, "--json")
    whole = json.loads(told.stdout)
    assert told.returncode == 0 and len(whole) == read_table(run, "records", ["problem"]).num_rows
    assert json.loads(command(statement, run, "--json", "--limit", 2).stdout) == whole[:2]
    done = command(statement, run, "--parquet", tmp_path / "deep" / "a.parquet")
    assert done.stdout == f"{len(whole)} rows in {tmp_path / 'deep' / 'a.parquet'}\n" and done.stderr == ""
    assert pq.read_table(tmp_path / "deep" / "a.parquet").to_pylist() == whole
    wrong = command("select nocol from records", run)
    assert wrong.returncode == 2 and wrong.stdout == "" and wrong.stderr.startswith("error: line 1, column 8: ")
    assert wrong.stderr.count("\n") == 1


def test_a_query_does_not_write_into_the_run(run: Path) -> None:
    """--parquet into the run folder is refused, --json beside it too."""
    before = held(run)
    for words in (("--parquet", run / "records" / "part-0.parquet"), ("--parquet", run / "new" / "a.parquet")):
        done = command("select 1", run, *words)
        assert done.returncode == 2 and "lies in the run folder" in done.stderr
    assert command("select 1", run, "--json", "--parquet", run.parent / "a.parquet").returncode == 2
    assert held(run) == before


def test_an_interrupted_file_is_not_left(run: Path, tmp_path: Path) -> None:
    """An answer that fails on the way leaves no Parquet file, whole or half."""
    with pytest.raises(QueryError):
        query.write_answer(run, "select 1 / 1 as x, backend::int as y from records", tmp_path / "a.parquet")
    assert not list(tmp_path.iterdir())


def test_ctrl_c_stops_a_query(run: Path) -> None:
    """A statement that would take years ends within seconds of SIGINT, exit status 130, and leaves no file behind."""
    command = [
        sys.executable,
        "-m",
        "sandbox.cli",
        "query",
        "select count(*) from range(1000000000000) where range % 7 = 3",
        run,
    ]
    with tempfile.TemporaryDirectory() as scratch:
        asked = subprocess.Popen(
            command, env={**os.environ, "TMPDIR": scratch}, stdout=subprocess.PIPE, text=True,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),  # a suite in the background ignores it
        )  # fmt: skip
        for _ in range(300):
            if os.listdir(scratch):
                break
            time.sleep(0.1)
        time.sleep(1)
        assert asked.poll() is None
        asked.send_signal(signal.SIGINT)
        out, _ = asked.communicate(timeout=30)
        assert (asked.returncode, out) == (130, "") and os.listdir(scratch) == []


def test_json_says_what_json_can_say(run: Path) -> None:
    """NaN and infinity are null, decimals and huge integers numbers, duplicates of a name told apart."""
    statement = """select 'nan'::double as a, [1.5, 'inf'::double] as b, {'k': 'nan'::double} as c, sum(1) as d,
        1.5::decimal(4, 2) as e, date '2024-01-02' as f, 'ab'::blob as g, null as h, 1 as i, 2 as i, map(['x'], [1]) as j,
        true as k"""
    with query.answered(run, statement) as answer:
        (row,) = json.loads("".join(query.json_rows(answer)))
    assert row == {
        "a": None, "b": [1.5, None], "c": {"k": None}, "d": 1, "e": 1.5, "f": "2024-01-02", "g": "6162", "h": None, "i": 1,
        "i_1": 2, "j": {"x": 1}, "k": True,
    }  # fmt: skip
    with query.answered(run, "select 1 as x where false") as answer:
        assert json.loads("".join(query.json_rows(answer))) == []


def test_many_columns_are_shown_one_below_the_other(run: Path) -> None:
    """A record of fifty columns is readable in the terminal: a line for each of its values."""
    shown = command("select * from records", run, "--limit", 2).stdout
    assert all(f"│ {name} " in shown for name in RECORDS.names)


@pytest.mark.parametrize("name", ["run [1]", "it's a run", "run *?", "{a,b}", "r%20ün"])
def test_folders_may_have_any_name(run: Path, tmp_path: Path, name: str) -> None:
    """Quotes and the letters of patterns in the name of a folder are letters."""
    shutil.copytree(run, tmp_path / name)
    shutil.copytree(run, tmp_path / "run 1")  # what the pattern would match
    assert rows(tmp_path / name, "select count(*) from records") == rows(run, "select count(*) from records")


def test_a_damaged_run_is_named(run: Path, tmp_path: Path) -> None:
    """No run, a part cut short, of another kind, with a column missing or of another type: the file, and what is wrong."""
    with pytest.raises(InputFileError, match="is no run folder"):
        rows(tmp_path, "select 1")
    own = tmp_path / "run"
    shutil.copytree(run, own)
    part = own / "records" / "part-1.parquet"
    table = pq.read_table(part)
    for wrong, said in (
        (table.drop_columns(["verdict"]), "lacks the column 'verdict'"),
        (table.set_column(0, "problem", pa.array([1.0] * table.num_rows)), "'problem' as double, not string"),
        (table.append_column("error", table["error"]), "twice the column 'error'"),
    ):
        pq.write_table(wrong, part)
        with pytest.raises(InputFileError, match=rf"part-1\.parquet .*{said}"):
            rows(own, "select count(*) from records")
    part.write_bytes(part.read_bytes()[:200])
    with pytest.raises(InputFileError, match=r"part-1\.parquet is no Parquet file"):
        rows(own, "select 1")


def test_a_run_without_parts_has_no_tables(tmp_path: Path, run: Path) -> None:
    """A run that has not written a record answers what needs none."""
    (tmp_path / "run.json").write_text((run / "run.json").read_text())
    assert rows(tmp_path, "select 1") == [(1,)]
    with pytest.raises(QueryError, match="has no parts"):
        rows(tmp_path, "select * from records")
