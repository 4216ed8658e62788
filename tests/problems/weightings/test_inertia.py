"""The inertia matrix as a weight."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
import pytest

from problems.robots.planar import PLANAR_3R, planar_arm
from problems.robots.robot import Robot
from problems.sets import textbook
from problems.weightings.inertia import inertia
from sandbox.errors import AsymmetricWeightError, WeightNotPositiveDefiniteError
from sandbox.tolerances import UNIT

F1 = np.array(textbook.F1.q)


@dataclass(frozen=True, eq=False)
class Lopsided(Robot):
    """Its inertia matrix is not symmetric."""

    def inertia(self, q):
        """M with one entry off."""
        M = super().inertia(q)
        M[..., 0, 1] *= 1.1
        return M


def test_f1():
    """F1 with unit masses has M = [[8, 4, 2], [4, 3, 1], [2, 1, 1]], with eigenvalues .460519, .809493, 10.729988."""
    M = inertia(PLANAR_3R, F1).dense()
    np.testing.assert_allclose(M, textbook.INERTIA_F1, atol=64 * UNIT)
    np.testing.assert_allclose(np.linalg.eigvalsh(M), [0.460519, 0.809493, 10.729988], atol=1e-6)


@pytest.mark.parametrize("link", [3, None], ids=["last link", "no link"])
def test_a_massless_link_is_refused(link):
    """A robot whose last link weighs nothing has a mass matrix that is not positive definite; rotors cure it."""
    robot = planar_arm((1.0, 1.0, 1.0), name="light")
    for joint in [link] if link else robot.joints:
        robot.model.inertias[joint] = pin.Inertia.Zero()
    with pytest.raises(WeightNotPositiveDefiniteError, match="mass matrix M of light is not positive definite") as caught:
        inertia(robot, np.stack([F1, F1]))
    assert caught.value.evidence["index"] == (0,)
    robot.model.armature = np.full(3, 0.1)
    inertia(robot, F1)


def test_an_asymmetric_mass_matrix_is_refused():
    """M that is not symmetric is refused with the entry."""
    robot = Lopsided("lopsided", PLANAR_3R.model, "tip", PLANAR_3R.rows)
    with pytest.raises(AsymmetricWeightError, match=r"W\[0, 0, 1\]"):
        inertia(robot, F1[None])
