"""A made-up run, its report, and a browser to look at it with."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from reports.verification import write_report
from tests.reports.synthetic_run import write_run

NAMES = ("chromium", "chromium-browser", "google-chrome")


class Report(NamedTuple):
    """A run folder, the number of its records, and the page made from it."""

    run: Path
    records: int
    page: Path


@pytest.fixture(scope="session")
def report(tmp_path_factory: pytest.TempPathFactory) -> Report:
    """A run of all backends on some hundred problems."""
    return _made(tmp_path_factory.mktemp("run"), scale=0.1)


@pytest.fixture(scope="session")
def short_report(tmp_path_factory: pytest.TempPathFactory) -> Report:
    """Every kind of content with few rows of each."""
    names = ("osqp", "proxsuite:dense", "qpsolvers:quadprog", "cvxpy:OSQP+assume_psd", "casadi:ipopt")
    return _made(tmp_path_factory.mktemp("short"), scale=0.06, backends=names)


def _made(folder: Path, **what: Any) -> Report:
    records = write_run(folder / "run", **what)
    return Report(folder / "run", records, write_report(folder / "run", folder / "report.html"))


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """Chromium; where there is none a failure with CI=true, else one counted skip."""
    path = next((found for found in map(shutil.which, NAMES) if found), None)
    if path is None:
        reason = f"no Chromium ({', '.join(NAMES)}): the browser tests did not run"
        if os.environ.get("CI") == "true":
            pytest.fail(reason)
        pytest.skip(reason)
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=path, args=["--no-sandbox", "--enable-unsafe-swiftshader"])
        yield chromium
        chromium.close()


@pytest.fixture
def visit(browser: Any, report: Report) -> Iterator[Any]:
    """Open a report (fragment, options of the browser's context); afterwards: no outside request, no console error."""
    contexts, wrong = [], []

    def open_page(fragment: str = "", page_of: Report = report, **options: Any) -> Any:
        context = browser.new_context(viewport={"width": 1280, "height": 900}, **options)
        contexts.append(context)
        page = context.new_page()
        page.on("request", lambda r: r.url.startswith(("file:", "blob:", "data:")) or wrong.append(f"request: {r.url}"))
        page.on("console", lambda m: m.type in ("error", "warning") and wrong.append(f"console: {m.text}"))
        page.on("pageerror", lambda error: wrong.append(f"error: {error}"))
        page.goto(page_of.page.as_uri() + fragment)
        if options.get("java_script_enabled", True):
            page.wait_for_selector("html[data-ready]")
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert not wrong
