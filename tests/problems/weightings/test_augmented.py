"""W = E' Gamma E and a = -E' Gamma gbar."""

from __future__ import annotations

import numpy as np
import pytest

from problems import robots
from problems.measures.jacobian import decompose
from problems.methods.draw import generic
from problems.robots.planar import PLANAR_3R
from problems.weightings.augmented import (
    AlgorithmicSingularityError,
    NotRedundantError,
    OverdeterminedWarning,
    augmented,
    check_rows,
    clear,
    closed_loop,
    positive,
    redundancy,
    secondary_rate,
)
from sandbox.errors import NonFiniteError, RangeError, RankDeficientError, ShapeError
from sandbox.tolerances import UNIT
from tests.problems.secondary import F1, NULL

RNG = np.random.default_rng(0)
E = RNG.standard_normal((5, 2, 4))
GAMMA = np.array([0.5, 3.0])


def test_weight_is_the_sum_of_outer_products():
    """W = sum_i gam_i grad g_i grad g_i', factored, of rank k and positive semidefinite (8)."""
    weight = augmented(E, GAMMA)
    expected = sum(g * e[:, :, None] * e[:, None, :] for g, e in zip(GAMMA, np.moveaxis(E, 1, 0), strict=True))
    np.testing.assert_allclose(weight.dense(), expected, rtol=1e-14, atol=1e-15)
    assert weight.factored and not weight.base.any()
    assert (np.linalg.matrix_rank(weight.dense()) == 2).all()


def test_one_set_of_rows_and_a_stack_of_them():
    """Leading axes are a stack, with any number of members."""
    np.testing.assert_array_equal(augmented(E[0], GAMMA).dense(), augmented(E, GAMMA).dense()[0])
    for count in (1, 2, 3):
        assert augmented(E[:count], GAMMA).lead == (count,)
    assert augmented(E[0]).gamma.tolist() == np.eye(2).tolist()


def test_secondary_rate_is_minus_the_sum():
    """Vector a = -sum_i gam_i gbar_i grad g_i (9), one gbar for all or one for each."""
    gbar = RNG.standard_normal((5, 2))
    a = secondary_rate(E, gbar, GAMMA)
    expected = -sum(GAMMA[i] * gbar[:, i, None] * E[:, i] for i in range(2))
    np.testing.assert_allclose(a, expected, rtol=1e-14, atol=1e-15)
    np.testing.assert_array_equal(secondary_rate(E, gbar[0], GAMMA)[0], a[0])
    assert not secondary_rate(E).any()


def test_closed_loop():
    """Rates gbar = gdot_des + kp (g_des - g)."""
    g = np.array([[0.1, 0.2], [0.3, 0.4]])
    np.testing.assert_allclose(closed_loop(g, [1.0, 2.0], 2.0, [0.5, 0.0]), [[2.3, 3.6], [1.9, 3.2]], rtol=1e-15)


@pytest.mark.parametrize("gamma", [[0.0, 1.0], [1.0, -1.0], [[1.0, 1.0]]])
def test_gamma_must_be_positive(gamma):
    """Zero, negative or stacked gamma is refused."""
    with pytest.raises(RangeError, match="gamma"):
        augmented(E, gamma)


def test_gamma_must_be_of_the_right_number_and_finite():
    """There are k of them, each a number."""
    with pytest.raises(ShapeError, match="gamma"):
        positive([1.0], 2)
    with pytest.raises(NonFiniteError, match="gamma"):
        positive([1.0, np.inf], 2)


def test_decomposition_spans_null_space_and_range():
    """J = U diag(sigma) V', J N = 0, [V N] orthonormal."""
    panda = robots.load("panda")
    q, _, _ = generic(panda, np.random.default_rng(1), 20)
    J = panda.jacobian(q)
    found = decompose(panda, J)
    U, V, N, sigma = found.U, found.V, found.N, found.sigma
    both = np.concatenate([V, N], axis=2)
    np.testing.assert_allclose(np.swapaxes(both, 1, 2) @ both, np.broadcast_to(np.eye(7), (20, 7, 7)), rtol=0, atol=1e-14)
    np.testing.assert_allclose((U * sigma[:, None, :]) @ np.swapaxes(V, 1, 2), J, rtol=0, atol=1e-14)
    np.testing.assert_allclose(J @ N, 0, rtol=0, atol=1e-14)


def test_distance_from_an_algorithmic_singularity():
    """sigma_min(N'E') with unit rows: |n.e| / |n||e| for one of them; zero for a row of J, and for no row at all."""
    q = np.repeat(F1, 4, axis=0)
    rows = np.array([[[1.0, 1, 1]], [[1.0, 1, 0]], [[0.0, 0, 0]], [[5.0, 0, 0]]])
    distance, _ = clear(PLANAR_3R, q, rows)
    expected = np.abs(rows[:, 0] @ NULL) / np.sqrt(3) / np.array([np.sqrt(3), 1, 1, 5])
    np.testing.assert_allclose(distance, expected, rtol=0, atol=1e-15)


def test_one_configuration_may_be_checked_without_a_stack():
    """A q (n,) has its rows (k, n)."""
    check_rows(PLANAR_3R, F1[0], np.ones((1, 3)))
    with pytest.warns(OverdeterminedWarning):
        check_rows(PLANAR_3R, F1[0], np.array([[1.0, 1, 1], [1, 0, 0]]))


def test_refusals_name_robot_and_configuration():
    """A lost rank and a missing redundancy."""
    with pytest.raises(RankDeficientError, match="configuration 1 of planar_3r") as refusal:
        decompose(PLANAR_3R, PLANAR_3R.jacobian(np.vstack([F1, np.zeros(3)])))
    assert refusal.value.evidence["index"] == (1,)
    with pytest.raises(NotRedundantError, match="planar_3r"):
        redundancy(PLANAR_3R.task("planar pose"))


@pytest.mark.parametrize("given", [
    {"desired": np.ones(3)}, {"gain": np.ones(3)}, {"desired_rate": np.ones((2, 2, 2))}, {"desired": np.ones((3, 1))},
], ids=["desired", "gain", "rate", "column"])  # fmt: skip
def test_closed_loop_wants_one_number_per_function(given):
    """What goes with neither all functions nor each of them is refused by its name."""
    with pytest.raises(ShapeError, match=next(iter(given))):
        closed_loop(np.ones((3, 2)), **{"desired": np.zeros(2), "gain": 1.0, **given})


def test_algorithmic_singularity_to_what_the_arm_can_tell():
    """N is known to u cond(J) only: sigma_min(N'E') of 1e3 u is taken where J is healthy, refused where cond J is 1e6."""
    for q, taken in (([0.3, 1.1, -0.7], True), ([0.3, 1e-6, 1e-6], False)):
        J = PLANAR_3R.jacobian(np.array(q))
        N = np.linalg.svd(J)[2][2]
        assert (np.linalg.cond(J) > 1e5) != taken
        row = J[1] - (J[1] @ N) * N
        E = (row / np.linalg.norm(row) + 1e3 * UNIT * N)[None]
        if taken:
            check_rows(PLANAR_3R, np.array(q), E)
        else:
            with pytest.raises(AlgorithmicSingularityError):
                check_rows(PLANAR_3R, np.array(q), E)
