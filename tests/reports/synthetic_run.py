"""A made-up run folder with every verdict, nasty strings and as many records as a test wants; no solver is run."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from sandbox.problem import VelocityProblem
from sandbox.problem_set import problem_ids
from sandbox.records import PROBLEMS, RECORDS, TRUTH, write_json, write_parquet
from tests.reports.synthetic_methods import CARDS, write_methods

Array = np.ndarray

NASTY = (
    "<script>window.hacked = 1</script> \"double\" 'single' & ünïcödé ∑ 速度\nsecond line\t"
    "</script><img src=x onerror=alert(1)>"
)

SETS: tuple[tuple[str, int, tuple[str, ...], str], ...] = (
    ("textbook", 12, ("exact",), "fixtures with rational answers"),
    ("manufactured", 180, ("exact",), "answers known by construction, every inertia"),
    ("indefinite", 210, ("exact",), "W with negative eigenvalues, condition (7) true, lambda_min from -1e-9 to -1e4"),
    ("no_minimum", 120, ("exact",), "saddle, maximum or a descending direction"),
    ("not_unique", 90, ("exact",), "singular reduced Hessian without a descending direction"),
    ("rank_deficient", 160, ("exact", "least_squares"), "exactly rank-deficient J, <b>consistent</b> and not"),
    ("near_singular", 180, ("exact", "damped"), "sigma_min(J) from 1e-1 to 1e-12"),
    ("badly_scaled", 80, ("exact",), "rows and columns of very different units"),
    ("planar", 100, ("exact", "damped"), "planar 3R and 4R arms"),
    ("seven_joint", 80, ("exact", "damped"), "a spherical-revolute-spherical arm"),
    ("methods", 60, ("exact",), "every method at seeded configurations"),
    ("trajectories", 60, ("exact",), "every method along paths"),
)
OF_METHODS = ("methods", "trajectories")
WARM = ("osqp", "proxsuite:dense", "qpsolvers:piqp")
SHAPES = ((2, 3), (2, 4), (3, 5), (3, 7), (6, 7))

# name, engine, solves indefinite H down to this lambda_min, share of no-minimum problems called solved, promise, sampled
TRAITS: tuple[tuple[str, float, float, str | None, bool], ...] = (
    ("osqp", 1e9, 0.0, "psd", False),
    ("proxsuite:dense", 1e9, 0.9, "psd", False),
    ("proxsuite:sparse", 1e9, 0.9, "psd", False),
    ("qpsolvers:clarabel", 1e-3, 0.0, "psd", False),
    ("qpsolvers:cvxopt", 1e-1, 0.02, "psd", False),
    ("qpsolvers:daqp", 1e-1, 0.0, "pd", False),
    ("qpsolvers:ecos", 0.0, 0.0, "psd", False),
    ("qpsolvers:highs", 0.0, 0.1, "psd", False),
    ("qpsolvers:osqp", 1e9, 0.0, "psd", False),
    ("qpsolvers:piqp", 1e9, 0.0, "psd", False),
    ("qpsolvers:proxqp", 1e9, 0.8, "indefinite", False),
    ("qpsolvers:qpalm", 1e9, 0.7, "indefinite", False),
    ("qpsolvers:quadprog", 0.0, 0.0, "pd", False),
    ("qpsolvers:scs", 1e2, 0.0, "psd", False),
    ("cvxpy:OSQP", 0.0, 0.0, "psd", True),
    ("cvxpy:CLARABEL", 0.0, 0.0, "psd", True),
    ("cvxpy:SCS", 0.0, 0.0, "psd", True),
    ("cvxpy:OSQP+assume_psd", 1e9, 0.0, "psd", True),
    ("cvxpy:CLARABEL+assume_psd", 1e-3, 0.0, "psd", True),
    ("casadi:qrqp", 1e9, 0.95, None, False),
    ("casadi:osqp", 1e9, 0.0, None, False),
    ("casadi:highs", 0.0, 0.2, None, False),
    ("casadi:ipqp", 0.0, 0.5, None, False),
    ("casadi:proxqp", 1e9, 0.9, None, False),
    ("casadi:qpoases", 1e9, 0.0, "indefinite", False),
    ("casadi:fatrop", 1e9, 0.0, None, False),
    ("casadi:ipopt", 1e2, 0.0, "indefinite", True),
    ("numpy:lstsq", 1e9, 1.0, None, False),
    ("scipy:slsqp", 1e9, 0.3, None, True),
    ("scipy:trust-constr", 1e9, 0.1, None, True),
)
CLOSED = (
    ("eq6", "exact"), ("eq6_orthonormal", "exact"), ("null_space", "exact"), ("kkt", "exact"), ("eq2_5", "exact"),
    ("weighted_pseudoinverse", "exact"), ("finsler", "exact"), ("eq13", "least_squares"), ("damped_least_squares", "damped"),
)  # fmt: skip
CONVEX_ONLY = {"eq2_5", "weighted_pseudoinverse"}
FORMULATIONS = {
    "exact": ("direct", "convexified", "augmented_lagrangian", "null_space"),
    "least_squares": ("range_space", "normal_equations", "hierarchical"),
    "damped": ("slack",),
}
LICENCES = {"quadprog": "GPL-2.0-or-later", "cvxopt": "GPL-3.0-or-later", "ecos": "GPL-3.0-only", "daqp": "MIT"}


class _Problems:
    """Columns of all problems, in arrays; ragged ones as lists of arrays."""

    def __init__(self, rng: np.random.Generator, scale: float, sets: Sequence[tuple[Any, ...]] = SETS) -> None:
        columns: dict[str, list[Any]] = {name: [] for name in PROBLEMS.names}
        extra: dict[str, list[Any]] = {k: [] for k in ("x", "mult", "expected", "reason", "lam", "sig", "rank", "margin")}
        for name, count, _, _ in sets:
            for i in range(max(3, round(count * scale))):
                m, n = SHAPES[int(rng.integers(len(SHAPES)))]
                self._one(rng, name, i, m, n, columns, extra)
        self.columns, self.count = columns, len(columns["n"])
        self.set = np.array(columns["set"])
        self.n, self.m = np.array(columns["n"]), np.array(columns["m"])
        self.x, self.mult = extra["x"], extra["mult"]
        self.expected, self.reason = np.array(extra["expected"]), extra["reason"]
        self.lam, self.sig = np.array(extra["lam"]), np.array(extra["sig"])
        self.rank, self.margin = np.array(extra["rank"]), np.array(extra["margin"])
        self.id = np.array(columns["problem"])

    @staticmethod
    def _one(rng: Any, name: str, i: int, m: int, n: int, columns: dict[str, list], extra: dict[str, list]) -> None:
        J, xdot, a = rng.standard_normal((m, n)), rng.standard_normal(m), rng.standard_normal(n)
        Q = np.linalg.qr(rng.standard_normal((n, n)))[0]
        eigenvalues = rng.uniform(0.5, 3, n)
        expected, reason, rank, margin, sigma, value, knob = "unique_minimum", "", m, 0.1, None, None, None
        if name == "indefinite":
            value, knob = -(10.0 ** (-9 + 13 * (i % 14) / 13)), "lambda_min"
            eigenvalues[0] = value
        if name == "near_singular":
            value, knob = 10.0 ** -(1 + i % 12), "sigma_min"
            u, s, v = np.linalg.svd(J, full_matrices=False)
            s[-1] = value
            J, sigma = (u * s) @ v, value
            margin = value
        if name == "no_minimum":
            eigenvalues[0], expected, reason = -2.0, "no_minimum", ("saddle", "maximum", "descending")[i % 3]
        if name == "not_unique":
            eigenvalues[0], expected, margin = 0.0, "minimum_not_unique", 0.0
        if name == "rank_deficient":
            J[-1], rank, margin = J[0], m - 1, 0.0
            xdot[-1] = xdot[0] + i % 2
            expected, reason = ("infeasible", "inconsistent") if i % 2 else ("unique_minimum", "")
        W = (Q * eigenvalues) @ Q.T
        W = (W + W.T) / 2
        factored = name == "seven_joint"
        problem = VelocityProblem(J=J, xdot=xdot, W=W, a=a)
        K = np.block([[W, J.T], [J, np.zeros((m, m))]])
        z = np.linalg.lstsq(K, np.concatenate([-a, xdot]), rcond=1e-14)[0]
        row = dict(
            problem=problem_ids(problem.stacked())[0], set=name, robot="planar3R" if name == "planar" else None,
            method=CARDS[i % len(CARDS)]["name"] if name in OF_METHODS else NASTY if i == 0 else None,
            seed=i, step=None, q=list(rng.standard_normal(n)) if name == "planar" else None,
            knob=knob, value=value, case=NASTY if i == 1 else None, n=n, m=m, k=2 if factored else None, J=J.ravel(),
            xdot=xdot, W_base=W.ravel(), W_E=rng.standard_normal(2 * n) if factored else None,
            W_gamma=np.eye(2).ravel() if factored else None, a=a, Wx=np.eye(m).ravel() if name == "rank_deficient" else None,
        )  # fmt: skip
        for key, item in row.items():
            columns[key].append(item)
        solvable = expected in ("unique_minimum", "minimum_not_unique")
        sigma = float(np.linalg.svd(J, compute_uv=False)[-1]) if sigma is None else sigma
        sigma = 0.0 if rank < m else sigma
        for key, item in dict(
            x=z[:n] if solvable else None, mult=z[n:] if solvable else None, expected=expected, reason=reason,
            lam=value if name == "indefinite" else float(eigenvalues.min()), sig=sigma, rank=rank, margin=margin,
        ).items():  # fmt: skip
            extra[key].append(item)


def write_run(
    folder: Path,
    *,
    seed: int = 7,
    scale: float = 1.0,
    backends: Sequence[str] | None = None,
    default: bool = True,
    closed_forms: bool = True,
    false_successes: bool = True,
    complete: bool = True,
    methods: bool = True,
) -> int:
    """Write a run folder and return its number of cold records.

    Scale 1 gives about 1,200 problems and, with all backends, 150,000 records.
    """
    rng = np.random.default_rng(seed)
    problems = _Problems(rng, scale, [row for row in SETS if methods or row[0] not in OF_METHODS])
    tasks_of = {name: tasks for name, _, tasks, _ in SETS}
    traits = [row for row in TRAITS if backends is None or row[0] in backends]
    blocks: list[pa.Table] = []
    everywhere = np.arange(problems.count)
    for task, formulations in FORMULATIONS.items():
        members = everywhere[[task in tasks_of[name] for name in problems.set]]
        for name, depth, false_share, promise, sampled in traits:
            seen = members[::10] if sampled else members
            for formulation in formulations:
                for settings in ("high_accuracy", "default") if default and formulation == "direct" else ("high_accuracy",):
                    share = false_share if false_successes else 0.0
                    blocks.append(_records(rng, problems, seen, task, name, formulation, settings, depth, share, promise))
        for name, own in CLOSED if closed_forms else ():
            if own == task:
                depth = 0.0 if name in CONVEX_ONLY else 1e9
                blocks.append(_records(rng, problems, members, task, f"closed_form:{name}", None, None, depth, 0.0, None))
    cold = sum(block.num_rows for block in blocks)
    along = everywhere[problems.set == "trajectories"]
    for name, depth, _, promise, _ in traits if methods else ():
        if name in WARM:
            block = _records(rng, problems, along, "exact", name, "direct", "high_accuracy", depth, 0.0, promise)
            blocks.append(_warm(block))
    table = pa.concat_tables(blocks)
    half = table.num_rows // 2
    write_parquet(table.slice(0, half), folder / "records" / "part-0.parquet")
    write_parquet(table.slice(half), folder / "records" / "part-1.parquet")
    write_parquet(pa.table(problems.columns, schema=PROBLEMS), folder / "problems" / "part-0.parquet")
    truths = [_truth(problems, task, tasks_of) for task in FORMULATIONS]
    write_parquet(pa.concat_tables(truths), folder / "truth" / "part-0.parquet")
    about = _about(problems, traits, closed_forms, default, complete)
    if methods:
        write_methods(folder)
        about["methods"] = CARDS
    write_json(about, folder / "run.json")
    return cold


def _warm(block: pa.Table) -> pa.Table:
    """The same answers, started warm: a third of the iterations, half the time."""
    columns = {name: block[name] for name in block.column_names}
    columns["mode"] = pa.array(["warm"] * block.num_rows)
    columns["iterations"] = pa.array([k // 3 for k in block["iterations"].to_pylist()])
    columns["solve_time"] = pa.array([0.5 * t for t in block["solve_time"].to_pylist()])
    return pa.table({name: _plain(column) for name, column in columns.items()}).cast(RECORDS)


def _truth(problems: _Problems, task: str, tasks_of: dict[str, tuple[str, ...]]) -> pa.Table:
    rows = [i for i in range(problems.count) if task in tasks_of[problems.set[i]]]
    return pa.table(
        {
            "problem": problems.id[rows], "task": [task] * len(rows), "expected": problems.expected[rows].tolist(),
            "reason": [problems.reason[i] or None for i in rows], "margin": problems.margin[rows],
            "rank": problems.rank[rows], "inertia": [[int(problems.n[i] - problems.m[i]), 0, 0] for i in rows],
            "x": [problems.x[i] for i in rows], "y": [problems.mult[i] for i in rows],
            "freedom": [np.zeros(0) for _ in rows], "value": [None if problems.x[i] is None else 1.5 for i in rows],
        },
        schema=TRUTH,
    )  # fmt: skip


def _records(
    rng: np.random.Generator, problems: _Problems, rows: Array, task: str, backend: str, formulation: str | None,
    settings: str | None, depth: float, false_share: float, promise: str | None,
) -> pa.Table:  # fmt: skip
    """One backend's answers to many problems: who fails where follows the traits, the rest is chance."""
    B = len(rows)
    closed = settings is None
    expected, lam = problems.expected[rows], problems.lam[rows]
    solvable = np.isin(expected, ("unique_minimum", "minimum_not_unique"))
    repaired = formulation in ("convexified", "augmented_lagrangian", "null_space", "slack")
    capable = (lam >= 0) | repaired | (-lam <= depth)
    luck = rng.random(B)
    base = {"high_accuracy": -11.0, "default": -5.0}.get(settings or "", -14.5)
    error = 10.0 ** (base + rng.normal(0, 0.8, B) - 0.25 * np.log10(np.maximum(problems.sig[rows], 1e-12)))
    tolerance = np.full(B, {"high_accuracy": 1e-7, "default": 1e-2}.get(settings or "", 1e-10))
    verdict = np.where(solvable, np.where(error <= tolerance, "verified", "inaccurate"), "right_refusal").astype(object)
    status = np.where(solvable, "solved", "unbounded").astype(object)
    incapable = solvable & ~capable
    covered = promise == "indefinite"
    verdict[incapable], status[incapable] = "wrong_refusal" if covered else "out_of_scope", "nonconvex"
    lied = ~solvable & (luck < false_share)
    verdict[lied], status[lied] = "false_success", "solved"
    if not closed:
        kinds = ["timed_out", "crashed", "limit", "inaccurate"]
        for k, (kind, state) in enumerate(zip(kinds, ("timed_out", "crashed", "limit", "solved"), strict=True)):
            hit = solvable & (luck > 0.999 - 0.002 * (k + 1)) & (luck <= 0.999 - 0.002 * k)
            verdict[hit], status[hit] = kind, state
            error[hit] *= 1e5
        off = solvable & capable & (luck > 0.9995) & (false_share > 0)
        verdict[off], status[off], error[off] = "false_success", "solved", 0.3
        near = problems.margin[rows] < 1e-9
        verdict[near & (problems.set[rows] == "near_singular")] = "undecidable"
        verdict[luck < 0.0004] = "not_run"
    has_x = np.isin(status, ("solved", "limit")) & (verdict != "not_run")
    scored = has_x & solvable
    blame = np.where(verdict == "inaccurate", np.where(luck < 0.3, "formulation", "backend"), None)
    if formulation == "augmented_lagrangian":
        blame[(problems.sig[rows] < 1e-6) & (verdict == "inaccurate")] = "formulation"
    nan_where = lambda mask, values: pa.array(values, mask=~mask)  # noqa: E731
    lengths = problems.n[rows]
    said = np.where(verdict == "out_of_scope", "H is not convex: refused", "optimal").astype(object)
    said[luck < 0.01] = NASTY
    columns: dict[str, Any] = {
        "problem": problems.id[rows], "set": problems.set[rows], "robot": [None] * B,
        "method": [problems.columns["method"][i] for i in rows], "seed": rows,
        "step": [None] * B, "n": lengths, "m": problems.m[rows], "rank": problems.rank[rows], "task": [task] * B,
        "expected": expected, "expected_reason": [problems.reason[i] or None for i in rows],
        "margin": problems.margin[rows], "lambda_min_W": lam, "lambda_min_reduced": np.abs(lam),
        "sigma_min_J": problems.sig[rows], "kappa": 1 / np.maximum(problems.sig[rows], 1e-14),
        "formulation": [formulation] * B, "backend": [backend] * B, "library_version": [None if closed else "1.2.3"] * B,
        "engine_version": [None if closed else "0.9"] * B, "settings": [settings] * B,
        "effective_settings": [None if closed else '{"eps_abs": 1e-09, "eps_rel": 0, "note": "<b>&"}'] * B,
        "mode": ["cold"] * B, "time_limit": [None if closed else 2.0] * B, "status": list(status), "said": list(said),
        "found": has_x, "reason_right": nan_where(verdict == "right_refusal", luck < 0.8), "verdict": list(verdict),
        "error": nan_where(scored, error), "tolerance": nan_where(solvable, tolerance),
        "error_bound": np.full(B, 1e-16), "posing_error": nan_where(scored, error / 100), "blame": list(blame),
        "residuals_met": nan_where(has_x, luck < 0.97), "attainable": (luck > 0.01) | closed,
        "primal_residual": nan_where(has_x, error), "dual_residual": nan_where(has_x, error * 2),
        "objective_gap": nan_where(scored, error**2), "multiplier_error": nan_where(scored, error * 3),
        "iterations": pa.array((luck * 50).astype(int), mask=np.full(B, closed)),
        "build_time": np.exp(rng.normal(-9, 0.3, B)), "solve_time": np.exp(rng.normal(-9 + len(backend) / 10, 0.5, B)),
        "runtime": np.exp(rng.normal(-8, 0.5, B)), "repeat": np.zeros(B, int),
        "qdot": _ragged([problems.x[i] for i in rows], lengths, has_x, 1 + np.where(scored, error, 0)),
        "y": _ragged([problems.mult[i] for i in rows], problems.m[rows], has_x, 1 + np.where(scored, error * 3, 0)),
        "run": ["synthetic"] * B,
    }  # fmt: skip
    return pa.table({name: _plain(column) for name, column in columns.items()}, schema=RECORDS)


def _plain(column: Any) -> Any:
    """Arrays of strings as lists, which pyarrow takes for dictionary columns."""
    return column.tolist() if isinstance(column, np.ndarray) and column.dtype.kind in "UO" else column


def _ragged(answers: list[Any], lengths: Array, present: Array, factor: Array) -> pa.Array:
    """Lists of the given lengths, null where not `present`, the answers times `factor`."""
    offsets = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int32)
    values = np.concatenate([np.ones(k) if x is None else x for x, k in zip(answers, lengths, strict=True)])
    return pa.ListArray.from_arrays(pa.array(offsets), pa.array(values * np.repeat(factor, lengths)), mask=pa.array(~present))


def _about(problems: _Problems, traits: Any, closed_forms: bool, default: bool, complete: bool) -> dict[str, Any]:
    def groups(name: str) -> list[list[int]]:
        pairs = list(zip(problems.m[problems.set == name].tolist(), problems.n[problems.set == name].tolist(), strict=True))
        return [[m, n, pairs.count((m, n))] for m, n in sorted(set(pairs))]

    def backend(name: str, promise: str | None, sampled: bool) -> dict[str, Any]:
        library, _, engine = name.partition(":")
        quote = f'{library} solves convex problems, i.e. H is {promise}; "quoted" <i>as is</i>.' if promise else None
        return {
            "name": name, "library": library, "engine": engine or library, "sampled": sampled, "state": "ran", "why": "",
            "licence": LICENCES.get(engine, "Apache-2.0"), "method": "alternating directions, factorises once",
            "library_version": "1.2.3", "engine_version": "0.9", "expected": "runs", "message": "",
            "install": f"pip install {library}",
            "promise": {"H": promise, "A": "full_rank" if promise else None, "quote": quote,
                        "source": "https://example.org/docs" if promise else None, "version": "1.2" if promise else None},
        }  # fmt: skip

    absent = backend("casadi:hpipm", None, False) | {
        "state": "not_run", "expected": "loads but fails", "message": "no dense QP",
        "why": "loads, then fails: " + NASTY, "library_version": None, "engine_version": None,
    }  # fmt: skip
    missing = backend("qpsolvers:qpax", None, False) | {
        "state": "not_run", "why": "not installed: No module named 'qpax'", "library_version": None, "engine_version": None,
    }  # fmt: skip
    return {
        "format": 1, "id": "synthetic", "command": "sandbox verify --out 'runs/<x>'", "started": "2025-01-02T03:04:05+00:00",
        "finished": "2025-01-02T03:06:30+00:00" if complete else None, "complete": complete, "sandbox_version": "0.1.0",
        "python": "3.11.2", "platform": "Linux-6.1-x86_64", "cpu": "Example CPU @ 3 GHz", "cores": 2, "jobs": 2,
        "time_limit": 2.0, "packages": {"numpy": "2.4.6", "osqp": "1.1.3", "cvxpy": "1.9.0", "casadi": "3.8.2"},
        "sets": [{"name": s, "about": about, "problems": int((problems.set == s).sum()), "groups": groups(s),
                  "tasks": list(tasks)} for s, _, tasks, about in SETS if (problems.set == s).any()],
        "backends": [*(backend(name, promise, sampled) for name, _, _, promise, sampled in traits), absent, missing],
        "closed_forms": [{"name": name, "task": task, "domain": "W > 0" if name in CONVEX_ONLY else "condition (7)",
                          "bound": "50 n u cond", "about": "a closed form", "source": "eq. (6)"} for name, task in CLOSED]
        if closed_forms else [],
        "formulations": [{"name": f, "task": task, "about": "posed so"} for task, fs in FORMULATIONS.items() for f in fs],
        "settings": ["high_accuracy", "default"] if default else ["high_accuracy"],
        "not_run": [{"backend": "osqp", "formulation": "direct", "settings": "high_accuracy", "set": "badly_scaled",
                     "count": 12, "why": "timed out five times in this set"}],
        "probe": [{"backend": "osqp", "claim": "H psd", "instances": 50, "successes": 49, "low": 0.89, "high": 1.0}],
        "timing": {"wall": 145.0, "solve": 90.0, "build": 20.0, "reference": 12.5},
    }  # fmt: skip
