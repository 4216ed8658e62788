"""Drawings as SVG text: an arm in motion, curves over time, drift by cycle. No script, both colour schemes, ready for print.

Arrays in, text out; lengths in metres, angles in radians. A drawing names its colours by class: `style()` is their style
sheet, in a page once for all drawings, in a file of its own inside the drawing (`standalone`).
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from html import escape
from typing import Any, NamedTuple

import numpy as np

Array = np.ndarray

_COLOURS: dict[str, tuple[str, str]] = {
    "ink": ("#1d1f23", "#e9e7e2"), "muted": ("#5b5e66", "#a7aab2"), "line": ("#e2dfd8", "#2f3238"),
    "rule": ("#8b8f98", "#767b85"), "paper": ("#fcfbf9", "#141518"), "start": ("#c2500a", "#ff9a5c"),
    "bad": ("#b3261a", "#ff9583"),
    # lightness alone orders them, so that they do for every eye and on grey paper
    "s0": ("#9fc6da", "#33586f"), "s1": ("#86b6d0", "#396a86"), "s2": ("#6ca5c5", "#417d9c"), "s3": ("#5190b8", "#4b91b2"),
    "s4": ("#397aa7", "#5ea6c7"), "s5": ("#246190", "#7abbda"), "s6": ("#154976", "#9cd1e8"), "s7": ("#0b3058", "#c6e6f4"),
    # told apart with every kind of colour blindness (after Okabe and Ito), 3 : 1 and more against the paper
    "c0": ("#1f6fb0", "#6db5ea"), "c1": ("#c2500a", "#ff9a5c"), "c2": ("#0b7a5b", "#4ec9a4"), "c3": ("#9b4a98", "#d795d2"),
    "c4": ("#8a6400", "#f0c35c"), "c5": ("#0f7684", "#7fd8e0"), "c6": ("#5b5e66", "#b5b8bf"), "c7": ("#73482a", "#cba27e"),
}  # fmt: skip
"""Class -> colour on light and on dark paper."""

_SHAPES = """
.drawing{font:11px system-ui,-apple-system,"Segoe UI",Roboto,"Helvetica Neue","Liberation Sans",Arial,sans-serif}
.drawing text{font-variant-numeric:tabular-nums}
.drawing path{fill:none;stroke-linejoin:round;stroke-linecap:round}
.drawing text.h{font-weight:600;font-size:13px}
.drawing .e{text-anchor:end}.drawing .m{text-anchor:middle}
.drawing path.w{stroke-width:1.5}
.drawing path.k{stroke-width:2.2}
.drawing path.l{stroke-width:3.8}
.drawing path.j{stroke-width:6.5}
.drawing path.d{stroke-width:7}
.drawing path.i{stroke-width:2.5}
"""

_MOST = 200
"""Points of a curve at most: more than a small drawing shows."""

_FINE = 0.2
"""Pixels by which a thinned curve may leave its points: below what is seen."""

_SMOOTH = 0.05
"""The same for the path of a hand, which is drawn large: a circle stays round."""

FLOOR = 1e-17
"""Bottom of a logarithmic axis: below rounding of numbers of order one there is nothing to see."""

FLAT = 1e-3
"""Radians up to which the axis of a drift always reaches: a drift far below it is drawn as none."""

STEPS = 8
"""Shades in which a sequence of arms is drawn."""

_BOLD, _PLAIN = 7.7, 6.3
"""Pixels of a letter of a heading and of other text, on average, in the widest of the fonts."""

_NARROW = 120.0
"""Pixels of a panel at least: many panels make a wider figure."""


class Cycles(NamedTuple):
    """One panel of `drift_figure`.

    arm : (c + 1, points, 3) base, joints and hand at the start and after each of c cycles [m]
    hand : (T, 3) what the hand drew [m]
    drift : (c,) distance of the joints from their start after each cycle [rad]
    """

    title: str
    note: str
    arm: Array
    hand: Array
    drift: Array


class Curve(NamedTuple):
    """A named curve: y (T,), NaN where it has no value; `place` picks its colour."""

    name: str
    y: Array
    place: int = 0


def style(scheme: str = "page") -> str:
    """The style sheet of all drawings: "page" follows `color-scheme`, "file" the reader's own wish."""
    if scheme == "page":
        return _SHAPES + _coloured({name: f"light-dark({light},{dark})" for name, (light, dark) in _COLOURS.items()})
    light, dark = ({name: pair[k] for name, pair in _COLOURS.items()} for k in (0, 1))
    return f"{_SHAPES}{_coloured(light)}@media(prefers-color-scheme:dark){{{_coloured(dark)}}}"


def _coloured(colour: dict[str, str]) -> str:
    rules = [
        f".drawing text{{fill:{colour['muted']}}}.drawing text.h,.drawing text.n{{fill:{colour['ink']}}}",
        f".drawing .g{{stroke:{colour['line']}}}.drawing .a{{stroke:{colour['rule']}}}.drawing .p{{stroke:{colour['ink']}}}",
        f".drawing .b{{stroke:{colour['rule']}}}.drawing .o{{stroke:{colour['paper']}}}",
        f".drawing rect.paper{{fill:{colour['paper']}}}",
    ]
    for name in ("start", "bad", *(f"{kind}{k}" for kind in "sc" for k in range(8))):
        rules.append(f".drawing path.{name}{{stroke:{colour[name]}}}.drawing text.{name}{{fill:{colour[name]}}}")
    return "\n".join(rules) + "\n"


def standalone(svg: str) -> str:
    """A drawing as a file of its own, on its own paper: light or dark as the reader wishes, in a browser or on a page."""
    head, body = svg.split(">", 1)
    width, height = (float(x) for x in head.split('viewBox="')[1].split('"')[0].split()[2:])
    paper = f'<rect class="paper" width="{width:g}" height="{height:g}"/>'
    about, rest = body.split("</desc>", 1)
    namespace = 'xmlns="http://www.w3.org/2000/svg"'
    return f"{head} {namespace}>{about}</desc>\n<style>{style('file')}</style>\n{paper}{rest}\n"


# ---- the three drawings ----------------------------------------------------------------------------------------------------


def stroboscope(
    arm: Array, hand: Array | None = None, *, title: str, about: str, width: float = 220, height: float = 230
) -> str:
    """An arm at some instants, light to dark in time, the first in another colour; the path of its hand above.

    arm : (frames, points, 3) base, joints and hand [m]; a planar arm is drawn in its plane, another as seen from where
        the path of the hand is widest
    hand : (T, 3) [m]
    """
    arm, hand = _finite(arm), _finite(hand)
    view = _View.of(arm, hand)
    room = (width - 16, height - (30 if view.planar else 44))
    scale = view.fit(*room)
    inside = _arm(view, scale, arm, hand, (8.0, 6.0), room) + _measure(view, scale, 8, height - 10)
    return _svg(width, height, title, about, inside + ("" if view.planar else _triad(view, width - 26, height - 20)))


def curves(
    x: Array, lines: Sequence[Curve], *, title: str, about: str, heading: str = "", unit: str = "", across: str = "t [s]",
    log: bool = False, width: float = 290, height: float = 150,
) -> str:  # fmt: skip
    """Curves over x (T,), each named at its end; a gap where a value is not finite.

    On a logarithmic axis what is not positive is marked along the bottom instead.
    """
    x = np.asarray(x, float)
    longest = max((len(line.name) for line in lines), default=0)
    box = _Box(44.0, 22.0, width - 44 - (max(28.0, 8 + _PLAIN * longest) if longest else 8), height - 22 - 30)
    values = np.concatenate([np.asarray(line.y, float) for line in lines]) if lines else np.empty(0)
    most = max(2, int(box.height // 20))
    axis = _Axis.logarithmic(values, most) if log else _Axis.linear(values, most=min(most, 5))
    along = _Axis.linear(x, tight=True)
    out = [_frame(box, axis, along, heading, unit, across)]
    ends: list[tuple[float, int, str]] = []
    for line in lines:
        y = np.asarray(line.y, float)
        shown = np.isfinite(x) & np.isfinite(y) & ((y > 0) | (not log))
        for run in _runs(shown):
            px, py = box.across(along.place(x[run])), box.up(axis.place(y[run]))
            out.append(f'<path class="c{line.place % 8} w" d="{_path(*thinned(px, py))}"/>')
        if log:
            for run in _runs(np.isfinite(x) & np.isfinite(y) & (y <= 0)):
                left, right = box.across(along.place(x[run[[0, -1]]]))
                out.append(f'<path class="bad k" d="M{_n(left)} {_n(box.bottom)}h{_n(max(right - left, 0.1))}"/>')
                out.append(f'<text class="bad e" x="{_n(max(right, left + 20))}" y="{_n(box.bottom - 5)}">≤ 0</text>')
        if line.name and shown.any():
            ends.append((float(box.up(axis.place(y[shown][-1:]))[0]), line.place % 8, line.name))
    out += [
        f'<text class="c{place}" x="{_n(box.right + 5)}" y="{_n(y + 3.5)}">{escape(name)}</text>'
        for y, (_, place, name) in zip(_apart([end[0] for end in ends], box.top, box.bottom), ends, strict=True)
    ]
    return _svg(width, height, title, about, "".join(out))


def drift(
    values: Array, *, title: str, about: str, heading: str = "", unit: str = "rad", width: float = 180, height: float = 150
) -> str:
    """Distance of the joints from their start after each cycle, (c,) [rad], 0 at the start."""
    values = np.asarray(values, float)
    box = _Box(38.0, 22.0, width - 48, height - 22 - 30)
    inside = _drift(box, values, _drift_axis([values]), heading, unit, "after cycle", len(values))
    return _svg(width, height, title, about, inside)


def drift_figure(motions: Sequence[Cycles], *, title: str = "", about: str = "", width: float = 880) -> str:
    """The same closed path, some cycles, several methods side by side: where the joints are each time the hand is back.

    All panels share one scale, and one axis of drift; the dots of the drift bear the colours of the arms above them. A title
    that does not fit in two lines loses what it has in brackets at its end, and then its end.
    """
    margin, gap, first = 16.0, 20.0, 34.0
    count = max(1, len(motions))
    width = max(width, 2 * margin + first + count * _NARROW + (count - 1) * gap)
    each = (width - 2 * margin - first - (count - 1) * gap) / count
    arms, hands = [_finite(motion.arm) for motion in motions], [_finite(motion.hand) for motion in motions]
    view = _View.of(
        np.concatenate([np.empty((0, 3)), *(arm.reshape(-1, 3) for arm in arms)]), np.concatenate([np.empty((0, 3)), *hands])
    )
    tall = min(max(each * view.height / view.width, 0.5 * each), 1.15 * each)
    scale = view.fit(each, tall)
    axis = _drift_axis([np.asarray(motion.drift, float) for motion in motions])
    titles = [_titled(motion.title, each / _BOLD) for motion in motions]
    notes = [_lines(motion.note, each / _PLAIN) for motion in motions]
    below = 22 + 16 * max((len(lines) for lines in titles), default=0)  # the notes stand on one line
    top = below + 14.0 * max((len(lines) for lines in notes), default=0)
    low = 78.0
    cycles = max((len(motion.drift) for motion in motions), default=0)
    height = top + tall + 50 + low + 56
    out = []
    for k, (motion, arm, hand) in enumerate(zip(motions, arms, hands, strict=True)):
        left = margin + first + k * (each + gap)
        out += [f'<text class="h" x="{_n(left)}" y="{22 + 16 * j}">{escape(one)}</text>' for j, one in enumerate(titles[k])]
        out += [f'<text x="{_n(left)}" y="{below + 14 * j}">{escape(one)}</text>' for j, one in enumerate(notes[k])]
        out.append(_arm(view, scale, arm, hand, (left, top), (each, tall)))
        box = _Box(left, top + tall + 50, each, low)
        heading = "drift of the joints" if k == 0 else ""
        values = np.asarray(motion.drift, float)
        out.append(_drift(box, values, axis, heading, "rad", "after cycle", cycles, labelled=k == 0, indent=0))
    out.append(_measure(view, scale, margin + first, top + tall + 14))  # below the ground that a base stands on
    out.append(_legend(margin + first, height - 10, cycles))
    words = title or "Drift of the joints over cycles of one closed path"
    told = [(motion.title, np.asarray(motion.drift, float)) for motion in motions if len(motion.drift)]
    said = "; ".join(f"{name}: {_number(float(d[-1]))} rad after {len(d)} cycles" for name, d in told)
    return _svg(width, height, words, about or said or words, "".join(out))


# ---- parts ------------------------------------------------------------------------------------------------------------------


class _View(NamedTuple):
    """An orthographic view: page (2,) = basis (2, 3) times metres, between `low` (2,) and `high` (2,)."""

    basis: Array
    low: Array
    high: Array
    planar: bool

    @classmethod
    def of(cls, arm: Array, hand: Array) -> _View:
        points = np.concatenate([arm.reshape(-1, 3), hand])
        if not len(points):
            return cls(np.eye(2, 3), np.zeros(2), np.ones(2), True)
        spans = np.ptp(points, axis=0)
        planar = bool(spans.min() <= 1e-9 * max(spans.max(), 1e-300))
        flat_axis = 2 - int(np.argmin(spans[::-1]))  # z where several are
        basis = np.delete(np.eye(3), flat_axis, axis=0) if planar else _oblique(points, hand)
        flat = points @ basis.T
        low, high = flat.min(axis=0), flat.max(axis=0)
        room = 0.04 * max(float((high - low).max()), 1e-9)
        return cls(basis, low - room, high + room, planar)

    @property
    def width(self) -> float:
        return float(self.high[0] - self.low[0])

    @property
    def height(self) -> float:
        return float(self.high[1] - self.low[1])

    def fit(self, width: float, height: float) -> float:
        """Pixels a metre at which all of it fits."""
        return min(width / self.width, height / self.height)


def _oblique(points: Array, hand: Array) -> Array:
    """From a little above, all around: where the path of the hand looks widest, and the arm most spread."""
    tilt = math.radians(20)
    best, most = np.eye(2, 3), -1.0
    for turn in np.radians(np.arange(-180, 180, 15) + 5.0):
        right = np.array([-math.sin(turn), math.cos(turn), 0.0])
        up = np.array([-math.sin(tilt) * math.cos(turn), -math.sin(tilt) * math.sin(turn), math.cos(tilt)])
        basis = np.array([right, up])
        spread = np.cov((points @ basis.T).T)
        area = math.sqrt(max(np.linalg.det(np.cov((hand @ basis.T).T)), 0.0)) if len(hand) > 2 else 0.0
        worth = area + 0.1 * math.sqrt(max(spread[0, 0], 0.0))
        if worth > most * (1 + 1e-9):
            best, most = basis, worth
    return best


def _arm(view: _View, scale: float, arm: Array, hand: Array, corner: tuple[float, float], room: tuple[float, float]) -> str:
    """Arms and the path of the hand inside a box of `room`, centred."""
    left = corner[0] + (room[0] - scale * view.width) / 2
    bottom = corner[1] + room[1] - (room[1] - scale * view.height) / 2

    def placed(points: Array) -> tuple[Array, Array]:
        flat = points @ view.basis.T
        return left + scale * (flat[..., 0] - view.low[0]), bottom - scale * (flat[..., 1] - view.low[1])

    out = []
    if len(arm):
        x, y = placed(arm)
        out.append(_base(float(x[0, 0]), float(y[0, 0]), view.planar))
        for k in (*range(1, len(arm)), 0):  # the start above the others: it is what they are compared with
            name = "start" if k == 0 else f"s{_shade(k, len(arm))}"
            whole = k in (0, len(arm) - 1)
            # the last is drawn wider, to be seen behind the start where the arm has come back
            wide = "l" if k == len(arm) - 1 > 0 else "k" if whole else "w"
            out.append(f'<path class="{name} {wide}" d="{_path(x[k], y[k])}"/>')
            if whole:
                out += [f'<path class="{part}" d="{_dots(x[k], y[k])}"/>' for part in (f"{name} j", "o i")]
    if len(hand):
        out.append(f'<path class="p" d="{_path(*thinned(*placed(hand), _SMOOTH))}"/>')
    return "".join(out)


def _shade(k: int, count: int) -> int:
    """The shade of the k-th of `count` in a sequence whose first is the start."""
    return STEPS - 1 if count <= 2 else round((k - 1) / (count - 2) * (STEPS - 1))


def _base(x: float, y: float, planar: bool) -> str:
    if planar:
        return f'<path class="b w" d="M{_n(x)} {_n(y)}l-6 9h12zm-10 9h20"/>'
    return f'<path class="b w" d="M{_n(x - 9)} {_n(y + 2)}a9 3.5 0 1 0 18 0a9 3.5 0 1 0 -18 0"/>'


def _measure(view: _View, scale: float, x: float, y: float) -> str:
    """A bar of a round length."""
    length = _round_down(0.3 * max(view.width, 1e-9))
    return (
        f'<path class="a" d="M{_n(x)} {_n(y - 3)}v3h{_n(scale * length)}v-3"/>'
        f'<text x="{_n(x + scale * length + 5)}" y="{_n(y + 2)}">{_number(length)} m</text>'
    )


def _legend(x: float, y: float, cycles: int) -> str:
    """One line that says what is drawn: arms and dots at the start and after each cycle, and the path of the hand."""
    shades = [f"s{shade}" for shade in dict.fromkeys(_shade(k, cycles + 1) for k in range(1, cycles + 1))]
    out = []
    for words, names in (("joints at the start", ["start"]), ("after each cycle", shades)):
        for name in names:
            out.append(f'<path class="d {name}" d="M{_n(x + 4)} {_n(y - 3.8)}h0"/>')
            x += 9
        out.append(f'<text x="{_n(x + 4)}" y="{_n(y)}">{words}</text>')
        x += 18 + _PLAIN * len(words)
    out.append(f'<path class="p" d="M{_n(x)} {_n(y - 3.8)}h14"/><text x="{_n(x + 19)}" y="{_n(y)}">path of the hand</text>')
    return "".join(out)


def _triad(view: _View, x: float, y: float) -> str:
    """Which way the axes of the base point."""
    out = []
    for k, name in enumerate("xyz"):
        step = 12 * view.basis[:, k]
        if np.linalg.norm(step) < 3:
            continue
        out.append(f'<path class="a" d="M{_n(x)} {_n(y)}l{_n(step[0])} {_n(-step[1])}"/>')
        out.append(f'<text class="m" x="{_n(x + 1.5 * step[0])}" y="{_n(y - 1.5 * step[1] + 3)}">{name}</text>')
    return "".join(out)


class _Box(NamedTuple):
    """Where a chart stands."""

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
        return self.left + self.width * np.asarray(share)

    def up(self, share: Any) -> Array:
        return self.bottom - self.height * np.asarray(share)


class _Axis(NamedTuple):
    """From values to shares of a box, with the values that bear a label."""

    low: float
    high: float
    log: bool
    ticks: tuple[float, ...]

    @classmethod
    def linear(cls, values: Array, *, tight: bool = False, zero: bool = False, most: int = 4) -> _Axis:
        known = values[np.isfinite(values)]
        low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)
        low = min(low, 0.0) if zero else low
        if high - low < 1e-12 * max(abs(low), abs(high), 1e-290):
            low, high = low - (0.5 * abs(low) or 0.5), high + (0.5 * abs(high) or 0.5)
        step = _step((high - low) / most)
        if not tight:
            low, high = step * math.floor(low / step + 1e-9), step * math.ceil(high / step - 1e-9)
        first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
        return cls(low, high, False, tuple(step * k for k in range(first, last + 1)))

    @classmethod
    def logarithmic(cls, values: Array, most: int = 5) -> _Axis:
        known = values[np.isfinite(values) & (values > 0)]
        low, high = (max(float(known.min()), FLOOR), max(float(known.max()), FLOOR)) if len(known) else (0.1, 1.0)
        bottom, top = math.floor(math.log10(low) + 1e-9), math.ceil(math.log10(high) - 1e-9)
        if top <= bottom:
            bottom, top = bottom - 1, bottom + 1
        every = max(1, math.ceil((top - bottom) / (most - 1)))
        return cls(float(bottom), float(top), True, tuple(float(k) for k in range(bottom, top + 1) if (top - k) % every == 0))

    def place(self, values: Array) -> Array:
        held = np.log10(np.maximum(values, FLOOR)) if self.log else np.asarray(values, float)
        return (held - self.low) / (self.high - self.low)

    def shares(self) -> list[tuple[float, str]]:
        """Where the labels stand, and what they say."""
        said = [f"1e{t:.0f}".replace("-", "−") if self.log else _number(t) for t in self.ticks]
        return [((t - self.low) / (self.high - self.low), words) for t, words in zip(self.ticks, said, strict=True)]


def _frame(
    box: _Box, axis: _Axis, along: _Axis, heading: str, unit: str, across: str, *, labelled: bool = True, indent: float = -34
) -> str:
    """Grid, axes, labels; the heading stands above the axis it explains, `indent` from its line."""
    grid = "".join(f"M{_n(box.left)} {_n(box.up(share))}h{_n(box.width)}" for share, _ in axis.shares())
    out = [f'<path class="g" d="{grid}"/>', f'<path class="a" d="M{_n(box.left)} {_n(box.bottom)}h{_n(box.width)}"/>']
    if labelled:
        x = _n(box.left - 5)
        out += [f'<text class="e" x="{x}" y="{_n(box.up(share) + 3.5)}">{words}</text>' for share, words in axis.shares()]
    for share, words in along.shares():
        x = _n(box.across(share))
        out.append(f'<path class="a" d="M{x} {_n(box.bottom)}v3"/>')
        out.append(f'<text class="m" x="{x}" y="{_n(box.bottom + 14)}">{words}</text>')
    out.append(f'<text class="e" x="{_n(box.right)}" y="{_n(box.bottom + 27)}">{escape(across)}</text>')
    if heading:
        of = f" [{escape(unit)}]" if unit else ""
        out.append(f'<text class="n" x="{_n(box.left + indent)}" y="{_n(box.top - 9)}">{escape(heading)}{of}</text>')
    return "".join(out)


def _drift_axis(values: Sequence[Array]) -> _Axis:
    return _Axis.linear(np.concatenate([np.array([0.0, FLAT]), *values]), zero=True, most=3)


def _drift(
    box: _Box, values: Array, axis: _Axis, heading: str, unit: str, across: str, most: int, *,
    labelled: bool = True, indent: float = -34,
) -> str:  # fmt: skip
    """Stems and dots in the colours of the arms, room for `most` cycles; a curve where the cycles are many."""
    cycles = np.arange(len(values) + 1)
    every = max(1, math.ceil(most / 8))
    along = _Axis(-0.35, most + 0.35, False, tuple(float(k) for k in range(0, most + 1, every)))
    out = [_frame(box, axis, along, heading, unit, across, labelled=labelled, indent=indent)]
    x, y = box.across(along.place(cycles)), box.up(axis.place(np.concatenate([[0.0], values])))
    kept = np.isfinite(y)
    if len(values) > 30:
        return out[0] + "".join(f'<path class="s6 w" d="{_path(*thinned(x[run], y[run]))}"/>' for run in _runs(kept))
    for k in np.flatnonzero(kept):
        name = "start" if k == 0 else f"s{_shade(int(k), len(cycles))}"
        if k and box.bottom - y[k] > 3:
            out.append(f'<path class="{name} w" d="M{_n(x[k])} {_n(box.bottom)}V{_n(y[k])}"/>')
        out.append(f'<path class="{name} d" d="M{_n(x[k])} {_n(y[k])}h0"/>')
    if len(values) and kept[-1]:
        words = _number(float(values[-1]))
        right = min(x[-1] + _PLAIN * len(words) / 2, box.right)
        near = kept & (x >= right - _PLAIN * len(words) - 4)  # the number stands above all dots that it covers
        out.append(f'<text class="n e" x="{_n(right)}" y="{_n(y[near].min() - 7)}">{words}</text>')
    return "".join(out)


# ---- text of a path ---------------------------------------------------------------------------------------------------------


def thinned(x: Array, y: Array, tolerance: float = _FINE) -> tuple[Array, Array]:
    """The fewest points, at most 200, from which a curve looks the same: ends and extremes stay (Douglas and Peucker, 1973)."""
    while True:
        kept = _kept(x, y, tolerance)
        if len(kept) <= _MOST:
            return x[kept], y[kept]
        tolerance *= 1.5


def _kept(x: Array, y: Array, tolerance: float) -> Array:
    keep = np.zeros(len(x), bool)
    keep[[0, -1]] = True
    spans = [(0, len(x) - 1)]
    while spans:
        i, j = spans.pop()
        if j - i < 2:
            continue
        dx, dy = x[j] - x[i], y[j] - y[i]
        px, py = x[i + 1 : j] - x[i], y[i + 1 : j] - y[i]
        length = math.hypot(dx, dy)
        # a curve that comes back to where it began has no chord: then what is furthest from there stays
        off = np.abs(px * dy - py * dx) / length if length > tolerance else np.hypot(px, py)
        far = int(np.argmax(off))
        if off[far] > tolerance:
            keep[i + 1 + far] = True
            spans += [(i, i + 1 + far), (i + 1 + far, j)]
    return np.flatnonzero(keep)


def _path(x: Array, y: Array) -> str:
    """A polyline in tenths of a pixel, each point by its distance from the one before."""
    tenths = np.round(10 * np.column_stack([x, y])).astype(int)
    steps = np.diff(tenths, axis=0)
    steps = steps[(steps != 0).any(axis=1)] if len(steps) else steps
    start = f"M{_n(tenths[0, 0] / 10)} {_n(tenths[0, 1] / 10)}"
    return start + ("l" + " ".join(f"{_n(a / 10)} {_n(b / 10)}" for a, b in steps) if len(steps) else "h0")


def _dots(x: Array, y: Array) -> str:
    """Points: round caps make them dots."""
    return "".join(f"M{_n(a)} {_n(b)}h0" for a, b in zip(x, y, strict=True))


def _n(value: Any) -> str:
    """A coordinate to a tenth of a pixel, as short as it can be."""
    text = f"{float(value):.1f}"
    text = text[:-2] if text.endswith(".0") else text
    return "0" if text in ("-0", "") else text.replace("0.", ".", 1) if text.startswith(("0.", "-0.")) else text


def _number(value: float) -> str:
    """A number to read: 0.2, 1.5, 3e−7."""
    if value == 0 or not math.isfinite(value):
        return "0" if value == 0 else "–"
    if 1e-3 <= abs(value) < 1e4:
        return f"{value:.3g}".replace("-", "−")
    mantissa, exponent = f"{value:.1e}".split("e")
    return f"{mantissa.removesuffix('.0')}e{int(exponent)}".replace("-", "−")


def _round_down(value: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not above."""
    power = 10.0 ** math.floor(math.log10(value))
    return power * max(step for step in (1, 2, 5) if step * power <= value * (1 + 1e-9))


def _step(value: float) -> float:
    """The least of 1, 2, 5 times a power of ten that is not below."""
    power = 10.0 ** math.floor(math.log10(value))
    return power * min(step for step in (1, 2, 5, 10) if step * power >= value * (1 - 1e-9))


def _runs(mask: Array) -> list[Array]:
    """Indices of each unbroken stretch of true."""
    found = np.flatnonzero(mask)
    return np.split(found, np.flatnonzero(np.diff(found) > 1) + 1) if len(found) else []


def _apart(places: list[float], top: float, bottom: float, gap: float = 11.0) -> list[float]:
    """Heights of labels, as near to `places` as their size allows, in the same order."""
    order = sorted(range(len(places)), key=lambda k: places[k])
    out = [0.0] * len(places)
    last = -math.inf
    for k in order:
        last = out[k] = max(places[k], last + gap, top)
    last = math.inf
    for k in reversed(order):
        last = out[k] = min(out[k], last - gap, max(bottom, top + gap * (len(places) - 1)))
    return out


def _finite(points: Array | None) -> Array:
    """Points (..., 3) with the frames or instants left out that are not finite."""
    if points is None:
        return np.empty((0, 3))
    points = np.asarray(points, float)
    return points[np.isfinite(points).all(axis=tuple(range(1, points.ndim)))]


def _titled(text: str, letters: float) -> list[str]:
    """A title in at most two lines, without what it has in brackets at its end where that does not fit."""
    short = text[: text.rindex("(")].strip() if text.endswith(")") and "(" in text else ""
    return _lines(text if not short or len(textwrap.wrap(text, max(8, int(letters)))) <= 2 else short, letters)


def _lines(text: str, letters: float) -> list[str]:
    """A text in at most two lines."""
    return textwrap.wrap(text, max(8, int(letters)), max_lines=2, placeholder=" …") or [""]


def _svg(width: float, height: float, title: str, about: str, inside: str) -> str:
    return (
        f'<svg class="drawing" viewBox="0 0 {_n(width)} {_n(height)}" width="{_n(width)}" height="{_n(height)}" role="img">'
        f"<title>{escape(title)}</title><desc>{escape(about)}</desc>{inside}</svg>"
    )
