"""Truth at the speed of floats: proved by rigorous enclosures, by exact arithmetic where these do not close."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sandbox.closed_form.vectorised import WORTH, worth
from sandbox.problem import VelocityProblem
from sandbox.reference.enclosure import UP, Enclosure, enclosed, inertias
from sandbox.reference.truth import REASONS, Truth, truth
from sandbox.spectrum import smallest_eigenvalue
from sandbox.stacked import eigenvalues, svd, times, transpose

Array = np.ndarray

CLOSE = 2.0**-44
"""Radius of an enclosure, relative to the largest entry and rounding included, up to which its centre is the answer."""

REASON = tuple(REASONS)
"""Reasons by code."""

PROVED = {
    "no_freedom": "unique_minimum", "condition_7": "unique_minimum", "saddle": "no_minimum", "maximum": "no_minimum",
}  # fmt: skip
"""What a certificate can say: the reason, and the class that it puts a problem in."""


@dataclass(frozen=True, eq=False)
class Certified:
    """What is right for a stack of B problems and task "exact", rigorously, and how it was found; see Truth.

    reason (B,) : codes into REASON, -1 where it is open; rank (B,) of J; inertia (B, 3) of N'WN
    x (B, n), y (B, m) : minimiser and multipliers, NaN where there is none
    x_radius (B,), y_radius (B,) : no entry of the exact ones is further from them [unit of qdot, of y]; half a unit in the
        last place of the largest where exact arithmetic rounded them once, NaN where there is none
    exactly (B,) : decided by exact arithmetic, because no certificate closed
    """

    problem: VelocityProblem
    reason: Array
    rank: Array
    inertia: Array
    x: Array
    y: Array
    x_radius: Array
    y_radius: Array
    exactly: Array
    exact: dict[int, Truth]

    @cached_property
    def truths(self) -> list[Truth]:
        """A Truth for each, none of them open: the margins take most of the time; values are off by rounding of their terms."""
        fast = np.flatnonzero(~self.exactly)
        if not len(fast):
            return list(self.exact.values())
        part, x = self.problem[fast], self.x[fast]
        values = (x * (times(part.W.dense(), x) / 2 + part.a)).sum(axis=-1)
        freedom = np.zeros((part.n, 0))
        columns = fast, self.reason[fast], _margins(part), self.inertia[fast], values
        truths = dict(self.exact)
        for i, code, margin, (up, down, zero), value in zip(*(column.tolist() for column in columns), strict=True):
            reason = REASON[code]
            told = "exact", PROVED[reason], reason, margin, part.m, (up, down, zero)
            minimum = PROVED[reason] == "unique_minimum"
            truths[i] = Truth(*told, *((self.x[i], self.y[i], freedom, value) if minimum else (None, None, freedom, None)))
        return [truths[i] for i in range(len(self.exactly))]


def certified(problem: VelocityProblem, *, worthwhile: int = WORTH) -> Certified:
    """Decide every member of a stack with one leading axis, as `truth(problem, "exact")` does, rigorously and fast.

    What float64 does not prove goes to rationals, and so do stacks of fewer than `worthwhile`: machine code for a new size
    takes seconds to compile, once.
    """
    found = proved(problem, worthwhile=worthwhile)
    members = np.flatnonzero(found.reason < 0)
    found.exactly[members] = True
    truths: list[Truth] = truth(problem[members]) if len(members) else []  # type: ignore[assignment]
    for i, one in zip(members.tolist(), truths, strict=True):
        found.exact[i] = one
        found.reason[i], found.rank[i], found.inertia[i] = REASON.index(one.reason), one.rank, one.inertia
        if one.x is not None and one.y is not None:
            found.x[i], found.y[i] = one.x, one.y
            found.x_radius[i], found.y_radius[i] = _half_ulp(one.x), _half_ulp(one.y)
    for values in (found.x, found.y):
        values.setflags(write=False)
    return found


def proved(problem: VelocityProblem, *, worthwhile: int = 1) -> Certified:
    """What float64 alone proves of a stack: unique minima with their enclosures, saddles and maxima; the rest stays open.

    Open stay exactly singular N'WN, lower rank, problems too near to these, entries beyond 2^200, and sizes that there is no
    machine code for.
    """
    B, m, n = len(problem), problem.m, problem.n
    reason, inertia = np.full(B, -1, dtype=np.int8), np.zeros((B, 3), dtype=np.int64)
    rank = np.full(B, m)
    x, y, x_radius, y_radius = np.full((B, n), np.nan), np.full((B, m), np.nan), np.full(B, np.nan), np.full(B, np.nan)
    if m <= n and worth(B, n, problem.W.E, least=worthwhile):
        found = enclosed(problem)
        minimum = _minima(problem, found, x, y, x_radius, y_radius)
        reason[minimum] = REASON.index("condition_7" if m < n else "no_freedom")
        inertia[minimum, 0] = n - m
        rest = np.flatnonzero(~found.proved)
        if m < n and len(rest):
            inertia[rest, 0], inertia[rest, 1] = inertias(problem[rest])
            up, down = inertia[rest, 0] > 0, inertia[rest, 1] > 0
            reason[rest[down]] = REASON.index("maximum")
            reason[rest[down & up]] = REASON.index("saddle")
    return Certified(problem, reason, rank, inertia, x, y, x_radius, y_radius, np.zeros(B, dtype=bool), {})


@np.errstate(all="ignore")  # what leaves the range of float64, or has no enclosure, compares as not close
def _minima(problem: VelocityProblem, found: Enclosure, x: Array, y: Array, x_radius: Array, y_radius: Array) -> Array:
    """Enter the unique minima whose enclosure is close, and tell where they are (B,).

    Close for x is relative to its largest entry, for y relative to the terms |W||x| + |a| that J'y balances.
    """
    at_rest = np.logical_not(
        np.concatenate([problem.xdot, problem.a], axis=-1).any(axis=-1, keepdims=True)
    )  # x = 0 and y = 0, exactly
    parts = []
    for near, low, radius in ((found.x, found.x_low, found.x_radius), (found.y, found.y_low, found.y_radius)):
        centre = np.where(at_rest, 0.0, near + low)
        parts.append((centre, (np.where(at_rest, 0.0, radius).max(axis=-1) + _half_ulp(centre)) * UP))
    (qdot, off), (multipliers, slack) = parts
    size = np.abs(qdot)
    terms = times(np.abs(problem.W.dense()), size) + np.abs(problem.a)
    balance = times(transpose(np.abs(problem.J)), found.y_radius).max(axis=-1)
    close = (off <= CLOSE * size.max(axis=-1)) & ((balance <= CLOSE * terms.max(axis=-1)) | at_rest[:, 0])
    close &= found.proved & ((size * terms).sum(axis=-1) < np.inf)  # so that the optimal value is a float
    for into, values in ((x, qdot), (y, multipliers), (x_radius, off), (y_radius, slack)):
        into[close] = values[close]
    return close


def _half_ulp(values: Array) -> Array:
    """Of the largest entry of a vector or of each of a stack."""
    largest = np.abs(values).max(axis=-1)
    half: Array = np.where(largest > 0, np.spacing(largest) / 2, 0.0)
    return half


def _margins(problem: VelocityProblem) -> Array:
    """The margin (B,) of problems with J of full row rank, as margin.py defines it, for a stack."""
    m, n = problem.m, problem.n
    J = problem.J / np.abs(problem.J).max(axis=-1, initial=0.0, keepdims=True).clip(np.finfo(float).tiny)
    J = J / np.linalg.norm(J, axis=-1, keepdims=True).clip(np.finfo(float).tiny)
    _, sigma, V = svd(J)
    with np.errstate(all="ignore"):
        margin = np.minimum(1.0, sigma[:, m - 1] / sigma[:, 0])
        if n > m:
            W = problem.W.dense()
            largest = np.abs(W).max(axis=(-1, -2))
            W = W / largest[:, None, None]
            N = V[:, :, m:]
            bend = np.abs(smallest_eigenvalue(transpose(N) @ W @ N)) / np.abs(eigenvalues(W)).max(axis=-1)
            margin = np.minimum(margin, np.where((largest > 0) & (largest < np.inf), bend, 0.0))
    return margin
