"""Files of a run folder are written whole or not at all, and read as what they are or refused in one line."""

from __future__ import annotations

import errno
import json
import os
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from sandbox import records
from sandbox.errors import InputFileError

SCHEMA = pa.schema([("name", pa.dictionary(pa.int32(), pa.string())), ("size", pa.float64())])

TABLE = pa.table({"name": ["a", "b"], "size": [1.0, 2.0]})


def test_what_is_written_is_read(tmp_path: Path) -> None:
    """JSON and Parquet come back, with the mode of any new file, and nothing else stays in the folder."""
    records.write_json({"format": records.FORMAT, "id": "x"}, tmp_path / "run.json")
    records.write_parquet(TABLE.cast(SCHEMA), tmp_path / "records" / "a.parquet")
    assert records.read_run(tmp_path)["id"] == "x"
    assert records.read_part(tmp_path / "records" / "a.parquet", SCHEMA).cast(TABLE.schema) == TABLE
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["a.parquet", "records", "run.json"]
    (tmp_path / "plain").write_text("")
    assert (tmp_path / "run.json").stat().st_mode == (tmp_path / "plain").stat().st_mode


def test_a_folder_in_the_way_leaves_no_temporary_file(tmp_path: Path) -> None:
    """The error names the target, and nothing is left beside it."""
    (tmp_path / "run.json").mkdir()
    with pytest.raises(IsADirectoryError) as caught:
        records.write_json({}, tmp_path / "run.json")
    assert caught.value.filename == str(tmp_path / "run.json")
    assert [p.name for p in tmp_path.iterdir()] == ["run.json"]


def test_what_cannot_be_written_leaves_the_old_file(tmp_path: Path) -> None:
    """NaN is no JSON: the file of before stays."""
    records.write_json({"old": 1}, tmp_path / "run.json")
    with pytest.raises(ValueError, match="not JSON compliant"):
        records.write_json({"new": float("nan")}, tmp_path / "run.json")
    assert json.loads((tmp_path / "run.json").read_text()) == {"old": 1}
    assert [p.name for p in tmp_path.iterdir()] == ["run.json"]


@pytest.mark.parametrize("gone", [False, True])
def test_a_full_disk_is_told_by_the_name_of_the_target(gone: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No space left: that is the error, even where the temporary file is gone too."""

    def full(table: pa.Table, where: str, **options: Any) -> None:
        if gone:
            os.unlink(where)
        raise OSError(errno.ENOSPC, "No space left on device", where)

    monkeypatch.setattr(pq, "write_table", full)
    with pytest.raises(OSError, match="No space left") as caught:
        records.write_parquet(TABLE, tmp_path / "a.parquet")
    assert (caught.value.errno, caught.value.filename) == (errno.ENOSPC, str(tmp_path / "a.parquet"))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("{}", "is not of format 1: it was written by another version"),
        ('{"format": 2}', "is not of format 1"),
        ("[1]", "is not of format 1"),
        ("null", "is not of format 1"),
        ("{", "is no JSON"),
        ("[" * 100_000, "is no JSON"),
        ("\xff", "is no JSON"),
    ],
)
def test_other_folders_are_no_runs(content: str, words: str, tmp_path: Path) -> None:
    """run.json must be one of ours: of this format, an object, JSON at all."""
    (tmp_path / "run.json").write_text(content, encoding="latin-1")
    with pytest.raises(InputFileError, match=words) as caught:
        records.read_run(tmp_path)
    assert str(caught.value).startswith(str(tmp_path / "run.json")) and str(caught.value).isprintable()


def test_names_of_folders_stay_on_one_line(tmp_path: Path) -> None:
    """A line break in a name is shown, not printed."""
    with pytest.raises(InputFileError, match=r"two\\nlines. is no run folder") as caught:
        records.read_run(tmp_path / "two\nlines")
    assert str(caught.value).isprintable()


def test_columns_that_are_not_ours_are_left_alone(tmp_path: Path) -> None:
    """A part with more columns, in another order, is read as the schema says, whole or by columns."""
    more = pa.table({"size": [1.0, 2.0], "notes": [{"mine": 1}, None], "name": ["a", "b"]})
    pq.write_table(more, tmp_path / "a.parquet")
    assert records.read_part(tmp_path / "a.parquet", SCHEMA).schema == SCHEMA
    assert records.read_part(tmp_path / "a.parquet", SCHEMA, ["size"]).column_names == ["size"]


@pytest.mark.parametrize(
    ("table", "words"),
    [
        (pa.table({"name": ["a"]}), "lacks the column 'size'"),
        (pa.table({"name": ["a"], "size": ["big"]}), "is no Parquet file of this kind"),
        (pa.table({"name": ["a"], "size": [[1.0]]}), "is no Parquet file of this kind"),
        (pa.table({"name": [{"x": 1}], "size": [1.0]}), "is no Parquet file of this kind"),
        (pa.table([["a"], [1.0], [2.0]], names=["name", "size", "size"]), "is no Parquet file of this kind"),
    ],
)
def test_other_tables_are_no_parts(table: pa.Table, words: str, tmp_path: Path) -> None:
    """A column that is missing, twice there, or of a type that is not ours is refused by the name of the file."""
    pq.write_table(table, tmp_path / "a.parquet")
    with pytest.raises(InputFileError, match=words) as caught:
        records.read_part(tmp_path / "a.parquet", SCHEMA)
    assert str(caught.value).startswith(str(tmp_path / "a.parquet")) and str(caught.value).isprintable()


def test_damaged_parts_are_refused(tmp_path: Path) -> None:
    """Cut off, garbled in the middle, or no Parquet at all."""
    pq.write_table(TABLE.cast(SCHEMA), tmp_path / "whole.parquet")
    whole = (tmp_path / "whole.parquet").read_bytes()
    for content in (whole[: len(whole) // 2], b"", b"hello", b"PAR1" + b"\xff" * 40 + whole[44:]):
        (tmp_path / "a.parquet").write_bytes(content)
        with pytest.raises(InputFileError, match="is no Parquet file"):
            records.read_part(tmp_path / "a.parquet", SCHEMA)
