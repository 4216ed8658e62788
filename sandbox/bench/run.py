"""All benchmarks in one run: their figures, and what they were measured on."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from importlib import metadata
from importlib.util import find_spec
from typing import Any

import numpy as np

from sandbox.bench.closed_forms import largest_cache
from sandbox.bench.measured import Measured
from sandbox.bench.race import WARM_UP, Effort
from sandbox.bench.table import BENCHMARKS, Benchmark
from sandbox.errors import UnknownNameError
from sandbox.run_folder import beginning

PACKAGES = ("llvmlite", "quadprog", "daqp", "piqp", "proxsuite", "qpbenchmark", "pin-pink", "mink", "mujoco", "pin")
"""Whose versions are told besides those that every run tells."""


def bench(
    only: Sequence[str] | None = None, effort: Effort | None = None, *, command: str = "sandbox bench",
    told: Callable[[str, int, int], None] = lambda *_: None, table: Mapping[str, Benchmark] = BENCHMARKS,
) -> dict[str, Any]:  # fmt: skip
    """Measure the benchmarks called `only`, or all; `told` hears ("bench", figures done, figures there are).

    Raises UnknownNameError for a name that is none, before anything is measured.
    """
    effort, names = effort or Effort(), chosen(only, table)
    content = described(command, effort)
    told("bench", 0, len(names))
    for done, name in enumerate(names, 1):
        content["figures"].append(figure(table[name], effort))
        told("bench", done, len(names))
    return content


def chosen(only: Sequence[str] | None, table: Mapping[str, Benchmark] = BENCHMARKS) -> list[str]:
    """The names in `only`, each once, or all there are; UnknownNameError for one that is none."""
    for name in only or ():
        if name not in table:
            raise UnknownNameError.of("benchmark", name, table)
    return list(dict.fromkeys(only or table))


def described(command: str, effort: Effort) -> dict[str, Any]:
    """What the figures are measured on, and how."""
    known = beginning(command, datetime.now(UTC))
    packages = dict(known["packages"])
    for name in PACKAGES:
        try:
            packages[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            packages[name] = "absent"
    numbers = np.show_config(mode="dicts") or {}
    return {
        **{key: known[key] for key in ("command", "started", "sandbox_version", "python", "platform", "cpu", "cores")},
        "packages": packages,
        "conditions": {
            "largest cache [bytes]": largest_cache(),
            "threads": os.environ.get("OMP_NUM_THREADS", "not told (OMP_NUM_THREADS)"),
            "pinned to one core": hasattr(os, "sched_setaffinity"),
            "blas": str(numbers.get("Build Dependencies", {}).get("blas", {}).get("name", "unknown")),
            "warm-up rounds": WARM_UP,
            "rounds": effort.rounds,
            "share of the problems": effort.share,
            "load before": os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
        },
        "figures": [],
    }


def figure(row: Benchmark, effort: Effort) -> dict[str, Any]:
    """One benchmark measured; where something it needs is not installed, how to install it."""
    start = time.perf_counter()
    absent = [package for module, package in row.needs if find_spec(module) is None]
    found = None if absent else row.measure(effort)
    shown = found or Measured(float("nan"))
    return {
        "name": row.name, "what": row.what, "unit": row.unit,
        "value": None if found is None else found.value,
        "bound": None if row.target is None else "at least" if row.at_least else "at most",
        "target": row.target, "stretch": row.stretch,
        "verdict": f"absent: pip install {' '.join(absent)}" if found is None else row.verdict(found.value),
        "median": shown.median, "low": shown.low, "high": shown.high, "rounds": shown.rounds, "beside": shown.beside,
        "seconds": time.perf_counter() - start,
    }  # fmt: skip


def text_rows(content: Mapping[str, Any]) -> list[dict[str, str]]:
    """The figures for a printed table."""
    rows = []
    for one in content["figures"]:
        bound = {"at least": "≥", "at most": "≤", None: ""}[one["bound"]]
        spread = "" if one["median"] is None else f"{short(one['median'])} ({short(one['low'])}-{short(one['high'])})"
        rows.append({
            "name": one["name"], "what": one["what"],
            "measured": "" if one["value"] is None else f"{short(one['value'])} {one['unit']}",
            "median (quartiles)": spread,
            "target": "" if one["target"] is None else f"{bound} {short(one['target'])}",
            "stretch": "" if one["stretch"] is None else f"{bound} {short(one['stretch'])}",
            "verdict": one["verdict"],
        })  # fmt: skip
    return rows


def text_beside(content: Mapping[str, Any]) -> list[str]:
    """The lines under the table: what goes with each figure."""
    told = (
        (one["name"], ", ".join(f"{name} {short(value)}" for name, value in one["beside"].items()))
        for one in content["figures"]
    )
    return [f"{name}: {words}" for name, words in told if words]


def short(value: float | str) -> str:
    """Three digits of a number."""
    return value if isinstance(value, str) else f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"


def text_conditions(content: Mapping[str, Any]) -> list[str]:
    """The lines over the table."""
    packages = ", ".join(f"{name} {version}" for name, version in content["packages"].items() if version != "absent")
    told = ", ".join(f"{name} {value}" for name, value in content["conditions"].items())
    return [
        f"{content['cpu']}, {content['cores']} cores, {content['platform']}, Python {content['python']}",
        f"{told}; each figure is of the least times, what it compares is timed in turn, on one core unless said",
        packages,
    ]
