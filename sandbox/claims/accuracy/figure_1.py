"""Fig. 1: the errors of both methods against each other."""

from __future__ import annotations

import numpy as np

from sandbox.claims.accuracy.experiment import EXPERIMENT, PAPER_SHARES, SETUP, SHARES, both, percent
from sandbox.claims.claim import Answer, Check, Claim, Evidence, Fault, Trial, at_least
from sandbox.claims.exhibit import Axis, Plot, Series, Table
from sandbox.claims.power import scientific
from sandbox.claims.single_precision import SAMPLES, condition, uniform

Array = np.ndarray

CUT = 8.0e-6
"""Errors of (2)-(5) above this are not shown in Fig. 1 [m/s]."""


def figure_1(trial: Trial, first: Answer, second: Answer) -> Evidence:
    """Both errors of one sample against each other, as in Fig. 1 and without its cut; above the diagonal in every seed."""
    found, agree = both(trial, first, second)
    J, _, single, _ = first(*uniform(trial.seed, 0))
    cond = condition(J)
    normal, augmented = np.asarray(single, dtype=np.float64)
    shown = normal <= CUT
    cut = int((~shown).sum())
    above = found.single.shares[:, 0] / (found.single.shares[:, 0] + found.single.shares[:, 1])
    checks = (
        agree,
        at_least("share of points above the diagonal, where (6) has the smaller error, of those not on it", above, 0.5),
        Check(
            "points above the cut, which Fig. 1 does not show, are few", 0 < cut <= SAMPLES / 20, cut,
            f"1 to {SAMPLES // 20}", SAMPLES,
        ),
    )  # fmt: skip
    points = np.unique(np.stack([augmented[shown], normal[shown]]), axis=1)
    right = max(CUT, float(points[0].max()))
    paper_like = Plot(
        f"Errors of {SAMPLES:,} samples with the cut of Fig. 1: above the diagonal (2)–(5) is worse than (6). "
        f"{points.shape[1]:,} different points stand for {int(shown.sum()):,} samples; {cut} lie above the cut of "
        f"{scientific(CUT)}, up to {scientific(normal.max())}",
        Axis("error of (6) [m/s]", low=0.0, high=right), Axis("error of (2)–(5) [m/s]", low=0.0, high=CUT),
        (Series("samples", *points), Series("equal errors", [0.0, CUT], [0.0, CUT], "line", "bound")),
    )  # fmt: skip
    some = np.union1d(np.flatnonzero(~shown), np.arange(1500))
    positive = some[(normal[some] > 0) & (augmented[some] > 0)]
    low, high = augmented[positive].min(), normal[some].max()
    whole = Plot(
        "Without the cut: every sample above it, and the first 1,500; what Fig. 1 leaves out are the arms near a singularity",
        Axis("error of (6) [m/s]", log=True), Axis("error of (2)–(5) [m/s]", log=True),
        (
            *(
                Series(words, augmented[part], normal[part], text=[f"cond J = {value:.3g}" for value in cond[part]])
                for words, part in (("cond J < 10", some[cond[some] < 10]), ("cond J ≥ 10", some[cond[some] >= 10]))
            ),
            Series("equal errors", [low, high], [low, high], "line", "bound"),
            Series("cut of Fig. 1", [low], [CUT], "horizontal", "paper"),
        ),
    )  # fmt: skip
    sides = [(normal > augmented), (normal < augmented), (normal == augmented)]
    table = Table(
        "Samples of the first seed on either side of the diagonal",
        ("", "Table III", "all samples", "of those below the cut"),
        tuple(
            (words, percent(paper), percent(100 * side.mean()), percent(100 * side[shown].mean()))
            for words, paper, side in zip(SHARES, PAPER_SHARES, sides, strict=True)
        ), paper=("Table III",),
    )  # fmt: skip
    return Evidence(checks, (paper_like, whole, table))


def exchanged(path: Answer) -> Answer:
    """The two methods taken for each other."""

    def planted(q: Array, xdot: Array) -> tuple[Array, ...]:
        J, rates, single, double = path(q, xdot)
        return J, rates[::-1], single[::-1], double[::-1]

    return planted


CLAIM = Claim(
    name="figure_1",
    title="Fig. 1: most samples lie above the diagonal",
    place="Section V, Fig. 1",
    says=(
        "Errors of (2)–(5) are drawn against those of (6): a diagonal separates the regions where one method outperforms the "
        r"other, and points with errors of (2)–(5) above $8.0 \times 10^{-6}$ are not shown."
    ),
    tested=SETUP + "One seed is drawn with the cut of the figure, and once more without it.",
    accepted=(
        "More than half of the points off the diagonal lie above it, in every seed; the cut leaves out some points of the seed "
        "that is drawn, but 5 % at most."
    ),
    paths=EXPERIMENT,
    examine=figure_1,
    fault=Fault("the two methods taken for each other", exchanged),
)
