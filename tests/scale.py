"""Runs of any size out of a small real one, and what questions to them cost; by hand, no part of the suite.

    python -m tests.scale make RUN OUT --records 10000000
    python -m tests.scale measure OUT [OTHER]

`make` repeats the records, problems and truths of RUN under new problem ids, errors and times moved a little by a hash of
id and seed, and with a seed other than 0 some verdicts and errors changed; `measure` writes the report of OUT, compares it
with OTHER (made with another --seed), groups and sorts by `sandbox query`, each in a process of its own, and prints wall
time, time of the processors and peak resident memory.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import duckdb
import pyarrow as pa

from sandbox.records import KINDS, read_run, write_json, write_parquet

ROWS = 50_000
"""Records of a part."""

SPREAD = 0.05
"""Relative size of the noise on errors and times."""

CHANGED = 1e-4
"""Share of the records that with a seed other than 0 become false successes, and of those that lose three digits."""

LIMIT = 2 * 2**30
"""Bytes of resident memory that a question to ten million records may take."""

PATIENCE = 60
"""Seconds that it may take."""

QUERIES = {
    "verdicts by backend": "select backend, formulation, verdict, count(*) from records group by all order by all",
    "quantiles by backend": "select backend, median(error), quantile_cont(solve_time, 0.99) from records group by all",
    "worst hundred": "select problem, error, qdot from records where verdict = 'verified' order by error desc limit 100",
    "records per problem": "select max(n) from (select problem, count(*) as n from records group by 1)",
}


def make(source: Path, out: Path, records: int, *, seed: int = 0, rows: int = ROWS, closed: bool = False) -> int:
    """Write a run of about `records` records into `out`, and return how many: whole copies of `source`, the last one cut.

    With `closed` the records of closed forms alone.
    """
    about = read_run(source)
    chosen = "starts_with(backend, 'closed_form:')" if closed else "true"
    with duckdb.connect(config={"memory_limit": "2GB"}) as database:
        one = database.execute(f"select count(*) from '{source}/records/*.parquet' where {chosen}").fetchall()[0][0]
        assert one > 0
        copies = -(-records // one)
        for kind in ("problems", "truth"):
            for copy in range(copies):
                _parts(database, source, out, kind, _id(copy), "true", copy, rows)
        written = 0
        for copy in range(copies):
            noise = f"1.0 * hash(problem, backend, formulation, settings, '%s', {copy}, {seed}) / 18446744073709551615.0"
            times = ", ".join(
                f"{name} * exp({SPREAD} * (2 * {noise % name} - 1)) as {name}"
                for name in ("build_time", "solve_time", "runtime")
            )
            changed = CHANGED if seed else 0
            moved = f"""{times}, case when {noise % "verdict"} < {changed} then 'false_success' else verdict end as verdict,
                error * exp({SPREAD} * (2 * {noise % "error"} - 1)) * case when {noise % "lost"} < {changed} then 1e3 else 1 end
                as error"""
            left = records - written
            written += _parts(database, source, out, "records", f"{_id(copy)}, {moved}", chosen, copy, rows, left)
    for kind in ("methods", "motions"):
        for part in sorted((source / kind).glob("*.parquet")):
            (out / kind).mkdir(parents=True, exist_ok=True)
            (out / kind / part.name).write_bytes(part.read_bytes())
    write_json(about | {"id": f"{about['id']}-x{copies}-{seed}"}, out / "run.json")
    return written


def _id(copy: int) -> str:
    """The problem's id in a copy; that of the first is its own."""
    return "problem" if copy == 0 else f"left(md5(problem || '{copy}'), 16) as problem"


def _parts(
    database: duckdb.DuckDBPyConnection, source: Path, out: Path, kind: str, replaced: str, chosen: str, copy: int, rows: int,
    most: int | None = None,
) -> int:  # fmt: skip
    limit = "" if most is None else f"limit {most}"
    replace = "" if replaced == "problem" else f"replace ({replaced.removeprefix('problem, ')})"
    found = database.sql(f"select * {replace} from '{source}/{kind}/*.parquet' where {chosen} {limit}")
    held: list[pa.RecordBatch] = []
    written = place = 0

    def flush() -> None:
        nonlocal place
        table = pa.Table.from_batches(held)
        plain = pa.table({name: table[name] for name in KINDS[kind].names})
        write_parquet(plain.cast(KINDS[kind]), out / kind / f"part-{copy:04}-{place:04}.parquet")
        held.clear()
        place += 1

    for batch in found.to_arrow_reader(rows):  # a batch ends where a part of the source does
        while batch.num_rows:
            taken = batch.slice(0, rows - sum(one.num_rows for one in held))
            held.append(taken)
            written, batch = written + taken.num_rows, batch.slice(taken.num_rows)
            if sum(one.num_rows for one in held) == rows:
                flush()
    if held:
        flush()
    return written


SANDBOX = ("-m", "sandbox.cli")


WATCH = """
import json, resource, subprocess, sys, time
start = time.perf_counter()
status = subprocess.run([sys.executable, *sys.argv[1:]], stdout=subprocess.DEVNULL).returncode
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(json.dumps([status, time.perf_counter() - start, used.ru_utime + used.ru_stime, used.ru_maxrss]))
"""
"""Watches from a small process: a child inherits the peak memory of the process that it was forked from."""


def measure(what: str, *words: str) -> dict[str, Any]:
    """Run Python with these words in a process of its own: seconds of wall and processors, peak resident memory [bytes]."""
    told = subprocess.run([sys.executable, "-c", WATCH, *words], stdout=subprocess.PIPE, check=True, text=True).stdout
    status, wall, processors, peak = json.loads(told)
    return {
        "what": what, "status": status, "wall": round(wall, 2), "processors": round(processors, 2),
        "peak_rss": peak * (1 if sys.platform == "darwin" else 1024),
    }  # fmt: skip


def main() -> None:
    """Make or measure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    of = parser.add_subparsers(dest="do", required=True)
    making = of.add_parser("make")
    making.add_argument("source", type=Path)
    making.add_argument("out", type=Path)
    making.add_argument("--records", type=int, default=10_000_000)
    making.add_argument("--seed", type=int, default=0)
    making.add_argument("--rows", type=int, default=ROWS)
    making.add_argument("--closed", action="store_true")
    measuring = of.add_parser("measure")
    measuring.add_argument("run")
    measuring.add_argument("other", nargs="?")
    given = parser.parse_args()
    if given.do == "make":
        print(make(given.source, given.out, given.records, seed=given.seed, rows=given.rows, closed=given.closed), "records")
        return
    with tempfile.TemporaryDirectory() as pages:
        asked = [("report", *SANDBOX, "report", given.run, "--page", f"{pages}/report.html")]
        if given.other:
            asked.append(("compare", *SANDBOX, "compare", given.run, given.other, "--page", f"{pages}/comparison.html"))
        asked += [(f"query, {words}", *SANDBOX, "query", query, given.run) for words, query in QUERIES.items()]
        for one in asked:
            row = measure(*one)
            print(json.dumps(row | {"within": row["peak_rss"] <= LIMIT and row["wall"] <= PATIENCE}), flush=True)


if __name__ == "__main__":
    main()
