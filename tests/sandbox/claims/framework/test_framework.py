"""What is printed, and where it falls."""

from __future__ import annotations

import pytest

from sandbox.claims import framework
from sandbox.claims.claim import Role, Trial

ERRATA = ("footnote_1",)


@pytest.mark.paper
@pytest.mark.parametrize("claim", framework.CLAIMS, ids=lambda claim: claim.name)
def test_what_is_printed_falls_only_where_an_erratum_is_known(claim):
    """The literal reading fails in one claim, and says how to read it; nothing else fails."""
    fallen = [check for check in claim.evidence(Trial(full=False)).checks if not check.holds]
    assert [check.role for check in fallen] == ([Role.PRINTED] if claim.name in ERRATA else [])
    assert all(check.range for check in fallen)
