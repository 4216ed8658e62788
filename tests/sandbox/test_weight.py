"""W kept factored: its products against fractions, what forming E'Gamma E would cost, and that nothing can be changed."""

from __future__ import annotations

from fractions import Fraction as F

import numpy as np
import pytest

from sandbox.errors import AsymmetricWeightError, ShapeError
from sandbox.weight import Weight
from tests.oracle import oracle

F1 = np.array([[-1.0, -1, 0], [2, 1, 1]])
N1 = np.array([[-1.0], [1], [1]])  # null(F1), methods section 0


def integer_weight(rng: np.random.Generator, lead: tuple[int, ...] = (), n: int = 4, k: int = 2) -> Weight:
    """Small integers, so that every product is exact in floats."""
    base, gamma = rng.integers(-3, 4, (*lead, n, n)), rng.integers(-3, 4, (*lead, k, k))
    return Weight(base + np.swapaxes(base, -1, -2), rng.integers(-3, 4, (*lead, k, n)), gamma + np.swapaxes(gamma, -1, -2))


def fractions(W: Weight) -> oracle.Matrix:
    """W as it is meant, base + E'Gamma E over the rationals."""
    return oracle.factored(W.base, W.E, W.gamma)


@pytest.mark.parametrize("seed", range(4))
def test_products_are_those_of_the_rational_matrix(seed: int) -> None:
    """W X, N'W and W as one matrix are exactly what fractions say, for one weight and for each member of a stack."""
    rng = np.random.default_rng(seed)
    stack = integer_weight(rng, (3,))
    X = rng.integers(-3, 4, (3, 4, 2)).astype(float)
    for i in range(3):
        exact = fractions(stack[i])
        product = oracle.times(exact, oracle.rational(X[i]))
        assert oracle.rational(stack.times(X)[i]) == oracle.rational(stack[i].times(X[i])) == product
        assert oracle.rational(stack.left(X)[i]) == oracle.rational(stack[i].left(X[i])) == oracle.transpose(product)
        assert oracle.rational(stack.dense()[i]) == oracle.rational(np.asarray(stack[i])) == exact


def test_a_weight_without_factors_is_its_matrix() -> None:
    """Base alone: products are those of the matrix, symmetric part taken."""
    W = Weight([[1.0, 2], [2, -3]])
    X = np.array([[1.0], [2]])
    assert not W.factored and W.n == 2 and W.lead == ()
    np.testing.assert_array_equal(W.times(X), [[5], [-4]])
    np.testing.assert_array_equal(W.left(X), [[5, -4]])
    np.testing.assert_array_equal(W.dense(), [[1, 2], [2, -3]])


@pytest.mark.parametrize(("d", "kept", "left"), [(1e-4, 1e-10, 1e-10), (1e-6, 1e-8, 1e-6)])
def test_forming_the_product_first_costs_the_square_of_the_conditioning(d: float, kept: float, left: float) -> None:
    """Methods 4.4, g = (1 + d) q1 + q2 on F1: eq. (6) through the factors keeps digits that a dense W has lost."""
    W = Weight(np.zeros((3, 3)), np.array([[1 + d, 1.0, 0]]))
    a, xdot = -0.9 * np.array([1 + d, 1.0, 0]), np.array([0.3, -0.7])
    exact_W = fractions(W)
    Nt = oracle.transpose(oracle.rational(N1))
    rows = oracle.rational(F1) + oracle.times(Nt, exact_W)
    exact = oracle.solve(rows, oracle.vector(xdot) + [-v for v in oracle.apply(Nt, oracle.vector(a))]).solution
    assert exact is not None

    def miss(NtW: np.ndarray) -> float:
        qdot = np.linalg.solve(np.vstack([F1, NtW]), np.append(xdot, -N1.T @ a))
        return max(abs(float(F(float(v)) - w)) for v, w in zip(qdot, exact, strict=True)) / float(max(map(abs, exact)))

    assert miss(W.left(N1)) < kept
    assert miss(N1.T @ W.dense()) > left
    assert miss(W.times(N1).T) < kept


def test_one_weight_serves_a_stack() -> None:
    """Broadcasting, reshaping and indexing keep base, E and Gamma together, member by member."""
    rng = np.random.default_rng(1)
    one, stack = integer_weight(rng), integer_weight(rng, (2, 3))
    spread = one.broadcast((2, 3))
    assert one.broadcast(()) is one
    assert (spread.lead, spread.n, spread.factored) == ((2, 3), 4, True)
    flat = stack.reshape((6,))
    for i, place in enumerate(np.ndindex(2, 3)):
        assert fractions(spread[place]) == fractions(one)
        assert fractions(flat[i]) == fractions(stack[place])
    again, twice = flat.reshape((2, 3)), flat[:3].broadcast((2, 3))
    for place in np.ndindex(2, 3):
        assert fractions(again[place]) == fractions(stack[place])
        assert fractions(twice[place]) == fractions(flat[place[1]])
    mixed = Weight(np.eye(4), stack.E, one.gamma[None, None])
    assert mixed.lead == (2, 3)
    assert fractions(mixed[1, 2]) == oracle.factored(np.eye(4), stack.E[1, 2], one.gamma)
    plain = Weight(np.eye(2)).broadcast((3,)).reshape((3, 1))
    assert plain.E is None and plain.gamma is None and plain.lead == (3, 1) and plain[0, 0].lead == ()


def test_gamma_may_be_left_out_or_be_a_diagonal() -> None:
    """Gamma left out is the identity, (k,) is a diagonal, (B, k) one diagonal for each E."""
    E = np.array([[1.0, 2, 0], [0, 1, 1]])
    base = np.diag([1.0, 2, 3])
    np.testing.assert_array_equal(Weight(base, E).dense(), base + E.T @ E)
    np.testing.assert_array_equal(Weight(base, E, [2.0, -1]).dense(), base + E.T @ np.diag([2.0, -1]) @ E)
    several = Weight(base, np.stack([E, 2 * E, E]), [[1.0, 0], [2, 1], [0, 3]])
    assert several.lead == (3,)
    np.testing.assert_array_equal(several.dense()[1], base + 4 * E.T @ np.diag([2.0, 1]) @ E)


def test_a_dense_weight_is_symmetric_to_the_last_bit() -> None:
    """E'Gamma E of full 53-bit entries is symmetric exactly, though its rounding is not."""
    rng = np.random.default_rng(0)
    gamma = rng.standard_normal((3, 3))
    dense = Weight(np.eye(5), rng.standard_normal((3, 5)), gamma + gamma.T).dense()
    np.testing.assert_array_equal(dense, dense.T)
    E = rng.standard_normal((4, 3, 5))
    stack = Weight(np.eye(5), E, (gamma + gamma.T)[None]).dense()
    product = np.swapaxes(E, -1, -2) @ ((gamma + gamma.T) @ E)
    assert (product != np.swapaxes(product, -1, -2)).any()
    np.testing.assert_array_equal(stack, np.swapaxes(stack, -1, -2))


def test_nothing_can_be_changed_afterwards() -> None:
    """The caller's arrays stay the caller's, the weight's are read-only, also after indexing and broadcasting."""
    base, E, gamma = np.eye(3), np.ones((1, 3)), np.ones((1, 1))
    W = Weight(base, E, gamma)
    for mine in (base, E, gamma):
        mine[...] = 7
    np.testing.assert_array_equal(W.dense(), np.eye(3) + 1)
    for weight in (W, W.broadcast((2,)), W.broadcast((2,))[0], W.broadcast((2,)).reshape((2, 1))):
        for part in (weight.base, weight.E, weight.gamma):
            with pytest.raises(ValueError, match="read-only"):
                part[...] = 0
    copy = np.asarray(W)
    copy[0, 0] = 9
    assert W.dense()[0, 0] == 2


@pytest.mark.parametrize(
    ("parts", "error", "words"),
    [
        ((np.ones((2, 3)),), ShapeError, r"W has shape \(2, 3\); it must be \(\.\.\., n, n\) = \(\.\.\., 3, 3\)"),
        ((np.ones(2),), ShapeError, r"W has shape \(2,\)"),
        ((np.ones(2), np.ones((1, 2))), ShapeError, r"W_base has shape \(2,\)"),
        ((np.eye(2), None, np.eye(1)), ShapeError, "W_gamma is given without W_E"),
        ((np.eye(2), np.ones((1, 3))), ShapeError, r"W_E has shape \(1, 3\)"),
        ((np.eye(2), np.ones((1, 2)), np.eye(2)), ShapeError, r"W_gamma has shape \(2, 2\)"),
        ((np.ones((3, 2)), np.ones((1, 2))), ShapeError, r"W_base has shape \(3, 2\)"),
        ((np.triu(np.ones((2, 2))), np.ones((1, 2))), AsymmetricWeightError, r"W_base\[0, 1\] is 1 but W_base\[1, 0\] is 0"),
        ((np.triu(np.ones((2, 2))),), AsymmetricWeightError, r"W\[0, 1\] is 1 but W\[1, 0\] is 0"),
        ((np.eye(2), np.ones((2, 2)), [[1.0, 2], [0, 1]]), AsymmetricWeightError, r"W_gamma\[0, 1\] is 2"),
        ((np.ones((3, 2, 2)), np.ones((2, 1, 2))), ShapeError, r"W_base \(3,\), W_E \(2,\)"),
    ],
)
def test_the_door_names_the_part(parts: tuple, error: type[Exception], words: str) -> None:
    """Whatever is wrong with base, E or Gamma is refused by the name of that part."""
    with pytest.raises(error, match=words):
        Weight(*parts)
