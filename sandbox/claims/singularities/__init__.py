"""Section VI: near kinematic singularities no exact method is realizable; what damping and time scaling do instead."""

from __future__ import annotations

from sandbox.claims.singularities import (
    damped_least_squares,
    giving_up_exactness,
    not_realizable,
    rank_tolerance,
    time_scaling,
)

CLAIMS = (
    not_realizable.CLAIM,
    rank_tolerance.CLAIM,
    giving_up_exactness.CLAIM,
    time_scaling.CLAIM,
    damped_least_squares.CLAIM,
)
