"""A minimum that is not unique: N'WN singular and positive semidefinite, with nothing pulling along its null space."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from problems.sets import construct as make
from problems.sets.collect import FULL, Member, draw, grouped
from sandbox.problem_set import Group

TASKS = ("exact",)
ROUNDS = 2
SIZES = ((2, 3), (6, 7), (2, 4), (3, 5), (3, 6), (3, 7), (4, 9))
KINDS = ("W semidefinite", "W generic", "W indefinite")


class Case(NamedTuple):
    """Size, dimension of the freedom that is left, and the definiteness of W."""

    m: int
    n: int
    freedom: int
    kind: str


CASES = tuple(Case(m, n, freedom, kind) for m, n in SIZES for freedom in sorted({1, (n - m + 1) // 2, n - m}) for kind in KINDS)


def member(case: Case, rng: np.random.Generator) -> Member:
    """Integer data: N'WN = F' diag(pivots) F with `freedom` zero pivots, and h = -N'WN y."""
    m, n, freedom, kind = case
    k = n - m
    basis = make.integer_basis(rng, m, n)
    pivots = rng.integers(1, 3, k, endpoint=True).astype(float)
    pivots[k - freedom :] = 0.0
    S_N, _ = make.integer_form(rng, pivots)
    if kind == "W semidefinite":
        # C = B S_N and S_T = B S_N B' + G make W = [B I]' S_N [B I] + diag(G, 0) in dual coordinates
        B = make.nonzero_integers(rng, m, k, largest=1)
        G, _ = make.integer_form(rng, rng.integers(0, 2, m, endpoint=True))
        C, S_T = B @ S_N, B @ S_N @ B.T + G
    else:
        C, S_T = make.nonzero_integers(rng, m, k), make.integer_symmetric(rng, m)
        if kind == "W indefinite":
            S_T = S_T - 16.0 * np.eye(m)
    xdot = make.integers(rng, m) / 4
    nu = -C.T @ xdot - S_N @ make.integers(rng, k)
    return Member(
        J=basis.J,
        xdot=xdot,
        W=make.weight(basis, S_T, C, S_N),
        a=make.gradient(basis, make.integers(rng, m), nu),
        Wx=None,
        labels={"case": f"{kind}, freedom {freedom}"},
    )


def build(seed: int, full: bool) -> tuple[Group, ...]:
    """The groups of the set."""
    return grouped(draw(CASES, member, seed, rounds=ROUNDS * (FULL if full else 1)), TASKS)
