"""A library that fails in every way a solver can, on the problems that ask for it.

The first entry of g says what to do; everything else is answered by the KKT system. Its words tell where it started.
"""

from __future__ import annotations

import ctypes
import os
import time

import numpy as np

from sandbox.backends.backend import Answer, Engine, Start
from sandbox.solution import Status
from sandbox.solver_process import SEND_EVERY

SEGFAULT, HANG, SHOUT, GARBAGE, RAISE, EXIT, EAT, SHORT = 101.0, 102.0, 103.0, 104.0, 105.0, 106.0, 107.0, 108.0
STUCK, LIE, SLOW = 109.0, 110.0, 111.0


def solve(H: np.ndarray, g: np.ndarray, A: np.ndarray, b: np.ndarray, start: Start | None = None) -> Answer:
    """Misbehave as told, else solve."""
    n, p = H.shape[0], A.shape[0]
    if g[0] == SEGFAULT:
        ctypes.string_at(0)
    if g[0] == HANG:
        time.sleep(60)
    if g[0] == SHOUT:
        os.write(1, b"banner " * 200_000)
        os.write(2, b"the end")
    if g[0] == GARBAGE:
        return Answer(np.full(n, np.nan), np.full(p, np.inf), Status.SOLVED, "fine", 1, 0.0, 0.0)
    if g[0] == RAISE:
        raise RuntimeError("out of cheese")
    if g[0] == EXIT:
        os._exit(3)
    if g[0] == EAT:
        eaten = np.ones(1 << 34)
        return Answer(eaten[:n], None, Status.SOLVED, "fed", 1, 0.0, 0.0)
    if g[0] == SHORT:
        return Answer(np.zeros(n - 1), np.zeros(p), Status.SOLVED, "forgot one", 1, 0.0, 0.0)
    if g[0] == STUCK:
        ctypes.PyDLL(None).sleep(60)  # in C, holding the interpreter's lock
    if g[0] == LIE:
        return Answer(np.array(["a"] * n), np.full(p, 1j), Status.SOLVED, "\udcff", 10**12, 0.0, 0.0)  # type: ignore[arg-type]
    if g[0] == SLOW:
        time.sleep(1.5 * SEND_EVERY)  # what is answered is sent
    K = np.block([[H, A.T], [A, np.zeros((p, p))]])
    z = np.linalg.solve(K, np.concatenate([-g, b]))
    said = "solved" if start is None else f"solved from {start.x.tolist()}, {start.y.tolist()}"
    return Answer(z[:n], z[n:], Status.SOLVED, said, 1, 1e-6, 1e-6)


def open_engine(engine: str, settings: str) -> Engine:
    """`missing` cannot be opened; `bursts` dies while opening."""
    if engine == "missing":
        raise ImportError("No module named 'unruly'")
    if engine == "bursts":
        ctypes.string_at(0)
    return Engine(solve, {"settings": settings}, (0.0, 0.0, 0.0, 0.0), "1.0", "1.0")
