"""Section IV: Tables I and II, what follows from them, and how far a count of operations gauges time."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np

from sandbox.claims import operation_counts as by_hand
from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_least, at_most, every
from sandbox.claims.exhibit import Axis, Heat, Plot, Series, Table
from sandbox.claims.operation_counts import ROWS, TABLE_II, Count, Row
from sandbox.closed_form import CLOSED_FORMS
from sandbox.closed_form.compiled import compiled
from sandbox.closed_form.uncompiled import Operations, eq6_on, operations
from sandbox.problem import VelocityProblem
from sandbox.tolerances import COMPARABLE, IMPERFECT, RANK_CORRELATION

Array = np.ndarray
Cell = tuple[int, int]
"""n joints, m task rows."""

WORDS: dict[Row, str] = {
    ("eq2_5", False): "(2)–(5), W = I", ("eq2_5", True): "(2)–(5), any W",
    ("eq6", False): "(6), W = I", ("eq6", True): "(6), any W",
}  # fmt: skip
SHOWN: tuple[Cell, ...] = ((3, 2), (4, 2), (6, 3), (6, 5), (7, 3), (7, 5), (7, 6), (10, 6), (12, 11))
"""Cells that tables show: planar and spatial arms with one redundant joint and with several."""

PAPER: Cell = (7, 6)
SHARE = 0.60
"""The paper's numbers: where Table II is, and "less than 60 %"."""

FAR = 40
"""Joints up to which Table I is evaluated, to show where its crossings tend."""


def cells(largest: int) -> list[Cell]:
    """Every 1 <= m < n <= largest."""
    return [(n, m) for n in range(2, largest + 1) for m in range(1, n)]


def counted(count: Answer, row: Row, cell: Cell, **options: bool) -> Count:
    """What `count` says of a row of Table I at (n, m)."""
    found = count(row[0], *cell, weighted=row[1], **options)
    return Count(found.multiplications, found.additions)


def totals(count: Answer, row: Row, within: Iterable[Cell], **options: bool) -> dict[Cell, int]:
    """Operations in all, cell by cell."""
    return {cell: counted(count, row, cell, **options).total for cell in within}


def ratios(count: Answer, six: Row, normal: Row, within: Iterable[Cell]) -> dict[Cell, Fraction]:
    """Operations of (6) over those of (2)-(5), exactly."""
    above, below = totals(count, six, within), totals(count, normal, within)
    return {cell: Fraction(above[cell], below[cell]) for cell in above}


def span(held: Mapping[Cell, bool], largest: int) -> str:
    """Where it holds among 1 <= m < n <= largest, by degrees of redundancy or by task rows: the shorter."""
    by_redundancy = [(f"n - m = {k}", {n: held[n, n - k] for n in range(k + 1, largest + 1)}) for k in range(1, largest)]
    by_rows = [(f"m = {m}", {n: held[n, m] for n in range(m + 1, largest + 1)}) for m in range(1, largest)]
    return "everywhere" if all(held.values()) else min(_span(by_redundancy, largest), _span(by_rows, largest), key=len)


def _span(lines: list[tuple[str, dict[int, bool]]], largest: int) -> str:
    said = []
    for name, line in lines:
        ns = [n for n, holds in line.items() if holds]
        starts, ends = [n for n in ns if n - 1 not in ns], [n for n in ns if n + 1 not in ns]
        runs = [
            f"$n = {a}$" if a == b else f"$n ≥ {a}$" if b == largest else f"${a} ≤ n ≤ {b}$"
            for a, b in zip(starts, ends, strict=True)
        ]
        said += [f"${name}$" + ("" if len(ns) == len(line) else " with " + " and ".join(runs))] if ns else []
    return "; ".join(said) if said else "nowhere"


def percent(part: Fraction | float) -> str:
    """A ratio as a percentage, one decimal."""
    return f"{100 * float(part):.1f} %"


def heat(caption: str, values: Mapping[Cell, Fraction | float], *, words: Mapping[Cell, str] | None = None) -> Heat:
    """A number for every (n, n - m), one printed as such in its cell unless `words` say otherwise."""
    largest = max(n for n, _ in values)
    columns, rows = range(2, largest + 1), range(1, largest)
    numbers = [[float(values[n, n - k]) if (n, n - k) in values else None for n in columns] for k in rows]
    texts = [[(words or {}).get((n, n - k), "") for n in columns] for k in rows] if words else ()
    names = tuple(map(str, columns)), tuple(map(str, rows))
    return Heat(caption, "joints n", "degrees of redundancy n − m", *names, numbers, words=texts)


def same_count(
    says: str,
    first: Answer,
    second: Answer,
    rows: Iterable[Row],
    within: Iterable[Cell],
    *,
    role: Role = Role.CLAIM,
    **options: bool,
) -> Check:
    """Both kinds of operation agree in every row and cell; it shows the first that does not."""
    pairs = [[counted(path, row, cell, **options).both for path in (first, second)] for row in rows for cell in within]
    held = [ours == theirs for ours, theirs in pairs]
    words = f"{sum(held)} of {len(held)}"
    if not all(held):
        words += "; the first that does not: {} against {}".format(*pairs[held.index(False)])
    return Check(says, all(held), words, "all", 2 * len(held), role)


# ---- Table I


def table_1(trial: Trial, count: Answer, described: Answer) -> Evidence:
    """Every row of Table I: counted on running code, added up from the text, and as printed."""
    within = cells(trial.of(12, 5))
    checks = []
    for row in ROWS:
        checks.append(
            same_count(f"{WORDS[row]}: counted on the running code, and Table I", count, by_hand.table_1, [row], within)
        )
        checks.append(same_count(f"{WORDS[row]}: added up from the text, and counted", described, count, [row], within))
    residues = [by_hand.sixfold(row, n, m) for row in ROWS for n in range(6, 12) for m in range(6)]
    checks.append(
        every(
            "the eight polynomials are integers for every $n$ and $m$: six times each is a multiple of 6 for all 36 residues",
            [value % 6 == 0 for pair in residues for value in pair],
            role=Role.OURS,
        )
    )
    shown: list[tuple[str | int, ...]] = []
    for cell in (cell for cell in SHOWN if cell in within):
        for row in ROWS:
            ours, printed = counted(count, row, cell), by_hand.table_1(row[0], *cell, weighted=row[1])
            shown.append((*cell, WORDS[row], ours.multiplications, printed.multiplications, ours.additions, printed.additions))
    table = Table(
        "Operations counted on the running code, and Table I evaluated",
        ("n", "m", "method", "mul/div counted", "mul/div, Table I", "add/sub counted", "add/sub, Table I"),
        tuple(shown), paper=("mul/div, Table I", "add/sub, Table I"),
    )  # fmt: skip
    line = [(n, m) for n, m in within if n == m + 1]
    joints = [n for n, _ in line]
    plot = Plot(
        "Operations in all for one degree of redundancy, n − m = 1",
        Axis("joints n"), Axis("operations", log=True),
        (
            *(Series(f"{WORDS[row]}, counted", joints, list(totals(count, row, line).values())) for row in ROWS),
            *(
                Series(f"{WORDS[row]}, Table I", joints, list(totals(by_hand.table_1, row, line).values()), "line", "paper")
                for row in ROWS
            ),
        ),
    )  # fmt: skip
    return Evidence(tuple(checks), (table, plot))


def dense_spared(count: Answer) -> Answer:
    """The null vectors and N'W with no product by the identity block, which Table I does not spare."""

    def planted(method: str, n: int, m: int, *, weighted: bool) -> Operations:
        return count(method, n, m, weighted=weighted, identity=True)

    return planted


# ---- Table II


def table_2(trial: Trial, count: Answer, described: Answer) -> Evidence:
    """The eight numbers at n = 7, m = 6, and where they come from."""
    checks, shown = [], []
    for row in ROWS:
        ours, text = counted(count, row, PAPER), counted(described, row, PAPER)
        held = ours.both == text.both == TABLE_II[row]
        found = "{} / {} counted, {} / {} by the text".format(*ours.both, *text.both)
        says = f"{WORDS[row]}: multiplies and divides / adds and subtracts"
        checks.append(Check(says, held, found, "{} / {}".format(*TABLE_II[row]), 2))
        shown.append((WORDS[row], ours.multiplications, TABLE_II[row][0], ours.additions, TABLE_II[row][1]))
    table = Table(
        "Table II, $n = 7$, $m = 6$",
        ("method", "mul/div counted", "mul/div printed", "add/sub counted", "add/sub printed"),
        tuple(shown), paper=("mul/div printed", "add/sub printed"),
    )  # fmt: skip
    steps = [
        (WORDS[row], step, *cost.both, percent(cost.total / counted(described, row, PAPER).total))
        for row in ROWS
        for step, cost in by_hand.steps(row[0], *PAPER, weighted=row[1]).items()
        if cost.total
    ]
    where = Table(
        "Where the operations go at $n = 7$, $m = 6$: each step of the description in section IV",
        ("method", "step", "mul/div", "add/sub", "share"), tuple(steps),
    )  # fmt: skip
    places = list(range(len(ROWS)))
    kinds = ("multiplies and divides", "adds and subtracts")
    plot = Plot(
        "Table II: counted, and printed",
        Axis("method", categories=tuple(WORDS[row] for row in ROWS)), Axis("operations at n = 7, m = 6", low=0),
        (
            *(Series(f"{kinds[i]}, counted", places, [counted(count, row, PAPER).both[i] for row in ROWS]) for i in (0, 1)),
            *(Series(f"{kinds[i]}, printed", places, [TABLE_II[row][i] for row in ROWS], role="paper") for i in (0, 1)),
        ),
    )  # fmt: skip
    return Evidence(tuple(checks), (table, where, plot))


def roots_counted(count: Answer) -> Answer:
    """Square roots of the Cholesky factors counted as divisions."""

    def planted(method: str, n: int, m: int, *, weighted: bool) -> Count:
        found = count(method, n, m, weighted=weighted)
        roots = (m + n * weighted) * (method == "eq2_5")
        return Count(found.multiplications + roots, found.additions)

    return planted


# ---- what follows from the tables

IDENTITY: tuple[Row, Row] = (("eq6", False), ("eq2_5", False))
GENERAL: tuple[Row, Row] = (("eq6", True), ("eq2_5", True))
ACROSS: tuple[Row, Row] = (("eq6", True), ("eq2_5", False))


COMPARED = "the counts compared, on the running code and by Table I"


def tends(pair: tuple[Row, Row]) -> str:
    """Where (6) takes fewer operations when there are many joints, in words."""
    return f"For many joints (6) takes fewer where $m / n$ exceeds {by_hand.limiting_share(*pair):.3f}."


def less_than_60_percent(trial: Trial, count: Answer, printed: Answer) -> Evidence:
    """(6) against (2)-(5) for W = I: at (7, 6), and for every other size."""
    largest = trial.of(12, 7)
    within = cells(largest)
    ratio = ratios(count, *IDENTITY, within)
    below, cheaper = {cell: r < SHARE for cell, r in ratio.items()}, {cell: r < 1 for cell, r in ratio.items()}
    six, normal = (totals(count, row, [PAPER])[PAPER] for row in IDENTITY)
    checks = (
        Check(
            "operations of (6) over those of (2)–(5), $W = I$, $n = 7$, $m = 6$", ratio[PAPER] < SHARE,
            f"{six} / {normal} = {percent(ratio[PAPER])}", f"< {percent(SHARE)}",
        ),
        same_count(COMPARED, count, printed, IDENTITY, within),
        every(
            f"less than {percent(SHARE)} for every $1 ≤ m < n ≤ {largest}$", list(below.values()), role=Role.REACH,
            range=f"For $n ≤ {largest}$ less than {percent(SHARE)}: {span(below, largest)}. "
            f"Fewer operations at all: {span(cheaper, largest)}. {tends(IDENTITY)}",
        ),
    )  # fmt: skip
    lines = []
    for k in range(1, min(5, largest - 1)):
        ns = list(range(k + 1, largest + 1))
        lines.append(Series(f"n − m = {k}", ns, [float(ratio[n, n - k]) for n in ns], "line"))
    plot = Plot(
        "Operations of (6) over those of (2)–(5), W = I", Axis("joints n"), Axis("ratio of operations", log=True),
        (
            *lines,
            Series("Table II", [PAPER[0]], [_printed(IDENTITY)], role="paper", text=["n = 7, m = 6"]),
            Series("60 %", [], [SHARE], "horizontal", "paper"), Series("equal", [], [1.0], "horizontal", "bound"),
        ),
    )  # fmt: skip
    table = Table(
        "Table II and the counts, $n = 7$, $m = 6$, $W = I$", ("quantity", "counted", "Table II"),
        (
            ("(6)", six, sum(TABLE_II[IDENTITY[0]])),
            ("(2)–(5)", normal, sum(TABLE_II[IDENTITY[1]])),
            ("ratio", float(ratio[PAPER]), _printed(IDENTITY)),
        ),
        paper=("Table II",),
    )  # fmt: skip
    shown = heat("Operations of (6) over those of (2)–(5), W = I: (6) takes fewer below 1", ratio)
    return Evidence(checks, (shown, plot, table))


def _printed(pair: tuple[Row, Row]) -> float:
    return sum(TABLE_II[pair[0]]) / sum(TABLE_II[pair[1]])


def general_for_identity(count: Answer) -> Answer:
    """(6) counted with a general W where W = I was asked for."""

    def planted(method: str, n: int, m: int, *, weighted: bool) -> Operations:
        return count(method, n, m, weighted=weighted or method == "eq6")

    return planted


def more_significant_for_general_weight(trial: Trial, count: Answer, printed: Answer) -> Evidence:
    """The ratio and the operations saved, for W = I and for general W."""
    largest = trial.of(12, 7)
    within = cells(largest)
    plain, general = ratios(count, *IDENTITY, within), ratios(count, *GENERAL, within)
    all_of = {row: totals(count, row, within) for row in ROWS}
    saved = {pair: {cell: all_of[pair[1]][cell] - all_of[pair[0]][cell] for cell in within} for pair in (IDENTITY, GENERAL)}
    lower = {cell: general[cell] < plain[cell] for cell in within}
    more = {cell: saved[GENERAL][cell] > saved[IDENTITY][cell] for cell in within}
    cheaper = {cell: general[cell] < 1 for cell in within}
    checks = (
        Check(
            "the ratio at $n = 7$, $m = 6$ is lower for a general $W$", lower[PAPER], percent(general[PAPER]),
            f"< {percent(plain[PAPER])}",
        ),
        Check("and more operations are saved", more[PAPER], saved[GENERAL][PAPER], f"> {saved[IDENTITY][PAPER]}"),
        same_count(COMPARED, count, printed, ROWS, within),
        every(
            f"the ratio is lower for a general $W$ for every $1 ≤ m < n ≤ {largest}$", list(lower.values()), role=Role.REACH,
            range=f"For $n ≤ {largest}$ the ratio is lower: {span(lower, largest)}.",
        ),
        every(
            "and more operations are saved, or fewer lost", list(more.values()), role=Role.REACH,
            range=f"For $n ≤ {largest}$ the ratio is lower in {sum(lower.values())} of {len(lower)} cases; more operations "
            f"are saved, or fewer lost: {span(more, largest)}.",
        ),
        every(
            "(6) is the cheaper of the two for a general $W$", list(cheaper.values()), role=Role.REACH,
            range=f"(6) takes fewer operations for a general $W$: {span(cheaper, largest)}. {tends(GENERAL)}",
        ),
    )  # fmt: skip
    low = float(min(general.values()))
    high = float(max(plain.values()))
    plot = Plot(
        "The ratio of (6) to (2)–(5) for a general W against that for W = I, one point for every n and m",
        Axis("ratio of operations, W = I", log=True), Axis("ratio of operations, any W", log=True),
        (
            Series(
                "counted", [float(plain[cell]) for cell in within], [float(general[cell]) for cell in within],
                text=[f"n = {n}, m = {m}" for n, m in within],
            ),
            Series("Table II", [_printed(IDENTITY)], [_printed(GENERAL)], role="paper", text=["n = 7, m = 6"]),
            Series("equal ratios", [low, high], [low, high], "line", "bound"),
        ),
    )  # fmt: skip
    table = Table(
        "Ratio of (6) to (2)–(5) and operations saved",
        ("n", "m", "ratio, $W = I$", "ratio, any $W$", "saved, $W = I$", "saved, any $W$"),
        tuple(
            (*cell, float(plain[cell]), float(general[cell]), saved[IDENTITY][cell], saved[GENERAL][cell])
            for cell in SHOWN if cell in within
        ),
    )  # fmt: skip
    shown = heat("Operations of (6) over those of (2)–(5), any W: (6) takes fewer below 1", general)
    return Evidence(checks, (shown, plot, table))


def weight_not_factored(count: Answer) -> Answer:
    """(2)-(5) with a general W counted as if W = L L' came for nothing, and the substitutions with it."""

    def planted(method: str, n: int, m: int, *, weighted: bool) -> Operations:
        return count(method, n, m, weighted=weighted and method == "eq6")

    return planted


def general_cheaper_than_identity(trial: Trial, count: Answer, printed: Answer) -> Evidence:
    """(6) with any W against (2)-(5) with W = I."""
    largest = trial.of(12, 7)
    within = cells(largest)
    ratio = ratios(count, *ACROSS, within)
    cheaper = {cell: r < 1 for cell, r in ratio.items()}
    six, normal = (totals(count, row, [PAPER])[PAPER] for row in ACROSS)
    checks = (
        Check("operations of (6) with any $W$ and of (2)–(5) with $W = I$, $n = 7$, $m = 6$", six < normal, six, f"< {normal}"),
        same_count(COMPARED, count, printed, ACROSS, within),
        every(
            f"(6) with any $W$ takes fewer for every $1 ≤ m < n ≤ {largest}$", list(cheaper.values()), role=Role.REACH,
            range=f"For $n ≤ {largest}$, (6) with any $W$ takes fewer operations than (2)–(5) with $W = I$: "
            f"{span(cheaper, largest)}. {tends(ACROSS)}",
        ),
    )  # fmt: skip
    table = Table(
        "(6) with any $W$, and (2)–(5) with $W = I$, at $n = 7$, $m = 6$", ("method", "counted", "Table II"),
        tuple((WORDS[row], totals(count, row, [PAPER])[PAPER], sum(TABLE_II[row])) for row in ACROSS), paper=("Table II",),
    )  # fmt: skip
    shown = heat("Operations of (6) with any W over those of (2)–(5) with W = I: (6) takes fewer below 1", ratio)
    return Evidence(checks, (shown, _frontier(count, printed, largest), table))


def _frontier(count: Answer, printed: Answer, largest: int) -> Plot:
    """The most degrees of redundancy with which (6) still takes fewer operations, over n, for the three comparisons."""
    series = []
    for words, pair in (("W = I in both", IDENTITY), ("any W in both", GENERAL), ("(6) any W, (2)–(5) W = I", ACROSS)):

        def most(of: Answer, n: int, pair: tuple[Row, Row] = pair) -> int:
            ratio = ratios(of, *pair, [(n, m) for m in range(1, n)])
            return max((n - m for (_, m), r in ratio.items() if r < 1), default=0)

        near, far = list(range(2, largest + 1)), list(range(2, FAR + 1))
        series.append(Series(f"{words}, counted", near, [most(count, n) for n in near]))
        series.append(Series(f"{words}, Table I", far, [most(printed, n) for n in far], "line", "paper"))
        limit = 1 - by_hand.limiting_share(*pair)
        series.append(Series(f"{words}, limit {limit:.3f} n", [2, FAR], [2 * limit, FAR * limit], "line", "bound"))
    return Plot(
        "The most degrees of redundancy with which (6) takes fewer operations than (2)–(5)",
        Axis("joints n"), Axis("degrees of redundancy n − m", low=0), tuple(series),
    )  # fmt: skip


def every_row_weighted(count: Answer) -> Answer:
    """The product with W counted for the m rows of J in the place of the n - m rows of N_J'."""

    def planted(method: str, n: int, m: int, *, weighted: bool) -> Count:
        found = count(method, n, m, weighted=weighted)
        more = (2 * m - n) * n * (weighted and method == "eq6")
        return Count(found.multiplications + more * n, found.additions + more * (n - 1))

    return planted


# ---- the identity block of N_J


def identity_exploited(trial: Trial, count: Answer, described: Answer) -> Evidence:
    """(6) with no product by the identity block, run and counted; by hand; and who is the cheaper then."""
    largest = trial.of(12, 7)
    within = cells(largest)
    sixes = [row for row in ROWS if row[0] == "eq6"]
    dense = {row: totals(count, row, within) for row in sixes}
    spared = {row: totals(count, row, within, identity=True) for row in sixes}
    normal = {row: totals(count, ("eq2_5", row[1]), within) for row in sixes}
    gain = [1 - spared[row][cell] / dense[row][cell] for row in sixes for cell in within]
    turned = {row: {cell: dense[row][cell] >= normal[row][cell] > spared[row][cell] for cell in within} for row in sixes}
    names = {row: WORDS[row].removeprefix("(6), ") for row in sixes}
    at = ["{} / {}".format(*counted(count, row, PAPER, identity=True).both) + f" ({names[row]})" for row in sixes]
    checks = (
        same_count(
            r"the printed counts are those of code that spares the block in $(\nabla f)^T N_J$ alone",
            count, by_hand.table_1, sixes, within,
        ),
        same_count(
            "spared in every step: counted on the running code, and by hand", count, described, sixes, within,
            role=Role.OURS, identity=True,
        ),
        every(
            "nothing more is saved when the block is spared in the null vectors and in $N_J^T W$ too",
            [saved == 0 for saved in gain], role=Role.REACH,
            range=r"The printed counts spare the identity block in $(\nabla f)^T N_J$ only. Spared in every step, (6) takes "
            + f"{' and '.join(at)} at $n = 7$, $m = 6$; for $n ≤ {largest}$ it saves {percent(min(gain))} to "
            + f"{percent(max(gain))}. "
            + " ".join(f"It becomes the cheaper of the two, {names[row]}: {span(turned[row], largest)}." for row in sixes),
        ),
    )  # fmt: skip
    shown: list[tuple[str | int, ...]] = []
    for cell in (cell for cell in SHOWN if cell in within):
        for row in sixes:
            printed, ours = by_hand.table_1(row[0], *cell, weighted=row[1]), counted(count, row, cell, identity=True)
            parts = ("{} / {}".format(*part.both) for part in (printed, ours, counted(described, row, cell, identity=True)))
            shown.append((*cell, WORDS[row], *parts, normal[row][cell]))
    table = Table(
        "Multiplies and divides / adds and subtracts of (6): as printed, and with the identity block spared in every step",
        ("n", "m", "method", "Table I", "spared, counted", "spared, by hand", "(2)–(5), in all"),
        tuple(shown), paper=("Table I",),
    )  # fmt: skip
    ratio = {row: {cell: spared[row][cell] / normal[row][cell] for cell in within} for row in sixes}
    heats = [
        heat(
            f"Operations of (6) with the block spared over those of (2)–(5), {names[row]}; * where this makes (6) the cheaper",
            ratio[row], words={cell: f"{r:.2f}" + "*" * turned[row][cell] for cell, r in ratio[row].items()},
        )
        for row in sixes
    ]  # fmt: skip
    return Evidence(checks, (*heats, table))


def nothing_spared(count: Answer) -> Answer:
    """The block said to be spared, and multiplied by all the same."""

    def planted(method: str, n: int, m: int, *, weighted: bool, identity: bool = False) -> Operations:
        return count(method, n, m, weighted=weighted)

    return planted


# ---- time


def in_turn(kernel: Any, stack: Any, args: Any, J: Array, xdot: Array, W: Array, gradf: Array, x: Array, answers: Array) -> int:
    """Copy every problem of the stack into the arrays that `args` hold and solve it there; how many were refused."""
    Js, xdots, Ws, gradfs = stack
    m, n = J.shape
    refused = 0
    for i in range(Js.shape[0]):
        for r in range(m):
            xdot[r] = xdots[i, r]
            for j in range(n):
                J[r, j] = Js[i, r, j]
        for r in range(n):
            gradf[r] = gradfs[i, r]
            for j in range(n):
                W[r, j] = Ws[i, r, j]
        if kernel(*args) != 0:
            refused += 1
        for j in range(n):
            answers[i, j] = x[j]
    return refused


@cache
def _in_turn() -> Any:
    import numba

    return numba.njit(in_turn)


def stopwatch(compiled: Answer, stack: tuple[Array, ...], repeats: int) -> tuple[dict[Row, float], dict[Row, Array]]:
    """Seconds per solve of the bare kernels on a stack, the least of `repeats` taken in turns, and the answers (B, n)."""
    B, m, n = stack[0].shape
    J, xdot, W, gradf = (np.empty(part.shape[1:]) for part in stack)
    x, loop = np.zeros(n), _in_turn()
    A, N, p = np.empty((n, n)), np.eye(n, n - m, -m), np.empty(n, dtype=np.int64)
    none = np.zeros((0, n)), np.zeros((0, 0))
    work = np.empty((n, n)), np.empty((m, n)), np.empty(n), np.empty((m, m)), x, np.empty(m)
    least, answers = dict.fromkeys(ROWS, math.inf), {row: np.empty((B, n)) for row in ROWS}
    for _ in range(repeats + 1):  # the first one compiles
        for row in ROWS:
            args: tuple[Any, ...] = (J, xdot, W, gradf, 1.0, row[1], *work)
            if row[0] == "eq6":
                args = (J, xdot, W, *none, gradf, 1.0, row[1], A, N, p, np.empty(n), np.empty((2, 0)), np.empty(n), x)
            kernel, begun = compiled(row[0]), time.perf_counter()
            refused = loop(kernel, stack, args, J, xdot, W, gradf, x, answers[row])
            least[row] = min(least[row], (time.perf_counter() - begun) / B)
            if refused:
                answers[row][:] = np.nan
    return least, answers


def drawn(rng: np.random.Generator, n: int, m: int, count: int) -> tuple[Array, ...]:
    """J, xdot, W, grad f of a stack: entries in [-1, 1), W > 0 and full."""
    W = rng.uniform(-0.25, 0.25, (count, n, n))
    W = W + np.swapaxes(W, 1, 2) + n * np.eye(n)
    return rng.uniform(-1, 1, (count, m, n)), rng.uniform(-1, 1, (count, m)), W, rng.uniform(-1, 1, (count, n))


@np.errstate(invalid="ignore")  # 0 / 0 where nothing was solved: NaN fails the check
def apart(stack: tuple[Array, ...], answers: dict[Row, Array], weighted: bool, members: int = 10) -> Array:
    """How far the answers of both methods are apart, in units of the sum of their bounds, on the first `members`."""
    J, xdot, W, gradf = (part[:members] for part in stack)
    W = W if weighted else np.broadcast_to(np.eye(J.shape[2]), W.shape)
    problem = VelocityProblem(J=J, xdot=xdot, W=W, a=gradf)
    six, normal = answers["eq6", weighted][:members], answers["eq2_5", weighted][:members]
    bound = CLOSED_FORMS["eq6"].bound(problem) + CLOSED_FORMS["eq2_5"].bound(problem)
    return np.abs(six - normal).max(axis=1) / np.abs(six).max(axis=1) / bound


def count_as_gauge(trial: Trial, compiled: Answer, count: Answer) -> Evidence:
    """The ratio of times of (6) and (2)-(5) against the ratio of counts, in one run."""
    from scipy.stats import spearmanr

    rng = trial.rng("count_as_gauge")
    within = cells(12) if trial.full else [cell for cell in cells(7) if cell[0] in (3, 5, 7)]
    seconds: dict[Cell, dict[Row, float]] = {}
    off = []
    for n, m in within:
        stack = drawn(rng, n, m, trial.of(2000, 300))
        seconds[n, m], answers = stopwatch(compiled, stack, trial.of(7, 5))
        off += [apart(stack, answers, weighted) for weighted in (False, True)]
    operations = {cell: {row: counted(count, row, cell).total for row in ROWS} for cell in within}
    ratio = {
        pair: np.array([[taken[cell][pair[0]] / taken[cell][pair[1]] for cell in within] for taken in (operations, seconds)])
        for pair in (IDENTITY, GENERAL)
    }
    correlation = [spearmanr(*ratio[pair]).statistic for pair in (IDENTITY, GENERAL)]
    counts, times = np.hstack([ratio[IDENTITY], ratio[GENERAL]])
    order, clear = (counts < 1) == (times < 1), np.maximum(counts, 1 / counts) > 2
    per = {row: [1e9 * seconds[cell][row] / operations[cell][row] for cell in within] for row in ROWS}
    six, normal = (float(np.median([per[row] for row in ROWS if row[0] == method])) for method in ("eq6", "eq2_5"))
    at = [ratio[pair][:, within.index(PAPER)] for pair in (IDENTITY, GENERAL)]
    checks = (
        at_least(
            "rank correlation of the two ratios over $n$ and $m$, for $W = I$ and for a general $W$",
            correlation, RANK_CORRELATION,
        ),
        at_least(
            "the gauge is imperfect: the largest factor between the ratio of times and that of counts",
            [np.exp(np.abs(np.log(times / counts)).max())], IMPERFECT,
        ),
        every(
            "the method that counts fewer operations takes less time", order, role=Role.REACH,
            range=f"In this run it does in {order.sum()} of {len(order)} cases, and in {(order & clear).sum()} of the "
            f"{clear.sum()} where the counts differ more than twofold. (6) counts fewer operations in {(counts < 1).sum()} "
            f"cases and takes less time in {(times < 1).sum()}: in these plain scalar loops a counted operation takes it "
            f"{six:.2g} ns (median), and (2)–(5) {normal:.2g} ns. At $n = 7$, $m = 6$ it takes {at[0][1]:.2f} times as long "
            f"for $W = I$ (counts: {at[0][0]:.2f}), and {at[1][1]:.2f} times for a general $W$ (counts: {at[1][0]:.2f}).",
        ),
        at_most(
            "the problems timed are solved: difference of the two methods / sum of their bounds", np.concatenate(off), 1.0,
            role=Role.OURS,
        ),
    )  # fmt: skip
    names = [f"n = {n}, m = {m}" for n, m in within]
    ends = [float(min(counts.min(), times.min())), float(max(counts.max(), times.max()))]
    plot = Plot(
        "Time of (6) over time of (2)–(5) against the ratio of their operations, one point for every n and m",
        Axis("ratio of operations (6) / (2)–(5)", log=True), Axis("ratio of times (6) / (2)–(5)", log=True),
        (
            *(
                Series(words, list(ratio[pair][0]), list(ratio[pair][1]), text=names)
                for words, pair in (("W = I", IDENTITY), ("any W", GENERAL))
            ),
            Series("times as the counts", ends, ends, "line", "bound"), Series("equal times", [], [1.0], "horizontal", "bound"),
        ),
    )  # fmt: skip
    rate = Plot(
        "Time of one solve against its operations, compiled kernels",
        Axis("operations", log=True), Axis("time of one solve [ns]", log=True),
        tuple(
            Series(
                WORDS[row], [operations[cell][row] for cell in within], [1e9 * seconds[cell][row] for cell in within],
                text=names,
            )
            for row in ROWS
        ),
    )  # fmt: skip
    table = Table(
        "Operations and measured time of one solve [ns]",
        ("n", "m", "method", "operations", "time [ns]", "time / operation [ns]"),
        tuple(
            (*cell, WORDS[row], operations[cell][row], round(1e9 * seconds[cell][row]), per[row][within.index(cell)])
            for cell in SHOWN if cell in within for row in ROWS
        ),
    )  # fmt: skip
    return Evidence(checks, (plot, rate, table))


def optimised_away(compiled: Answer) -> Answer:
    """Kernels that return at once: what a compiler makes of work whose result nobody reads."""
    import numba

    idle = numba.njit(lambda *args: 0)
    return lambda name: idle


# ---- projection methods


def projection_methods_comparable(trial: Trial, count: Answer, projection: Callable[..., Count]) -> Evidence:
    """(6) for W = I against the projection method as we read it, with the identity block multiplied by and spared."""
    largest = trial.of(12, 7)
    within = cells(largest)
    six = {spare: totals(count, IDENTITY[0], within, identity=spare) for spare in (False, True)}
    other = {spare: {cell: projection(*cell, identity=spare) for cell in within} for spare in (False, True)}
    ratio = {spare: {cell: six[spare][cell] / other[spare][cell].total for cell in within} for spare in (False, True)}
    every_ratio = np.array([r for spare in ratio for r in ratio[spare].values()])
    faster = {spare: {cell: r < 1 for cell, r in ratio[spare].items()} for spare in ratio}
    held = [h for spare in faster for h in faster[spare].values()]
    exact = [_same_rates(trial.rng(f"projection {n} {m}"), n, m) for n, m in within if n <= 5]
    written = [by_hand.projection_accounting(*cell, identity=spare) == other[spare][cell] for spare in other for cell in within]
    ways = {False: "multiplied by, as in Table I", True: "spared in every step"}
    checks = (
        at_most(
            "operations of (6) and of the projection method: the larger over the smaller",
            np.maximum(every_ratio, 1 / every_ratio), COMPARABLE,
        ),
        every(
            "(6) takes fewer operations", held, role=Role.REACH,
            range=f"In our reading and for $n ≤ {largest}$, (6) takes fewer operations than the projection method, the "
            f"identity block of $N_J$ {ways[False]}: {span(faster[False], largest)}; {ways[True]}: "
            f"{span(faster[True], largest)}. At $n = 7$, $m = 6$ it takes {ratio[False][PAPER]:.2f} and "
            f"{ratio[True][PAPER]:.2f} times as many; over all between {every_ratio.min():.2f} and {every_ratio.max():.2f}. "
            f"The paper does not say how [30]–[33] were counted.",
        ),
        every("both give the same joint rates, in exact rationals", exact, role=Role.OURS),
        every("the projection method: counted by running it, and added up by hand", written, role=Role.OURS),
    )  # fmt: skip
    table = Table(
        "Multiplies and divides / adds and subtracts for $W = I$",
        ("n", "m", "identity block", "(6)", "projection method", "(6) / projection"),
        tuple(
            (
                *cell, ways[spare], "{} / {}".format(*counted(count, IDENTITY[0], cell, identity=spare).both),
                "{} / {}".format(*other[spare][cell].both), ratio[spare][cell],
            )
            for cell in SHOWN if cell in within for spare in (False, True)
        ),
    )  # fmt: skip
    heats = [
        heat(f"Operations of (6) over those of the projection method, W = I, identity block {ways[spare]}", ratio[spare])
        for spare in (False, True)
    ]
    return Evidence(checks, (*heats, table))


def _same_rates(rng: np.random.Generator, n: int, m: int) -> bool:
    """Whether (6) and the projection method give the same rates on a problem of small integers, in Fractions."""
    J, xdot, gradf = rng.integers(-5, 6, (m, n)), rng.integers(-5, 6, m), rng.integers(-5, 6, n)
    J[:, :m] += 20 * np.eye(m, dtype=int)  # full row rank
    rates = [by_hand.projected(Fraction, J, xdot, gradf, Fraction(1, 2), spare) for spare in (False, True)]
    _, x, *_ = eq6_on(Fraction, J, xdot, None, gradf, Fraction(1, 2), multipliers=False)
    return all((x == rate).all() for rate in rates)


def wrong_method(count: Answer) -> Answer:
    """(2)-(5) with a general W counted in the place of (6)."""

    def planted(method: str, n: int, m: int, *, weighted: bool, identity: bool = False) -> Operations:
        return count("eq2_5", n, m, weighted=True)

    return planted


RUN = CodePath("the kernels that solve in float64, run on counting numbers", operations)
TEXT = CodePath("the description in section IV added up by hand, in integers", by_hand.accounting)
PRINTED = CodePath("the polynomials printed in Table I", by_hand.table_1)

CLAIMS = (
    Claim(
        name="table_1",
        title="Table I: operations of both methods for any n and m",
        place="Section IV, Table I",
        says=r"Once $J$, $W$ and $\nabla f$ are known, the operations of (2)–(5) and of (6), for $W = I$ and for any $W$, "
        r"are eight polynomials in $n$ and $m$: multiplies with divides, and adds with subtracts.",
        tested=r"The source that solves in float64 is run on numbers that count, for all $1 ≤ m < n ≤ 12$; apart from it, "
        r"the text's description is added up by hand. Conventions found: square roots, comparisons and negations are not "
        r"counted; $\alpha \nabla f$ is a product for every entry; null vectors come from dense back-substitution; for "
        r"$W = I$ nothing that involves $W$ is done. All three sides are cubic in $n$ and $m$: agreeing for $n ≤ 5$, they "
        r"agree for every $n$.",
        accepted="All three agree exactly in every row and for every $n$ and $m$.",
        paths=(RUN, TEXT),
        examine=table_1,
        fault=Fault("the identity block of $N_J$ not multiplied by in the null vectors and in $N_J^T W$", dense_spared),
        sources=("methods 8.11",),
    ),
    Claim(
        name="table_2",
        title="Table II: operations for seven joints and six task rows",
        place="Section IV, Table II",
        says="For $n = 7$, $m = 6$ the operations are the eight numbers of Table II.",
        tested="Counted on the running code, and added up from the text.",
        accepted="All eight agree exactly.",
        paths=(RUN, TEXT),
        examine=table_2,
        fault=Fault("square roots counted as divisions", roots_counted),
    ),
    Claim(
        name="less_than_60_percent",
        title="(6) takes less than 60 % of the operations of (2)–(5)",
        place="Section IV, below Table II",
        says="For $n = 7$, $m = 6$ and $W = I$, (6) requires less than 60 % of the cost of (2)–(5).",
        tested="The ratio of all operations counted, there and for every other $n$ and $m$.",
        accepted="The ratio is below 0.6; where else it is, is computed.",
        paths=(RUN, PRINTED),
        examine=less_than_60_percent,
        fault=Fault("(6) counted with a general $W$ in the place of $W = I$", general_for_identity),
    ),
    Claim(
        name="more_significant_for_general_weight",
        title="The difference is more significant for a general W",
        place="Section IV, below Table II",
        says=r"The difference is even more significant when $W \neq I$.",
        tested="The ratio of operations and the operations saved, for a general $W$ against those for $W = I$.",
        accepted="At $n = 7$, $m = 6$ the ratio is lower and more is saved; where else, is computed.",
        paths=(RUN, PRINTED),
        examine=more_significant_for_general_weight,
        fault=Fault("the factorisation of $W$ and the substitutions with it left out of (2)–(5)", weight_not_factored),
    ),
    Claim(
        name="general_cheaper_than_identity",
        title="(6) with any W is cheaper than (2)–(5) with W = I",
        place="Section IV, below Table II",
        says="(6) requires fewer operations for a general $W$ than (2)–(5) with $W = I$.",
        tested="Both counted for every $n$ and $m$.",
        accepted="Fewer at $n = 7$, $m = 6$; where else, is computed.",
        paths=(RUN, PRINTED),
        examine=general_cheaper_than_identity,
        fault=Fault("$W$ multiplied onto the $m$ rows of the other block", every_row_weighted),
    ),
    Claim(
        name="identity_exploited",
        title="The efficiencies of the text, and what the counts leave of one",
        place="Section IV, captions of Tables I and II",
        says="The costs are based on the efficiencies mentioned in the text; one is that rows $m + 1$ to $n$ of $N_J$ are "
        "those of the identity matrix.",
        tested=r"(6) is run on counting numbers with no product by these rows in the null vectors and in $N_J^T W$ either. "
        r"By hand this saves $m (n - m)^2$ multiplications and $m (n - m)(n - m - 1)$ additions in the null vectors, and, "
        r"with a general $W$, $n (n - m)^2$ and $n (n - m)(n - m - 1)$ in $N_J^T W$.",
        accepted="The printed counts are those of the dense steps; whether anything is left to save, is computed.",
        paths=(RUN, TEXT),
        examine=identity_exploited,
        fault=Fault("the block multiplied by where it is said to be spared", nothing_spared),
        sources=("methods 8.11",),
    ),
    Claim(
        name="count_as_gauge",
        title="A count of operations is an imperfect measure and a rough gauge",
        place="Section IV, footnote 3",
        says="A floating-point count is an imperfect measure of the cost of an implementation, and is used only as a rough "
        "gauge.",
        tested="Both kernels, compiled, are timed by turns in one run on stacks of 2,000 problems of every size, the least "
        "of seven repeats; beside it their counts. The kernels are plain scalar loops, without multipliers or checks. "
        "Comparisons (the search for pivots), copies, look-ups of pivoted indices and square roots take time and are not "
        "counted.",
        accepted="The ratios of times and of counts are ordered alike and are not equal; whether who counts less is faster, "
        "is computed.",
        paths=(
            CodePath("time of the compiled kernels", compiled),
            CodePath("the description in section IV added up by hand, in integers", by_hand.accounting),
        ),
        examine=count_as_gauge,
        fault=Fault("the work optimised away: the kernels return at once", optimised_away),
    ),
    Claim(
        name="projection_methods_comparable",
        title="(6) is comparable in cost with projection methods",
        place="Section IV, last paragraph",
        says="For $W = I$, (6) is similar in concept to the dual projection method [30] and the projection methods "
        "[31]–[33]; though somewhat faster, it is comparable with them in cost.",
        formula=r"\dot q = \dot q_p - N_J (N_J^T N_J)^{-1} N_J^T (\alpha \nabla f + \dot q_p)",
        tested=r"The paper gives none of these methods, and we have not identified [30]: what is counted is our reading. "
        r"$\dot q_p$ has zeros on the joints that no row of $J$ pivots on, and comes from the LU that gives $N_J$; $N_J^T "
        r"N_J$ is factored $L D L^T$, for one degree of redundancy a single division by $n_J^T n_J$. It is counted by "
        r"running it on numbers that keep a log.",
        accepted="The counts are within a factor of two of each other; which is lower, is computed.",
        paths=(RUN, CodePath("the projection method in scalar loops, run and counted", by_hand.projection_operations)),
        examine=projection_methods_comparable,
        fault=Fault("the count of (2)–(5) with a general $W$ taken for that of (6)", wrong_method),
        sources=("methods 3.P, P4",),
    ),
)
