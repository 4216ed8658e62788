"""Two runs side by side in one HTML file that needs no network: what `sandbox compare` found, new failures first."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any

from reports import page
from reports.findings import Finding
from reports.page import plural
from reports.words import TASKS, VERDICTS
from sandbox import compare as comparing
from sandbox.records import CLOSED_FORM

Row = dict[str, Any]

ORDER = tuple(reversed(comparing.SEVERITY))
"""Verdicts as the rows and columns of the table of flips, the worst first."""


def write_comparison(found: Row, out: Path) -> Path:
    """Write the page of what `sandbox.compare.compare` returned, and return its path."""
    page.write(_render(found), Path(out))
    return Path(out)


def _render(found: Row) -> str:
    flips = {(row["before"], row["after"]): row for row in found["by_verdict"]}
    told = [row for row in found["time"] if row["says"] in ("slower", "faster")]
    moved = [row for row in found["accuracy"] if row["worse"] or row["better"] or row["median_log10_ratio"]]
    return page.render(
        "comparison.html.j2", found=found, findings=findings(found), flips=flips,
        rows=[name for name in ORDER if any(pair[0] == name for pair in flips)],
        columns=[name for name in ORDER if any(pair[1] == name for pair in flips)],
        moved=moved, still=len(found["accuracy"]) - len(moved), times=told,
        noise=[row for row in found["time"] if row["says"] == "noise"],
        few=[row for row in found["time"] if row["says"] == "too few"],
        changed=[row for row in found["versions"] if row["differ"]], verdicts=VERDICTS, tasks=TASKS, prefix=CLOSED_FORM,
        rule=comparing, folders={side: shlex.quote(found[side]["folder"]) for side in ("before", "after")},
        style=page.asset("base.css") + page.asset("report.css") + page.asset("comparison.css"),
        script=page.asset("comparison.js"),
    )  # fmt: skip


def findings(found: Row) -> list[Finding]:
    """The findings in the order of their weight."""
    fallen, new, fixed, flips = (found[name] for name in ("fallen", "new_failures", "fixed", "flips"))
    out = [
        Finding(
            f"{fallen:,}", f"{_answers(fallen)} fell: verified before, a false success or a crash after.",
            f"Of {plural(found['joined'], 'record')} that both runs hold. With none the exit status is 0, else 1.", "#flips",
            "bad" if fallen else "good",
        ),
        Finding(
            f"{new:,}", f"{'is a new failure' if new == 1 else 'are new failures'}, {fixed:,} fixed; "
            f"{plural(flips, 'verdict')} {'differs' if flips == 1 else 'differ'} in all.",
            f"Failures are: {_listed([VERDICTS[name][0] for name in reversed(comparing.FAILED)])}.", "#flips",
            "bad" if new else "good",
        ),
        _accuracy(found), _times(found["time"]),
    ]  # fmt: skip
    if found["missing"]:
        before, after = (sum(row[f"only_{side}"] for row in found["missing"]) for side in ("before", "after"))
        out.append(
            Finding(
                f"{before + after:,}", f"answers are on one side only: {before:,} before, {after:,} after.",
                "They are compared with nothing.", "#missing",
                "fair",
            )
        )  # fmt: skip
    differ = [row["backend"] for row in found["versions"] if row["differ"]]
    if differ:
        out.append(
            Finding(
                f"{len(differ)} of {len(found['versions'])}", f"backends changed their version: {_listed(differ, 8)}.",
                "What they do differently may be theirs.", "#versions", "none",
            )
        )  # fmt: skip
    return out


def _accuracy(found: Row) -> Finding:
    worse, better = found["worse"], sum(row["better"] for row in found["accuracy"])
    shifted = [row for row in found["accuracy"] if abs(row["median_log10_ratio"]) >= comparing.MOVED]
    median = (
        "No backend's median error moved."
        if not shifted
        else "The median moved for " + _listed([f"{row['backend']} (× {_factor(row)})" for row in shifted], 6) + "."
    )
    return Finding(
        f"{worse:,}",
        f"{_answers(worse)} lost more than a factor of {comparing.WORSE:g} in accuracy, {better:,} gained as much.", median,
        "#accuracy", "fair" if worse else "good",
    )  # fmt: skip


def _factor(row: Row) -> str:
    return page.number(10.0 ** row["median_log10_ratio"])


def _times(rows: list[Row]) -> Finding:
    slower, faster = (sum(row["says"] == says for row in rows) for says in ("slower", "faster"))
    return Finding(
        f"{slower} of {len(rows)}", f"{'configuration is' if slower == 1 else 'configurations are'} slower, {faster} faster; "
        "of the rest the times cannot be told apart.",
        f"Mann-Whitney U at {comparing.SIGNIFICANT:g}, corrected for {len(rows)} tests (Holm), and medians more than "
        f"{page.percent(comparing.NOISE)} apart. Two machines, or one that is busy, differ without any change of the code.",
        "#time", "fair" if slower else "good",
    )  # fmt: skip


def _answers(n: int) -> str:
    return "answer" if n == 1 else "answers"


def _listed(names: list[str], most: int = 8) -> str:
    """Names in a sentence: a, b or c; the first of many and how many more."""
    if len(names) > most:
        return ", ".join(names[:most]) + f" and {len(names) - most} more"
    return ", ".join(names)
