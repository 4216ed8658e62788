"""The page of a comparison says what `sandbox.compare` found, in one file that needs no network, to every reader."""

from __future__ import annotations

import html
import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from reports.comparison import findings, write_comparison
from reports.page import CONTENT_SECURITY_POLICY
from sandbox.compare import compare
from sandbox.records import RECORDS, read_table
from tests.reports.synthetic_run import NASTY, write_run
from tests.reports.test_in_browser import violations
from tests.reports.test_verification import _Elements

Row = dict[str, Any]


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Two runs: verdicts, errors, times and versions differ, a backend is missing."""
    folder = tmp_path_factory.mktemp("comparison")
    names = ("osqp", "qpsolvers:piqp", "proxsuite:dense", "casadi:ipqp")
    for name in ("before", "after"):
        write_run(folder / name, scale=0.06, backends=names)
    rows = [row for row in read_table(folder / "after", "records").to_pylist() if row["backend"] != "casadi:ipqp"]
    for i, row in enumerate(rows):
        if row["backend"] == "osqp":
            row["solve_time"] *= 2
            row["engine_version"] = "1.0"
        if i % 23 == 0 and row["error"] is not None:
            row["error"] *= 1e3
        if i % 29 == 0:
            row |= {"verdict": ("false_success", "crashed", "timed_out", "verified")[i % 4], "said": NASTY}
    for part in (folder / "after" / "records").iterdir():
        part.unlink()
    pq.write_table(pa.Table.from_pylist(rows, schema=RECORDS), folder / "after" / "records" / "part-0.parquet")
    return folder / "before", folder / "after"


@pytest.fixture(scope="module")
def found(runs: tuple[Path, Path]) -> Row:
    """What the comparison found."""
    return compare(*runs)


@pytest.fixture(scope="module")
def comparison(found: Row, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page."""
    return write_comparison(found, tmp_path_factory.mktemp("page") / "comparison.html")


def table(text: str, name: str) -> list[list[str]]:
    """Cells of the rows of the region called `name`, as text."""
    region = text[text.index(f'aria-label="{name}"') :]
    body = region[region.index("<tbody>") : region.index("</tbody>")]
    cells = [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row, re.S) for row in body.split("</tr>")[:-1]]
    return [[html.unescape(re.sub(r"<[^>]+>", "", cell)).strip() for cell in row] for row in cells]


def test_the_page_counts_what_the_comparison_found(found: Row, comparison: Path) -> None:
    """Flips by verdict, the list of them, losses, times, missing ones and versions: a row for each, in the same order."""
    text = comparison.read_text(encoding="utf-8")
    numbers = [int(n) for row in table(text, "Verdicts before and after") for n in re.findall(r"\d+", " ".join(row[1:]))]
    assert sum(numbers) == found["flips"] > 50
    listed = table(text, "Verdicts that differ, one by one")
    assert [(row[0], row[1].replace(" ", "_"), row[2].replace(" ", "_")) for row in listed] == [
        (row["problem"], row["before"], row["after"]) for row in found["flipped"]
    ]
    assert [row[0] for row in table(text, "Less accurate answers")] == [row["problem"] for row in found["lost"]]
    told = [row for row in found["time"] if row["says"] in ("slower", "faster")]
    assert [row[0] for row in table(text, "Times that differ")] == [row["backend"] for row in told] and told
    assert {row["backend"] for row in told} == {"osqp"}
    assert len(table(text, "On one side only")) == len(found["missing"]) > 0
    assert table(text, "Versions that differ") == [["osqp", "1.2.3, engine 0.9", "1.2.3, engine 1.0"]]


def test_findings_lead_with_what_fell(found: Row) -> None:
    """The first figure is the number that the exit status depends on; it is bad unless it is 0."""
    first, second = findings(found)[:2]
    assert first.figure == str(found["fallen"]) and first.kind == "bad" and "fell" in first.sentence
    assert second.figure == str(found["new_failures"])


def test_a_page_of_no_difference_says_so(runs: tuple[Path, Path], tmp_path: Path) -> None:
    """A run against itself: no flip, no loss, no time, nothing missing, in words."""
    same = compare(runs[0], runs[0])
    text = write_comparison(same, tmp_path / "same.html").read_text(encoding="utf-8")
    assert [finding.kind for finding in findings(same)] == ["good"] * 4
    said = ("has the same verdict in both", "No error moved", "None differs", "holds every answer", "No backend that ran")
    assert all(words in text for words in said)


def test_the_page_forbids_itself_every_request_and_shows_text_as_text(comparison: Path) -> None:
    """The policy stands before any content; what a solver said is never markup."""
    text = comparison.read_text(encoding="utf-8")
    policy = re.search(r'Content-Security-Policy" content="([^"]+)"', text)
    assert policy is not None and html.unescape(policy[1]) == CONTENT_SECURITY_POLICY
    assert "<script>window.hacked" not in text and html.escape(NASTY[:30]).replace("&quot;", "&#34;") in text
    elements = _Elements()
    elements.feed(text)
    assert not {"link", "img", "iframe", "object", "embed"} & elements.tags
    assert "script" in elements.tags and not {"src", "srcset", "action"} & elements.attributes


def test_the_command_writes_the_page(runs: tuple[Path, Path], tmp_path: Path) -> None:
    """--page beside the tables, and beside JSON, which stays alone on its stream; the exit status is that of what fell."""
    command = [sys.executable, "-m", "sandbox.cli", "compare", *map(str, runs), "--page"]
    done = subprocess.run([*command, str(tmp_path / "a.html")], capture_output=True, text=True, check=False)
    assert done.returncode == 1 and done.stdout.splitlines()[-1].startswith(f"page: {tmp_path / 'a.html'} (")
    told = subprocess.run([*command, str(tmp_path / "b.html"), "--json"], capture_output=True, text=True, check=False)
    assert json.loads(told.stdout)["fallen"] > 0 and told.stderr.startswith("page: ")
    assert (tmp_path / "a.html").read_bytes() == (tmp_path / "b.html").read_bytes()


@pytest.mark.browser
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_is_accessible_and_asks_for_nothing(browser: Any, comparison: Path, scheme: str) -> None:
    """axe-core finds nothing in either scheme; no request, no error; the theme button says what it does."""
    context = browser.new_context(viewport={"width": 1280, "height": 900}, color_scheme=scheme, bypass_csp=True)
    page, wrong = context.new_page(), []
    page.on("request", lambda r: r.url.startswith("file:") or wrong.append(r.url))
    page.on("console", lambda m: wrong.append(m.text))
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.goto(comparison.as_uri())
    page.wait_for_selector("html[data-ready]")
    page.evaluate("document.querySelectorAll('details').forEach((d) => { d.open = true })")
    assert violations(page) == []
    for name in ("light", "dark", "system"):
        page.locator("#theme").click()
        assert page.locator("#theme").inner_text() == f"Theme: {name}"
    assert page.evaluate("document.documentElement.scrollWidth") <= 1280
    context.close()
    assert not wrong


@pytest.mark.browser
def test_rows_are_found_by_their_words(browser: Any, found: Row, comparison: Path) -> None:
    """The search keeps the rows that hold every word, and says how many; emptied it shows all."""
    page = browser.new_page()
    page.goto(comparison.as_uri())
    page.wait_for_selector("html[data-ready]")
    search = page.locator("input[data-rows=flipped]")
    search.fill("osqp crashed")
    right = [row for row in found["flipped"] if row["backend"] == "osqp" and "crashed" in (row["before"], row["after"])]
    assert page.locator("#flipped tbody tr:visible").count() == len(right) > 0
    assert page.locator("output").first.inner_text() == f"{len(right)} of {len(found['flipped'])} rows"
    search.fill("")
    assert page.locator("#flipped tbody tr:visible").count() == len(found["flipped"])
    page.close()


def test_a_page_is_made_without_any_solver() -> None:
    """Importing the page imports no solver, no exact arithmetic, no compiler and no scipy."""
    names = ("osqp", "proxsuite", "qpsolvers", "cvxpy", "casadi", "scipy", "flint", "numba", "sandbox.backends", "problems")
    code = f"import sys, reports.comparison; print([name for name in {names} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
