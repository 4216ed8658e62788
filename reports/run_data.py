"""A run folder opened for questions: its records, problems and truths as DuckDB tables."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import duckdb

from sandbox.records import read_run, read_table

CLOSED = "closed_form:"
"""Backends with this prefix are closed forms."""

_JUDGED_AT = ("high_accuracy", "mid_accuracy", "low_accuracy", "default")


class RunData:
    """Tables `records`, `problems`, `truth` of a run, and run.json as `about`.

    `records` carries four columns more: `id` (row number), `judged` (asked for the accuracy at which backends are
    compared by verdict; closed forms always are), `apart` (not held against the backend: the formulation is to blame, or
    it gave up on what float64 cannot attain) and `closed`. Non-finite numbers become null.

    Raises
    ------
    InputFileError
        where `folder` is no run folder, a part is no Parquet file, or a part lacks a column.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = Path(folder)
        self.about: dict[str, Any] = read_run(self.folder)
        self.connection = duckdb.connect(":memory:", config={"threads": 2})
        records = read_table(self.folder, "records")
        present = set(records["settings"].unify_dictionaries().cast("string").unique().to_pylist())
        self.settings: str = next((name for name in _JUDGED_AT if name in present), "high_accuracy")
        """The settings level at which backends are compared by verdict."""
        self._load("problems", read_table(self.folder, "problems"))
        self._load("truth", read_table(self.folder, "truth"))
        self._load(
            "records",
            records,
            ["lower(status) as status"],
            f"""(row_number() over ())::int as id, starts_with(backend, '{CLOSED}') as closed,
            (settings is null or settings = '{self.settings}') as judged,
            coalesce(blame = 'formulation', false)
              or (verdict in ('limit', 'right_refusal', 'wrong_refusal', 'out_of_scope') and not coalesce(attainable, true))
              as apart""",
        )

    def _load(self, kind: str, content: Any, replaced: Sequence[str] = (), more: str = "") -> None:
        """Table `kind` with non-finite numbers as null, columns `replaced`, and `more` columns."""
        finite = [
            f'case when isfinite("{field.name}") then "{field.name}" end as "{field.name}"'
            if str(field.type) == "double"
            else f'[case when isfinite(x) then x end for x in "{field.name}"] as "{field.name}"'
            for field in content.schema
            if "double" in str(field.type)
        ]
        columns = ", ".join([f"* replace ({', '.join([*finite, *replaced])})", *([more] if more else [])])
        self.connection.register("arrow", content)
        self.connection.execute(f"create table {kind} as select {columns} from arrow")
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
