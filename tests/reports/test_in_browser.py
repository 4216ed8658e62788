"""The report as its reader meets it, in Chromium."""

from __future__ import annotations

import csv
import json
import re
import shlex
import subprocess
import sys
from decimal import Decimal
from pathlib import Path
from typing import Any

import duckdb
import pytest
from playwright.sync_api import expect

from reports.figure import write_drift_figure
from tests.reports.conftest import Report

pytestmark = pytest.mark.browser

AXE = (Path(__file__).parent / "assets" / "axe.min.js").read_text(encoding="utf-8")
CHARTS = ("error", "time", "lambda", "sigma", "ratio")


def shown(page: Any) -> int:
    """Number of cases that pass the filters, as the page says."""
    return int(re.match(r"Showing ([\d,]+) of", page.locator(".tools output").inner_text())[1].replace(",", ""))


def column(page: Any, place: int) -> list[str]:
    """The visible cells of one column of the case table."""
    return page.locator(f".scroller tbody tr:not(.spacer) > :nth-child({place})").all_inner_texts()


def violations(page: Any, within: str = "document") -> list[str]:
    """What axe-core finds against WCAG 2 and 2.1, A and AA."""
    page.evaluate(AXE)
    found = page.evaluate(f"() => axe.run({within}, {{runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa']}})")
    return [f"{v['id']}: {n['html'][:160]} {n['failureSummary']}" for v in found["violations"] for n in v["nodes"][:2]]


def test_a_count_of_the_matrix_leads_to_its_cases_and_on_to_one_case(visit: Any, report: Report) -> None:
    """From a cell of the matrix to the cases it counts, to one case with seventeen digits and the command that repeats it."""
    page = visit()
    page.get_by_role("button", name=re.compile("^no minimum")).first.click()
    row = page.locator("table.matrix:visible tr[data-b='proxsuite:dense']").first
    count = row.locator("td[data-f=direct] a[data-v=false_success]")
    number = int(count.inner_text().split()[0])
    count.click()
    assert shown(page) == number > 0
    assert set(column(page, 6)) == {"false success"} and set(column(page, 4)) == {"proxsuite:dense"}
    page.locator(".scroller tbody a").first.click()
    dialog = page.locator("dialog[open]")
    problem = dialog.locator("h2").inner_text().split()[-1]
    command = f"sandbox show {report.run} {problem} --backend proxsuite:dense --formulation direct --settings high_accuracy"
    assert f"{command}\n{command} --script" in dialog.inner_text()
    with duckdb.connect() as database:
        W = database.execute(
            f"select W_base from '{report.run}/problems/*.parquet' where problem = ?", [problem]
        ).fetchone()[0]  # fmt: skip
    cells = dialog.get_by_role("region", name="W", exact=True).locator("td").all_inner_texts()
    assert [float(cell) for cell in cells] == W
    assert all(len(Decimal(cell).as_tuple().digits) == 17 for cell in cells)


def test_every_count_opens_cases_and_says_how_many_there_are(visit: Any, report: Report) -> None:
    """Each count of the matrix opens at least one case, and the total beside it is the count itself."""
    page = visit()
    found = page.evaluate(
        """async () => {
          const wrong = [], counts = [...document.querySelectorAll('.matrix[data-t] a[data-v], .matrix[data-t] a[data-p]')];
          const output = document.querySelector('.tools output');
          for (const count of counts.filter((_, i) => i % 7 === 0)) {
            location.hash = count.hash;
            await new Promise((done) => addEventListener('hashchange', done, { once: true }));
            const said = output.textContent.replaceAll(',', '').match(/Showing (\\d+) of (\\d+)/);
            const number = count.textContent.replaceAll(',', '').match(/^\\d+/)[0];
            if (said[1] === '0' || said[2] !== number) wrong.push(`${count.hash} ${said[0]} ${number}`);
          }
          return [counts.length, wrong];
        }"""
    )
    assert found[0] > 500 and found[1] == []


@pytest.mark.parametrize(
    "fragment",
    [
        "#v=verified&b=osqp&f=direct&t=exact&s=high_accuracy&p=(none)",
        "#p=float64",
        "#v=verified&b=closed_form:eq6&s=(judged)",
    ],
)
def test_the_command_lists_all_that_passes_the_filter(visit: Any, fragment: str) -> None:
    """Where cases are not embedded the page prints the command that lists them, and the command lists so many."""
    page = visit(fragment)
    number = int(re.search(r" of ([\d,]+)", page.locator(".tools output").inner_text())[1].replace(",", ""))
    assert shown(page) < number
    command = page.locator("#elsewhere code").inner_text()
    assert command.startswith("sandbox query ")
    command = command.replace("sandbox", f"{shlex.quote(sys.executable)} -m sandbox.cli", 1) + " --json"
    told = subprocess.run(["sh", "-c", command.replace(f"--limit {number}", "")], capture_output=True, text=True, check=True)
    assert len(json.loads(told.stdout)) == number


def test_a_permalink_restores_filter_and_case(visit: Any) -> None:
    """The address of a case opened in another tab shows the same filter and the same case; Escape leaves the filter."""
    page = visit()
    page.locator("[data-filter=verdict]").select_option("crashed")
    page.locator("input[type=search]").fill("direct")
    left = shown(page)
    page.locator(".scroller tbody a").first.click()
    title = page.locator("dialog[open] h2").inner_text()
    again = visit(page.evaluate("location.hash"))
    assert again.locator("dialog[open] h2").inner_text() == title
    again.keyboard.press("Escape")
    assert again.locator("dialog[open]").count() == 0
    assert again.locator("[data-filter=verdict]").input_value() == "crashed"
    assert again.locator("input[type=search]").input_value() == "direct"
    assert shown(again) == left > 0 and "case=" not in again.url


def test_a_case_that_is_not_embedded_is_named_with_its_command(visit: Any) -> None:
    """A link to a case outside the page says how to show it."""
    page = visit("#case=0000000000000000~osqp~direct~high_accuracy~exact")
    assert "sandbox show" in page.locator("dialog[open]").inner_text()
    assert "0000000000000000 --backend osqp" in page.locator("dialog[open]").inner_text()


def test_filters_narrow_and_clear_restores(visit: Any) -> None:
    """Each filter leaves only cases that match it, and the text filter looks into what the solver said."""
    page = visit()
    every = shown(page)
    page.locator("[data-filter=formulation]").select_option("null_space")
    assert set(column(page, 5)) == {"null space"} and 0 < shown(page) < every
    page.locator("[data-filter=formulation]").select_option("(none)")
    assert all(cell.endswith("(closed form)") for cell in column(page, 4)) and shown(page) > 0
    page.locator("#clear").click()
    assert shown(page) == every
    page.locator("input[type=search]").fill("速度")
    assert 0 < shown(page) < every
    page.locator(".scroller tbody a").first.click()
    assert "<script>window.hacked = 1</script>" in page.locator("dialog[open] .quote").inner_text()
    assert page.evaluate("window.hacked") is None


def test_columns_sort_both_ways(visit: Any) -> None:
    """A header sorts down, then up, says so to assistive technology, and cases without a value come last."""
    page = visit("#v=inaccurate")
    header = page.locator("th[data-column=error]")
    for direction, sign in (("descending", -1), ("ascending", 1)):
        header.get_by_role("button").click()
        assert header.get_attribute("aria-sort") == direction
        values = [float(cell.replace("−", "-")) for cell in column(page, 7) if cell != "–"]
        assert len(values) > 5 and values == sorted(values, key=lambda x: sign * x)
    assert "sort=error" in page.url


def test_the_case_table_works_by_keyboard_and_draws_only_what_is_seen(visit: Any) -> None:
    """Arrow keys and End move through all rows, Enter opens; the document holds a few dozen of them."""
    page = visit()
    page.locator(".scroller tbody a").first.focus()
    page.keyboard.press("End")
    page.wait_for_function(f"document.activeElement.dataset.place === '{shown(page) - 1}'")
    page.keyboard.press("ArrowUp")
    assert page.evaluate("document.activeElement.dataset.place") == str(shown(page) - 2)
    assert len(column(page, 1)) < 60
    page.keyboard.press("Enter")
    page.wait_for_selector("dialog[open]")  # the address changes first, the dialog follows
    first = page.locator("dialog h2").inner_text()
    page.get_by_role("button", name="Previous").click()
    page.get_by_role("button", name="Next").click()
    assert page.locator("dialog h2").inner_text() == first


def test_the_filtered_rows_are_saved_as_csv(visit: Any, tmp_path: Path) -> None:
    """The CSV has one row per filtered case, and reads back whatever the solver said."""
    page = visit("#b=osqp")
    with page.expect_download() as download:
        page.locator("#csv").click()
    download.value.save_as(tmp_path / "cases.csv")
    with open(tmp_path / "cases.csv", encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == shown(page) > 0
    assert {row["backend"] for row in rows} == {"osqp"}


def test_of_many_curves_some_stand_out_at_first(visit: Any) -> None:
    """Unlike backends are chosen beforehand, the rest is grey; letting the last one go brings all back."""
    page = visit()
    chart = page.locator("[data-chart=error]")
    chart.scroll_into_view_if_needed()
    page.wait_for_selector("[data-chart=error][data-drawn] .main-svg")
    pressed = chart.locator(".names button[aria-pressed=true]")
    names = pressed.all_inner_texts()
    assert {"eq6", "osqp", "proxsuite:dense", "numpy:lstsq"} < set(names) and len(names) == 8
    thin = "(all) => all.filter((line) => line.style.strokeWidth === '1px').length"
    grey = lambda: chart.locator(".js-line").evaluate_all(thin)  # noqa: E731
    assert grey() == chart.locator(".names button").count() - 8 > 10
    for _ in names:
        pressed.first.click()
    assert grey() == 0


def test_a_share_says_how_many_problems_it_rests_on(visit: Any) -> None:
    """Each cell of the tables by decade carries its count, and is grey where the count is below five."""
    cells = visit().locator(".heat td[title]").evaluate_all("(all) => all.map((c) => [c.title, c.textContent, c.className])")
    assert len(cells) > 100 and any(name == "few" for _, _, name in cells)
    for title, text, name in cells:
        verified, of, n = title.split(" ")
        assert of == "of" and int(text) == 100 * int(verified) // int(n) and (name == "few") == (int(n) < 5)


def test_failures_are_listed_with_links(visit: Any) -> None:
    """Opening a list shows as many linked cases as it counts."""
    page = visit()
    listing = page.locator(".listing[data-verdict=false_success]").last
    number = int(re.search(r"(\d+)(?: of them listed)?$", listing.locator("summary").inner_text())[1])
    listing.locator("summary").click()
    assert listing.locator("li a").count() == number > 0
    listing.locator("li a").first.click()
    assert "false success" in page.locator("dialog[open]").inner_text()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_no_accessibility_violation(visit: Any, short_report: Report, scheme: str) -> None:
    """WCAG 2.1 A and AA hold in both colour schemes, with the plots drawn, a list open and a case shown."""
    page = visit(page_of=short_report, color_scheme=scheme, reduced_motion="reduce")
    for chart in CHARTS:
        page.locator(f"[data-chart={chart}]").scroll_into_view_if_needed()
        page.wait_for_selector(f"[data-chart={chart}][data-drawn] .main-svg")
    page.locator(".listing summary").first.click()
    page.locator("[data-chart=error] .names button").first.click()
    for summary in page.locator(".method > summary").all():
        summary.click()
    assert page.locator(".drawing:visible").count() == page.locator(".drawing").count() > 20
    assert violations(page) == []
    page.evaluate("document.querySelector('.scroller tbody a').click()")
    page.wait_for_selector("dialog[open]")
    assert violations(page, "'dialog'") == []


def test_a_method_of_the_overview_leads_to_its_part(visit: Any) -> None:
    """A link of the overview opens the part of its method, with JavaScript and without."""
    for options in ({}, {"java_script_enabled": False}):
        page = visit(**options)
        assert page.locator(".method[open]").count() == 0
        page.locator("#methods .overview a", has_text="Manipulator inertia").click()
        page.wait_for_selector(".method[open] .drawing", timeout=5000)
        part = page.locator(".method[open]")
        assert part.count() == 1 and part.locator("h3").inner_text() == "M16, Manipulator inertia"
        expect(part.locator("h3")).to_be_in_viewport()  # waits: the page may scroll smoothly


def test_drawings_follow_the_theme_and_fit_their_place(visit: Any) -> None:
    """Lines and words change with the switch; no drawing is wider than its place, nor its words outside it, on a phone too."""
    page = visit(color_scheme="dark")
    page.locator("#methods .overview a").first.click()
    page.wait_for_selector(".method[open] .drawing")
    colours = """() => ['path.start', 'path.s7', 'path.g', 'text', 'text.n'].map((name) => {
      const style = getComputedStyle(document.querySelector(`.method[open] .drawing ${name}`));
      return name.startsWith('text') ? style.fill : style.stroke; })"""
    dark = page.evaluate(colours)
    page.locator("#theme").click()
    light = page.evaluate(colours)
    assert all(one != other for one, other in zip(dark, light, strict=True))
    outside = """() => [...document.querySelectorAll('.method[open] .drawing')].flatMap((svg) => {
      const box = svg.getBoundingClientRect(), place = svg.closest('.body').getBoundingClientRect();
      const words = [...svg.querySelectorAll('text')].filter((text) => { const own = text.getBoundingClientRect();
        return own.left < box.left - 1 || own.right > box.right + 1 || own.top < box.top - 1 || own.bottom > box.bottom + 1; });
      return [...(box.right > place.right + 1 ? [`wide: ${svg.querySelector('title').textContent}`] : []),
              ...words.map((text) => `${svg.querySelector('title').textContent}: ${text.textContent}`)]; })"""
    assert page.evaluate(outside) == []
    page.set_viewport_size({"width": 390, "height": 800})
    assert page.evaluate(outside) == []


def test_the_figure_stands_alone_in_both_schemes(browser: Any, report: Report, tmp_path: Path) -> None:
    """As an image of a page it is drawn, on its own paper, light and dark as the reader wishes."""
    figure = write_drift_figure(report.run, tmp_path / "drift.svg", robot="planar_3r")
    (tmp_path / "page.html").write_text('<img src="drift.svg" alt="drift">')
    seen = {}
    for scheme in ("light", "dark"):
        context = browser.new_context(color_scheme=scheme)
        page = context.new_page()
        page.goto((tmp_path / "page.html").as_uri())
        page.wait_for_function("document.images[0].complete")
        assert page.evaluate("document.images[0].naturalWidth") == 880
        seen[scheme] = page.locator("img").screenshot()
        context.close()
    assert seen["light"] != seen["dark"] and figure.is_file()


def test_the_switch_overrides_the_system_and_plots_follow(visit: Any) -> None:
    """Dark by the system's wish; one press of the switch makes it light, plots included."""
    page = visit(color_scheme="dark")
    page.locator("[data-chart=error]").scroll_into_view_if_needed()
    page.wait_for_selector("[data-chart=error][data-drawn] .main-svg")
    colours = (
        "() => [getComputedStyle(document.body).backgroundColor, getComputedStyle(document.querySelector('.xtick text')).fill]"
    )
    before = page.evaluate(colours)
    page.locator("#theme").click()
    after = page.evaluate(colours)
    assert page.locator("#theme").inner_text() == "Theme: light"
    assert before[0] != after[0] and before[1] != after[1]


def test_readable_without_javascript(visit: Any) -> None:
    """With JavaScript off all findings, panels, rankings and the worst failures stand, and no dead control does."""
    page = visit(java_script_enabled=False)
    text = page.locator("main").inner_text()
    for phrase in (
        "false successes by",
        "sandbox verify --out",
        "What did not run",
        "Liegeois gradient projection",
        "Cold and warm",
        "pip install qpsolvers",
        "Which should I use",
        "The worst 50",
    ):
        assert phrase in text
    assert page.locator("table.matrix").count() > 5
    assert all(table.is_visible() for table in page.locator("table.matrix").all())
    assert not any(control.is_visible() for control in page.locator("button, select, input").all())


def test_printed_it_shows_every_panel_and_the_worst_failures(visit: Any) -> None:
    """On paper all panels and the list of the worst failures stand; navigation, filters and the virtual table do not."""
    page = visit()
    page.emulate_media(media="print")
    assert all(panel.is_visible() for panel in page.locator(".panel").all())
    assert page.locator("#worst").is_visible() and page.locator("#worst tbody tr").count() == 50
    assert page.locator(".method[open]").count() == 0 and page.locator(".method .body").count() == 6
    assert all(part.is_visible() for part in page.locator(".method .body, .method .drawing").all())
    assert not page.locator("nav").is_visible() and not page.locator("#explorer").is_visible()
