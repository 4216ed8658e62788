"""Runs problem sets through closed forms and backends, judges every answer, and keeps the records: the only loop."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import pyarrow as pa

from sandbox.backends import BACKENDS
from sandbox.backends.backend import Engine, Promise
from sandbox.batch import Batch
from sandbox.closed_form import CLOSED_FORMS
from sandbox.closed_form.form import POSITIVE_WEIGHT
from sandbox.columns import problem_table, record_table, truth_table
from sandbox.formulation import FORMULATIONS, Posed
from sandbox.judgement import Allowance, judge
from sandbox.preparation import Work, prepare
from sandbox.problem_set import ProblemSet
from sandbox.records import CLOSED_FORM
from sandbox.solution import CODE, Status
from sandbox.tolerances import UNIT
from sandbox.verdict import VERDICTS
from sandbox.worker import Answers, Workers

Array = np.ndarray

PATIENCE = 5
"""A backend that dies or overruns this often in one set is stopped there."""

WARM = ("high_accuracy", "direct")
"""Settings level and formulation of warm starts: x and y of `direct` mean the same from one member to the next."""

STRETCH = 5
"""A sampled backend that starts warm sees so many members of a sequence on end, and none of as many stretches as it skips."""


@dataclass(frozen=True)
class Plan:
    """What is to be run.

    levels : settings level -> formulations run at it
    sample_every : backends marked `sampled` see every so many-th problem of each set, of a sequence every so many-th stretch
    warm : sequences are solved a second time, at WARM, by the backends that can start from an earlier answer
    """

    sets: Sequence[ProblemSet]
    backends: Sequence[str]
    levels: dict[str, Sequence[str]]
    closed_forms: Sequence[str] = ()
    jobs: int = 1
    time_limit: float = 2.0
    sample_every: int = 1
    warm: bool = True

    @property
    def formulations(self) -> list[str]:
        """All formulations of any level."""
        return [name for name in FORMULATIONS if any(name in names for names in self.levels.values())]


@dataclass
class Tally:
    """Where the time went, summed over threads [s]."""

    wall: float = 0.0
    reference: float = 0.0
    build: float = 0.0
    solve: float = 0.0
    judge: float = 0.0

    def __post_init__(self) -> None:
        self._lock = threading.Lock()

    def add(self, **seconds: float) -> None:
        """Add to one or more counters."""
        with self._lock:
            for name, value in seconds.items():
                setattr(self, name, getattr(self, name) + value)


@dataclass
class Presence:
    """How a backend fared as a whole: absent and why, or its versions and the engine opened at each level."""

    state: str = "not_run"
    why: str = "no problem was posed for it"
    absent: bool = False
    engines: dict[str, Engine] = field(default_factory=dict)


Progress = Callable[[str, int, int], None]
"""Told (phase, records or problems done, total)."""

Keep = Callable[[str, str, pa.Table], None]
"""Given (kind, name of the part, table) as soon as a table is complete; kind as in records.read_table."""


def quiet(phase: str, done: int, total: int) -> None:
    """A Progress that tells nobody."""


class Agenda:
    """Sets still to be run by each library, handed out so that no library runs twice at once and none is left to the end.

    Iterating yields (library, set name) until nothing is left; several threads may iterate together.
    """

    def __init__(self, left: dict[str, list[str]]) -> None:
        self._left = left
        self._spent = {library: [0.0, 0] for library in left}  # seconds and sets done
        self._busy: set[str] = set()
        self._free = threading.Condition()

    def __iter__(self) -> Iterator[tuple[str, str]]:
        while True:
            with self._free:
                while not (idle := [one for one, sets in self._left.items() if sets and one not in self._busy]):
                    if not any(self._left.values()):
                        return
                    self._free.wait()
                library = max(idle, key=self._remaining)
                self._busy.add(library)
                set_name = self._left[library].pop(0)
            start = time.perf_counter()
            try:
                yield library, set_name
            finally:
                with self._free:
                    self._busy.discard(library)
                    self._spent[library][0] += time.perf_counter() - start
                    self._spent[library][1] += 1
                    self._free.notify_all()

    def _remaining(self, library: str) -> float:
        """Expected seconds of work left; a library not seen yet goes first."""
        seconds, done = self._spent[library]
        return seconds / done * len(self._left[library]) if done else float("inf")

    def clear(self) -> None:
        """Hand out nothing more."""
        with self._free:
            for sets in self._left.values():
                sets.clear()
            self._free.notify_all()


@dataclass
class Campaign:
    """A plan being carried out."""

    plan: Plan
    keep: Keep
    progress: Progress = quiet
    run_id: str | None = None
    tally: Tally = field(default_factory=Tally)
    presence: dict[str, Presence] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._stop = threading.Event()
        self._done = self._total = 0

    def carry_out(self) -> None:
        """Reference first, then closed forms, then every library in its process; Ctrl-C keeps what was done."""
        began = time.perf_counter()
        try:
            works = prepare(
                self.plan.sets, self.plan.formulations, self.plan.jobs, lambda *d: self.progress("exact arithmetic", *d)
            )
            self.tally.add(reference=time.perf_counter() - began)
            self._keep_problems(works)
            self._judge_closed_forms(works)
            self._run_backends(works)
        finally:
            self.tally.add(wall=time.perf_counter() - began)

    def _keep_problems(self, works: list[Work]) -> None:
        for set_name in dict.fromkeys(work.set_name for work in works):
            members = [work for work in works if work.set_name == set_name]
            problems = [problem_table(set_name, work.group, work.ids) for work in members]
            truths = [truth_table(task, work.ids, found) for work in members for task, found in work.truths.items()]
            self.keep("problems", set_name, pa.concat_tables(problems))
            self.keep("truth", set_name, pa.concat_tables(truths))

    def _judge_closed_forms(self, works: list[Work]) -> None:
        """Every closed form on every group of its task."""
        tables: dict[str, list[pa.Table]] = {}
        for count, work in enumerate(works):
            for name in self.plan.closed_forms:
                if CLOSED_FORMS[name].task in work.yardsticks:
                    tables.setdefault(work.set_name, []).append(_closed_form_records(name, work, self.run_id))
            self.progress("closed forms", count + 1, len(works))
        for set_name, parts in tables.items():
            self.keep("records", f"{set_name}-closed_form", pa.concat_tables(parts))

    # ---- backends --------------------------------------------------------------------------------------------

    def _run_backends(self, works: list[Work]) -> None:
        """Each library in its own process, `jobs` of them at a time."""
        libraries: dict[str, list[str]] = {}
        for name in self.plan.backends:
            libraries.setdefault(BACKENDS[name].library, []).append(name)
            self.presence[name] = Presence()
        self._total = sum(
            len(self._members(work, name)) * len(list(self._rounds(work, name)))
            for work in works
            for name in self.plan.backends
        )
        by_set = {name: [work for work in works if work.set_name == name] for name in dict.fromkeys(w.set_name for w in works)}
        agenda = Agenda({library: list(by_set) for library in libraries})
        with Workers(self._stop) as workers, ThreadPoolExecutor(max_workers=self.plan.jobs) as threads:

            def work_off() -> None:
                for library, set_name in agenda:
                    self._run_set(workers, libraries[library], by_set[set_name])

            futures = [threads.submit(work_off) for _ in range(self.plan.jobs)]
            try:
                for future in futures:
                    future.result()
            except BaseException:
                self._stop.set()
                agenda.clear()
                raise

    def _members(self, work: Work, backend: str) -> Array:
        """Members of a group that the backend sees."""
        every = self.plan.sample_every if BACKENDS[backend].sampled else 1
        members = np.arange(len(work.ids))
        chained = work.group.sequence and BACKENDS[backend].warm
        places = members // STRETCH if chained else members + work.first
        return np.flatnonzero(places % every == 0)

    def _rounds(self, work: Work, backend: str) -> Iterator[tuple[str, str, Literal["cold", "warm"]]]:
        """Settings level, formulation and mode of every batch of a backend on a group."""
        warm = self.plan.warm and BACKENDS[backend].warm and work.group.follows().any()
        for level, formulations in self.plan.levels.items():
            for formulation in formulations:
                if formulation in work.posings:
                    yield level, formulation, "cold"
                    if warm and (level, formulation) == WARM:
                        yield level, formulation, "warm"

    def _run_set(self, workers: Workers, backends: list[str], works: list[Work]) -> None:
        """One library on one set; an interruption keeps the groups that were finished."""
        parts: list[pa.Table] = []
        failures = dict.fromkeys(backends, 0)
        try:
            for work in works:
                if not self._stop.is_set():
                    parts += self._run_group(workers, backends, work, failures)
        finally:
            if parts:
                self.keep("records", f"{works[0].set_name}-{BACKENDS[backends[0]].library}", pa.concat_tables(parts))

    def _run_group(self, workers: Workers, backends: list[str], work: Work, failures: dict[str, int]) -> list[pa.Table]:
        """All engines, formulations and levels of one library on one group, judged together by task."""
        batches: dict[str, list[Batch]] = {}
        for backend in backends:
            members = self._members(work, backend)
            for level, formulation, mode in self._rounds(work, backend):
                if not len(members) or self._stop.is_set():
                    continue
                batch = Batch.empty(backend, level, formulation, work.group.problem, members, mode)
                self._solve(workers, batch, work, failures)
                self._done += len(members)
                self.progress("solving", self._done, self._total)
                if self.presence[backend].state == "ran":
                    batches.setdefault(FORMULATIONS[formulation].task, []).append(batch)
        start = time.perf_counter()
        tables = [_backend_records(work, task, group, self.plan.time_limit, self.run_id) for task, group in batches.items()]
        self.tally.add(judge=time.perf_counter() - start)
        return tables

    def _solve(self, workers: Workers, batch: Batch, work: Work, failures: dict[str, int]) -> None:
        """Fill the batch with what its backend says to the posed group."""
        posing, recipe, problem = work.posings[batch.formulation].posing, FORMULATIONS[batch.formulation], work.group.problem
        batch.refuse(posing.refused)
        for whole in posing.parts:
            posed = whole[np.flatnonzero(np.isin(whole.index, batch.members))]
            if not len(posed.index):
                continue
            follows = None
            if batch.mode == "warm":
                follows = work.group.follows()[posed.index]
                follows[1:] &= np.diff(posed.index) == 1  # the one before may not have been posed, or asked
                follows[0] = False
            answers = self._ask(workers, batch, posed, failures, follows)
            if recipe.then is not None:
                reached = (answers.status == CODE[Status.SOLVED]) & np.isfinite(answers.x).all(axis=-1)
                batch.note(posed.index, answers)  # where the first stage fails, its end is the end
                first = answers[np.flatnonzero(reached)]
                posed = posed[np.flatnonzero(reached)]
                if not len(posed.index):
                    continue
                posed = recipe.then(problem[posed.index], posed, first.x)
                answers = self._ask(workers, batch, posed, failures).after(first)
            batch.take(posed, answers, problem, recipe)
        batch.engine = batch.engine or self.presence[batch.backend].engines.get(batch.level)

    def _ask(
        self, workers: Workers, batch: Batch, posed: Posed, failures: dict[str, int], follows: Array | None = None
    ) -> Answers:
        """One stack of QPs to one backend, as long as patience lasts."""
        row, presence = BACKENDS[batch.backend], self.presence[batch.backend]
        if presence.absent:  # it could not be opened: asking again for every stack would cost its start each time
            return Answers.empty(posed.qp)
        if posed.qp.p == 0 and not row.without_rows:
            answers = Answers.empty(posed.qp)
            answers.fail(np.arange(len(posed.qp)), Status.NOT_RUN, "takes no QP without rows")
            return answers
        answers = workers.solve(
            batch.backend, posed.qp, settings=batch.level, time_limit=self.plan.time_limit,
            patience=max(PATIENCE - failures[batch.backend], 0), follows=follows,
        )  # fmt: skip
        failures[batch.backend] += int(np.isin(answers.status, (CODE[Status.CRASHED], CODE[Status.TIMED_OUT])).sum())
        self.tally.add(build=float(np.nansum(answers.build_time)), solve=float(np.nansum(answers.solve_time)))
        if answers.engine is not None:
            presence.state, presence.why = "ran", ""
            presence.engines[batch.level] = batch.engine = answers.engine
            batch.scale(posed, answers)
        elif answers.absent and presence.state != "ran":
            presence.why, presence.absent = answers.absent, True
        return answers


def _closed_form_records(name: str, work: Work, run_id: str | None) -> pa.Table:
    """One closed form on one group, judged by its own error bound."""
    form, problem = CLOSED_FORMS[name], work.group.problem
    yardstick = work.yardsticks[form.task]
    start = time.perf_counter()
    solution = form.function(problem)
    each = np.full(len(problem), (time.perf_counter() - start) / len(problem))
    codes = np.array([CODE[status] for status in solution.status], dtype=np.int8)
    bound = form.bound(problem)
    promised = bound < 1  # a bound that exceeds the answer itself promises nothing
    if form.domain == POSITIVE_WEIGHT:
        promised &= yardstick.lambda_min_W > UNIT * yardstick.norm_W
    judged = judge(yardstick, solution.x, solution.y, codes, Allowance.of_closed_form(bound), promised)
    more = {"backend": f"{CLOSED_FORM}{name}", "solve_time": each, "runtime": each, "run": run_id}
    rows = np.arange(len(problem))
    return record_table(work, form.task, rows, judged, solution.x, solution.y, codes, list(solution.said), more)


def _backend_records(work: Work, task: str, batches: list[Batch], time_limit: float, run_id: str | None) -> pa.Table:
    """All batches of one group and task: one stacked judgement."""
    posed = [work.posings[batch.formulation] for batch in batches]
    members = [batch.members for batch in batches]

    def joined(parts: list[Array]) -> Array:
        return np.concatenate([part[m] for part, m in zip(parts, members, strict=True)])

    def each(values: list[Any]) -> pa.Array:
        """One value per batch, repeated over its members."""
        kinds = [kind for kind in dict.fromkeys(values) if kind is not None]
        codes = np.repeat([-1 if v is None else kinds.index(v) for v in values], [len(m) for m in members]).astype(np.int32)
        return pa.DictionaryArray.from_arrays(pa.array(codes, mask=codes < 0), pa.array(kinds, pa.string()))

    rows = np.concatenate(members)
    qdot, y, status = (joined([getattr(batch, name) for batch in batches]) for name in ("qdot", "y", "status"))
    promised = joined(
        [_promised(BACKENDS[b.backend].promise, p.curvature, p.full_rank) for b, p in zip(batches, posed, strict=True)]
    )
    allowance = Allowance.joined([batch.allowance() for batch in batches], members)
    judged = judge(work.yardsticks[task][rows], qdot, y, status, allowance, promised)
    posing_error = joined([p.posing_error for p in posed])
    with np.errstate(invalid="ignore"):
        spoilt = joined([p.differs | p.refused for p in posed]) | (posing_error > judged.tolerance)
    # posing is no excuse for dying, and what came out right needs none
    own = np.isin(judged.verdict, [VERDICTS.index(v) for v in ("verified", "crashed", "timed_out")])
    at_fault = spoilt & ~own
    engines = [batch.engine for batch in batches]
    more: dict[str, Any] = {
        "backend": each([batch.backend for batch in batches]),
        "formulation": each([batch.formulation for batch in batches]),
        "settings": each([batch.level for batch in batches]),
        "library_version": each([e and e.library_version for e in engines]),
        "engine_version": each([e and e.engine_version for e in engines]),
        "effective_settings": each([e and json.dumps(e.settings, sort_keys=True) for e in engines]),
        "mode": each([batch.mode for batch in batches]),
        "run": run_id,
        "time_limit": np.full(len(rows), time_limit),
        "posing_error": posing_error,
        "blame": np.where(at_fault, "formulation", "backend"),
        "iterations": pa.array([b.iterations[i] for b in batches for i in b.members], pa.int32()),
        **{name: joined([getattr(b, name) for b in batches]) for name in ("build_time", "solve_time", "runtime")},
    }
    said = [batch.said[i] for batch in batches for i in batch.members]
    return record_table(work, task, rows, judged, qdot, y, status, said, more)


def _promised(promise: Promise, curvature: Array, full_rank: Array) -> Array:
    """Whether the documentation promises to solve such a QP (B,); silence promises nothing."""
    if promise.H is None:
        return np.zeros(len(curvature), dtype=bool)
    covered: Array = curvature <= ("pd", "psd", "indefinite").index(promise.H)
    return covered & (full_rank | (promise.A == "any"))
