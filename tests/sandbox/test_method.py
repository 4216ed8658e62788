"""What a row of the table of methods can do by itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from problems.methods import METHODS
from problems.methods.gradient_projection import METHOD
from problems.robots.planar import PLANAR_3R, PLANAR_4R
from sandbox.errors import EmptyPlanError
from sandbox.method import STARTS, start


@pytest.mark.parametrize("name", ["gradient_projection", "weighted_least_norm", "mussa_ivaldi_hogan"])
def test_a_start_is_the_best_conditioned_of_some_situations(name):
    """Of twenty drawn one by one from the seed it is the one whose J is best conditioned, parameters and all."""
    method = METHODS[name]
    for seed in (0, 1):
        drawn = [method.draw(PLANAR_4R, np.random.default_rng([seed, i]), 1) for i in range(STARTS)]
        best = min(drawn, key=lambda one: float(np.linalg.cond(PLANAR_4R.jacobian(one.q[0]))))
        found = start(method, PLANAR_4R, seed)
        np.testing.assert_array_equal(found.q, best.q)
        np.testing.assert_array_equal(found.xdot, best.xdot)
        assert found.q.shape == (1, 4)
        for key, value in best.parameters.items():
            np.testing.assert_array_equal(found.parameters[key], value)
    assert STARTS == 20
    assert np.abs(start(method, PLANAR_4R, 0).q - start(method, PLANAR_4R, 1).q).max() > 1e-3


def test_a_witness_is_the_original():
    """It answers what the original answers, with the same parameters; without an original there is none."""
    q, xdot = np.array([[0.3, 1.1, -0.7]]), np.array([[0.3, -0.7]])
    np.testing.assert_array_equal(METHOD.witness(PLANAR_3R, q, xdot, alpha=0.2), METHOD.original(PLANAR_3R, q, xdot, alpha=0.2))
    with pytest.raises(EmptyPlanError, match="gradient_projection has no original"):
        replace(METHOD, original=None).witness(PLANAR_3R, q, xdot)
