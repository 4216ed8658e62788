"""The Jacobian decomposed: what is made of its singular values, and when they count as zero."""

from __future__ import annotations

import numpy as np
import pytest

from problems import robots
from problems.measures.jacobian import decompose, require_full_rank
from problems.methods.draw import generic
from problems.robots.planar import PLANAR_3R
from sandbox.errors import RankDeficientError
from sandbox.tolerances import RANK, UNIT


@pytest.mark.parametrize("name", ["planar_3r", "planar_4r", "panda"])
def test_parts(name):
    """J = U diag(sigma) V'; J^+ and the condition number are numpy's; the columns of N are an orthonormal basis of null J."""
    robot = robots.load(name)
    J = robot.jacobian(generic(robot, np.random.default_rng(0), 20).q)
    found = decompose(robot, J)
    rounding = 64 * robot.n * UNIT
    condition = np.linalg.cond(J)
    whole = (found.U * found.sigma[:, None, :]) @ np.swapaxes(found.V, 1, 2)
    np.testing.assert_allclose(whole, J, atol=rounding * np.abs(J).max())
    np.testing.assert_allclose(found.condition, condition, rtol=rounding * condition.max())
    np.testing.assert_allclose(found.pinv, np.linalg.pinv(J), atol=rounding * (condition**2).max())
    assert found.N.shape == (20, robot.n, robot.k)
    np.testing.assert_allclose(J @ found.N, 0, atol=rounding * np.abs(J).max())
    square = np.swapaxes(found.N, 1, 2) @ found.N
    np.testing.assert_allclose(square, np.tile(np.eye(robot.k), (20, 1, 1)), atol=rounding)


def test_zero_is_a_share_of_the_largest_singular_value():
    """A smallest singular value of twice RANK n u sigma_1 is taken and half of it refused, whatever J's unit, by its member."""
    J, least = np.zeros((2, 2, 3)), RANK * 3 * UNIT
    for size in (1e-9, 1.0, 1e9):
        require_full_rank(PLANAR_3R, J, size * np.array([[1.0, 2 * least], [1.0, 1.0]]))
        with pytest.raises(RankDeficientError, match="configuration 1") as caught:
            require_full_rank(PLANAR_3R, J, size * np.array([[1.0, 2 * least], [1.0, least / 2]]))
        assert caught.value.evidence["singular_values"] == [size, size * least / 2]
