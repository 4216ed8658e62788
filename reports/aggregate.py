"""Tables computed from all records of a run: matrix, promise against measurement, curves, rankings, lists."""

from __future__ import annotations

from math import floor, inf, log2
from typing import Any

from reports.run_data import DRAW, RunData
from reports.words import EXPECTED, FORMULATIONS, TASKS, VERDICTS
from sandbox.records import CLOSED_FORM

Row = dict[str, Any]

SOLVABLE = "expected in ('unique_minimum', 'minimum_not_unique')"
COUNTED = "verdict not in ('undecidable', 'not_run')"
SPENT = "coalesce(build_time, 0) + coalesce(solve_time, runtime)"

_INDEFINITE = -1e-12  # the sign of an eigenvalue nearer to zero is rounding where W is of order one
_WELL_CONDITIONED = 1e6  # of kappa: ten of sixteen digits are left
_NEAR_SINGULAR = 1e-4  # of sigma_min(J): its square is lost in the eight digits left to normal equations
HOLDS = 0.9
"""A backend holds at a level where at least this share of the problems is verified: levels have a dozen problems or so,
so that one miss of another cause does not end the range."""
FEW = 5
"""Rows that rest on fewer problems are not ranked."""

CLASSES: tuple[tuple[str, str, str, str], ...] = (
    (
        "convex",
        "W > 0, well conditioned",
        f"J q̇ = ẋ, unique minimum, λmin(W) > 0, J of full row rank, κ ≤ {_WELL_CONDITIONED:.0e}",
        f"task = 'exact' and expected = 'unique_minimum' and lambda_min_W > 0 and rank = m and kappa <= {_WELL_CONDITIONED}",
    ),
    (
        "indefinite",
        "valid indefinite W",
        f"J q̇ = ẋ, unique minimum, λmin(W) < {_INDEFINITE:.0e}: W is indefinite and condition (7) holds",
        f"task = 'exact' and expected = 'unique_minimum' and lambda_min_W < {_INDEFINITE}",
    ),
    (
        "near_singular",
        "near-singular J",
        f"J q̇ = ẋ, unique minimum, 0 < σmin(J) ≤ {_NEAR_SINGULAR:.0e}",
        f"task = 'exact' and expected = 'unique_minimum' and rank = m and sigma_min_J <= {_NEAR_SINGULAR}",
    ),
    (
        "rank_deficient",
        "rank-deficient least squares",
        "least squares, J of exact rank r < m, a minimum exists",
        f"task = 'least_squares' and rank < m and {SOLVABLE}",
    ),
    ("damped", "damped", "damped least squares, a minimum exists", f"task = 'damped' and {SOLVABLE}"),
)
"""Classes of problems a user stands before: name, words, definition, SQL condition."""

MEASURED: tuple[tuple[str, str, str], ...] = (
    ("psd", "H psd", f"expected = 'unique_minimum' and lambda_min_W >= {_INDEFINITE} and rank = m"),
    ("indefinite", "H indefinite, valid", f"expected = 'unique_minimum' and lambda_min_W < {_INDEFINITE} and rank = m"),
    ("no_minimum", "no minimum", "expected = 'no_minimum'"),
    ("rank_deficient", "rows dependent", f"{SOLVABLE} and rank < m"),
    ("infeasible", "rows inconsistent", "expected = 'infeasible'"),
)
"""What promises speak about: name, words, SQL condition (posed directly, task exact)."""

REPAIRS = ("direct", "convexified", "null_space")
"""The formulations whose comparison shows what reposing repairs."""


def counts(run: RunData) -> Row:
    """How much there is: records, problems, verdicts."""
    totals = run.rows(f"select ({_number('tally')}) as records, (select count(distinct problem) from posed) as problems")[0]
    verdicts = run.rows(
        """select verdict, sum(n)::bigint as n, coalesce(sum(n) filter (apart is not null), 0)::bigint as apart from tally
        where judged group by verdict"""
    )
    order = list(VERDICTS)
    return totals | {
        "embedded": 0,
        "verdicts": sorted(verdicts, key=lambda row: order.index(row["verdict"]) if row["verdict"] in order else 99),
        "expected": run.rows(
            """select expected, count(distinct problem) as n from posed where expected is not null
            group by 1 order by n desc, expected"""
        ),
        "judged": run.one(_number("tally where judged")),
    }


def _number(of: str) -> str:
    """SQL of the number of records that rows of `tally` stand for."""
    return f"select coalesce(sum(n), 0)::bigint as n from {of}"


def backend_order(run: RunData) -> list[str]:
    """Backends as run.json lists them, then closed forms, then whatever else the records name."""
    names = [row["name"] for row in run.about.get("backends", [])]
    closed = [CLOSED_FORM + row["name"] for row in run.about.get("closed_forms", [])]
    seen = [row["backend"] for row in run.rows("select distinct backend from tally order by 1")]
    known = closed + names
    return [name for name in known if name in set(seen)] + [name for name in seen if name not in set(known)]


def ran(run: RunData) -> set[str]:
    """Backends that answered at least one problem."""
    return {row["backend"] for row in run.rows("select distinct backend from tally where verdict <> 'not_run'")}


def sampled(run: RunData) -> set[str]:
    """Backends that saw only a sample of the problems."""
    if run.about.get("sample_every") == 1:
        return set()
    return {row["name"] for row in run.about.get("backends", []) if row.get("sampled")}


def matrices(run: RunData) -> list[Row]:
    """Verdict counts by task, expected class, backend and formulation; what is `apart` is counted apart."""
    found = run.rows(
        """select task, expected, backend, formulation, verdict, apart, sum(n)::bigint as n
        from tally where judged and expected is not null group by all"""
    )
    cells: dict[tuple[str, str, str, str | None], Row] = {}
    for row in found:
        cell = cells.setdefault((row["task"], row["expected"], row["backend"], row["formulation"]), {"counts": {}, "apart": {}})
        if row["apart"]:
            cell["apart"][row["apart"]] = cell["apart"].get(row["apart"], 0) + row["n"]
        else:
            cell["counts"][row["verdict"]] = row["n"]
    order = backend_order(run)
    few = sampled(run)
    problems = {
        (row["task"], row["expected"]): row["n"]
        for row in run.rows("select task, expected, count(distinct problem) as n from posed group by all")
    }
    out = []
    for task in [name for name in TASKS if any(key[0] == name for key in cells)]:
        formulations = [f for f in FORMULATIONS if any(key[0] == task and key[3] == f for key in cells)]
        classes = []
        for expected in [name for name in EXPECTED if any(key[:2] == (task, name) for key in cells)]:
            rows = []
            for backend in order:
                own = [cells.get((task, expected, backend, f)) for f in formulations]
                closed = cells.get((task, expected, backend, None))
                if closed or any(own):
                    rows.append({"backend": backend, "closed": closed, "cells": own, "sampled": backend in few})
            classes.append({"name": expected, "problems": problems[task, expected], "rows": rows})
        out.append({"task": task, "formulations": formulations, "classes": classes})
    return out


def measured(run: RunData) -> dict[str, dict[str, dict[str, int]]]:
    """Backend -> kind of problem (MEASURED) -> verdict -> count, posed directly in task exact."""
    kinds = ", ".join(f"count(*) filter ({condition}) as {name}" for name, _, condition in MEASURED)
    rows = run.rows(
        f"""select backend, verdict, {kinds} from records where judged and apart is null and not closed
        and task = 'exact' and formulation = 'direct' group by all"""
    )
    out: dict[str, dict[str, dict[str, int]]] = {}
    for name, _, _ in MEASURED:
        for row in sorted(rows, key=lambda row: (-row[name], row["backend"], row["verdict"])):
            if row[name]:
                out.setdefault(row["backend"], {}).setdefault(name, {})[row["verdict"]] = row[name]
    return out


def distributions(run: RunData) -> list[Row]:
    """Cumulative counts of error (5 steps a decade) and of solve time where verified (10 steps a decade).

    One row per task, formulation, backend and settings level, of problems that have a minimum and can be decided;
    `total` is what the share refers to, so what was refused is never reached. Time only at the judged level.
    """
    where = f"{SOLVABLE} and {COUNTED}"
    keys = "task, formulation, backend, settings"
    binned = f"""
      with counted as (
        select {keys}, count(*) as total from records where {where} group by all),
      errors as (
        select {keys}, greatest(-85, least(15, ceil(5 * log10(greatest(error, 1e-30)) - 1e-9)))::int as bin, count(*) as n
        from records where {where} and status = 'solved' and error is not null group by all),
      times as (
        select {keys}, greatest(-70, least(20, ceil(10 * log10(greatest(solve_time, 1e-9)) - 1e-9)))::int as bin, count(*) as n
        from records where {where} and judged and verdict = 'verified' and solve_time is not null group by all),
      cumulative as (
        select 'error' as what, {keys}, bin, sum(n) over (partition by {keys} order by bin) as reached from errors
        union all
        select 'time', {keys}, bin, sum(n) over (partition by {keys} order by bin) from times)
      select c.*, list(k.bin order by k.bin) filter (k.what = 'error') as error_bins,
        list(k.reached::int order by k.bin) filter (k.what = 'error') as error_reached,
        list(k.bin order by k.bin) filter (k.what = 'time') as time_bins,
        list(k.reached::int order by k.bin) filter (k.what = 'time') as time_reached
      from counted c left join cumulative k on c.task = k.task and c.backend = k.backend
        and c.formulation is not distinct from k.formulation and c.settings is not distinct from k.settings
      group by c.task, c.formulation, c.backend, c.settings, c.total
      order by c.task, c.formulation nulls first, c.backend, c.settings"""
    return run.rows(binned)


def accuracy(run: RunData) -> list[Row]:
    """The numbers behind the direct curves: shares by accuracy, median and 90 % of error and time."""
    return run.rows(
        f"""select backend, settings, count(*) as total,
        avg((status = 'solved' and error <= 1e-9)::int) as nine, avg((status = 'solved' and error <= 1e-6)::int) as six,
        avg((status = 'solved' and error <= 1e-3)::int) as three,
        median(error) filter (status = 'solved') as error_median,
        quantile_cont(error, 0.9) filter (status = 'solved') as error_high,
        median(solve_time) as time_median, quantile_cont(solve_time, 0.9) as time_high
        from records where task = 'exact' and (formulation = 'direct' or closed) and {SOLVABLE} and {COUNTED}
        and (judged or settings = 'default') group by all order by settings nulls first, six desc, backend"""
    )


def breakdown(run: RunData, over: str) -> list[Row]:
    """Share verified and median error by decade, formulation and backend.

    over "lambda_min_W" takes the set `indefinite` (all valid indefinite problems where a run has no such set), over
    "sigma_min_J" the set `near_singular` (or every nonsingular J). Decades are rounded to the nearest. Every problem
    that a backend's tolerance can decide counts, whoever is to blame; where the margin is so small that a failure would
    be undecidable, successes are dropped like failures.
    """
    name = {"lambda_min_W": "indefinite", "sigma_min_J": "near_singular"}[over]
    value = {"lambda_min_W": "-lambda_min_W", "sigma_min_J": "sigma_min_J"}[over]
    present = run.one(_number("tally where set = ?"), [name])
    chosen = f"set = '{name}'" if present else "true"
    return run.rows(
        f"""with own as (
          select *, max(margin) filter (verdict = 'undecidable') over (partition by backend, formulation) as blurred
          from records where judged and task = 'exact' and expected = 'unique_minimum' and {chosen} and {value} > 0)
        select formulation, backend, round(log10({value}))::int as decade, count(*) as n,
        count(*) filter (verdict = 'verified') as verified, median(error) filter (status = 'solved') as error
        from own where {COUNTED} and coalesce(margin > blurred, true)
        group by all order by formulation nulls first, backend, decade"""
    )


def depths(rows: list[Row], formulation: str | None = "direct") -> dict[str, int | None]:
    """Backend -> the deepest decade of -lambda_min(W) up to which it holds at every decade; None where at none."""
    by_backend: dict[str, list[Row]] = {}
    for row in rows:
        if row["formulation"] == formulation:
            by_backend.setdefault(row["backend"], []).append(row)
    out: dict[str, int | None] = {}
    for backend, own in by_backend.items():
        out[backend] = None
        for row in sorted(own, key=lambda r: r["decade"]):
            if row["verified"] < HOLDS * row["n"]:
                break
            out[backend] = row["decade"]
    return out


def holds_on_convex(run: RunData) -> set[str]:
    """Backends that hold on well-conditioned problems with W > 0, posed directly."""
    condition = next(sql for name, _, _, sql in CLASSES if name == "convex")
    return {
        row["backend"]
        for row in run.rows(
            f"""select backend from records where judged and not closed and {COUNTED} and {condition}
            and formulation = 'direct' group by 1 having count(*) filter (verdict = 'verified') >= {HOLDS} * count(*)"""
        )
    }


def repairs(run: RunData) -> list[Row]:
    """Backend and formulation (REPAIRS): verified of all on valid indefinite problems."""
    condition = next(sql for name, _, _, sql in CLASSES if name == "indefinite")
    return run.rows(
        f"""select backend, formulation, count(*) as n, count(*) filter (verdict = 'verified') as verified
        from records where judged and not closed and {COUNTED} and {condition}
        and formulation in {REPAIRS} group by all order by backend, formulation"""
    )


def closed_forms(run: RunData) -> list[Row]:
    """Each closed form against the truth: verdicts by expected class, error, and error over its own bound."""
    rows = run.rows(
        f"""select backend, task, count(*) filter (error is not null and tolerance is not null and {COUNTED}) as scored,
        count(*) filter (error is not null and tolerance is null and {COUNTED}) as unbounded,
        count(*) filter (verdict = 'false_success') as false_success,
        count(*) filter (error <= tolerance and {COUNTED}) as within,
        median(error) filter ({COUNTED}) as error_median, max(error) filter ({COUNTED}) as error_max,
        median(error / nullif(tolerance, 0)) filter ({COUNTED}) as ratio_median,
        max(error / nullif(tolerance, 0)) filter ({COUNTED}) as ratio_max, median(tolerance) as bound_median
        from records where closed group by all"""
    )
    verdicts = run.rows(
        """select backend, expected, verdict, sum(n)::bigint as n from tally where closed group by all
        order by n desc, backend, expected, verdict"""
    )
    ratios = run.rows(
        f"""select backend, count(*) as n,
        greatest(-60, least(20, ceil(5 * log10(greatest(error / tolerance, 1e-30)))))::int as bin
        from records where closed and error is not null and tolerance > 0 and {COUNTED} group by all order by backend, bin"""
    )
    order = backend_order(run)
    for row in rows:
        row["expected"] = {name: {} for name in EXPECTED}
        for cell in verdicts:
            if cell["backend"] == row["backend"] and cell["expected"] in row["expected"]:
                row["expected"][cell["expected"]][cell["verdict"]] = cell["n"]
        row["ratios"] = [[cell["bin"], cell["n"]] for cell in ratios if cell["backend"] == row["backend"]]
    return sorted(rows, key=lambda row: order.index(row["backend"]))


PAIRED = 50_000
"""Problems over which closed forms are compared with each other at most: every pair of them takes a distance."""

_PAIRABLE = "posed where task = 'exact' and expected = 'unique_minimum'"


def pairs_sampled(run: RunData) -> bool:
    """Whether `closed_form_pairs` looks at a sample of the problems."""
    return bool(run.one(f"select count(distinct problem) from {_PAIRABLE}") > PAIRED)


def closed_form_pairs(run: RunData) -> tuple[list[str], dict[tuple[str, str], Row]]:
    """Largest and median |x_a - x_b|, max norm, over problems of task exact with a unique minimum that both solve.

    The denominator is that of `error`, read off the record of the problem with the largest error, where the quotient of
    |x - x*| and error is least rounded, and never below |x*|; problems without one (x* = 0, no error) are left out. Where
    there are more than PAIRED problems, of that many, drawn by a hash.
    """
    distance = "list_max([abs(p[1] - p[2]) for p in list_zip({}, {})])"
    run.do(
        f"""create or replace table paired as select problem from (select distinct problem from {_PAIRABLE})
        order by {DRAW}, problem limit {PAIRED}"""
    )
    rows = run.rows(
        f"""with sizes as (
          select r.problem, greatest(arg_max({distance.format("r.qdot", "t.x")} / r.error, r.error),
            max(list_max([abs(v) for v in t.x]))) as size
          from records r join truth t on r.problem = t.problem and r.task = t.task
          where r.task = 'exact' and r.expected = 'unique_minimum' and r.error > 0 and r.qdot is not null
          and r.problem in (from paired) group by 1),
        answers as (
          select problem, backend, qdot from records where closed and task = 'exact' and expected = 'unique_minimum'
          and status = 'solved' and qdot is not null and {COUNTED} and problem in (from paired)),
        differences as (
          select a.backend as a, b.backend as b,
            {distance.format("a.qdot", "b.qdot")} / s.size as d
          from answers a join answers b on a.problem = b.problem and a.backend < b.backend
          join sizes s on a.problem = s.problem where s.size > 0)
        select a, b, count(d) as n, median(d) as typical, max(d) as largest from differences group by all"""
    )
    pairs = {key: row for row in rows for key in ((row["a"], row["b"]), (row["b"], row["a"]))}
    return [name for name in backend_order(run) if any(name == key[0] for key in pairs)], pairs


def lower_end(successes: int, trials: int) -> float:
    """Lower end of the 95 % interval of a share (Wilson 1927)."""
    z2 = 1.96**2
    share, spread = successes / trials, z2 / (4 * trials)
    return (share + 2 * spread - (z2 / trials * (share * (1 - share) + spread)) ** 0.5) / (1 + z2 / trials)


def rank(row: Row) -> tuple[bool, int, float, float, float]:
    """What rows of `recommendations` are ranked by, smaller first."""
    return (
        row["false_success"] > 0,
        -int(100 * lower_end(row["verified"], row["n"])),
        row["refused"] / row["n"],
        floor(log2(max(row["ratio"], 1.0))) if row["ratio"] else inf,
        inf if row["error"] is None else row["error"],
    )


def recommendations(run: RunData) -> list[Row]:
    """Per class of problems every formulation x backend, ranked.

    Rank: no false success before any; then the share verified, as the lower end of its 95 % interval in whole per cent;
    then the smaller share refused or given up; then the median time to build and solve as a multiple of the fastest, in
    steps of two (less is a tie: timings are no better); then the smaller median error.
    """
    licences = {row["name"]: row.get("licence") for row in run.about.get("backends", [])}
    few = sampled(run)
    out = []
    for name, words, definition, condition in CLASSES:
        rows = run.rows(
            f"""select backend, formulation, closed, count(*) as n, count(*) filter (verdict = 'verified') as verified,
            count(*) filter (verdict = 'false_success') as false_success,
            count(*) filter (verdict in ('limit', 'wrong_refusal', 'out_of_scope')) as refused,
            median(error) filter (status = 'solved') as error, median({SPENT}) filter (status = 'solved') as time
            from records where judged and {COUNTED} and {condition} group by all having count(*) >= {FEW}"""
        )
        fastest = min((row["time"] for row in rows if row["time"] and row["verified"]), default=None)
        for row in rows:
            row["ratio"] = row["time"] / fastest if row["time"] and fastest else None
            row["licence"] = "Apache-2.0 (this project)" if row["closed"] else licences.get(row["backend"])
            row["sampled"] = row["backend"] in few
        rows.sort(key=lambda r: (*rank(r), r["backend"], r["formulation"] or ""))
        if rows:
            out.append(
                {"name": name, "words": words, "definition": definition, "rows": rows, "problems": max(r["n"] for r in rows)}
            )
    return out


LISTED = ("false_success", "crashed", "timed_out", "wrong_refusal")
"""Verdicts whose every record is listed."""


def failures(run: RunData) -> list[Row]:
    """Counts of LISTED by backend, the formulation's own shown apart, most first."""
    of = "coalesce(sum(n) filter ({}), 0)::bigint as {}"
    filters = ", ".join(of.format(f"verdict = '{v}' and apart is null", v) for v in LISTED)
    return run.rows(
        f"""select backend, {filters}, {of.format("apart is not null", "apart")}, sum(n)::bigint as total
        from tally where judged and verdict in {LISTED} group by all
        order by false_success desc, crashed + timed_out + wrong_refusal desc, backend"""
    )


def worst(run: RunData, limit: int = 50) -> list[Row]:
    """The worst failures held against backends, the backends taking turns: for the printed page."""
    return run.rows(
        f"""select problem, set, task, formulation, backend, settings, repeat, expected, verdict, error, said, lambda_min_W
        from records where judged and apart is null and verdict in {LISTED} order by
        row_number() over (partition by backend, verdict order by error desc nulls first, problem, formulation),
        case verdict when 'false_success' then 0 when 'crashed' then 1 when 'timed_out' then 2 else 3 end, backend
        limit {limit}"""
    )


def warm_starts(run: RunData) -> list[Row]:
    """Cold against warm per backend, over the solves that were done both ways at the judged level.

    Medians of iterations and of solve time each way, the time's as a ratio warm / cold; `changed`: (cold, warm) -> count of
    verdicts that differ.
    """
    pairs = """
      with pairs as (
        select c.backend, c.verdict as cold, w.verdict as warm, c.iterations as cold_iterations,
          w.iterations as warm_iterations, c.solve_time as cold_time, w.solve_time as warm_time
        from records c join warm w on c.problem = w.problem and c.set = w.set and c.backend = w.backend and c.task = w.task
          and c.settings = w.settings and c.formulation = w.formulation and c.repeat is not distinct from w.repeat
        where c.judged and c.verdict <> 'not_run' and w.verdict <> 'not_run')"""
    rows = run.rows(
        f"""{pairs} select backend, count(*) as n, median(cold_iterations) as cold_iterations,
        median(warm_iterations) as warm_iterations, median(cold_time) as cold_time, median(warm_time) as warm_time,
        median(warm_time) / nullif(median(cold_time), 0) as ratio,
        count(*) filter (cold = 'verified') as cold_verified, count(*) filter (warm = 'verified') as warm_verified
        from pairs group by 1"""
    )
    changes = run.rows(f"{pairs} select backend, cold, warm, count(*) as n from pairs where cold <> warm group by all")
    for row in rows:
        own = [change for change in changes if change["backend"] == row["backend"]]
        own.sort(key=lambda change: (-change["n"], change["cold"], change["warm"]))
        row["changed"] = {(change["cold"], change["warm"]): change["n"] for change in own}
    order = backend_order(run)
    return sorted(rows, key=lambda row: order.index(row["backend"]))


def not_run(run: RunData) -> list[Row]:
    """What run.json says did not run, and rows of records with that verdict that run.json does not name."""
    told = list(run.about.get("not_run", []))
    named = {(row.get("backend"), row.get("formulation"), row.get("settings"), row.get("set")) for row in told}
    rows = run.rows(
        """select backend, formulation, settings, set, said as why, count(*) as count from records
        where verdict = 'not_run' group by all order by 1, 2, 3, 4"""
    )
    return told + [r for r in rows if (r["backend"], r["formulation"], r["settings"], r["set"]) not in named]


def left_out(run: RunData) -> list[Row]:
    """`not_run` by reason and formulation: the settings, sets and backends it befell, and how many solves in all."""
    out: dict[tuple[str, str], Row] = {}
    for told in not_run(run):
        why, formulation = told.get("why") or "", told.get("formulation") or ""
        row = out.setdefault((why, formulation), {"why": why, "formulation": formulation, "count": 0})
        row["count"] += told["count"]
        for name in ("settings", "set", "backend"):
            row[name] = {**row.get(name, {}), told.get(name) or "all": None}  # a set that keeps its order
    return list(out.values())


def effective_settings(run: RunData) -> list[Row]:
    """Every combination of backend, versions and effective settings that the records hold, with the tolerances in force."""
    rows = run.rows(
        """select backend, settings, library_version, engine_version, effective_settings, count(*) as n from records
        where not closed group by all order by backend, settings desc, n desc"""
    )
    levels = {row["name"]: row.get("effective_settings") or {} for row in run.about.get("backends", [])}
    return [{**row, "eps": levels.get(row["backend"], {}).get(row["settings"], {}).get("eps")} for row in rows]
