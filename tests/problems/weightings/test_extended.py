"""The condition h = N'grad g = 0, its derivative, and W = H'H."""

from __future__ import annotations

import numpy as np
import pytest

from problems import robots
from problems.methods.draw import generic
from problems.robots.planar import PLANAR_3R
from problems.weightings.augmented import AlgorithmicSingularityError
from problems.weightings.extended import OffManifoldError, extended, extremum
from problems.weightings.impedance import elastic
from tests.problems.secondary import COUNT, EACH_ROBOT, F1, NULL, Q0, rest, rounding

STEP = np.finfo(float).eps ** (1 / 3)


@EACH_ROBOT
def test_t_is_made_of_the_derivatives_of_j(name):
    """T_ij = sum_k lam_k dJ_ki/dq_j, from expressions, is that of the numeric derivative of J."""
    robot = robots.load(name)
    q, _, _ = generic(robot, np.random.default_rng(0), COUNT)
    condition = extremum(robot, q, elastic(robot, 1.0, np.ones(robot.n)))
    expected = np.einsum("bk,bjki->bij", condition.multipliers, robot.jacobian_derivative(q))
    allowed = rounding(robot, q, np.abs(condition.T).max(axis=(1, 2)) + np.linalg.norm(condition.multipliers, axis=1))
    assert (np.abs(condition.T - expected).max(axis=(1, 2)) <= allowed).all()


@EACH_ROBOT
def test_h_is_differentiated_with_the_null_space_frozen(name):
    """H = dh/dq of h = (N_0 - J^+J N_0)'grad g, on the manifold and off it, by central differences (5.2)."""
    robot = robots.load(name)
    q, _, _ = generic(robot, np.random.default_rng(1), 20)
    g = elastic(robot, np.linspace(0.5, 2.0, robot.n), 0.3 * np.ones(robot.n))
    condition = extremum(robot, q, g)

    def h(at):
        J = robot.jacobian(at)
        N = condition.N - np.linalg.pinv(J) @ J @ condition.N
        return np.einsum("bnk,bn->bk", N, g.gradient(robot, at))

    steps = STEP * np.eye(robot.n)
    differenced = np.stack([(h(q + s) - h(q - s)) / (2 * STEP) for s in steps], axis=-1)
    curvature = np.linalg.cond(robot.jacobian(q)) ** 3 * np.linalg.norm(condition.gradient, axis=1)
    assert (np.abs(differenced - condition.H).max(axis=(1, 2)) <= 10 * STEP**2 * curvature).all()


def test_f1():
    """Multipliers lam = (-1, -1), h = 0 and grad h = (-1, 0, 0) in the gauge of the cross product (E1)."""
    condition = extremum(PLANAR_3R, F1, elastic(PLANAR_3R, 1.0, Q0))
    allowed = rounding(PLANAR_3R, F1, 5.0)[0]
    np.testing.assert_allclose(condition.multipliers[0], (-1, -1), rtol=0, atol=allowed)
    np.testing.assert_allclose(condition.h, 0, rtol=0, atol=allowed)
    scale = condition.N[0, :, 0] @ NULL / 3  # N = scale n
    np.testing.assert_allclose(condition.H[0, 0] / scale, (-1, 0, 0), rtol=0, atol=3 * allowed)


def test_weight_is_factored():
    """W = H'H keeps H as its factor, with nothing added."""
    weight = extended(extremum(PLANAR_3R, F1, elastic(PLANAR_3R, 1.0, Q0)))
    assert weight.factored and not weight.base.any() and weight.E.shape == (1, 1, 3)


@EACH_ROBOT
def test_distance_is_zero_in_balance_and_one_along_the_self_motion(name):
    """With rest = q - J'F is extremal; rest = q - N y is as far off as can be."""
    robot = robots.load(name)
    q, _, _ = generic(robot, np.random.default_rng(2), COUNT)
    balanced = extremum(robot, q, elastic(robot, 1.0, rest(robot, q, np.ones(robot.m))))
    assert (balanced.distance <= rounding(robot, q)).all()
    off = extremum(robot, q, elastic(robot, 1.0, q - balanced.N[:, :, 0]))
    assert (np.abs(off.distance - 1) <= rounding(robot, q, 1 + robot.n * np.linalg.norm(q, axis=1))).all()


def test_border_of_the_manifold():
    """The tolerance is a share of |grad g|; inf switches the check off."""
    off = extremum(PLANAR_3R, F1, elastic(PLANAR_3R, 1.0, Q0 + 1e-3 * NULL))
    share = off.distance[0]
    assert off.on_manifold(1.01 * share) is off and off.on_manifold(np.inf) is off
    with pytest.raises(OffManifoldError) as refusal:
        off.on_manifold(0.99 * share)
    assert refusal.value.evidence["distance"] == share
    assert refusal.value.evidence["h"].shape == (1,)


def test_bifurcation_is_decided_at_rounding():
    """Curvature n'Hess L n = 3 + 2 F_x at F1: refused at F_x = -1.5, not 1e-9 beside it."""
    for F_x, refused in ((-1.5, True), (-1.5 + 1e-9, False), (-1.5 - 1e-9, False)):
        condition = extremum(PLANAR_3R, F1, elastic(PLANAR_3R, 1.0, rest(PLANAR_3R, F1, (F_x, 0.0))))
        if refused:
            with pytest.raises(AlgorithmicSingularityError):
                extended(condition)
        else:
            assert extended(condition).factored


def test_single_configuration():
    """A q (n,) gives one weight."""
    condition = extremum(PLANAR_3R, F1[0], elastic(PLANAR_3R, 1.0, Q0))
    assert condition.on_manifold() is condition
    assert extended(condition).lead == ()


@pytest.mark.parametrize("stiffness", [1e-9, 1.0, 1e9])
def test_distance_from_the_manifold_has_no_unit(stiffness):
    """Springs a thousand million times as soft or stiff are as far off the manifold, or on it."""
    off = extremum(PLANAR_3R, F1, elastic(PLANAR_3R, stiffness, Q0 + 0.1 * NULL)).distance
    np.testing.assert_allclose(off, extremum(PLANAR_3R, F1, elastic(PLANAR_3R, 1.0, Q0 + 0.1 * NULL)).distance, rtol=1e-9)
    assert off > 0.05
    assert extremum(PLANAR_3R, F1, elastic(PLANAR_3R, stiffness, Q0)).distance < 1e-15


def test_rounding_of_large_angles_is_no_distance():
    """A hundred thousand turns on, q itself is rounded to 1e-10 rad: still on the manifold."""
    turns = 2 * np.pi * 1e5
    far = extremum(PLANAR_3R, F1 + turns, elastic(PLANAR_3R, 1.0, Q0 + turns))
    assert far.distance < 1e-9
