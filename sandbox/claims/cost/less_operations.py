"""What Section IV concludes from Table II."""

from __future__ import annotations

from sandbox.claims.claim import Answer, Check, Claim, Evidence, Fault, Role, Trial, every
from sandbox.claims.cost.comparison import (
    ACROSS,
    BEYOND,
    COMPARED,
    FAR,
    GENERAL,
    IDENTITY,
    PAPER,
    PRINTED,
    RUN,
    SHARE,
    SHOWN,
    WORDS,
    Pair,
    cells,
    heat,
    percent,
    printed_ratio,
    ratios,
    same_count,
    span,
    tends,
    totals,
)
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.operation_counts import ROWS, TABLE_II, Count
from sandbox.closed_form.uncompiled import Operations


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
            f"beyond the paper's words: less than {percent(SHARE)} for every $1 ≤ m < n ≤ {largest}$", list(below.values()),
            role=Role.REACH,
            range=f"{BEYOND}$n ≤ {largest}$, (6) takes less than 60 % where {span(below, largest)}, and fewer operations at "
            f"all where {span(cheaper, largest)}. {tends(IDENTITY)}",
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
            Series("Table II", [PAPER[0]], [printed_ratio(IDENTITY)], role="paper", text=["n = 7, m = 6"]),
            Series("60 %", [], [SHARE], "horizontal", "paper"), Series("equal", [], [1.0], "horizontal", "bound"),
        ),
    )  # fmt: skip
    table = Table(
        "Table II and the counts, $n = 7$, $m = 6$, $W = I$", ("quantity", "counted", "Table II"),
        (
            ("(6)", six, sum(TABLE_II[IDENTITY[0]])),
            ("(2)–(5)", normal, sum(TABLE_II[IDENTITY[1]])),
            ("ratio", float(ratio[PAPER]), printed_ratio(IDENTITY)),
        ),
        paper=("Table II",),
    )  # fmt: skip
    shown = heat("Operations of (6) over those of (2)–(5), W = I: (6) takes fewer below 1", ratio)
    return Evidence(checks, (shown, plot, table))


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
            f"beyond the paper's words: the ratio is lower for a general $W$ for every $1 ≤ m < n ≤ {largest}$",
            list(lower.values()), role=Role.REACH,
            range=f"For $n ≤ {largest}$ the ratio is lower: {span(lower, largest)}.",
        ),
        every(
            "beyond the paper's words: and more operations are saved, or fewer lost", list(more.values()), role=Role.REACH,
            range=f"{BEYOND}$n ≤ {largest}$, the ratio is lower for a general $W$ in {sum(lower.values())} of {len(lower)} "
            f"cases; more operations are saved, or fewer lost, where {span(more, largest)}. For a general $W$ (6) takes fewer "
            f"than (2)–(5) where {span(cheaper, largest)}. {tends(GENERAL)}",
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
            Series("Table II", [printed_ratio(IDENTITY)], [printed_ratio(GENERAL)], role="paper", text=["n = 7, m = 6"]),
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
            f"beyond the paper's words: (6) with any $W$ takes fewer for every $1 ≤ "
            f"m < n ≤ {largest}$", list(cheaper.values()), role=Role.REACH,
            range=f"{BEYOND}$n ≤ {largest}$, (6) with any $W$ takes fewer operations than (2)–(5) with $W = I$ where "
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

        def most(of: Answer, n: int, pair: Pair = pair) -> int:
            ratio = ratios(of, *pair, [(n, m) for m in range(1, n)])
            return max((n - m for (_, m), r in ratio.items() if r < 1), default=0)

        near, far = list(range(2, largest + 1)), list(range(2, FAR + 1))
        series.append(Series(f"{words}, counted", near, [most(count, n) for n in near]))
        series.append(Series(f"{words}, Table I", far, [most(printed, n) for n in far], "line", "paper"))
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


LESS_THAN_60_PERCENT = Claim(
    name="less_than_60_percent",
    title="(6) takes less than 60 % of the operations of (2)–(5)",
    place="Section IV, below Table II",
    says="Here, for $n = 7$, $m = 6$ and $W = I$, (6) requires less than 60 % of the cost of (2)–(5).",
    tested="The ratio of all operations counted, there and for every other $1 ≤ m < n ≤ 12$.",
    accepted="The ratio is below 0.6 at $n = 7$, $m = 6$. Where else it is, is computed; the paper does not say.",
    paths=(RUN, PRINTED),
    examine=less_than_60_percent,
    fault=Fault("(6) counted with a general $W$ in the place of $W = I$", general_for_identity),
)


MORE_SIGNIFICANT = Claim(
    name="more_significant_for_general_weight",
    title="The difference is more significant for a general W",
    place="Section IV, below Table II",
    says=r"For $n = 7$, $m = 6$ the difference is even more significant when $W \neq I$.",
    tested="The ratio of operations and the operations saved, for a general $W$ against those for $W = I$, $1 ≤ m < n ≤ 12$.",
    accepted="At $n = 7$, $m = 6$ the ratio is lower and more is saved. Where else, is computed.",
    paths=(RUN, PRINTED),
    examine=more_significant_for_general_weight,
    fault=Fault("the factorisation of $W$ and the substitutions with it left out of (2)–(5)", weight_not_factored),
)


GENERAL_CHEAPER = Claim(
    name="general_cheaper_than_identity",
    title="(6) with any W is cheaper than (2)–(5) with W = I",
    place="Section IV, below Table II",
    says="For $n = 7$, $m = 6$, (6) requires fewer operations for a general $W$ than (2)–(5) with $W = I$.",
    tested="Both counted for every $1 ≤ m < n ≤ 12$.",
    accepted="Fewer at $n = 7$, $m = 6$. Where else, is computed.",
    paths=(RUN, PRINTED),
    examine=general_cheaper_than_identity,
    fault=Fault(
        "the product with $W$ counted for the $m$ rows of $J$ in the place of the $n - m$ rows of $N_J^T$", every_row_weighted
    ),
)
