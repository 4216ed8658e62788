"""Tables and plots as data: computed by a claim, kept as JSON, drawn by a report."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, is_dataclass
from typing import Any, Literal

import numpy as np

Array = np.ndarray

SeriesKind = Literal["points", "line", "bars", "vertical", "horizontal"]
"""How a series is drawn; bars are a histogram (x the left edges, one more x than y); vertical and horizontal are rules."""

SeriesRole = Literal["ours", "other", "paper", "bound"]
"""Whose numbers: ours (told apart by order), the compared path's, printed in the paper, or a bound or prediction."""


@dataclass(frozen=True)
class Table:
    """A table; cells are text ($...$ is TeX), numbers or None. `paper` names the columns that the paper prints."""

    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str | float | int | None, ...], ...]
    paper: tuple[str, ...] = ()
    kind: Literal["table"] = "table"

    def __post_init__(self) -> None:
        if any(len(row) != len(self.columns) for row in self.rows):
            raise ValueError(f"a row of the table {self.caption!r} has not its {len(self.columns)} columns")
        if not set(self.paper) <= set(self.columns):
            raise ValueError(f"{self.paper} are not all columns of the table {self.caption!r}")


@dataclass(frozen=True)
class Axis:
    """What an axis shows, with its unit; its range where that is fixed; `categories` name 0, 1, 2, ..."""

    title: str
    log: bool = False
    low: float | None = None
    high: float | None = None
    categories: tuple[str, ...] = ()


@dataclass(frozen=True)
class Series:
    """Points (x, y) under one name; `text` says more on each point."""

    name: str
    x: Sequence[float] | Array
    y: Sequence[float] | Array
    kind: SeriesKind = "points"
    role: SeriesRole = "ours"
    text: Sequence[str] = ()


@dataclass(frozen=True)
class Plot:
    """Series on two axes."""

    caption: str
    x: Axis
    y: Axis
    series: tuple[Series, ...]
    kind: Literal["plot"] = "plot"


@dataclass(frozen=True)
class Heat:
    """A number for every column and row, coloured apart at `middle`; `words` are printed in the cells instead."""

    caption: str
    x: str
    y: str
    columns: tuple[str, ...]
    rows: tuple[str, ...]
    values: Sequence[Sequence[float | None]] | Array
    middle: float = 1.0
    words: Sequence[Sequence[str]] = ()
    kind: Literal["heat"] = "heat"


Exhibit = Table | Plot | Heat


def histogram(name: str, values: Any, edges: Any, *, role: SeriesRole = "ours") -> Series:
    """Counts of `values` between the edges."""
    return Series(name, np.asarray(edges, dtype=float), np.histogram(values, edges)[0], "bars", role)


def as_json(exhibit: Exhibit) -> str:
    """JSON; numbers that are not finite become null. Floats are kept to 7 digits, more than a page shows."""
    return json.dumps(_plain(exhibit), ensure_ascii=False, separators=(",", ":"), allow_nan=False)


def _plain(value: Any) -> Any:
    if is_dataclass(value) and not isinstance(value, type):
        return {name: _plain(part) for name, part in asdict(value).items()}
    if isinstance(value, dict):
        return {name: _plain(part) for name, part in value.items()}
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [_plain(part) for part in value]
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, float):
        return float(f"{value:.7g}") if math.isfinite(value) else None
    return value
