"""Claims about the experiment: what the paper printed, and that faults show of themselves."""

from __future__ import annotations

import numpy as np
import pytest

from sandbox.claims import accuracy
from sandbox.claims.accuracy import experiment, figure_1
from sandbox.claims.claim import Role, State, Trial

CLAIMS = {claim.name: claim for claim in accuracy.CLAIMS}
REDUCED = Trial(full=False)


def test_the_papers_numbers_are_consistent() -> None:
    """Shares add up to 100 %, means lie below worst cases, and those of (6) below those of (2)-(5)."""
    assert sum(experiment.PAPER_SHARES) == 100
    assert all(mean < worst for mean, worst in zip(experiment.PAPER_MEAN, experiment.PAPER_WORST, strict=True))
    assert experiment.PAPER_MEAN[1] < experiment.PAPER_MEAN[0] and experiment.PAPER_WORST[1] < experiment.PAPER_WORST[0]


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
    assert {check.role for check in sound.checks if not check.holds} == {Role.CLAIM}
    assert (sound.state, faulty.state) == (State.NOT_REPRODUCED, State.UNSOUND)


@pytest.mark.paper
def test_ranges_name_the_numbers_that_lie_outside() -> None:
    """Table III's shares: 12 % and 9 % are outside by a little, 79 % is not; each with the range that was found."""
    checks = CLAIMS["table_3_percentages"].evidence(REDUCED).checks
    reach = {check.found: check for check in checks if check.role is Role.REACH}
    assert {found: check.holds for found, check in reach.items()} == {"79 %": True, "12 %": False, "9 %": False}
    assert reach["12 %"].range.endswith("the paper's 12 % is above them.") and reach["9 %"].range.endswith("is below them.")


@pytest.mark.paper
def test_figure_1_has_the_papers_axes_and_cut() -> None:
    """No point above 8.0e-6, the diagonal drawn, and the caption counts what is left out."""
    figure, whole, _ = CLAIMS["figure_1"].evidence(REDUCED).exhibits
    points, diagonal = figure.series
    assert (figure.y.low, figure.y.high) == (0.0, 8.0e-6) and max(points.y) <= 8.0e-6
    assert list(diagonal.x) == list(diagonal.y)
    beyond = sum(y > figure_1.CUT for series in whole.series[:2] for y in series.y)
    assert f"{beyond} lie above the cut" in figure.caption and beyond > 0


def test_a_number_is_as_near_as_its_last_digit() -> None:
    """12 % stands for 11.5 to 12.5 %: among seeds up to 11.6 %, not among those up to 11.4 %."""
    for highest, held in ((11.6, True), (11.4, False)):
        check = experiment.inside("“(6) worse”", np.linspace(10.0, highest, 10_000), 12, 0.5, experiment.percent, "is near")
        assert check.holds is held and check.found == "12 %" and "is above them" in check.range


def test_whole_shares_have_no_decimal() -> None:
    """As Table III prints them."""
    assert (experiment.percent(79.0), experiment.percent(78.62)) == ("79 %", "78.6 %")
