"""One measured number, with its spread."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

Array = np.ndarray


@dataclass(frozen=True)
class Measured:
    """A figure in the unit of its benchmark.

    value : of the least times, which other work on the machine disturbs least
    median, low, high : median and quartiles over the rounds, each round by itself; None where nothing was timed
    beside : further numbers that go with it, by name
    """

    value: float
    median: float | None = None
    low: float | None = None
    high: float | None = None
    rounds: int = 0
    beside: dict[str, float | str] = field(default_factory=dict)

    def with_(self, beside: Mapping[str, float | str]) -> Measured:
        """The same with more beside it."""
        return replace(self, beside={**self.beside, **beside})


def ratio(over: Array, under: Array) -> Measured:
    """Seconds (rounds,) over seconds (rounds,) of the same race."""
    return _spread(over.min() / under.min(), over / under)


def each(seconds: Array, count: int, unit: float = 1e-6) -> Measured:
    """Time of one of `count`, in `unit` seconds."""
    return _spread(seconds.min() / count / unit, seconds / count / unit)


def rate(seconds: Array, count: int) -> Measured:
    """How many of `count` in a second."""
    return _spread(count / seconds.min(), count / seconds)


def _spread(value: float, values: Array) -> Measured:
    low, median, high = np.quantile(values, [0.25, 0.5, 0.75])
    return Measured(float(value), float(median), float(low), float(high), len(values))
