"""cvxpy: 1/2 quad_form(x, H) + g'x subject to A x == b, compiled for one of its engines.

engine      how it gets the QP          default here (cvxpy rewrites some of the engines' own)
CLARABEL    quadratic objective         tol_feas = tol_gap = 1e-8
CVXOPT      second-order cone           feastol = abstol = 1e-7, one refinement step
DAQP        QP                          eps_prox 0 if Cholesky of H succeeds, else 1e-5
ECOS        second-order cone           feastol = abstol = 1e-8
HIGHS       QP                          feasibility tolerances 1e-7
OSQP        QP                          eps_abs = eps_rel = 1e-5, max_iter 10000, polishing
PIQP        QP, sparse                  eps_abs 1e-8, eps_rel 1e-9
PROXQP      QP, dense                   eps_abs 1e-8, eps_rel 0, max_iter 10000
QPALM       QP                          eps_abs 1e-8, eps_rel 1e-9, infeasibility 1e-8
SCS         quadratic objective         eps_abs = eps_rel = 1e-5

H           refused by the rules of disciplined convex programming unless positive semidefinite (by ARPACK);
            "+assume_psd" says quad_form(x, H, assume_PSD=True), and the engine gets whatever H is
1e-9        CVXOPT gives up on most problems there ("unknown", which cvxpy calls solver_error)
A           as the engine; CVXOPT's redundant rows are removed beforehand
y           ours: Hx + g + A'y = 0
warm        warm_start=True re-uses the solver of the same problem object; built anew, there is none
built anew  a parametrised problem would need H declared positive semidefinite, which is what is at stake;
            compiling (some milliseconds) is build time
documents   https://www.cvxpy.org
"""

from __future__ import annotations

import warnings
from time import perf_counter
from typing import Any

import numpy as np

from sandbox.backends.backend import Answer, Array, Engine, attributes, plain, status_of, version
from sandbox.backends.qpsolvers_ import CVXOPT_DEFAULTS, DAQP, ECOS_DEFAULTS, SCS_DEFAULTS
from sandbox.backends.qpsolvers_ import asked as asked_of_engine
from sandbox.solution import Status
from sandbox.tolerances import ASKED

ASSUME = "+assume_psd"

STATUS = {
    "optimal": Status.SOLVED,
    "optimal_inaccurate": Status.LIMIT,
    "infeasible": Status.INFEASIBLE,
    "infeasible_inaccurate": Status.INFEASIBLE,
    "unbounded": Status.UNBOUNDED,
    "unbounded_inaccurate": Status.UNBOUNDED,
    "user_limit": Status.LIMIT,
}
"""cvxpy's statuses; for the rest (solver_error, infeasible_or_unbounded) the engine's own words decide."""

DISTRIBUTION = {"HIGHS": "highspy", "PROXQP": "proxsuite"}
"""Where the engine's distribution is not its name in lower case."""

DAQP_DEFAULTS = {"primal_tol": 1e-6, "dual_tol": 1e-12, "eps_prox": "0 where H has a Cholesky factor, else 1e-5"}
"""DAQP's tolerances and what cvxpy makes of eps_prox."""


def open_engine(engine: str, settings: str) -> Engine:
    """One engine of cvxpy at a settings level; a name that ends in "+assume_psd" vouches for H.

    Raises ImportError where cvxpy or the engine is missing.
    """
    import cvxpy

    name, assume = engine.removesuffix(ASSUME), engine.endswith(ASSUME)
    if name not in cvxpy.installed_solvers():
        raise ImportError(f"cvxpy does not find {name}; it finds {', '.join(cvxpy.installed_solvers())}")
    options = {} if settings == "default" else asked_of_engine(name.lower(), ASKED[settings])

    def compiled(H: Array, g: Array, A: Array, b: Array) -> tuple[Any, ...]:
        x = cvxpy.Variable(len(g))
        rows = [A @ x == b] if len(b) else []
        problem = cvxpy.Problem(cvxpy.Minimize(0.5 * cvxpy.quad_form(x, H, assume_PSD=assume) + g @ x), rows)
        return x, rows, problem, *problem.get_problem_data(name, solver_opts=dict(options))

    def solve(H: Array, g: Array, A: Array, b: Array) -> Answer:
        start = perf_counter()
        x, rows, problem, data, chain, inverse = compiled(H, g, A, b)
        built = perf_counter()
        raw = chain.solve_via_data(problem, data, warm_start=False, verbose=False, solver_opts=dict(options))
        done = perf_counter()
        solution = chain.invert(raw, inverse)
        said = _said(name, solution, raw)
        status = STATUS.get(solution.status) or status_of(said)
        found = solution.primal_vars.get(x.id)
        y = solution.dual_vars.get(rows[0].id) if rows else np.empty(0)
        iterations = solution.attr.get("num_iters")
        return Answer(
            None if found is None else np.asarray(found, dtype=float).ravel(),
            None if y is None or found is None else np.asarray(y, dtype=float).ravel(),
            status, said, None if iterations is None else int(iterations), built - start, done - built,
        )  # fmt: skip

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        _, _, problem, data, chain, _ = compiled(np.eye(2), np.ones(2), np.ones((1, 2)), np.ones(1))
        chain.solve_via_data(problem, data, warm_start=False, verbose=False, solver_opts=dict(options))
    taken, eps = _effective(name, options, problem._solver_cache)
    engine_version = version(DISTRIBUTION.get(name, name.lower()))
    return Engine(solve, {**taken, "assume_PSD": assume}, eps, version("cvxpy"), engine_version)


def _said(name: str, solution: Any, raw: Any) -> str:
    """Cvxpy's status, and the engine's own where it is at hand and says more."""
    own: Any = None
    if name in ("OSQP", "QPALM"):
        own = raw.info.status
    elif name in ("PIQP", "PROXQP"):
        own = plain(raw.info.status)
    elif name == "CLARABEL":
        own = str(raw.status)
    elif name == "SCS":
        own = raw["info"]["status"]
    elif name == "ECOS":
        own = raw["info"]["infostring"]
    elif name == "HIGHS":
        own = raw["model_status"]
    elif name == "DAQP":
        own = f"exit flag {raw[2]}: {DAQP.get(raw[2], (None, 'unknown'))[1]}"
    return solution.status if own is None else f"{solution.status}: {own}"


def _effective(
    name: str, options: dict[str, Any], cache: dict[str, Any]
) -> tuple[dict[str, Any], tuple[float, float, float, float]]:
    """Settings in force, read from the engine that cvxpy keeps after a solve; documented where it keeps none."""
    taken: dict[str, Any]
    if name == "CLARABEL":
        taken = attributes(cache[name].get_settings(), {"pardiso_iparm", "verbose"})
        return taken, (taken["tol_feas"],) * 4
    if name in ("CVXOPT", "ECOS"):
        taken = {**({**CVXOPT_DEFAULTS, "refinement": 1} if name == "CVXOPT" else ECOS_DEFAULTS), **options}
        return taken, (taken["feastol"],) * 4
    if name == "DAQP":
        taken = {**DAQP_DEFAULTS, **options}
        return taken, (taken["primal_tol"], 0.0, taken["dual_tol"], 0.0)
    if name == "HIGHS":
        every = attributes(cache[name][0].getOptions())
        of_others = ("mip_", "pdlp_", "simplex_", "ipx_", "ipm_", "log_", "write_", "read_", "output_", "solution_")
        taken = {option: value for option, value in every.items() if not option.startswith(of_others)}
        return taken, (taken["primal_feasibility_tolerance"], 0.0, taken["dual_feasibility_tolerance"], 0.0)
    if name == "QPALM":
        import qpalm

        # cvxpy hands its settings over and keeps no copy: these are the four that it rewrites
        taken = attributes(qpalm.Settings(), {"verbose", "print_iter"})
        taken |= {"eps_abs": 1e-8, "eps_rel": 1e-9, "eps_dual_inf": 1e-8, "eps_prim_inf": 1e-8, **options}
    elif name == "SCS":
        taken = {**SCS_DEFAULTS, "eps_abs": 1e-5, "eps_rel": 1e-5, **options}  # 1e-5: cvxpy's, not SCS's
    else:  # OSQP, PIQP, PROXQP
        taken = attributes(cache[name][0].settings)
    return taken, (taken["eps_abs"], taken["eps_rel"], taken["eps_abs"], taken["eps_rel"])
