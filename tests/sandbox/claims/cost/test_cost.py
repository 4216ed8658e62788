"""What Section IV's claims say where a count is right, and where it is wrong."""

from __future__ import annotations

from fractions import Fraction

import pytest

from sandbox.claims import cost
from sandbox.claims import operation_counts as counts
from sandbox.claims.claim import Claim, Evidence, Role, State, Trial
from sandbox.claims.cost import less_operations

CLAIMS = {claim.name: claim for claim in cost.CLAIMS}

COUNTED = [claim for claim in cost.CLAIMS if claim.name != "count_as_gauge"]


def _range(evidence: Evidence) -> str:
    return " ".join(check.range for check in evidence.checks if check.range and (check.role is Role.OURS or not check.holds))


@pytest.mark.parametrize("claim", COUNTED, ids=lambda claim: claim.name)
def test_counts_do_not_depend_on_the_seed(claim: Claim) -> None:
    """Operations are counted, not drawn: every seed finds the same."""
    first, second = (claim.evidence(Trial(full=False, seed=seed)) for seed in (0, 7))
    assert first.checks == second.checks and first.exhibits == second.exhibits
    assert first.state is (State.REPRODUCED if claim.name in ("table_1", "table_2", "identity_exploited") else State.RANGE)


@pytest.mark.parametrize(
    "name, words",
    [
        (
            "less_than_60_percent",
            "less than 60 % where $n - m = 1$ with $n ≥ 6$, and fewer operations at all where $n - m = 1$; $n - m = 2$",
        ),
        ("more_significant_for_general_weight", "$n - m = 1$; $n - m = 2$ with $n ≥ 4$; $n - m = 3$ with $n = 7$"),
        ("general_cheaper_than_identity", "$n - m = 1$ with $n ≥ 4$. For many joints"),
        ("identity_exploited", "189 / 154 (W = I) and 231 / 196 (any W) at $n = 7$, $m = 6$"),
        (
            "projection_methods_comparable",
            "$m = 1$ with $n ≥ 3$; $m = 2$ with $n ≥ 6$; with the block spared in every step, nowhere",
        ),
    ],
)
def test_the_range_of_a_claim_is_the_one_by_hand(name: str, words: str) -> None:
    """Up to seven joints."""
    assert words in _range(CLAIMS[name].evidence(Trial(full=False)))


@pytest.mark.parametrize("off", [Fraction(0), Fraction(1, 2)])
def test_a_share_is_below_or_not(off: Fraction) -> None:
    """Where the paper's 60 % are not undercut the claim is not reproduced, though every count agreed with what is printed."""

    def dearer(method: str, n: int, m: int, *, weighted: bool) -> counts.Count:
        found = counts.table_1(method, n, m, weighted=weighted)
        return found + counts.Count(int(off * found.multiplications) * (method == "eq6"))

    state = less_operations.less_than_60_percent(Trial(full=False), dearer, dearer).state
    assert state is (State.NOT_REPRODUCED if off else State.RANGE)
