"""Numbers of the report against numbers counted another way."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator

import pytest

from reports import aggregate, cases, page
from reports.findings import findings
from reports.run_data import RunData
from sandbox.records import read_table
from tests.reports.conftest import Report


@pytest.fixture(scope="module")
def run(report: Report) -> Iterator[RunData]:
    """The run folder opened."""
    data = RunData(report.run)
    yield data
    data.close()


def judged(report: Report) -> list[dict]:
    """Cold records at high_accuracy and of closed forms, as Python sees them."""
    return [row for row in cold(report) if row["settings"] in (None, "high_accuracy")]


def cold(report: Report) -> list[dict]:
    """Records of solves that began from nothing."""
    names = ["backend", "formulation", "settings", "task", "expected", "verdict", "blame", "attainable", "problem", "error"]
    rows = read_table(report.run, "records", [*names, "status", "mode", "qdot", "y", "tolerance"]).to_pylist()
    return [row for row in rows if row["mode"] == "cold"]


def held_against(row: dict) -> bool:
    """Whether the backend answers for it: neither the formulation's blame nor beyond float64.

    What it solved, and how it died, is always its own.
    """
    if row["verdict"] in ("verified", "crashed", "timed_out", "not_run"):
        return True
    declined = row["verdict"] in ("limit", "right_refusal", "wrong_refusal", "out_of_scope")
    return row["blame"] != "formulation" and not (declined and row["attainable"] is False)


def test_cells_count_what_the_records_hold(run: RunData, report: Report) -> None:
    """Each cell of the matrix is the count of its records, those apart left out."""
    expected = Counter(
        (r["task"], r["expected"], r["backend"], r["formulation"], r["verdict"]) for r in judged(report) if held_against(r)
    )
    found: Counter = Counter()
    for matrix in aggregate.matrices(run):
        for group in matrix["classes"]:
            for row in group["rows"]:
                cells = [(None, row["closed"]), *zip(matrix["formulations"], row["cells"], strict=True)]
                for formulation, cell in cells:
                    for verdict, n in (cell or {"counts": {}})["counts"].items():
                        found[matrix["task"], group["name"], row["backend"], formulation, verdict] += n
    assert found == expected


def test_a_distribution_reaches_the_share_that_was_answered(run: RunData, report: Report) -> None:
    """Curves never fall, never pass their total, and end at the number of answers with an error."""
    for row in aggregate.distributions(run):
        reached = row["error_reached"] or [0]
        assert reached == sorted(reached) and reached[-1] <= row["total"]
    one = next(
        r
        for r in aggregate.distributions(run)
        if (r["backend"], r["formulation"], r["settings"]) == ("osqp", "direct", "high_accuracy")
    )
    rows = [
        r for r in cold(report)
        if (r["backend"], r["formulation"], r["settings"]) == ("osqp", "direct", "high_accuracy")
        and r["expected"] in ("unique_minimum", "minimum_not_unique")
        and r["verdict"] not in ("undecidable", "not_run")
    ]  # fmt: skip
    assert one["total"] == len(rows)
    within = sum(r["status"] == "solved" and r["error"] is not None and r["error"] <= 1e-10 for r in rows)
    assert max(n for at, n in zip(one["error_bins"], one["error_reached"], strict=True) if at <= -50) == within > 0


def test_a_backend_holds_until_the_first_decade_that_falls_short() -> None:
    """A good decade beyond a bad one does not count."""
    rows = [
        {"formulation": "direct", "backend": name, "decade": decade, "n": 10, "verified": verified}
        for name, shares in {"all": (10, 10, 9), "part": (10, 3, 10), "none": (0, 10, 10)}.items()
        for decade, verified in zip((-9, -8, -7), shares, strict=True)
    ]
    assert aggregate.depths(rows) == {"all": -7, "part": -9, "none": None}


def test_findings_name_the_depth_of_each_backend(run: RunData) -> None:
    """The run is made so that scs stops at -1e2 and quadprog never solves indefinite W directly."""
    found = findings(run, aggregate.breakdown(run, "lambda_min_W"), aggregate.closed_forms(run))
    text = "\n".join(f"{f.figure} {f.sentence} {f.detail}" for f in found)
    never = next(f.sentence for f in found if "at the mildest decade" in f.sentence)
    part = next(f.sentence for f in found if "part of the way" in f.sentence)
    assert "qpsolvers:quadprog" in never and "qpsolvers:scs" not in never
    assert "qpsolvers:scs" in part and "qpsolvers:quadprog" not in part
    assert "hold on well-conditioned convex problems" in text and "closed forms lie within" in text


def test_the_headline_counts_false_successes(run: RunData, report: Report) -> None:
    """The first finding is the number of false successes held against backends."""
    rows = [
        r
        for r in judged(report)
        if r["verdict"] == "false_success" and held_against(r) and not r["backend"].startswith("closed_form:")
    ]
    first = findings(run, [], [])[0]
    assert first.figure == f"{len(rows):,}" and f"by {len({r['backend'] for r in rows})} of" in first.sentence


def test_the_ranking_follows_its_rule(run: RunData) -> None:
    """No false success first; then the lower end of the share; fewer refusals; time in steps of two; then accuracy."""
    for group in aggregate.recommendations(run):
        keys = [aggregate.rank(row) for row in group["rows"]]
        assert keys == sorted(keys) and len(keys) > 1
        assert min(row["ratio"] for row in group["rows"] if row["ratio"] and row["verified"]) == 1.0


def test_few_problems_prove_less_than_many() -> None:
    """Wilson's lower end: 10 of 10 is 72 %, 1000 of 1000 is 99.6 %, 0 is 0."""
    assert aggregate.lower_end(10, 10) == pytest.approx(0.7225, abs=1e-4)
    assert aggregate.lower_end(1000, 1000) == pytest.approx(0.99617, abs=1e-5)
    assert aggregate.lower_end(0, 10) == pytest.approx(0, abs=1e-15)


def test_closed_forms_agree_with_themselves(run: RunData) -> None:
    """Differences between two closed forms are symmetric and the median is at most the largest."""
    names, pairs = aggregate.closed_form_pairs(run)
    assert len(names) > 3
    for first in names:
        for second in names:
            if first != second:
                assert pairs[first, second] is pairs[second, first]
                assert 0 <= pairs[first, second]["typical"] <= pairs[first, second]["largest"]


def test_times_within_a_factor_of_two_are_a_tie() -> None:
    """Of equal shares the fewer refusals win, then the time's step of two, then the smaller error."""
    row = {"false_success": 0, "verified": 90, "n": 100, "refused": 3, "ratio": 1.9, "error": 1e-12}
    refusing, slower, coarser, slow = {"refused": 4}, {"ratio": 2.1}, {"error": 1e-9}, {"ratio": 1.0, "error": 1e-11}
    ranked = [row, row | slow, row | coarser, row | slower, row | refusing]
    keys = [aggregate.rank(one) for one in ranked]
    assert keys == sorted(keys) and len(set(keys)) == 5


def test_failures_are_embedded_in_equal_numbers(run: RunData) -> None:
    """Of each backend all failures are among the cases, or as many as the limit; with little room, about equally many."""
    assert cases.choose(run, each=25) <= cases.MOST
    failing = f"judged and apart is null and verdict in {aggregate.LISTED}"
    query = f"""select backend, count(*) as n, count(*) filter (id in (select id from chosen)) as held from records
        where {failing} group by all"""
    rows = run.rows(query)
    assert len(rows) > 10 and all(row["held"] >= min(25, row["n"]) for row in rows)
    listed = cases.listed(run)
    assert sum(listed.values()) == sum(row["held"] for row in rows)
    assert {backend for backend, _ in listed} == {row["backend"] for row in rows}


def test_every_count_of_the_matrix_has_its_worst_case(run: RunData) -> None:
    """Of each cell and verdict, and of what stands apart there, the answer furthest beyond its tolerance is embedded."""
    number = cases.choose(run)
    missed = run.rows(
        """with ranked as (select id, error / nullif(tolerance, 0) as excess,
            max(error / nullif(tolerance, 0)) over cell as most,
            count(*) filter (id in (select id from chosen)) over cell as held
          from records where judged
          window cell as (partition by task, expected, backend, formulation, coalesce(apart, verdict)))
        select id from ranked where held = 0 or (excess = most and id not in (select id from chosen))"""
    )
    assert missed == [] and number == cases.MOST < run.one("select count(*) from records")


def test_some_problems_have_all_their_answers(run: RunData) -> None:
    """A few problems, of different sets, stand with all their answers side by side."""
    cases.choose(run)
    whole = run.rows(
        """select problem, any_value(set) as set from records group by problem having bool_and(id in (select id from chosen))"""
    )
    assert len({row["set"] for row in whole}) >= cases.COMPLETE


def test_totals_count_every_record_once(run: RunData, report: Report) -> None:
    """What the page says a filter passes adds up to the records of the run."""
    totals = cases.totals(run)
    assert sum(totals["n"]) == report.records
    names, codes = totals["apart"]["names"], totals["apart"]["codes"]
    apart = sum(n for n, code in zip(totals["n"], codes, strict=True) if code is not None)
    assert set(names) == {"formulation", "float64"} and apart == run.one("select count(apart) from records") > 0


def test_what_was_left_out_is_grouped_by_reason(run: RunData, monkeypatch: pytest.MonkeyPatch) -> None:
    """Backends left out of the same sets for the same reason are one row; no solve is lost."""
    told = [
        {"backend": b, "formulation": "null_space", "settings": "high_accuracy", "set": s, "count": 5, "why": w}
        for b, s, w in (("osqp", "a", "no rows"), ("x", "a", "no rows"), ("osqp", "b", "no rows"), ("x", "b", "no rows"))
    ]
    monkeypatch.setattr(aggregate, "not_run", lambda _: [*told, told[0] | {"why": "other"}])
    first, second = aggregate.left_out(run)
    assert (list(first["backend"]), list(first["set"]), first["count"]) == (["osqp", "x"], ["a", "b"], 20)
    assert (second["why"], second["count"]) == ("other", 5)


def test_embedded_numbers_keep_every_bit(run: RunData, report: Report) -> None:
    """Answers, errors and tolerances read back from the page's JSON are the doubles of the records."""
    cases.choose(run, most=300)
    packed = json.loads(cases.as_json(cases.pack(run)))
    held = packed["cases"]
    identity = [held["problem"]["names"][code] for code in held["problem"]["codes"]]
    key = ("backend", "formulation", "settings", "task")
    recorded = {(row["problem"], *(row[name] for name in key)): row for row in cold(report)}
    assert packed["count"] == 300
    for i, problem in enumerate(identity):
        names = [held[name]["names"][held[name]["codes"][i]] if held[name]["codes"][i] is not None else None for name in key]
        row = recorded[problem, *names]
        assert all(held[name][i] == row[name] for name in ("qdot", "y", "error", "tolerance"))


@pytest.mark.parametrize(
    ("part", "whole", "text"),
    [(0, 10, "0 %"), (10, 10, "100 %"), (9999, 10000, "99.9 %"), (1, 10000, "0.1 %"), (1, 3, "33 %"), (1, 0, "–")],
)
def test_all_and_none_are_said_only_where_it_is_all_or_none(part: int, whole: int, text: str) -> None:
    """A share is rounded to neither 100 % nor 0 % while one case speaks against it."""
    assert page.percent(part, whole) == text


@pytest.mark.parametrize(
    ("value", "text"), [(0.0, "0"), (None, "–"), (float("nan"), "–"), (0.25, "0.25"), (12.34, "12"), (-3.14e-9, "−3.1e−9")]
)
def test_numbers_are_short(value: float | None, text: str) -> None:
    """Two digits where two digits speak, a dash where there is no number."""
    assert page.number(value) == text
