"""Section II: eqs. (2)-(7) and what eq. (6) minimises."""

from __future__ import annotations

from sandbox.claims.framework import (
    any_spanning_basis,
    beyond_positive_definite,
    condition_seven,
    footnote_1,
    footnote_2,
    lagrange_minimiser,
    normal_equations_equal_augmented,
    symmetric_weight,
    tradeoff,
)

CLAIMS = (
    footnote_1.CLAIM, normal_equations_equal_augmented.CLAIM, any_spanning_basis.CLAIM, beyond_positive_definite.CLAIM,
    symmetric_weight.CLAIM, condition_seven.CLAIM, lagrange_minimiser.CLAIM, footnote_2.CLAIM, tradeoff.CLAIM,
)  # fmt: skip
