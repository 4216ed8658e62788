"""The child process of one solver library: reads stacks of QPs from a pipe, answers problem by problem.

Started by worker.py as `python -m sandbox.solver_process MODULE FD PROGRESS_FD LIFELINE_FD`. What the solver prints to
the descriptors 1 and 2 is caught and kept as its own words.
"""

from __future__ import annotations

import contextlib
import ctypes
import fcntl
import mmap
import os
import struct
import sys
import tempfile
import time
from collections.abc import Iterator
from multiprocessing.connection import Connection
from typing import Any

from sandbox.backends.backend import Start, opened

PROGRESS = struct.Struct("qd")
"""Position of the problem being solved and when it was begun (time.monotonic, s); inf while nothing is."""

SEND_EVERY = 0.05
"""Seconds between two batches of answers: what dies unsent is solved again."""

KEPT_WORDS = 600
"""Characters of a solver's print-out that are kept per problem."""

MEMORY_LIMIT = 8 << 30
"""Address space of a solver process: a solver that allocates without limit dies alone."""


class PrintOut:
    """Catches what C and Python code write to the descriptors 1 and 2."""

    def __init__(self) -> None:
        self.file = tempfile.TemporaryFile()
        self.libc = ctypes.CDLL(None)
        for descriptor in (1, 2):
            os.dup2(self.file.fileno(), descriptor)

    def take(self) -> str:
        """What was printed since the last call, shortened in the middle."""
        sys.stdout.flush()
        sys.stderr.flush()
        self.libc.fflush(None)
        size = os.fstat(self.file.fileno()).st_size
        if size == 0:
            return ""
        head = os.pread(self.file.fileno(), KEPT_WORDS, 0)
        tail = os.pread(self.file.fileno(), KEPT_WORDS, max(KEPT_WORDS, size - KEPT_WORDS))
        os.ftruncate(self.file.fileno(), 0)
        for descriptor in (1, 2):  # the descriptors share the file's offset
            os.lseek(descriptor, 0, os.SEEK_SET)
        text = head.decode(errors="replace")
        if size > KEPT_WORDS:
            text = text[: KEPT_WORDS // 2] + " [...] " + tail.decode(errors="replace")[-KEPT_WORDS // 2 :]
        return text.strip()


class SolverProcess:
    """Serves one library until the pipe closes."""

    def __init__(self, module: str, pipe: Connection, progress: mmap.mmap) -> None:
        self.pipe = pipe
        self.progress = progress
        self.printed = PrintOut()
        self.module = module
        self.engines: dict[tuple[str, str], Any] = {}

    def mark(self, position: int, begun: float) -> None:
        """Tell the parent what is being solved since when."""
        self.progress[: PROGRESS.size] = PROGRESS.pack(position, begun)

    def engine(self, name: str, settings: str) -> Any:
        """The engine at a settings level, opened once."""
        key = (name, settings)
        if key not in self.engines:
            self.engines[key] = opened(self.module, name, settings)
            self.printed.take()
        return self.engines[key]

    def answers(
        self, engine: Any, H: Any, g: Any, A: Any, b: Any, follows: Any, start: Start | None
    ) -> Iterator[tuple[Any, ...]]:
        """One tuple per problem: x, y, status name, words, iterations, build, solve and wall time.

        follows (B,) : whether a problem starts from the answer to the one before; start : where the first one starts
        """
        for i in range(len(g)):
            given = (H[i], g[i], A[i], b[i]) if start is None else (H[i], g[i], A[i], b[i], start)
            self.mark(i, time.monotonic())
            begun = time.perf_counter()
            answer = engine.solve(*given)
            wall = time.perf_counter() - begun
            going_on = i + 1 < len(g) and follows[i + 1]
            start = Start.after(answer.status, answer.x, answer.y, *A[i].shape[::-1]) if going_on else None
            printed = self.printed.take()
            said = f"{answer.said} | {printed}" if printed else answer.said
            yield (
                answer.x,
                answer.y,
                answer.status.name,
                said,
                answer.iterations,
                answer.build_time,
                answer.solve_time,
                wall,
            )

    def serve(self) -> None:
        """Answer requests (engine, settings, H, g, A, b, follows, start) until the parent hangs up."""
        while True:
            try:
                name, settings, *qp = self.pipe.recv()
            except EOFError:
                return
            self.mark(-1, float("inf"))
            try:
                engine = self.engine(name, settings)
            except Exception as error:  # the library is missing or cannot load: the run goes on without it
                self.pipe.send(("cannot open", f"{type(error).__name__}: {error}"))
                continue
            self.pipe.send(("open", engine._replace(solve=None)))
            batch: list[tuple[Any, ...]] = []
            sent = time.monotonic()
            for answer in self.answers(engine, *qp):
                batch.append(answer)
                now = time.monotonic()
                if now - sent > SEND_EVERY:
                    self.pipe.send(("answers", batch))
                    batch, sent = [], now
            self.mark(-1, float("inf"))
            self.pipe.send(("done", batch))


def die_with_parent(lifeline: int) -> None:
    """End this process when the parent's end of the socket `lifeline` closes, even in the middle of a solver's C code.

    The hang-up raises SIGIO, whose default action terminates: it needs neither the interpreter nor its lock.
    """
    fcntl.fcntl(lifeline, fcntl.F_SETOWN, os.getpid())
    fcntl.fcntl(lifeline, fcntl.F_SETFL, fcntl.fcntl(lifeline, fcntl.F_GETFL) | os.O_ASYNC)


def main(module: str, descriptor: int, progress: int, lifeline: int) -> None:
    """Serve the library file `module` over the pipe at `descriptor`."""
    die_with_parent(lifeline)
    with contextlib.suppress(ImportError, ValueError, OSError):  # no such limit on this system: run without it
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_LIMIT, MEMORY_LIMIT))
    pipe = Connection(descriptor)
    SolverProcess(module, pipe, mmap.mmap(progress, mmap.PAGESIZE)).serve()


if __name__ == "__main__":
    main(sys.argv[1], *map(int, sys.argv[2:]))
