"""What counts as positive definite."""

from __future__ import annotations

import numpy as np
import pytest

from problems.methods.draw import scattered
from problems.weightings.definite import definite, positive_definite
from sandbox.errors import AsymmetricWeightError, NonFiniteError, ShapeError, WeightNotPositiveDefiniteError


def test_scattered_matrices_are_positive_definite_and_symmetric():
    """Random weights pass, one or a stack, and their eigenvalues lie in [1/2, 8)."""
    rng = np.random.default_rng(0)
    for A in (scattered(rng, 5), scattered(rng, 5, 7)):
        assert definite(A, "A", "") is A
        np.testing.assert_array_equal(A, np.swapaxes(A, -1, -2))
        eigenvalues = np.linalg.eigvalsh(A)
        assert 0.499 < eigenvalues.min() and eigenvalues.max() < 8.001


def test_units_of_joints_do_not_decide():
    """A matrix of good condition stays definite when one joint is measured in units a million times smaller."""
    S = np.diag([1.0, 1e-9, 1e9])
    definite(S @ scattered(np.random.default_rng(1), 3) @ S, "A", "")


@pytest.mark.parametrize(
    "A, words",
    [
        (np.diag([1.0, 0.0]), "diagonal entry of joint 2 is 0"),
        (np.diag([1.0, -2.0]), "diagonal entry of joint 2 is -2"),
        (np.array([[1.0, 2.0], [2.0, 1.0]]), "smallest eigenvalue is -1"),
        (np.ones((2, 2)), "smallest eigenvalue is"),
    ],
    ids=["zero", "negative", "indefinite", "singular"],
)
def test_refused_with_evidence(A, words):
    """Zero, negative, indefinite and singular matrices are refused; the place in the stack and the way out are named."""
    with pytest.raises(WeightNotPositiveDefiniteError, match=words) as caught:
        definite(np.stack([np.eye(2), A]), "A", "way out")
    assert caught.value.evidence["index"] == (1,)
    assert "at configuration 1: " in str(caught.value) and str(caught.value).endswith("way out")


def test_refusal_names_the_member():
    """Of a stack, the first that fails."""
    stack = np.stack([np.eye(2), np.diag([1.0, -1.0])])
    with pytest.raises(WeightNotPositiveDefiniteError, match=r"K is not positive definite at configuration 1"):
        positive_definite(stack, "K", 2)


def test_small_is_not_singular():
    """Eigenvalues apart by 1e12 are still positive definite: only rounding is refused."""
    np.testing.assert_array_equal(positive_definite([1.0, 1e-12], "K", 2), np.diag([1.0, 1e-12]))


def test_refuses_what_is_no_symmetric_matrix_of_numbers():
    """Wrong size, asymmetric, not finite: the field is named."""
    for error, values in ((ShapeError, np.ones(3)), (ShapeError, np.eye(3)), (AsymmetricWeightError, [[1.0, 1], [0, 1]]),
                          (NonFiniteError, [np.nan, 1.0])):  # fmt: skip
        with pytest.raises(error, match="K"):
            positive_definite(values, "K", 2)
