"""Section III: eq. (6) without forming W or grad f, and what that saves."""

from __future__ import annotations

from sandbox.claims.implicit import (
    directional_derivatives,
    explicit_weight_costs_more,
    inertia_by_inverse_dynamics,
    weight_not_needed_augmented,
)

CLAIMS = (
    weight_not_needed_augmented.CLAIM,
    inertia_by_inverse_dynamics.CLAIM,
    directional_derivatives.CLAIM,
    explicit_weight_costs_more.CLAIM,
)
