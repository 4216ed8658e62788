"""Section VI: eq. (13), where J is not of full rank."""

from __future__ import annotations

from sandbox.claims.rank_deficient import completing_basis, conditions, full_rank, minimiser, rank_k_weights

CLAIMS = (minimiser.CLAIM, full_rank.CLAIM, completing_basis.CLAIM, conditions.CLAIM, rank_k_weights.CLAIM)
