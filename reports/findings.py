"""The headline findings of a run, as sentences computed from its records."""

from __future__ import annotations

from typing import Any, NamedTuple

from reports import aggregate
from reports.page import plural
from reports.run_data import RunData
from sandbox.records import CLOSED_FORM


class Finding(NamedTuple):
    """A number that leads, the sentence it leads, and the place in the page that shows it; `kind` as in words.VERDICTS."""

    figure: str
    sentence: str
    detail: str
    href: str
    kind: str


def findings(
    run: RunData, indefinite: list[aggregate.Row], closed: list[aggregate.Row], studied: list[aggregate.Row] | None = None
) -> list[Finding]:
    """The findings in the order of their weight; one that the run has no records for is left out.

    `indefinite` is aggregate.breakdown over lambda_min_W, `closed` is aggregate.closed_forms, `studied` is methods.methods.
    """
    found = [
        _false_successes(run),
        *_indefinite(indefinite),
        _repairs(run),
        _closed_forms(closed),
        _methods(studied or []),
        _no_minimum(run),
        _died(run),
    ]
    return [finding for finding in found if finding is not None]


def _of(condition: str, name: str) -> str:
    """SQL of the number of records that rows of `tally` stand for where a condition holds."""
    return f"coalesce(sum(n) filter ({condition}), 0)::bigint as {name}"


def _names(names: list[str], most: int = 8) -> str:
    shown = [name.removeprefix(CLOSED_FORM) for name in names[:most]]
    rest = len(names) - len(shown)
    return ", ".join(shown) + (f" and {rest} more" if rest else "")


def _false_successes(run: RunData) -> Finding | None:
    judged = run.rows(
        "select coalesce(sum(n), 0)::bigint as n, count(distinct backend) as backends from tally where judged and not closed"
    )[0]
    if not judged["n"]:
        return None
    rows = run.rows(
        f"""select backend, sum(n)::bigint as n, {_of("expected = 'no_minimum'", "empty")},
        {_of("expected = 'infeasible'", "infeasible")} from tally
        where judged and apart is null and not closed and verdict = 'false_success' group by 1 order by n desc, backend"""
    )
    total = sum(row["n"] for row in rows)
    if not total:
        return Finding(
            "0", f"false successes: none of {judged['backends']} backends called a wrong answer solved.",
            f"Over {plural(judged['n'], 'answer')} at {run.settings}.", "#failures", "good",
        )  # fmt: skip
    first, most = rows[0], ", ".join(f"{row['backend']} {row['n']:,}" for row in rows[1:4])
    alone = f" {first['backend']} alone {first['n']:,}." if len(rows) > 1 else ""
    empty, infeasible = sum(row["empty"] for row in rows), sum(row["infeasible"] for row in rows)
    return Finding(
        f"{total:,}",
        f"{'false success' if total == 1 else 'false successes'} by {len(rows)} of {judged['backends']} backends: "
        f"solved, said the solver, and the answer is wrong.{alone}",
        f"{empty:,} where no minimum exists, {infeasible:,} where the rows contradict each other, "
        f"{total - empty - infeasible:,} where a minimum exists and was missed."
        + (f" Next: {most}." if most else ""),
        "#failures", "bad",
    )  # fmt: skip


def _indefinite(rows: list[aggregate.Row]) -> list[Finding]:
    depths = {name: depth for name, depth in aggregate.depths(rows).items() if not name.startswith(CLOSED_FORM)}
    if not depths:
        return []
    seen = {
        name: max(row["decade"] for row in rows if row["backend"] == name and row["formulation"] == "direct") for name in depths
    }
    deepest = max(seen.values())
    whole = [name for name, depth in depths.items() if depth == deepest]
    as_seen = [name for name, depth in depths.items() if depth == seen[name] != deepest]
    never = [name for name, depth in depths.items() if depth is None]
    partly: dict[int, list[str]] = {}
    for name, depth in depths.items():
        if depth is not None and depth != seen[name]:
            partly.setdefault(depth, []).append(name)
    few = f" As deep as their sample reaches: {_names(as_seen, 30)}." if as_seen else ""
    out = [
        Finding(
            f"{len(whole) + len(as_seen)} of {len(depths)}",
            f"{'backend solves' if len(depths) == 1 else 'backends solve'} valid indefinite W posed directly, "
            f"down to λmin = {_level(deepest)}"
            + (f": {_names(whole, 30)}." if whole else ".") + few,
            f"Valid: condition (7) holds. Solve: at least {aggregate.HOLDS:.0%} of every decade verified.", "#breakdown",
            "good" if whole or as_seen else "fair",
        )
    ]  # fmt: skip
    if partly:
        steps = "; ".join(f"{_level(depth)}: {_names(names, 30)}" for depth, names in sorted(partly.items(), reverse=True))
        out.append(
            Finding(
                f"{sum(map(len, partly.values()))} of {len(depths)}", f"follow part of the way, down to λmin = {steps}.",
                "The first decade short of that share ends the range.", "#breakdown", "fair",
            )
        )  # fmt: skip
    if never:
        out.append(
            Finding(
                f"{len(never)} of {len(depths)}", f"do not solve it directly at the mildest decade: {_names(never, 30)}.",
                "Refusing is honest; the other formulations are there to repair it.", "#breakdown", "none",
            )
        )  # fmt: skip
    return out


def _level(decade: int) -> str:
    """−lambda_min of a decade as text: −1e−3."""
    return f"−1e{decade}".replace("-", "−")


def _repairs(run: RunData) -> Finding | None:
    table: dict[str, dict[str, aggregate.Row]] = {}
    for row in aggregate.repairs(run):
        table.setdefault(row["backend"], {})[row["formulation"]] = row
    convex = aggregate.holds_on_convex(run)
    weak = {
        b: t for b, t in table.items() if b in convex and "direct" in t and t["direct"]["verified"] < 0.5 * t["direct"]["n"]
    }
    if not weak:
        return None
    parts, details, short = [], [], []
    for name, phrase in {"convexified": "convexified", "null_space": "in null-space coordinates"}.items():
        own = {b: t[name] for b, t in weak.items() if name in t}
        if own:
            failing = [b for b, row in own.items() if row["verified"] < aggregate.HOLDS * row["n"]]
            parts.append(f"{len(own) - len(failing)} of {len(own)} {phrase}")
            details.append(
                f"{sum(row['verified'] for row in own.values()):,} of {sum(row['n'] for row in own.values()):,} {phrase}"
            )
            if failing:
                short.append(f"{phrase}, {_names(failing, 30)}")
    if not parts:
        return None
    direct, one = [t["direct"] for t in weak.values()], len(weak) == 1
    return Finding(
        plural(len(weak), "backend"),
        f"{'holds' if one else 'hold'} on well-conditioned convex problems but {'solves' if one else 'solve'} less than half "
        f"of the valid indefinite ones directly; reposed, {' and '.join(parts)} reach {aggregate.HOLDS:.0%} or more.",
        f"Verified: {sum(row['verified'] for row in direct):,} of {sum(row['n'] for row in direct):,} directly, "
        f"{', '.join(details)}." + (f" Short of it: {'; '.join(short)}." if short else ""),
        "#breakdown", "good" if not short else "fair",
    )  # fmt: skip


def _closed_forms(rows: list[aggregate.Row]) -> Finding | None:
    scored, within, unbounded = (sum(row[key] for row in rows) for key in ("scored", "within", "unbounded"))
    if not scored:
        return None
    outside = [row["backend"] for row in rows if row["within"] < row["scored"]]
    false = {row["backend"]: row["false_success"] for row in rows if row["false_success"]}
    details = ["Against exact rational arithmetic, rounded once."]
    if unbounded:
        details.append(f"{plural(unbounded, 'answer')} more came with no finite bound.")
    if false:
        listed = ", ".join(f"{name.removeprefix(CLOSED_FORM)} {n:,}" for name, n in false.items())
        details.append(f"{plural(sum(false.values()), 'false success', 'false successes')} among them: {listed}.")
    return Finding(
        f"{within:,} of {scored:,}",
        f"answers of the {f'{len(rows)} closed forms' if len(rows) > 1 else 'closed form'} lie within "
        f"{'their' if len(rows) > 1 else 'its'} own error bound of the exact answer"
        + (f"; outside somewhere: {_names(outside, 30)}." if outside else "."),
        " ".join(details), "#closed-forms", "fair" if outside or false else "good",
    )  # fmt: skip


def _methods(rows: list[aggregate.Row]) -> Finding | None:
    compared = [row for row in rows if row["compared"]]
    if not compared:
        return None
    short = [row["title"] for row in compared if row["agreed"] < row["compared"]]
    agreed, total = (sum(row[key] for row in compared) for key in ("agreed", "compared"))
    refused = sum(row["refused"] for row in compared)
    one = len(compared) == 1
    return Finding(
        f"{len(compared) - len(short)} of {len(compared)}",
        f"{'method agrees' if one else 'methods agree'} with {'its' if one else 'their'} own original formulation, written "
        "without the framework, in every situation that eq. (6) or its like answers"
        + (f"; not everywhere: {_names(short, 30)}." if short else "."),
        f"Within the sum of the two error bounds in {agreed:,} of {total:,} situations, robots and forms of W counted one by "
        f"one; {plural(refused, 'refusal')}.",
        "#methods", "good" if not short else "bad",
    )  # fmt: skip


def _no_minimum(run: RunData) -> Finding | None:
    rows = run.rows(
        f"""select closed, sum(n)::bigint as n, {_of("verdict = 'right_refusal'", "refused")} from tally
        where judged and apart is null and expected = 'no_minimum' and {aggregate.COUNTED}
        group by closed order by closed desc"""
    )
    if not rows:
        return None
    who = {True: "closed forms", False: "backends"}
    lead = rows[0]
    return Finding(
        f"{lead['refused']:,} of {lead['n']:,}",
        f"answers of {who[lead['closed']]} to problems without a minimum are refusals, as they must be"
        + "".join(f"; of {who[row['closed']]} {row['refused']:,} of {row['n']:,}" for row in rows[1:]) + ".",
        "Where the formulation refused before any solver was called, nothing counts; nor do problems whose class rounding can "
        "turn over. A crash or a time-out is no refusal.", "#matrix",
        "good" if lead["refused"] == lead["n"] else "bad",
    )  # fmt: skip


def _died(run: RunData) -> Finding | None:
    rows: list[dict[str, Any]] = run.rows(
        f"""select backend, {_of("verdict = 'crashed'", "crashed")}, {_of("verdict = 'timed_out'", "late")},
        {_of("verdict = 'wrong_refusal'", "refused")} from tally
        where judged and apart is null and verdict in ('crashed', 'timed_out', 'wrong_refusal')
        group by 1 order by sum(n) desc, backend"""
    )
    if not rows:
        return None
    crashed, late, refused = (sum(row[key] for row in rows) for key in ("crashed", "late", "refused"))
    return Finding(
        f"{crashed + late + refused:,}",
        f"{'answer was' if crashed + late + refused == 1 else 'answers were'} lost: {plural(crashed, 'crash', 'crashes')}, "
        f"{plural(late, 'time-out')}, "
        f"{plural(refused, 'refusal')} of what the documentation promises.",
        f"By {_names([row['backend'] for row in rows], 6)}.", "#failures", "bad",
    )  # fmt: skip
