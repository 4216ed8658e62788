"""Questions to a run in SQL, read-only: DuckDB over its Parquet parts, in bounded memory.

A statement reaches the parts of its run and nothing else: one SELECT, posed inside another one (where no WITH may write),
on a connection that opens no other file, loads no extension and takes no setting any more.
"""

from __future__ import annotations

import json
import math
import os
import re
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Any

import duckdb
import pyarrow as pa
import pyarrow.parquet as pq
from rich.table import Table
from rich.text import Text

from sandbox.check import line, named
from sandbox.errors import InputFileError, QueryError
from sandbox.records import KINDS, read_run, write_batches

MEMORY = "1GB"
"""Of the database; Python, Arrow and what decompresses pages come on top, within twice that."""

SHOWN = 100
"""Rows of a table in the terminal where no limit is given."""

WIDE = 12
"""Columns beyond which a table in the terminal has one line for each value."""

CHUNK = 10_000
"""Rows taken from the database at a time."""

_HEAD = "select * from (\n"


# ---- parts ------------------------------------------------------------------------------------------------------------------


def parts(run: Path, kind: str) -> list[Path]:
    """Parts of `kind` (a name in KINDS) of a run folder, in the order of their names.

    Raises InputFileError where one is no Parquet file, lacks a column, or holds another type in one.
    """
    found = sorted(path for path in (Path(run) / kind).glob("*.parquet") if path.is_file())
    schema = KINDS[kind]
    for path in found:
        try:
            present = pq.read_schema(path)
        except (pa.ArrowException, OSError, ValueError) as error:
            raise InputFileError(f"{named(path)} is no Parquet file of this kind: {line(error)}") from error
        for field in schema:
            places = present.get_all_field_indices(field.name)
            if len(places) != 1:
                told = "lacks the column" if not places else "has twice the column"
                raise InputFileError(f"{named(path)} {told} {field.name!r}; it is no file of this kind")
            held = present.field(places[0]).type
            if _plain(held) != _plain(field.type):
                raise InputFileError(
                    f"{named(path)} holds the column {field.name!r} as {held}, not {field.type}; it is no file of this kind"
                )
    return found


def _plain(type_: pa.DataType) -> pa.DataType:
    """The type of the values that a column holds, however they are encoded."""
    if pa.types.is_dictionary(type_):
        return _plain(type_.value_type)
    if pa.types.is_list(type_) or pa.types.is_large_list(type_):
        return pa.list_(_plain(type_.value_type))
    return pa.string() if pa.types.is_large_string(type_) else type_


_SQL_TYPES = {
    pa.string(): "varchar", pa.float64(): "double", pa.bool_(): "boolean", pa.int16(): "smallint", pa.int32(): "integer",
    pa.int64(): "bigint",
}  # fmt: skip


def scan(files: Sequence[Path], kind: str, columns: Iterable[str] = ()) -> str:
    """SQL of a table: all rows of the parts of one kind, or none of its columns' rows where there is no part.

    `columns` names what DuckDB adds to them: filename, file_row_number, file_index.
    """
    if files:
        return f"read_parquet([{', '.join(text(literal(path)) for path in files)}])"
    empty = ", ".join(f'null::{_sql_type(field.type)} as "{field.name}"' for field in KINDS[kind])
    return f"(select {', '.join([empty, *(f'null::bigint as {name}' for name in columns)])} limit 0)"


def _sql_type(type_: pa.DataType) -> str:
    plain = _plain(type_)
    return f"{_sql_type(plain.value_type)}[]" if pa.types.is_list(plain) else _SQL_TYPES[plain]


def literal(path: Path) -> str:
    """A path that DuckDB takes for itself where it would take it for a pattern."""
    return re.sub(r"([\[*?])", r"[\1]", str(path))


def text(value: object) -> str:
    """A string in SQL."""
    return "'" + str(value).replace("'", "''") + "'"


@contextmanager
def database(memory: str = MEMORY, *, tables: bool = False) -> Iterator[duckdb.DuckDBPyConnection]:
    """A database that spills into a folder of its own, removed with it; it takes nothing from Python or the net.

    With `tables` those that are made in it lie in that folder, compressed; else in memory.
    """
    with tempfile.TemporaryDirectory(prefix="sandbox-query-") as scratch:
        config: dict[str, Any] = {
            "memory_limit": memory, "threads": _threads(), "temp_directory": f"{scratch}/spilt",
            "python_enable_replacements": False, "autoload_known_extensions": False, "autoinstall_known_extensions": False,
            "allow_community_extensions": False, "preserve_insertion_order": not tables,
        }  # fmt: skip
        with duckdb.connect(f"{scratch}/tables.duckdb" if tables else ":memory:", config=config) as connection:
            for setting in ("parquet_metadata_cache = true", "enable_progress_bar = false"):  # a bar would stand among answers
                connection.execute(f"set {setting}").fetchall()
            yield connection


def _threads() -> int:
    """As many as there are processors, but few: each holds buffers of its own."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(cores, 4)


# ---- one statement ----------------------------------------------------------------------------------------------------------


class _Worker:
    """A thread that asks the database while the main one waits for it or for Ctrl-C, which the database does not hear."""

    def __init__(self, connection: duckdb.DuckDBPyConnection) -> None:
        self.connection, self.pool = connection, ThreadPoolExecutor(1)

    def does(self, work: Callable[..., Any], *given: Any) -> Any:
        """The result of `work(*given)`; interrupted, the question is stopped first."""
        future = self.pool.submit(work, *given)
        try:
            return future.result()
        except KeyboardInterrupt:
            self.connection.interrupt()
            raise


@dataclass(eq=False)
class Answer:
    """The rows of one answer, computed as they are taken: as Python sees them or as Arrow batches; `names` of its columns."""

    statement: str
    names: list[str]
    connection: duckdb.DuckDBPyConnection
    worker: _Worker

    def rows(self) -> Iterator[tuple[Any, ...]]:
        """One tuple a row."""
        self.worker.does(self.connection.execute, self.statement)
        while chunk := self.worker.does(self.connection.fetchmany, CHUNK):
            yield from chunk

    def batches(self) -> pa.RecordBatchReader:
        """The rows as Arrow batches."""
        reader = self.worker.does(lambda: self.connection.sql(self.statement).to_arrow_reader(CHUNK))
        # a reader ends with StopIteration, which a future cannot carry
        taken = iter(lambda: self.worker.does(next, reader, None), None)
        return pa.RecordBatchReader.from_batches(reader.schema, taken)


@contextmanager
def answered(run: Path, statement: str, limit: int | None = None) -> Iterator[Answer]:
    """The answer of a run folder to one SELECT over its tables `records`, `problems`, ... (KINDS, where it has parts).

    At most `limit` rows. Nothing is written, and nothing is read but the parts of the run.

    Raises
    ------
    InputFileError
        where `run` is no run folder, or a part is not what it should be.
    QueryError
        where the statement is not one SELECT, or cannot be answered; it names the place.
    """
    read_run(run)
    files = {kind: found for kind in KINDS if (found := parts(run, kind))}
    with database() as connection:
        for kind, found in files.items():
            connection.execute(f"create view {kind} as select * from {scan(found, kind)}").fetchall()
        allowed = ", ".join(text(name) for found in files.values() for path in found for name in {str(path), literal(path)})
        for setting in (
            f"allowed_paths = [{allowed}]", "enable_external_access = false", "errors_as_json = true",
            "lock_configuration = true",
        ):  # fmt: skip
            connection.execute(f"set {setting}").fetchall()
        worker = _Worker(connection)
        try:
            yield _asked(connection, worker, _one_select(connection, statement), limit)
        except duckdb.Error as error:
            raise _refusal(error, statement, list(files)) from error
        finally:
            worker.pool.shutdown()


def _one_select(connection: duckdb.DuckDBPyConnection, statement: str) -> str:
    """The statement without what ends it, if it is one SELECT."""
    given = statement.rstrip("; \t\r\n")
    found = connection.extract_statements(given)
    if len(found) != 1:
        raise QueryError(f"{len(found)} statements are given; a query is one SELECT")
    kind = found[0].type.name
    if kind != "SELECT":
        raise QueryError(f"a statement of the kind {kind} is not answered: a query is one SELECT, and reads")
    return given


def _asked(connection: duckdb.DuckDBPyConnection, worker: _Worker, statement: str, limit: int | None) -> Answer:
    # inside a subquery a WITH that copies, inserts or deletes is refused by the binder; at the top it would write
    most = "" if limit is None else f" limit {int(limit)}"
    posed = f"{_HEAD}{statement}\n){most}"
    connection.execute(f"{_HEAD}{statement}\n) limit 0")  # binds, and tells what is wrong with its place
    names = [column[0] for column in connection.description or ()]
    connection.fetchall()
    return Answer(posed, names, connection, worker)


def _refusal(error: duckdb.Error, statement: str, tables: list[str]) -> QueryError:
    """One line: the place in the statement, what DuckDB says of it, and which tables there are."""
    words = str(error)
    try:
        told = json.loads(words[words.index("{") :])
    except ValueError:  # raised on the Python side, in plain words
        return QueryError(line(words.splitlines()[0]))
    message = line(told.get("exception_message", words))
    if told.get("exception_type") == "Catalog" and told.get("type") == "Table":
        message = f"no table is called {told.get('name')!r}; this run has: {', '.join(tables) or 'none, it has no parts'}"
    elif "Did you mean" not in message and told.get("exception_type") == "Permission":
        message += "; a query reads the parts of its run and nothing else"
    try:
        at = int(told["position"])
    except (KeyError, ValueError):
        return QueryError(message)
    raw, head = statement.encode(), len(_HEAD.encode())
    # the statement is parsed alone first: only what the parser passed stands behind the head
    at -= 0 if told.get("exception_type") == "Parser" else head
    before = raw[: max(0, min(at, len(raw)))].decode(errors="replace")
    column = len(before) - (before.rfind("\n") + 1) + 1
    return QueryError(f"line {before.count(chr(10)) + 1}, column {column}: {message}", position=at)


# ---- what becomes of an answer ----------------------------------------------------------------------------------------------


def table(answer: Answer, limit: int) -> list[Table | Text]:
    """The first `limit` rows for the terminal, and a line where there are more. A cell takes one short line."""
    out: list[Table | Text] = []
    wide = len(answer.names) > WIDE
    drawn = Table()
    for name in ("row", "column", "value") if wide else answer.names:
        drawn.add_column(Text(name), overflow="fold")
    for place, row in enumerate(answer.rows()):
        if place == limit:
            out.append(Text(f"the first {limit} rows; --limit shows more, --json and --parquet give all"))
            break
        cells = [Text(_shown(value), style="dim" if value is None else "") for value in row]
        if not wide:
            drawn.add_row(*cells)
            continue
        for name, cell in zip(answer.names, cells, strict=True):
            drawn.add_row("" if cell is not cells[0] else str(place), Text(name), cell)
        drawn.add_section()
    return [drawn, *out]


def _shown(value: Any) -> str:
    if value is None:
        return "null"
    return line(value) if isinstance(value, str) else line(_plain_value(value, finite=False))


def json_rows(answer: Answer) -> Iterator[str]:
    """A JSON array with one object a row, piece by piece; numbers that are not finite are null."""
    begin = "[\n"
    for row in answer.rows():
        content = {name: _plain_value(value) for name, value in zip(answer.names, row, strict=True)}
        yield begin + json.dumps(content, allow_nan=False)
        begin = ",\n"
    yield "[]\n" if begin == "[\n" else "\n]\n"


def _plain_value(value: Any, finite: bool = True) -> Any:
    """What JSON can say of a value of the database."""
    if isinstance(value, float):
        return value if math.isfinite(value) or not finite else None
    if value is None or isinstance(value, (bool, int, str)):
        return value
    if isinstance(value, Decimal):
        return int(value) if value == value.to_integral_value() else float(value)
    if isinstance(value, (list, tuple)):
        return [_plain_value(one, finite) for one in value]
    if isinstance(value, dict):
        return {str(key): _plain_value(one, finite) for key, one in value.items()}
    return value.hex() if isinstance(value, bytes) else str(value)


def write_answer(run: Path, statement: str, file: Path, limit: int | None = None) -> int:
    """Write the answer to one SELECT into a Parquet file, whole or not at all; returns the number of its rows.

    Raises InputFileError where `file` lies in the run folder, and as `answered`.
    """
    if Path(run).resolve() in Path(file).resolve().parents:
        raise InputFileError(f"{named(file)} lies in the run folder {named(run)}, which a query only reads; name another place")
    with answered(run, statement, limit) as answer:
        return write_batches(answer.batches(), Path(file))
