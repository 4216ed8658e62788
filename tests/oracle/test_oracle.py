"""The oracle itself: its float and exact sides agree, and both meet the conditions they are meant to decide."""

from __future__ import annotations

from fractions import Fraction as F

import numpy as np
import pytest

from tests.oracle import oracle

F1 = np.array([[-1.0, -1, 0], [2, 1, 1]])
F0 = np.array([[0.0, 0, 0], [3, 2, 1]])


def draw(seed: int, n: int = 5, m: int = 3) -> tuple[np.ndarray, ...]:
    """A well-conditioned problem with W > 0."""
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((n, n))
    return rng.standard_normal((m, n)), rng.standard_normal(m), A @ A.T + np.eye(n), rng.standard_normal(n)


@pytest.mark.parametrize("seed", range(6))
def test_paths_agree(seed: int) -> None:
    """Eq. (6), the KKT system, the weighted pseudoinverse, eq. (13) and fractions give one answer."""
    J, xd, W, a = draw(seed)
    right = oracle.exact(J, xd, W, a)
    x = np.array(right.x, dtype=float)
    G = oracle.weighted_pseudoinverse(J, W)
    z = -np.linalg.solve(W, a)
    np.testing.assert_allclose(oracle.paper_eq6(J, xd, W, a), x, rtol=1e-11)
    np.testing.assert_allclose(oracle.kkt(J, xd, W, a)[0], x, rtol=1e-11)
    np.testing.assert_allclose(oracle.kkt(J, xd, W, a)[1], np.array(right.y, dtype=float), rtol=1e-11)
    np.testing.assert_allclose(z + G @ (xd - J @ z), x, rtol=1e-11)
    np.testing.assert_allclose(oracle.paper_eq13(J, xd, W, a, np.eye(3), 3), x, rtol=1e-11)


def test_indefinite_weight() -> None:
    """F1, diag(-1,1,1): (1,-2,1) with lam = (-3,-1), by fractions and by floats."""
    W = np.diag([-1.0, 1, 1])
    right = oracle.exact(F1, [1, 1], W, [0, 0, 0])
    assert (right.x, right.y, right.inertia) == ([1, -2, 1], [-3, -1], (1, 0, 0))
    np.testing.assert_allclose(oracle.paper_eq6(F1, np.ones(2), W, np.zeros(3)), [1, -2, 1], rtol=1e-14)


@pytest.mark.parametrize(("w", "reason"), [(-1, "condition_7"), (-2, "descending"), (-3, "maximum")])
def test_reasons(w: int, reason: str) -> None:
    """F1 over W = diag(w,1,1): valid, singular, maximum."""
    assert oracle.exact(F1, [1, 1], np.diag([w, 1, 1]), [0, 0, 0]).reason == reason


def test_rank_deficient_fixture() -> None:
    """F0 of methods 6.6, by fractions and by eq. (13)."""
    W, Wx = np.diag([1, 1, -0.0625]), np.array([[2.0, 1], [1, 1]])
    right = oracle.least_squares(F0, [1, 1], W, [0, 0, 0], Wx)
    x = oracle.paper_eq13(F0, np.ones(2), W, np.zeros(3), Wx, 1)
    np.testing.assert_allclose(np.array(right.x, dtype=float), x, rtol=1e-13)
    assert oracle.least_squares(F0, [1, 1], 20 * np.diag([1, 1, F(-1, 20)]), [0, 0, 0], Wx).x == [
        F(-6, 7), F(-4, 7), F(40, 7),
    ]  # fmt: skip
    assert oracle.exact(F0, [1, 1], W, [0, 0, 0]).expected == "infeasible"


def test_damped() -> None:
    """The slack arm gives sum s/(s^2 + lambda^2) v u'xdot, and F1's exact columns for lambda = 1."""
    J, xd, _, _ = draw(9)
    right = oracle.damped(J, xd, np.eye(5), np.zeros(5), 0.5)
    np.testing.assert_allclose(oracle.damped_pseudoinverse(J, xd, 0.5), np.array(right.x[:5], dtype=float), rtol=1e-12)
    assert oracle.damped(F1, [1, 1], np.eye(3), np.zeros(3), 1).x[:3] == [F(1, 6), F(-1, 3), F(1, 2)]


def test_inertia_counts_eigenvalues() -> None:
    """Signs of the characteristic polynomial are those of the eigenvalues."""
    rng = np.random.default_rng(1)
    for _ in range(20):
        A = rng.integers(-3, 4, (4, 4))
        S = A + A.T
        lam = np.linalg.eigvalsh(S)
        counted = int((lam > 1e-9).sum()), int((lam < -1e-9).sum()), int((abs(lam) <= 1e-9).sum())
        assert oracle.inertia(oracle.rational(S)) == counted


def test_null_space() -> None:
    """The float null basis is orthonormal and J maps it to zero."""
    J, _, _, _ = draw(2)
    N = oracle.null_space(J, 3)
    np.testing.assert_allclose(J @ N, np.zeros((3, 2)), atol=1e-14)
    np.testing.assert_allclose(N.T @ N, np.eye(2), atol=1e-14)


def test_freedom() -> None:
    """A singular, consistent QP keeps a basis of what is left free, and every member has the same value."""
    right = oracle.qp(oracle.rational(np.diag([1, 0, 0])), [F(1), F(0), F(0)], oracle.rational([[0, 1, 0]]), [F(2)])
    assert (right.reason, right.freedom) == ("singular", [[0, 0, 1]])
    assert right.x[:2] == [-1, 2]
    assert right.value == F(-1, 2)
