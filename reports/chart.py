"""The plots of a claim: drawn as SVG text for every reader, and as data for the script that makes them interactive.

A plot or heat map of `sandbox.claims.exhibit` in, text out. Colours are named by class, as in `drawing`: `style()` is their
style sheet, to be added to that of the drawings.
"""

from __future__ import annotations

import itertools
import math
import textwrap
from collections.abc import Iterable, Sequence
from html import escape
from typing import Any, NamedTuple

import numpy as np

from reports import drawing, page, tex
from reports.drawing import thinned
from sandbox.claims import exhibit

Array = np.ndarray

NARROW, WIDE = 484.0, 720.0
"""Pixels of a chart that stands beside another, and of one that stands alone."""

_OURS = ("c0", "c2", "c3", "c4", "c5", "c7")
"""Colours of our series, in turn."""

_OTHERS = ("c1", "c6")
"""Colours of the compared path."""

_DASHES = ("dash", "dots", "long", "mixed")
"""How the numbers of the paper are dashed, in turn."""

_STROKES = {"dash": "6 4", "dots": "2 3", "long": "11 4", "mixed": "9 3 2 3", "dot": "1.5 3"}

_MANY = 400
"""Points of a series above which each is drawn smaller, and its place is rounded to the pixel."""

_MOST = 3000
"""Points of a series above which they are drawn faintly, so that their density shows."""

_LETTER = 6.3
"""Pixels of a letter, on average."""

_ROW = 13
"""Pixels of a row of names above the box."""

_STEPS = 5
"""Shades of a heat map on either side of its middle."""

_TINTS = (
    (
        "#7fb2dc", "#9cc4e4", "#b7d4eb", "#d1e3f2", "#e4eef7", "#f1efea", "#f9e7e0", "#f6d3c7", "#f2bcab", "#eca48f", "#e58c75",
    ),
    (
        "#2c6a9c", "#28597f", "#244b69", "#213e54", "#1f3241", "#24262a", "#3a2a27", "#52322c", "#6c3a31", "#844235", "#9c4a39",
    ),
)  # fmt: skip
"""From far below the middle of a heat map to far above, told apart with every kind of colour blindness; text reads on all."""

_SHAPES = """
.chart-box .drawing{width:100%}
.drawing .small{font-size:10px}
.drawing path.f{stroke:none;fill-opacity:.16}
.drawing path.x{stroke-width:1.2}
.drawing path.p3{stroke-width:3}.drawing path.p4{stroke-width:4.2}.drawing path.p6{stroke-width:6}
.drawing path.sq{stroke-linecap:square;stroke-linejoin:miter}
.drawing path.many{stroke-opacity:.55}.drawing path.most{stroke-opacity:.32}
.drawing path.bound,.key path.bound{stroke-opacity:.75}
.drawing text.halo{paint-order:stroke;stroke-width:3px;stroke-linejoin:round}
"""


class Key(NamedTuple):
    """One line of a legend: a name, the class of its colour, and a drawing of its mark."""

    name: str
    colour: str
    mark: str


class Drawn(NamedTuple):
    """A chart: its drawing, the lines of its legend, what a script needs to draw it again (nothing where it is empty),
    and what it leaves out, in words.
    """

    svg: str
    keys: list[Key]
    data: dict[str, Any]
    left_out: str


def style() -> str:
    """What charts add to the style sheet of the drawings."""
    pairs = {name: drawing._COLOURS[name] for name in (*_OURS, *_OTHERS)}
    pairs |= {"paper": drawing._COLOURS["ink"], "bound": drawing._COLOURS["rule"]}
    held = {name: f"light-dark({light},{dark})" for name, (light, dark) in pairs.items()}
    ground = "light-dark({},{})".format(*drawing._COLOURS["paper"])
    ink, muted = ("light-dark({},{})".format(*drawing._COLOURS[name]) for name in ("ink", "muted"))
    out = [f".drawing text.halo{{stroke:{ground}}}.drawing path.gap,.key path.gap{{stroke:{ground}}}"]
    out += [f".drawing text.paper{{fill:{ink}}}.drawing text.bound{{fill:{muted}}}", ".key path{fill:none}"]
    for name, value in held.items():
        out.append(f".drawing path.{name},.key path.{name}{{stroke:{value}}}.drawing path.f.{name}{{stroke:none;fill:{value}}}")
    out += [f".drawing path.{name}{{stroke-dasharray:{dash};stroke-linecap:butt}}" for name, dash in _STROKES.items()]
    for k, (light, dark) in enumerate(zip(*_TINTS, strict=True)):
        out.append(f".drawing rect.t{k}{{fill:light-dark({light},{dark})}}")
    return _SHAPES + "\n".join(out) + "\n"


def layout(shown: Sequence[exhibit.Plot | exhibit.Heat]) -> list[float]:
    """The width of each chart: two beside each other, but alone what needs the room or has no neighbour."""
    out: list[float] = []
    run = 0
    for one in shown:
        if isinstance(one, exhibit.Heat) and _crowded(one):
            if run % 2:
                out[-1] = WIDE
            run = 0
            out.append(WIDE)
        else:
            run += 1
            out.append(NARROW)
    if run % 2:
        out[-1] = WIDE
    return out


def _crowded(heat: exhibit.Heat) -> bool:
    """Whether the words of a heat map need more than half the page."""
    most = max([4, *(len(tex.plain(str(word or ""))) for row in heat.words for word in row)])
    rows = max((len(tex.plain(name)) for name in heat.rows), default=0)
    return len(heat.columns) * (_LETTER * most + 4) > NARROW - 20 - min(0.4 * NARROW, _LETTER * rows)


def drawn(shown: exhibit.Plot | exhibit.Heat, *, width: float = WIDE, most: int = 10_000) -> Drawn:
    """A plot or heat map, `width` pixels wide, with at most `most` points of a series."""
    return _plot(shown, width, most) if isinstance(shown, exhibit.Plot) else _heat(shown, width)


# ---- plots ------------------------------------------------------------------------------------------------------------------


class _Line(NamedTuple):
    """A series made ready: numbers (NaN where there is none), its colour, and whether marks are filled, dashed or square."""

    name: str
    x: Array
    y: Array
    kind: str
    role: str
    colour: str
    square: bool
    hollow: bool
    dash: str
    text: list[str]
    of: int


def _plot(plot: exhibit.Plot, width: float, most: int) -> Drawn:
    lines = _lines(plot.series, most)
    x = _Scale.of(plot.x, _reach(lines, "x"), max(3, int(width // 70)))
    bars = any(line.kind == "bars" for line in lines)
    low_title = textwrap.wrap(tex.plain(plot.x.title), int(width * 0.9 / _LETTER)) or [""]
    heading = textwrap.wrap(tex.plain(plot.y.title), int(width * 0.95 / _LETTER)) or [""]
    height = round(0.5 * width + 60) if width < 600 else round(0.44 * width + 40)
    if plot.y.categories:
        height = max(height, min(900, 24 * len(plot.y.categories) + 90))
    y = _Scale.of(plot.y, _reach(lines, "y"), max(3, int(height // 52)), zero=bars)
    left = 12 + min(0.42 * width, max([30, *(_LETTER * len(words) for _, words in y.ticks)]))
    turned = _turned(x, width - left)
    bottom = 20.0 + 13 * len(low_title) + (min(84.0, 0.64 * _LETTER * max(len(w) for _, w in x.ticks)) if turned else 8)
    right = 14.0 if turned else max(14.0, 0.5 * _LETTER * len(x.ticks[-1][1]) + 3 if x.ticks else 0.0)
    flags = _flags(lines, x, left, width - left - right)
    banner = _ROW * max((flag.row + 1 for flag in flags.values()), default=0)
    top = 12.0 + 14 * len(heading) + banner
    height += banner
    box = _Box(left, top, width - left - right, height - top - bottom)
    out = [_frame(box, x, y, heading, low_title, turned)]
    rules: list[str] = []
    outside = 0
    order = {"bound": 0, "ours": 1, "other": 1, "paper": 2}
    for k, line in sorted(enumerate(lines), key=lambda one: order[one[1].role]):
        if line.kind in ("vertical", "horizontal"):
            out.append(_rule(line, box, x, y, flags.get(k), rules))
        elif line.kind == "bars":
            out.append(_bars(line, box, x, y))
        else:
            text, lost = _marks(line, box, x, y)
            out.append(text)
            outside += lost
    empty = not any(np.isfinite(line.x).any() and np.isfinite(line.y).any() for line in lines)
    if empty:
        out.append(f'<text class="m" x="{_n(box.left + box.width / 2)}" y="{_n(box.top + box.height / 2)}">no values</text>')
    keys = [Key(line.name, line.colour, _mark(line)) for line in lines]
    cut = [f"{len(line.x):,} of {line.of:,} of {line.name}" for line in lines if line.of > len(line.x) + (line.kind == "bars")]
    words = [f"drawn: {'; '.join(cut)}"] if cut else []
    if outside:
        words.append(f"{outside:,} {'point lies' if outside == 1 else 'points lie'} outside the axes")
    title = tex.plain(plot.caption)
    svg = _svg(width, height, title, _about(plot, lines), "".join(out) + "".join(rules))
    data = {
        "kind": "plot", "x": x.data(plot.x), "y": y.data(plot.y), "height": height, "left": _n(box.left),
        "series": [_series(line, flags.get(k)) for k, line in enumerate(lines)],
    }  # fmt: skip
    return Drawn(svg, keys, {} if empty else data, "; ".join(words))


def _lines(series: Iterable[exhibit.Series], most: int) -> list[_Line]:
    counts = {role: itertools.count() for role in ("ours", "other", "paper", "bound")}
    out = []
    for one in series:
        x, y = (np.array([np.nan if v is None else v for v in values], dtype=float) for values in (one.x, one.y))
        text = [str(words) for words in one.text]
        of = max(len(x), len(y))
        if one.kind in ("vertical", "horizontal"):
            own, other = (x, y) if one.kind == "vertical" else (y, x)
            x = y = own if len(own) else other
        elif one.kind == "bars":
            x, y = x[: len(y) + 1], y[: max(len(x) - 1, 0)]
        else:
            size = min(len(x), len(y))
            x, y = x[:size], y[:size]
            if size > most:
                kept = _sample(x, y, most)
                x, y, text = x[kept], y[kept], [text[k] for k in kept if k < len(text)] if len(text) == size else []
        k = next(counts[one.role])
        if one.role == "ours":
            colour, square, again = _OURS[k % len(_OURS)], False, k // len(_OURS)
        elif one.role == "other":
            colour, square, again = _OTHERS[k % len(_OTHERS)], True, k // len(_OTHERS)
        else:
            colour, square, again = one.role, False, 2 * (k % 2) if one.kind != "points" else 0
        dash = _DASHES[k % len(_DASHES)] if one.role == "paper" else "dash" if again % 2 else "dot" if again else ""
        out.append(
            _Line(
                tex.plain(one.name),
                x,
                y,
                one.kind,
                one.role,
                colour,
                square,
                one.role == "paper" or bool(again),
                dash,
                text,
                of,
            )
        )
    return out


def _sample(x: Array, y: Array, most: int) -> Array:
    """Every k-th point, and those at the ends of both axes."""
    kept = set(np.linspace(0, len(x) - 1, max(most - 4, 1)).astype(int).tolist())
    for values in (x, y):
        if np.isfinite(values).any():
            kept |= {int(np.nanargmin(values)), int(np.nanargmax(values))}
    return np.array(sorted(kept))


def _reach(lines: Sequence[_Line], axis: str) -> Array:
    """All values on an axis."""
    across = "horizontal" if axis == "x" else "vertical"
    values = [getattr(line, axis) for line in lines if line.kind != across]
    return np.concatenate([np.empty(0), *values])


class _Box(NamedTuple):
    left: float
    top: float
    width: float
    height: float

    @property
    def right(self) -> float:
        return self.left + self.width

    @property
    def bottom(self) -> float:
        return self.top + self.height

    def across(self, share: Any) -> Array:
        return self.left + self.width * np.asarray(share, float)

    def up(self, share: Any) -> Array:
        return self.bottom - self.height * np.asarray(share, float)


class _Scale(NamedTuple):
    """From values to shares of a box.

    low, high : what the box shows; exponents of ten where `log`
    ticks : where labels stand (as low and high), and what they say
    lane : where on a logarithmic axis stands what has no logarithm; None where nothing needs it
    """

    low: float
    high: float
    log: bool
    ticks: tuple[tuple[float, str], ...]
    minor: tuple[float, ...] = ()
    lane: float | None = None

    @classmethod
    def of(cls, axis: exhibit.Axis, values: Array, most: int, *, zero: bool = False) -> _Scale:
        values = values[np.isfinite(values)]
        if axis.categories:
            last = max(len(axis.categories) - 1.0, float(values.max(initial=0.0)))
            ticks = tuple((float(k), _short(tex.plain(name), 28)) for k, name in enumerate(axis.categories))
            return cls(-0.5, last + 0.5, False, ticks)
        return cls._logarithmic(axis, values, most) if axis.log else cls._linear(axis, values, most, zero)

    @classmethod
    def _linear(cls, axis: exhibit.Axis, values: Array, most: int, zero: bool) -> _Scale:
        low, high = (float(values.min()), float(values.max())) if len(values) else (0.0, 1.0)
        low, high = (min(low, 0.0), max(high, 0.0)) if zero else (low, high)
        low = low if axis.low is None else axis.low
        high = high if axis.high is None else axis.high
        if not high - low > 1e-12 * max(abs(low), abs(high)):
            low, high = low - (0.5 * abs(low) or 0.5), high + (0.5 * abs(high) or 0.5)
        room = 0.04 * (high - low)
        low = low if axis.low is not None or (zero and low == 0) else low - room
        high = high if axis.high is not None else high + room
        step = _step((high - low) / most)
        first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
        return cls(low, high, False, tuple((step * k, _tick(step * k, step)) for k in range(first, last + 1)))

    @classmethod
    def _logarithmic(cls, axis: exhibit.Axis, values: Array, most: int) -> _Scale:
        known = values[values > 0]
        low, high = (math.log10(known.min()), math.log10(known.max())) if len(known) else (-1.0, 0.0)
        low, high = math.floor(low + 1e-9), math.ceil(high - 1e-9)
        low = math.log10(axis.low) if axis.low is not None and axis.low > 0 else low
        high = math.log10(axis.high) if axis.high is not None and axis.high > 0 else high
        if high - low < 1e-9:
            low, high = low - 1, high + 1
        first, last = math.ceil(low - 1e-9), math.floor(high + 1e-9)
        every = max(1, math.ceil((last - first + 1) / most))
        powers = [k for k in range(first, last + 1) if (last - k) % every == 0]
        plainly = -2 <= first and last <= 3
        ticks = [(float(k), _plainly(10.0**k) if plainly else _power(k)) for k in powers]
        minor: list[float] = []
        if high - low <= 6:
            minor = [k + math.log10(d) for k in range(first - 1, last + 1) for d in range(2, 10)]
        if last - first < 2:  # one decade or less: its 2 and its 5 are named as well
            ticks += [
                (k + math.log10(d), _plainly(d * 10.0**k) if plainly else f"{d}·{_power(k)}")
                for k in range(first - 1, last + 1) for d in (2, 5)
            ]  # fmt: skip
        lane = None
        if (values <= 0).any():
            lane = low - 0.07 * (high - low)
            ticks = [(lane, "≤ 0" if (values < 0).any() else "0"), *ticks]
            low = lane - 0.05 * (high - low)
        inside = [tick for tick in ticks if low - 1e-9 <= tick[0] <= high + 1e-9]
        floor = low if lane is None else lane + 0.05 * (high - low)
        return cls(low, high, True, tuple(sorted(inside)), tuple(v for v in minor if floor < v < high), lane)

    def level(self, values: Array) -> Array:
        """Values as `low` and `high` are; NaN where they have no place."""
        if not self.log:
            return np.asarray(values, float)
        with np.errstate(divide="ignore", invalid="ignore"):
            found = np.log10(values)
        return np.where(values <= 0, np.nan if self.lane is None else self.lane, found)

    def place(self, values: Array) -> Array:
        return (self.level(values) - self.low) / (self.high - self.low)

    def shares(self) -> list[tuple[float, str]]:
        return [((t - self.low) / (self.high - self.low), words) for t, words in self.ticks]

    def data(self, axis: exhibit.Axis) -> dict[str, Any]:
        return {
            "title": tex.plain(axis.title), "log": self.log, "range": [_rounded(self.low), _rounded(self.high)],
            "ticks": [[_rounded(t), words] for t, words in self.ticks] if self.log or axis.categories else None,
            "lane": None if self.lane is None else _rounded(self.lane), "names": [tex.plain(name) for name in axis.categories],
        }  # fmt: skip


def _frame(box: _Box, x: _Scale, y: _Scale, heading: list[str], below: list[str], turned: bool) -> str:
    grid = "".join(f"M{_n(box.left)} {_n(box.up(s))}h{_n(box.width)}" for s, _ in y.shares())
    grid += "".join(f"M{_n(box.across(s))} {_n(box.top)}v{_n(box.height)}" for s, _ in x.shares())
    out = [f'<path class="g" d="{grid}"/>']
    out.append(f'<path class="a" d="M{_n(box.left)} {_n(box.top)}v{_n(box.height)}h{_n(box.width)}"/>')
    ticks = "".join(f"M{_n(box.across(s))} {_n(box.bottom)}v4" for s, _ in x.shares())
    ticks += "".join(f"M{_n(box.left)} {_n(box.up(s))}h-4" for s, _ in y.shares())
    ticks += "".join(f"M{_n(box.across((v - x.low) / (x.high - x.low)))} {_n(box.bottom)}v2" for v in x.minor)
    ticks += "".join(f"M{_n(box.left)} {_n(box.up((v - y.low) / (y.high - y.low)))}h-2" for v in y.minor)
    if ticks:
        out.append(f'<path class="a" d="{ticks}"/>')
    longest = int((box.left - 12) / _LETTER) + 1
    out += [
        f'<text class="e" x="{_n(box.left - 7)}" y="{_n(box.up(s) + 3.6)}">{escape(_short(words, longest))}</text>'
        for s, words in y.shares()
    ]
    for s, words in x.shares():
        at, low = _n(box.across(s)), box.bottom + 16
        if turned:
            name = escape(_short(words, 22))
            out.append(f'<text class="e" transform="translate({at} {_n(low - 4)})rotate(-38)">{name}</text>')
        else:
            out.append(f'<text class="m" x="{at}" y="{_n(low)}">{escape(words)}</text>')
    if x.lane is not None:
        at = _n(box.across((x.lane - x.low) / (x.high - x.low) * 2))
        out.append(f'<path class="a dot" d="M{at} {_n(box.top)}v{_n(box.height)}"/>')
    if y.lane is not None:
        at = _n(box.up((y.lane - y.low) / (y.high - y.low) * 2))
        out.append(f'<path class="a dot" d="M{_n(box.left)} {at}h{_n(box.width)}"/>')
    out += [f'<text class="n" x="4" y="{12 + 14 * k}">{escape(words)}</text>' for k, words in enumerate(heading)]
    height = box.bottom + (12 if turned else 20)
    deep = min(84.0, 0.64 * _LETTER * max((len(w) for _, w in x.shares()), default=0)) if turned else 0
    for k, words in enumerate(below):
        out.append(f'<text class="n e" x="{_n(box.right)}" y="{_n(height + deep + 13 * (k + 1))}">{escape(words)}</text>')
    return "".join(out)


def _turned(x: _Scale, room: float) -> bool:
    """Whether the labels below would run into one another."""
    shares = x.shares()
    return len(shares) > 1 and any(
        0.5 * _LETTER * (len(one) + len(other)) + 4 > room * (b - a) for (a, one), (b, other) in itertools.pairwise(shares)
    )


def _marks(line: _Line, box: _Box, x: _Scale, y: _Scale) -> tuple[str, int]:
    """Points or a line, and how many points lie outside."""
    sx, sy = x.place(line.x), y.place(line.y)
    known = np.isfinite(sx) & np.isfinite(sy)
    edge = 1e-6
    inside = known & (sx >= -edge) & (sx <= 1 + edge) & (sy >= -edge) & (sy <= 1 + edge)
    outside = int((known & ~inside).sum())
    px, py = box.across(sx), box.up(sy)
    if line.kind == "line":
        far = 40 * max(box.width, box.height)
        px, py = np.clip(px, -far, far), np.clip(py, -far, far)
        paths = "".join(_path(*thinned(px[run], py[run], 0.15)) for run in _runs(known))
        kind = "x" if line.role == "bound" else "w"
        text = f'<path class="{line.colour} {kind} {line.dash}" d="{paths}"/>' if paths else ""
        if text and outside:  # cut off at the edge of the box
            text = (
                f'<svg x="{_n(box.left)}" y="{_n(box.top)}" width="{_n(box.width)}" height="{_n(box.height)}" '
                f'viewBox="{_n(box.left)} {_n(box.top)} {_n(box.width)} {_n(box.height)}">{text}</svg>'
            )
        return text, 0
    if not inside.any():
        return "", outside
    many = int(inside.sum()) > _MANY
    dots = _dots(px[inside], py[inside], 1.0 if many else 0.5)
    size = "p3" if many or line.role == "bound" else "p4" if inside.sum() > 60 else "p6"
    if line.role == "paper" and not many:
        return f'<path class="paper w" d="{_diamonds(px[inside], py[inside])}"/>', outside
    crowd = "" if not many else " many" if inside.sum() <= _MOST else " most"
    shape = f"{line.colour} {size}{' sq' if line.square else ''}{crowd}"
    text = f'<path class="{shape}" d="{dots}"/>'
    if line.hollow and not many:
        text += f'<path class="gap p{"3" if size != "p3" else "x"}{" sq" if line.square else ""}" d="{dots}"/>'
    return text, outside


def _bars(line: _Line, box: _Box, x: _Scale, y: _Scale) -> str:
    """A histogram: its outline, filled lightly, so that several are seen at once."""
    at = np.clip(np.nan_to_num(box.across(x.place(line.x)), nan=box.left), box.left, box.right)
    if y.log:
        tops = np.where(line.y > 0, y.place(line.y), 0.0)
        ground = box.bottom
    else:
        tops, ground = y.place(line.y), float(np.clip(box.up(y.place(np.zeros(1)))[0], box.top, box.bottom))
    up = np.clip(box.up(np.nan_to_num(tops)), box.top, box.bottom)
    if not len(line.y):
        return ""
    outline = f"M{_n(at[0])} {_n(ground)}" + "".join(f"V{_n(h)}H{_n(r)}" for h, r in zip(up, at[1:], strict=True))
    return (
        f'<path class="f {line.colour}" d="{outline}V{_n(ground)}z"/>'
        f'<path class="{line.colour} x {line.dash}" d="{outline}V{_n(ground)}"/>'
    )


class _Flag(NamedTuple):
    """The name of a vertical rule above the box: where the rule stands, whether the name lies to its left, and how high."""

    at: float
    name: str
    back: bool
    row: int = 0

    @property
    def span(self) -> tuple[float, float]:
        wide = _LETTER * len(self.name) + 6
        return (self.at - wide, self.at) if self.back else (self.at, self.at + wide)

    def over(self, at: float) -> bool:
        return self.span[0] < at < self.span[1]


def _flags(lines: Sequence[_Line], x: _Scale, left: float, width: float) -> dict[int, _Flag]:
    """The names of the vertical rules, so high that none lies on another or is crossed by a rule that has a higher one."""
    found: dict[int, _Flag] = {}
    for k, line in enumerate(lines):
        places = x.place(line.x) if line.kind == "vertical" else np.empty(0)
        places = places[(places >= -1e-9) & (places <= 1 + 1e-9)]
        if len(places) and line.name:
            at = left + width * float(places[0])
            found[k] = _Flag(at, _said(line), at + _LETTER * len(_said(line)) > left + width)
    placed: dict[int, _Flag] = {}
    # names to the right from the right, then names to the left from the left: each lies over rules that have their row
    for k, flag in sorted(found.items(), key=lambda one: (one[1].back, one[1].at if one[1].back else -one[1].at)):
        taken = [other.row for other in placed.values() if flag.span[0] < other.span[1] and other.span[0] < flag.span[1]]
        least = max((other.row + 1 for other in placed.values() if flag.over(other.at)), default=0)
        placed[k] = flag._replace(row=next(row for row in itertools.count(least) if row not in taken))
    return placed


def _said(line: _Line) -> str:
    """The name of a rule, with whose it is."""
    return _short(line.name if line.role != "paper" or "paper" in line.name.lower() else f"{line.name} (paper)".strip(), 40)


def _rule(line: _Line, box: _Box, x: _Scale, y: _Scale, flag: _Flag | None, said: list[str]) -> str:
    """Lines across the box at some values, with their name at the first of them; the names go to `said`."""
    upright = line.kind == "vertical"
    places = (x if upright else y).place(line.x)
    places = places[np.isfinite(places) & (places >= -1e-9) & (places <= 1 + 1e-9)]
    if not len(places):
        return ""
    if flag is not None:
        top = box.top - _ROW * flag.row
        at = flag.at + (-4 if flag.back else 4)
        kind = f"halo {line.colour}{' e' if flag.back else ''}"
        said.append(f'<text class="{kind}" x="{_n(at)}" y="{_n(top - 3)}">{escape(flag.name)}</text>')
        first = f"M{_n(flag.at)} {_n(top - _ROW + 3)}V{_n(box.bottom)}"
        paths = first + "".join(f"M{_n(at)} {_n(box.top)}v{_n(box.height)}" for at in box.across(places[1:]))
    elif upright:
        paths = "".join(f"M{_n(at)} {_n(box.top)}v{_n(box.height)}" for at in box.across(places))
    else:
        low = max(float(box.up(places[0])) - 5, box.top + 9)
        said.append(f'<text class="halo {line.colour} e" x="{_n(box.right - 4)}" y="{_n(low)}">{escape(_said(line))}</text>')
        paths = "".join(f"M{_n(box.left)} {_n(at)}h{_n(box.width)}" for at in box.up(places))
    return f'<path class="{line.colour} {"x" if line.role == "bound" else "w"} {line.dash}" d="{paths}"/>'


def _mark(line: _Line) -> str:
    """The mark of a series, 26 by 10 pixels, for a legend."""
    if line.kind == "bars":
        inside = f'<path class="{line.colour}" stroke-width="8" stroke-opacity=".35" stroke-linecap="butt" d="M3 5h20"/>'
    elif line.kind == "points" and line.role == "paper":
        inside = '<path class="paper" stroke-width="1.5" d="M13 1l4 4-4 4-4-4z"/>'
    elif line.kind == "points":
        cap = "square" if line.square else "round"
        size = 5 if line.role == "bound" else 7
        inside = f'<path class="{line.colour}" stroke-width="{size}" style="stroke-linecap:{cap}" d="M13 5h0"/>'
        if line.hollow:
            inside += f'<path class="gap" stroke-width="3.5" style="stroke-linecap:{cap}" d="M13 5h0"/>'
    else:
        dash = f' stroke-dasharray="{_STROKES[line.dash]}"' if line.dash else ""
        thin = 1.2 if line.role == "bound" else 2
        inside = f'<path class="{line.colour}" stroke-width="{thin}"{dash} style="stroke-linecap:butt" d="M1 5h24"/>'
    return f'<svg class="key" viewBox="0 0 26 10" width="26" height="10" aria-hidden="true">{inside}</svg>'


def _about(plot: exhibit.Plot, lines: Sequence[_Line]) -> str:
    """What a reader who does not see the drawing is told."""
    sides = [f"{tex.plain(axis.title)}{' (logarithmic)' if axis.log else ''}" for axis in (plot.x, plot.y)]
    told = []
    for line in lines:
        if line.kind in ("vertical", "horizontal"):
            known = line.x[np.isfinite(line.x)]
            told.append(f"{line.name}: {', '.join(page.number(v, 3) for v in known[:6])}{' …' if len(known) > 6 else ''}")
            continue
        known = line.y[np.isfinite(line.y)]
        what = {"points": "point", "line": "point of a line", "bars": "bar"}[line.kind]
        size = page.plural(len(known), what, {"line": "points of a line"}.get(line.kind))
        span = f", from {page.number(known.min(), 3)} to {page.number(known.max(), 3)}" if len(known) else ""
        told.append(f"{line.name}: {size}{span}")
    return f"{sides[1]} over {sides[0]}. {'; '.join(told) or 'No series'}."


def _series(line: _Line, flag: _Flag | None) -> dict[str, Any]:
    out: dict[str, Any] = {
        "name": line.name,
        "kind": line.kind,
        "role": line.role,
        "square": line.square,
        "dash": _STROKES.get(line.dash, ""),
    }
    out |= {"hollow": line.hollow, "x": [_rounded(v) for v in line.x], "y": [_rounded(v) for v in line.y]}
    out |= {"text": [tex.plain(words) for words in line.text]} if line.text else {}
    return out | ({"row": flag.row, "back": flag.back} if flag else {})


# ---- heat maps --------------------------------------------------------------------------------------------------------------


def _heat(heat: exhibit.Heat, width: float) -> Drawn:
    values = [[math.nan if v is None else float(v) for v in row] for row in heat.values]
    columns, rows = [tex.plain(name) for name in heat.columns], [tex.plain(name) for name in heat.rows]
    grid = np.full((len(rows), len(columns)), math.nan)
    for i, row in enumerate(values[: len(rows)]):
        grid[i, : len(row)] = row[: len(columns)]
    words = [[_cell(heat, grid, i, j) for j in range(len(columns))] for i in range(len(rows))]
    score = _scores(grid, heat.middle)
    named, across = tex.plain(heat.y), tex.plain(heat.x)
    left = 12 + min(0.4 * width, max([24, *(_LETTER * len(name) for name in rows)]))
    each = (width - left - 8) / max(1, len(columns))
    turned = any(_LETTER * len(name) + 4 > each for name in columns)
    deep = min(90.0, 0.64 * _LETTER * min(22, max((len(name) for name in columns), default=0))) if turned else 4.0
    room = max(0, int((each - 4) / (0.95 * _LETTER)))
    fitting = [[_fitted(word, room) for word in row] for row in words]
    least = 34.0 if any(len(lines) > 1 for row in fitting for lines in row) else 16.0
    tall = max(least, min(30.0, 420 / max(1, len(rows))))
    box = _Box(left, 22.0, width - left - 8, tall * max(1, len(rows)))
    height = box.bottom + 18 + deep + 18
    out = [f'<text class="n" x="4" y="12">{escape(named)}</text>']
    for i, name in enumerate(rows):
        short = escape(_short(name, int((left - 12) / _LETTER) + 1))
        out.append(f'<text class="e" x="{_n(left - 7)}" y="{_n(box.top + tall * (i + 0.5) + 3.8)}">{short}</text>')
    small = any(len(word) * _LETTER > each - 4 for row in words for word in row)
    for i in range(len(rows)):
        for j in range(len(columns)):
            x, y = box.left + each * j, box.top + tall * i
            if math.isfinite(score[i, j]):
                size = f'width="{_n(each - 1)}" height="{_n(tall - 1)}" rx="2"'
                shade = round(_STEPS * (score[i, j] + 1))
                out.append(f'<rect class="t{shade}" x="{_n(x + 0.5)}" y="{_n(y + 0.5)}" {size}/>')
            for k, line in enumerate(fitting[i][j]):
                kind = "m n small" if small else "n m"
                low = y + tall / 2 + 3.8 + 12 * (k - 0.5 * (len(fitting[i][j]) - 1))
                out.append(f'<text class="{kind}" x="{_n(x + each / 2)}" y="{_n(low)}">{escape(line)}</text>')
    every = max(1, math.ceil(13 / each))
    for j, name in list(enumerate(columns))[::every]:
        at = _n(box.left + each * (j + 0.5))
        if turned:
            short = escape(_short(name, 22))
            out.append(f'<text class="e" transform="translate({at} {_n(box.bottom + 12)})rotate(-38)">{short}</text>')
        else:
            out.append(f'<text class="m" x="{at}" y="{_n(box.bottom + 15)}">{escape(name)}</text>')
    out.append(f'<text class="n e" x="{_n(box.right)}" y="{_n(height - 6)}">{escape(across)}</text>')
    known = grid[np.isfinite(grid)]
    about = f"{page.plural(len(rows), 'row')} ({named}) by {page.plural(len(columns), 'column')} ({across})"
    if len(known):
        about += f"; values from {page.number(known.min(), 3)} to {page.number(known.max(), 3)}"
        about += f", coloured apart at {page.number(heat.middle, 3)}"
    data = {
        "kind": "heat", "x": across, "y": named, "columns": columns, "rows": rows, "words": words, "height": round(height),
        "lines": fitting,
        "score": [[_rounded(v) for v in row] for row in score], "left": _n(left),
        "values": [[page.number(v, 3) for v in row] for row in grid.tolist()],
    }  # fmt: skip
    svg = _svg(width, height, tex.plain(heat.caption), about + ".", "".join(out))
    return Drawn(svg, [], data if len(known) else {}, "")


def _cell(heat: exhibit.Heat, grid: Array, i: int, j: int) -> str:
    if i < len(heat.words) and j < len(heat.words[i]):
        return tex.plain(str(heat.words[i][j] if heat.words[i][j] is not None else ""))
    return page.number(grid[i, j])


def _fitted(words: str, room: int) -> list[str]:
    """Words in at most two lines of `room` letters; none where there is room for next to nothing."""
    if len(words) <= room:
        return [words] if words else []
    return textwrap.wrap(words, room, max_lines=2, placeholder="…") if room > 3 else []


def _scores(grid: Array, middle: float) -> Array:
    """Values as −1, ..., 1 about the middle: by their ratio to it where all are positive, else by their difference."""
    known = grid[np.isfinite(grid)]
    if not len(known):
        return grid
    away = np.log(grid / middle) if middle > 0 and known.min() > 0 else grid - middle
    most = float(np.nanmax(np.abs(away)))
    return away / most if most > 0 else np.where(np.isfinite(grid), 0.0, np.nan)


# ---- text of a drawing ------------------------------------------------------------------------------------------------------


def _svg(width: float, height: float, title: str, about: str, inside: str) -> str:
    size = f'viewBox="0 0 {_n(width)} {_n(height)}" width="{_n(width)}" height="{_n(height)}"'
    return f'<svg class="drawing" {size} role="img"><title>{escape(title)}</title><desc>{escape(about)}</desc>{inside}</svg>'


def _dots(x: Array, y: Array, grain: float) -> str:
    """Points rounded to `grain` pixels, each place once: round caps make them dots."""
    places = np.unique(np.round(np.column_stack([x, y]) / grain).astype(int), axis=0)
    steps = np.diff(places, axis=0)
    start = f"M{_n(places[0, 0] * grain)} {_n(places[0, 1] * grain)}h0"
    return start + "".join(f"m{_n(a * grain)} {_n(b * grain)}h0".replace(" -", "-") for a, b in steps)


def _diamonds(x: Array, y: Array) -> str:
    return "".join(f"M{_n(a)} {_n(b - 4)}l4 4-4 4-4-4z" for a, b in zip(x, y, strict=True))


def _path(x: Array, y: Array) -> str:
    """A polyline in tenths of a pixel, each point by its distance from the one before."""
    tenths = np.round(10 * np.column_stack([x, y])).astype(int)
    steps = np.diff(tenths, axis=0)
    steps = steps[(steps != 0).any(axis=1)] if len(steps) else steps
    start = f"M{_n(tenths[0, 0] / 10)} {_n(tenths[0, 1] / 10)}"
    return start + ("l" + " ".join(f"{_n(a / 10)} {_n(b / 10)}" for a, b in steps) if len(steps) else "h0")


def _runs(mask: Array) -> list[Array]:
    """Indices of each unbroken stretch of true."""
    found = np.flatnonzero(mask)
    return np.split(found, np.flatnonzero(np.diff(found) > 1) + 1) if len(found) else []


def _n(value: Any) -> str:
    """A coordinate to a tenth of a pixel, as short as it can be."""
    text = f"{float(value):.1f}"
    text = text[:-2] if text.endswith(".0") else text
    return "0" if text in ("-0", "") else text.replace("0.", ".", 1) if text.startswith(("0.", "-0.")) else text


def _rounded(value: float) -> float | int | None:
    """A number for the script: five digits, None where it is not finite."""
    if not math.isfinite(value):
        return None
    short = float(f"{value:.5g}")
    return int(short) if short.is_integer() and abs(short) < 1e15 else short


def _step(value: float) -> float:
    """The least of 1, 2, 5 times a power of ten that is not below."""
    power = 10.0 ** math.floor(math.log10(value))
    return power * min(step for step in (1, 2, 5, 10) if step * power >= value * (1 - 1e-9))


def _tick(value: float, step: float) -> str:
    """A label with the digits that its step has."""
    if value == 0 or abs(value) < 1e-9 * step:
        return "0"
    size = max(abs(value), step)
    if 1e-3 <= size < 1e6 and step >= 1e-4:
        return f"{value:,.{max(0, -math.floor(math.log10(step) + 1e-9))}f}".replace("-", "−")
    return page.number(value, max(2, 1 + math.floor(math.log10(size) + 1e-9) - math.floor(math.log10(step) + 1e-9)))


def _plainly(value: float) -> str:
    return f"{value:,.10g}"


def _power(k: int) -> str:
    return "10" + str(k).translate(str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻"))


def _short(words: str, most: int) -> str:
    return words if len(words) <= most else words[: max(1, most - 1)].rstrip() + "…"
