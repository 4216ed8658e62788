"""Data of a graded condition, choices of R, and the fault."""

from __future__ import annotations

import numpy as np
import pytest

from sandbox.claims import equations
from sandbox.claims.claim import Trial
from sandbox.claims.rank_deficient import completing_basis, posed
from sandbox.closed_form.eq13 import eq13
from sandbox.tolerances import ORIGINAL, UNIT

RNG = Trial().rng("tests of rank_deficient")


def test_graded_data_have_the_rank_they_are_said_to_have() -> None:
    """A row stands there twice, to the last bit; the smallest singular value kept is 10^-depth of the largest."""
    problem = completing_basis.graded(RNG, 3, 6, 5.0)
    N, _ = posed.exact_bases(np.round(problem.J * 2**20))  # of rank 3 too: rounding is the same for both rows
    assert N.shape == (6, 3)
    sigma = np.linalg.svd(problem.J, compute_uv=False)
    assert 1e-6 < sigma[2] / sigma[0] < 1e-4


@pytest.mark.parametrize("choice", completing_basis.CHOICES)
def test_every_choice_completes_the_null_space(choice: str) -> None:
    """R has as many columns as J has rank, and [R N] is nonsingular."""
    problem = completing_basis.graded(RNG, 3, 6, 1.0)
    R = completing_basis.CHOICES[choice](problem.J, 3)
    assert R.shape == (6, 3)
    assert np.linalg.matrix_rank(np.hstack([R, equations.null_space(problem.J, 3)])) == 6


def test_the_fault_of_one_side_gives_another_target() -> None:
    """U'Wx J qdot = Sigma U'Wx xdot, U and Sigma of the range of J: rates that eq. (13) does not give."""
    one = posed.drawn(RNG, 3, 5, 2, "achievable", "positive definite", "positive definite")
    x = completing_basis.one_sided(eq13)(one.stacked()).x[0]
    U, sigma, _ = np.linalg.svd(one.J)
    U, sigma, Wx = U[:, :2], sigma[:2], np.array(one.Wx)
    left, right = U.T @ Wx @ one.J @ x, sigma * (U.T @ Wx @ one.xdot)
    assert (
        np.abs(left - right).max()
        <= ORIGINAL * 5 * UNIT * np.linalg.cond(Wx) * np.linalg.norm(Wx) * sigma[0] ** 2 * np.abs(x).max()
    )
