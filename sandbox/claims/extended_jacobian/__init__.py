"""Section III, eqs. (11)-(12): Baillieul's extended Jacobian and its feedback."""

from __future__ import annotations

from sandbox.claims.extended_jacobian import (
    any_differentiable_basis,
    extended_jacobian,
    extremum_feedback,
    maintains_an_extremum,
)

CLAIMS = (
    extended_jacobian.EXTENDED_JACOBIAN,
    extended_jacobian.EXTENDED_JACOBIAN_GENERAL,
    maintains_an_extremum.CLAIM,
    any_differentiable_basis.CLAIM,
    extremum_feedback.CLAIM,
)
