"""The one table of backends: a backend is registered by one row here and by nothing else.

Importing this imports no solver. A promise is the documentation's own sentence ([...] joins two); where it
says nothing of H or A the promise is None, and with nothing said at all the quote is empty.
"""

from __future__ import annotations

from sandbox.backends.backend import Backend, Promise, WarmStart

SILENCE = Promise(None, None, "", "", "")
"""The documentation says nothing of H or A."""

_README = "README of the distribution"

_OSQP = Promise(
    "psd", "any",
    "it requires no assumptions on problem data (the problem only needs to be convex)",
    "https://osqp.org/docs", "1.0",
)  # fmt: skip
_PROXQP = Promise(
    "psd", None,
    "The objective function is defined by a positive semidefinite matrix",
    f"proxsuite, {_README}", "0.8.0",
)  # fmt: skip
_QPSOLVERS = Promise(
    "psd", None,
    "All solvers require the problem to be convex, meaning the matrix $P$ should be [positive semi-definite]",
    f"qpsolvers, {_README}", "4.13.0",
)  # fmt: skip
_CVXOPT = Promise(
    "psd", "full_rank",
    "Must be positive semidefinite. [...] It needs to be full row rank",
    "cvxopt.coneprog.qp, docstring; qpsolvers.solvers.cvxopt_.cvxopt_solve_qp, docstring", "1.3.3; 4.13.0",
)  # fmt: skip
_DAQP = Promise(
    "psd", None,
    "Cost matrix (should be positive definite). For singular Hessians, a negative eps_prox enables automatic regularization",
    "daqp.solve, docstring", "0.11.0",  # eps_prox is negative by default
)  # fmt: skip
_ECOS = Promise(
    "pd", None,
    "ValueError : If the cost matrix is not positive definite.",
    "qpsolvers.solvers.ecos_.ecos_solve_problem, docstring", "4.13.0",
)  # fmt: skip
_HIGHS = Promise(
    "psd", None,
    "where $Q$ must be positive semi-definite",
    f"highspy, {_README}", "1.15.1",
)  # fmt: skip
_OSQP_HERE = Promise(
    "psd", "any",
    "convexity is the only assumption it makes on problem data (for instance, it does not make any rank assumption",
    "qpsolvers.solvers.osqp_, docstring", "4.13.0",
)  # fmt: skip
_PIQP = Promise(
    "psd", "any",
    "the algorithm can handle ill-conditioned convex QP problems without the need for linear independence of the constraints",
    f"piqp, {_README}", "0.7.0",
)  # fmt: skip
_QUADPROG = Promise(
    "pd", None,
    "Solve a strictly convex quadratic program",
    "quadprog.solve_qp, docstring", "0.1.14",
)  # fmt: skip
_SCS = Promise(
    "psd", None,
    "must be symmetric positive semidefinite",
    "https://www.cvxgrp.org/scs/api/matrices.html", "3.2",
)  # fmt: skip
_CVXPY = Promise(
    "psd", None,
    "CVXPY is a Python-embedded modeling language for convex optimization problems.",
    f"cvxpy, {_README}", "1.9.3",
)  # fmt: skip
_ASSUMED = Promise(
    "psd", None,
    "assume_PSD : P is assumed to be PSD without checking.",
    "cvxpy.quad_form, docstring", "1.9.3",
)  # fmt: skip
_CONIC = Promise(
    "pd", None,
    "H sparse (n x n) positive definite",
    "casadi.conic, docstring", "3.8.2",
)  # fmt: skip
_IPOPT = Promise(
    "indefinite", None,
    "can be linear or nonlinear and convex or non-convex (but should be twice continuously differentiable)",
    "https://coin-or.github.io/Ipopt", "3.14",
)  # fmt: skip

_INITVALS = WarmStart(
    "initvals",
    "Primal candidate vector :math:`x` values used to warm-start the solver.",
    "qpsolvers.solve_problem.solve_problem, docstring", "4.13.0",
)  # fmt: skip
_INITVALS_AND_Y = WarmStart(
    "initvals, y",
    f"{_INITVALS.quote} [...] Warm start value for the dual Lagrange multiplier for equality constraints.",
    f"{_INITVALS.source}; qpsolvers.solvers.proxqp_.proxqp_solve_problem, docstring", "4.13.0",
)  # fmt: skip
_SOLVE_XYZ = WarmStart(
    "QP.solve(x, y, z)",
    "function used for solving the QP problem, when passing a warm start.",
    "proxsuite.proxqp.dense.QP.solve, docstring", "0.8.0",
)  # fmt: skip
_CONIC_X0 = WarmStart("x0, lam_a0", "dense, (n x 1), initial guess, default 0", "casadi.conic, docstring", "3.8.2")
_NLPSOL_X0 = WarmStart("x0, lam_g0", "Decision variables, initial guess (nx x 1),", "casadi.nlpsol_in, docstring", "3.8.2")
_X0 = WarmStart("x0", "Initial guess. Array of real elements of size (n,)", "scipy.optimize.minimize, docstring", "1.17.1")

_ADMM = "operator splitting (ADMM), first order"
_PALM = "proximal augmented Lagrangian"
_IPM = "interior point"
_ACTIVE = "active set"


def _proxsuite(engine: str) -> Backend:
    return Backend(
        f"proxsuite:{engine}", "proxsuite", engine, "BSD-2-Clause", _PALM, _PROXQP, install="pip install proxsuite",
        start=_SOLVE_XYZ,
    )  # fmt: skip


def _qpsolvers(
    engine: str, licence: str, method: str, promise: Promise, *, without_rows: bool = True, package: str = "",
    start: WarmStart | None = None,
) -> Backend:  # fmt: skip
    return Backend(
        f"qpsolvers:{engine}", "qpsolvers", engine, licence, method, promise, without_rows=without_rows,
        install=f"pip install qpsolvers {package or engine}", start=start,
    )  # fmt: skip


def _cvxpy(engine: str, licence: str, method: str, package: str = "", *, without_rows: bool = True) -> tuple[Backend, Backend]:
    install = f"pip install cvxpy {package or engine.lower()}"
    by_rule, assumed = (
        Backend(
            f"cvxpy:{name}", "cvxpy", name, licence, method, promise, without_rows=without_rows, sampled=True,
            install=install,
        )
        for name, promise in ((engine, _CVXPY), (f"{engine}+assume_psd", _ASSUMED))
    )  # fmt: skip
    return by_rule, assumed


def _casadi(
    engine: str, licence: str, method: str, promise: Promise = _CONIC, *, message: str = "", sampled: bool = False,
    without_rows: bool = True, start: WarmStart | None = None,
) -> Backend:  # fmt: skip
    return Backend(
        f"casadi:{engine}", "casadi", engine, licence, method, promise, "loads but fails" if message else "runs", message,
        without_rows, sampled, "pip install casadi", start,
    )  # fmt: skip


_ROWS = (
    Backend(
        "osqp", "osqp", "osqp", "Apache-2.0", _ADMM, _OSQP, install="pip install osqp", start=WarmStart("OSQP.warm_start(x, y)")
    ),
    _proxsuite("dense"),
    _proxsuite("sparse"),
    _qpsolvers("clarabel", "Apache-2.0", _IPM, _QPSOLVERS, without_rows=False),
    _qpsolvers("cvxopt", "GPL-3.0-or-later", f"{_IPM}; here one factorisation", _CVXOPT),
    _qpsolvers("daqp", "MIT", f"dual {_ACTIVE}", _DAQP),
    _qpsolvers("ecos", "GPL-3.0-or-later", f"{_IPM} on the cone form", _ECOS),
    _qpsolvers("highs", "MIT", f"primal {_ACTIVE}", _HIGHS, package="highspy"),
    _qpsolvers("osqp", "Apache-2.0", _ADMM, _OSQP_HERE, start=_INITVALS),
    _qpsolvers("piqp", "BSD-2-Clause", f"proximal {_IPM}", _PIQP),
    _qpsolvers("proxqp", "BSD-2-Clause", _PALM, _QPSOLVERS, package="proxsuite", start=_INITVALS_AND_Y),
    _qpsolvers("qpalm", "LGPL-3.0-or-later", _PALM, _QPSOLVERS),
    _qpsolvers("quadprog", "GPL-2.0-or-later", f"dual {_ACTIVE} (Goldfarb-Idnani)", _QUADPROG),
    _qpsolvers("scs", "MIT", f"{_ADMM}, on the cone form", _SCS, without_rows=False, start=_INITVALS),
    *_cvxpy("CLARABEL", "Apache-2.0", _IPM),
    *_cvxpy("CVXOPT", "GPL-3.0-or-later", f"{_IPM} on the cone form"),
    *_cvxpy("DAQP", "MIT", f"dual {_ACTIVE}"),
    *_cvxpy("ECOS", "GPL-3.0-or-later", f"{_IPM} on the cone form"),
    *_cvxpy("HIGHS", "MIT", f"primal {_ACTIVE}", "highspy"),
    *_cvxpy("OSQP", "Apache-2.0", f"{_ADMM}, polished"),
    *_cvxpy("PIQP", "BSD-2-Clause", f"proximal {_IPM}"),
    *_cvxpy("PROXQP", "BSD-2-Clause", _PALM, "proxsuite"),
    *_cvxpy("QPALM", "LGPL-3.0-or-later", _PALM),
    *_cvxpy("SCS", "MIT", f"{_ADMM}, on the cone form", without_rows=False),
    _casadi("qrqp", "LGPL-3.0-or-later", f"primal-dual {_ACTIVE}", start=_CONIC_X0),
    _casadi("osqp", "Apache-2.0", _ADMM, start=_CONIC_X0),
    _casadi("highs", "MIT", f"primal {_ACTIVE}"),
    _casadi("ipqp", "LGPL-3.0-or-later", f"{_IPM} (Mehrotra)"),
    _casadi("proxqp", "BSD-2-Clause", _PALM),
    _casadi("qpoases", "LGPL-2.1-or-later", f"online {_ACTIVE}"),
    _casadi("daqp", "MIT", f"dual {_ACTIVE}"),
    _casadi("fatrop", "LGPL-3.0-or-later", f"{_IPM} for optimal control", start=_CONIC_X0),
    _casadi("piqp", "BSD-2-Clause", f"proximal {_IPM}"),
    _casadi(
        "hpipm",
        "BSD-2-Clause",
        f"{_IPM} for optimal control",
        message="does not correspond to what the interface can handle",
        without_rows=False,  # it dies of SIGSEGV there
    ),
    _casadi("clp", "EPL-2.0", "simplex", message="Not an LP"),
    _casadi("ipopt", "EPL-2.0", f"{_IPM}, nonlinear", _IPOPT, sampled=True, start=_NLPSOL_X0),
    _casadi("sqpmethod", "LGPL-3.0-or-later", "sequential quadratic programming", SILENCE, sampled=True, start=_NLPSOL_X0),
    Backend(
        "numpy:lstsq", "numpy", "lstsq", "BSD-3-Clause", "least squares on the KKT system", SILENCE, install="pip install numpy"
    ),
    Backend(
        "scipy:slsqp",
        "scipy",
        "slsqp",
        "BSD-3-Clause",
        "sequential least squares, BFGS",
        SILENCE,
        install="pip install scipy",
        start=_X0,
    ),
    Backend(
        "scipy:trust-constr",
        "scipy",
        "trust-constr",
        "BSD-3-Clause",
        "trust-region SQP, nonlinear",
        SILENCE,
        sampled=True,
        install="pip install scipy",
        start=_X0,
    ),
)

BACKENDS: dict[str, Backend] = {row.name: row for row in _ROWS}
"""Every backend by name."""

if len(BACKENDS) != len(_ROWS):
    raise ValueError("two backends share a name")
