"""The spectrum of a stack, against numpy one matrix at a time and identities of the pseudoinverse."""

from __future__ import annotations

import numpy as np
import pytest

from sandbox.problem import VelocityProblem
from sandbox.spectrum import Spectrum, numerical_rank, reduced_weight, smallest_eigenvalue, spectral_norm
from sandbox.tolerances import RANK, UNIT
from sandbox.weight import Weight


def mixed_ranks(m: int, n: int) -> VelocityProblem:
    """Integer Jacobians of ranks 0 to min(m, n), in no order."""
    rng = np.random.default_rng(m * 10 + n)
    ranks = [2, 0, min(m, n), 1, 2, min(m, n)]
    J = np.array([rng.integers(-3, 4, (m, r)) @ rng.integers(-3, 4, (r, n)) for r in ranks], dtype=float)
    A = rng.integers(-2, 3, (6, n, n))
    return VelocityProblem(J, rng.standard_normal((6, m)), A + np.swapaxes(A, -1, -2))


@pytest.mark.parametrize(("m", "n"), [(2, 4), (3, 3), (4, 2)])
def test_bases_span_what_they_say(m: int, n: int) -> None:
    """Each member is found once under numpy's rank; N spans null J, V_r range J', U_r range J, all orthonormal."""
    problem = mixed_ranks(m, n)
    spectrum = Spectrum.of(problem)
    seen = []
    for r, members in spectrum.by_rank():
        seen += members.tolist()
        N, V, U = (basis(r, members) for basis in (spectrum.null_basis, spectrum.range_basis, spectrum.image_basis))
        for i, at in enumerate(members):
            J = problem.J[at]
            assert np.linalg.matrix_rank(J) == r == spectrum.rank[at]
            np.testing.assert_allclose(J @ N[i], 0, atol=1e-13)
            np.testing.assert_allclose(V[i] @ V[i].T, np.linalg.pinv(J) @ J, atol=1e-13)
            np.testing.assert_allclose(U[i] @ U[i].T, J @ np.linalg.pinv(J), atol=1e-13)
            np.testing.assert_allclose(np.hstack([V[i], N[i]]).T @ np.hstack([V[i], N[i]]), np.eye(n), atol=1e-14)
            np.testing.assert_allclose(U[i].T @ J @ V[i], np.diag(spectrum.sigma[at, :r]), atol=1e-12)
    assert sorted(seen) == list(range(len(problem)))


@pytest.mark.parametrize(("m", "n"), [(2, 4), (3, 3), (4, 2)])
def test_solving_is_the_pseudoinverse(m: int, n: int) -> None:
    """J^+ v and J^+' v are numpy's, at every rank."""
    problem = mixed_ranks(m, n)
    rng = np.random.default_rng(1)
    v, w = rng.standard_normal((6, m)), rng.standard_normal((6, n))
    spectrum = Spectrum.of(problem)
    for r, members in spectrum.by_rank():
        there, back = spectrum.solve(r, members, v[members]), spectrum.solve_transposed(r, members, w[members])
        for i, at in enumerate(members):
            inverse = np.linalg.pinv(problem.J[at])
            np.testing.assert_allclose(there[i], inverse @ v[at], atol=1e-13)
            np.testing.assert_allclose(back[i], inverse.T @ w[at], atol=1e-13)


def test_a_declared_rank_is_believed() -> None:
    """Where the rank is known exactly the singular values do not vote."""
    problem = VelocityProblem(np.diag([1.0, 1e-300 * 1e160])[None], [0.0, 0], np.eye(2))
    assert Spectrum.of(problem).rank.tolist() == [1]
    assert Spectrum.of(problem, np.array([2])).rank.tolist() == [2]


def test_rank_is_decided_at_the_documented_ratio() -> None:
    """A singular value counts from 16 max(m, n) u sigma_1 on, whichever of m and n is larger, at any scale."""
    edge = RANK * 5 * UNIT
    sigma = np.array([[1.0, 1.01 * edge], [1.0, 0.99 * edge], [1e80, 1.01e80 * edge], [1e-80, 0.99e-80 * edge], [0, 0]])
    for m, n in ((2, 5), (5, 2)):
        assert numerical_rank(sigma, m, n).tolist() == [2, 1, 2, 1, 0]
    assert numerical_rank(np.array([1.0, edge]), 2, 5) == 1  # rounding itself is no evidence


def test_the_reduced_weight_keeps_the_factors() -> None:
    """N'WN is numpy's, symmetric to the last bit, and does not lose the digits that a dense W has lost."""
    rng = np.random.default_rng(2)
    problem = mixed_ranks(2, 4)
    N = rng.standard_normal((6, 4, 2))
    S = reduced_weight(problem, N)
    np.testing.assert_array_equal(S, np.swapaxes(S, -1, -2))
    for i in range(6):
        np.testing.assert_allclose(S[i], N[i].T @ problem.W.dense()[i] @ N[i], atol=1e-12)
    A, N = rng.standard_normal((3, 6, 6)), rng.standard_normal((3, 6, 5))
    S = reduced_weight(VelocityProblem(np.ones((1, 6)), [0.0], A + np.swapaxes(A, -1, -2)), N)
    np.testing.assert_array_equal(S, np.swapaxes(S, -1, -2))
    d = 2.0**-28  # E N = d: N'WN = d^2 lies below the rounding of W
    factored = VelocityProblem(np.ones((1, 1, 2)), [[0.0]], Weight(np.zeros((2, 2)), [[1 + d, 1.0]]))
    column = np.array([[[1.0], [-1.0]]])
    assert reduced_weight(factored, column)[0, 0, 0] == d**2
    assert (column[0].T @ factored.W.dense()[0] @ column[0])[0, 0] != d**2


def test_eigenvalues_of_a_stack() -> None:
    """lambda_min and |M|_2 are those of each matrix; no matrix at all has no smallest eigenvalue."""
    M = np.array([[[2.0, 0], [0, -5]], [[1, 2], [2, 1]], [[4, 0], [0, 3]]])
    np.testing.assert_allclose(smallest_eigenvalue(M), [-5, -1, 3])
    np.testing.assert_allclose(spectral_norm(M), [5, 3, 4])
    assert smallest_eigenvalue(np.zeros((3, 0, 0))).tolist() == [np.inf] * 3
