"""Arrow columns of problems, truths and records: NaN becomes null, names are dictionary-encoded."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyarrow as pa

from sandbox.judgement import Judgement
from sandbox.preparation import Work
from sandbox.problem_set import Group
from sandbox.records import PROBLEMS, RECORDS, TRUTH
from sandbox.reference.truth import Truth
from sandbox.solution import STATUSES
from sandbox.tolerances import UNIT
from sandbox.verdict import EXPECTED, VERDICTS

Array = np.ndarray


def record_table(
    work: Work, task: str, rows: Array, judged: Judgement, qdot: Array, y: Array, status: Array, said: list[str],
    more: dict[str, Any],
) -> pa.Table:  # fmt: skip
    """Records of the members `rows` of a group: labels, judgement, and what `more` adds; NaN becomes null."""
    yardstick, R, problem = work.yardsticks[task], len(rows), work.group.problem
    columns: dict[str, Any] = {
        "problem": _taken(work.ids, rows), "set": work.set_name, "n": np.full(R, problem.n, np.int16),
        "m": np.full(R, problem.m, np.int16), "rank": yardstick.rank[rows], "task": task,
        "expected": _coded(EXPECTED, yardstick.expected[rows]), "expected_reason": _taken(yardstick.reason, rows),
        "margin": yardstick.margin[rows], "lambda_min_W": yardstick.lambda_min_W[rows],
        "lambda_min_reduced": yardstick.lambda_min_reduced[rows], "sigma_min_J": yardstick.sigma_min_J[rows],
        "kappa": yardstick.kappa[rows], "status": _coded([s.name.lower() for s in STATUSES], status),
        "said": pa.array([words or None for words in said], pa.string()), "found": judged.found,
        "reason_right": _three(judged.reason_right), "verdict": _coded(VERDICTS, judged.verdict),
        "error": judged.error, "tolerance": judged.tolerance,
        "error_bound": np.where(yardstick.solvable[rows], UNIT, np.nan),
        "residuals_met": _three(judged.residuals_met), "attainable": _three(judged.attainable),
        "primal_residual": judged.primal_residual, "dual_residual": judged.dual_residual,
        "objective_gap": judged.objective_gap, "multiplier_error": judged.multiplier_error,
        "repeat": np.zeros(R, np.int32), "qdot": _vectors(qdot), "y": _vectors(y), **more,
    }  # fmt: skip
    for name in ("robot", "method", "seed", "step"):
        if name in work.group.labels:
            columns[name] = _taken(work.group.labels[name], rows)
    return pa.table([_column(columns.get(f.name), f, R) for f in RECORDS], schema=RECORDS)


def problem_table(set_name: str, group: Group, ids: list[str]) -> pa.Table:
    """Problems of a group, matrices row-major."""
    problem, B = group.problem, len(group)
    weight = problem.W
    columns: dict[str, Any] = {
        "problem": ids, "set": set_name, "n": np.full(B, problem.n), "m": np.full(B, problem.m),
        "k": None if weight.E is None else np.full(B, weight.E.shape[-2]),
        **{name: None if part is None else _vectors(part.reshape(B, -1)) for name, part in (
            ("J", problem.J), ("xdot", problem.xdot), ("W_base", weight.base), ("W_E", weight.E),
            ("W_gamma", weight.gamma), ("a", problem.a), ("Wx", problem.Wx))},
        **{name: list(column) for name, column in group.labels.items()},
    }  # fmt: skip
    return pa.table([_column(columns.get(f.name), f, B) for f in PROBLEMS], schema=PROBLEMS)


def truth_table(task: str, ids: list[str], truths: list[Truth]) -> pa.Table:
    """Exact answers of one task, rounded once to float64."""
    columns: dict[str, Any] = {
        "problem": ids, "task": task, "expected": [t.expected for t in truths], "reason": [t.reason for t in truths],
        "margin": [t.margin for t in truths], "rank": [t.rank for t in truths], "inertia": [list(t.inertia) for t in truths],
        "x": [None if t.x is None else t.x.tolist() for t in truths],
        "y": [None if t.y is None else t.y.tolist() for t in truths],
        "freedom": [t.freedom.ravel().tolist() for t in truths], "value": [t.value for t in truths],
    }  # fmt: skip
    return pa.table([_column(columns[f.name], f, len(ids)) for f in TRUTH], schema=TRUTH)


def _taken(values: Sequence[Any], rows: Array) -> pa.Array:
    """values[rows] as an arrow array."""
    return pa.array(list(values)).take(pa.array(rows))


def _coded(names: Sequence[str], codes: Array) -> pa.Array:
    return pa.DictionaryArray.from_arrays(np.asarray(codes, np.int32), pa.array(list(names), pa.string()))


def _three(values: Array) -> pa.Array:
    """1, 0 and -1 as true, false and null."""
    return pa.array(values == 1, mask=values < 0)


def _vectors(values: Array) -> pa.Array:
    """Rows as lists, null where nothing was given; an entry that is not finite is null."""
    missing = np.isnan(values).all(axis=-1) if values.shape[-1] else np.ones(len(values), bool)
    offsets = np.arange(len(values) + 1, dtype=np.int32) * values.shape[-1]
    return pa.ListArray.from_arrays(
        offsets, pa.array(values.ravel(), mask=~np.isfinite(values.ravel())), mask=pa.array(missing)
    )


def _column(values: Any, wanted: pa.Field, R: int) -> pa.Array:
    """Whatever stands for a column, as an array of the column's type: scalars repeat, NaN is null."""
    if values is None:
        return pa.nulls(R, wanted.type)
    if isinstance(values, str):
        array = pa.DictionaryArray.from_arrays(np.zeros(R, np.int32), pa.array([values]))
    elif isinstance(values, (pa.Array, pa.ChunkedArray)):
        array = values
    elif isinstance(values, list):
        array = pa.array(values, pa.string() if pa.types.is_dictionary(wanted.type) else wanted.type)
    else:
        floating = np.asarray(values)
        finite = np.isfinite(floating) if floating.dtype.kind == "f" else None
        array = pa.array(floating, mask=None if finite is None else ~finite)
    if pa.types.is_dictionary(wanted.type) and not pa.types.is_dictionary(array.type):
        array = array.cast(pa.string()).dictionary_encode()
    if not pa.types.is_dictionary(wanted.type) and pa.types.is_dictionary(array.type):
        array = array.dictionary_decode()
    return array.cast(wanted.type)
