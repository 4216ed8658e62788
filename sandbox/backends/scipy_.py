"""scipy: minimize with SLSQP and with trust-constr, exact derivatives given.

method      slsqp: sequential least squares with a BFGS matrix (it never sees H);
            trust-constr: Byrd-Omojokun trust-region SQP with the exact Hessian
H           documentation silent: general nonlinear minimisers
A           documentation silent
default     slsqp ftol = 1e-6, at most 100 iterations; trust-constr gtol = xtol = 1e-8, at most 1000
y           trust-constr ours, Hx + g + A'y = 0; slsqp the opposite, turned here
cold        x0 = 0
warm        x0; neither takes multipliers. slsqp stops on the last change of the objective, which is small from the start
            when it begins near the minimiser: it then stops early
documents   https://docs.scipy.org/doc/scipy/reference/generated/scipy.optimize.minimize.html
"""

from __future__ import annotations

from time import perf_counter
from typing import Any

import numpy as np

from sandbox.backends.backend import Answer, Array, Engine, Solve, Start, version
from sandbox.solution import Status
from sandbox.tolerances import ASKED

SLSQP = {
    0: Status.SOLVED,
    3: Status.LIMIT,  # more than 3 n iterations in the least-squares subproblem
    4: Status.INFEASIBLE,
    6: Status.RANK_DEFICIENT,  # singular matrix C (the equality rows) in the subproblem
    7: Status.RANK_DEFICIENT,
    8: Status.LIMIT,  # the line search finds no descent: it stalls short of ftol
    9: Status.LIMIT,
}
"""SLSQP's exit modes; the rest failed."""

TRUST_CONSTR = {0: Status.LIMIT, 1: Status.SOLVED, 2: Status.SOLVED, 4: Status.LIMIT}
"""trust-constr's statuses: iteration limit, gtol, xtol, xtol with the rows not met; the rest failed."""


def open_engine(engine: str, settings: str) -> Engine:
    """SciPy's minimize at a settings level; `engine` is "slsqp" or "trust-constr"."""
    tolerance = None if settings == "default" else ASKED[settings]
    if engine == "slsqp":
        taken: dict[str, Any] = {"ftol": tolerance or 1e-6, "maxiter": 100}  # 1e-6, 100: SciPy's own defaults
        solve, eps = _slsqp(taken), taken["ftol"]
    else:
        taken = {"gtol": tolerance or 1e-8, "xtol": tolerance or 1e-8, "maxiter": 1000}  # SciPy's own defaults
        solve, eps = _trust_constr(taken), taken["gtol"]
    return Engine(solve, {**taken, "x0": "zeros"}, (eps, 0.0, eps, 0.0), version("scipy"), version("scipy"))


def _slsqp(options: dict[str, Any]) -> Solve:
    from scipy.optimize import minimize

    def solve(H: Array, g: Array, A: Array, b: Array, start: Start | None = None) -> Answer:
        begun = perf_counter()
        rows = [{"type": "eq", "fun": lambda x: A @ x - b, "jac": lambda x: A}] if len(b) else []
        built = perf_counter()
        result = minimize(
            lambda x: (0.5 * (x @ (Hx := H @ x)) + g @ x, Hx + g),
            np.zeros(len(g)) if start is None else start.x,
            jac=True,
            method="SLSQP",
            constraints=rows,
            options=options,
        )
        done = perf_counter()
        status = SLSQP.get(int(result.status), Status.FAILED)
        y = -np.asarray(result.multipliers) if "multipliers" in result else None
        return Answer(result.x, y, status, result.message, int(result.nit), built - begun, done - built)

    return solve


def _trust_constr(options: dict[str, Any]) -> Solve:
    from scipy.optimize import LinearConstraint, minimize

    def solve(H: Array, g: Array, A: Array, b: Array, start: Start | None = None) -> Answer:
        begun = perf_counter()
        rows = [LinearConstraint(A, b, b)] if len(b) else []
        built = perf_counter()
        result = minimize(
            lambda x: (0.5 * (x @ (Hx := H @ x)) + g @ x, Hx + g),
            np.zeros(len(g)) if start is None else start.x,
            jac=True,
            hess=lambda x: H,
            method="trust-constr",
            constraints=rows,
            options=options,
        )
        done = perf_counter()
        status = TRUST_CONSTR.get(int(result.status), Status.FAILED)
        y = np.asarray(result.v[0]) if len(b) else np.empty(0)
        return Answer(result.x, y, status, result.message, int(result.nit), built - begun, done - built)

    return solve
