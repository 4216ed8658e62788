"""What counts as positive definite."""

from __future__ import annotations

import numpy as np
import pytest

from problems.weightings.definite import definite, scattered
from sandbox.errors import WeightNotPositiveDefiniteError


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
    assert "configuration [1]" in str(caught.value) and str(caught.value).endswith("way out")
