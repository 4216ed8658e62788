"""One case of a run in full: the problem bit for bit, its exact truth, and every answer that was recorded."""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from sandbox.check import line
from sandbox.errors import InputFileError, UnknownNameError
from sandbox.problem import VelocityProblem
from sandbox.problem_set import LABELS, problem_ids
from sandbox.records import PROBLEMS, RECORDS, TRUTH, read_part, read_run, read_table
from sandbox.reference.truth import REASONS, Truth, truth
from sandbox.solution import Status
from sandbox.task import TASKS
from sandbox.weight import Weight

Array = np.ndarray

READABLE_BITS = 64
"""An exact number is printed as a fraction where numerator and denominator are shorter than this."""

NEAREST = 5
"""Ids named when one is unknown."""

NAME = 16
"""Columns that a name takes."""

_SCHEMAS = {"problems": PROBLEMS, "truth": TRUTH, "records": RECORDS}


@dataclass(frozen=True, eq=False)
class Case:
    """One problem of a run.

    id : content hash; set_name, labels : where it stands and what it was labelled with
    problem : one VelocityProblem (no leading axis)
    truths : task -> exact truth, decided anew; records : one dict per record (records.RECORDS), None for null
    """

    run: Path
    id: str
    set_name: str
    labels: dict[str, Any]
    problem: VelocityProblem
    truths: dict[str, Truth]
    records: list[dict[str, Any]]

    def chosen(self, backend: str | None, formulation: str | None, settings: str | None) -> list[dict[str, Any]]:
        """Records of one backend ("qpsolvers": all its engines), formulation and settings level; all where None.

        Raises UnknownNameError where this problem has no such record.
        """
        found = self.records
        wanted = (("backend", backend), ("formulation", formulation), ("settings", settings))
        for column, name in wanted:
            if name is None:
                continue
            there = dict.fromkeys(row[column] for row in found if row[column] is not None)
            found = [row for row in found if row[column] == name or (row[column] or "").startswith(f"{name}:")]
            if not found:
                raise UnknownNameError.of(f"{column} recorded for problem {self.id}", name, there)
        return found


def read_case(run: Path, problem: str) -> Case:
    """The case whose id is `problem`, or begins with it.

    Raises
    ------
    UnknownNameError
        no id of the run begins so, or several do; it lists the nearest.
    InputFileError
        `run` is no run folder, or a file in it is damaged.
    """
    run = Path(run)
    read_run(run)
    ids = list(dict.fromkeys(read_table(run, "problems", ["problem"])["problem"].to_pylist()))
    id = _resolved(run, ids, problem)
    row, answers = _rows(run, "problems", id)[0], _rows(run, "records", id)
    tasks = dict.fromkeys(right["task"] for right in _rows(run, "truth", id))
    _known(run, id, "task", tasks, TASKS)
    _known(run, id, "status", [answer["status"] for answer in answers], [status.name.lower() for status in Status])
    try:
        rebuilt = _problem(row)
    except (ValueError, TypeError) as error:  # a field is missing, or of another length
        raise InputFileError(f"{run}/problems: problem {id} is damaged: {line(error)}") from error
    if problem_ids(rebuilt) != [id]:
        raise InputFileError(f"{run}/problems: the numbers of problem {id} do not have this content hash; they were changed")
    truths = {task: _truth(rebuilt, task) for task in tasks}
    labels = {name: row[name] for name in LABELS if row[name] is not None}
    return Case(run, id, row["set"], labels, rebuilt, truths, answers)


def _known(run: Path, id: str, column: str, values: Iterable[Any], names: Sequence[str]) -> None:
    """Refuse a value of `column` that is none of `names`."""
    for value in values:
        if value not in names:
            raise InputFileError(f"{run}: problem {id} has a {column} {line(repr(value))}; there are: {', '.join(names)}")


def _resolved(run: Path, ids: Sequence[str], name: str) -> str:
    if not ids:
        raise InputFileError(f"{run}/problems holds no problem")
    if None in ids:
        raise InputFileError(f"{run}/problems holds a problem without an id")
    fitting = [id for id in ids if id.startswith(name)]
    if name in ids or len(fitting) == 1:
        return name if name in ids else fitting[0]
    if fitting:
        shown, more = sorted(fitting)[:NEAREST], len(fitting) - NEAREST
        told = ", ".join(shown) + (f" and {more} more" if more > 0 else "")
        raise UnknownNameError(f"{len(fitting)} problems of {run} begin with {name!r}: {told}", name=name)
    nearest = sorted(ids, key=lambda id: sum(id.startswith(name[:k]) for k in range(1, len(name))), reverse=True)[:NEAREST]
    raise UnknownNameError(
        f"no problem of {run} is called {name!r} or begins so; the nearest of {len(ids)} are: {', '.join(nearest)}", name=name
    )


def _rows(run: Path, kind: str, id: str) -> list[dict[str, Any]]:
    """Rows of one problem; only the parts that name it are read whole."""
    rows: list[dict[str, Any]] = []
    for path in sorted((run / kind).glob("*.parquet")):
        here = pc.equal(read_part(path, _SCHEMAS[kind], ["problem"])["problem"], pa.scalar(id))
        if pc.any(here).as_py():
            rows += read_part(path, _SCHEMAS[kind]).filter(here).to_pylist()
    return rows


def _problem(row: dict[str, Any]) -> VelocityProblem:
    """The arrays of a row of problems/*.parquet."""
    m, n, k = row["m"], row["n"], row["k"]

    def matrix(name: str, height: int, width: int) -> Array | None:
        return None if row[name] is None else np.array(row[name]).reshape(height, width)

    factors = (None, None) if k is None else (matrix("W_E", k, n), matrix("W_gamma", k, k))
    weight = Weight(matrix("W_base", n, n), *factors)  # type: ignore[arg-type]
    return VelocityProblem(J=matrix("J", m, n), xdot=row["xdot"], W=weight, a=row["a"], Wx=matrix("Wx", m, m))


def _truth(problem: VelocityProblem, task: str) -> Truth:
    found = truth(problem, task)
    assert isinstance(found, Truth)
    return found


# ---- for the terminal -----------------------------------------------------------------------------------------


def text(case: Case, *, backend: str | None = None, formulation: str | None = None, settings: str | None = None) -> str:
    """The case as plain text, every number with 17 significant digits; records as `Case.chosen` takes them.

    Raises UnknownNameError where this problem has no such record.
    """
    chosen = case.chosen(backend, formulation, settings)
    problem, weight = case.problem, case.problem.W
    lines = [f"problem {case.id}  (set {case.set_name}, m = {problem.m}, n = {problem.n})"]
    lines += _pairs((name, clean(_number(value))) for name, value in case.labels.items())
    lines += ["", "minimise 1/2 qdot'W qdot + a'qdot subject to J qdot = xdot", *_matrix("J", problem.J)]
    lines += _matrix("xdot", problem.xdot)
    if weight.E is not None and weight.gamma is not None:
        lines += ["W = W_base + W_E' W_gamma W_E", *_matrix("W_base", weight.base), *_matrix("W_E", weight.E)]
        lines += _matrix("W_gamma", weight.gamma)
    lines += [*_matrix("W", weight.dense()), *_matrix("a", problem.a)]
    lines += [] if problem.Wx is None else _matrix("Wx", problem.Wx)
    for task, right in case.truths.items():
        lines += ["", *_truth_lines(task, right)]
    lines += ["", f"{len(chosen)} of {len(case.records)} records"]
    for row in chosen:
        lines += ["", *_record_lines(case, row)]
    settings_lines = _settings_lines(chosen)
    lines += ["", "effective settings", *settings_lines] if settings_lines else []
    return "\n".join(lines)


def _truth_lines(task: str, right: Truth) -> list[str]:
    lines = [f"truth, task {task}: {right.expected} ({right.reason}: {REASONS[right.reason]})"]
    lines += _pairs([("margin", _number(right.margin)), ("rank J", str(right.rank)), ("inertia", inertia_words(right))])
    if right.x is not None and right.y is not None:
        lines += _matrix("x", right.x) + _exactly(right.x_exact) + _matrix("y", right.y) + _exactly(right.y_exact)
        lines += _pairs([("value", _number(right.value))])
        if right.freedom.shape[1]:
            lines += ["x + range(Z) are all minimisers", *_matrix("Z", right.freedom)]
    return lines


def inertia_words(right: Truth) -> str:
    """Signs of N'WN in words."""
    positive, negative, zero = right.inertia
    return f"N'WN has {positive} positive, {negative} negative and {zero} zero eigenvalues"


def _record_lines(case: Case, row: dict[str, Any]) -> list[str]:
    names = ("backend", "formulation", "settings", "task", *(("mode",) if row["mode"] == "warm" else ()))
    head = ", ".join(clean(row[name]) for name in names if row[name] is not None)
    lines = [f"{head}: {row['verdict']}"]
    sentence = Status[row["status"].upper()].sentence
    pairs = [("status", f"{row['status']} ({sentence})"), ("said", clean(row["said"] or ""))]
    for name in (
        "error", "tolerance", "posing_error", "blame", "primal_residual", "dual_residual", "residuals_met", "attainable",
        "objective_gap", "multiplier_error", "reason_right", "iterations", "build_time", "solve_time", "runtime", "time_limit",
        "library_version", "engine_version",
    ):  # fmt: skip
        if row[name] is not None:
            pairs.append((name, clean(_number(row[name])) + (" s" if name.endswith(("time", "limit")) else "")))
    lines += _pairs(pairs)
    for name in ("qdot", "y"):
        lines += [] if row[name] is None else _matrix(name, np.array(row[name], dtype=float))
    command = repeat_command(case, row)
    told = "repeat cold with" if row["mode"] == "warm" else "repeat with"  # its start is the answer to another problem
    return lines if command is None else [*lines, *_pairs([(told, command)])]


def _settings_lines(rows: Iterable[dict[str, Any]]) -> list[str]:
    """Effective settings, once for each backend and level."""
    told = {(row["backend"], row["settings"]): row["effective_settings"] for row in rows if row["effective_settings"]}
    return [f"  {clean(backend)}, {clean(level)}: {clean(settings)}" for (backend, level), settings in told.items()]


def repeat_command(case: Case, row: dict[str, Any]) -> str | None:
    """The command that prints a stand-alone script of a record; None where no solver was asked."""
    if row["runtime"] is None and row["verdict"] not in ("crashed", "timed_out"):
        return None
    words = ["sandbox", "show", str(case.run), case.id]
    for option in ("backend", "formulation", "settings"):
        words += [] if row[option] is None else [f"--{option}", row[option]]
    return clean(shlex.join([*words, "--script"]))


def _pairs(pairs: Iterable[tuple[str, str]]) -> list[str]:
    return [f"  {name:<{NAME}} {value}".rstrip() for name, value in pairs]


def _number(value: Any) -> str:
    """A number with 17 significant digits, anything else as it is."""
    if isinstance(value, (list, tuple)):
        return "  ".join(_number(entry) for entry in value)
    return f"{value:.17g}" if isinstance(value, float) else str(value)


def _matrix(name: str, values: Array) -> list[str]:
    """A vector on one line, a matrix on one line per row, columns aligned."""
    rows = [[f"{value:.17g}" for value in row] for row in np.atleast_2d(values)]
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    told = ["  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) for row in rows]
    return [f"  {name if i == 0 else '':<{NAME}} {line}" for i, line in enumerate(told)]


def _exactly(values: tuple[Fraction, ...] | None) -> list[str]:
    """The same numbers as fractions, where they are short and not whole."""
    fractions = readable(values)
    if fractions is None or all("/" not in one for one in fractions):
        return []
    return [f"  {'exactly':<{NAME}} {'  '.join(fractions)}"]


def readable(values: tuple[Fraction, ...] | None) -> list[str] | None:
    """Exact numbers as "p/q"; None where one is too long to read."""
    if values is None or any(max(v.numerator.bit_length(), v.denominator.bit_length()) > READABLE_BITS for v in values):
        return None
    return [str(value) for value in values]


def clean(words: str) -> str:
    """On one line, without control characters: a solver's words reach a terminal and the comments of a script."""
    return "".join(letter if letter.isprintable() else "?" for letter in " ".join(words.split()))


# ---- for programs ---------------------------------------------------------------------------------------------


def as_json(
    case: Case, *, backend: str | None = None, formulation: str | None = None, settings: str | None = None
) -> dict[str, Any]:
    """The case as JSON knows it: matrices as nested lists, null for what has no value; floats keep all digits.

    Raises UnknownNameError where this problem has no such record.
    """
    problem, weight = case.problem, case.problem.W
    content = {
        "problem": case.id, "set": case.set_name, "m": problem.m, "n": problem.n, "labels": case.labels,
        "J": problem.J, "xdot": problem.xdot, "W": weight.dense(), "W_base": weight.base, "W_E": weight.E,
        "W_gamma": weight.gamma, "a": problem.a, "Wx": problem.Wx,
        "truth": {
            task: {
                "expected": right.expected, "reason": right.reason, "reason_words": REASONS[right.reason],
                "margin": right.margin, "rank": right.rank, "inertia": list(right.inertia), "x": right.x,
                "x_exact": readable(right.x_exact), "y": right.y, "y_exact": readable(right.y_exact),
                "freedom": right.freedom, "value": right.value,
            }
            for task, right in case.truths.items()
        },
        "records": [
            {**row, "script": repeat_command(case, row)} for row in case.chosen(backend, formulation, settings)
        ],
    }  # fmt: skip
    strict: dict[str, Any] = _strict(content)
    return strict


def _strict(value: Any) -> Any:
    """Arrays as lists, and null for a number that JSON cannot hold."""
    if isinstance(value, dict):
        return {key: _strict(entry) for key, entry in value.items()}
    if isinstance(value, np.ndarray):
        return _strict(value.tolist())
    if isinstance(value, (list, tuple)):
        return [_strict(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
