"""Charts are sound SVG and draw what they were given."""

from __future__ import annotations

import itertools
import math
import re
from xml.etree import ElementTree

import numpy as np
import pytest

from reports import chart
from sandbox.claims.exhibit import Axis, Exhibit, Heat, Plot, Series, Table
from tests.reports.synthetic_paper import plots

SHOWN = [one for one in plots() if not isinstance(one, Table)]


def svg(drawn: chart.Drawn) -> ElementTree.Element:
    """The drawing, read as XML."""
    return ElementTree.fromstring(drawn.svg)


def paths(drawn: chart.Drawn, name: str) -> list[str]:
    """The paths of a class."""
    return [path.get("d", "") for path in svg(drawn).iter("path") if name in path.get("class", "").split()]


def words(drawn: chart.Drawn) -> list[str]:
    """What is written in the drawing."""
    return [text.text or "" for text in svg(drawn).iter("text")]


def plot(*series: Series, x: Axis | None = None, y: Axis | None = None) -> chart.Drawn:
    """A plot of some series."""
    return chart.drawn(Plot("caption", x or Axis("x"), y or Axis("y"), series))


@pytest.mark.parametrize("width", [chart.NARROW, chart.WIDE])
@pytest.mark.parametrize("shown", SHOWN, ids=[one.caption[:20] for one in SHOWN])
def test_every_exhibit_is_a_described_drawing_inside_its_box(shown: Exhibit, width: float) -> None:
    """It is well-formed, has title and description, no number that is none, and nothing outside its box."""
    drawn = chart.drawn(shown, width=width)  # type: ignore[arg-type]
    root = svg(drawn)
    assert root.get("role") == "img" and root.findtext("title") and root.findtext("desc")
    text = "".join(value for part in root.iter() for name, value in part.attrib.items() if name not in ("class", "viewBox"))
    assert "nan" not in text and "inf" not in text
    _, _, across, height = (float(v) for v in root.get("viewBox", "").split())
    for part in root.iter("text"):
        if "transform" not in part.attrib:
            assert 0 <= float(part.get("x", "")) <= across and 0 <= float(part.get("y", "")) <= height
    assert not re.search(r"<(script|img|a|image|foreignObject)\b", drawn.svg)


def test_decades_are_ticks_of_a_logarithmic_axis() -> None:
    """From 1e−8 to 1 every few have their label, in powers of ten; within a decade its 2 and its 5 have one as well."""
    drawn = plot(Series("a", [1, 2], [1e-8, 1.0]), y=Axis("y", log=True))
    assert {"10⁻⁸", "10⁻⁶", "10⁻⁴", "10⁻²", "10⁰"} <= set(words(drawn)) and drawn.data["y"]["range"] == [-8, 0]
    near = plot(Series("a", [1, 2], [1.2, 8.0]), y=Axis("y", log=True))
    assert {"1", "2", "5", "10"} <= set(words(near))


def test_what_has_no_logarithm_stands_on_a_line_of_its_own() -> None:
    """Zeros lie on a tick named 0, negatives make it ≤ 0, and without them there is no such tick."""
    log = Axis("y", log=True)
    assert "0" in words(plot(Series("a", [1, 2], [0.0, 1e-3]), y=log))
    assert "≤ 0" in words(plot(Series("a", [1, 2], [-1.0, 1e-3]), y=log))
    positive = plot(Series("a", [1, 2], [1e-5, 1e-3]), y=log)
    assert positive.data["y"]["lane"] is None and not {"0", "≤ 0"} & set(words(positive)[:6])


def test_points_are_left_out_only_where_another_stands_on_the_same_pixel() -> None:
    """All points far apart are drawn; 10,000 in one place are one."""
    apart = plot(Series("a", list(range(300)), list(range(300))))
    assert paths(apart, "c0")[0].count("h0") == 300
    assert paths(plot(Series("a", [1.0] * 10_000 + [2.0], [1.0] * 10_000 + [2.0])), "c0")[0].count("h0") == 2


def test_what_is_not_drawn_is_said() -> None:
    """Points beyond the axes, and those left out to keep the page small, are counted in words; extremes stay."""
    outside = plot(Series("a", [0, 1, 2], [0, 1, 9]), y=Axis("y", low=0, high=2))
    assert outside.left_out == "1 point lies outside the axes" and paths(outside, "c0")[0].count("h0") == 2
    x = np.arange(5000.0)
    y = np.where(x == 777, 10.0, np.sin(x))
    fewer = chart.drawn(Plot("c", Axis("x"), Axis("y"), (Series("a", x, y),)), most=100)  # type: ignore[arg-type]
    assert re.fullmatch(r"drawn: \d+ of 5,000 of a", fewer.left_out)
    assert len(fewer.data["series"][0]["x"]) <= 104 and 10 in fewer.data["series"][0]["y"]


def test_the_papers_numbers_are_dashed_and_named() -> None:
    """A rule of the paper is dashed and its label says paper; bounds are thin and grey."""
    drawn = plot(Series("average", [], [0.5], "horizontal", "paper"), Series("limit", [0.2], [], "vertical", "bound"),
                 Series("a", [0, 1], [0, 1]))  # fmt: skip
    assert len(paths(drawn, "paper")) == 1 and "dash" in drawn.svg and "average (paper)" in words(drawn)
    assert len(paths(drawn, "bound")) == 1 and "limit" in words(drawn)
    assert [key.name for key in drawn.keys] == ["average", "limit", "a"]


def test_a_line_breaks_where_it_has_no_value() -> None:
    """A missing value is a gap, not a zero."""
    drawn = plot(Series("a", [0, 1, 2, 3, 4], [1, 2, math.nan, 2, 1], "line"))
    assert paths(drawn, "c0")[0].count("M") == 2


def test_series_of_one_role_are_told_apart() -> None:
    """Six of ours have six colours; the seventh is dashed."""
    drawn = plot(*(Series(f"s{k}", [0, 1], [k, k], "line") for k in range(7)))
    assert len({key.colour for key in drawn.keys[:6]}) == 6
    assert drawn.keys[6].colour == drawn.keys[0].colour and len(paths(drawn, "dash")) == 1


def test_a_histogram_has_an_area_for_every_bin() -> None:
    """Its outline rises once per bin and starts at nothing."""
    drawn = plot(Series("a", [0, 1, 2, 3], [2, 0, 4], "bars"))
    outline = next(path for path in paths(drawn, "c0") if not path.endswith("z"))
    assert outline.count("H") == 3 and drawn.data["y"]["range"][0] == 0


def test_a_heat_map_is_coloured_apart_at_its_middle() -> None:
    """Cells on either side of the middle take shades of either side, equal ratios equal shades; none has no cell."""
    drawn = chart.drawn(Heat("c", "n", "m", ("a", "b", "c", "d"), ("r",), [[0.5, 1.0, 2.0, None]]))
    assert [rect.get("class") for rect in svg(drawn).iter("rect")] == ["t0", "t5", "t10"]
    assert drawn.data["score"] == [[-1, 0, 1, None]]
    flat = chart.drawn(Heat("c", "n", "m", ("a",), ("r",), [[1.0]]))
    assert [rect.get("class") for rect in svg(flat).iter("rect")] == ["t5"]


def test_two_charts_stand_beside_each_other_and_an_odd_one_alone() -> None:
    """Widths go by pairs; a heat map full of words has a row of its own."""
    small = Plot("c", Axis("x"), Axis("y"), ())
    large = Heat("c", "x", "y", tuple("abcdefghijkl"), ("row",), [[1.0] * 12], 1.0, [["a long word"] * 12])
    n, w = chart.NARROW, chart.WIDE
    assert chart.layout([small]) == [w] and chart.layout([small, small]) == [n, n]
    assert chart.layout([small, small, small]) == [n, n, w] and chart.layout([small, large, small]) == [w, w, w]


def test_colours_follow_the_scheme_and_keep_their_contrast() -> None:
    """Every class of a mark has a colour for light and for dark paper; text on a heat map reads at 4.5 : 1 and more."""
    sheet = chart.style()
    for name in (*chart._OURS, *chart._OTHERS, "paper", "bound", *(f"t{k}" for k in range(11))):
        assert re.search(rf"\.{name}\b[^}}]*\{{[^}}]*light-dark\(#\w{{6}},#\w{{6}}\)", sheet)

    def luminance(colour: str) -> float:
        parts = [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]
        linear = [v / 12.92 if v <= 0.03928 else ((v + 0.055) / 1.055) ** 2.4 for v in parts]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    for ink, tints in zip(("#1d1f23", "#e9e7e2"), chart._TINTS, strict=True):
        for tint in tints:
            high, low = sorted((luminance(ink), luminance(tint)), reverse=True)
            assert (high + 0.05) / (low + 0.05) >= 4.5, (ink, tint)


@pytest.mark.parametrize("at", [(1, 2, 3), (3, 2, 1), (1, 1.1, 9), (8, 8.9, 9), (0, 5, 9.9), (5,)])
@pytest.mark.parametrize("name", ["c", "a name of some length", "a name as long as a name can be in a plot"])
def test_names_of_rules_lie_apart_above_the_plot(at: tuple[float, ...], name: str) -> None:
    """No name lies on another or on the plot, none leaves it, and the rules that a name lies over have lower ones."""
    axis = Axis("x", low=0, high=10)
    rules = tuple(Series(f"{name} {k}", [x], [], "vertical", "bound") for k, x in enumerate(at))
    plot = Plot("c", axis, axis, (Series("s", [0, 10], [0, 10], "line"), *rules))
    found = chart.drawn(plot, width=chart.WIDE)
    marks = re.findall(r'<text class="halo bound( e)?" x="([\d.]+)" y="([\d.]+)">([^<]+)</text>', found.svg)
    rule = re.compile(r'<path class="bound x[^"]*" d="M([\d.]+) ([\d.]+)V([\d.]+)"')
    tops = {float(x): float(y) for x, y, _ in rule.findall(found.svg)}
    top = float(re.search(r'<path class="a" d="M[\d.]+ ([\d.]+)v', found.svg)[1])  # type: ignore[index]
    assert len(marks) == len(at) == len(tops)
    spans = []
    for back, x, y, words in marks:
        wide = 6.3 * len(words)
        low, high = (float(x) - wide, float(x)) if back else (float(x), float(x) + wide)
        assert float(y) < top and high <= chart.WIDE
        assert all(not low < stands < high or reaches > float(y) - 4 for stands, reaches in tops.items())
        spans.append((low, high, float(y)))
    for (low, high, y), (other_low, other_high, other_y) in itertools.combinations(spans, 2):
        assert y != other_y or high <= other_low or other_high <= low
