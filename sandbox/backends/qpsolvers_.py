"""qpsolvers: eleven engines behind one function, solve_problem.

engine      method                               H                        A          default tolerance
clarabel    interior point, homogeneous          psd                      silent     tol_feas = tol_gap = 1e-8
cvxopt      interior point; with equality rows   psd                      full rank  none: one factorisation
            only, one LDL' or Cholesky solve
daqp        dual active set, proximal if         psd ("pd", and "psd      silent     primal_tol 1e-6, dual_tol 1e-12
            H is singular                        through proximal-point")
ecos        interior point on the cone form      pd (Cholesky by          silent     feastol = abstol = 1e-8
                                                 qpsolvers)
highs       primal active set, adds 1e-7 I       psd                      silent     feasibility tolerances 1e-7
osqp        operator splitting (ADMM)            psd                      any        eps_abs = eps_rel = 1e-3
piqp        proximal interior point              psd                      any        eps_abs 1e-8, eps_rel 1e-9
proxqp      proximal augmented Lagrangian        psd                      silent     eps_abs = 1e-5
qpalm       proximal augmented Lagrangian        psd here; "possibly      silent     eps_abs = eps_rel = 1e-4
                                                 nonconvex" natively
quadprog    dual active set (Goldfarb-Idnani)    pd                       silent     none
scs         operator splitting on the cone form  psd                      silent     eps_abs = eps_rel = 1e-4

y           ours for all: Hx + g + A'y = 0 (qpsolvers turns those of quadprog and HiGHS)
warm        initvals, which is x: osqp, proxqp (its y as well), scs (from slacks and multipliers 0, so it saves little);
            daqp takes it for a guess of the active rows, and equality rows always are; qpalm drops it, whatever its
            documentation says; the others ignore it
no rows     qpsolvers answers clarabel's and scs's with SciPy's LSQR: not these engines, so not asked
reasons     qpsolvers passes DAQP's exit flag and HiGHS's model status on as found or not found; they are
            read from the engine's own return here, the answer itself is qpsolvers'
documents   https://qpsolvers.github.io/qpsolvers
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from time import perf_counter
from types import SimpleNamespace
from typing import Any

import numpy as np

from sandbox.backends.backend import Answer, Array, Engine, Start, attributes, plain, status_of, version
from sandbox.solution import Status
from sandbox.tolerances import ASKED, UNIT

SPARSE = frozenset({"clarabel", "highs", "osqp", "qpalm", "scs"})
"""Engines that take sparse matrices only; given dense ones qpsolvers converts them and warns."""

DAQP = {
    1: (Status.SOLVED, "optimal"),
    2: (Status.SOLVED, "soft optimal"),
    -1: (Status.INFEASIBLE, "infeasible"),
    -2: (Status.FAILED, "cycling detected"),
    -3: (Status.UNBOUNDED, "unbounded problem"),
    -4: (Status.LIMIT, "iteration limit reached"),
    -5: (Status.NONCONVEX, "nonconvex problem"),
    -6: (Status.RANK_DEFICIENT, "initial working set overdetermined"),
    -7: (Status.LIMIT, "time limit reached"),
    -8: (Status.FAILED, "unsupported problem"),
}
"""DAQP's exit flags, https://darnstrom.github.io/daqp/parameters."""

SCS = {1: Status.SOLVED, 2: Status.LIMIT, -1: Status.UNBOUNDED, -2: Status.INFEASIBLE, -6: Status.UNBOUNDED,
       -7: Status.INFEASIBLE}  # fmt: skip
"""SCS's status_val; the rest failed."""

SCS_DEFAULTS = {
    "eps_abs": 1e-4, "eps_rel": 1e-4, "eps_infeas": 1e-7, "max_iters": 100000, "alpha": 1.5, "rho_x": 1e-6, "scale": 0.1,
    "adaptive_scale": True, "normalize": True, "acceleration_lookback": 10, "acceleration_interval": 10,
}  # fmt: skip
"""As documented, https://www.cvxgrp.org/scs/api/settings.html: SCS cannot be asked."""

ECOS_DEFAULTS = {
    "feastol": 1e-8, "abstol": 1e-8, "reltol": 1e-8, "feastol_inacc": 1e-4, "abstol_inacc": 5e-5, "reltol_inacc": 5e-5,
    "max_iters": 100, "nitref": 9,
}  # fmt: skip
"""As in ecos.h: ECOS cannot be asked."""

CVXOPT_DEFAULTS = {"feastol": 1e-7, "abstol": 1e-7, "reltol": 1e-6, "maxiters": 100}
"""As in cvxopt/coneprog.py; without inequalities none of them is looked at."""


def asked(engine: str, tolerance: float) -> dict[str, Any]:
    """Keywords that ask `engine` for an absolute tolerance, relative 0 where it has one."""
    if engine in ("osqp", "proxqp", "qpalm", "scs"):
        return {"eps_abs": tolerance, "eps_rel": 0.0}
    return {
        "clarabel": {"tol_feas": tolerance, "tol_gap_abs": tolerance, "tol_gap_rel": 0.0},
        "cvxopt": {"feastol": tolerance, "abstol": tolerance, "reltol": 0.0},
        "daqp": {"primal_tol": tolerance},  # its dual_tol, 1e-12, is tighter already
        "ecos": {"feastol": tolerance, "abstol": tolerance, "reltol": UNIT},  # it insists on a positive one
        "highs": dict.fromkeys(
            ("primal_feasibility_tolerance", "dual_feasibility_tolerance", "primal_residual_tolerance",
             "dual_residual_tolerance", "optimality_tolerance"), tolerance),
        "piqp": {"eps_abs": tolerance, "eps_rel": 0.0, "eps_duality_gap_abs": tolerance, "eps_duality_gap_rel": 0.0},
        "quadprog": {},
    }[engine]  # fmt: skip


def open_engine(engine: str, settings: str) -> Engine:
    """One engine of qpsolvers at a settings level.

    Raises ImportError where qpsolvers or the engine is missing.
    """
    import qpsolvers
    from scipy.sparse import csc_matrix

    if engine not in qpsolvers.available_solvers:
        raise ImportError(f"qpsolvers does not find {engine}; it finds {', '.join(qpsolvers.available_solvers)}")
    options: dict[str, Any] = {} if settings == "default" else asked(engine, ASKED[settings])
    form: Any = csc_matrix if engine in SPARSE else np.array  # a copy: some engines insist on writable memory
    kept = _keep_reason(engine)
    quiet: dict[str, Any] = {"raise_error": False} if engine == "osqp" else {}  # its default; unsaid, OSQP warns of it
    outcome = OUTCOMES[engine]

    def solve(H: Array, g: Array, A: Array, b: Array, start: Start | None = None) -> Answer:
        begun = perf_counter()
        rows = (form(A), np.array(b)) if len(b) else (None, None)
        problem = qpsolvers.Problem(form(H), np.array(g), None, None, *rows)
        built = perf_counter()
        guess: dict[str, Any] = {} if start is None else {"initvals": start.x}
        if start is not None and engine == "proxqp":
            guess["y"] = start.y  # without it qpsolvers starts y at 0
        solution = qpsolvers.solve_problem(problem, engine, **guess, **options, **quiet)
        done = perf_counter()
        solve_time = solution.solve_time if solution.solve_time is not None else done - built
        status, said, iterations = outcome(solution, kept)
        y = np.empty(0) if not len(b) and solution.x is not None else solution.y
        y = None if y is None else np.asarray(y, dtype=float)
        return Answer(solution.x, y, status, said, iterations, done - begun - solve_time, solve_time)

    taken, eps = _effective(engine, options)
    return Engine(solve, taken, eps, version("qpsolvers"), _engine_version(engine))


def _engine_version(engine: str) -> str:
    return version({"highs": "highspy", "proxqp": "proxsuite"}.get(engine, engine))


def _effective(engine: str, options: dict[str, Any]) -> tuple[dict[str, Any], tuple[float, float, float, float]]:
    """Settings in force and the stopping tolerances among them, read from the engine where it can be asked."""
    if engine == "quadprog":
        return {}, (0.0, 0.0, 0.0, 0.0)
    if engine == "cvxopt":
        return {**CVXOPT_DEFAULTS, **options}, (0.0, 0.0, 0.0, 0.0)  # no inequality: one factorisation, nothing to stop
    taken: dict[str, Any]
    if engine == "clarabel":
        import clarabel

        taken = attributes(_with(clarabel.DefaultSettings(), options), {"pardiso_iparm", "verbose"})
        tolerance = taken["tol_feas"]  # times max(1, scale)
        return taken, (tolerance, tolerance, tolerance, tolerance)
    if engine == "daqp":
        import daqp

        one = np.ones(1)
        model = daqp.Model()
        model.setup(np.eye(1), one, np.eye(1), one, one, np.full(1, 5, dtype=np.int32))
        model.settings = {**model.settings, **options}
        taken = plain(model.settings)
        return taken, (taken["primal_tol"], 0.0, taken["dual_tol"], 0.0)
    if engine == "ecos":
        taken = {**ECOS_DEFAULTS, **options}
        return taken, (taken["feastol"],) * 4  # times max(1, scale)
    if engine == "highs":
        import highspy

        highs = highspy.Highs()
        highs.setOptionValue("output_flag", False)
        for name, value in options.items():
            highs.setOptionValue(name, value)
        of_others = ("mip_", "pdlp_", "simplex_", "ipx_", "ipm_", "log_", "write_", "read_", "output_", "solution_")
        taken = {name: value for name, value in attributes(highs.getOptions()).items() if not name.startswith(of_others)}
        return taken, (taken["primal_feasibility_tolerance"], 0.0, taken["dual_feasibility_tolerance"], 0.0)
    if engine == "osqp":
        import osqp
        from scipy.sparse import eye

        probe = osqp.OSQP()
        probe.setup(eye(1, format="csc"), np.ones(1), eye(1, format="csc"), np.ones(1), np.ones(1), verbose=False, **options)
        taken = attributes(probe.settings)
    elif engine == "piqp":
        import piqp

        taken = attributes(_with(piqp.DenseSolver().settings, options))
    elif engine == "proxqp":
        from proxsuite import proxqp

        taken = attributes(_with(proxqp.dense.QP(1, 1, 0).settings, options))
    elif engine == "qpalm":
        import qpalm

        taken = attributes(_with(qpalm.Settings(), options), {"verbose", "print_iter"})
    else:
        taken = {**SCS_DEFAULTS, **options}
    return taken, (taken["eps_abs"], taken["eps_rel"], taken["eps_abs"], taken["eps_rel"])


def _with(holder: Any, options: dict[str, Any]) -> Any:
    for name, value in options.items():
        setattr(holder, name, value)
    return holder


@cache  # every settings level shares the one place
def _keep_reason(engine: str) -> dict[str, Any]:
    """Where the engine's own return is kept; filled for the two whose reason qpsolvers drops."""
    kept: dict[str, Any] = {}
    if engine == "daqp":
        import daqp
        from qpsolvers.solvers import daqp_

        def solve_kept(*arguments: Any, **keywords: Any) -> Any:
            kept["result"] = daqp.solve(*arguments, **keywords)
            return kept["result"]

        setattr(daqp_, "daqp", SimpleNamespace(solve=solve_kept))  # noqa: B010 (a module in mypy's eyes)
    elif engine == "highs":
        import highspy
        from qpsolvers.solvers import highs_

        class Kept(highspy.Highs):
            def run(self) -> Any:
                status = super().run()
                kept["status"], kept["info"] = self.getModelStatus(), self.getInfo()
                return status

        setattr(highs_, "highspy", SimpleNamespace(**{**vars(highspy), "Highs": Kept}))  # noqa: B010
    return kept


Outcome = tuple[Status, str, "int | None"]


def _clarabel(solution: Any, kept: dict[str, Any]) -> Outcome:
    said = str(solution.extras["status"])
    return Status.SOLVED if said == "Solved" else status_of(_spaced(said)), said, None


def _cvxopt(solution: Any, kept: dict[str, Any]) -> Outcome:
    said = solution.extras["status"]
    return Status.SOLVED if solution.found else status_of(said), said, solution.extras.get("iterations")


def _daqp(solution: Any, kept: dict[str, Any]) -> Outcome:
    *_, flag, info = kept["result"]
    status, said = DAQP.get(flag, (Status.FAILED, "unknown exit flag"))
    return status, f"exit flag {flag}: {said}", int(info["iterations"])


def _ecos(solution: Any, kept: dict[str, Any]) -> Outcome:
    said, iterations = solution.extras["infostring"], int(solution.extras["iter"])
    if solution.found:
        return Status.SOLVED, said, iterations
    known = {1: Status.INFEASIBLE, 11: Status.INFEASIBLE, 2: Status.UNBOUNDED, 12: Status.UNBOUNDED, 10: Status.LIMIT,
             -1: Status.LIMIT, -2: Status.LIMIT}  # fmt: skip
    return known.get(solution.extras["exitFlag"], Status.FAILED), said, iterations


def _highs(solution: Any, kept: dict[str, Any]) -> Outcome:
    said = kept["status"].name.removeprefix("k")
    status = Status.SOLVED if said == "Optimal" else status_of(_spaced(said))
    return status, said, int(kept["info"].qp_iteration_count)


def _osqp(solution: Any, kept: dict[str, Any]) -> Outcome:
    from sandbox.backends.osqp_ import STATUS

    info = solution.extras["info"]
    return STATUS.get(int(info.status_val), Status.FAILED), info.status, int(info.iter)


def _piqp(solution: Any, kept: dict[str, Any]) -> Outcome:
    info = solution.extras["info"]
    said = info.status.name
    return Status.SOLVED if said == "PIQP_SOLVED" else status_of(said), said, int(info.iter)


def _proxqp(solution: Any, kept: dict[str, Any]) -> Outcome:
    from sandbox.backends.proxsuite_ import STATUS

    info = solution.extras["info"]
    said = str(plain(info.status))
    return STATUS.get(said, Status.FAILED), said, int(info.iter)


def _qpalm(solution: Any, kept: dict[str, Any]) -> Outcome:
    info = solution.extras["info"]
    return Status.SOLVED if info.status == "solved" else status_of(info.status), info.status, int(info.iter)


def _quadprog(solution: Any, kept: dict[str, Any]) -> Outcome:
    if solution.found:
        return Status.SOLVED, "found", int(solution.extras["iterations"][0])
    return Status.INFEASIBLE, "constraints are inconsistent, no solution", None  # all else qpsolvers raises or warns of


def _scs(solution: Any, kept: dict[str, Any]) -> Outcome:
    return SCS.get(solution.extras["status_val"], Status.FAILED), solution.extras["status"], int(solution.extras["iter"])


def _spaced(name: str) -> str:
    return "".join(f" {letter}" if letter.isupper() else letter for letter in name).strip()


OUTCOMES: dict[str, Callable[[Any, dict[str, Any]], Outcome]] = {
    "clarabel": _clarabel, "cvxopt": _cvxopt, "daqp": _daqp, "ecos": _ecos, "highs": _highs, "osqp": _osqp, "piqp": _piqp,
    "proxqp": _proxqp, "qpalm": _qpalm, "quadprog": _quadprog, "scs": _scs,
}  # fmt: skip
"""What a qpsolvers solution amounts to, engine by engine: status, words, iterations."""
