"""Answers known by construction (methods 1.7): every inertia of N'WN, integer and real data, n up to 12."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from problems.sets import construct as make
from problems.sets.collect import FULL, Member, draw, grouped
from sandbox.problem_set import Group

Array = np.ndarray

TASKS = ("exact",)
ROUNDS = 2
SIZES = ((1, 2), (2, 3), (6, 7), (2, 4), (3, 5), (10, 12), (3, 7), (4, 8), (6, 12))
VARIANTS = (  # N'WN, S_T, C, data; singular ones are integer, since only exact data make them exactly singular
    ("positive", "generic", "generic", "real"),
    ("positive", "generic", "generic", "integer"),
    ("positive", "negative", "generic", "real"),
    ("positive", "negative", "generic", "integer"),
    ("positive", "zero", "generic", "real"),
    ("positive", "generic", "zero", "integer"),
    ("negative", "generic", "generic", "real"),
    ("negative", "generic", "generic", "integer"),
    ("indefinite", "generic", "generic", "real"),
    ("indefinite", "generic", "generic", "integer"),
    ("singular", "generic", "generic", "integer"),
    ("singular, descending", "generic", "generic", "integer"),
    ("indefinite and singular", "generic", "generic", "integer"),
)


class Case(NamedTuple):
    """What is chosen of one problem."""

    m: int
    n: int
    S_N: str
    S_T: str
    C: str
    data: str

    @property
    def text(self) -> str:
        """The case in words, as labelled."""
        return f"N'WN {self.S_N}; S_T {self.S_T}; C {self.C}; {self.data} data"


CASES = tuple(
    Case(m, n, *variant)
    for m, n in SIZES
    for variant in VARIANTS
    if n - m > 1 or not variant[0].startswith("indefinite")  # one number cannot have both signs
)


class Manufactured(NamedTuple):
    """The chosen parts of one problem, from which W, a and the answer follow."""

    basis: make.Basis
    S_T: Array
    C: Array
    S_N: Array
    mu: Array
    nu: Array
    xdot: Array


def manufacture(case: Case, rng: np.random.Generator) -> Manufactured:
    """Choose J, N, S_N, S_T, C, mu, nu and xdot of `case`."""
    return (_integer if case.data == "integer" else _real)(case, rng)


def _real(case: Case, rng: np.random.Generator) -> Manufactured:
    m, n, k = case.m, case.n, case.n - case.m
    basis = make.real_basis(rng, m, n)
    sign = np.ones(k)
    if case.S_N == "negative":
        sign[:] = -1.0
    elif case.S_N == "indefinite":
        sign[: rng.integers(1, k)] = -1.0
    S_N = make.with_eigenvalues(rng, sign * rng.uniform(0.5, 2.0, k))
    S_T = {"zero": 0.0, "generic": 1.0, "negative": 1.0}[case.S_T] * make.symmetric(rng, m)
    if case.S_T == "negative":
        S_T = S_T - 16.0 * np.eye(m)
    C = rng.uniform(-1.0, 1.0, (m, k))
    return Manufactured(basis, S_T, C, S_N, make.vector(rng, m), make.vector(rng, k), make.vector(rng, m))


def _integer(case: Case, rng: np.random.Generator) -> Manufactured:
    m, n, k = case.m, case.n, case.n - case.m
    basis = make.integer_basis(rng, m, n)
    pivots = rng.integers(1, 3, k, endpoint=True).astype(float)
    if case.S_N == "negative":
        pivots = -pivots
    elif case.S_N == "indefinite":
        pivots[: rng.integers(1, k)] *= -1.0
    elif case.S_N == "indefinite and singular":
        pivots[0], pivots[-1] = -pivots[0], 0.0
    elif case.S_N.startswith("singular"):
        pivots[rng.integers(0, k) :] = 0.0
    S_N, F = make.integer_form(rng, pivots)
    S_T = make.integer_symmetric(rng, m)
    if case.S_T == "negative":
        S_T = S_T - 16.0 * np.eye(m)
    C = np.zeros((m, k)) if case.C == "zero" else make.nonzero_integers(rng, m, k)
    xdot, mu, nu = make.integers(rng, m) / 4, make.integers(rng, m), make.integers(rng, k)
    if case.S_N.startswith("singular"):  # h = nu + C'xdot = -S_N y in range S_N, and off it for a descent
        nu = -C.T @ xdot - S_N @ nu + (F[-1] if case.S_N == "singular, descending" else 0.0)
    return Manufactured(basis, S_T, C, S_N, mu, nu, xdot)


def member(case: Case, rng: np.random.Generator) -> Member:
    """One problem of `case`."""
    chosen = manufacture(case, rng)
    return Member(
        J=chosen.basis.J,
        xdot=chosen.xdot,
        W=make.weight(chosen.basis, chosen.S_T, chosen.C, chosen.S_N),
        a=make.gradient(chosen.basis, chosen.mu, chosen.nu),
        Wx=None,
        labels={"case": case.text},
    )


def build(seed: int, full: bool) -> tuple[Group, ...]:
    """The groups of the set."""
    return grouped(draw(CASES, member, seed, rounds=ROUNDS * (FULL if full else 1)), TASKS)
