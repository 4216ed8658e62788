"""Solver libraries in processes of their own: a crash or a hang costs one problem, never the run."""

from __future__ import annotations

import contextlib
import mmap
import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from sandbox.backends import BACKENDS
from sandbox.backends.backend import Backend, Engine, Start
from sandbox.errors import RefusalError, UnknownNameError
from sandbox.qp import QP
from sandbox.solution import CODE, STATUSES, Status
from sandbox.solver_process import PROGRESS
from sandbox.tolerances import VERIFIED_RELATIVE

Array = np.ndarray

OPENING_LIMIT = 120.0
"""Seconds that a library may take to start."""

POLL = 0.02
"""Seconds between two looks at a busy process."""


@dataclass(frozen=True, eq=False)
class Answers:
    """What one backend said to a stack of B QPs.

    x (B, n) and y (B, p), NaN where it gave none; status (B,) codes into solution.STATUSES; times in seconds.
    `engine` is None where the backend was not opened, and `absent` then says why it could not be.
    """

    x: Array
    y: Array
    status: Array
    said: list[str]
    iterations: list[int | None]
    build_time: Array
    solve_time: Array
    runtime: Array
    engine: Engine | None = None
    absent: str = ""

    def __getitem__(self, members: Array) -> Answers:
        """Some of the answers, by an index array."""
        return replace(
            self, x=self.x[members], y=self.y[members], status=self.status[members], said=[self.said[i] for i in members],
            iterations=[self.iterations[i] for i in members], build_time=self.build_time[members],
            solve_time=self.solve_time[members], runtime=self.runtime[members],
        )  # fmt: skip

    def start(self, i: int) -> Start | None:
        """The answer to member `i` as the start of the next, None where it is no good for that."""
        return Start.after(STATUSES[self.status[i]], self.x[i], self.y[i], self.x.shape[1], self.y.shape[1])

    def after(self, first: Answers) -> Answers:
        """These answers, with the times of a first stage added."""
        return replace(
            self, build_time=self.build_time + first.build_time, solve_time=self.solve_time + first.solve_time,
            runtime=self.runtime + first.runtime,
        )  # fmt: skip

    @classmethod
    def empty(cls, qp: QP) -> Answers:
        """Nothing run yet."""
        B = len(qp)
        return cls(
            np.full((B, qp.n), np.nan), np.full((B, qp.p), np.nan), np.full(B, CODE[Status.NOT_RUN], dtype=np.int8),
            [""] * B, [None] * B, np.full(B, np.nan), np.full(B, np.nan), np.full(B, np.nan),
        )  # fmt: skip

    def put(self, i: int, answer: tuple[Any, ...]) -> None:
        """Store what the process sent for member `i`; an answer of the wrong size is none."""
        x, y, status, said, iterations, build, solve, wall = answer
        for kept, given in ((self.x, x), (self.y, y)):
            values = np.asarray(given)
            if values.dtype.kind in "fiu" and values.shape == kept[i].shape:
                kept[i] = values
        self.status[i] = CODE[Status[status]]
        self.said[i] = str(said).encode("utf-8", "replace").decode()
        self.iterations[i] = iterations if isinstance(iterations, int) and 0 <= iterations < 2**31 else None
        self.build_time[i], self.solve_time[i], self.runtime[i] = build, solve, wall

    def fail(self, members: Array, status: Status, said: str) -> None:
        """The same end for several members."""
        self.status[members] = CODE[status]
        for i in members:
            self.said[i] = said


@dataclass(frozen=True, eq=False)
class Chain:
    """Which members of a stack start from the answer to the one before them (B,), and where the first one starts."""

    follows: Array
    first: Start | None

    def of(self, todo: Array, answers: Answers) -> tuple[Array, Start | None]:
        """The same for the members `todo` alone, of which the first may follow one that `answers` has already."""
        follows = self.follows[todo]
        follows[1:] &= np.diff(todo) == 1  # whatever lies between was lost
        if todo[0] == 0:
            return follows, self.first
        return follows, answers.start(todo[0] - 1) if follows[0] else None


class Process:
    """One running solver process and the pipe to it."""

    def __init__(self, module: str) -> None:
        ours, theirs = socket.socketpair()
        self.progress_file = tempfile.TemporaryFile()
        self.progress_file.truncate(mmap.PAGESIZE)
        self.progress = mmap.mmap(self.progress_file.fileno(), mmap.PAGESIZE)
        self.progress[: PROGRESS.size] = PROGRESS.pack(-1, float("inf"))
        self.lifeline, tied = socket.socketpair()  # nothing is sent on it: its end is ours
        threads = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}
        descriptors = (theirs.fileno(), self.progress_file.fileno(), tied.fileno())
        self.child = subprocess.Popen(
            [sys.executable, "-m", "sandbox.solver_process", module, *map(str, descriptors)],
            pass_fds=descriptors, env={**os.environ, **threads}, stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True,
        )  # fmt: skip
        theirs.close()
        tied.close()
        self.pipe = Connection(ours.detach())

    def position(self) -> tuple[int, float]:
        """Problem being solved and when it was begun."""
        position, begun = PROGRESS.unpack(self.progress[: PROGRESS.size])
        return position, begun

    def died(self) -> str:
        """How the process ended, in words; waits a moment for it."""
        try:
            code = self.child.wait(timeout=5)
        except subprocess.TimeoutExpired:
            return "its process stopped answering"
        if code < 0:
            return f"its process died of {signal.Signals(-code).name}"
        return f"its process ended with status {code}"

    def stop(self) -> None:
        """End the process, whatever it is doing."""
        with contextlib.suppress(ProcessLookupError):  # it leads a session: what it started ends with it
            os.killpg(self.child.pid, signal.SIGKILL)
        self.child.wait()
        self.pipe.close()
        self.lifeline.close()
        self.progress.close()
        self.progress_file.close()


class Workers:
    """Solver processes, one per library, started when first needed; a context manager that ends them all.

    stopped : once set, work in progress is left: what was answered stays, the rest is NOT_RUN
    """

    def __init__(self, stopped: threading.Event | None = None) -> None:
        self._processes: dict[str, Process] = {}
        self._stopped = stopped or threading.Event()
        self._stuck: dict[str, str] = {}  # libraries that did not start, by module

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, *_: Any) -> None:
        for process in self._processes.values():
            process.stop()
        self._processes.clear()

    def solve(
        self, backend: str, qp: QP, *, settings: str = "high_accuracy", time_limit: float = 2.0, patience: int | None = None,
        follows: Array | None = None, start: Start | None = None,
    ) -> Answers:  # fmt: skip
        """Answers of `backend` to the stack `qp`.

        time_limit : seconds for one problem, building included
        patience : deaths and overruns after which the rest is left NOT_RUN; None never gives up
        follows : (B,) which members are started from the answer to the member before them; that one having failed, or
            died, they are started cold. None: all are cold
        start : where the first member is started

        Raises
        ------
        UnknownNameError
            if there is no such backend or settings level.
        RefusalError
            if the backend takes no starting point.
        """
        if backend not in BACKENDS:
            raise UnknownNameError.of("backend", backend, BACKENDS)
        if settings not in VERIFIED_RELATIVE:
            raise UnknownNameError.of("settings level", settings, VERIFIED_RELATIVE)
        row = BACKENDS[backend]
        if not row.warm and (follows is not None or start is not None):
            raise RefusalError(f"{backend} takes no starting point; its row in the table of backends would name how")
        chain = Chain(np.zeros(len(qp), dtype=bool) if follows is None else follows, start)
        answers = Answers.empty(qp)
        todo = np.arange(len(qp))
        failures = 0
        while len(todo):
            if patience is not None and failures >= patience:
                answers.fail(todo, Status.NOT_RUN, "stopped here: too many crashes or time-outs in this set")
                break
            answers, todo, failed = self._attempt(row, qp, settings, time_limit, answers, todo, chain)
            failures += failed
        late = answers.runtime > time_limit
        answers.status[late] = CODE[Status.TIMED_OUT]
        return answers

    def _attempt(
        self, row: Backend, qp: QP, settings: str, time_limit: float, answers: Answers, todo: Array, chain: Chain
    ) -> tuple[Answers, Array, int]:
        """Solve members `todo` until done or until the process fails; what is left to do and failures (0 or 1)."""
        if row.module in self._stuck:
            return self._missing(row, answers, todo, self._stuck[row.module]), todo[:0], 0
        process = self._processes.get(row.library)
        if process is None:
            process = self._processes[row.library] = Process(row.module)
        part = qp[todo]
        done = 0
        opening = time.monotonic()
        try:
            process.pipe.send((row.engine, settings, part.H, part.g, part.A, part.b, *chain.of(todo, answers)))
            while True:
                if self._stopped.is_set():
                    self._drop(row.library)
                    answers.fail(todo[done:], Status.NOT_RUN, "interrupted")
                    return answers, todo[:0], 0
                if not process.pipe.poll(POLL):
                    position, begun = process.position()
                    if position >= 0 and time.monotonic() - begun > time_limit:
                        # what it had solved but not sent yet is lost with it: it stays in `todo`
                        return self._fell(row, answers, todo, done, position, Status.TIMED_OUT, f"overran {time_limit:g} s")
                    if answers.engine is None and time.monotonic() - opening > OPENING_LIMIT:
                        self._drop(row.library)
                        self._stuck[row.module] = f"did not start in {OPENING_LIMIT:g} s"
                        return self._missing(row, answers, todo, self._stuck[row.module]), todo[:0], 0
                    continue
                kind, content = process.pipe.recv()
                if kind == "cannot open":
                    return self._missing(row, answers, todo, content), todo[:0], 0
                if kind == "open":
                    answers = replace(answers, engine=content)
                    continue
                for answer in content:
                    answers.put(int(todo[done]), answer)
                    done += 1
                if kind == "done":
                    return answers, todo[:0], 0
        except (EOFError, BrokenPipeError, ConnectionResetError):
            position, _ = process.position()
            words = process.died()
            if position < 0 and answers.engine is None:
                self._drop(row.library)
                return self._missing(row, answers, todo, f"could not start: {words}"), todo[:0], 0
            return self._fell(row, answers, todo, done, position, Status.CRASHED, words)
        except BaseException:  # an interrupted conversation cannot be taken up again
            self._drop(row.library)
            raise

    def _missing(self, row: Backend, answers: Answers, todo: Array, why: str) -> Answers:
        """The backend cannot be opened: said once, with the way out."""
        why = f"{why}; install it with: {row.install}"
        answers.fail(todo, Status.NOT_RUN, why)
        return replace(answers, absent=why)

    def _fell(
        self, row: Backend, answers: Answers, todo: Array, done: int, position: int, status: Status, said: str
    ) -> tuple[Answers, Array, int]:
        """The process failed at `position` of `todo`: that one is lost, all others unanswered are done again."""
        self._drop(row.library)
        position = max(position, done)
        answers.fail(todo[position : position + 1], status, said)
        return answers, np.concatenate([todo[done:position], todo[position + 1 :]]), 1

    def _drop(self, library: str) -> None:
        self._processes.pop(library).stop()
