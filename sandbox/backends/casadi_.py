"""casadi: its conic plug-ins, and its nonlinear solvers ipopt and sqpmethod through nlpsol.

plug-in     method                                  default tolerance
qrqp        primal-dual active set, sparse QR       constr_viol_tol = dual_inf_tol = 1e-8
ipqp        Mehrotra interior point                 constr_viol_tol = dual_inf_tol = 1e-8
osqp        operator splitting (ADMM)               eps_abs = eps_rel = 1e-3
highs       primal active set, adds 1e-7 I          feasibility tolerances 1e-7
proxqp      proximal augmented Lagrangian           eps_abs = 1e-5
qpoases     online active set, dense                none that bounds a residual
daqp        dual active set                         primal_tol 1e-6, dual_tol 1e-12
fatrop      interior point for optimal control      tol 1e-8; takes no options (it swallows any name silently)
piqp        proximal interior point                 eps_abs 1e-8, eps_rel 1e-9
hpipm       interior point for optimal control      refuses dense rows
clp         simplex                                 the plug-in takes linear programs only
ipopt       interior point with line search         tol 1e-8, constr_viol_tol 1e-4, dual_inf_tol 1
sqpmethod   SQP with line search, QPs by qpoases    tol_pr = tol_du = 1e-6

H           "sparse (n x n) positive definite" for all conic plug-ins; ipopt "convex or non-convex"
A           documentation silent
y           ours: Hx + g + A'y = 0
cold        qpoases and osqp carry their working set and step size from call to call, so every solve gets
            a function of its own; its making is build time
warm        x0 and lam_a0 (nonlinear: lam_g0); measured, qrqp, osqp, ipqp, fatrop, ipopt and sqpmethod heed them, highs,
            qpoases, daqp, piqp and proxqp do not (whose warm_start_primal, by default true, has no effect on a new
            function); ipqp stays cold because its first answer is NaN
left out    superscs: takes 0.6 s to give up on an indefinite H, and 0.4 off with success where there are no rows
documents   https://web.casadi.org/docs and casadi.doc_conic(plug-in)
"""

from __future__ import annotations

from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from sandbox.backends.backend import Answer, Array, Engine, Solve, Start, status_of, version
from sandbox.solution import Status
from sandbox.tolerances import ASKED

SILENT: dict[str, dict[str, Any]] = {
    "qrqp": {"print_iter": False, "print_header": False, "print_info": False},
    "ipqp": {"print_iter": False, "print_header": False, "print_info": False},
    "osqp": {"osqp": {"verbose": False}},
    "highs": {"highs": {"output_flag": False}},
    "proxqp": {"proxqp": {"verbose": False}},
    "qpoases": {"printLevel": "none"},
    "fatrop": {"structure_detection": "none"},  # a dense QP is no optimal-control problem
    "ipopt": {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes"}},
    "sqpmethod": {
        "print_time": False, "print_header": False, "print_iteration": False, "print_status": False,
        "qpsol_options": {"printLevel": "none", "error_on_fail": False},
    },
}  # fmt: skip
"""Options that silence a plug-in. fatrop and qpoases still print; nothing can be done about it."""

DEFAULTS: dict[str, dict[str, Any]] = {
    "qrqp": {"constr_viol_tol": 1e-8, "dual_inf_tol": 1e-8, "max_iter": 1000, "min_lam": 0.0},
    "ipqp": {"constr_viol_tol": 1e-8, "dual_inf_tol": 1e-8, "max_iter": 1000, "min_lam": 0.0, "linear_solver": "ldl"},
    "osqp": {"eps_abs": 1e-3, "eps_rel": 1e-3, "max_iter": 4000, "polish": False, "scaling": 10, "rho": 0.1},
    "highs": {"primal_feasibility_tolerance": 1e-7, "dual_feasibility_tolerance": 1e-7, "qp_regularization_value": 1e-7},
    "proxqp": {"eps_abs": 1e-5, "eps_rel": 0.0, "max_iter": 10000},
    "qpoases": {"hessian_type": "unknown", "sparse": False, "nWSR": "5 (n + p)"},
    "daqp": {"primal_tol": 1e-6, "dual_tol": 1e-12, "zero_tol": 1e-11, "eps_prox": 0.0, "iter_limit": 1000},
    "fatrop": {"tol": 1e-8, "structure_detection": "none"},
    "piqp": {"eps_abs": 1e-8, "eps_rel": 1e-9, "eps_duality_gap_abs": 1e-8, "eps_duality_gap_rel": 1e-9, "max_iter": 250},
    "ipopt": {"tol": 1e-8, "constr_viol_tol": 1e-4, "dual_inf_tol": 1.0, "acceptable_tol": 1e-6, "max_iter": 3000},
    "sqpmethod": {"tol_pr": 1e-6, "tol_du": 1e-6, "max_iter": 50, "qpsol": "qpoases"},
}
"""Defaults as documented by CasADi 3.8 and the engines: CasADi cannot be asked for those in force."""

EPS: dict[str, tuple[str, str, str, str]] = {
    "qrqp": ("constr_viol_tol", "", "dual_inf_tol", ""),
    "ipqp": ("constr_viol_tol", "", "dual_inf_tol", ""),
    "osqp": ("eps_abs", "eps_rel", "eps_abs", "eps_rel"),
    "highs": ("primal_feasibility_tolerance", "", "dual_feasibility_tolerance", ""),
    "proxqp": ("eps_abs", "eps_rel", "eps_abs", "eps_rel"),
    "daqp": ("primal_tol", "", "dual_tol", ""),
    "fatrop": ("tol", "", "tol", ""),
    "piqp": ("eps_abs", "eps_rel", "eps_abs", "eps_rel"),
    "ipopt": ("tol", "", "tol", ""),
    "sqpmethod": ("tol_pr", "", "tol_du", ""),
}
"""Which settings are the stopping tolerances; an engine that is missing has none."""

NONLINEAR = frozenset({"ipopt", "sqpmethod"})
"""Reached through nlpsol, the objective given as a symbolic expression."""

LIBRARIES = {"highs": "highs", "ipopt": "ipopt", "fatrop": "fatrop"}
"""Engines shipped as a library whose file name carries the engine's version."""


def asked(engine: str, tolerance: float) -> dict[str, Any]:
    """Options that ask `engine` for an absolute tolerance, relative 0 where it has one."""
    if engine in ("qrqp", "ipqp"):
        return {"constr_viol_tol": tolerance, "dual_inf_tol": tolerance}
    if engine in ("osqp", "proxqp"):
        return {"eps_abs": tolerance, "eps_rel": 0.0}
    return {
        "highs": {"primal_feasibility_tolerance": tolerance, "dual_feasibility_tolerance": tolerance},
        "daqp": {"primal_tol": tolerance},  # its dual_tol, 1e-12, is tighter already
        "piqp": {"eps_abs": tolerance, "eps_rel": 0.0, "eps_duality_gap_abs": tolerance, "eps_duality_gap_rel": 0.0},
        "ipopt": {"tol": tolerance, "constr_viol_tol": tolerance, "dual_inf_tol": tolerance},
        "sqpmethod": {"tol_pr": tolerance, "tol_du": tolerance},
    }.get(engine, {})  # qpoases, fatrop: nothing to ask for, or no ear for it


def open_engine(engine: str, settings: str) -> Engine:
    """One plug-in of CasADi at a settings level.

    Raises ImportError where CasADi or the plug-in is missing.
    """
    import casadi

    has = casadi.has_nlpsol if engine in NONLINEAR else casadi.has_conic
    if not has(engine):
        raise ImportError(f"casadi {version('casadi')} ships no plug-in {engine} that loads here")
    wish = {} if settings == "default" else asked(engine, ASKED[settings])
    options = {name: dict(value) if isinstance(value, dict) else value for name, value in SILENT.get(engine, {}).items()}
    options["error_on_fail"] = False
    if engine in NONLINEAR or engine in ("qrqp", "ipqp"):
        nested = options.setdefault("ipopt", {}) if engine == "ipopt" else options
        nested.update(wish)
    elif wish:
        options.setdefault(engine, {}).update(wish)
    taken = {**DEFAULTS.get(engine, {}), **wish}
    eps = tuple(float(taken[name]) if name else 0.0 for name in EPS.get(engine, ("", "", "", "")))
    solve = _nonlinear(engine, options) if engine in NONLINEAR else _conic(engine, options)
    library = version("casadi")
    return Engine(solve, taken, eps, library, _engine_version(casadi, engine, library))  # type: ignore[arg-type]


def _engine_version(casadi: Any, engine: str, library: str) -> str:
    """From the file name of the engine's library; most engines do not tell."""
    if engine in ("qrqp", "ipqp", "sqpmethod"):
        return library  # CasADi's own
    if engine in LIBRARIES:
        for path in Path(casadi.__file__).parent.glob(f"lib{LIBRARIES[engine]}*"):
            numbers = "".join(c if c.isdigit() else " " for c in path.name.removeprefix(f"lib{engine}")).split()
            if len(numbers) == 3:
                return ".".join(numbers)
    return f"bundled with casadi {library}"


def _status(engine: str, stats: dict[str, Any]) -> tuple[Status, str]:
    said = str(stats.get("return_status", stats.get("unified_return_status", "")))
    if engine == "daqp":
        from sandbox.backends.qpsolvers_ import DAQP

        status, words = DAQP.get(int(said), (Status.FAILED, "unknown exit flag"))
        return status, f"exit flag {said}: {words}"
    if stats["success"] and status_of(said) is not Status.LIMIT:
        return Status.SOLVED, said
    return status_of(said), said


def _iterations(engine: str, stats: dict[str, Any]) -> int | None:
    if engine == "fatrop":
        return None  # its counter is not initialised
    count = stats.get("qp_iteration_count", stats.get("iter_count", -1))
    return int(count) if count >= 0 else None


def _conic(engine: str, options: dict[str, Any]) -> Solve:
    import casadi

    patterns: dict[tuple[int, int], dict[str, Any]] = {}

    def solve(H: Array, g: Array, A: Array, b: Array, start: Start | None = None) -> Answer:
        begun = perf_counter()
        p, n = A.shape
        if (n, p) not in patterns:
            patterns[n, p] = {"h": casadi.Sparsity.dense(n, n), "a": casadi.Sparsity.dense(p, n)}
        function = casadi.conic("qp", engine, patterns[n, p], options)
        right = casadi.DM(b)
        data = {"h": casadi.DM(H), "g": casadi.DM(g), "a": casadi.DM(A), "lba": right, "uba": right}
        if start is not None:
            data |= {"x0": casadi.DM(start.x), "lam_a0": casadi.DM(start.y)}
        built = perf_counter()
        result = function.call(data)
        done = perf_counter()
        stats = function.stats()
        status, said = _status(engine, stats)
        x, y = np.array(result["x"]).ravel(), np.array(result["lam_a"]).ravel()
        return Answer(x, y, status, said, _iterations(engine, stats), built - begun, done - built)

    return solve


def _nonlinear(engine: str, options: dict[str, Any]) -> Solve:
    import casadi

    def solve(H: Array, g: Array, A: Array, b: Array, start: Start | None = None) -> Answer:
        begun = perf_counter()
        x = casadi.SX.sym("x", len(g))
        problem = {"x": x, "f": 0.5 * casadi.bilin(casadi.DM(H), x, x) + casadi.dot(casadi.DM(g), x)}
        if len(b):
            problem["g"] = casadi.DM(A) @ x
        function = casadi.nlpsol("nlp", engine, problem, options)
        built = perf_counter()
        guess = {"x0": 0} if start is None else {"x0": start.x, "lam_g0": start.y}
        result = function(**guess, lbg=b, ubg=b) if len(b) else function(**guess)
        done = perf_counter()
        stats = function.stats()
        status, said = _status(engine, stats)
        found, y = np.array(result["x"]).ravel(), np.array(result["lam_g"]).ravel()
        return Answer(found, y, status, said, _iterations(engine, stats), built - begun, done - built)

    return solve
