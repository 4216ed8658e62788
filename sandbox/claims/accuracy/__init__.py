"""Section V: cond(J J') = cond(J)^2, Fig. 1 and Table III, in the paper's single precision."""

from __future__ import annotations

from sandbox.claims.accuracy import errors, figure_1, more_accurate, normal_equations, shares

CLAIMS = (
    *normal_equations.CLAIMS,
    figure_1.CLAIM,
    shares.PERCENTAGES,
    errors.MEAN_AND_WORST_AUGMENTED,
    errors.MEAN_AND_WORST_NORMAL,
    more_accurate.MORE_ACCURATE,
    more_accurate.GROWTH,
    shares.THROUGHOUT,
)
