"""The cases a page carries: which of a run's records, with their problems and truths, packed by column."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pyarrow as pa

from reports.aggregate import LISTED
from reports.run_data import DRAW, RunData

MOST = 5000
"""Cases embedded at most."""

EACH = 200
"""Failures of one backend embedded at most, beside the worst of its cells."""

JUDGED = "(judged)"
"""The filter on settings that passes what is compared by verdict: the judged level, and closed forms."""

COMPLETE = 2
"""Problems embedded with all their answers, each of another set."""

PLACES = 20
"""Of each count of the matrix so many are embedded where there is room."""

_EXACT = ("error", "tolerance")
_ROUNDED = (
    "error_bound", "posing_error", "primal_residual", "dual_residual", "objective_gap", "multiplier_error", "kappa",
    "build_time", "solve_time", "runtime", "time_limit",
)  # fmt: skip
_NAMES = (
    "set", "task", "expected", "formulation", "backend", "settings", "verdict", "status", "said", "blame", "mode",
    "library_version", "engine_version", "apart",
)  # fmt: skip
_FILTERED = ("set", "task", "expected", "backend", "formulation", "settings", "verdict", "apart")
_PLAIN = ("found", "reason_right", "residuals_met", "attainable", "iterations", "repeat")
_OF_PROBLEM = ("robot", "method", "seed", "step", "knob", "value", "case", "n", "m", "k")
_DECIDED = ("lambda_min_W", "lambda_min_reduced", "sigma_min_J")
_HELD = ("id", "problem", "judged", *_NAMES, *_PLAIN, *_EXACT, *_ROUNDED, *_DECIDED, "qdot", "y")
_ARRAYS = ("J", "xdot", "W_base", "W_E", "W_gamma", "a", "Wx")


def choose(run: RunData, most: int = MOST, each: int = EACH) -> int:
    """Fill the table `chosen` with at most `most` records and return how many there are.

    In this order: the worst of each count of the matrix, so that every count opens a case; all records of a few problems,
    so that answers stand side by side; failures, backends taking turns, up to `each` a backend; the worst of what stands
    apart in each cell; the second to twentieth of each count; a sample. Ties are broken by a seeded hash of the
    problem, the same for all backends, so that the cases share problems.
    """
    _order(run, most, each)
    held = ", ".join(f"r.{name}" for name in _HELD)
    run.do(
        f"""create or replace table candidates as select {held}, o.place from records r join (
          select id, row_number() over (order by tier, turn, draw, id) as place from ordered order by place limit {most}) o
        on r.id = o.id"""
    )
    for kind in ("problems", "truth"):
        run.do(
            f"create or replace table chosen_{kind} as select * from {kind} where problem in (select problem from candidates)"
        )
    return keep(run, most)


def keep(run: RunData, most: int) -> int:
    """Make the table `chosen` the first `most` of those that `choose` found, and return how many they are."""
    run.do(f"create or replace table chosen as select * from candidates where place <= {most}")
    return int(run.one("select count(*) from chosen"))


def _order(run: RunData, most: int, each: int) -> None:
    """Fill the table `ordered`: id of every record that may be chosen, its tier and its turn there.

    Of each cell its worst alone are looked at, as many as could be chosen: no question sorts all records.
    """
    worst = max(each, PLACES)
    run.do(
        f"""create or replace table worst as
        with cells as (
          select judged, task, expected, backend, formulation, coalesce(apart, verdict) as count,
            apart is null and verdict in {LISTED} as failed, apart is not null as apart,
            max([coalesce(error / nullif(tolerance, 0), -1), -{DRAW}, -id::double], {worst}) as found
          from records group by all)
        select * exclude (one), -one[2] as draw, (-one[3])::bigint as id, place from (
          select * exclude (found), unnest(found) as one, generate_subscripts(found, 1) as place from cells)"""
    )
    run.do(
        f"""create or replace table ordered as
        with complete as (
          select arg_min(problem, {DRAW}) as problem from records group by set order by min({DRAW}) limit {COMPLETE}),
        turns as (
          select *, row_number() over (partition by failed, backend order by place, draw, formulation, task, id) as turn
          from worst where judged),
        tiers as (
          select id, draw, case when place = 1 and not apart then 0 when failed and turn <= {each} then 2
            when place = 1 then 3 when place <= {PLACES} then 4 end as tier,
            case when place = 1 and not apart then 0 when failed and turn <= {each} then turn when place = 1 then 0
            else place end as turn from turns
          union all
          select id, {DRAW}, 1, 0 from records where problem in (from complete)
          union all
          select -one[2], -one[1], 5, 0 from (
            select unnest(max([-{DRAW}, -id::double], {most})) as one from records))
        select id, any_value(draw) as draw, min(tier) as tier, arg_min(turn, tier) as turn from tiers where tier is not null
        group by id"""
    )


def listed(run: RunData) -> dict[tuple[str, str], int]:
    """Backend and verdict -> how many of its failures are among the chosen."""
    rows = run.rows(
        f"""select backend, verdict, count(*) as n from chosen where judged and apart is null and verdict in {LISTED}
        group by all"""
    )
    return {(row["backend"], row["verdict"]): row["n"] for row in rows}


def totals(run: RunData) -> dict[str, Any]:
    """How many records the run holds for every combination of the columns a page filters by, by column."""
    table = run.table(f"select {', '.join(_FILTERED)}, sum(n)::int as n from tally group by all order by all")
    return {name: _coded(table[name]) for name in _FILTERED} | {"n": table["n"].to_pylist()}


def pack(run: RunData) -> dict[str, Any]:
    """The chosen records by column, the problems they need once each, and the truths.

    Doubles keep all their digits where the page shows seventeen (answers, truth, error, tolerance, the matrices); other
    columns are rounded to six. Names are codes into a list. A symmetric matrix is its upper triangle.
    """
    rounded = ", ".join(f"cast(printf('%.6g', {name}) as double) as {name}" for name in _ROUNDED)
    table = run.table(
        f"""select problem, {", ".join((*_NAMES, *_PLAIN, *_EXACT, "qdot", "y"))}, {rounded} from chosen
        order by problem, task, backend, formulation, settings, mode, repeat"""
    )
    cases: dict[str, Any] = {name: _coded(table[name]) for name in ("problem", *_NAMES)}
    for name in (*_PLAIN, *_EXACT, *_ROUNDED, "qdot", "y"):
        cases[name] = table[name].to_pylist()
    identities = cases["problem"]["names"]
    return {
        "count": table.num_rows,
        "cases": cases,
        "problems": _problems(run, identities),
        "truths": _truths(run, identities),
    }


def _coded(column: Any) -> dict[str, Any]:
    coded = column.combine_chunks().cast(pa.string()).dictionary_encode()
    return {"names": coded.dictionary.to_pylist(), "codes": coded.indices.to_pylist()}


def _problems(run: RunData, identities: list[str]) -> dict[str, Any]:
    """Columns of the problems named, one entry per name, null where the run folder lacks it."""
    rows = run.rows(
        f"""select p.problem, {", ".join(f'p."{name}"' for name in (*_OF_PROBLEM, *_ARRAYS))}, r.* exclude (problem)
        from (select distinct on (problem) * from chosen_problems order by problem, set) p join (
          select problem, {", ".join(f"min(cast(printf('%.6g', {name}) as double)) as {name}" for name in _DECIDED)}
          from chosen group by 1) r on p.problem = r.problem"""
    )
    for row in rows:  # a page carries some hundreds of problems, never one per record
        for name, size in (("W_base", "n"), ("W_gamma", "k"), ("Wx", "m")):
            row[name] = _triangle(row[name], row[size])
    return _columns(rows, identities)


def _triangle(values: list[float] | None, size: int | None) -> list[float] | None:
    """The upper triangle of a symmetric matrix, row by row; the whole where it is not symmetric."""
    if not values or not size or len(values) != size * size:
        return values
    matrix = np.reshape(values, (size, size))
    return matrix[np.triu_indices(size)].tolist() if (matrix == matrix.T).all() else values


def _truths(run: RunData, identities: list[str]) -> dict[str, Any]:
    """Task -> columns of the truth, one entry per problem name."""
    rows = run.rows(
        """select distinct on (problem, task) problem, task, expected, reason, margin, rank, inertia, x, y, freedom, value
        from chosen_truth where (problem, task) in (select (problem, task) from chosen)
        order by problem, task"""
    )
    tasks = sorted({row["task"] for row in rows})
    return {task: _columns([{**r} for r in rows if r["task"] == task], identities) for task in tasks}


def _columns(rows: list[dict[str, Any]], identities: list[str]) -> dict[str, Any]:
    known = {row.pop("problem"): row for row in rows}
    names = [name for name in (next(iter(known.values())) if known else {}) if name != "task"]
    return {name: [known[key][name] if key in known else None for key in identities] for name in names}


def as_json(packed: dict[str, Any]) -> bytes:
    """The packed cases as JSON; doubles as their shortest digits that read back as the same double."""
    return json.dumps(packed, separators=(",", ":"), allow_nan=False, ensure_ascii=False).encode()
