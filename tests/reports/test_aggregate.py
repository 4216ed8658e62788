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
    """Records at high_accuracy and of closed forms, as Python sees them."""
    names = ["backend", "formulation", "settings", "task", "expected", "verdict", "blame", "attainable", "problem", "error"]
    return [row for row in read_table(report.run, "records", names).to_pylist() if row["settings"] in (None, "high_accuracy")]


def held_against(row: dict) -> bool:
    """Whether the backend answers for it: neither the formulation's blame nor beyond float64."""
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
    names = ["backend", "formulation", "settings", "expected", "verdict", "status", "error", "blame"]
    rows = [
        r for r in read_table(report.run, "records", names).to_pylist()
        if (r["backend"], r["formulation"], r["settings"]) == ("osqp", "direct", "high_accuracy")
        and r["blame"] != "formulation" and r["expected"] in ("unique_minimum", "minimum_not_unique")
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
    """No false success first; then the lower end of the share; then time."""
    for group in aggregate.recommendations(run):
        keys = [
            (row["false_success"] > 0, -int(100 * aggregate.lower_end(row["verified"], row["n"])), row["time"] or float("inf"))
            for row in group["rows"]
        ]
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


def test_every_failure_is_embedded_up_to_its_limit(run: RunData, report: Report) -> None:
    """All false successes, crashes, time-outs and wrong refusals are among the cases, up to the limit a backend and verdict."""
    number = cases.choose(run, each=25)
    assert number <= cases.MOST
    rows = run.rows(
        "select backend, verdict, count(*) as n, count(*) filter (id in (from chosen)) as held from records group by all"
    )
    failing = [row for row in rows if row["verdict"] in aggregate.LISTED]
    assert len(failing) > 20
    for row in failing:
        assert row["held"] >= min(25, row["n"])
    assert sum(row["held"] for row in rows) == number


def test_the_worst_of_each_cell_is_embedded(run: RunData) -> None:
    """Of each cell of the matrix the answer furthest beyond its tolerance is among the cases."""
    cases.choose(run)
    missed = run.rows(
        """with ranked as (select id, error / nullif(tolerance, 0) as excess, row_number() over (
            partition by backend, formulation, settings, task, expected
            order by error / nullif(tolerance, 0) desc nulls last, problem, repeat) as place
          from records where verdict <> 'not_run')
        select id from ranked where place = 1 and excess is not null and id not in (from chosen)"""
    )
    assert missed == []


def test_embedded_numbers_keep_every_bit(run: RunData, report: Report) -> None:
    """Answers, errors and tolerances read back from the page's JSON are the doubles of the records."""
    cases.choose(run, most=300)
    packed = json.loads(cases.as_json(cases.pack(run)))
    held = packed["cases"]
    identity = [held["problem"]["names"][code] for code in held["problem"]["codes"]]
    key = ("backend", "formulation", "settings", "task")
    recorded = {
        (row["problem"], *(row[name] for name in key)): row
        for row in read_table(report.run, "records", ["problem", *key, "qdot", "y", "error", "tolerance"]).to_pylist()
    }
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
