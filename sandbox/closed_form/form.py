"""One closed form: what it solves, where it holds, how far off it may be; and the ledger of a stack's refusals."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from sandbox.closed_form.geometry import Geometry, Standing
from sandbox.problem import VelocityProblem
from sandbox.solution import CODE, Solution, Status, statuses

Array = np.ndarray

POSITIVE_WEIGHT = "W > 0"
CONDITION_SEVEN_HOLDS = "condition (7)"


@dataclass(frozen=True, eq=False)
class ClosedForm:
    """A row of the table.

    function : stack with one leading axis (and keyword options) -> Solution; never raises on data
    bound : the same stack -> (B,) relative forward error; inf where the form promises nothing
    bound_text : the bound as a formula; domain : where the form holds, J of full row rank unless task says otherwise
    """

    name: str
    task: str
    domain: str
    function: Callable[..., Solution]
    bound: Callable[..., Array]
    bound_text: str
    about: str
    source: str

    def __call__(self, problem: VelocityProblem, **options: object) -> Solution:
        """The answers to a stack with one leading axis."""
        return self.function(problem, **options)


class Ledger:
    """Status of every member while a form works; the first refusal of a member stands."""

    def __init__(self, problem: VelocityProblem) -> None:
        self.problem = problem
        self.codes = np.full(len(problem), CODE[Status.SOLVED], dtype=np.int8)
        self.said = [""] * len(problem)
        self.threshold = np.zeros(len(problem))
        self.evidence: dict[str, Array] = {
            "lambda_min_reduced": np.full(len(problem), np.nan),
            "lambda_max_reduced": np.full(len(problem), np.nan),
            "singular_values": np.full((len(problem), min(problem.m, problem.n)), np.nan),
        }

    @property
    def open(self) -> Array:
        """Members not refused so far (B,)."""
        solved: Array = self.codes == CODE[Status.SOLVED]
        return solved

    def refuse(self, where: Array, status: Status, reason: str | Callable[[int], str]) -> None:
        """Refuse the members `where` (B,) bool that are still open; `reason` may depend on the member."""
        for i in np.flatnonzero(where & self.open):
            self.codes[i] = CODE[status]
            self.said[i] = reason if isinstance(reason, str) else reason(int(i))

    def show(self, standing: Standing, members: Array | None = None) -> None:
        """Enter the evidence of `standing`, of `members` (all if left out)."""
        where = slice(None) if members is None else members
        for name, values in standing.evidence.items():
            self.evidence[name][where] = values
        self.threshold[where] = standing.threshold

    def refuse_by(self, standing: Standing) -> None:
        """Refuse for want of rank, of condition (7), or of a condition (7) that anybody can decide."""
        self.show(standing)
        self.refuse(~standing.full_row_rank, Status.RANK_DEFICIENT, self.rank_words)
        self.refuse(standing.singular, Status.CONDITION_SEVEN, self.curvature_words)
        self.refuse(standing.unsure, Status.ILL_CONDITIONED, self.unsure_words)

    def explain(self, where: Array) -> Geometry:
        """Compute and enter the evidence of the members `where` (B,), which is their order in the geometry returned."""
        members = np.flatnonzero(where)
        geometry = Geometry.of(self.problem[members])
        self.show(geometry, members)
        return geometry

    def rank_words(self, i: int) -> str:
        """Why J of member i is not of full row rank."""
        m, n = self.problem.m, self.problem.n
        if n < m:
            return f"J is {m} x {n}: more rows than joints, so it cannot have full row rank"
        return f"J does not have full row rank; its singular values are {numbers(self.evidence['singular_values'][i])}"

    def curvature_words(self, i: int) -> str:
        """Which way condition (7) fails for member i."""
        low, high = self.evidence["lambda_min_reduced"][i], self.evidence["lambda_max_reduced"][i]
        threshold = self.threshold[i]
        if not np.isfinite([low, high]).all():
            return "condition (7) cannot be decided: N'WN leaves the range of float64"
        if low >= -threshold:
            kind = "N'WN is singular, so a minimum is not unique or does not exist"
        elif high < -threshold:
            kind = "the stationary point is a maximum"
        else:
            kind = "the stationary point is a saddle" if high > threshold else "N'WN is singular and falls without bound"
        return f"condition (7) fails: the smallest eigenvalue of N'WN is {low:.6g} (the largest {high:.6g}): {kind}"

    def unsure_words(self, i: int) -> str:
        """Why nobody can say whether condition (7) holds for member i."""
        low, sigma = self.evidence["lambda_min_reduced"][i], self.evidence["singular_values"][i]
        return (
            f"condition (7) is within rounding error: the smallest eigenvalue of N'WN is {low:.6g}, and the null space of J "
            f"is only known to the condition of J; its singular values are {numbers(sigma)}"
        )

    def solution(self, x: Array, y: Array) -> Solution:
        """The answers of the open members; NaN elsewhere, and where the arithmetic left float64."""
        if not (np.isfinite(x).all() and np.isfinite(y).all()):
            lost = ~(np.isfinite(x).all(axis=-1) & np.isfinite(y).all(axis=-1))
            self.refuse(lost, Status.ILL_CONDITIONED, "the arithmetic left the range of float64")
        solved = self.open
        if not solved.all():
            x, y = np.where(solved[:, None], x, np.nan), np.where(solved[:, None], y, np.nan)
        return Solution(x=x, y=y, status=statuses(self.codes), said=self.said, evidence=self.evidence)


def numbers(values: Iterable[float]) -> str:
    """Six digits of each."""
    return "(" + ", ".join(f"{value:.6g}" for value in values) + ")"
