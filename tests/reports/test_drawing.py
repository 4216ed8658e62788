"""Drawings as text: well formed, true to scale, small, and legible on light and dark paper."""

from __future__ import annotations

import re
import subprocess
import sys
from itertools import pairwise
from xml.etree import ElementTree

import numpy as np
import pytest

from reports import drawing
from reports.drawing import Curve, Cycles

Array = np.ndarray

ARM = np.array([[[0, 0, 0], [0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 0, 0], [0, 0, 0], [0, 1, 0], [1, 1, 0]]], float)
T = np.linspace(0, 1, 500)
ROUND = np.column_stack([1 + 0.2 * np.cos(2 * np.pi * T), 1 + 0.2 * np.sin(2 * np.pi * T), 0 * T])


def points(path: str) -> Array:
    """The points (T, 2) of a path of one M and one l."""
    numbers = [float(x) for x in re.findall(r"-?(?:\d+\.?\d*|\.\d+)", path)]
    steps = np.reshape(numbers, (-1, 2))
    return np.cumsum(steps, axis=0)


def paths(svg: str, name: str) -> list[str]:
    """The paths of a class."""
    return re.findall(rf'<path class="{name}" d="([^"]+)"', svg)


def drawings() -> dict[str, str]:
    """One of each."""
    panel = Cycles("<A & B>", "drift 0.1", ARM, ROUND, np.array([0.1]))
    return {
        "stroboscope": drawing.stroboscope(ARM, ROUND, title="<A & B>", about="two postures"),
        "curves": drawing.curves(T, [Curve("q₁", np.sin(9 * T))], title="<A & B>", about="a sine", heading="h", unit="rad"),
        "drift": drawing.drift(np.array([0.1, 0.2]), title="<A & B>", about="two cycles"),
        "drift_figure": drawing.drift_figure([panel, panel], title="<A & B>", about="two methods"),
    }


@pytest.mark.parametrize("kind", drawings())
def test_a_drawing_is_well_formed_and_says_what_it_shows(kind: str) -> None:
    """It parses as XML, is an image with a title and a description, and its words are text, never markup."""
    root = ElementTree.fromstring(drawings()[kind])
    assert root.get("role") == "img" and [child.tag for child in root][:2] == ["title", "desc"]
    assert root[0].text == "<A & B>" and root[1].text
    assert {child.tag for child in root} <= {"title", "desc", "path", "text"}


@pytest.mark.parametrize("kind", drawings())
def test_a_file_of_its_own_needs_nothing_else(kind: str) -> None:
    """Its style stands inside, follows the reader's wish for dark, and names no address but the one of the format."""
    text = drawing.standalone(drawings()[kind])
    root = ElementTree.fromstring(text)
    assert root.tag == "{http://www.w3.org/2000/svg}svg"
    assert "@media(prefers-color-scheme:dark)" in text and "light-dark(" not in text and "var(" not in text
    assert re.findall(r"https?://[^\"]*", text) == ["http://www.w3.org/2000/svg"] and "url(" not in text and "href" not in text
    classes = {name for found in re.findall(r'class="([^"]+)"', text) for name in found.split()} - {"drawing"}
    assert not [name for name in classes if f".{name}{{" not in text]


def test_a_planar_arm_is_drawn_to_scale_in_its_plane() -> None:
    """Equal links have equal lengths on paper, up is up, and no axis is foreshortened."""
    svg = drawing.stroboscope(ARM, ROUND, title="t", about="a")
    start = points(paths(svg, "start k")[0])  # base and first joint coincide and are one point
    along, up = np.diff(start, axis=0)
    assert along[0] == pytest.approx(-up[1], abs=0.2) and abs(along[1]) < 0.11 and abs(up[0]) < 0.11 and along[0] > 50
    length = float(re.search(r'h([\d.]+)v-3"', svg)[1])
    metres = float(re.search(r">([\d.]+) m<", svg)[1])
    assert length / metres == pytest.approx(along[0], rel=0.02)


@pytest.mark.parametrize(("flat", "kept"), [(0, (1, 2)), (1, (0, 2)), (2, (0, 1))])
def test_the_plane_of_an_arm_is_found(flat: int, kept: tuple[int, int]) -> None:
    """Whichever coordinate stands still is the one left out."""
    arm = np.random.default_rng(1).standard_normal((3, 4, 3))
    arm[..., flat] = 0.25
    view = drawing._View.of(arm, np.empty((0, 3)))
    assert view.planar and np.array_equal(view.basis, np.eye(3)[list(kept)])


def test_an_arm_in_space_is_seen_without_perspective_from_where_its_path_is_wide() -> None:
    """Both directions of the page are unit vectors at right angles, and a circle upright in x and z is seen nearly face on."""
    arm = np.random.default_rng(2).standard_normal((3, 4, 3))
    ring = 0.3 * np.column_stack([np.cos(7 * T), 0 * T, np.sin(7 * T)])
    view = drawing._View.of(arm, ring)
    assert not view.planar and np.allclose(view.basis @ view.basis.T, np.eye(2))
    assert abs(np.cross(*view.basis)[1]) > 0.9


def test_a_thinned_curve_looks_the_same() -> None:
    """Few points, within a fifth of a pixel of every point left out, both ends and a spike kept."""
    x, y = 300 * T, 50 * np.sin(12 * T)
    y[250] += 40
    kept_x, kept_y = drawing.thinned(x, y)
    assert 20 < len(kept_x) < 120 and {x[0], x[250], x[-1]} <= set(kept_x)
    assert np.abs(np.interp(x, kept_x, kept_y) - y).max() < 0.21 * np.hypot(1, np.abs(np.diff(y) / np.diff(x)).max())
    rough = drawing.thinned(x, np.random.default_rng(3).uniform(0, 100, len(x)))
    assert len(rough[0]) <= 200


def test_a_closed_path_stays_closed_and_round() -> None:
    """A curve that ends where it began is not taken for a point."""
    x, y = drawing.thinned(100 + 80 * ROUND[:, 0], 100 + 80 * ROUND[:, 1], 0.05)
    assert 20 < len(x) <= 200 and (x[0], y[0]) == pytest.approx((x[-1], y[-1]))
    assert np.ptp(x) == pytest.approx(32, abs=0.1) and np.ptp(y) == pytest.approx(32, abs=0.1)


def test_rounding_does_not_add_up_along_a_path() -> None:
    """The last of 200 points, each given by its distance from the one before, is where it should be."""
    x, y = np.linspace(0, 7.77, 200), np.linspace(3, 9.99, 200)
    assert points(drawing._path(x, y))[-1] == pytest.approx((7.8, 10.0), abs=1e-9)


def test_a_curve_breaks_where_it_has_no_value() -> None:
    """One gap, two strokes."""
    y = np.cos(5 * T)
    y[200:220] = np.nan
    assert len(paths(drawing.curves(T, [Curve("", y)], title="t", about="a"), "c0 w")) == 2


def test_what_a_logarithm_cannot_show_is_marked() -> None:
    """Values of zero and below leave a mark at the bottom of a logarithmic axis, and the words beside it."""
    fine = drawing.curves(T, [Curve("", 1e-3 + T)], title="t", about="a", log=True)
    crossing = drawing.curves(T, [Curve("", 0.5 - T)], title="t", about="a", log=True)
    assert not paths(fine, "bad k") and "≤ 0" not in fine
    assert len(paths(crossing, "bad k")) == 1 and ">≤ 0<" in crossing and len(paths(crossing, "c0 w")) == 1


@pytest.mark.parametrize(
    "y", [np.full(5, np.nan), np.zeros(5), np.full(5, 1e-300), np.full(5, 7.0), np.array([1e300, 0, 1, 2, -1e300])]
)
@pytest.mark.parametrize("log", [False, True])
def test_strange_values_still_have_their_axes(y: Array, log: bool) -> None:
    """Nothing finite, nothing positive, a constant, the range of doubles: a drawing with labels, all numbers finite."""
    svg = drawing.curves(np.arange(5.0), [Curve("a", y)], title="t", about="a", log=log)
    ElementTree.fromstring(svg)
    assert "nan" not in svg and "inf" not in svg and svg.count('class="m"') >= 2


def test_nothing_to_draw_is_a_drawing_too() -> None:
    """No frames, one frame, no hand, frames that are not finite, no cycle, no lines."""
    broken = ARM.copy()
    broken[0] = np.nan
    for arm, hand in ((ARM[:0], None), (ARM[:1], ROUND[:0]), (broken, ROUND), (np.zeros((1, 4, 3)), np.zeros((2, 3)))):
        svg = drawing.stroboscope(arm, hand, title="t", about="a")
        assert "nan" not in ElementTree.tostring(ElementTree.fromstring(svg)).decode()
    ElementTree.fromstring(drawing.drift(np.empty(0), title="t", about="a"))
    ElementTree.fromstring(drawing.curves(np.empty(0), [], title="t", about="a"))
    ElementTree.fromstring(drawing.drift_figure([]))


def test_labels_do_not_cover_each_other() -> None:
    """Seven curves that end together have seven labels apart, in the order of their ends, none outside."""
    places = drawing._apart([50.0, 50.1, 49.9, 50.05, 50.2, 49.8, 120.0], 20, 120)
    assert all(b - a >= 11 - 1e-9 for a, b in pairwise(sorted(places)))
    assert np.array_equal(np.argsort(places), np.argsort([50.0, 50.1, 49.9, 50.05, 50.2, 49.8, 120.0]))
    assert min(places) >= 20 - 1e-9 and max(places) <= 120 + 1e-9


def test_a_drift_has_a_dot_for_each_cycle_in_the_colour_of_its_arm() -> None:
    """Panels with c cycles have c + 1 dots each; the last arm and the last dot are of one colour, as are the first."""
    arm = np.array([[[0, 0, 0], [1, 0.1 * k, 0], [1, 1, 0]] for k in range(5)], float)
    svg = drawing.drift_figure([Cycles("a", "", arm, ROUND, np.arange(1, 5) / 10)] * 3)
    for name in ("start", "s0", "s2", "s5", "s7"):
        assert len(paths(svg, f"{name} d")) == 3
    assert len(paths(svg, "start k")) == len(paths(svg, "s7 l")) == 3


def test_long_titles_are_broken_and_panels_share_their_cycles() -> None:
    """No line is wider than its panel; a method that got round less often has its dots below those of the others."""
    name = "Inertia-weighted (the dynamically consistent inverse) and then some more words that do not fit in here at all"
    arm = np.array([[[0, 0, 0], [1, 0.1 * k, 0], [1, 1, 0]] for k in range(4)], float)
    panels = [Cycles(name, "drift", arm, ROUND, np.arange(1, 4) / 10), Cycles("b", "stopped", arm[:1], ROUND, np.empty(0))]
    svg = drawing.drift_figure([*panels, panels[0]])
    lines = re.findall(r'class="h" x="([\d.]+)" y="(\d+)">([^<]+)<', svg)
    assert [y for _, y, _ in lines] == ["22", "38", "22", "22", "38"] and all(len(words) < 40 for _, _, words in lines)
    starts = [float(path.split()[0][1:]) for path in paths(svg, "start d")]
    assert starts[1] - starts[0] == pytest.approx(starts[2] - starts[1], abs=0.2)


def test_a_drift_of_rounding_is_drawn_as_none() -> None:
    """1e-13 rad stand on the axis; 0.01 rad do not."""

    def heights(drift: float) -> list[float]:
        found = re.findall(r'<path class="\w+ d" d="M[\d.]+ ([\d.]+)h0', drawing.drift(np.array([drift]), title="t", about="a"))
        return [float(y) for y in found]

    assert heights(1e-13)[0] == heights(1e-13)[1] and heights(0.01)[0] - heights(0.01)[1] > 20


def test_panels_share_one_scale() -> None:
    """The same arm has the same size beside a larger one."""
    small, large = Cycles("a", "", ARM, ROUND, np.array([0.1])), Cycles("b", "", 2 * ARM, ROUND, np.array([0.1]))
    first, second = (points(path) for path in paths(drawing.drift_figure([small, large]), "start k"))
    assert np.ptp(second[:, 0]) == pytest.approx(2 * np.ptp(first[:, 0]), abs=0.3)


def luminance(colour: str) -> float:
    """Relative luminance (WCAG 2.1)."""
    channels = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255
    linear = np.where(channels <= 0.03928, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)
    return float(linear @ (0.2126, 0.7152, 0.0722))


@pytest.mark.parametrize("scheme", [0, 1], ids=["light", "dark"])
def test_text_is_legible_and_a_sequence_is_ordered_by_lightness(scheme: int) -> None:
    """Every colour that writes text has 4.5 : 1 against its paper, and each later shade stands out more than the one before."""
    colours = {name: pair[scheme] for name, pair in drawing._COLOURS.items()}
    paper = luminance(colours["paper"])

    def contrast(name: str) -> float:
        dark, light = sorted((luminance(colours[name]), paper))
        return (light + 0.05) / (dark + 0.05)

    assert not [name for name in ("ink", "muted", "start", "bad", *(f"c{k}" for k in range(8))) if contrast(name) < 4.5]
    shades = [contrast(f"s{k}") for k in range(drawing.STEPS)]
    assert shades == sorted(shades) and shades[0] > 1.6 and all(b / a > 1.1 for a, b in pairwise(shades))


def test_drawing_needs_numpy_alone() -> None:
    """Importing the drawings imports nothing of the project and no library but numpy."""
    names = ("duckdb", "pyarrow", "jinja2", "matplotlib", "scipy", "sandbox", "problems")
    code = f"import sys, reports.drawing; print([name for name in {names} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
