"""Exact linear algebra against fractions."""

from __future__ import annotations

from fractions import Fraction as F

import numpy as np
import pytest
from flint import fmpz_mat
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from sandbox.reference.exact import Dyadic, Rationals, inertia, kernel, nearest, orthogonalised
from tests.oracle import oracle

finite = st.floats(allow_nan=False, allow_infinity=False, allow_subnormal=True)
small = st.integers(-2, 2)


def fractions(matrix: Dyadic) -> list[list[F]]:
    """The matrix as fractions."""
    scale = F(2) ** matrix.exponent
    return [[int(v) * scale for v in row] for row in matrix.integers.tolist()]


@given(arrays(np.float64, (2, 3), elements=finite))
def test_floats_are_taken_exactly(values: np.ndarray) -> None:
    """Every float, subnormals and the largest included, becomes the rational that it is, and comes back."""
    exact = Dyadic.of(values)
    assert fractions(exact) == oracle.rational(values)
    back = Rationals.of(exact.integers.entries(), fmpz_mat([[1]])[0, 0], exact.exponent).nearest()
    np.testing.assert_array_equal(back, values.ravel())


@given(arrays(np.float64, (2, 2), elements=finite), arrays(np.float64, (2, 2), elements=finite), finite)
def test_sums_and_products_are_exact(A: np.ndarray, B: np.ndarray, factor: float) -> None:
    """A + B, A B and a float times A carry no rounding."""
    a, b = oracle.rational(A), oracle.rational(B)
    assert fractions(Dyadic.of(A) + Dyadic.of(B)) == oracle.plus(a, b)
    assert fractions(Dyadic.of(A) @ Dyadic.of(B)) == oracle.times(a, b)
    assert fractions(Dyadic.of(A).scaled(factor)) == [[F(factor) * v for v in row] for row in a]
    assert fractions(Dyadic.of(A).columns([1])) == [[row[1]] for row in a]


@given(st.integers(1, 4).flatmap(lambda m: arrays(np.int64, (m, 4), elements=small)))
def test_kernel(Ab: np.ndarray) -> None:
    """The kernel of [A -b] has A's rank, a full null basis, and a solution where there is one."""
    found = kernel(fmpz_mat(Ab.tolist()))
    A, b = oracle.rational(Ab[:, :3]), oracle.vector(-Ab[:, 3])
    right = oracle.solve(A, b)
    assert len(found.pivots) == right.rank
    assert oracle.solve(oracle.rational(Ab[:, found.pivots]), b, right.rank).rank == right.rank
    assert (found.point is None) == (right.solution is None)
    vectors = [[F(int(v)) for v in column] for column in zip(*found.directions.tolist(), strict=True)]
    assert len(oracle.independent(vectors)) == found.free == 3 - right.rank
    for vector in vectors:
        assert vector[3] == 0 and not any(oracle.apply(A, vector[:3]))
    if found.point is not None:
        *x, d = [F(int(v)) for v in found.point.entries()]
        assert oracle.apply(A, [v / d for v in x]) == b


@given(st.integers(0, 5).flatmap(lambda k: arrays(np.int64, (k, k), elements=small)))
def test_inertia(A: np.ndarray) -> None:
    """Signs of the LDL' agree with those of the characteristic polynomial, zero diagonals and singular S included."""
    S = A + A.T - 2 * np.diag(np.diag(A)) * (A.sum() % 2)
    assert inertia(fmpz_mat(len(S), len(S), S.ravel().tolist())) == oracle.inertia(oracle.rational(S))


@pytest.mark.parametrize(
    ("S", "signs"),
    [
        ([[0, 1], [1, 0]], (1, 1, 0)),
        ([[0, 0, 1], [0, 0, 0], [1, 0, 0]], (1, 1, 1)),
        ([[0, 1, 1], [1, 0, 1], [1, 1, 0]], (1, 2, 0)),
        ([[0]], (0, 0, 1)),
        ([[-2, 1], [1, -2]], (0, 2, 0)),
        ([[1, 2, 3], [2, 4, 6], [3, 6, 9]], (1, 0, 2)),
    ],
)
def test_inertia_of_known_matrices(S: list, signs: tuple) -> None:
    """Matrices whose signs are known by hand."""
    assert inertia(fmpz_mat(S)) == signs


def test_inertia_of_large_entries() -> None:
    """Congruence with 53-bit floats leaves the signs of D, however close to singular."""
    rng = np.random.default_rng(0)
    for k in (3, 6, 11):
        D = np.diag(rng.permutation([(-1.0) ** i * 10.0 ** (-i) for i in range(k)]))
        D[0, 0] = 0
        X = Dyadic.of(rng.standard_normal((k, k)))
        signs = int((np.diag(D) > 0).sum()), int((np.diag(D) < 0).sum()), 1
        assert inertia((X.T @ Dyadic.of(D) @ X).integers) == signs


def test_rounding_of_quotients() -> None:
    """Ties go to even, subnormals are rounded once, and overflow is infinite."""
    assert nearest(2**53 + 1, 1) == 2.0**53
    assert nearest(2**53 + 3, 1) == 2.0**53 + 4
    assert nearest(3, 2**1075) == 2.0**-1073  # a tie at 1.5 of the least subnormal
    assert nearest(-(10**400), 3) == -np.inf
    assert nearest(10**400, -3) == -np.inf
    assert nearest(10**400, 3) == np.inf
    assert nearest(1, 3) == 1 / 3


def test_orthogonalised() -> None:
    """Gram-Schmidt over the integers keeps the span and makes columns exactly orthogonal."""
    Z = fmpz_mat([[1, 1, 2], [1, 0, 1], [0, 1, -5], [2, 2, 0]])
    basis = orthogonalised(Z)
    for i, u in enumerate(basis):
        for v in basis[:i]:
            assert (u.transpose() * v)[0, 0] == 0
    columns = [[F(int(v)) for v in q.entries()] for q in basis]
    for column in zip(*Z.tolist(), strict=True):
        assert oracle.solve(oracle.transpose(columns), [F(int(v)) for v in column]).solution is not None
