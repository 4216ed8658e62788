"""One claim of the paper: what it says, the two code paths that are compared, and what the comparison found."""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np

from sandbox.claims.exhibit import Exhibit


class Role(StrEnum):
    """What a check decides about its claim."""

    CLAIM = "claim"
    """The sentence where the paper states it: a failure means not reproduced."""
    REACH = "reach"
    """The sentence as far as its words go: a failure limits it to a range, which the check names."""
    PRINTED = "printed"
    """The sentence to the letter, where we read it otherwise: a failure confirms the erratum."""
    OURS = "ours"
    """What we say about the claim (a cause, a correction): a failure means that our evidence does not stand."""


class State(StrEnum):
    """What the checks of a claim add up to."""

    REPRODUCED = "reproduced"
    RANGE = "reproduced with a range"
    CORRECTED = "reproduced as corrected"
    NOT_REPRODUCED = "not reproduced"
    UNSOUND = "evidence fails"

    @property
    def red(self) -> bool:
        """Whether the claim, or our evidence for it, has fallen."""
        return self in (State.NOT_REPRODUCED, State.UNSOUND)


@dataclass(frozen=True)
class Check:
    """One thing that holds or does not, over `count` cases.

    says : what is asked, in words ($...$ is TeX)
    found, asked : the number or words found, and what was asked of it
    range : of a REACH or PRINTED check that may fail: where the sentence does hold, or how it is to be read; computed
    """

    says: str
    holds: bool
    found: str | float | int
    asked: str | float | int
    count: int = 1
    role: Role = Role.CLAIM
    range: str = ""

    def __post_init__(self) -> None:
        # no case examined, or NaN found, proves nothing
        lost = isinstance(self.found, float) and math.isnan(self.found)
        object.__setattr__(self, "holds", bool(self.holds) and self.count > 0 and not lost)
        for name in ("found", "asked"):
            value = getattr(self, name)
            value = value.item() if isinstance(value, np.generic) else value
            endless = isinstance(value, float) and not math.isfinite(value)
            object.__setattr__(self, name, str(value).replace("inf", "∞") if endless else value)
        object.__setattr__(self, "count", int(self.count))


def at_most(says: str, found: Any, limit: float, *, role: Role = Role.CLAIM, range: str = "") -> Check:
    """Every entry of `found` (any shape) is at most `limit`; the largest is shown. NaN does not hold."""
    values = np.asarray(found, dtype=float)
    largest = float(values.max()) if values.size else math.nan
    return Check(says, largest <= limit, largest, f"≤ {limit:g}", values.size, role, range)


def at_least(says: str, found: Any, limit: float, *, role: Role = Role.CLAIM, range: str = "") -> Check:
    """Every entry of `found` is at least `limit`; the smallest is shown. NaN does not hold."""
    values = np.asarray(found, dtype=float)
    smallest = float(values.min()) if values.size else math.nan
    return Check(says, smallest >= limit, smallest, f"≥ {limit:g}", values.size, role, range)


def every(says: str, held: Any, *, role: Role = Role.CLAIM, range: str = "") -> Check:
    """Every entry of the boolean array `held` is true; the share is shown."""
    values = np.asarray(held, dtype=bool)
    return Check(says, bool(values.all()), f"{int(values.sum()):,} of {values.size:,}", "all", values.size, role, range)


@dataclass(frozen=True)
class Evidence:
    """What a claim's examination found: its checks, and the tables and plots that show it."""

    checks: tuple[Check, ...]
    exhibits: tuple[Exhibit, ...]

    @property
    def state(self) -> State:
        """Computed from the checks alone."""
        fallen = {check.role for check in self.checks if not check.holds}
        if not any(check.role is not Role.OURS for check in self.checks) or Role.OURS in fallen:
            return State.UNSOUND
        order = {Role.CLAIM: State.NOT_REPRODUCED, Role.PRINTED: State.CORRECTED, Role.REACH: State.RANGE}
        return next((state for role, state in order.items() if role in fallen), State.REPRODUCED)


@dataclass(frozen=True)
class Trial:
    """How a claim is examined: in full for the page, reduced for the tests.

    folder : where a claim may keep runs of its own; None where nothing is kept
    """

    full: bool = True
    seed: int = 0
    folder: Path | None = None
    jobs: int = 1

    def of(self, full: int, reduced: int) -> int:
        """A number of cases."""
        return full if self.full else reduced

    def rng(self, key: str) -> np.random.Generator:
        """Draws of their own for each key (a claim's name), the same in every run of this seed."""
        return np.random.default_rng([self.seed, zlib.crc32(key.encode())])


Answer = Callable[..., Any]
"""A code path: each claim's examination says what it hands to it and takes from it."""


@dataclass(frozen=True)
class CodePath:
    """One of the two sides: the function, and what it is.

    name : module:function; the function's own, unless it is compiled or bound and would not tell
    """

    words: str
    function: Answer
    name: str = ""

    def __post_init__(self) -> None:
        if not self.name:
            object.__setattr__(self, "name", f"{self.function.__module__}:{self.function.__qualname__}")


@dataclass(frozen=True)
class Fault:
    """A planted fault: the first code path made wrong as `words` say, so that the claim must turn red."""

    words: str
    plant: Callable[[Answer], Answer]


@dataclass(frozen=True)
class Claim:
    """A row of the ledger.

    place : where the paper says it ("Section II, eq. (6)")
    says : the paper's sentence in our words; tested, accepted : how, and what must hold. $...$ is TeX
    formula : the displayed formula in TeX, if there is one
    paths : the two code paths compared; they share nothing below numpy but the nouns that hold the data
    examine : (trial, first path, second path) -> Evidence
    alone : whether it measures time, or uses all processes itself: nothing else runs beside it
    """

    name: str
    title: str
    place: str
    says: str
    tested: str
    accepted: str
    paths: tuple[CodePath, CodePath]
    examine: Callable[[Trial, Answer, Answer], Evidence]
    fault: Fault
    formula: str = ""
    sources: tuple[str, ...] = ()
    alone: bool = False

    def evidence(self, trial: Trial, *, faulty: bool = False) -> Evidence:
        """Examine the claim; `faulty` with its fault planted in the first code path."""
        first, second = (path.function for path in self.paths)
        return self.examine(trial, self.fault.plant(first) if faulty else first, second)
