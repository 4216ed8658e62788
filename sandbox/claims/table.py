"""The ledger: every claim of the paper that is computed, in the paper's order."""

from __future__ import annotations

from sandbox.claims import framework
from sandbox.claims.claim import Claim

CLAIMS: dict[str, Claim] = {claim.name: claim for part in (framework,) for claim in part.CLAIMS}
"""All claims by name."""
