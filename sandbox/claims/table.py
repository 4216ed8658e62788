"""The ledger: every claim of the paper that is computed, in the paper's order."""

from __future__ import annotations

from sandbox.claims import (
    accuracy,
    augmented_jacobian,
    beyond,
    cost,
    damping,
    extended_jacobian,
    framework,
    implicit,
    introduction,
    pseudoinverse,
    rank_deficient,
    singularities,
    summary,
    weightings,
)
from sandbox.claims.claim import Claim

CLAIMS: dict[str, Claim] = {
    claim.name: claim
    for part in (
        introduction, framework, pseudoinverse, augmented_jacobian, extended_jacobian, weightings, implicit, damping, cost,
        accuracy, beyond, rank_deficient, singularities, summary,
    )
    for claim in part.CLAIMS
}  # fmt: skip
"""All claims by name."""
