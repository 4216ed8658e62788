"""Nothing to find: N'WN with a negative eigenvalue, or singular with a direction of descent."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from problems.sets import construct as make
from problems.sets.collect import FULL, Member, draw, grouped
from sandbox.problem_set import Group

Array = np.ndarray

TASKS = ("exact",)
ROUNDS = 2
KNOB = "lambda_min(N'WN)"
SIZES = ((2, 3), (6, 7), (2, 4), (3, 5), (3, 6), (4, 8), (5, 12))
LEVELS = (-1.0, -1e-1, -1e-3, -1e-6)  # against |W| of order 1: far above rounding


class Case(NamedTuple):
    """Size, what the stationary points are, and the negative eigenvalue of N'WN (N orthonormal) where it is chosen."""

    m: int
    n: int
    kind: str
    level: float | None


def _cases(m: int, n: int) -> list[Case]:
    kinds: list[tuple[str, float | None]] = [("maximum", level) for level in LEVELS]
    if n - m > 1:
        kinds += [("saddle", level) for level in LEVELS] + [("indefinite_singular", None)] * 2
    return [Case(m, n, kind, level) for kind, level in [*kinds, ("descending", None), ("descending", None)]]


CASES = tuple(case for size in SIZES for case in _cases(*size))


def member(case: Case, rng: np.random.Generator) -> Member:
    """One problem of `case`; the singular ones are integer, so that they are exactly singular."""
    labels = {"case": case.kind}
    if case.level is not None:
        return _curved(case, rng)._replace(labels={**labels, "knob": KNOB, "value": case.level})
    return _singular(case, rng)._replace(labels=labels)


def _curved(case: Case, rng: np.random.Generator) -> Member:
    m, n, kind, level = case
    assert level is not None
    k = n - m
    basis = make.orthonormal_basis(rng, m, n)
    eigenvalues = rng.uniform(0.5, 2.0, k)
    if kind == "maximum":
        eigenvalues *= 0.5 * level  # within (level, level/4]
    elif k > 2:
        eigenvalues[1 : rng.integers(1, k - 1, endpoint=True)] *= 0.5 * level
    eigenvalues[0] = level
    S_N = make.with_eigenvalues(rng, eigenvalues)
    W = make.weight(basis, make.symmetric(rng, m), rng.uniform(-1.0, 1.0, (m, k)), S_N)
    mixing = make.orthogonal(rng, m) * rng.uniform(0.5, 2.0, m)
    return Member(make.product(mixing, basis.J), make.vector(rng, m), W, make.vector(rng, n), None, {})


def _singular(case: Case, rng: np.random.Generator) -> Member:
    m, n, kind, _ = case
    k = n - m
    basis = make.integer_basis(rng, m, n)
    pivots = rng.integers(1, 3, k, endpoint=True).astype(float)
    pivots[int(rng.integers(1 if k > 1 else 0, k)) :] = 0.0
    if kind == "indefinite_singular":
        pivots[0] *= -1.0
    S_N, F = make.integer_form(rng, pivots)
    C, xdot = make.nonzero_integers(rng, m, k), make.integers(rng, m) / 4
    y = make.integers(rng, k)
    nu = -C.T @ xdot - S_N @ y  # h = nu + C'xdot = -S_N y lies in range S_N ...
    if kind == "descending":
        nu = nu + F[-1]  # ... and now does not: N'WN has no curvature where F[-1] points
    W = make.weight(basis, make.integer_symmetric(rng, m), C, S_N)
    return Member(basis.J, xdot, W, make.gradient(basis, make.integers(rng, m), nu), None, {})


def build(seed: int, full: bool) -> tuple[Group, ...]:
    """The groups of the set."""
    return grouped(draw(CASES, member, seed, rounds=ROUNDS * (FULL if full else 1)), TASKS)
