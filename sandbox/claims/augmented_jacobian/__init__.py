"""Section III: the augmented Jacobian technique, eqs. (8)-(10)."""

from __future__ import annotations

from sandbox.claims.augmented_jacobian import any_positive_gamma, augmented_jacobian, frozen_rate, repeatable_with_alpha_zero

CLAIMS = (
    augmented_jacobian.CLAIM,
    any_positive_gamma.CLAIM,
    frozen_rate.CLAIM,
    repeatable_with_alpha_zero.CLAIM,
)
