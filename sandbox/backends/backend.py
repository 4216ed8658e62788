"""What a backend is: one engine reached through one library, what its documentation promises, how it answers.

Every engine is given  minimise 1/2 x'Hx + g'x  subject to  Ax = b  and answers in the one Lagrangian
L = 1/2 x'Hx + g'x + y'(Ax - b), so Hx + g + A'y = 0.
"""

from __future__ import annotations

import math
import re
import time
import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from importlib import import_module, metadata
from typing import Any, Literal, NamedTuple

import numpy as np

from sandbox.errors import UnknownNameError
from sandbox.solution import Status
from sandbox.tolerances import ASKED

Array = np.ndarray


@dataclass(frozen=True)
class Promise:
    """What the documentation says of H and A, in its own words; None where it is silent.

    H : the matrices it promises to take: positive definite, semidefinite, or any symmetric one.
    A : whether its rows must be linearly independent.
    quote, source, version : the sentence, where it stands, and the version it was read for; "" for silence.
    """

    H: Literal["pd", "psd", "indefinite"] | None
    A: Literal["full_rank", "any"] | None
    quote: str
    source: str
    version: str


@dataclass(frozen=True)
class WarmStart:
    """How an engine is handed a starting point.

    by : the parameters, or the call, that take it
    quote, source, version : the documentation's sentence, where it stands, and the version it was read for; "" where
        the name is all it says
    """

    by: str
    quote: str = ""
    source: str = ""
    version: str = ""


@dataclass(frozen=True)
class Backend:
    """One row of the table: an engine as one library reaches it.

    licence : SPDX expression of the engine, as shipped.
    expected, message : what the reference environment shows; `message` is part of what a row that fails says.
    without_rows : it takes a QP with no equality rows itself.
    start : how it takes a starting point; None where its interface has none, or heeds none.
    sampled : slow; sees every tenth problem of each set in the standard run.
    install : the line that installs it; package : where the library's file stands.
    """

    name: str
    library: str
    engine: str
    licence: str
    method: str
    promise: Promise
    expected: Literal["runs", "loads but fails", "absent"] = "runs"
    message: str = ""
    without_rows: bool = True
    sampled: bool = False
    install: str = ""
    start: WarmStart | None = None
    package: str = "sandbox.backends"

    @property
    def warm(self) -> bool:
        """Whether it can be started from an earlier answer."""
        return self.start is not None

    @property
    def module(self) -> str:
        """The file that opens its engines; its library is imported in the process that imports this."""
        return f"{self.package}.{self.library}_"

    def open(self, settings: str) -> Engine:
        """Import the library (into this process, for good) and make the engine ready at a settings level.

        Raises ImportError where the library or the engine is missing, UnknownNameError for a level that is none.
        """
        if settings != "default" and settings not in ASKED:
            raise UnknownNameError.of("settings level", settings, ["default", *ASKED])
        return opened(self.module, self.engine, settings)


class Answer(NamedTuple):
    """What an engine said of one QP.

    x (n,), y (p,): as given, None where there is none; said: its own words; times in s, build_time being
    all that comes before the engine starts to solve (conversion, set-up, compilation).
    """

    x: Array | None
    y: Array | None
    status: Status
    said: str
    iterations: int | None
    build_time: float
    solve_time: float


class Start(NamedTuple):
    """Where an engine is to start: x (n,) and y (p,), finite; an engine that takes no y heeds x alone."""

    x: Array
    y: Array

    @classmethod
    def after(cls, status: Status, x: Any, y: Any, n: int, p: int) -> Start | None:
        """An answer to one problem as the start of the next; None unless it was solved and is finite and whole."""
        parts = np.asarray(x), np.asarray(y)
        if status is not Status.SOLVED or [part.shape for part in parts] != [(n,), (p,)]:
            return None
        if any(part.dtype.kind not in "fiu" or not np.isfinite(part).all() for part in parts):
            return None
        return cls(*(np.array(part, dtype=float) for part in parts))


Solve = Callable[..., Answer]
"""solve(H (n, n), g (n,), A (p, n), b (p,)), p may be 0; a backend that can be warm takes a Start as fifth argument."""


class Engine(NamedTuple):
    """An engine ready to solve: nothing is left of the calls before, and without a Start a call is cold.

    solve: see Solve; settings: the effective ones, as JSON;
    eps: effective (primal absolute, primal relative, dual absolute, dual relative) stopping tolerances,
    zeros for an engine that factors or follows an active set and has none.
    """

    solve: Solve
    settings: dict[str, Any]
    eps: tuple[float, float, float, float]
    library_version: str
    engine_version: str


def guarded(solve: Solve) -> Solve:
    """`solve` made unable to raise: what the engine throws becomes a refusal, what it warns joins its words."""

    def solve_or_refuse(*given: Any) -> Answer:
        begun = time.perf_counter()
        with warnings.catch_warnings(record=True) as heard:
            warnings.simplefilter("always")
            try:
                answer = solve(*given)
            except (KeyboardInterrupt, SystemExit):
                raise
            except BaseException as error:  # a panic of a Rust engine derives from BaseException only
                words = f"{type(error).__name__}: {' '.join(str(error).split())}"
                answer = Answer(None, None, status_of(words), words, None, time.perf_counter() - begun, 0.0)
        if heard:
            told = dict.fromkeys(" ".join(str(warning.message).split()) for warning in heard)
            answer = answer._replace(said="; ".join([*filter(None, [answer.said]), *told]))
        return answer

    return solve_or_refuse


def opened(module: str, engine: str, settings: str) -> Engine:
    """The engine that the library file `module` opens, its solve made unable to raise."""
    found: Engine = import_module(module).open_engine(engine, settings)
    return found._replace(solve=guarded(found.solve), settings=plain(found.settings))


_WORDS = (  # the first that occurs decides; capitals, blanks and _ - are levelled before
    (r"infeasible or unbounded|unbounded or infeasible|infeasibleorunbounded|unboundedorinfeasible", Status.FAILED),
    (
        r"non ?convex|non ?cvx|indefinite|positive ?(semi ?)?definite|\bdcp\b|inertia|\bosqpexception: 4\b|solvererror: 4$",
        Status.NONCONVEX,
    ),
    (r"rank ?\(a\) ?< ?p|rank ?deficient|singular matrix c|linearly dependent|overdetermined", Status.RANK_DEFICIENT),
    (r"dual ?infeasible|unbounded|diverging", Status.UNBOUNDED),
    (r"infeasib|inconsistent|incompatible", Status.INFEASIBLE),
    (
        r"inaccurate|acceptable|almost|limit|max(imum)? ?(number of )?iter|insufficient ?progress|too small|\bmaxit\b",
        Status.LIMIT,
    ),
)


def status_of(words: str) -> Status:
    """The refusal that an engine's words amount to; FAILED where they give no reason."""
    level = re.sub(r"[\s_-]+", " ", words).lower()
    return next((status for pattern, status in _WORDS if re.search(pattern, level)), Status.FAILED)


def plain(value: Any) -> Any:
    """`value` as JSON knows it: enumerations by name, infinities and NaN by their words."""
    if isinstance(value, Mapping):
        return {str(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, Enum):
        return value.name
    if isinstance(value, (bool, str)) or value is None:
        return value
    if isinstance(value, (int, np.integer)) and type(value).__module__ in ("builtins", "numpy"):
        return int(value)
    if isinstance(value, (float, np.floating)):
        return float(value) if math.isfinite(value) else str(float(value))
    if isinstance(value, (list, tuple, np.ndarray)):
        return [plain(entry) for entry in value]
    return getattr(value, "name", None) or str(value)


def attributes(holder: Any, leave_out: Iterable[str] = ()) -> dict[str, Any]:
    """The public data attributes of a settings object, as JSON."""
    names = (name for name in dir(holder) if not name.startswith("_") and name not in set(leave_out))
    return {name: plain(value) for name in names if not callable(value := getattr(holder, name))}


def version(distribution: str) -> str:
    """Installed version of a distribution.

    Raises ImportError (PackageNotFoundError) where it is not installed.
    """
    return metadata.version(distribution)
