"""The report as a file: what it counts, how large it is, what it survives."""

from __future__ import annotations

import html
import json
import re
import subprocess
import sys
import time
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from reports import verification, words
from reports.page import CONTENT_SECURITY_POLICY
from reports.run_data import RunData
from reports.verification import write_report
from sandbox import verdict
from sandbox.errors import InputFileError
from tests.reports.conftest import Report
from tests.reports.synthetic_run import NASTY, write_run

SECTIONS = (
    "findings", "run", "not-run", "matrix", "promise", "curves", "breakdown", "warm", "closed-forms", "methods", "which",
    "failures", "settings", "cases", "limits",
)  # fmt: skip


def test_a_large_run_fits_in_three_megabytes_and_twenty_seconds(tmp_path: Path) -> None:
    """More than 100,000 records become a page under 3 MB in under 20 s."""
    assert write_run(tmp_path / "run") > 100_000
    start = time.perf_counter()
    page = write_report(tmp_path / "run", tmp_path / "page.html")
    assert time.perf_counter() - start < 20
    assert page.stat().st_size < 3_000_000


def test_fewer_cases_are_embedded_where_the_page_would_grow_too_large(
    report: Report, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The page keeps its size and says how many cases it left out."""
    size = report.page.stat().st_size
    monkeypatch.setattr(verification, "LARGEST", size - 200_000)
    page = write_report(report.run, tmp_path / "page.html")
    assert page.stat().st_size <= size - 200_000
    said = re.search(r"([\d,]+) of ([\d,]+) records are in this page", page.read_text(encoding="utf-8"))
    assert said is not None
    chosen, records = (int(number.replace(",", "")) for number in said.groups())
    assert 100 < chosen < 5000 and records == report.records


def test_sections_stand_in_their_order(report: Report) -> None:
    """All sections, in the order in which the contents list them."""
    text = report.page.read_text(encoding="utf-8")
    places = [text.index(f'id="{name}"') for name in SECTIONS]
    assert places == sorted(places)
    assert re.findall(r'<li><a href="#([\w-]+)">', text)[: len(SECTIONS)] == list(SECTIONS)


class _Elements(HTMLParser):
    """Names of all elements and attributes of a page."""

    def __init__(self) -> None:
        super().__init__()
        self.tags: set[str] = set()
        self.attributes: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note one element."""
        self.tags.add(tag)
        self.attributes |= {name for name, _ in attrs}


def test_the_page_forbids_itself_every_request(report: Report) -> None:
    """The policy stands before any content, and nothing in the page names an outside resource."""
    text = report.page.read_text(encoding="utf-8")
    policy = re.search(r'Content-Security-Policy" content="([^"]+)"', text)
    assert policy is not None and html.unescape(policy[1]) == CONTENT_SECURITY_POLICY
    elements = _Elements()
    elements.feed(text)
    assert not {"link", "img", "iframe", "object", "embed"} & elements.tags
    assert "script" in elements.tags and not {"src", "srcset", "action"} & elements.attributes


def test_text_from_records_is_never_markup(report: Report) -> None:
    """Script tags in what a solver said, in labels and in quotes arrive as text."""
    text = report.page.read_text(encoding="utf-8")
    assert "<script>window.hacked" not in text and "<img src=x" not in text and "<i>as is</i>" not in text
    assert html.escape(NASTY[:30]).replace("&quot;", "&#34;") in text


def test_the_matrix_counts_every_judged_record_once(report: Report) -> None:
    """Counts of all cells and what stands apart add up to the records at the judged level."""
    text = report.page.read_text(encoding="utf-8")
    matrix = text[text.index('id="matrix"') : text.index('id="promise"')]
    cells = re.findall(r'data-v="\w+">([\d,]+)&nbsp;', matrix) + re.findall(r'data-p="\w+">([\d,]+)&nbsp;', matrix)
    data = RunData(report.run)
    judged = data.one("select count(*) from records where judged")
    data.close()
    assert sum(int(number.replace(",", "")) for number in cells) == judged > 0


def test_the_same_run_gives_the_same_page(report: Report, tmp_path: Path) -> None:
    """Nothing in a page depends on when or how often it is made."""
    assert write_report(report.run, tmp_path / "again.html").read_bytes() == report.page.read_bytes()


@pytest.mark.parametrize(
    "lacking",
    [
        {"backends": ("osqp",)},
        {"default": False},
        {"closed_forms": False},
        {"false_successes": False},
        {"complete": False},
        {"methods": False},
        {"backends": ()},
        {"backends": ("osqp",), "default": False, "closed_forms": False, "false_successes": False, "complete": False},
    ],
    ids=lambda lacking: "-".join(lacking),
)
def test_a_run_that_lacks_something_still_has_its_report(lacking: dict[str, Any], tmp_path: Path) -> None:
    """Few backends, no default level, no closed forms, no false success, interrupted: the page says so and stands."""
    write_run(tmp_path / "run", scale=0.05, **lacking)
    text = write_report(tmp_path / "run", tmp_path / "page.html").read_text(encoding="utf-8")
    assert ("The run was interrupted" in text) == (not lacking.get("complete", True))
    assert ("This run has no closed forms" in text) == (not lacking.get("closed_forms", True))
    assert ('href="#methods"' in text) == ('id="methods"' in text) == lacking.get("methods", True)
    if not lacking.get("false_successes", True):
        assert "none of " in text and "called a wrong answer solved" in text


def test_a_run_stopped_before_its_first_record_has_a_report(tmp_path: Path) -> None:
    """A bare run.json, as the first second of a run leaves it, gives a page without numbers."""
    write_run(tmp_path / "whole", scale=0.05, backends=("osqp",), complete=False)
    (tmp_path / "run").mkdir()
    about = json.loads((tmp_path / "whole" / "run.json").read_text())
    (tmp_path / "run" / "run.json").write_text(json.dumps(about | {"timing": {}, "not_run": []}))
    text = write_report(tmp_path / "run", tmp_path / "page.html").read_text(encoding="utf-8")
    assert "This run has no records yet" in text


def test_the_default_place_is_named_after_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a path the page goes to reports/out/<run id>.html below the current folder, whatever the id holds."""
    write_run(tmp_path / "run", scale=0.05, backends=("osqp",))
    about = json.loads((tmp_path / "run" / "run.json").read_text())
    (tmp_path / "run" / "run.json").write_text(json.dumps(about | {"id": "../../a b"}))
    monkeypatch.chdir(tmp_path)
    page = write_report(Path("run"))
    assert page.resolve() == tmp_path / "reports" / "out" / "_.._a_b.html" and page.is_file()


def test_a_folder_that_is_no_run_is_refused(tmp_path: Path) -> None:
    """No run.json, a record file that is no Parquet: an error that names it, and no page."""
    with pytest.raises(InputFileError, match=re.escape(f"{tmp_path} is no run folder")):
        write_report(tmp_path, tmp_path / "page.html")
    write_run(tmp_path / "run", scale=0.05, backends=("osqp",))
    part = tmp_path / "run" / "records" / "part-1.parquet"
    part.write_bytes(part.read_bytes()[:100])
    with pytest.raises(InputFileError, match=r"part-1\.parquet is no Parquet file"):
        write_report(tmp_path / "run", tmp_path / "page.html")
    assert not list(tmp_path.glob("*.html"))


def test_a_page_is_made_without_any_solver() -> None:
    """Importing the report imports no solver, no exact arithmetic and no compiler."""
    names = (
        "osqp",
        "proxsuite",
        "qpsolvers",
        "cvxpy",
        "casadi",
        "scipy",
        "flint",
        "numba",
        "sandbox.backends",
        "problems",
        "pinocchio",
    )
    code = f"import sys, reports.verification; print([name for name in {names} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_every_verdict_has_its_words_and_its_rule() -> None:
    """The page knows every verdict, and states the rules in the words of the code that applies them."""
    assert set(words.VERDICTS) == set(verdict.VERDICTS)
    assert set(words.EXPECTED) == set(verdict.EXPECTED)
    ruled = {name.strip() for names, _ in words.PRECEDENCE for name in names.split(",")}
    assert ruled == set(verdict.VERDICTS)
