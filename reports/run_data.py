"""A run folder opened for questions: its records, problems, truths and method study as DuckDB views of its Parquet parts."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Any

import duckdb
import pyarrow as pa

from sandbox.check import line, named
from sandbox.errors import InputFileError
from sandbox.query import database, parts, scan
from sandbox.records import CLOSED_FORM, KINDS, read_run

OWN = ("verified", "crashed", "timed_out", "not_run")
"""Verdicts that always count as the backend's: a success, a death and silence are nobody else's."""

APART: dict[str, str] = {
    "formulation": f"coalesce(blame, '') = 'formulation' and verdict not in {OWN}",
    "float64": "not coalesce(attainable, true) and verdict in ('limit', 'right_refusal', 'wrong_refusal', 'out_of_scope')",
}
"""Why an answer is not held against its backend -> SQL condition: the formulation lost it, or it gave up
on what float64 cannot attain. The first that applies."""

OF_METHODS = "set in ('methods', 'trajectories')"
"""SQL condition: the problems that the methods pose, at configurations and along paths."""

SEED = 20250101
DRAW = f"('0x' || left(md5(problem || '{SEED}'), 12))::bigint::double"
"""SQL: a seeded hash of the problem, the same for all backends, in 48 bits, which a double holds."""

TALLIED = ("set", "task", "expected", "formulation", "backend", "settings", "verdict", "apart", "closed", "judged")
"""Columns of the table `tally`: what counts ask for, read once."""

_JUDGED_AT = ("high_accuracy", "mid_accuracy", "low_accuracy", "default")


class RunData:
    """Views `records`, `warm`, `problems`, `truth`, `methods`, `motions` of a run, and run.json as `about`.

    A question reads the columns it names from the parts, which stay where they are: no view is ever held in memory. Two
    tables are: `tally`, how many records (`n`) there are of each combination of TALLIED, and `posed`, the distinct problem,
    task and expected class of the records.

    `records` are the cold solves: what is counted, ranked and listed. `warm` are the same solves started from an earlier
    answer, for comparison alone. Both carry four columns more: `id` (of the row, in the order of the parts), `judged` (asked
    for the accuracy at which backends are compared by verdict; closed forms always are), `apart` (why it is not held against
    the backend, a key of APART, or null) and `closed`. Non-finite numbers become null.

    Raises
    ------
    InputFileError
        where `folder` is no run folder, a part is no Parquet file, or a part lacks a column.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = Path(folder)
        self.about: dict[str, Any] = read_run(self.folder)
        self._open = ExitStack()
        self.connection: duckdb.DuckDBPyConnection = self._open.enter_context(database())
        try:
            self._create_views()
        except BaseException:
            self.close()
            raise

    def _create_views(self) -> None:
        for kind in ("problems", "truth", "methods", "motions"):
            self.do(f"create view {kind} as select * replace ({_finite(kind)}) from {scan(parts(self.folder, kind), kind)}")
        files = parts(self.folder, "records")
        present = {row["settings"] for row in self.rows(f"select distinct settings from {scan(files, 'records')}")}
        self.settings: str = next((name for name in _JUDGED_AT if name in present), "high_accuracy")
        """The settings level at which backends are compared by verdict."""
        for view, condition in (("records", "is distinct from"), ("warm", "=")):
            self.do(
                f"""create view {view} as select file_index::bigint << 32 | file_row_number as id,
                * replace ({_finite("records")}, lower(status) as status), starts_with(backend, '{CLOSED_FORM}') as closed,
                (settings is null or settings = '{self.settings}') as judged,
                case {" ".join(f"when {apart} then '{name}'" for name, apart in APART.items())} end as apart
                from {scan(files, "records", ("file_index", "file_row_number"))} where mode {condition} 'warm'"""
            )

        self.do(f"create table tally as select {', '.join(TALLIED)}, count(*) as n from records group by all")
        self.do("create table posed as select distinct problem, task, expected from records")

    def do(self, statement: str) -> None:
        """Carry out a statement that answers nothing."""
        try:
            self.connection.execute(statement).fetchall()
        except duckdb.Error as error:
            raise InputFileError(f"{named(self.folder)}: {line(error)}") from error

    def table(self, query: str, parameters: list[Any] | None = None) -> Any:
        """The answer to a query as a pyarrow Table; nothing is left open on the connection."""
        try:
            return self.connection.sql(query, params=parameters or None).to_arrow_table()
        except duckdb.IOException as error:  # a page of a part is damaged
            raise InputFileError(f"{named(self.folder)}: {line(error)}") from error

    def rows(self, query: str, parameters: list[Any] | None = None) -> list[dict[str, Any]]:
        """The answer to a query that aggregates, one dict a row."""
        rows: list[dict[str, Any]] = self.table(query, parameters).to_pylist()
        return rows

    def one(self, query: str, parameters: list[Any] | None = None) -> Any:
        """The only number of an answer."""
        rows = self.rows(query, parameters)
        return next(iter(rows[0].values())) if rows else None

    def close(self) -> None:
        """Free the database and what it spilt."""
        self._open.close()


def _finite(kind: str) -> str:
    """SQL of the columns of doubles, null where a number is not finite."""
    return ", ".join(
        f'case when isfinite("{field.name}") then "{field.name}" end as "{field.name}"'
        if field.type == pa.float64()
        else f'[case when isfinite(x) then x end for x in "{field.name}"] as "{field.name}"'
        for field in KINDS[kind]
        if field.type in (pa.float64(), pa.list_(pa.float64()))
    )
