"""What rank tolerances are compared with."""

from __future__ import annotations

import numpy as np

from sandbox.claims.singularities import approach, rank_tolerance
from sandbox.closed_form.eq13 import eq13


def test_rank_tolerances_are_compared_with_the_scaled_singular_values() -> None:
    """Eq. (13) drops the small singular value just where the tolerance passes the share that is drawn in the plot."""
    one = approach.stretching(approach.TURN)
    problem = one.problem(np.array([1e-5]))
    share = float(rank_tolerance.relative_sigma(problem.J)[0])
    kept, dropped = (eq13(problem, rank_tolerance=factor * share).x[0] for factor in (1 - 1e-6, 1 + 1e-6))
    assert np.linalg.norm(kept) > 1e3 * np.linalg.norm(dropped)
