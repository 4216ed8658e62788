"""The committed verdicts of the standard run: a release must not turn a verified answer into a false one."""

from __future__ import annotations

from pathlib import Path

import duckdb
import pyarrow as pa
import pyarrow.compute as pc

from sandbox.records import CLOSED_FORM, read_part, read_table, write_parquet

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
    records = read_table(run, "records", [*KEYS, "verdict"])
    verified = records.filter(pc.equal(records["verdict"].cast(pa.string()), "verified")).select(list(KEYS))
    plain = pa.table({name: verified[name].cast(pa.string()) for name in KEYS})
    ordered = plain.sort_by([(name, "ascending") for name in reversed(KEYS)])
    write_parquet(ordered.cast(SCHEMA), file)
    return int(verified.num_rows)


def fallen(run: Path, file: Path = FILE) -> list[dict[str, object]]:
    """Records of `run` that fell: verified in the baseline with the same engine version, false or crashed now.

    A closed form falls where it answers what has no answer, refuses a problem of its domain, or exceeds its own bound.
    """
    records = read_table(run, "records", [*KEYS, "verdict", "error", "tolerance"])
    now = pa.table({n: records[n].cast(pa.string()) if pa.types.is_dictionary(records[n].type) else records[n]
                    for n in records.column_names})  # fmt: skip
    columns = ", ".join(f"now.{key}" for key in KEYS) + ", now.verdict, now.error"
    rows: list[dict[str, object]] = []
    with duckdb.connect() as database:
        database.register("now", now)
        if file.is_file():
            before = read_part(file, SCHEMA)
            database.register("before", pa.table({name: before[name].cast(pa.string()) for name in KEYS}))
            same = " AND ".join(f"now.{key} IS NOT DISTINCT FROM before.{key}" for key in KEYS)
            rows += _rows(database, f"SELECT {columns} FROM now JOIN before ON {same} WHERE now.verdict IN {FALLEN}")
        rows += _rows(
            database,
            f"SELECT {columns} FROM now WHERE starts_with(backend, '{CLOSED_FORM}') AND (verdict IN ('crashed', "
            "'wrong_refusal') OR (verdict = 'false_success' AND error IS NULL) OR error > tolerance)",
        )
    return rows


def _rows(database: duckdb.DuckDBPyConnection, query: str) -> list[dict[str, object]]:
    cursor = database.execute(query)
    names = [column[0] for column in cursor.description or ()]
    return [dict(zip(names, row, strict=True)) for row in cursor.fetchall()]
