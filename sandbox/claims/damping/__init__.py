"""Section III: damping a weight that is not positive definite."""

from __future__ import annotations

from sandbox.claims.damping import (
    damping_at_algorithmic_singularities,
    damping_reduces_task_errors,
    damping_secures_condition_seven,
)

CLAIMS = (
    damping_secures_condition_seven.CLAIM,
    damping_at_algorithmic_singularities.CLAIM,
    damping_reduces_task_errors.CLAIM,
)
