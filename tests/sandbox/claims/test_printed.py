"""A printed equation on a stack."""

from __future__ import annotations

import numpy as np

from sandbox.claims import equations
from sandbox.claims.claim import Trial
from sandbox.claims.printed import each
from sandbox.claims.situations import positive


def test_each_problem_of_a_stack_has_the_rates_that_it_has_alone() -> None:
    """With its own J, xdot, W and gradient, and the alpha that is given."""
    problem = positive(Trial().rng("printed"), 2, 4, 3)
    for alpha in (1.0, 0.5):
        alone = [equations.liegeois(problem.J[i], problem.xdot[i], problem.W.dense()[i], problem.a[i], alpha) for i in range(3)]
        assert np.array_equal(each(equations.liegeois, problem, alpha), alone)
