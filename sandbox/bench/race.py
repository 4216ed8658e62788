"""Functions timed in turn: what one is divided by runs in the same moments, on the same core."""

from __future__ import annotations

import gc
import os
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

Array = np.ndarray

WARM_UP = 1
"""Turns of every function before any is timed: they load code, touch memory and set the clock of the core."""


@dataclass(frozen=True)
class Effort:
    """How much is measured: `share` of a benchmark's own number of problems, and rounds that are timed."""

    share: float = 1.0
    rounds: int = 15

    def problems(self, whole: int) -> int:
        """Problems to measure of the `whole` number; never fewer than 16."""
        return max(16, self.least(whole))

    def least(self, whole: int) -> int:
        """The share of a `whole` number; never less than 1."""
        return max(1, round(whole * self.share))


@contextmanager
def one_core() -> Iterator[None]:
    """Keep this thread, and whatever it starts, on one core, where the system lets us say so."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    allowed = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(allowed)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, allowed)


def race(functions: Mapping[str, Callable[[], object]], rounds: int, *, wall: bool = False) -> dict[str, Array]:
    """Seconds (rounds,) of each function [s]; every round begins with another, and the collector of garbage waits.

    Seconds are those that this process spends on a core, so that what others take of it does not count; `wall` ones where
    several threads or processes work for a function.
    """
    clock = time.perf_counter if wall else time.process_time
    names = list(functions)
    found = {name: np.zeros(rounds) for name in names}
    for _ in range(WARM_UP):
        for name in names:
            functions[name]()
    collecting = gc.isenabled()
    gc.disable()
    try:
        for k in range(rounds):
            turn = k % len(names)
            for name in (*names[turn:], *names[:turn]):
                start = clock()
                functions[name]()
                found[name][k] = clock() - start
    finally:
        if collecting:
            gc.enable()
    return found
