"""Eq. (6) beside a projection method."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

import numpy as np

from sandbox.claims import operation_counts as by_hand
from sandbox.claims.claim import Answer, Claim, CodePath, Evidence, Fault, Role, Trial, at_most, every
from sandbox.claims.cost.comparison import (
    IDENTITY,
    PAPER,
    RUN,
    SHOWN,
    cells,
    counted,
    heat,
    span,
    totals,
)
from sandbox.claims.exhibit import Table
from sandbox.claims.operation_counts import Count
from sandbox.closed_form.uncompiled import Operations, eq6_on
from sandbox.tolerances import COMPARABLE

Array = np.ndarray


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
            "comparable: operations of (6) and of the projection method, the larger over the smaller",
            np.maximum(every_ratio, 1 / every_ratio), COMPARABLE,
        ),
        every(
            "somewhat faster: (6) takes fewer operations", held, role=Role.REACH,
            range=f"In our reading, for $n ≤ {largest}$ and with the identity block of $N_J$ {ways[False]}, (6) takes fewer "
            f"operations than the projection method where {span(faster[False], largest)}; with the block {ways[True]}, "
            f"{span(faster[True], largest)}. At $n = 7$, $m = 6$ it takes {ratio[False][PAPER]:.2f} and "
            f"{ratio[True][PAPER]:.2f} times as many; over all between {every_ratio.min():.2f} and {every_ratio.max():.2f}. "
            "The paper does not say how it compared them; with other forms of these methods the result may be another.",
        ),
        every("both give the same joint rates, in exact rationals", exact, role=Role.OURS),
        every("the projection method: counted by running it, and added up by hand", written, role=Role.OURS),
    )  # fmt: skip
    brief = {False: "multiplied by", True: "spared"}
    table = Table(
        "Multiplies and divides / adds and subtracts for $W = I$, the identity block of $N_J$ multiplied by, as in Table I, "
        "and spared in every step",
        ("n", "m", *(f"{words}, block {brief[spare]}" for spare in brief for words in ("(6)", "projection", "ratio"))),
        tuple(
            (
                *cell,
                *(
                    part for spare in brief for part in (
                        "{} / {}".format(*counted(count, IDENTITY[0], cell, identity=spare).both),
                        "{} / {}".format(*other[spare][cell].both), ratio[spare][cell],
                    )
                ),
            )
            for cell in SHOWN if cell in within
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


CLAIM = Claim(
    name="projection_methods_comparable",
    title="(6) is comparable in cost with projection methods",
    place="Section IV, last paragraph",
    says=(
        "For $W = I$, (6) is similar in concept to the dual projection method [30] and the projection methods [31]–[33]; "
        "though somewhat faster, it is comparable with these in its computational cost."
    ),
    formula=r"\dot q = \dot q_p - N_J (N_J^T N_J)^{-1} N_J^T (\alpha \nabla f + \dot q_p)",
    tested=(
        r"The paper gives none of these methods, and we have not identified [30]: what is counted is our reading. $\dot q_p$ "
        r"has zeros on the joints that no row of $J$ pivots on, and comes from the LU that gives $N_J$; $N_J^T N_J$ is "
        r"factored $L D L^T$, for one degree of redundancy a single division by $n_J^T n_J$. It is counted by running it on "
        "numbers that keep a log."
    ),
    accepted=("The counts are within a factor of two of each other. Which is the lower, is computed."),
    paths=(RUN, CodePath("the projection method in scalar loops, run and counted", by_hand.projection_operations)),
    examine=projection_methods_comparable,
    fault=Fault("the count of (2)–(5) with a general $W$ taken for that of (6)", wrong_method),
    sources=(
        "R. V. Dubey, J. A. Euler, S. M. Babcock, Real-time implementation of an optimization scheme for "
        "seven-degree-of-freedom redundant manipulators, IEEE Trans. R&A 7(5), 1991 (perhaps [31])",
        "H. Zghal, R. V. Dubey, J. A. Euler, Efficient gradient projection optimization for manipulators with multiple degrees "
        "of redundancy, ICRA 1990 (perhaps [32] or [33])",
    ),
)
