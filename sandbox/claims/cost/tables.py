"""Tables I and II."""

from __future__ import annotations

from sandbox.claims import operation_counts as by_hand
from sandbox.claims.claim import Answer, Check, Claim, Evidence, Fault, Role, Trial, every
from sandbox.claims.cost.comparison import (
    PAPER,
    RUN,
    SHOWN,
    TEXT,
    WORDS,
    Cell,
    cells,
    counted,
    percent,
    same_count,
    totals,
)
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.operation_counts import ROWS, TABLE_II, Count, Row
from sandbox.closed_form.uncompiled import Operations


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
            "the eight numerators of Table I are multiples of six for every $n$ and $m$: they are for all 36 pairs of residues",
            [value % 6 == 0 for pair in residues for value in pair],
            role=Role.OURS,
        )
    )

    def both(of: Answer, row: Row, cell: Cell) -> str:
        return "{} / {}".format(*counted(of, row, cell).both)

    paths = ((count, "counted"), (by_hand.table_1, "Table I"))
    table = Table(
        "Multiplies and divides / adds and subtracts, counted on the running code, and Table I evaluated",
        ("n", "m", *(f"{WORDS[row]}, {words}" for row in ROWS for _, words in paths)),
        tuple((*cell, *(both(of, row, cell) for row in ROWS for of, _ in paths)) for cell in SHOWN if cell in within),
        paper=tuple(f"{WORDS[row]}, Table I" for row in ROWS),
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


def table_2(trial: Trial, count: Answer, described: Answer) -> Evidence:
    """The eight numbers at n = 7, m = 6, and where they come from."""
    checks, shown = [], []
    for row in ROWS:
        ours, text = counted(count, row, PAPER), counted(described, row, PAPER)
        held = ours.both == text.both == TABLE_II[row]
        found = "{} / {} counted; {} / {} by hand".format(*ours.both, *text.both)
        says = f"{WORDS[row]}: multiplies and divides / adds and subtracts"
        checks.append(Check(says, held, found, "{} / {}".format(*TABLE_II[row]), 2))
        shown.append((WORDS[row], ours.multiplications, TABLE_II[row][0], ours.additions, TABLE_II[row][1]))
    table = Table(
        "Table II, $n = 7$, $m = 6$",
        ("method", "mul/div counted", "mul/div printed", "add/sub counted", "add/sub printed"),
        tuple(shown), paper=("mul/div printed", "add/sub printed"),
    )  # fmt: skip
    spent = {row: by_hand.steps(row[0], *PAPER, weighted=row[1]) for row in ROWS}
    where = Table(
        "Where the operations go at $n = 7$, $m = 6$: multiplies and divides / adds and subtracts of each step that Section IV "
        "describes",
        ("method", "step", "$W = I$", "share", "any $W$", "share of them"),
        tuple(
            (
                words, step,
                *(
                    part for row in ((method, False), (method, True))
                    for part in (
                        "{} / {}".format(*spent[row][step].both), percent(spent[row][step].total / sum(TABLE_II[row])),
                    )
                ),
            )
            for method, words in (("eq2_5", "(2)–(5)"), ("eq6", "(6)")) for step in spent[method, True]
        ),
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


TABLE_1 = Claim(
    name="table_1",
    title="Table I: operations of both methods for any n and m",
    place="Section IV, Table I",
    says=(
        r"Once $J$, $W$ and $\nabla f$ are known, the operations of (2)–(5) and of (6), for $W = I$ and for any $W$, are eight "
        r"polynomials in $n$ and $m$: multiplies with divides, and adds with subtracts."
    ),
    tested=(
        r"The source that solves in float64 is run on numbers that count, for all $1 ≤ m < n ≤ 12$; apart from it, the text's "
        r"description is added up by hand. What the text leaves open and the counts decide: square roots, comparisons and "
        r"negations are not counted; $\alpha\nabla f$ is a product for every entry; null vectors come from dense "
        r"back-substitution; for $W = I$ nothing that involves $W$ is done. All three sides are polynomials of degree three in "
        r"$n$ and $m$: where they agree for $n ≤ 5$, ten cases, they agree for every $n$."
    ),
    accepted="All three agree exactly in every row and for every $n$ and $m$.",
    paths=(RUN, TEXT),
    examine=table_1,
    fault=Fault("the identity block of $N_J$ not multiplied by in the null vectors and in $N_J^T W$", dense_spared),
)


TABLE_2 = Claim(
    name="table_2",
    title="Table II: operations for seven joints and six task rows",
    place="Section IV, Table II",
    says="For $n = 7$ and $m = 6$, common for redundant manipulators, the operations are the eight numbers of Table II.",
    tested="Counted on the running code, and added up by hand from the text.",
    accepted="All eight agree exactly.",
    paths=(RUN, TEXT),
    examine=table_2,
    fault=Fault("square roots counted as divisions", roots_counted),
)
