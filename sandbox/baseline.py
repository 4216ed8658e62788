"""The committed verdicts of the standard run: a release must not turn a verified answer into a false one."""

from __future__ import annotations

from pathlib import Path

import duckdb
import pyarrow as pa

from sandbox.query import database, parts, scan
from sandbox.records import CLOSED_FORM, read_part, read_run, write_parquet

FILE = Path(__file__).parent / "baseline.parquet"
"""Written by `sandbox verify --accept`."""

KEYS = ("problem", "set", "task", "backend", "formulation", "settings", "mode", "engine_version")

_name = pa.dictionary(pa.int32(), pa.string())

SCHEMA = pa.schema([("problem", _name)] + [(name, _name) for name in KEYS[1:]])
"""Every record that was verified; what is not listed was not."""

FALLEN = ("false_success", "crashed")
"""A verified answer that becomes one of these has fallen."""


def accept(run: Path, file: Path = FILE) -> int:
    """Make the verified records of `run` the baseline; returns how many they are."""
    read_run(run)
    with database() as connection:
        verified = connection.sql(
            f"SELECT {', '.join(KEYS)} FROM {scan(parts(run, 'records'), 'records')} WHERE verdict = 'verified' "
            f"ORDER BY {', '.join(f'{key} NULLS LAST' for key in reversed(KEYS))}"
        ).to_arrow_table()
    write_parquet(verified.cast(SCHEMA), file)
    return int(verified.num_rows)


def fallen(run: Path, file: Path = FILE) -> list[dict[str, object]]:
    """Records of `run` that fell: verified in the baseline with the same engine version, false or crashed now.

    A closed form falls where it answers what has no answer, refuses a problem of its domain, or exceeds its own bound.
    """
    read_run(run)
    columns = ", ".join(f"now.{key}" for key in KEYS) + ", now.verdict, now.error"
    rows: list[dict[str, object]] = []
    with database() as connection:
        connection.execute(f"CREATE VIEW now AS SELECT * FROM {scan(parts(run, 'records'), 'records')}").fetchall()
        if file.is_file():
            before = read_part(file, SCHEMA)
            connection.register("before", pa.table({name: before[name].cast(pa.string()) for name in KEYS}))
            same = " AND ".join(f"now.{key} IS NOT DISTINCT FROM before.{key}" for key in KEYS)
            rows += _rows(connection, f"SELECT {columns} FROM now JOIN before ON {same} WHERE now.verdict IN {FALLEN}")
        rows += _rows(
            connection,
            f"SELECT {columns} FROM now WHERE starts_with(backend, '{CLOSED_FORM}') AND (verdict IN ('crashed', "
            "'wrong_refusal') OR (verdict = 'false_success' AND error IS NULL) OR error > tolerance)",
        )
    return rows


def _rows(connection: duckdb.DuckDBPyConnection, query: str) -> list[dict[str, object]]:
    cursor = connection.execute(query)
    names = [column[0] for column in cursor.description or ()]
    return [dict(zip(names, row, strict=True)) for row in cursor.fetchall()]
