"""A made-up run of a paper's claims: every state, role and exhibit, and texts that try to break the page."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from sandbox.claims.claim import Check, Role, State
from sandbox.claims.exhibit import Axis, Exhibit, Heat, Plot, Series, Table, as_json, histogram
from sandbox.records import CHECKS, CLAIMS, EXHIBITS, FORMAT, write_json, write_parquet

HOSTILE = "</script><script>window.hacked = 1</script><img src=x onerror='window.hacked = 1'> \"quoted\" & {{ 7 * 7 }}"
BROKEN = r"a broken $\frac{1$, an unknown $\nothing{x}$, a lone $ and a price of \$5"
LONG = "weighted_pseudoinverse_of_the_third_kind"


@dataclass(frozen=True)
class Row:
    """A claim as the ledger would keep it."""

    name: str
    state: State
    checks: tuple[Check, ...]
    exhibits: tuple[Exhibit, ...] = ()
    title: str = "A claim of the paper about the joint rates"
    where: str = "Section II, eq. (6)"
    says: str = r"When $J$ has full row rank, $\dot q$ minimises $\frac{1}{2}\dot q^T W \dot q$."
    formula: str = ""
    fault: str = r"the sign of $\alpha$ turned"
    fault_state: State = State.NOT_REPRODUCED
    noticed: bool = True


def plots() -> tuple[Exhibit, ...]:
    """One exhibit of every kind and every series, and the awkward ones."""
    rng = np.random.default_rng(0)
    x = 10 ** rng.uniform(0, 6, 300)
    many = 10 ** rng.normal(-7, 1, (2, 10_000))
    many[0, :900] = many[1, :900] = 0.0  # no logarithm
    edges = np.linspace(-3, 3, 25)
    return (
        Plot(
            "Errors of (2)–(5) and of (6), one point a problem", Axis("cond J", log=True), Axis("error [m/s]", log=True),
            (
                Series("(2)–(5)", x, 1e-16 * x**2), Series("(6)", x, 1e-16 * x, role="other"),
                Series("bound", np.sort(x), 1e-15 * np.sort(x) ** 2, "line", "bound"),
                Series("average", [], [2.7e-7], "horizontal", "paper"), Series("singular", [1e5], [], "vertical", "bound"),
            ),
        ),
        Plot(
            "Differences as histograms", Axis("difference"), Axis("count"),
            (histogram("ours", rng.normal(size=500), edges), histogram("theirs", rng.normal(1, 1, 300), edges, role="other")),
        ),
        Plot(
            "10,000 points, some of them zero", Axis("(6)", log=True), Axis("(2)–(5)", log=True, high=1e-4),
            (Series("error", many[0], many[1]), Series("equal", [1e-11, 1e-3], [1e-11, 1e-3], "line", "paper")),
        ),
        Plot(
            "Zeros and negatives where there is no logarithm", Axis("step"), Axis("residual", log=True),
            (Series("residual", list(range(6)), [1e-3, 0.0, -1.0, None, float("nan"), 1e-9], "line", text=["a", HOSTILE]),),  # type: ignore[arg-type]
        ),
        Plot("Nothing at all", Axis("x", log=True), Axis("y", log=True), (Series("empty", [], []),)),
        Plot("Without a series", Axis("x"), Axis("y"), ()),
        Plot(
            f"Categories {HOSTILE}", Axis(HOSTILE, categories=(LONG, HOSTILE, "c")), Axis("rate [rad/s]", low=0, high=2),
            (
                Series(HOSTILE, [0, 1, 2], [0.5, 1.0, 5.0]),
                Series("printed", [0, 2], [1.0, 1.5], role="paper", text=["Table I", ""]),
            ),
        ),
        Plot(
            "Many lines", Axis("t [s]"), Axis("q [rad]"),
            tuple(Series(f"joint {k}", np.arange(50.0), np.sin(np.arange(50.0) / 5 + k), "line") for k in range(14)),
        ),
        Heat(
            "Time of (6) over (2)–(5)", "n", "m", ("3", "7", LONG), ("2", "6", HOSTILE),
            [[0.5, 1.0, 2.0], [None, 0.8, 1.2], [1, 1, 1]],
        ),
        Heat(
            "In words", "backend", "problem", ("a", "b"), ("$J$", "second"), [[-1, 1], [0, None]], 0.0,
            [["no", "yes"], ["–", HOSTILE]],
        ),
        Heat("No cells", "x", "y", (), (), []),
        Table(
            f"Counts {HOSTILE}", ("method", "printed", "ours", "ratio $r$", "text"),
            (
                ("(2)–(5), $W = I$", 330, 330, 1.0, None), ("(6)", 195, 195, float("nan"), HOSTILE),
                (LONG, None, -7, 1e-300, BROKEN),
            ),
            paper=("printed",),
        ),
        Table("No rows", ("a", "b"), ()),
        Table("Long", ("k", "k squared"), tuple((k, k * k) for k in range(60))),
    )  # fmt: skip


def rows() -> list[Row]:
    """A claim of every state, out of the order of its sections, and one whose every text is hostile."""
    holds = Check("difference / bound", True, 0.031, "≤ 1", 1600)
    reach = Check(
        r"for every $W$",
        False,
        "12 of 14",
        "all",
        14,
        Role.REACH,
        range=r"It holds where $\lambda_{\min}(N^T W N) > 0.2$; not below.",
    )
    printed = Check(
        "as printed",
        False,
        "3 of 10",
        "all",
        10,
        Role.PRINTED,
        range=r"Read $-\alpha N_J^T \nabla f$ for $\alpha N_J^T \nabla f$.",
    )
    family = tuple(Check(f"agreement, $n = {n}$, $m = {m}$", True, 1e-3 * n, "≤ 1", 50) for n in range(3, 9) for m in (1, 2))
    lost = Check("the examination comes to its end", False, f"ValueError: {HOSTILE}", "no error", role=Role.OURS)
    six = (
        r"\dot q = \begin{bmatrix} J \\ N_J^T W \end{bmatrix}^{-1} "
        r"\begin{bmatrix} \dot x \\ -\alpha N_J^T \nabla f \end{bmatrix}"
    )
    shown = plots()
    return [
        Row("holds", State.REPRODUCED, (holds, *family), shown[:2], formula=six),
        Row("in_a_range", State.RANGE, (holds, reach), shown[2:4], title="The scalars may be any", where="Section V"),
        Row("with_an_erratum", State.CORRECTED, (printed, holds, replace(holds, role=Role.OURS)), shown[4:7], where="eq. (9)"),
        Row(
            "refuted", State.NOT_REPRODUCED, (replace(holds, holds=False, found=3.2),), shown[7:11], where="Table I",
            fault_state=State.UNSOUND,
        ),
        Row("broken", State.UNSOUND, (lost,), where="Section VII", noticed=False, fault_state=State.REPRODUCED),
        Row(
            "hostile", State.REPRODUCED, (replace(holds, says=f"{HOSTILE} {BROKEN}", found=None, asked=HOSTILE),), shown[11:],
            title=f"{HOSTILE} {BROKEN}", where=HOSTILE, says=f"{HOSTILE} {BROKEN}", formula=r"\begin{matrix} <b> & \frac{",
            fault=HOSTILE,
        ),
        Row("bare", State.UNSOUND, (), (), where="", says="", fault=""),
    ]  # fmt: skip


def write_paper_run(folder: Path, claims: list[Row] | None = None, **about: Any) -> list[Row]:
    """Write the run folder and return its claims."""
    claims = rows() if claims is None else claims
    content = {
        "format": FORMAT, "id": "20260101T000000Z", "kind": "paper", "command": "sandbox paper --out 'a <b>'", "seed": 0,
        "full": True, "jobs": 1, "started": "2026-01-01T00:00:00+00:00", "finished": "2026-01-01T00:01:00+00:00",
        "complete": True, "sandbox_version": "0.1.0", "python": "3.11.7", "platform": "Linux", "cpu": "a processor", "cores": 2,
        "packages": {"numpy": "2.0.0", "scipy": "1.13.0", "osqp": "1.0.0"}, "timing": {"wall": 61.2},
    }  # fmt: skip
    write_json(content | about, folder / "run.json")
    for place, row in enumerate(claims):
        claim = {
            "place": place, "claim": row.name, "title": row.title, "where": row.where, "says": row.says, "formula": row.formula,
            "tested": r"Random $J$ of every size.", "accepted": "No more than the sum of the bounds.",
            "first": "sandbox.closed_form.eq6:eq6", "first_words": "eq. (6)", "second": "sandbox.claims.equations:liegeois",
            "second_words": "eqs. (2)–(5) as printed", "sources": ["A work, 1977"], "state": str(row.state), "fault": row.fault,
            "fault_state": str(row.fault_state), "noticed": row.noticed, "seconds": 1.25, "seed": 0, "full": True,
            "command": f"sandbox paper --claim {row.name} --seed 0",
        }  # fmt: skip
        checks = [
            {
                "claim": row.name, "place": i, "says": check.says, "role": str(check.role), "holds": check.holds,
                "found": json.dumps(check.found), "asked": json.dumps(check.asked), "count": check.count, "range": check.range,
            }
            for i, check in enumerate(row.checks)
        ]  # fmt: skip
        exhibits = [
            {"claim": row.name, "place": i, "kind": one.kind, "content": as_json(one)} for i, one in enumerate(row.exhibits)
        ]
        for kind, schema, parts in (("checks", CHECKS, checks), ("exhibits", EXHIBITS, exhibits), ("claims", CLAIMS, [claim])):
            write_parquet(pa.Table.from_pylist(parts, schema), folder / kind / f"{place:02}-{row.name}.parquet")
    return claims
