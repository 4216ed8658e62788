"""Counts of verdicts by backend and formulation, for the terminal."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rich.table import Table

from sandbox.query import database, parts, scan
from sandbox.records import read_run
from sandbox.verdict import VERDICTS

STYLE = {
    "verified": "green",
    "right_refusal": "green",
    "false_success": "bold red",
    "crashed": "bold red",
    "timed_out": "red",
    "wrong_refusal": "red",
    "inaccurate": "yellow",
}
"""Colours beside the words, never instead of them."""


def counts(run: Path) -> list[dict[str, Any]]:
    """One row per backend, formulation, settings and mode: verdict -> number of records.

    Those blamed on the formulation are counted apart, as `of_formulation`.
    """
    read_run(run)
    with database() as connection:
        found = connection.execute(
            "SELECT backend, formulation, settings, mode, verdict, blame IS NOT DISTINCT FROM 'formulation' AS posing, "
            f"count(*) AS n FROM {scan(parts(run, 'records'), 'records')} GROUP BY ALL ORDER BY ALL"
        ).fetchall()
    rows: dict[tuple[Any, ...], dict[str, Any]] = {}
    for backend, formulation, settings, mode, verdict, posing, n in found:
        row = rows.setdefault(
            (backend, formulation, settings, mode),
            {"backend": backend, "formulation": formulation, "settings": settings, "mode": mode, "of_formulation": 0},
        )
        if posing:
            row["of_formulation"] += n
        else:
            row[verdict] = row.get(verdict, 0) + n
    return list(rows.values())


def table(rows: list[dict[str, Any]]) -> Table:
    """The rows of `counts` as a table; a verdict that never occurs has no column."""
    used = [verdict for verdict in VERDICTS if any(verdict in row for row in rows)]
    drawn = Table(
        title="verdicts (what the formulation itself refused or spoilt is counted under `posing`)", title_justify="left"
    )
    of = ("formulation", "settings", *(("mode",) if any(row["mode"] == "warm" for row in rows) else ()))
    for name in ("backend", *of):
        drawn.add_column(name, overflow="fold")
    for verdict in used:
        drawn.add_column(verdict.replace("_", "\n"), justify="right", style=STYLE.get(verdict, ""))
    drawn.add_column("posing", justify="right", style="dim")
    last = None
    for row in rows:
        if last is not None and last != row["backend"]:
            drawn.add_section()
        cells = ["" if row["backend"] == last else row["backend"], *(row[name] or "" for name in of)]
        last = row["backend"]
        drawn.add_row(*cells, *(str(row.get(v) or "") for v in used), str(row["of_formulation"] or ""))
    return drawn
