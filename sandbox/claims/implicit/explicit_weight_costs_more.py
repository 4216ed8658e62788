"""Operations saved where W or grad f is not formed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from sandbox.claims.claim import Answer, Check, Claim, CodePath, Evidence, Fault, Role, Trial, at_least, at_most
from sandbox.claims.exhibit import Axis, Heat, Plot, Series, Table
from sandbox.closed_form.uncompiled import Operations, operations
from sandbox.implicit_study import COUNTS, LONGEST_GRADIENT, ROWS

Array = np.ndarray

SIZES = (5, 6, 7, 8, 10, 12, 16, 20, 25, 30)
"""Numbers of joints from which on the counts below are polynomials in n."""


RECURSION = {"planar": ((15, -18), (12, -18)), "spatial": ((49, -75), (42, -73))}
"""Multiplications and additions of one recursion of Newton and Euler on n links at rest: coefficients in n."""


SMALLEST = (2, 3, 4, 5)
"""Numbers of joints among which one column of N begins to save."""


MATRIX = {"planar": ((2.5, -3.5, -3), (1.5, 3.5, -11)), "spatial": ((5.5, 2.5, -6), (4, 19, -38))}
"""Of the inertia matrix by composite bodies."""


GRADIENT = {"planar": ((76, -114), (77, -114), (53, -80)), "spatial": ((79, -235), (80, -236), (53, -163))}
"""All operations of grad f in reverse mode, of the first column of N in forward mode, and of each further one."""


VALUE = {"planar": (25, -34), "spatial": (28, -74)}
"""All operations of f, half the squared gravity torque."""


Poly = Callable[[Any, Any], Any]


def formulas(poly: Poly, form: str, family: str, n: int, k: int) -> tuple[float, float]:
    """All operations (explicit, implicit) of a form on n joints for k columns of N, from polynomials in n."""
    family = "spatial" if family == "spatial" else "planar"
    product = poly((2, -1, 0), n)  # N'W, one column
    slope = poly((2, -1), n)  # N'a, one column
    if form == "inertia":
        matrix, recursion = (sum(poly(part, n) for part in table[family]) for table in (MATRIX, RECURSION))
        return matrix + k * product, k * recursion
    if form == "augmented":
        return k * poly((3, 1, 0), n) - poly((0.5, 0.5, 0), n), poly((4 * n, -n, 0), k)
    if form == "gradient":
        reverse, first, further = (poly(part, n) for part in GRADIENT[family])
        return reverse + k * slope, first + (k - 1) * further
    return n * poly(VALUE[family], n) + k * slope, k * poly(VALUE[family], n)


def counted(form: str, family: str, n: int, k: int) -> tuple[int, int]:
    """The same, counted on the symbols of the generated code, or by running plain loops on counting numbers."""
    explicit, implicit, _ = COUNTS[form](family, n, k)
    return total(explicit), total(implicit)


def total(count: Operations) -> int:
    """Multiplications and additions together."""
    return count.multiplications + count.additions


def one_column(count: Answer) -> Answer:
    """One recursion, one slope, one function evaluated, however many columns N has."""

    def planted(form: str, family: str, n: int, k: int) -> tuple[int, int]:
        return count(form, family, n, k)[0], count(form, family, n, 1)[1]

    return planted


BOUNDED = ("gradient", "black_box")
"""Forms counted up to LONGEST_GRADIENT joints."""

FORMS = {
    "inertia": "$W = M$ by inverse dynamics",
    "augmented": r"$(N_J^T E^T) \Gamma E$, augmented Jacobian",
    "gradient": r"$N_J^T \nabla f$ by forward derivatives",
    "black_box": r"$N_J^T \nabla f$, $f$ known by its values alone",
}


CALLED = {"inertia": "W = M", "augmented": "augmented Jacobian", "gradient": "∇f, forward", "black_box": "∇f, values alone"}
"""The same in a legend."""


def explicit_weight_costs_more(trial: Trial, count: Answer, poly: Answer) -> Evidence:
    """Operations of N'W and N' grad f with and without W and grad f, counted, over n and k; and from formulas."""
    wrong: list[float] = []
    saved: dict[str, dict[tuple[str, int, int], float]] = {form: {} for form in FORMS}
    sizes = SIZES if trial.full else (5, 7)
    for form in FORMS:
        for family in ROWS:
            for n in sizes:
                if form in BOUNDED and n > LONGEST_GRADIENT:
                    continue
                for k in sorted({1, 2, 3, n // 2, n - ROWS[family]} & set(range(1, n))):
                    explicit, implicit = count(form, family, n, k)
                    wrong.append(np.abs(np.subtract((explicit, implicit), formulas(poly, form, family, n, k))).max())
                    saved[form][family, n, k] = 1 - implicit / explicit
    one = [share for form in FORMS for (_, _, k), share in saved[form].items() if k == 1]
    everywhere = np.array([share for form in FORMS for share in saved[form].values()])
    explicit, implicit = count("black_box", "spatial", 7, 1)
    formed, framework = (total(operations(which, 7, 6, weighted=False)) for which in ("eq2_5", "eq6"))
    checks = (
        at_most("operations counted against closed formulas in $n$ and $k$: difference", wrong, 0.0),
        at_least(r"$n = 7$, $m = 6$, a costly $f$ known by its values alone: operations saved by not forming $\nabla f$, "
                 "over those that (6) saves beside (2)–(5)", (explicit - implicit) / (formed - framework), 1.0),
        at_least("one degree of redundancy: share of operations saved, any form and $n$", one, 0.0),
        at_least("a function known by its values alone, any $n$ and $k$: share saved", list(saved["black_box"].values()), 0.0),
        Check("beyond the paper's words: with many degrees of redundancy the other forms can cost more than they save",
              bool((everywhere < 0).any()), f"{int((everywhere < 0).sum())} of {everywhere.size}", "some",
              everywhere.size, Role.OURS),
    )  # fmt: skip
    return Evidence(checks, exhibits(trial, count, saved))


def reach(count: Answer, form: str, sizes: Sequence[int]) -> tuple[str | int, ...]:
    """From how many joints on a form saves on a spatial arm for one column of N, and for each size up to how many columns."""
    least = next(n for n in SMALLEST if np.less(*count(form, "spatial", n, 1)[::-1]))
    found = []
    for n in sizes:
        k = 0
        while k + 1 < n and (form not in BOUNDED or n <= LONGEST_GRADIENT):
            if not np.less(*count(form, "spatial", n, k + 1)[::-1]):
                break
            k += 1
        found.append("–" if k == 0 else f"any k < {n}" if k + 1 == n else f"k ≤ {k}" if k > 1 else "k = 1")
    return (least, *found)


def percent(share: float) -> str:
    """A share in per cent."""
    return f"{100 * share:.3g} %".replace("-", "−")


def exhibits(trial: Trial, count: Answer, saved: dict[str, Any]) -> tuple[Any, ...]:
    """Shares saved with k = 1 over n; the inertia form over n and k; and operations beside those of the rest of (6)."""
    lines = []
    for form in FORMS:
        for family in ("planar", "spatial"):
            points = sorted((n, share) for (f, n, k), share in saved[form].items() if f == family and k == 1)
            if form == "augmented" and family == "spatial":
                continue  # the same matrices
            name = CALLED[form] + ("" if form == "augmented" else f", {family}")
            lines.append(Series(name, [n for n, _ in points], [100 * share for _, share in points], "line"))
    plot = Plot(
        "One degree of redundancy: operations saved by not forming W or ∇f", Axis("number of joints n"),
        Axis("saved, of forming N'W or N'∇f [%]"),
        (*lines, Series("nothing saved", [min(SIZES), max(SIZES)], [0, 0], "line", "bound")),
    )  # fmt: skip
    columns = (7, 10, 16, 20, 25, 30) if trial.full else (7,)
    degrees = (1, 2, 3, 4, 6, 8, 12, 16, 24)
    ratio = []
    for k in degrees:
        pairs = [count("inertia", "spatial", n, k) if k < n else None for n in columns]
        ratio.append([None if pair is None else pair[1] / pair[0] for pair in pairs])
    heat = Heat(
        "N'M of a spatial arm: operations by k inverse dynamics over those of forming M and multiplying; below 1 it saves",
        "number of joints n", "degrees of redundancy k", tuple(str(n) for n in columns), tuple(str(k) for k in degrees), ratio,
    )  # fmt: skip
    rows = []
    for form, words in FORMS.items():
        for n, k in ((7, 1), (10, 4), (30, 1)) if trial.full else ((7, 1), (7, 3)):
            if form in BOUNDED and n > LONGEST_GRADIENT:
                continue
            explicit, implicit = count(form, "spatial", n, k)
            rest = total(operations("eq6", n, n - k, weighted=False))
            rows.append((words, n, k, explicit, implicit, percent(1 - implicit / explicit), rest,
                         percent((explicit - implicit) / (explicit + rest))))  # fmt: skip
    table = Table(
        "Spatial arms: operations with $W$ or $\\nabla f$ formed and without, beside those of the rest of (6)",
        ("form", "$n$", "$k$", "formed", "not formed", "saved", "rest of (6)", "saved of all"),
        tuple(rows),
    )
    sizes = (7, 10, 16, 30) if trial.full else (7,)
    limits = Table(
        "Spatial arms: up to how many degrees of redundancy each form takes fewer operations; – where it is not counted",
        ("form", "saves for $k = 1$ from $n$ =", *(f"$n = {n}$" for n in sizes)),
        tuple((words, *reach(count, form, sizes)) for form, words in FORMS.items()),
    )
    return plot, heat, table, limits


CLAIM = Claim(
    name="explicit_weight_costs_more",
    title="Not forming W or ∇f can be what matters most",
    place="Section III, after the weightings; Section VII",
    says=r"For problems in which $W$ or $\nabla f$ are very costly to evaluate, the ability to find the solution without "
    "them can be the most important characteristic of (6).",
    tested=r"Operations of four forms with and without $W$ or $\nabla f$, counted on generated code (sines and cosines "
    r"shared, zeros "
    "and ones dropped) over the number of joints and of degrees of redundancy. The paper's sentence is about what can be: one "
    "problem shows it.",
    accepted=r"For a costly $f$, half the squared gravity torque known by its values alone, not forming $\nabla f$ saves more "
    "operations than (6) saves beside (2)–(5). With one degree of redundancy every form saves.",
    paths=(
        CodePath("operations counted instruction by instruction", counted),
        CodePath("closed formulas in $n$ and $k$", np.polyval, "numpy:polyval"),
    ),
    examine=explicit_weight_costs_more,
    fault=Fault("one inverse dynamics, slope or evaluation counted for all columns of $N_J$", one_column),
    sources=(
        "J. Y. S. Luh, M. W. Walker, R. P. C. Paul, ASME J. Dynamic Systems, Measurement, and Control 102, 1980",
        "M. W. Walker, D. E. Orin, ASME J. Dynamic Systems, Measurement, and Control 104, 1982",
    ),
)
