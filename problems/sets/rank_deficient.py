"""Exactly rank-deficient J: achievable and unachievable xdot, task weights Wx of every kind, indefinite W."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from problems.sets import construct as make
from problems.sets.collect import FULL, Member, draw, grouped
from sandbox.problem_set import Group

Array = np.ndarray

TASKS = ("exact", "least_squares", "damped")
ROUNDS = 1
SIZES = ((2, 3, 1), (3, 4, 2), (3, 5, 2), (4, 6, 3), (6, 7, 5), (6, 7, 4), (3, 3, 2), (4, 3, 2), (5, 4, 3), (4, 3, 3))
VARIANTS = (  # xdot, Wx, W; P = (JR)'Wx(JR) is what Wx does on range J
    ("achievable", "identity", "positive definite"),
    ("achievable", "identity", "indefinite"),
    ("achievable", "positive definite", "positive definite"),
    ("achievable", "positive definite", "indefinite"),
    ("achievable", "indefinite off range J", "indefinite"),
    ("achievable", "identity", "singular on null J, level"),
    ("unachievable", "identity", "positive definite"),
    ("unachievable", "identity", "indefinite"),
    ("unachievable", "identity", "negative on null J"),
    ("unachievable", "identity", "singular on null J"),
    ("unachievable", "positive definite", "positive definite"),
    ("unachievable", "positive definite", "indefinite"),
    ("unachievable", "indefinite off range J", "positive definite"),
    ("unachievable", "indefinite off range J", "indefinite"),
    ("unachievable", "P indefinite", "positive definite"),
    ("unachievable", "P singular, target unbounded", "positive definite"),
    ("unachievable", "P singular, target not unique", "positive definite"),
)


class Case(NamedTuple):
    """Size and rank of J; kinds of xdot, Wx and W."""

    m: int
    n: int
    r: int
    xdot: str
    Wx: str
    W: str


def _meaningful(case: Case) -> bool:
    if "null J" in case.W and case.n == case.r:
        return False  # no null space
    return case.r > 1 or case.Wx != "P singular, target not unique"  # with r = 1, P = 0 and nothing is asked


CASES = tuple(case for size in SIZES for variant in VARIANTS if _meaningful(case := Case(*size, *variant)))


def member(case: Case, rng: np.random.Generator) -> Member:
    """Integer data: J = L [T_1; 0] for unimodular L and T, so that rank, range and null space are exact."""
    m, n, r = case.m, case.n, case.r
    basis = make.integer_basis(rng, r, n)  # J = B basis.J, and null J is spanned by basis.N
    L, L_inverse = make.unimodular(rng, m)
    B, dual = L[:, :r], L_inverse  # range J = range B; the rows dual[r:] annihilate it
    coordinates = make.nonzero_integers(rng, m) / 4
    if case.xdot == "achievable":
        coordinates[r:] = 0.0
    W, a = _weight(case, basis, rng), make.integers(rng, n)
    if case.W.endswith("level"):  # N'(a + W Y coordinates) = -N'WN y lies in the range of N'WN
        C, S_N = basis.Y.T @ W @ basis.N, basis.N.T @ W @ basis.N
        nu = -C.T @ coordinates[:r] - S_N @ make.integers(rng, n - r)
        a = make.gradient(basis, make.integers(rng, r), nu)
    return Member(
        J=B @ basis.J,
        xdot=L @ coordinates,
        W=W,
        a=a,
        Wx=_task_weight(case, dual, rng),
        labels={"case": f"rank {r}; xdot {case.xdot}; Wx {case.Wx}; W {case.W}"},
    )


def _weight(case: Case, basis: make.Basis, rng: np.random.Generator) -> Array:
    r, k = case.r, case.n - case.r
    if case.W == "positive definite":
        return make.integer_form(rng, rng.integers(1, 3, case.n, endpoint=True))[0]
    pivots = rng.integers(1, 3, k, endpoint=True).astype(float)
    if case.W == "negative on null J":
        pivots[0] *= -1.0
    elif case.W.startswith("singular"):
        pivots[-1] = 0.0
    S_N, _ = make.integer_form(rng, pivots)
    return make.weight(basis, make.integer_symmetric(rng, r) - 16.0 * np.eye(r), make.nonzero_integers(rng, r, k), S_N)


def _task_weight(case: Case, dual: Array, rng: np.random.Generator) -> Array | None:
    """Wx = dual' [[P, D], [D', Q]] dual, so that (JR)'Wx(JR) = P exactly."""
    if case.Wx == "identity":
        return None
    r, off = case.r, case.m - case.r
    pivots = rng.integers(1, 3, r, endpoint=True).astype(float)
    if case.Wx == "P indefinite":
        pivots[0] *= -1.0
    elif case.Wx.startswith("P singular"):
        pivots[-1] = 0.0
    P, G = make.integer_form(rng, pivots)
    B = make.nonzero_integers(rng, r, off, largest=1)
    D = P @ B
    if case.Wx == "P singular, target unbounded":
        D = D + G[-1][:, None] * np.eye(1, off)  # D c leaves range P for every c without zeros
    # [[P, P B], [B'P, B'P B + Q]] has the inertia of P and that of Q together
    sign = 1.0 if case.Wx == "positive definite" else -1.0
    Q, _ = make.integer_form(rng, sign * rng.integers(1, 3, off, endpoint=True))
    return dual.T @ np.block([[P, D], [D.T, B.T @ P @ B + Q]]) @ dual


def build(seed: int, full: bool) -> tuple[Group, ...]:
    """The groups of the set."""
    return grouped(draw(CASES, member, seed, rounds=ROUNDS * (FULL if full else 1)), TASKS)
