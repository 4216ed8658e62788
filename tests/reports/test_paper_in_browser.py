"""The page of a paper's claims as its reader meets it, in Chromium."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import expect

from reports.paper import write_paper
from tests.reports.synthetic_paper import HOSTILE, plots, rows, write_paper_run
from tests.reports.test_in_browser import violations

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The made-up run with everything in it, and one of sixty claims."""
    folder = tmp_path_factory.mktemp("paper")
    write_paper_run(folder / "all")
    kinds = [row for row in rows() if row.name not in ("hostile", "bare")]
    sections = ("I", "II", "II", "III", "III", "III", "IV", "V", "VI", "VII")
    many = [
        replace(kinds[k % 5], name=f"claim_{k}", where=f"Section {sections[k // 6]}, eq. ({k})", exhibits=()) for k in range(60)
    ]
    write_paper_run(folder / "many", many)
    return {name: write_paper(folder / name, folder / f"{name}.html") for name in ("all", "many")}


@pytest.fixture
def visit(browser: Any, pages: dict[str, Path]) -> Iterator[Any]:
    """Open a page (fragment, options of the browser's context); afterwards: no outside request, no console error."""
    contexts, wrong = [], []

    def open_page(fragment: str = "", which: str = "all", size: tuple[int, int] = (1280, 800), **options: Any) -> Any:
        context = browser.new_context(viewport={"width": size[0], "height": size[1]}, reduced_motion="reduce", **options)
        contexts.append(context)
        page = context.new_page()
        page.on("request", lambda r: r.url.startswith(("file:", "blob:", "data:")) or wrong.append(f"request: {r.url}"))
        page.on("console", lambda m: m.type in ("error", "warning") and wrong.append(f"console: {m.text}"))
        page.on("pageerror", lambda error: wrong.append(f"error: {error}"))
        page.goto(pages[which].as_uri() + fragment)
        if options.get("java_script_enabled", True):
            page.wait_for_selector("html[data-ready]")
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert not wrong


def chart(page: Any, claim: str, place: int = 0) -> Any:
    """A chart of a claim, once the script has drawn it."""
    figure = page.locator(f'[data-chart="{claim}~{place}"]')
    figure.scroll_into_view_if_needed()
    figure.locator(".main-svg").first.wait_for()
    return figure


def names(page: Any) -> set[str]:
    """The claims that are seen."""
    return set(page.locator("article.claim:visible").evaluate_all("(all) => all.map((one) => one.id)"))


@pytest.mark.parametrize("which", ["all", "many"])
def test_the_summary_fits_one_screen(visit: Any, which: str) -> None:
    """At 1280 by 800 title, citation, counts, every claim, faults, command, seed and versions stand above the fold."""
    page = visit(which=which)
    assert page.locator("#page-summary").bounding_box()["height"] <= 800
    assert page.locator(".provenance").bounding_box()["y"] + page.locator(".provenance").bounding_box()["height"] <= 800
    expect(page.locator(".chip").last).to_be_in_viewport()
    for phrase in (
        "English and A. A. Maciejewski",
        "from memory",
        "reproduced with a range",
        "planted faults",
        "seed 0",
        "numpy",
    ):
        assert phrase in page.locator("#page-summary").inner_text()
    for mark in page.locator(".chip .mark").all()[:7]:
        assert mark.inner_text() in "✓RC✕!" and mark.bounding_box()["width"] >= 12


def test_a_chip_leads_to_its_claim_and_the_address_keeps_it(visit: Any) -> None:
    """Each claim has an address of its own, which opens at it."""
    page = visit()
    page.locator(".chip", has_text="The scalars may be any").click()
    expect(page.locator("#in_a_range h3")).to_be_in_viewport()
    assert page.url.endswith("#in_a_range")
    expect(visit("#refuted").locator("#refuted h3")).to_be_in_viewport()


def test_the_filter_leaves_one_state(visit: Any) -> None:
    """A state in the summary or in the contents leaves its claims and their sections; again, or a link elsewhere, lifts it."""
    page = visit()
    every = names(page)
    page.locator("nav .filter").get_by_role("button", name="1 reproduced as corrected").click()
    assert names(page) == {"with_an_erratum"} and page.locator(".part:visible").count() == 1
    assert names(visit("#state=corrected")) == {"with_an_erratum"}
    page.locator(".tile button").get_by_text("reproduced as corrected").click()
    assert names(page) == every
    page.locator(".tile[data-state=range] button").click()
    assert names(page) == {"in_a_range"}
    page.locator("nav .map a.s-not-reproduced").click()
    assert names(page) == every
    expect(page.locator("#refuted h3")).to_be_in_viewport()


def test_hovering_a_point_names_series_and_values(visit: Any) -> None:
    """The label of a point says its series, both values with their axes, and its own words."""
    page = visit("#with_an_erratum")
    figure = chart(page, "with_an_erratum", 2)
    point = figure.locator(".scatterlayer .trace").last.locator(".point").first.bounding_box()
    page.mouse.move(point["x"] + point["width"] / 2, point["y"] + point["height"] / 2)
    label = figure.locator(".hoverlayer .hovertext")
    label.wait_for()
    for words in ("printed", "rate [rad/s]: 1", "weighted_pseudoinverse", "Table I"):
        assert words in label.inner_html().replace("&nbsp;", " ") or words in label.text_content()


def test_what_is_drawn_agrees_with_the_still_drawing(visit: Any) -> None:
    """The script draws as many series, over the same ranges, with values on a logarithmic axis and zeros on their line."""
    page = visit("#in_a_range")
    figure = chart(page, "in_a_range", 0)
    full = figure.evaluate("(f) => { const l = f.querySelector('.plot')._fullLayout; return [l.xaxis.type, l.xaxis.range]; }")
    assert full[0] == "log" and full[1][0] < full[1][1]
    assert figure.locator(".xtick text").all_text_contents()[0] == "0"
    assert figure.locator(".scatterlayer .trace").count() == 2
    assert figure.locator(".scatterlayer .point").count() > 9000
    colours = "(f) => [getComputedStyle(f.querySelector('.keys .c0')).stroke, f.querySelector('.plot').data.at(0).marker.color]"
    still, drawn = figure.evaluate(colours)
    assert drawn.removeprefix("rgba(").startswith(still.removeprefix("rgb(").removesuffix(")"))


def test_a_name_of_the_legend_hides_its_series(visit: Any) -> None:
    """By mouse or keyboard a name takes its series away and brings it back, and says so."""
    page = visit("#holds")
    figure = chart(page, "holds", 0)
    traces = "(f) => f.querySelector('.plot').data.length"
    count = figure.evaluate(traces)
    button = figure.get_by_role("button", name="(6)")
    button.focus()
    page.keyboard.press("Enter")
    assert button.get_attribute("aria-pressed") == "false" and figure.evaluate(traces) == count - 1
    button.click()
    assert figure.evaluate(traces) == count


def test_every_plot_becomes_interactive_and_no_text_becomes_markup(visit: Any) -> None:
    """All exhibits with values draw, hostile names included; those without values stay as they are."""
    page = visit()
    drawn = 0
    for row in rows():
        for place, one in enumerate(row.exhibits):
            if one.kind == "table" or one.caption in ("Nothing at all", "Without a series", "No cells"):
                continue
            chart(page, row.name, place)
            drawn += 1
    assert drawn == len([one for one in plots() if one.kind != "table"]) - 3
    assert page.evaluate("window.hacked") is None
    assert HOSTILE.split("<img")[0] in page.locator("#hostile h3").inner_text()
    assert page.locator('[data-chart="with_an_erratum~0"] .still svg').is_visible()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("size", [(1280, 800), (390, 844)])
def test_no_accessibility_violation(visit: Any, scheme: str, size: tuple[int, int]) -> None:
    """WCAG 2.1 A and AA hold in both colour schemes, large and small, with plots drawn and lists open."""
    page = visit(size=size, color_scheme=scheme)
    for claim, place in (("holds", 0), ("holds", 1), ("with_an_erratum", 2), ("refuted", 1)):
        chart(page, claim, place)
    for summary in page.locator("summary:visible").all():
        summary.click()
    assert violations(page) == []


@pytest.mark.parametrize("options", [{}, {"java_script_enabled": False}], ids=["script", "no script"])
def test_nothing_is_wider_than_a_phone(visit: Any, options: dict[str, Any]) -> None:
    """At 390 pixels the page does not scroll sideways, and no word of a formula or a table is out of reach."""
    page = visit(size=(390, 844), **options)
    page.wait_for_timeout(300)
    assert page.locator("body").bounding_box()["width"] <= 390
    wide = """(all) => all.filter((e) => { const b = e.getBoundingClientRect();
      if (b.right <= 391 || !b.width) return false;
      for (let p = e.parentElement; p; p = p.parentElement) {
        if (['auto', 'scroll', 'hidden'].includes(getComputedStyle(p).overflowX)) return false; }
      return true; }).map((e) => e.outerHTML.slice(0, 120))"""
    if options:
        assert page.locator("#page-main").bounding_box()["width"] <= 390
    else:
        assert page.locator("main *").evaluate_all(wide) == []
        assert page.evaluate("document.documentElement.scrollWidth") <= 390


def test_the_switch_overrides_the_system_and_plots_follow(visit: Any) -> None:
    """Dark by the system's wish; one press of the switch makes it light, drawings and plots included."""
    page = visit("#holds", color_scheme="dark")
    figure = chart(page, "holds", 0)
    colours = """(f) => [getComputedStyle(document.body).backgroundColor, getComputedStyle(f.querySelector('.keys .c0')).stroke,
      getComputedStyle(f.querySelector('.xtick text')).fill, f.querySelector('.plot').data.at(-1).marker.color]"""
    dark = figure.evaluate(colours)
    page.locator("#page-theme").click()
    light = figure.evaluate(colours)
    assert page.locator("#page-theme").inner_text() == "Theme: light"
    assert all(one != other for one, other in zip(dark[:3], light[:3], strict=True))


def test_formulae_are_mathml_that_the_browser_lays_out(visit: Any) -> None:
    """The matrices of (6) have two rows, and their brackets are as tall as they are."""
    page = visit("#holds")
    fence, table = page.evaluate(
        """() => { const t = document.querySelector('#holds .formula mtable');
        return [t.previousElementSibling.getBoundingClientRect().height, t.getBoundingClientRect().height]; }"""
    )
    assert table > 30 and fence > 0.75 * table
    assert page.locator("#holds .formula math").get_attribute("alttext").startswith("\\dot q")


def test_readable_without_javascript(visit: Any) -> None:
    """With JavaScript off every claim, table and drawing stands, and no dead control does."""
    page = visit(java_script_enabled=False)
    assert names(page) == {row.name for row in rows()}
    assert page.locator(".drawing:visible").count() == page.locator(".chart-box").count() == 11
    assert not any(control.is_visible() for control in page.locator("button, select, input").all())
    page.locator("#holds summary").click()
    assert page.locator("#holds .folded tbody tr:visible").count() == 12
    assert "planted faults noticed" in page.locator("main").inner_text()


def test_printed_it_shows_all_and_the_still_drawings(visit: Any) -> None:
    """On paper every claim, list and drawing stands, also of a filtered page; navigation and interactive plots do not."""
    page = visit("#holds")
    chart(page, "holds", 0)
    page.locator(".tile[data-state=range] button").click()
    page.emulate_media(media="print")
    assert names(page) == {row.name for row in rows()}
    assert page.locator(".drawing:visible").count() == 11 and page.locator(".main-svg:visible").count() == 0
    assert page.locator("#holds .folded tbody tr:visible").count() == 12
    assert not page.locator("nav").is_visible()


def test_it_works_by_keyboard(visit: Any) -> None:
    """The first stop skips to the claims; a chart that is reached draws itself; tables that scroll can be reached."""
    page = visit()
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.className") == "skip"
    figure = page.locator('[data-chart="refuted~0"]')
    figure.focus()
    figure.locator(".main-svg").first.wait_for()
    assert page.locator("[role=region]:not([tabindex='0'])").count() == 0
