"""Claims of section V: what the paper printed, the exact side of its condition numbers, and that faults show of themselves."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

from sandbox.claims import accuracy
from sandbox.claims.claim import Role, State, Trial
from sandbox.claims.exact_condition import exactly
from sandbox.claims.single_compiled import factored
from sandbox.tolerances import UNIT

CLAIMS = {claim.name: claim for claim in accuracy.CLAIMS}
REDUCED = Trial(full=False)

F1 = np.array([[[-1.0, -1, 0], [2, 1, 1]]])


def test_exact_condition_of_a_textbook_arm() -> None:
    """Planar 3R at (0, pi/2, -pi/2): J J' has the eigenvalues 4 +- sqrt 13."""
    square, formed, printed = exactly(F1, np.eye(3)[None])
    assert square[0] == pytest.approx((4 + math.sqrt(13)) / (4 - math.sqrt(13)), rel=4 * UNIT)
    assert formed[0].tolist() == printed[0].tolist() == [[2, -3], [-3, 6]]
    assert factored(F1)[0] == pytest.approx(formed[0], rel=8 * UNIT)


def test_exact_matrices_for_a_weight() -> None:
    """W = diag(1, 4, 16) by hand: J W^-1 J' and J W J'; the kernel factors the former."""
    L = np.diag([1.0, 2.0, 4.0])[None]
    square, formed, printed = exactly(F1, L)
    assert formed[0].tolist() == [[1.25, -2.25], [-2.25, 4.3125]]
    assert printed[0].tolist() == [[5, -6], [-6, 24]]
    assert factored(F1, L @ L)[0] == pytest.approx(formed[0], rel=8 * UNIT)
    trace, product = Fraction(89, 16), Fraction(5, 4) * Fraction(69, 16) - Fraction(81, 16)
    gap = math.sqrt(trace**2 - 4 * product)
    assert square[0] == pytest.approx((float(trace) + gap) / (float(trace) - gap), rel=1e-13)


def test_what_has_no_cholesky_factor_is_not_a_matrix() -> None:
    """A Jacobian of lower rank leaves NaN."""
    assert np.isnan(factored(np.array([[[1.0, 2, 3], [1, 2, 3]]]))).all()


def test_the_papers_numbers_are_consistent() -> None:
    """Shares add up to 100 %, means lie below worst cases, and those of (6) below those of (2)-(5)."""
    assert sum(accuracy.PAPER_SHARES) == 100
    assert all(mean < worst for mean, worst in zip(accuracy.PAPER_MEAN, accuracy.PAPER_WORST, strict=True))
    assert accuracy.PAPER_MEAN[1] < accuracy.PAPER_MEAN[0] and accuracy.PAPER_WORST[1] < accuracy.PAPER_WORST[0]


@pytest.mark.paper
@pytest.mark.parametrize("name", CLAIMS)
def test_a_fault_shows_in_what_is_claimed_too(name: str) -> None:
    """Not only in that the two code paths no longer agree bit for bit."""
    fallen = [check for check in CLAIMS[name].evidence(REDUCED, faulty=True).checks if not check.holds]
    assert [check for check in fallen if "bit for bit" not in check.says and check.role in (Role.CLAIM, Role.OURS)]


@pytest.mark.paper
def test_what_does_not_reproduce_is_its_claim_alone() -> None:
    """Mean and worst case of (2)-(5) fail; the heavy tail and both code paths stand. Without the tail the evidence falls."""
    claim = CLAIMS["table_3_normal_equations"]
    sound, faulty = claim.evidence(REDUCED), claim.evidence(REDUCED, faulty=True)
    assert {check.role for check in sound.checks if not check.holds} == {Role.CLAIM, Role.REACH}
    assert (sound.state, faulty.state) == (State.NOT_REPRODUCED, State.UNSOUND)


@pytest.mark.paper
def test_ranges_name_the_numbers_that_lie_outside() -> None:
    """Table III's shares: 12 % and 9 % are outside by a little, 79 % is not; each with the range that was found."""
    checks = CLAIMS["table_3_percentages"].evidence(REDUCED).checks
    reach = {check.found: check for check in checks if check.role is Role.REACH}
    assert {found: check.holds for found, check in reach.items()} == {"79.0 %": True, "12.0 %": False, "9.0 %": False}
    assert reach["12.0 %"].range.endswith("the paper's 12.0 % is above it") and reach["9.0 %"].range.endswith("is below it")


@pytest.mark.paper
def test_figure_1_has_the_papers_axes_and_cut() -> None:
    """No point above 8.0e-6, the diagonal drawn, and the caption counts what is left out."""
    figure, whole, _ = CLAIMS["figure_1"].evidence(REDUCED).exhibits
    points, diagonal = figure.series
    assert (figure.y.low, figure.y.high) == (0.0, 8.0e-6) and max(points.y) <= 8.0e-6
    assert list(diagonal.x) == list(diagonal.y)
    beyond = sum(y > accuracy.CUT for series in whole.series[:2] for y in series.y)
    assert f"{beyond} lie above the cut" in figure.caption and beyond > 0
