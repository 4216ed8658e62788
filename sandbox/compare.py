"""Two runs side by side: what fell, what is less accurate, what is missing, and which times a rank test tells apart.

A record of one run is compared with that of the other for the same problem, backend, formulation, settings, mode and task.
Where a run holds several (a problem in two sets, repeats) the worst verdict, the largest error and the shortest time count.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import duckdb
from rich.table import Table
from rich.text import Text

from sandbox.check import line, named
from sandbox.errors import InputFileError
from sandbox.query import database, parts, scan
from sandbox.records import CLOSED_FORM, read_run
from sandbox.tolerances import UNIT

Row = dict[str, Any]

CONFIGURATION = ("backend", "formulation", "settings", "mode", "task")
"""What a problem was given to; with the problem the key by which records are joined."""

SEVERITY = (
    "not_run", "verified", "right_refusal", "undecidable", "out_of_scope", "limit", "inaccurate", "wrong_refusal", "timed_out",
    "crashed", "false_success",
)  # fmt: skip
"""Verdicts from the mildest to the worst."""

FAILED = ("wrong_refusal", "timed_out", "crashed", "false_success")
"""What was run, was none of these and now is one is a new failure; the other way round it is fixed."""

FALLEN = ("crashed", "false_success")
"""What was verified and is now one of these has fallen."""

WORSE = 10.0
"""Factor of the error beyond which a record is listed as less accurate; errors below a rounding count as one."""

LISTED = 500
"""Flips and losses of accuracy listed at most."""

SIGNIFICANT = 0.01
"""Level of the rank tests, all of one comparison together (Holm)."""

NOISE = 0.05
"""A ratio of medians nearer to 1 than this is called noise, however sure it is: machines drift by as much."""

FEWEST = 20
"""Times on each side below which no test is made."""

STEPS = 512
"""Times are told apart in steps of 2^(1/STEPS), 0.14 %; ties are corrected for."""


def compare(before: Path, after: Path, *, listed: int = LISTED) -> Row:
    """What changed from the run folder `before` to the run folder `after`, as plain rows (JSON can say them).

    Raises InputFileError where one is no run folder, or a part of it is not what it should be.
    """
    folders = {"before": Path(before), "after": Path(after)}
    about = {side: read_run(folder) for side, folder in folders.items()}
    files = {side: parts(folder, "records") for side, folder in folders.items()}
    with database(tables=True) as connection, _readable(folders):
        for side in folders:
            _do(connection, f"create view {side} as select * from {scan(files[side], 'records')}")
        _join(connection)
        found = {side: _run(connection, folders[side], about[side], side) for side in folders}
        joined = _rows(connection, "select count(*) as joined from pairs where v0 is not null and v1 is not null")[0]
        return {
            **found, **joined, **_flips(connection, listed), **_accuracy(connection, listed),
            "missing": _missing(connection), "versions": _versions(connection), "time": _times(connection),
        }  # fmt: skip


@contextmanager
def _readable(folders: dict[str, Path]) -> Iterator[None]:
    """Damage that a query meets (a page cut short, a verdict of another version) as the error that names the folders."""
    try:
        yield
    except duckdb.Error as error:
        names = " and ".join(named(folder) for folder in folders.values())
        raise InputFileError(f"{names} cannot be compared: {line(error)}") from error


def _do(connection: duckdb.DuckDBPyConnection, statement: str) -> None:
    connection.execute(statement).fetchall()


def _rows(connection: duckdb.DuckDBPyConnection, question: str, *given: Any) -> list[Row]:
    cursor = connection.execute(question, list(given) or None)
    names = [column[0] for column in cursor.description or ()]
    return [dict(zip(names, row, strict=True)) for row in cursor.fetchall()]


def _join(connection: duckdb.DuckDBPyConnection) -> None:
    """The table `pairs`: for each key verdict, error and time on both sides, null where a side has none.

    One aggregation over both runs: it needs no side to fit in memory, and no key to stand once.
    """
    names = ", ".join(CONFIGURATION)
    _do(connection, f"create type verdict as enum {SEVERITY}")
    _do(
        connection,
        f"""create table configurations as select (row_number() over (order by {names}))::int as c, * from (
        select distinct {names} from before union select distinct {names} from after)""",
    )
    same = " and ".join(f"r.{name} is not distinct from g.{name}" for name in CONFIGURATION)
    solved = "case when status = 'solved' then {} end"
    error = "case when isfinite(error) then error end"
    step = f"round(log2(greatest(coalesce(build_time, 0) + coalesce(solve_time, runtime), 1e-9)) * {STEPS})::smallint"
    both = " union all ".join(
        f"""select problem, c, {side == "after"} as later, verdict::verdict as v, {solved.format(error)} as e,
        case when not starts_with(r.backend, '{CLOSED_FORM}') then {solved.format(step)} end as t
        from {side} r join configurations g on {same}"""
        for side in ("before", "after")
    )
    _do(
        connection,
        f"""create table pairs as select problem, c,
        max(v) filter (not later) as v0, max(v) filter (later) as v1, max(e) filter (not later) as e0,
        max(e) filter (later) as e1, min(t) filter (not later) as t0, min(t) filter (later) as t1
        from ({both}) group by problem, c""",
    )


def _run(connection: duckdb.DuckDBPyConnection, folder: Path, about: Row, side: str) -> Row:
    """What is told of one run."""
    told = {
        name: about.get(name) for name in ("id", "command", "started", "complete", "sandbox_version", "cpu", "cores", "jobs")
    }
    counted = _rows(connection, f"select count(*) as records from {side}")[0]
    return {"folder": str(folder), **told, **counted}


# ---- verdicts and accuracy --------------------------------------------------------------------------------------------------

_FAILED = ", ".join(f"'{verdict}'" for verdict in FAILED)
_FELL = f"v0 = 'verified' and v1 in {FALLEN}"
_NEW = f"v0 not in ({_FAILED}, 'not_run') and v1 in ({_FAILED})"
_FIXED = f"v0 in ({_FAILED}) and v1 not in ({_FAILED}, 'not_run')"


def _flips(connection: duckdb.DuckDBPyConnection, listed: int) -> Row:
    """Verdicts that differ: how many of each kind, by verdict, by backend, and the first of them, new failures first."""
    counts = _rows(
        connection,
        f"""select count(*) as flips, count(*) filter ({_FELL}) as fallen, count(*) filter ({_NEW}) as new_failures,
        count(*) filter ({_FIXED}) as fixed from pairs where v0 <> v1""",
    )[0]
    kinds = f"({_FELL}) as fell, ({_NEW}) as failed, ({_FIXED}) as fixed"
    by_verdict = _rows(
        connection,
        f"""select v0::varchar as before, v1::varchar as after, {kinds}, count(*) as n from pairs where v0 <> v1
        group by v0, v1 order by fell desc, failed desc, fixed, v1 desc, n desc, v0""",
    )
    by_backend = _rows(
        connection,
        f"""select backend, count(*) filter (v1 is not null and v0 is not null) as joined, count(*) filter (v0 <> v1) as flips,
        count(*) filter (v0 <> v1 and {_FELL}) as fallen, count(*) filter (v0 <> v1 and {_NEW}) as new_failures,
        count(*) filter (v0 <> v1 and {_FIXED}) as fixed from pairs join configurations using (c) group by backend
        having count(*) filter (v0 <> v1) > 0 order by fallen desc, new_failures desc, flips desc, backend""",
    )
    order = f"{_FELL} desc, {_NEW} desc, {_FIXED}, v1 desc, v0, problem, c"
    chosen = f"""select problem, c, row_number() over (order by {order}) as place from pairs where v0 <> v1
        order by place limit {listed}"""
    return {**counts, "by_verdict": by_verdict, "by_backend": by_backend, "flipped": _told(connection, chosen)}


def _accuracy(connection: duckdb.DuckDBPyConnection, listed: int) -> Row:
    """log10(error after / error before) of what both sides call solved: median per backend, and the largest losses."""
    ratio = f"greatest(e1, {UNIT}) / greatest(e0, {UNIT})"
    per_backend = _rows(
        connection,
        f"""select backend, count(*) as n, median(log10({ratio})) as median_log10_ratio,
        count(*) filter ({ratio} > {WORSE}) as worse, count(*) filter ({ratio} < {1 / WORSE}) as better
        from pairs join configurations using (c) where e0 is not null and e1 is not null
        group by backend order by worse desc, median_log10_ratio desc, backend""",
    )
    chosen = f"""select problem, c, row_number() over (order by {ratio} desc, problem, c) as place from pairs
        where e0 is not null and e1 is not null and {ratio} > {WORSE} order by place limit {listed}"""
    return {"accuracy": per_backend, "worse": sum(row["worse"] for row in per_backend), "lost": _told(connection, chosen)}


def _told(connection: duckdb.DuckDBPyConnection, chosen: str) -> list[Row]:
    """The chosen pairs (problem, c, place) with what the records of both sides say of them."""
    _do(connection, f"create or replace temp table chosen as {chosen}")
    same = " and ".join(f"r.{name} is not distinct from g.{name}" for name in CONFIGURATION)
    first = ", ".join(f"any_value(r.{name} order by r.set, r.repeat) as {name}" for name in ("set", "said", "error"))
    for side, verdict, error in (("before", "v0", "e0"), ("after", "v1", "e1")):
        # of several records of a key the one that counted; the problem's own name lets the scan skip most
        _do(
            connection,
            f"""create or replace temp table told_{side} as
            select k.place, {first}
            from {side} r join configurations g on {same} join chosen k on r.problem = k.problem and g.c = k.c
              join pairs p on p.problem = k.problem and p.c = k.c
            where r.verdict = p.{verdict}::varchar and (p.{error} is null or r.error is null or r.error = p.{error})
              and r.problem in (select problem from chosen) group by k.place""",
        )
    return _rows(
        connection,
        f"""select k.problem, coalesce(a.set, b.set) as set, {", ".join(f"g.{name}" for name in CONFIGURATION)},
        p.v0::varchar as before, p.v1::varchar as after, coalesce(p.e0, b.error) as error_before,
        coalesce(p.e1, a.error) as error_after, b.said as said_before, a.said as said_after
        from chosen k join pairs p using (problem, c) join configurations g using (c) left join told_before b using (place)
          left join told_after a using (place) order by k.place""",
    )


def _missing(connection: duckdb.DuckDBPyConnection) -> list[Row]:
    """Configurations of which one side has problems that the other lacks, with how many."""
    return _rows(
        connection,
        f"""select {", ".join(CONFIGURATION)}, count(*) filter (v1 is null) as only_before,
        count(*) filter (v0 is null) as only_after, count(*) filter (v0 is not null and v1 is not null) as both
        from pairs join configurations using (c) where true group by all having only_before + only_after > 0
        order by only_before + only_after desc, {", ".join(CONFIGURATION)}""",
    )


def _versions(connection: duckdb.DuckDBPyConnection) -> list[Row]:
    """Backends with their versions on each side, and whether they differ; closed forms carry none."""
    found = _rows(
        connection,
        """select coalesce(b.backend, a.backend) as backend, b.versions as before, a.versions as after from
        (select backend, list(distinct v order by v) as versions from (select backend,
          concat_ws(', engine ', library_version, engine_version) as v from before) where v <> '' group by 1) b
        full join (select backend, list(distinct v order by v) as versions from (select backend,
          concat_ws(', engine ', library_version, engine_version) as v from after) where v <> '' group by 1) a
        on a.backend = b.backend order by 1""",
    )
    return [{**row, "differ": None not in (row["before"], row["after"]) and row["before"] != row["after"]} for row in found]


# ---- time -------------------------------------------------------------------------------------------------------------------


def _times(connection: duckdb.DuckDBPyConnection) -> list[Row]:
    """Time to build and solve what both sides solved, per configuration: medians, their ratio, and what the rank test says."""
    names = ", ".join(name for name in CONFIGURATION if name != "task")
    rows = _rows(
        connection,
        f"""with counted as (
          select {names}, t, sum(n0) as a, sum(n1) as b from (
            select c, t0 as t, count(*) as n0, 0 as n1 from pairs where t0 is not null and t1 is not null group by all
            union all
            select c, t1, 0, count(*) from pairs where t0 is not null and t1 is not null group by all)
          join configurations using (c) group by all),
        ranked as (
          select *, sum(a) over (partition by {names} order by t) - a as a_below,
            sum(a) over (partition by {names} order by t) as a_to, sum(b) over (partition by {names} order by t) as b_to,
            sum(a) over (partition by {names}) as n_a, sum(b) over (partition by {names}) as n_b from counted)
        select {names}, any_value(n_a)::bigint as n_before, any_value(n_b)::bigint as n_after,
          sum(b * (a_below + a / 2.0))::double as u, sum((a + b)::double ** 3 - (a + b)) as ties,
          2.0 ** (min(t) filter (2 * a_to >= n_a) / {STEPS}.0) as median_before,
          2.0 ** (min(t) filter (2 * b_to >= n_b) / {STEPS}.0) as median_after
        from ranked group by all order by {names}""",
    )
    for row in rows:
        u, ties = row.pop("u"), row.pop("ties")
        enough = min(row["n_before"], row["n_after"]) >= FEWEST
        row["ratio"] = row["median_after"] / row["median_before"]
        row["p"] = rank_test(u, row["n_before"], row["n_after"], ties) if enough else None
    tested = [row for row in rows if row["p"] is not None]
    for row, adjusted in zip(tested, holm([row["p"] for row in tested]), strict=True):
        row["p_adjusted"] = adjusted
    for row in rows:
        row.setdefault("p_adjusted", None)
        row["says"] = _says(row["p_adjusted"], row["ratio"])
    order = ("slower", "faster", "noise", "too few")
    return sorted(rows, key=lambda row: (order.index(row["says"]), -abs(math.log(row["ratio"]))))


def _says(p: float | None, ratio: float) -> str:
    """What a test and a ratio of medians amount to."""
    if p is None:
        return "too few"
    if p >= SIGNIFICANT or abs(ratio - 1) <= NOISE:
        return "noise"
    return "slower" if ratio > 1 else "faster"


def rank_test(u: float, n_before: int, n_after: int, ties: float) -> float:
    """Two-sided p-value of the Mann-Whitney U test, normal approximation with corrections for ties and continuity.

    `u` counts the pairs in which the later time is longer, equal ones half; `ties` is the sum of t^3 - t over groups of t
    equal times. 1 where all times are equal. Mann, Whitney (1947), Ann. Math. Stat. 18.
    """
    n = n_before + n_after
    variance = n_before * n_after / 12 * (n + 1 - ties / (n * (n - 1)))
    if variance <= 0:
        return 1.0
    z = max(0.0, abs(u - n_before * n_after / 2) - 0.5) / math.sqrt(variance)
    return math.erfc(z / math.sqrt(2))


def holm(p: list[float]) -> list[float]:
    """The p-values adjusted for their number, so that comparing each with a level keeps it for all (Holm 1979)."""
    out, largest = [0.0] * len(p), 0.0
    for place, i in enumerate(sorted(range(len(p)), key=p.__getitem__)):
        largest = max(largest, min(1.0, (len(p) - place) * p[i]))
        out[i] = largest
    return out


# ---- for the terminal -------------------------------------------------------------------------------------------------------

SHOWN = 20
"""Rows of each table in the terminal."""


def tables(found: Row) -> list[Table | Text]:
    """What `sandbox compare` prints, in its order: tables and lines."""
    before, after = found["before"], found["after"]
    out: list[Table | Text] = [
        Text(
            f"{side:<6} {run['folder']}: {run['id']}, sandbox {run['sandbox_version']}, {run['records']:,} records, "
            f"{run['cpu']}"
        )
        for side, run in (("before", before), ("after", after))
    ]
    out.append(
        Text(
            f"{found['joined']:,} records on both sides; verdicts that differ: {found['flips']:,}, of them {found['fallen']:,} "
            f"fell from verified to false success or crash, {found['new_failures']:,} are new failures, "
            f"{found['fixed']:,} are fixed"
        )
    )
    key = ("problem", *CONFIGURATION)
    out += _table("verdicts that differ", found["by_verdict"], ("before", "after", "n"))
    out += _table("the first of them", found["flipped"], (*key, "before", "after", "error_after", "said_after"))
    moved = [row for row in found["accuracy"] if row["worse"] or row["better"] or abs(row["median_log10_ratio"]) >= MOVED]
    out += _table(
        f"accuracy, log10(error after / before); worse, better: by more than {WORSE:g} times", moved,
        ("backend", "n", "median_log10_ratio", "worse", "better"),
    )  # fmt: skip
    out += _table("least accurate against before", found["lost"], (*key, "error_before", "error_after"))
    out += _table("on one side only", found["missing"], (*CONFIGURATION, "only_before", "only_after", "both"))
    out += _table("versions that differ", [row for row in found["versions"] if row["differ"]], ("backend", "before", "after"))
    told = [row for row in found["time"] if row["says"] in ("slower", "faster")]
    out += _table(
        "time to build and solve: medians, told apart by a rank test", told,
        ("backend", "formulation", "settings", "mode", "n_after", "median_before", "median_after", "ratio", "p_adjusted",
         "says"),
    )  # fmt: skip
    rest = {says: sum(row["says"] == says for row in found["time"]) for says in ("noise", "too few")}
    out.append(
        Text(
            f"time: {len(told)} of {len(found['time'])} configurations differ; {rest['noise']} are noise (p >= {SIGNIFICANT:g} "
            f"after Holm's correction, or medians within {NOISE:.0%}), {rest['too few']} have too few times"
        )
    )
    return out


MOVED = 0.05
"""A median log10 ratio that the terminal shows though nothing moved by a factor of ten."""


def _table(title: str, rows: Sequence[Row], columns: Sequence[str]) -> list[Table | Text]:
    """The first rows as a table; none where there is none."""
    if not rows:
        return []
    drawn = Table(title=title, title_justify="left")
    for name in columns:
        numeric = any(isinstance(row[name], (int, float)) for row in rows)
        drawn.add_column(name.replace("_", " "), justify="right" if numeric else "left", overflow="fold")
    for row in rows[:SHOWN]:
        drawn.add_row(*(Text(_cell(row[name])) for name in columns))
    more = len(rows) - SHOWN
    return [drawn, *([Text(f"and {more:,} more rows; --json and --page show them")] if more > 0 else [])]


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, float):
        return f"{value:.3g}"
    if isinstance(value, list):
        return "; ".join(map(str, value))
    return f"{value:,}" if isinstance(value, int) else line(value)
