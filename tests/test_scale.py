"""A run of 300,000 records is reported on, compared and queried within seconds, and memory does not grow with a run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from sandbox.compare import compare
from sandbox.query import answered
from tests import scale
from tests.reports.synthetic_run import write_run

RECORDS = 300_000
REPORT = "import sys; from pathlib import Path; from reports.verification import write_report as w; w(*map(Path, sys.argv[1:]))"


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The same run repeated often, and less often, and often with some records changed."""
    folder = tmp_path_factory.mktemp("scale")
    write_run(folder / "one", scale=0.2)
    out = {"many": (RECORDS, 0), "changed": (RECORDS, 1), "few": (RECORDS // 5, 0)}
    for name, (records, seed) in out.items():
        assert scale.make(folder / "one", folder / name, records, seed=seed, rows=20_000) == records
    return {name: folder / name for name in out}


def spent(what: str, *words: object) -> dict[str, Any]:
    """What a process took that ended well."""
    row = scale.measure(what, *map(str, words))
    assert row["status"] == 0
    return row


def test_parts_are_of_the_size_asked_for(runs: dict[str, Path]) -> None:
    """No part has more rows than asked; ids are as many as the copies make."""
    with answered(runs["many"], "select count(*), count(distinct problem), max(problem) from records") as answer:
        (row,) = answer.rows()
    with answered(runs["many"], "select count(*) from problems") as answer:
        assert row[0] == RECORDS and next(answer.rows())[0] >= row[1] > 1000
    assert len(list((runs["many"] / "records").iterdir())) >= RECORDS // 20_000


def test_a_report_takes_seconds_and_no_more_memory_for_five_times_the_records(runs: dict[str, Path], tmp_path: Path) -> None:
    """Under 60 s on a busy machine, under 700 MB, and within a quarter of what a fifth of the records takes."""
    few = spent("few", "-c", REPORT, runs["few"], tmp_path / "few.html")
    many = spent("many", "-c", REPORT, runs["many"], tmp_path / "many.html")
    assert many["wall"] < scale.PATIENCE and many["processors"] < 30
    assert many["peak_rss"] < 700e6 and many["peak_rss"] < 1.25 * few["peak_rss"] + 50e6
    assert f"of {RECORDS - warm(runs['many']):,} records are in this page" in (tmp_path / "many.html").read_text(
        encoding="utf-8"
    )


def warm(run: Path) -> int:
    """Records of solves started warm, which a report counts apart."""
    with answered(run, "select count(*) from records where mode = 'warm'") as answer:
        return int(next(answer.rows())[0])


def test_a_comparison_finds_the_few_that_changed(runs: dict[str, Path], tmp_path: Path) -> None:
    """Of 300,000 pairs the changed ones and no other, within seconds and 700 MB; times within 5 % are noise."""
    row = scale.measure("compare", *scale.SANDBOX, "compare", str(runs["many"]), str(runs["changed"]))
    assert row["status"] == 1 and row["wall"] < scale.PATIENCE and row["peak_rss"] < 700e6
    found = compare(runs["many"], runs["changed"])
    assert found["missing"] == [] and {r["after"] for r in found["flipped"]} == {"false_success"}
    assert (
        0 < found["fallen"] <= found["flips"] < 3 * scale.CHANGED * RECORDS and 0 < found["worse"] < 3 * scale.CHANGED * RECORDS
    )
    assert {r["says"] for r in found["time"]} == {"noise"}


def test_a_query_takes_seconds(runs: dict[str, Path]) -> None:
    """Group-by, quantiles, the worst hundred, records per problem: each within seconds and 500 MB."""
    for name, statement in scale.QUERIES.items():
        row = spent(name, *scale.SANDBOX, "query", statement, runs["many"])
        assert row["wall"] < scale.PATIENCE / 4 and row["peak_rss"] < 500e6
