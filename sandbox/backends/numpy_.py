"""numpy: least squares on the KKT system, the first thing an engineer types.

method      [H A'; A 0] (x, y) = (-g, b) by numpy.linalg.lstsq (singular values, smallest-norm solution)
H           any symmetric: a stationary point is all it looks for, minimum or not
A           any; dependent rows give the y of smallest norm, inconsistent ones a compromise
warm        nothing to start
default     rcond = machine epsilon times the size; it factors, so there is no stopping tolerance
y           ours: Hx + g + A'y = 0
documents   https://numpy.org/doc/stable/reference/generated/numpy.linalg.lstsq.html
"""

from __future__ import annotations

from time import perf_counter

import numpy as np

from sandbox.backends.backend import Answer, Array, Engine, version
from sandbox.solution import Status


def open_engine(engine: str, settings: str) -> Engine:
    """Least squares on the KKT system; `engine` is "lstsq", and no settings level changes it."""

    def solve(H: Array, g: Array, A: Array, b: Array) -> Answer:
        start = perf_counter()
        n, p = len(g), len(b)
        K = np.zeros((n + p, n + p))
        K[:n, :n], K[:n, n:], K[n:, :n] = H, A.T, A
        right = np.concatenate((-g, b))
        built = perf_counter()
        z, _, rank, _ = np.linalg.lstsq(K, right, rcond=None)
        done = perf_counter()
        said = f"rank {rank} of {n + p}"
        return Answer(z[:n], z[n:], Status.SOLVED, said, None, built - start, done - built)

    return Engine(solve, {"rcond": None}, (0.0, 0.0, 0.0, 0.0), version("numpy"), version("numpy"))
