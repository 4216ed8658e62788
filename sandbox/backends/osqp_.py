"""osqp: the OSQP engine through its own Python interface.

method      operator splitting (ADMM), first order, optional polishing (off by default)
H           positive semidefinite; a factorisation at set-up refuses some indefinite ones ("non-convex")
A           any; no assumption on the rank
default     eps_abs = eps_rel = 1e-3, at most 4000 iterations; a duality gap is checked too
y           ours: Hx + g + A'y = 0
warm        warm_start(x, y) after the set-up
documents   https://osqp.org/docs
"""

from __future__ import annotations

from time import perf_counter

import numpy as np

from sandbox.backends.backend import Answer, Array, Engine, Start, attributes, version
from sandbox.solution import Status
from sandbox.tolerances import ASKED

STATUS = {
    1: Status.SOLVED,
    2: Status.LIMIT,  # solved inaccurate
    3: Status.INFEASIBLE,
    4: Status.INFEASIBLE,  # inaccurate certificate
    5: Status.UNBOUNDED,
    6: Status.UNBOUNDED,  # inaccurate certificate
    7: Status.LIMIT,
    8: Status.LIMIT,
    9: Status.NONCONVEX,
}
"""OSQP's status_val; the rest (interrupted, unsolved) failed."""


def open_engine(engine: str, settings: str) -> Engine:
    """OSQP at a settings level; `engine` is "osqp"."""
    import osqp
    from scipy.sparse import csc_matrix

    options = {} if settings == "default" else {"eps_abs": ASKED[settings], "eps_rel": 0.0}

    def solve(H: Array, g: Array, A: Array, b: Array, start: Start | None = None) -> Answer:
        begun = perf_counter()
        engine = osqp.OSQP()
        if len(b):
            engine.setup(csc_matrix(H), g, csc_matrix(A), b, b, verbose=False, **options)
        else:
            engine.setup(csc_matrix(H), g, None, None, None, verbose=False, **options)
        if start is not None:
            engine.warm_start(*start)
        built = perf_counter()
        result = engine.solve(raise_error=False)
        done = perf_counter()
        status = STATUS.get(int(result.info.status_val), Status.FAILED)
        return Answer(result.x, result.y, status, result.info.status, int(result.info.iter), built - begun, done - built)

    probe = osqp.OSQP()
    probe.setup(csc_matrix(np.eye(1)), np.ones(1), csc_matrix(np.eye(1)), np.ones(1), np.ones(1), verbose=False, **options)
    taken = attributes(probe.settings)
    eps = (taken["eps_abs"], taken["eps_rel"], taken["eps_abs"], taken["eps_rel"])
    return Engine(solve, taken, eps, version("osqp"), version("osqp"))
