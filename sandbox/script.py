"""A stand-alone Python file that repeats one solve: numpy, the one library, exact numbers, and no sandbox."""

from __future__ import annotations

from collections.abc import Callable
from pprint import pformat
from textwrap import dedent, indent
from typing import Any, NamedTuple

import numpy as np

from sandbox.backends import BACKENDS, casadi_, qpsolvers_
from sandbox.case import Case, clean
from sandbox.closed_form import CLOSED_FORMS
from sandbox.errors import RefusalError, UnknownNameError
from sandbox.formulation import FORMULATIONS, Posed
from sandbox.records import CLOSED_FORM
from sandbox.reference.truth import REASONS, Truth, truth
from sandbox.tolerances import ASKED, CONDITION_SEVEN, DAMPING, RANK, UNIT, VERIFIED_RELATIVE

Array = np.ndarray


class Template(NamedTuple):
    """Import lines, and the body of `solve(H, g, A, b)`, which sets x (n,) or None, and status."""

    imports: str
    body: str


def script(case: Case, backend: str, formulation: str = "direct", settings: str = "high_accuracy") -> str:
    """Text of a Python file that repeats the solve of `case` by `backend` ("osqp", "closed_form:eq6", ...).

    The file holds the posed QP as exact literals, calls the library as the sandbox does, and prints status, x, the
    joint rates and their distance to the exact minimiser. A closed form is repeated as the equation of its task: (6),
    (13) or methods C1, by singular values.

    Raises
    ------
    UnknownNameError
        no such backend, formulation or settings level.
    RefusalError
        the formulation poses no QP for this problem, or the backend takes none without rows.
    """
    if backend.startswith(CLOSED_FORM):
        return _closed_form(case, backend)
    for kind, name, known in (
        ("backend", backend, [*BACKENDS, *(f"{CLOSED_FORM}{name}" for name in CLOSED_FORMS)]),
        ("formulation", formulation, FORMULATIONS),
        ("settings level", settings, VERIFIED_RELATIVE),
    ):
        if name not in known:
            raise UnknownNameError.of(kind, name, known)
    row, recipe = BACKENDS[backend], FORMULATIONS[formulation]
    stack = case.problem.stacked()
    posing = recipe.pose(stack)
    if posing.refused:
        raise RefusalError(f"{formulation} poses no QP for problem {case.id}: {posing.refused[0][1]}")
    posed = posing.parts[0]
    stages = [posed]
    if recipe.then is not None:  # the second stage takes its b from the first answer: b = A x
        stages.append(recipe.then(stack, posed, np.zeros((1, posed.qp.n))))
    if not row.without_rows and any(stage.qp.p == 0 for stage in stages):
        raise RefusalError(f"{backend} takes no QP without rows, and {formulation} poses one")
    template = TEMPLATES[row.library](row.engine, None if settings == "default" else ASKED[settings])
    qp = posed.qp
    parts = [
        _header(case, backend, formulation, settings, f"needs: {row.install}"),
        f"import numpy as np\n{template.imports}".rstrip() + "\n",
        "# minimise 1/2 x'Hx + g'x subject to Ax = b",
        _data(H=qp.H[0], g=qp.g[0], A=qp.A[0], b=qp.b[0]),
        _exact(_truth(case, recipe.task)),
        f"\n\ndef solve(H, g, A, b):\n{indent(template.body, '    ')}    return x, status\n",
        *(_second(stage) for stage in stages[1:]),
        _recovery(formulation, posed, case.problem.n),
        f"\n{_attempt('(H, g, A, b)' if len(stages) == 1 else '_both()')}",
    ]
    return "\n".join(parts)


def _truth(case: Case, task: str) -> Truth:
    found = case.truths.get(task) or truth(case.problem, task)
    assert isinstance(found, Truth)
    return found


# ---- the parts of a file --------------------------------------------------------------------------------------


def _header(case: Case, backend: str, formulation: str | None, settings: str | None, needs: str) -> str:
    """What is repeated and what was recorded, as comments: a solver's words never stand in code."""
    lines = [f"problem {case.id} (set {case.set_name}) by {backend}"]
    lines[0] += f", formulation {formulation}, settings {settings}" if formulation else ""
    for row in case.records:
        if (row["backend"], row["formulation"], row["settings"]) == (backend, formulation, settings):
            warm = ", warm: started from the answer to the step before, repeated cold here" if row["mode"] == "warm" else ""
            lines.append(f"recorded{warm}: {row['verdict']}; status {row['status']}, error {row['error']}")
            lines.append(f"said: {row['said'] or ''}")
            lines.append(f"versions: library {row['library_version']}, engine {row['engine_version']}")
    return "\n".join(f"# {clean(line)}" for line in [*lines, needs]) + "\n"


def _literal(values: Array) -> str:
    """An array as source; repr of a float reads back as the same float."""
    if not values.size:
        return f"np.zeros({values.shape})"
    if values.ndim == 1:
        return f"np.array({values.tolist()})"
    return "np.array([\n" + "".join(f"    {row},\n" for row in values.tolist()) + "])"


def _data(**arrays: Array) -> str:
    return "\n".join(f"{name} = {_literal(values)}" for name, values in arrays.items())


def _exact(right: Truth) -> str:
    """The exact minimiser in joint rates, and what is free of it."""
    why = f"# {right.expected}: {REASONS[right.reason]}"
    if right.x is None:
        return f"{why}\nexact = None"
    return f"{why}; each entry rounded once; exact + Z t are all minimisers\n{_data(exact=right.x, Z=right.freedom)}"


def _second(stage: Posed) -> str:
    data = _data(H_2=stage.qp.H[0], g_2=stage.qp.g[0], A_2=stage.qp.A[0])
    return f"# the second QP holds A_2 x at what the first reached\n{data}\n\n" + dedent(
        """
        def solve_both():
            first, status = solve(H, g, A, b)
            return (None, status) if first is None else solve(H_2, g_2, A_2, A_2 @ first)
        """
    )


RECOVER: dict[str, tuple[str, tuple[str, ...]]] = {
    "null_space": ("q_p + N @ x", ("q_p", "N")),
    "slack": ("x[:n]", ()),
}
"""Joint rates from x where they are not x itself, and the arrays of `Posed.keep` that this takes."""


def _recovery(formulation: str, posed: Posed, n: int) -> str:
    expression, names = RECOVER.get(formulation, ("x", ()))
    data = _data(**{name: posed.keep[name][0] for name in names})
    function = f"\ndef joint_rates(x):\n    return {expression.replace('[:n]', f'[:{n}]')}\n"
    return f"{data}\n{function}" if names else function


def _attempt(call: str) -> str:
    """Solve, print, compare."""
    return dedent(
        f"""\
        try:
            x, status = solve{call}
        except BaseException as error:  # a panic of a Rust engine is no Exception
            x, status = None, f"{{type(error).__name__}}: {{error}}"
        print("status  ", status)
        if x is not None:
            x = np.asarray(x, dtype=float).ravel()
            qdot = joint_rates(x)
            print("x       ", x.tolist())
            print("qdot    ", qdot.tolist())
            if exact is not None:
                offset = qdot - exact
                offset = offset - Z @ (Z.T @ offset)
                print("distance", np.abs(offset).max(), "from the exact minimiser, in the max norm")
            else:
                print("there is no minimiser to compare with")
        """
    )


# ---- one row per library --------------------------------------------------------------------------------------


def _keywords(options: dict[str, Any]) -> str:
    return "".join(f", {name}={value!r}" for name, value in options.items())


def _osqp(engine: str, tolerance: float | None) -> Template:
    options = {} if tolerance is None else {"eps_abs": tolerance, "eps_rel": 0.0}
    return Template("import osqp\nfrom scipy.sparse import csc_matrix", dedent(
        f"""\
        engine = osqp.OSQP()
        rows = (csc_matrix(A), b, b) if len(b) else (None, None, None)
        engine.setup(csc_matrix(H), g, *rows, verbose=False{_keywords(options)})
        result = engine.solve(raise_error=False)
        x, status = result.x, result.info.status
        """
    ))  # fmt: skip


def _proxsuite(engine: str, tolerance: float | None) -> Template:
    form = "" if engine == "dense" else "csc_matrix"
    asked = "" if tolerance is None else f"qp.settings.eps_abs, qp.settings.eps_rel = {tolerance!r}, 0.0\n"
    imports = "from proxsuite import proxqp" + ("\nfrom scipy.sparse import csc_matrix" if form else "")
    return Template(imports, (
        f"qp = proxqp.{engine}.QP(len(g), len(b), 0)\n{asked}"
        f"qp.init({form}(H), g, {form}(A) if len(b) else None, b if len(b) else None)\n"
        "qp.solve()\n"
        "x, status = qp.results.x, qp.results.info.status.name\n"
    ))  # fmt: skip


def _qpsolvers(engine: str, tolerance: float | None) -> Template:
    options = {} if tolerance is None else qpsolvers_.asked(engine, tolerance)
    if engine == "osqp":
        options = {**options, "raise_error": False}
    form, sparse = "", ""
    if engine in qpsolvers_.SPARSE:
        form, sparse = "csc_matrix", "\nfrom scipy.sparse import csc_matrix"
    return Template(f"import qpsolvers{sparse}", dedent(
        f"""\
        rows = ({form}(A), b) if len(b) else (None, None)
        problem = qpsolvers.Problem({form}(H), g, None, None, *rows)
        solution = qpsolvers.solve_problem(problem, {engine!r}{_keywords(options)})
        said = solution.extras.get("status") or getattr(solution.extras.get("info"), "status", "")
        x, status = solution.x, f"found = {{solution.found}} {{said}}"
        """
    ))  # fmt: skip


def _cvxpy(engine: str, tolerance: float | None) -> Template:
    name, assume = engine.removesuffix("+assume_psd"), engine.endswith("+assume_psd")
    options = {} if tolerance is None else qpsolvers_.asked(name.lower(), tolerance)
    return Template("import cvxpy", dedent(
        f"""\
        variable = cvxpy.Variable(len(g))
        objective = cvxpy.Minimize(0.5 * cvxpy.quad_form(variable, H, assume_PSD={assume}) + g @ variable)
        problem = cvxpy.Problem(objective, [A @ variable == b] if len(b) else [])
        problem.solve(solver={name!r}, warm_start=False{_keywords(options)})
        x, status = variable.value, problem.status
        """
    ))  # fmt: skip


def _casadi(engine: str, tolerance: float | None) -> Template:
    wish = {} if tolerance is None else casadi_.asked(engine, tolerance)
    options = {**casadi_.SILENT.get(engine, {}), "error_on_fail": False}
    if engine == "ipopt":
        options["ipopt"] = {**options["ipopt"], **wish}
    elif engine in ("sqpmethod", "qrqp", "ipqp"):
        options |= wish
    elif wish:
        options[engine] = {**options.get(engine, {}), **wish}
    told = f"options = {pformat(options, width=110, sort_dicts=False)}\n"
    if engine in casadi_.NONLINEAR:
        return Template("import casadi", told + dedent(
            f"""\
            v = casadi.SX.sym("x", len(g))
            problem = {{"x": v, "f": 0.5 * casadi.bilin(casadi.DM(H), v, v) + casadi.dot(casadi.DM(g), v)}}
            if len(b):
                problem["g"] = casadi.DM(A) @ v
            function = casadi.nlpsol("nlp", {engine!r}, problem, options)
            result = function(x0=0, lbg=b, ubg=b) if len(b) else function(x0=0)
            x, status = result["x"], function.stats()["return_status"]
            """
        ))  # fmt: skip
    return Template("import casadi", told + dedent(
        f"""\
        pattern = {{"h": casadi.Sparsity.dense(*H.shape), "a": casadi.Sparsity.dense(*A.shape)}}
        function = casadi.conic("qp", {engine!r}, pattern, options)
        right = casadi.DM(b)
        result = function.call({{"h": casadi.DM(H), "g": casadi.DM(g), "a": casadi.DM(A), "lba": right, "uba": right}})
        stats = function.stats()
        said = stats.get("return_status", stats["unified_return_status"])
        x, status = result["x"], f"success = {{stats['success']}}, {{said}}"
        """
    ))  # fmt: skip


def _numpy(engine: str, tolerance: float | None) -> Template:
    return Template("", dedent(
        """\
        n, p = len(g), len(b)
        K = np.zeros((n + p, n + p))
        K[:n, :n], K[:n, n:], K[n:, :n] = H, A.T, A
        z, _, rank, _ = np.linalg.lstsq(K, np.concatenate((-g, b)), rcond=None)
        x, status = z[:n], f"rank {rank} of {n + p}"
        """
    ))  # fmt: skip


def _scipy(engine: str, tolerance: float | None) -> Template:
    if engine == "slsqp":
        options, rows = {"ftol": tolerance or 1e-6, "maxiter": 100}, (  # 1e-6: SciPy's own default, as below 1e-8
            '[{"type": "eq", "fun": lambda x: A @ x - b, "jac": lambda x: A}]'
        )  # fmt: skip
        extra = 'method="SLSQP"'
    else:
        options = {"gtol": tolerance or 1e-8, "xtol": tolerance or 1e-8, "maxiter": 1000}
        rows, extra = "[LinearConstraint(A, b, b)]", 'hess=lambda x: H, method="trust-constr"'
    return Template("from scipy.optimize import LinearConstraint, minimize", dedent(
        f"""\
        result = minimize(
            lambda x: (0.5 * (x @ (Hx := H @ x)) + g @ x, Hx + g), np.zeros(len(g)), jac=True, {extra},
            constraints={rows} if len(b) else [],
            options={options!r},
        )
        x, status = result.x, result.message
        """
    ))  # fmt: skip


TEMPLATES: dict[str, Callable[[str, float | None], Template]] = {
    "osqp": _osqp,
    "proxsuite": _proxsuite,
    "qpsolvers": _qpsolvers,
    "cvxpy": _cvxpy,
    "casadi": _casadi,
    "numpy": _numpy,
    "scipy": _scipy,
}
"""How a library is called: from engine and asked tolerance (None for its own settings)."""


# ---- closed forms ---------------------------------------------------------------------------------------------

_REDUCED = f"""\
m, n = J.shape
_, sigma, Vt = np.linalg.svd(J)
rank = int(np.sum(sigma > {RANK} * max(m, n) * {UNIT!r} * sigma[0]))
V, N = Vt[:rank].T, Vt[rank:].T  # range J' and null J, orthonormal
NtW = N.T @ W if E is None else N.T @ W + (N.T @ E.T) @ gamma @ E
dense = W if E is None else W + E.T @ gamma @ E
reduced = np.linalg.eigvalsh((NtW @ N + (NtW @ N).T) / 2)
singular = {CONDITION_SEVEN * 2 * UNIT!r} * n * N.shape[1] * np.abs(np.linalg.eigvalsh(dense)).max()
"""

_CLOSED_FORMS = {
    "exact": _REDUCED + dedent(
        """\
        if rank < m:
            return None, f"refused: J has rank {rank} of {m}, singular values {sigma}"
        if rank < n and not reduced[0] > singular:
            return None, f"refused: condition (7) fails, the eigenvalues of N'WN are {reduced}"
        # eq. (6): [J; N'W] qdot = [xdot; -N'a]
        x = np.linalg.solve(np.vstack([J, NtW]), np.concatenate([xdot, -N.T @ a]))
        status = f"solved: rank {rank}, the eigenvalues of N'WN are {reduced}"
        """
    ),
    "least_squares": _REDUCED + dedent(
        """\
        JR = J @ (V / sigma[:rank])
        target = np.linalg.eigvalsh(JR.T @ Wx @ JR)
        if rank and not target[0] > singular_target * m * rank * np.abs(np.linalg.eigvalsh(Wx)).max():
            return None, f"refused: Wx is not positive definite on range J, eigenvalues {target}"
        if rank < n and not reduced[0] > singular:
            return None, f"refused: condition (7) fails, the eigenvalues of N'WN are {reduced}"
        # eq. (13): [R'J'Wx J; N'W] qdot = [R'J'Wx xdot; -N'a], R = V Sigma^-1
        x = np.linalg.solve(np.vstack([JR.T @ Wx @ J, NtW]), np.concatenate([JR.T @ Wx @ xdot, -N.T @ a]))
        status = f"solved: rank {rank}, the eigenvalues of N'WN are {reduced}"
        """
    ).replace("singular_target", repr(CONDITION_SEVEN * 2 * UNIT)),
    "damped": dedent(
        """\
        dense = W if E is None else W + E.T @ gamma @ E
        H = damping**2 * dense + J.T @ Wx @ J
        reduced = np.linalg.eigvalsh(H)
        if not reduced[0] > 0:
            return None, f"refused: lambda^2 W + J'Wx J is not positive definite, eigenvalues {reduced}"
        # methods C1: (lambda^2 W + J'Wx J) qdot = J'Wx xdot - lambda^2 a
        x = np.linalg.solve(H, J.T @ Wx @ xdot - damping**2 * a)
        status = f"solved: the eigenvalues of lambda^2 W + J'Wx J are {reduced}"
        """
    ),
}  # fmt: skip
"""Body of `solve` by task: what every closed form of that task computes, by singular values."""


def _closed_form(case: Case, backend: str) -> str:
    name = backend.removeprefix(CLOSED_FORM)
    if name not in CLOSED_FORMS:
        raise UnknownNameError.of("closed form", name, CLOSED_FORMS)
    form, problem = CLOSED_FORMS[name], case.problem
    weight = {"W": problem.W.base}
    if problem.W.E is not None and problem.W.gamma is not None:
        weight |= {"E": problem.W.E, "gamma": problem.W.gamma}
    Wx = np.eye(problem.m) if problem.Wx is None else problem.Wx
    parts = [
        _header(case, backend, None, None, f"{form.about}; repeated here as the equation of its task, {form.task}"),
        "import numpy as np\n",
        f"# minimise 1/2 qdot'W qdot + a'qdot, J qdot = xdot{'; W + E^T gamma E is the weight' if problem.W.factored else ''}",
        _data(J=problem.J, xdot=problem.xdot, **weight, a=problem.a, Wx=Wx),
        "" if problem.W.factored else "E = gamma = None",
        f"damping = {DAMPING!r}\n" if form.task == "damped" else "",
        _exact(_truth(case, form.task)),
        f"\n\ndef solve():\n{indent(_CLOSED_FORMS[form.task], '    ')}    return x, status\n",
        "\ndef joint_rates(x):\n    return x\n",
        f"\n{_attempt('()')}",
    ]
    return "\n".join(part for part in parts if part)
