"""The report of one run: every number computed from its records, in one HTML file that needs no network."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Any

from reports import aggregate, cases, drawing, page
from reports.findings import findings
from reports.methods import methods
from reports.run_data import APART, OWN, RunData
from reports.words import EXPECTED, FORMULATIONS, PRECEDENCE, TASKS, VERDICTS
from sandbox import tolerances
from sandbox.records import CLOSED_FORM
from sandbox.solution import STATUSES

LARGEST = 2_950_000
"""Bytes of a page: it is to be sent by mail. Fewer cases are embedded where they would not fit."""


FEWEST = 100
"""Cases that a page holds whatever its size."""

SLACK, TRIES = 0.04, 6
"""Share of the room for cases that a try leaves free, at twice which a page is full; and how often it is tried."""

_UNKNOWN: dict[str, Any] = {
    "command": "–", "started": None, "finished": None, "complete": False, "time_limit": None, "timing": {}, "packages": {},
    "sets": [], "backends": [], "closed_forms": [], "settings": [], "probe": None, "cpu": "–", "cores": "–", "jobs": "–",
    "platform": "–", "python": "–", "sandbox_version": "",
}  # fmt: skip
"""What a page says where run.json is silent."""


def write_report(run: Path, out: Path | None = None) -> Path:
    """Write the report of the run folder `run` and return its path (default: reports/out/<run id>.html).

    Raises
    ------
    InputFileError
        where `run` is no run folder, or one of its files is not what it should be.
    """
    data = RunData(Path(run))
    try:
        name = re.sub(r"[^\w.-]", "_", str(data.about.get("id") or Path(run).name)).lstrip(".") or "run"
        path = Path("reports/out") / f"{name}.html" if out is None else Path(out)
        page.write(_render(data), path)
    finally:
        data.close()
    return path


def _render(data: RunData) -> str:
    context = _tables(data)
    context |= _embedded(data, context)
    more = {"totals": cases.totals(data), "words": _words(data, context)}

    def rendered(most: int) -> str:
        chosen = cases.keep(data, most)
        held = page.embedded(cases.as_json(cases.pack(data) | more))
        return page.render("verification.html.j2", **context, chosen=chosen, shown=cases.listed(data), data_cases=held)

    most = cases.choose(data)
    text = rendered(most)
    if len(text.encode()) <= LARGEST or most <= FEWEST:
        return text
    (low, best), (high, beyond) = (FEWEST, rendered(FEWEST)), (most, len(text.encode()))
    slack = SLACK * (LARGEST - len(best.encode()))
    for _ in range(TRIES):  # how many fit, between what fits and what does not
        size = len(best.encode())
        if LARGEST - size <= 2 * slack or high - low < 2:
            break
        share = (LARGEST - slack - size) / (beyond - size)
        most = min(high - 1, max(low + 1, int(low + share * (high - low))))
        text = rendered(most)
        if len(text.encode()) <= LARGEST:
            low, best = most, text
        else:
            high, beyond = most, len(text.encode())
    return best


def _tables(data: RunData) -> dict[str, Any]:
    """All that the page says without JavaScript."""
    over_lambda, over_sigma = aggregate.breakdown(data, "lambda_min_W"), aggregate.breakdown(data, "sigma_min_J")
    closed = aggregate.closed_forms(data)
    names, pairs = aggregate.closed_form_pairs(data)
    ran = aggregate.ran(data)
    every = data.about.get("sample_every") or 10
    studied = methods(data)
    return {
        "about": _UNKNOWN | data.about, "ran": [row for row in data.about.get("backends", []) if row["name"] in ran],
        "absent": [row for row in data.about.get("backends", []) if row["name"] not in ran],
        "sampled": aggregate.sampled(data), "every": every, "tolerances": tolerances,
        "folder": shlex.quote(str(data.folder)), "settings": data.settings,
        "counts": aggregate.counts(data), "findings": findings(data, over_lambda, closed, studied),
        "methods": studied, "warm": aggregate.warm_starts(data), "warm_records": data.one("select count(*) from warm"),
        "left_out": aggregate.left_out(data), "matrices": aggregate.matrices(data), "measured": aggregate.measured(data),
        "kinds": aggregate.MEASURED, "distributions": aggregate.distributions(data), "accuracy": aggregate.accuracy(data),
        "over_lambda": over_lambda, "over_sigma": over_sigma, "heat_lambda": _heat(over_lambda, aggregate.backend_order(data)),
        "heat_sigma": _heat(over_sigma, aggregate.backend_order(data)),
        "closed": closed, "pair_names": names, "pairs": pairs,
        "paired": aggregate.PAIRED if aggregate.pairs_sampled(data) else None,
        "recommendations": aggregate.recommendations(data),
        "failures": aggregate.failures(data), "worst": aggregate.worst(data), "listed": aggregate.LISTED,
        "effective": aggregate.effective_settings(data), "order": aggregate.backend_order(data),
        "verdicts": VERDICTS, "expected": EXPECTED, "tasks": TASKS, "precedence": PRECEDENCE, "holds": aggregate.HOLDS,
        "few": aggregate.FEW, "prefix": CLOSED_FORM, "judged": cases.JUDGED, "held": "(none)", "each": cases.EACH,
        "shapes": {
            row["name"]: [f"{m}×{n}" for m, n in sorted({(m, n) for m, n, _ in row["groups"]})]
            for row in data.about.get("sets", [])
        },
    }  # fmt: skip


def _heat(rows: list[aggregate.Row], order: list[str]) -> list[dict[str, Any]]:
    """Share verified as a table of backends by decades, one for each formulation that shows the repair."""
    out = []
    for formulation in [f for f in FORMULATIONS if any(row["formulation"] == f for row in rows)]:
        own = [row for row in rows if row["formulation"] == formulation or row["formulation"] is None]
        decades = sorted({row["decade"] for row in own})
        cells = {(row["backend"], row["decade"]): row for row in own}
        backends = [name for name in order if any(key[0] == name for key in cells)]
        out.append({"formulation": formulation, "decades": decades, "cells": cells, "backends": backends})
    return out


def _embedded(data: RunData, context: dict[str, Any]) -> dict[str, Any]:
    """What the scripts of the page read, but for the cases."""
    curves = {
        "distributions": context["distributions"], "over_lambda": context["over_lambda"], "over_sigma": context["over_sigma"],
        "ratios": [{key: row[key] for key in ("backend", "task", "scored", "ratios")} for row in context["closed"]],
        "order": context["order"], "formulations": FORMULATIONS, "judged": data.settings, "closed": CLOSED_FORM,
    }  # fmt: skip
    return {
        "data_curves": page.embedded_json(curves),
        "plotly": page.embedded((page.ASSETS / "plotly-cartesian.min.js").read_bytes()),
        "style": page.asset("base.css") + page.asset("report.css") + (drawing.style() if context["methods"] else ""),
        "script": page.asset("report.js"),
    }


def _words(data: RunData, context: dict[str, Any]) -> dict[str, Any]:
    """What the scripts of the page say."""
    lost, beyond = APART["formulation"], APART["float64"]
    return {
        "verdicts": {name: [words, kind] for name, (words, kind, _) in VERDICTS.items()},
        "expected": {name: words for name, (words, _) in EXPECTED.items()},
        "statuses": {status.name.lower(): status.sentence for status in STATUSES},
        "folder": context["folder"], "closed": CLOSED_FORM,
        "judged": [cases.JUDGED, data.settings],
        "own": OWN, "cold": "mode is distinct from 'warm'" if context["warm_records"] else "true",
        "apart": {"formulation": lost, "float64": f"not ({lost}) and {beyond}", "(none)": f"not ({lost} or {beyond})"},
    }  # fmt: skip
