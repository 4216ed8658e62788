"""The table of weightings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import problems.weightings
from problems.robots.planar import PLANAR_3R
from problems.weightings import WEIGHTINGS
from sandbox.weight import Weight

HELPERS = {"__init__", "definite", "weighting"}
Q = np.array([[0.3, 1.1, -0.7], [0.2, -0.9, 1.3]])


def test_every_file_has_its_row():
    """One file per weighting, one row per file, and the row says everything."""
    files = {path.stem for path in Path(problems.weightings.__file__).parent.glob("*.py")} - HELPERS
    assert files == set(WEIGHTINGS)
    for row in WEIGHTINGS.values():
        assert all((row.formula, row.unit, row.definiteness, row.source))
        assert row.function.__name__ == row.name


@pytest.mark.parametrize("name", ["identity", "whitney", "least_norm", "stiffness", "inertia", "virtual_load"])
def test_weights_of_a_stack(name):
    """Weightings of (robot, q) need nothing else, are stacked as q is, and equal their members'; all these are definite."""
    weighting = WEIGHTINGS[name].function
    W = weighting(PLANAR_3R, Q)
    assert isinstance(W, Weight) and W.lead == (2,)
    np.testing.assert_array_equal(W.dense()[1], weighting(PLANAR_3R, Q[1]).dense())
    assert (np.linalg.eigvalsh(W.dense()) > 0).all()
