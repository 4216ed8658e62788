"""The part of a report per method: what it is, how framework, original and QPs agree, and how it moves along paths."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from itertools import zip_longest
from typing import Any

import numpy as np
from markupsafe import Markup, escape

from reports import drawing
from reports.aggregate import COUNTED
from reports.page import number, plural
from reports.run_data import OF_METHODS, RunData
from reports.words import FORMULATIONS
from sandbox.check import line
from sandbox.errors import InputFileError

Row = dict[str, Any]
Array = np.ndarray

ROOM = 400_000
"""Bytes of all drawings of a page: it is to be sent by mail. Motions beyond it stand in the tables alone."""

BACK = 1e-3
"""Share of its extent by which a hand may miss where it began, or its path, and be drawn as if it did not: less is not seen."""

RIGHT = "verdict in ('verified', 'right_refusal')"

_LETTERS = {
    "qddot": "q̈", "xddot": "ẍ", "qdot": "q̇", "xdot": "ẋ", "alpha": "α", "gamma": "γ", "Gamma": "Γ", "lambda": "λ", "kappa": "κ",
    "tau": "τ", "theta": "θ", "rho": "ρ", "sigma": "σ", "grad": "∇", "sum": "Σ", "gbar": "ḡ",
}  # fmt: skip


_FORMS = {"eq6": "eq. (6)", "eq13": "eq. (13)"}


def mathematics(text: str | None) -> Markup:
    """A formula as typed, in the letters of the page: J' W^-1 as Jᵀ W⁻¹, qdot as q̇, grad f as ∇f, g_i with its index below."""
    text = re.sub(rf"(?<![A-Za-z])({'|'.join(_LETTERS)})(?![A-Za-z])", lambda found: _LETTERS[found[1]], text or "")
    text = text.replace("∇ ", "∇").replace("W~", "W̃").replace("^-1", "⁻¹").replace("^+", "⁺").replace("^2", "²")
    text = re.sub(r"(?<![^\s(\[=])-", "−", text)
    text = re.sub(r"(?<=[A-Z)\]⁺⁻¹])'(?!s\b)|(?<=_[a-z0-9])'|(?<=\b[a-z])'(?!s\b)", "ᵀ", text)
    return Markup(re.sub(r"_([A-Za-z0-9α-ω]+)", r"<sub>\1</sub>", str(escape(text))))


def methods(run: RunData, room: int = ROOM) -> list[Row]:
    """Every method that run.json lists or a table names: its card, its figures, its rows and its drawings.

    Raises InputFileError where a motion's arrays do not fit its own n and frames.
    """
    told = [row for row in run.about.get("methods") or [] if isinstance(row, dict) and row.get("name")]
    studied = run.rows("select * from methods order by method, robot, shift is not null, shift")
    moved = [_motion(row) for row in run.rows("select * from motions order by method, robot, path, integrator")]
    answers = _answers(run)
    names = dict.fromkeys([row["name"] for row in told])
    names |= dict.fromkeys(row["method"] for row in [*studied, *moved, *answers])
    cards = {row["name"]: row for row in told}
    out = []
    for place, name in enumerate(names):
        rows = [row for row in studied if row["method"] == name]
        posed = [row for row in answers if row["method"] == name]
        own = [row for row in moved if row["method"] == name and row["damping"] is None]
        card = _card(name, cards.get(name, {}))
        out.append(card | {"place": place, "rows": rows, "posed": posed, "motions": own} | _summary(rows, posed, own))
    costs = _costs([row for row in moved if row["damping"] is not None])
    for row in out:
        row["refusals"] = _refusals(row["rows"])
        row["costs"] = [cost for cost in costs if cost["home"] == row["name"]]
        row["damped_in"] = [
            other for other in out if other is not row
            and any(cost["home"] == other["name"] and row["name"] in cost["methods"] for cost in costs)
        ]  # fmt: skip
    _draw(out, room)
    return out


def _card(name: str, told: Row) -> Row:
    card: Row = {key: told.get(key) or "" for key in ("id", "title", "number", "certainty", "form")}
    card |= {key: mathematics(told.get(key)) for key in ("formula", "weight", "vector", "condition")}
    words = name.replace("_", " ")
    return card | {
        "name": name, "title": card["title"] or words[:1].upper() + words[1:], "works": told.get("works") or [],
        "refuses": told.get("refuses") or [], "form": _FORMS.get(card["form"], card["form"].replace("_", " ")),
        "task": told.get("task"),
    }  # fmt: skip


def _summary(rows: list[Row], posed: list[Row], motions: list[Row]) -> Row:
    """The figures of a method's line in the overview; None where there is nothing to count."""
    compared = [row for row in rows if row["agreed"] is not None]
    total = lambda key, of: sum(row[key] or 0 for row in of) if of else None  # noqa: E731
    cold = [row for row in posed if row["mode"] == "cold" and row["formulation"]]
    most = lambda key: max((row[key] for row in motions if row[key] is not None), key=abs, default=None)  # noqa: E731
    return {
        "situations": total("situations", rows), "held": total("held", rows), "refused": total("refused", rows),
        "agreed": total("agreed", compared), "compared": total("held", compared),
        "ratio": max((row["ratio_max"] for row in compared if row["ratio_max"] is not None), default=None),
        "verified": total("verified", cold), "counted": total("counted", cold), "drift": most("first"),
        "bracket": most("bracket"), "stopped": sum(bool(row["stopped"]) for row in motions),
    }  # fmt: skip


def _refusals(rows: list[Row]) -> list[tuple[str, int]]:
    """Words of the refusals with their counts, most first."""
    counts: dict[str, int] = {}
    for row in rows:
        try:
            told = json.loads(row["refusals"] or "{}")
            for words, n in told.items():
                counts[str(words)] = counts.get(str(words), 0) + int(n)
        except (ValueError, TypeError, AttributeError) as error:
            raise InputFileError(f"refusals of {row['method']} are no JSON of counts: {line(error)}") from error
    return sorted(counts.items(), key=lambda item: (-item[1], item[0]))


def _answers(run: RunData) -> list[Row]:
    """Per method, formulation and mode: verdict counts of backends and closed forms, and how many backends had all right."""
    keys = "method, formulation, mode"
    counted = f"judged and method is not null and {OF_METHODS}"
    every = "(select * replace ('cold' as mode) from records union all select * from warm)"
    verdicts = run.rows(
        f"select {keys}, verdict, apart, count(*) as n from {every} where {counted} group by all order by {keys}, n desc"
    )
    backends = run.rows(
        f"""with each as (
          select {keys}, backend, count(*) as n, count(*) filter ({RIGHT}) as good,
            count(*) filter (verdict = 'verified') as verified
          from {every} where {counted} and {COUNTED} group by all)
        select {keys}, count(*) as backends, count(*) filter (good = n) as whole, sum(verified)::int as verified,
          sum(n)::int as counted from each group by all"""
    )
    problems = {
        (row["method"], row["formulation"], row["mode"]): row["n"]
        for row in run.rows(f"select {keys}, count(distinct problem) as n from {every} where {counted} group by all")
    }
    out: dict[tuple[str, str | None, str], Row] = {}
    for row in verdicts:
        key = (row["method"], row["formulation"], row["mode"])
        cell = out.setdefault(
            key,
            {"method": key[0], "formulation": key[1], "mode": key[2], "problems": problems[key], "counts": {}, "apart": 0,
             "backends": 0, "whole": 0, "verified": 0, "counted": 0},
        )  # fmt: skip
        if row["apart"]:
            cell["apart"] += row["n"]
        else:
            cell["counts"][row["verdict"]] = row["n"]
    for row in backends:
        out[row["method"], row["formulation"], row["mode"]] |= {
            key: row[key] for key in ("backends", "whole", "verified", "counted")
        }
    place = {name: k for k, name in enumerate((None, *FORMULATIONS))}
    return sorted(out.values(), key=lambda row: (place.get(row["formulation"], 99), row["mode"]))


# ---- motions ----------------------------------------------------------------------------------------------------------------


def _motion(row: Row) -> Row:
    """A motion with its lists as arrays, and the figures of its line."""
    n, frames = row["n"] or 0, row["frames"] or 0
    shapes: dict[str, tuple[int, ...]] = {
        "t": (-1,), "q": (-1, n), "qdot": (-1, n), "hand": (-1, 3), "task_error": (-1,), "lambda_min_reduced": (-1,),
        "sigma_min_J": (-1,), "arm": (frames, -1, 3) if frames else (0, 0, 3), "drift": (-1,),
    }  # fmt: skip
    plain = ("method", "robot", "path", "closed", "cycles", "integrator", "stopped", "bracket", "n", "m")
    out = {key: row[key] for key in (*plain, "share", "peak_rate", "damping", "secondary_error")}
    out["singularities"] = _singularities(row)
    for key, shape in shapes.items():
        values = np.array(row[key] or [], float)
        try:
            out[key] = values.reshape(shape) if len(values) else np.empty([max(size, 0) for size in shape])
        except ValueError:
            raise InputFileError(
                f"the motion of {row['method']} on {row['robot']} along {row['path']}: {key} has {len(values)} numbers, "
                f"which do not fit {n} joints and {frames} frames"
            ) from None
    if len({len(out[key]) for key in ("t", "q", "qdot", "hand") if len(out[key])}) > 1:
        raise InputFileError(
            f"the motion of {row['method']} on {row['robot']} along {row['path']}: t, q, qdot and hand have different lengths"
        )
    out["title"] = f"{row['robot']}, {(row['path'] or 'path').replace('_', ' ')}"
    drift = out["drift"][np.isfinite(out["drift"])]
    out["first"] = float(drift[0]) if len(drift) and row["closed"] else None
    out["last"] = float(drift[-1]) if len(drift) and row["closed"] else None
    for key, pick, name in (
        ("task_error", np.max, "error"), ("lambda_min_reduced", np.min, "lambda"), ("sigma_min_J", np.min, "sigma")
    ):  # fmt: skip
        known = out[key][np.isfinite(out[key])]
        out[name] = float(pick(known)) if len(known) else None
    return out


def _singularities(row: Row) -> list[Row]:
    """What a motion met, in order of time, in the letters of the page."""
    words, of = {"end": "at the end of the motion"}, "{kind, how, of, t, value}"
    try:
        told = json.loads(row["singularities"] or "[]")
        return [
            {"kind": str(one["kind"]), "how": words.get(one["how"], str(one["how"])), "of": mathematics(str(one["of"])),
             "t": float(one["t"]), "value": float(one["value"])}
            for one in told
        ]  # fmt: skip
    except (ValueError, TypeError, KeyError) as error:
        raise InputFileError(
            f"singularities of {row['method']} on {row['robot']} along {row['path']} are no JSON of {of}: {line(error)}"
        ) from error


def _costs(damped: list[Row]) -> list[Row]:
    """What damping costs, per robot and path: the motions with growing damping, at home with the method that damps most."""
    out: dict[tuple[str, str], Row] = {}
    for motion in sorted(damped, key=lambda row: row["damping"]):
        row = out.setdefault((motion["robot"], motion["path"]), {"title": motion["title"], "motions": []})
        row["motions"].append(motion)
        row["home"] = motion["method"]
    for row in out.values():
        row["methods"] = {motion["method"] for motion in row["motions"]}
        row["drawing"] = _rates(row)
    return list(out.values())


def _rates(cost: Row) -> str:
    """|qdot| over time of each motion, in one drawing; empty where none has any."""
    known = [motion for motion in cost["motions"] if len(motion["t"]) > 1 and motion["qdot"].size]
    if not known:
        return ""
    t = np.unique(np.concatenate([motion["t"] for motion in known]))
    rates = [np.interp(t, one["t"], np.linalg.norm(one["qdot"], axis=-1), right=np.nan) for one in known]
    damped = [np.nanmax(rate) for rate, one in zip(rates, known, strict=True) if one["damping"] > 0]
    ceiling = 10 * max(damped, default=np.inf)  # into its singularity the undamped method goes on rising, out of the drawing
    lines = [
        drawing.Curve(number(one["damping"]), np.where(rate <= ceiling, rate, np.nan), place)
        for place, (rate, one) in enumerate(zip(rates, known, strict=True))
    ]
    peaks = [f"{number(one['peak_rate'])} at damping {number(one['damping'])}" for one in known]
    title = f"{cost['title']}: joint rates by damping"
    about = f"Largest joint rates: {'; '.join(peaks)}."
    return drawing.curves(
        t, lines, title=title, about=about, heading="|q̇| by damping", unit="rad/s or m/s", log=True, width=360, height=200
    )  # fmt: skip


def postures(motion: Row) -> Array:
    """The frames (c, points, 3) in which the hand is where it began: at the start and after each cycle."""
    arm: Array = motion["arm"]
    if not len(arm):
        return arm
    away = np.linalg.norm(arm[:, -1] - arm[0, -1], axis=-1)
    back = np.flatnonzero(away <= BACK * np.ptp(arm.reshape(-1, 3), axis=0).max())
    # a figure eight passes its start on the way; what is kept of later cycles is their ends alone
    ends = len(motion["drift"])
    return arm[[back[0], *back[-ends:]] if 0 < ends < len(back) - 1 else back]


def traced(motion: Row) -> Array:
    """The path of the hand (T, 3); of a closed path gone round to the end, and kept to, once around."""
    hand, t, rounds = motion["hand"], motion["t"], motion["cycles"] or 0
    whole = motion["closed"] and not motion["stopped"] and rounds > 1 and len(t) == len(hand) > 1
    if not whole or motion["error"] is None or motion["error"] > BACK * float(np.ptp(hand, axis=0).max()):
        return hand
    return hand[: int(np.searchsorted(t, t[0] + (t[-1] - t[0]) / rounds)) + 1]


def cycles(motion: Row, title: str) -> drawing.Cycles:
    """A motion as a panel of the drift figure."""
    note = (
        "stopped before the first cycle ended"
        if motion["first"] is None
        else f"drift in cycle 1: {number(motion['first'])} rad"
    )
    return drawing.Cycles(title, note, postures(motion), traced(motion), motion["drift"])


def _draw(sections: list[Row], room: int) -> None:
    """Give motions their drawings, the methods taking turns, until the room is used up."""
    for section in sections:
        for cost in section["costs"]:
            size = len(cost["drawing"].encode())
            cost["drawing"], room = (cost["drawing"], room - size) if size <= room else ("", room)
    turns = zip_longest(*(_turns(section["motions"]) for section in sections))
    waiting = [(section, motion) for turn in turns for section, motion in zip(sections, turn, strict=True) if motion]
    for section, motion in waiting if room > 0 else ():
        drawn = list(_drawings(section, motion))
        room -= sum(len(svg.encode()) for column in drawn for svg in column)
        if room < 0:
            break
        motion["drawings"] = drawn
    for section in sections:
        section["undrawn"] = sum("drawings" not in motion for motion in section["motions"])


def _turns(motions: list[Row]) -> list[Row]:
    """Another robot each time, closed paths first: what is drawn first shows most."""
    seen: dict[str, int] = {}
    ranked = []
    for motion in sorted(motions, key=lambda row: not row["closed"]):
        seen[motion["robot"]] = seen.get(motion["robot"], 0) + 1
        ranked.append((seen[motion["robot"]], motion))
    return [motion for _, motion in sorted(ranked, key=lambda pair: pair[0])]


def _drawings(section: Row, motion: Row) -> Iterator[list[str]]:
    """The drawings of a motion, as columns of SVG."""
    named = f"{section['title']}, {motion['title']}"
    t, q = motion["t"], motion["q"]
    if len(motion["arm"]):
        about = f"{plural(len(motion['arm']), 'instant')} of the arm, {plural(motion['n'], 'joint')}, and the path of its hand."
        yield [drawing.stroboscope(motion["arm"], traced(motion), title=f"{named}: the arm", about=about)]
    if len(t) > 1 and q.size:
        lines = [drawing.Curve(f"q{_below(k + 1)}", q[:, k], k) for k in range(q.shape[1])]
        about = "; ".join(f"q{k + 1} from {number(float(x[0]))} to {number(float(x[-1]))}" for k, x in enumerate(q.T)) + "."
        yield [drawing.curves(
            t, lines, title=f"{named}: joint paths", about=about, heading="joints", unit="rad or m", height=230
        )]  # fmt: skip
    small = []
    for key, place, heading, unit, about in (
        ("task_error", 6, "task error", "m or rad", f"largest {number(motion['error'])}."),
        ("lambda_min_reduced", 0, "λmin(NᵀWN)", "", f"smallest {number(motion['lambda'])}."),
    ):
        if len(t) > 1 and len(motion[key]) == len(t) and np.isfinite(motion[key]).any():
            # no error at all is no failure: a gap, where an eigenvalue of zero is marked
            y = np.where(motion[key] == 0, np.nan, motion[key]) if key == "task_error" else motion[key]
            lines, title = [drawing.Curve("", y, place)], f"{named}: {heading}"
            small.append(
                drawing.curves(t, lines, title=title, about=about, heading=heading, unit=unit, log=True, width=230, height=113)
            )
    if small:
        yield small
    if motion["first"] is not None:
        about = f"{number(motion['first'])} rad after the first cycle, {number(motion['last'])} rad after the last."
        yield [drawing.drift(motion["drift"], title=f"{named}: drift of the joints", about=about, heading="drift", height=230)]


def _below(k: int) -> str:
    """A subscript."""
    return "".join("₀₁₂₃₄₅₆₇₈₉"[int(digit)] for digit in str(k))
