"""proxsuite: ProxQP, dense and sparse, through its own Python interface.

method      proximal augmented Lagrangian with a semi-smooth Newton inner solver
H           positive semidefinite; nonconvex only when told the smallest eigenvalue, which is not done here
A           documentation silent
default     eps_abs = 1e-5, eps_rel = 0, at most 10000 outer iterations
y           ours: Hx + g + A'y = 0
cold        starts from the solution of the equality-constrained problem, which is the whole problem here
warm        solve(x, y, z), z being empty; this replaces that first solution
documents   https://simple-robotics.github.io/proxsuite
"""

from __future__ import annotations

from time import perf_counter
from typing import Any

import numpy as np

from sandbox.backends.backend import Answer, Array, Engine, Start, attributes, plain, version
from sandbox.solution import Status
from sandbox.tolerances import ASKED

STATUS = {
    "PROXQP_SOLVED": Status.SOLVED,
    "PROXQP_MAX_ITER_REACHED": Status.LIMIT,
    "PROXQP_PRIMAL_INFEASIBLE": Status.INFEASIBLE,
    "PROXQP_SOLVED_CLOSEST_PRIMAL_FEASIBLE": Status.INFEASIBLE,
    "PROXQP_DUAL_INFEASIBLE": Status.UNBOUNDED,
}
"""ProxQP's status by name; PROXQP_NOT_RUN failed."""


def open_engine(engine: str, settings: str) -> Engine:
    """ProxQP at a settings level; `engine` is "dense" or "sparse"."""
    from proxsuite import proxqp
    from scipy.sparse import csc_matrix

    module = proxqp.dense if engine == "dense" else proxqp.sparse
    form: Any = (lambda M: M) if engine == "dense" else csc_matrix

    def new(n: int, p: int) -> Any:
        qp = module.QP(n, p, 0)
        if settings != "default":
            qp.settings.eps_abs, qp.settings.eps_rel = ASKED[settings], 0.0
        return qp

    def solve(H: Array, g: Array, A: Array, b: Array, start: Start | None = None) -> Answer:
        begun = perf_counter()
        qp = new(len(g), len(b))
        qp.init(form(H), g, form(A) if len(b) else None, b if len(b) else None)
        built = perf_counter()
        qp.solve(*(() if start is None else (start.x, start.y, np.empty(0))))
        done = perf_counter()
        results, info = qp.results, qp.results.info
        said = str(plain(info.status))
        status = STATUS.get(said, Status.FAILED)
        return Answer(results.x.copy(), results.y.copy(), status, said, int(info.iter), built - begun, done - built)

    taken = attributes(new(1, 1).settings)
    eps = (taken["eps_abs"], taken["eps_rel"], taken["eps_abs"], taken["eps_rel"])
    return Engine(solve, taken, eps, version("proxsuite"), version("proxsuite"))
