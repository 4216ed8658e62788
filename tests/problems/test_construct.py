"""The constructions of methods 1.6 and 1.7, exact where they claim to be."""

from __future__ import annotations

import numpy as np
import pytest

from problems.sets import construct as make
from sandbox.tolerances import UNIT

SIZES = [(1, 2), (2, 4), (3, 7), (10, 12)]
ROUNDING = 1e3 * UNIT  # products of a few well-conditioned matrices of up to twelve rows


@pytest.fixture
def rng():
    """A seeded generator."""
    return np.random.default_rng(11)


@pytest.mark.parametrize("n", [1, 2, 5, 12])
def test_unimodular(rng, n):
    """An integer matrix and its inverse multiply to the identity exactly, and no entry is large."""
    for _ in range(20):
        T, inverse = make.unimodular(rng, n)
        np.testing.assert_array_equal(T @ inverse, np.eye(n))
        assert max(np.abs(T).max(), np.abs(inverse).max()) <= make.LARGEST


@pytest.mark.parametrize("n", [1, 2, 5, 12])
def test_orthogonal(rng, n):
    """The product of reflections is orthogonal."""
    Q = make.orthogonal(rng, n)
    np.testing.assert_allclose(Q @ Q.T, np.eye(n), atol=ROUNDING)


@pytest.mark.parametrize("m, n", SIZES)
@pytest.mark.parametrize("kind, tolerance", [("integer", 0.0), ("orthonormal", ROUNDING), ("real", ROUNDING)])
def test_basis(rng, m, n, kind, tolerance):
    """[J; Z] [Y N] = I; with integers exactly."""
    basis = getattr(make, f"{kind}_basis")(rng, m, n)
    whole = np.vstack([basis.J, basis.Z]) @ np.hstack([basis.Y, basis.N])
    np.testing.assert_allclose(whole, np.eye(n), rtol=0, atol=tolerance)


def test_real_basis_has_the_singular_values_asked_for(rng):
    """Chosen singular values are those of J."""
    J = make.real_basis(rng, 3, 5, np.array([2.0, 1.0, 1e-3])).J
    np.testing.assert_allclose(np.linalg.svd(J, compute_uv=False), [2.0, 1.0, 1e-3], atol=ROUNDING)


@pytest.mark.parametrize("m, n", SIZES)
def test_blocks_of_the_weight(rng, m, n):
    """Y'WY = S_T, Y'WN = C and N'WN = S_N, exactly."""
    basis, k = make.integer_basis(rng, m, n), n - m
    S_T, S_N, C = make.integer_symmetric(rng, m), make.integer_symmetric(rng, k), make.integers(rng, m, k)
    W = make.weight(basis, S_T, C, S_N)
    np.testing.assert_array_equal(W, W.T)
    np.testing.assert_array_equal(basis.Y.T @ W @ basis.Y, S_T)
    np.testing.assert_array_equal(basis.Y.T @ W @ basis.N, C)
    np.testing.assert_array_equal(basis.N.T @ W @ basis.N, S_N)


def test_gradient(rng):
    """Y'a = mu and N'a = nu, exactly."""
    basis = make.integer_basis(rng, 2, 5)
    mu, nu = make.integers(rng, 2), make.integers(rng, 3)
    a = make.gradient(basis, mu, nu)
    np.testing.assert_array_equal(basis.Y.T @ a, mu)
    np.testing.assert_array_equal(basis.N.T @ a, nu)


def test_integer_form_has_the_inertia_of_its_pivots(rng):
    """F' diag(pivots) F has as many positive, negative and zero eigenvalues as there are such pivots."""
    S, _ = make.integer_form(rng, [2.0, 1.0, -1.0, 0.0])
    eigenvalues = np.linalg.eigvalsh(S)
    zero = ROUNDING * np.abs(eigenvalues).max()
    assert [int(np.sum(eigenvalues > zero)), int(np.sum(eigenvalues < -zero))] == [2, 1]


def test_eigenvalues_asked_for(rng):
    """Chosen eigenvalues are those of the matrix."""
    W = make.with_eigenvalues(rng, [-1e4, 0.5, 2.0])
    np.testing.assert_allclose(np.linalg.eigvalsh(W), [-1e4, 0.5, 2.0], atol=1e4 * ROUNDING)


def test_valid_indefinite(rng):
    """W has m negative eigenvalues at most, one at least, and N'WN is positive definite."""
    basis = make.orthonormal_basis(rng, 3, 5)
    W = make.valid_indefinite(rng, basis)
    assert 1 <= np.sum(np.linalg.eigvalsh(W) < 0) <= 3
    assert np.linalg.eigvalsh(basis.N.T @ W @ basis.N)[0] >= 0.5 - ROUNDING


def test_product_is_the_matrix_product(rng):
    """The product in a fixed order is the product, vectors and empty factors included."""
    A, B, b = rng.uniform(-1, 1, (2, 5)), rng.uniform(-1, 1, (5, 3)), rng.uniform(-1, 1, 3)
    np.testing.assert_allclose(make.product(A, B, b), A @ B @ b, atol=ROUNDING)
    np.testing.assert_array_equal(make.product(np.zeros((2, 0)), np.zeros((0, 3))), np.zeros((2, 3)))


def test_short_is_short():
    """A shortened number is a multiple of 2^-30, and noise in the last bits does not change it."""
    values = make.short(np.array([1 / 3, np.pi, -2.5]))
    np.testing.assert_array_equal(values * 2.0**30, np.round(values * 2.0**30))
    np.testing.assert_array_equal(make.short(np.array([1 / 3, np.pi, -2.5]) * (1 + 4 * UNIT)), values)
