"""Truth at the speed of floats: proved by rigorous enclosures, by exact arithmetic where these do not close."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np


from sandbox.closed_form.vectorised import LARGEST
from sandbox.problem import VelocityProblem
from sandbox.reference.enclosure import Enclosure, enclosed, inertias
from sandbox.reference.truth import Truth, truth
from sandbox.spectrum import smallest_eigenvalue
from sandbox.stacked import eigenvalues, svd, transpose

Array = np.ndarray

CLOSE = 2.0**-44
"""Radius of an enclosure, relative to the largest entry, up to which its centre is taken for the answer."""


@dataclass(frozen=True, eq=False)
class Certified:
    """The truths of a stack for task "exact", and how they were found.

    x_radius (B,) : no entry of the exact minimiser is further than this from truth.x [unit of qdot]; 0.5 ulp where exact
        arithmetic rounded it once
    exactly (B,) : decided by exact arithmetic, because no certificate closed
    """

    truths: list[Truth]
    x_radius: Array
    exactly: Array


def certified(problem: VelocityProblem) -> Certified:
    """Decide every member of a stack with one leading axis, as `truth(problem, "exact")` does, rigorously and fast.

    A unique minimum and its enclosure, or a saddle or maximum, are proved in float64 (enclosure.py); everything else, as
    exactly singular N'WN, lower rank, entries beyond 2^200, more joints than there is machine code for, goes to rationals.
    """
    B, m, n = len(problem), problem.m, problem.n
    truths: list[Any] = [None] * B
    radius = np.zeros(B)
    if m <= n <= LARGEST:
        found = enclosed(problem)
        rounding = np.spacing(np.abs(found.x).max(axis=-1)) / 2
        radius = found.x_radius.max(axis=-1) + rounding
        fit = found.proved & (radius <= CLOSE * np.abs(found.x).max(axis=-1) + rounding)
        margins = _margins(problem)
        _minima(problem, found, np.flatnonzero(fit), margins, truths)
        rest = np.flatnonzero(~fit)
        if len(rest) and m < n:
            _stationary(problem, rest, margins, truths)
    exactly = np.array([one is None for one in truths])
    members = np.flatnonzero(exactly)
    for i, exact in zip(members, truth(problem[members]) if len(members) else (), strict=True):
        truths[int(i)] = exact
        radius[i] = 0.0 if exact.x is None else np.spacing(np.abs(exact.x).max()) / 2
    return Certified(truths, np.where(np.isfinite(radius), radius, 0.0), exactly)


def _minima(problem: VelocityProblem, found: Enclosure, members: Array, margins: Array, truths: list[Any]) -> None:
    """Unique minima that an enclosure proves."""
    m, n = problem.m, problem.n
    x, y = found.x + found.x_low, found.y + found.y_low
    g = (problem.W.dense() @ x[..., None])[..., 0] / 2 + problem.a
    values = (x * g).sum(axis=-1)
    freedom = np.zeros((n, 0))
    reason = "condition_7" if n > m else "no_freedom"
    for i in members.tolist():
        told = "exact", "unique_minimum", reason, float(margins[i]), m, (n - m, 0, 0)
        truths[i] = Truth(*told, x[i], y[i], freedom, float(values[i]))


def _stationary(problem: VelocityProblem, members: Array, margins: Array, truths: list[Any]) -> None:
    """Saddles and maxima, by the proved inertia of N'WN."""
    part = problem[members]
    positive, negative = inertias(part)
    freedom = np.zeros((problem.n, 0))
    for i, up, down in zip(members.tolist(), positive.tolist(), negative.tolist(), strict=True):
        if down > 0:
            reason = "saddle" if up else "maximum"
            truths[i] = Truth(
                "exact", "no_minimum", reason, float(margins[i]), problem.m, (up, down, 0), None, None, freedom, None
            )


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
