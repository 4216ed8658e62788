"""Run folders: run.json, problems/, truth/ and records/ as Parquet; written atomically, never pickled."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from sandbox.check import line, named
from sandbox.errors import InputFileError

CLOSED_FORM = "closed_form:"
"""Begins the name of a closed form in the column `backend`."""

FORMAT = 1
"""Of run.json; a folder of another format is neither read nor touched."""

_vector = pa.list_(pa.float64())
_name = pa.dictionary(pa.int32(), pa.string())

RECORDS = pa.schema(
    [
        ("problem", pa.string()),  # content hash
        ("set", _name),
        ("robot", _name),
        ("method", _name),
        ("seed", pa.int64()),
        ("step", pa.int64()),
        ("n", pa.int16()),
        ("m", pa.int16()),
        ("rank", pa.int16()),  # exact rank of J
        ("task", _name),  # exact, least_squares, damped
        ("expected", _name),  # unique_minimum, minimum_not_unique, no_minimum, infeasible
        ("expected_reason", _name),
        ("margin", pa.float64()),  # smallest relative perturbation that changes the class
        ("lambda_min_W", pa.float64()),
        ("lambda_min_reduced", pa.float64()),  # of N'WN, N orthonormal
        ("sigma_min_J", pa.float64()),
        ("kappa", pa.float64()),
        ("formulation", _name),  # null for closed forms
        ("backend", _name),  # "library:engine" or "closed_form:NAME"
        ("library_version", _name),
        ("engine_version", _name),
        ("settings", _name),  # default, low_accuracy, mid_accuracy, high_accuracy; null for closed forms
        ("effective_settings", _name),  # JSON
        ("mode", _name),  # cold, warm
        ("time_limit", pa.float64()),  # s
        ("status", _name),
        ("said", pa.string()),
        ("found", pa.bool_()),  # a finite x came back
        ("reason_right", pa.bool_()),
        ("verdict", _name),
        ("error", pa.float64()),  # relative, see verdict.py
        ("tolerance", pa.float64()),  # same denominator as error
        ("error_bound", pa.float64()),  # certified bound on the reference itself
        ("posing_error", pa.float64()),
        ("blame", _name),  # formulation, backend
        ("residuals_met", pa.bool_()),
        ("attainable", pa.bool_()),
        ("primal_residual", pa.float64()),  # unit of xdot
        ("dual_residual", pa.float64()),  # unit of a
        ("objective_gap", pa.float64()),
        ("multiplier_error", pa.float64()),
        ("iterations", pa.int32()),
        ("build_time", pa.float64()),  # s
        ("solve_time", pa.float64()),  # s
        ("runtime", pa.float64()),  # s, wall, in the worker
        ("repeat", pa.int32()),
        ("qdot", _vector),  # rad/s or m/s per joint
        ("y", _vector),
        ("run", _name),
    ]
)
"""Columns of a record; null where a column has no meaning, never 0 or NaN."""

PROBLEMS = pa.schema(
    [
        ("problem", pa.string()),
        ("set", _name),
        ("robot", _name),
        ("method", _name),
        ("seed", pa.int64()),
        ("step", pa.int64()),
        ("q", _vector),
        ("knob", _name),
        ("value", pa.float64()),
        ("case", pa.string()),
        ("n", pa.int16()),
        ("m", pa.int16()),
        ("k", pa.int16()),  # rows of the weight's factor E; null where W is not factored
        ("J", _vector),  # row-major
        ("xdot", _vector),
        ("W_base", _vector),
        ("W_E", _vector),
        ("W_gamma", _vector),
        ("a", _vector),
        ("Wx", _vector),
    ]
)
"""Columns of a problem file: matrices row-major."""

TRUTH = pa.schema(
    [
        ("problem", pa.string()),
        ("task", _name),
        ("expected", _name),
        ("reason", _name),
        ("margin", pa.float64()),
        ("rank", pa.int16()),
        ("inertia", pa.list_(pa.int32())),  # of N'WN: positive, negative, zero
        ("x", _vector),
        ("y", _vector),
        ("freedom", _vector),  # Z row-major, n x d; empty when unique
        ("value", pa.float64()),
    ]
)
"""Columns of a truth file: the exact answer, rounded once to float64."""

METHODS = pa.schema(
    [
        ("method", pa.string()),  # its name
        ("robot", pa.string()),
        ("n", pa.int16()),
        ("m", pa.int16()),
        ("situations", pa.int32()),  # seeded configurations drawn
        ("held", pa.int32()),  # of these, condition (7) held (for eq. 13: its own conditions)
        ("refused", pa.int32()),  # refused by the cast or by the closed form
        ("refusals", pa.string()),  # JSON: {words of the refusal: count}
        ("shift", pa.string()),  # null: as cast; "J'AJ", "J'B + B'J": W shifted, same motion
        ("indefinite", pa.int32()),  # W (shifted, if so) with a negative eigenvalue
        ("agreed", pa.int32()),  # framework and original within the sum of their bounds
        ("difference_median", pa.float64()),  # max norm, relative to the framework's answer
        ("difference_max", pa.float64()),
        ("ratio_max", pa.float64()),  # largest difference / sum of the bounds
        ("seconds", pa.float64()),  # to cast them all
    ]
)
"""Columns of the method study: one row per method, robot and shift of W."""

MOTIONS = pa.schema(
    [
        ("method", pa.string()),
        ("robot", pa.string()),
        ("path", pa.string()),
        ("closed", pa.bool_()),  # whether the path ends where it begins
        ("cycles", pa.int32()),
        ("integrator", pa.string()),
        ("stopped", pa.string()),  # why the motion ended early; null where it did not
        ("n", pa.int16()),
        ("m", pa.int16()),
        ("t", _vector),  # s, T instants
        ("q", _vector),  # T x n, row-major
        ("qdot", _vector),  # T x n
        ("hand", _vector),  # T x 3, position [m]
        ("task_error", _vector),  # T, |x - x_path| [m, rad]
        ("lambda_min_reduced", _vector),  # T, of N'WN, N orthonormal; NaN where not decided
        ("sigma_min_J", _vector),  # T
        ("arm", _vector),  # (frames, n + 2, 3): base, joints and hand of a few instants, for the stroboscope
        ("frames", pa.int32()),
        ("drift", _vector),  # joint drift |q(cycle end) - q(0)| after each cycle [rad]; null where not closed
        ("bracket", pa.float64()),  # Lie-bracket test at the start, 0 for an integrable law; null where it has none
        ("singularities", pa.string()),  # JSON: [{kind, how, of, t, value}] met or neared on the way
        ("share", pa.float64()),  # of the path that was followed
        ("peak_rate", pa.float64()),  # largest joint rate, 2-norm [rad/s, m/s]
        ("damping", pa.float64()),  # size of the base W~ where that is what the motion shows; null elsewhere
        ("secondary_error", pa.float64()),  # largest error of the secondary functions [unit of g]; null where there are none
    ]
)
"""Columns of the motions of the method study: one row per method, robot and path."""

CLAIMS = pa.schema(
    [
        ("place", pa.int16()),  # in the order of the ledger
        ("claim", pa.string()),  # its name
        ("title", pa.string()),
        ("where", pa.string()),  # in the paper
        ("says", pa.string()),  # $...$ is TeX, here and below
        ("formula", pa.string()),  # TeX
        ("tested", pa.string()),
        ("accepted", pa.string()),
        ("first", pa.string()),  # module:function of the code path that the fault is planted in
        ("first_words", pa.string()),
        ("second", pa.string()),
        ("second_words", pa.string()),
        ("sources", pa.list_(pa.string())),
        ("state", pa.string()),  # claims.State
        ("fault", pa.string()),  # the planted fault, in words
        ("fault_state", pa.string()),  # of the claim at a reduced size with its fault planted
        ("noticed", pa.bool_()),  # whether the fault turned the claim red
        ("seconds", pa.float64()),
        ("seed", pa.int64()),
        ("full", pa.bool_()),
        ("command", pa.string()),  # that examines this claim again
    ]
)
"""Columns of the paper's claims."""

CHECKS = pa.schema(
    [
        ("claim", pa.string()),
        ("place", pa.int16()),  # within its claim
        ("says", pa.string()),
        ("role", pa.string()),  # claims.Role
        ("holds", pa.bool_()),
        ("found", pa.string()),  # JSON: a number or words
        ("asked", pa.string()),
        ("count", pa.int64()),  # cases examined
        ("range", pa.string()),  # where it does hold, or how it is to be read
    ]
)
"""Columns of the checks of the claims."""

EXHIBITS = pa.schema([("claim", pa.string()), ("place", pa.int16()), ("kind", pa.string()), ("content", pa.string())])
"""Columns of the tables and plots of the claims; content is the JSON of claims.exhibit."""

KINDS = {
    "problems": PROBLEMS, "truth": TRUTH, "records": RECORDS, "methods": METHODS, "motions": MOTIONS,
    "claims": CLAIMS, "checks": CHECKS, "exhibits": EXHIBITS,
}  # fmt: skip
"""Folders of Parquet parts in a run, and what they hold."""


def write_parquet(table: pa.Table, path: Path) -> None:
    """Write `table` to `path` whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with _atomic(path) as temporary:
        pq.write_table(table, temporary, compression="zstd")


def write_batches(batches: pa.RecordBatchReader, path: Path) -> int:
    """Write a stream of batches to `path` whole or not at all, holding one at a time; returns the number of rows."""
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = 0
    with _atomic(path) as temporary, pq.ParquetWriter(temporary, batches.schema, compression="zstd") as writer:
        for batch in batches:
            writer.write_batch(batch)
            rows += batch.num_rows
    return rows


def write_json(content: dict[str, Any], path: Path) -> None:
    """Write `content` to `path` whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with _atomic(path) as temporary:
        Path(temporary).write_text(json.dumps(content, indent=1, allow_nan=False) + "\n")


@contextmanager
def _atomic(path: Path) -> Iterator[str]:
    """A temporary file beside `path` that replaces it on success and vanishes on failure; errors name `path`."""
    temporary = ""
    try:
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        os.close(handle)
        yield temporary
        with open(temporary, "rb") as written:
            os.fsync(written.fileno())
        # mkstemp makes private files: give this one the mode that any other new file would have
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(temporary, 0o666 & ~mask)
        os.replace(temporary, path)
    except OSError as error:
        raise OSError(error.errno or 0, error.strerror or line(error), str(path)) from error
    finally:
        with suppress(OSError):  # replaced, or already gone; the first error is the one to tell
            os.unlink(temporary)


def read_run(run: Path) -> dict[str, Any]:
    """run.json of a run folder.

    Raises InputFileError where `run` is no run folder, or one of another format.
    """
    path = Path(run) / "run.json"
    if not path.is_file():
        raise InputFileError(f"{named(run)} is no run folder: it has no run.json; `sandbox run` and `sandbox verify` make one")
    try:
        content = json.loads(path.read_text())
    except (ValueError, RecursionError) as error:
        raise InputFileError(f"{named(path)} is no JSON: {line(error)}") from error
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise InputFileError(f"{named(path)} is not of format {FORMAT}: it was written by another version, or by hand")
    return content


def read_part(path: Path, schema: pa.Schema, columns: list[str] | None = None) -> pa.Table:
    """One Parquet file as a table of `schema`, or of `columns` of it; what else it holds is left alone.

    Raises InputFileError where the file is no Parquet, lacks a column, or holds another type in one.
    """
    wanted = columns or schema.names
    try:
        present = pq.read_schema(path).names
        missing = [name for name in wanted if name not in present]
        if not missing:
            return pq.read_table(path, columns=wanted).select(wanted).cast(pa.schema([schema.field(name) for name in wanted]))
    except (pa.ArrowException, OSError, KeyError) as error:  # KeyError: a column twice
        raise InputFileError(f"{named(path)} is no Parquet file of this kind: {line(error)}") from error
    raise InputFileError(f"{named(path)} lacks the column {missing[0]!r}; it is no file of this kind")


def read_table(run: Path, kind: str, columns: list[str] | None = None) -> pa.Table:
    """All parts of `kind` (a name in KINDS) of a run folder as one table."""
    read_run(run)
    schema = KINDS[kind]
    parts: Iterable[Path] = sorted((Path(run) / kind).glob("*.parquet"))
    tables = [read_part(path, schema, columns) for path in parts]
    if not tables:
        return (schema if columns is None else pa.schema([schema.field(name) for name in columns])).empty_table()
    return pa.concat_tables(tables).unify_dictionaries()
