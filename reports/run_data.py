"""A run folder opened for questions: its records, problems, truths and method study as DuckDB tables."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import duckdb
import pyarrow as pa

from sandbox.records import CLOSED_FORM, METHODS, MOTIONS, PROBLEMS, RECORDS, TRUTH, read_part, read_run

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

_JUDGED_AT = ("high_accuracy", "mid_accuracy", "low_accuracy", "default")


class RunData:
    """Tables `records`, `warm`, `problems`, `truth`, `methods`, `motions` of a run, and run.json as `about`.

    `records` are the cold solves: what is counted, ranked and listed. `warm` are the same solves started from an earlier
    answer, for comparison alone. Both carry four columns more: `id` (row number), `judged` (asked for the accuracy at which
    backends are compared by verdict; closed forms always are), `apart` (why it is not held against the backend, a key of
    APART, or null) and `closed`. Non-finite numbers become null.

    Raises
    ------
    InputFileError
        where `folder` is no run folder, a part is no Parquet file, or a part lacks a column.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = Path(folder)
        self.about: dict[str, Any] = read_run(self.folder)
        self.connection = duckdb.connect(":memory:", config={"threads": 2})
        tables = {"problems": PROBLEMS, "truth": TRUTH, "raw": RECORDS, "methods": METHODS, "motions": MOTIONS}
        for kind, schema in tables.items():
            self._load(kind, self.folder / ("records" if kind == "raw" else kind), schema)
        present = {row["settings"] for row in self.rows("select distinct settings from raw")}
        self.settings: str = next((name for name in _JUDGED_AT if name in present), "high_accuracy")
        """The settings level at which backends are compared by verdict."""
        for view, condition in (("records", "is distinct from"), ("warm", "=")):
            self.connection.execute(
                f"""create view {view} as select rowid::int as id, * replace (lower(status) as status),
                starts_with(backend, '{CLOSED_FORM}') as closed, (settings is null or settings = '{self.settings}') as judged,
                case {" ".join(f"when {apart} then '{name}'" for name, apart in APART.items())} end as apart
                from raw where mode {condition} 'warm'"""
            )

    def _load(self, table: str, folder: Path, schema: pa.Schema) -> None:
        """Fill `table` from the parts in `folder`, one at a time to save memory; non-finite numbers become null."""
        finite = ", ".join(
            f'case when isfinite("{field.name}") then "{field.name}" end as "{field.name}"'
            if field.type == pa.float64()
            else f'[case when isfinite(x) then x end for x in "{field.name}"] as "{field.name}"'
            for field in schema
            if field.type in (pa.float64(), pa.list_(pa.float64()))
        )
        select = f"select * replace ({finite}) from arrow"
        plain = pa.schema([(f.name, pa.string() if pa.types.is_dictionary(f.type) else f.type) for f in schema])
        self.connection.register("arrow", plain.empty_table())
        self.connection.execute(f"create table {table} as {select}")
        for part in sorted(folder.glob("*.parquet")):
            self.connection.register("arrow", read_part(part, schema))
            self.connection.execute(f"insert into {table} {select}")
        self.connection.unregister("arrow")

    def table(self, query: str, parameters: list[Any] | None = None) -> Any:
        """The answer to a query as a pyarrow Table; nothing is left open on the connection."""
        return self.connection.sql(query, params=parameters or None).to_arrow_table()

    def rows(self, query: str, parameters: list[Any] | None = None) -> list[dict[str, Any]]:
        """The answer to a query that aggregates, one dict a row."""
        rows: list[dict[str, Any]] = self.table(query, parameters).to_pylist()
        return rows

    def one(self, query: str, parameters: list[Any] | None = None) -> Any:
        """The only number of an answer."""
        rows = self.rows(query, parameters)
        return next(iter(rows[0].values())) if rows else None

    def close(self) -> None:
        """Free the tables."""
        self.connection.close()
