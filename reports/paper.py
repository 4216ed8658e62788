"""The page of `sandbox paper`: a paper re-verified claim by claim, in one HTML file that needs no network."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from markupsafe import Markup

from reports import chart, drawing, page, tex
from sandbox.check import line, named
from sandbox.claims import exhibit
from sandbox.claims.claim import Check, Evidence, Role, State
from sandbox.errors import InputFileError
from sandbox.records import read_run, read_table

LARGEST = 2_950_000
"""Bytes of a page: it is to be sent by mail. Fewer points of each series are drawn where they would not fit."""

POINTS = (12_000, 4_000, 2_000, 1_000, 500, 250, 100)
"""Points of a series at most, the first number with which the page is small enough."""

FOLDED = 8
"""Checks of one pattern above which those that hold are folded into one line."""

SECTIONS = {
    "": "The paper as a whole", "I": "Introduction", "II": "The framework", "III": "Established velocity-control methods",
    "IV": "Computational costs", "V": "Numerical accuracy", "VI": "When J is not of full rank", "VII": "Summary",
    "beyond": "Beyond the paper",
}  # fmt: skip
"""The sections of the paper."""

_WITHIN = {
    "I": r"footnote 0\b", "II": r"footnotes? [12]\b|eqs?\. \([2-7]\)", "III": r"eqs?\. \((?:8|9|1[0-2])\)",
    "IV": r"tables? I{1,2}\b|footnote 3\b", "V": r"fig\. 1\b|table III\b", "VI": r"eqs?\. \(13\)",
}  # fmt: skip
"""Where a place that names no section lies."""

STATES = {
    State.REPRODUCED: ("reproduced", "✓", "every check holds"),
    State.RANGE: ("range", "R", "it holds where the paper states it; as far as its words go, within a range that is given"),
    State.CORRECTED: ("corrected", "C", "it holds in our reading, which is given; not to the letter: an erratum"),
    State.NOT_REPRODUCED: ("not-reproduced", "✕", "a check of the sentence itself fails"),
    State.UNSOUND: ("unsound", "!", "what we say ourselves about the claim does not stand, or its examination broke off"),
}  # fmt: skip
"""State -> its class, its letter, and what it means."""

ROLES = {
    Role.CLAIM: ("the claim", "the sentence where the paper states it; if it fails the claim is not reproduced"),
    Role.REACH: ("its reach", "the sentence as far as its words go; if it fails the claim holds in a range, which is given"),
    Role.PRINTED: ("as printed", "the sentence to the letter where we read it otherwise; its failure confirms the erratum"),
    Role.OURS: ("our evidence", "what we say about it, a cause or a correction; if it fails our evidence does not stand"),
}  # fmt: skip
"""Role -> its name, and what it decides."""

_SAID: dict[str, tuple[type, Any]] = {
    "command": (str, "–"), "id": (str, "–"), "started": (str, None), "finished": (str, None), "complete": (bool, False),
    "seed": (int, None), "full": (bool, True), "jobs": (int, None), "timing": (dict, {}), "packages": (dict, {}),
    "platform": (str, "–"), "python": (str, "–"), "sandbox_version": (str, ""), "cpu": (str, "–"), "cores": (int, None),
    "planned": (int, None), "ledger": (int, None),
}  # fmt: skip
"""What run.json says of a run of claims: the type of each, and what stands for it where run.json is silent."""

_EXHIBITS: dict[str, Any] = {"table": exhibit.Table, "plot": exhibit.Plot, "heat": exhibit.Heat}


def write_paper(run: Path, out: Path | None = None) -> Path:
    """Write the page of the run folder `run` and return its path (default: reports/out/paper.html).

    Raises
    ------
    InputFileError
        where `run` is no run folder of `sandbox paper`, or one of its files is not what it should be.
    """
    run = Path(run)
    about = read_run(run)
    if about.get("kind") != "paper":
        raise InputFileError(
            f"{named(run)} is no run of a paper's claims: `sandbox paper` makes one; `sandbox report` shows others"
        )
    said = _about(about, run)
    claims = _claims(run)
    if said["complete"] and said["planned"] not in (None, len(claims)):
        raise InputFileError(
            f"{named(run)} holds {len(claims)} of its {page.plural(said['planned'], 'claim')}: parts are missing"
        )
    path = Path("reports/out/paper.html") if out is None else Path(out)
    for most in POINTS:
        text = _render(said, claims, most)
        if len(text.encode()) <= LARGEST:
            break
    page.write(text, path)
    return path


# ---- what the run holds -----------------------------------------------------------------------------------------------------


def _about(content: Mapping[str, Any], run: Path) -> dict[str, Any]:
    """What run.json says; refused where it says it in another type."""
    said: dict[str, Any] = {}
    for name, (kind, silent) in _SAID.items():
        value = content.get(name)
        if value is not None and (not isinstance(value, kind) or (kind is int and isinstance(value, bool))):
            raise InputFileError(f"{named(run / 'run.json')}: {name} is {line(repr(value))}, which is no {kind.__name__}")
        said[name] = silent if value is None else value
    wall = said["timing"].get("wall")
    return said | {"wall": wall if _is_number(wall) else None}


def _claims(run: Path) -> list[dict[str, Any]]:
    """Claims in the order of the ledger, each with its checks and exhibits."""
    rows = _rows(run, "claims")
    known = {row["claim"]: row for row in rows}
    if len(known) < len(rows):
        raise InputFileError(f"{named(run)} holds a claim twice")
    for row in rows:
        row |= {"checks": [], "exhibits": [], "state": _member(State, row["state"], run)}
        row["fault_state"] = _member(State, row["fault_state"], run)
    for kind in ("checks", "exhibits"):
        for part in sorted((run / "claims").glob("*.parquet")):
            if not (run / kind / part.name).is_file():
                raise InputFileError(f"{named(run / kind / part.name)} is missing")
        for row in _rows(run, kind):
            if row["claim"] in known:  # a claim is written last: without it, its parts are of a run that was broken off
                known[row["claim"]][kind].append(row)
    for row in rows:
        for check in row["checks"]:
            check |= {name: _read(check[name], run) for name in ("found", "asked")}
            check["role"] = _member(Role, check["role"], run)
        row["exhibits"] = [_exhibit(one, run) for one in row["exhibits"]]
        checks = tuple(Check(**{field.name: check[field.name] for field in fields(Check)}) for check in row["checks"])
        if (state := Evidence(checks, ()).state) is not row["state"]:
            raise InputFileError(f"{named(run)}: {line(row['claim'])} is kept as {row['state']}; its checks say {state}")
    return rows


def _rows(run: Path, kind: str) -> list[dict[str, Any]]:
    """The rows of a table in their order; refused where one is silent on what each must say."""
    table = read_table(run, kind)
    for name in table.column_names:
        if name != "seconds" and table[name].null_count:
            raise InputFileError(f"{named(run / kind)}: a row has no {name}")
    return sorted(table.to_pylist(), key=lambda row: row["place"])


def _member(kind: Any, name: str, run: Path) -> Any:
    try:
        return kind(name)
    except ValueError as error:
        raise InputFileError(
            f"{named(run)}: {name!r} is no {kind.__name__.lower()} of a claim that this version knows"
        ) from error


def _read(text: str, run: Path) -> Any:
    try:
        return json.loads(text)
    except (ValueError, TypeError, RecursionError) as error:
        raise InputFileError(f"{named(run)}: a check or an exhibit is no JSON: {error}") from error


def _exhibit(row: Mapping[str, Any], run: Path) -> exhibit.Exhibit:
    content = _read(row["content"], run)
    try:
        made = dict(content)
        if row["kind"] == "plot":
            made |= {name: exhibit.Axis(**made[name]) for name in ("x", "y")}
            made["series"] = tuple(exhibit.Series(**one) for one in made["series"])
        return _EXHIBITS[row["kind"]](**made)
    except (LookupError, TypeError, ValueError) as error:
        raise _unknown(row["claim"], error) from error


def _unknown(claim: str, error: Exception) -> InputFileError:
    return InputFileError(
        f"an exhibit of {line(claim)} is not one that this version knows: {type(error).__name__}: {line(error)}"
    )


# ---- what the page says -----------------------------------------------------------------------------------------------------


def _render(about: dict[str, Any], claims: list[dict[str, Any]], most: int) -> str:
    charts: dict[str, Any] = {}
    shown = [_shown(row, charts, most) for row in claims]
    sections: dict[str, list[dict[str, Any]]] = {}
    last = ""
    for row in shown:
        last = section(row["where"]) or last
        sections.setdefault(last, []).append(row)
    order = list(SECTIONS)
    context = {
        "about": about, "claims": shown, "packages": _packages(about),
        "sections": [(name, SECTIONS[name], sections[name]) for name in sorted(sections, key=order.index)],
        "counts": [(state, *STATES[state], [row for row in shown if row["state"] is state]) for state in State],
        "states": STATES, "roles": ROLES, "noticed": sum(bool(row["noticed"]) for row in claims),
        "lead": _lead(claims), "columns": 3 if len(claims) + 2 * len(sections) <= 84 else 4,
        "state_class": {str(state): words[0] for state, words in STATES.items()},
        "data_charts": page.embedded_json(charts),
        "plotly": page.embedded((page.ASSETS / "plotly-cartesian.min.js").read_bytes()),
        "style": page.asset("base.css") + page.asset("paper.css") + drawing.style() + chart.style(),
        "script": page.asset("paper.js"),
    }  # fmt: skip
    return page.render("paper.html.j2", **context)


def section(where: str) -> str | None:
    """The section of the paper that a place lies in: "II", "" for the whole, "beyond"; None where it does not say."""
    found = re.search(r"\bSections? ([IVX]+)\b", where)
    if found and found[1] in SECTIONS:
        return found[1]
    if re.search(r"\babstract\b|\bwhole\b|\btitle\b", where, re.IGNORECASE):
        return ""
    if re.search(r"\bbeyond\b|not in the paper", where, re.IGNORECASE):
        return "beyond"
    return next((name for name, words in _WITHIN.items() if re.search(words, where, re.IGNORECASE)), None)


def _lead(claims: list[dict[str, Any]]) -> str:
    """The result in one sentence."""
    if not claims:
        return "No claim was examined in this run."
    counts = [(state, sum(row["state"] is state for row in claims)) for state in State]
    parts = [f"{n} {state}" for state, n in counts if n]
    told = parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"
    only = "the claim is" if len(claims) == 1 else f"of {len(claims)} claims"
    return f"{only[0].upper()}{only[1:]} {told if len(claims) > 1 else claims[0]['state']}."


def _packages(about: Mapping[str, Any]) -> str:
    """The versions that the claims rest on, on one line; all others stand below."""
    held = about["packages"]
    first = [f"{name} {held[name]}" for name in ("numpy", "scipy", "numba", "python-flint", "casadi", "pin") if name in held]
    return ", ".join([f"velocity-sandbox {about['sandbox_version'] or '–'}", f"Python {about['python']}", *first])


def _shown(row: dict[str, Any], charts: dict[str, Any], most: int) -> dict[str, Any]:
    """A claim as the page shows it; the data of its charts go to `charts`."""
    name, letter, meaning = STATES[row["state"]]
    ranges = [
        (check["role"], tex.text(check["range"])) for check in row["checks"]
        if check["range"] and not check["holds"] and check["role"] in (Role.REACH, Role.PRINTED)
    ]  # fmt: skip
    figures = [one for one in row["exhibits"] if not isinstance(one, exhibit.Table)]
    try:
        widths = iter(chart.layout(figures))
    except (AttributeError, TypeError, ValueError) as error:
        raise _unknown(row["claim"], error) from error
    exhibits = []
    for place, one in enumerate(row["exhibits"]):
        try:
            if isinstance(one, exhibit.Table):
                exhibits.append({"kind": "table", **_table(one)})
                continue
            width = next(widths)
            drawn = chart.drawn(one, width=width, most=most)
        except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
            raise _unknown(row["claim"], error) from error  # numbers that are none, columns that are no list
        key = f"{row['claim']}~{place}"
        if drawn.data:
            charts[key] = drawn.data
        exhibits.append(
            {
                "kind": one.kind, "key": key, "wide": width == chart.WIDE, "svg": Markup(drawn.svg), "left_out": drawn.left_out,
                "caption": tex.text(one.caption), "title": tex.plain(one.caption),
                "keys": [(series.name, Markup(series.mark)) for series in drawn.keys],
            }
        )  # fmt: skip
    worded = {key: tex.text(row[key] or "") for key in ("says", "tested", "accepted", "first_words", "second_words", "fault")}
    return row | worded | {
        "kind": name, "letter": letter, "meaning": meaning, "ranges": list(dict.fromkeys(ranges)),
        "heading": tex.plain(row["title"]), "formula": tex.formula(row["formula"]) if row["formula"] else "",
        "groups": list(_groups(row["checks"])), "held": sum(check["holds"] for check in row["checks"]), "exhibits": exhibits,
        "number": len(row["checks"]),
    }  # fmt: skip


def _groups(checks: Iterable[dict[str, Any]]) -> Iterable[dict[str, Any]]:
    """Checks in order; those of one pattern that hold, where they are many, as one line that unfolds."""
    patterns: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for check in checks:
        patterns.setdefault((_pattern(check["says"]), check["role"]), []).append(check)
    for (_, role), own in patterns.items():
        shown = [_check(check) for check in own]
        held = [check for check in shown if check["holds"]]
        if len(held) <= FOLDED:
            yield {"fold": None, "rows": shown}
            continue
        yield {"fold": None, "rows": [check for check in shown if not check["holds"]]}
        yield {"fold": _fold(own, role), "rows": held}


def _fold(own: list[dict[str, Any]], role: str) -> dict[str, Any]:
    """Many checks that hold as one line: what they say alike, the least and the most found, the cases of all."""
    held = [check for check in own if check["holds"]]
    asked = {str(check["asked"]) for check in held}
    return {
        "says": _common([check["says"] for check in held]), "of": len(held), "role": ROLES[Role(role)][0],
        "found": _span([check["found"] for check in held]), "asked": _said(held[0]["asked"]) if len(asked) == 1 else "",
        "count": sum(check["count"] or 0 for check in held),
    }  # fmt: skip


def _span(found: list[Any]) -> Markup:
    """What several checks found: from the least to the most, the sum of shares, or what all of them found."""
    if all(_is_number(v) for v in found):
        return Markup("{} to {}").format(_said(min(found)), _said(max(found)))
    shares = [re.fullmatch(r"([\d,]+) of ([\d,]+)", str(v)) for v in found]
    if all(shares):
        part, whole = (sum(int(one[k].replace(",", "")) for one in shares if one) for k in (1, 2))
        return _said(f"{part:,} of {whole:,}")
    return _said(found[0]) if len(set(map(str, found))) == 1 else Markup("")


def _pattern(says: str) -> str:
    """What a check says, without its numbers and without what follows its first comma or colon."""
    head = re.split(r"[,:;(]", re.sub(r"\$[^$]*\$", "$", says), maxsplit=1)[0]
    return re.sub(r"\d[\d.,]*", "#", head).strip()


def _common(says: list[str]) -> Markup:
    """What several checks say alike, up to where they part; where that is little, the first of them."""
    first, last = min(says), max(says)
    length = next((k for k, (a, b) in enumerate(zip(first, last, strict=False)) if a != b), min(len(first), len(last)))
    words = first[:length]
    words = words[: words.rindex("$")] if words.count("$") % 2 else words
    words = words if words == first else words[: words.rfind(" ") + 1]
    words = re.sub(r"[\s,:;(]+$", "", words)
    return tex.text(words if len(words) > 3 else f"{says[0]}, and {len(says) - 1} more like it")


def _check(check: dict[str, Any]) -> dict[str, Any]:
    return {
        "says": tex.text(check["says"]), "found": _said(check["found"]), "asked": _said(check["asked"]),
        "count": check["count"], "role": check["role"], "role_words": ROLES[check["role"]][0], "holds": check["holds"],
        "range": tex.text(check["range"] or ""),
        "expected": not check["holds"] and check["role"] in (Role.PRINTED, Role.REACH),
    }  # fmt: skip


def _said(value: Any) -> Markup:
    """What was found or asked: a number to read, or words."""
    if isinstance(value, bool):
        return Markup("yes" if value else "no")
    if isinstance(value, (int, float)):
        words = page.count(value).replace("-", "−") if isinstance(value, int) else page.number(value, 3)
        return Markup('<span class="number">{}</span>').format(words)
    return Markup("–") if value is None else tex.text(str(value))


def _table(table: exhibit.Table) -> dict[str, Any]:
    """A table with the columns of numbers to the right, and those that the paper prints marked."""
    numeric = [
        any(_is_number(row[j]) for row in table.rows) and all(_is_number(row[j]) or row[j] is None for row in table.rows)
        for j in range(len(table.columns))
    ]
    columns = [
        (tex.text(name), name in table.paper, right, name in table.paper and "paper" not in name.lower())
        for name, right in zip(table.columns, numeric, strict=True)
    ]
    rows = [[(_said(cell), *columns[j][1:3]) for j, cell in enumerate(row)] for row in table.rows]
    return {"caption": tex.text(table.caption), "title": tex.plain(table.caption), "columns": columns, "rows": rows}


def _is_number(cell: Any) -> bool:
    return isinstance(cell, (int, float)) and not isinstance(cell, bool)
