"""The counts of both methods over joints and task rows, and how they are compared and shown."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from fractions import Fraction

import numpy as np

from sandbox.claims import operation_counts as by_hand
from sandbox.claims.claim import Answer, Check, CodePath, Role
from sandbox.claims.exhibit import Heat
from sandbox.claims.operation_counts import TABLE_II, Count, Row
from sandbox.closed_form.uncompiled import operations

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

Pair = tuple[Row, Row]
"""A row of (6), and the row of (2)-(5) that it is compared with."""

IDENTITY: Pair = (("eq6", False), ("eq2_5", False))
GENERAL: Pair = (("eq6", True), ("eq2_5", True))
ACROSS: Pair = (("eq6", True), ("eq2_5", False))

BEYOND = "The paper says this below Table II, of $n = 7$ and $m = 6$. Taken beyond its words, for "
"""How the range of such a sentence begins."""

COMPARED = "the counts compared, on the running code and by Table I"


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


def tends(pair: Pair) -> str:
    """Where (6) takes fewer operations when there are many joints, in words."""
    return f"For many joints it takes fewer where $m / n$ exceeds {by_hand.limiting_share(*pair):.3f}."


def printed_ratio(pair: Pair) -> float:
    """Operations of (6) over those of (2)-(5), by Table II."""
    return sum(TABLE_II[pair[0]]) / sum(TABLE_II[pair[1]])


RUN = CodePath("the kernels that solve in float64, run on counting numbers", operations)

TEXT = CodePath("the description in Section IV added up by hand, in integers", by_hand.accounting)

PRINTED = CodePath("the polynomials printed in Table I", by_hand.table_1)
