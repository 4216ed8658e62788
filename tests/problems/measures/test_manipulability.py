"""Manipulability and smallest singular value: printed values, invariances, refusals (methods M5)."""

from __future__ import annotations

import numpy as np
import pytest

from problems.measures.manipulability import log_volume, volume
from problems.measures.measure import NotDifferentiableError
from problems.measures.singular_value import require_simple, smallest_singular_value
from problems.robots import load
from problems.robots.planar import PLANAR_3R, PLANAR_4R, planar_arm
from problems.sets import textbook
from sandbox.errors import RankDeficientError
from sandbox.tolerances import SIMPLE, UNIT

F1, F1B = np.array(textbook.F1.q), np.array(textbook.F1B.q)
GENERIC = np.array([0.3, 1.1, -0.7])
ROUNDING = 64 * UNIT
PRINTED = 1e-12
ROOT = 5**0.5


def test_manipulability():
    """Manipulability and its gradient have the printed values at F1, F1b and a generic configuration."""
    q = np.stack([F1, F1B, GENERIC])
    np.testing.assert_allclose(volume().value(PLANAR_3R, q), [3**0.5, ROOT, 1.456001828397555], rtol=ROUNDING)
    printed = [[0, 0, 0], [0, 0, 1 / ROOT], [0, 1.047893942366, 0.176677313279]]
    np.testing.assert_allclose(volume().gradient(PLANAR_3R, q), printed, atol=PRINTED)


def test_of_the_planar_arm():
    """On the 3R arm w^2 = s3^2 + (s3 + s23)^2 + (s2 + s23)^2."""
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (50, 3))
    s2, s3, s23 = np.sin(q[:, 1]), np.sin(q[:, 2]), np.sin(q[:, 1] + q[:, 2])
    squared = s3**2 + (s3 + s23) ** 2 + (s2 + s23) ** 2
    np.testing.assert_allclose(volume().value(PLANAR_3R, q) ** 2, squared, rtol=ROUNDING, atol=ROUNDING)


def test_hessian():
    """Hess w at F1 is 1/sqrt3 [[0,0,0],[0,1,2],[0,2,0]]; at F1b it has the printed entries."""
    hessian = volume().curvature(PLANAR_3R, np.stack([F1, F1B]))
    np.testing.assert_allclose(hessian[0], np.array([[0, 0, 0], [0, 1, 2], [0, 2, 0]]) / 3**0.5, atol=ROUNDING)
    printed = [[0, 0, 0], [0, -ROOT, -3 * ROOT / 5], [0, -3 * ROOT / 5, -6 * ROOT / 25]]
    np.testing.assert_allclose(hessian[1], printed, atol=4 * ROUNDING)


def test_smallest_singular_value():
    """sigma_min and its gradient have the printed values at F1 and F1b."""
    f, q = smallest_singular_value(), np.stack([F1, F1B])
    np.testing.assert_allclose(f.value(PLANAR_3R, q), [0.628051530159756, 0.726542528005361], rtol=ROUNDING)
    printed = [[0, 0.087095076755, -0.174190153510], [0, 0.162459848116, 0.235114100917]]
    np.testing.assert_allclose(f.gradient(PLANAR_3R, q), printed, atol=PRINTED)


def test_logarithm():
    """The measure ln w is the logarithm of w, and its gradient w times smaller."""
    q = np.random.default_rng(1).uniform(-2, 2, (20, 4))
    w, slope = volume().value(PLANAR_4R, q), volume().gradient(PLANAR_4R, q)
    np.testing.assert_allclose(log_volume().value(PLANAR_4R, q), np.log(w), atol=ROUNDING)
    np.testing.assert_allclose(log_volume().gradient(PLANAR_4R, q), slope / w[:, None], rtol=1e-12, atol=1e-12)


def test_task_units():
    """An arm twice as long has w four times as large, and a gradient of ln w that is the same."""
    longer, q = planar_arm([2.0, 2.0, 2.0]), np.random.default_rng(2).uniform(-2, 2, (20, 3))
    np.testing.assert_allclose(volume().value(longer, q), 4 * volume().value(PLANAR_3R, q), rtol=ROUNDING)
    slopes = [log_volume().gradient(arm, q) for arm in (longer, PLANAR_3R)]
    np.testing.assert_allclose(*slopes, rtol=1e-12, atol=1e-12)


def test_near_a_singularity():
    """At sigma_min/sigma_1 near 1e-7 the logarithm keeps its digits, as JJ' would not: a step down is a step of ln w."""
    q = np.array([0.4, 1e-7, 2e-7])  # w = sqrt(s3^2 + ...) is linear in the scale of (q2, q3)
    exact = np.log(np.sqrt(2e-7**2 + 5e-7**2 + 4e-7**2))
    assert abs(log_volume().value(PLANAR_3R, q) - exact) < 1e-8
    slope = log_volume().gradient(PLANAR_3R, q)
    assert abs(slope @ [0.4, 1e-7, 2e-7] - 1) < 1e-7


@pytest.mark.parametrize("q", [[0, 0, 0], [0.3, 0, np.pi], [1, np.pi, 0]], ids=str)
@pytest.mark.parametrize("measure", [volume(), smallest_singular_value()], ids=lambda f: f.name)
def test_singular(measure, q):
    """At a singularity w and sigma_min are 0, but for rounding, and have no gradient; singular values are the evidence."""
    q = np.stack([F1, np.array(q, dtype=float)])
    assert measure.value(PLANAR_3R, q)[1] < 1e-15
    with pytest.raises(RankDeficientError, match="configuration 1") as caught:
        measure.gradient(PLANAR_3R, q)
    assert caught.value.evidence["singular_values"][1] < 1e-15


def test_singular_logarithm():
    """The measure ln w is refused at a singularity, value and gradient."""
    for function in (log_volume().value, log_volume().gradient):
        with pytest.raises(RankDeficientError, match="this configuration"):
            function(PLANAR_3R, np.zeros(3))


@pytest.mark.parametrize("measure", [volume(), log_volume(), smallest_singular_value()], ids=lambda f: f.name)
def test_more_rows_than_joints(measure):
    """A task of more rows than joints never has full row rank: no gradient."""
    with pytest.raises(RankDeficientError):
        measure.gradient(PLANAR_3R.task("pose"), F1)


def test_multiple_singular_value():
    """An isotropic J has no simple smallest singular value: no gradient, but a value."""
    # J J' = 2 I: two unit links at right angles to the line to the tip, seen by a two-link arm of lengths sqrt2, 1
    arm = planar_arm([2**0.5, 1.0])
    q = np.array([0.7, 0.75 * np.pi])
    J = arm.jacobian(q)
    np.testing.assert_allclose(J @ J.T, np.eye(2), atol=ROUNDING)
    assert abs(smallest_singular_value().value(arm, q) - 1) < ROUNDING
    with pytest.raises(NotDifferentiableError, match="not told from the next"):
        smallest_singular_value().gradient(arm, q)
    assert np.isfinite(volume().gradient(arm, q)).all()


def test_one_task_row():
    """With one task row w and sigma_min are the length of that row."""
    panda = load("panda").task((2,))
    q = np.array([0.1, -0.4, 0.3, -2.0, 0.2, 1.7, 0.5])
    length = np.linalg.norm(panda.jacobian(q))
    for f in (volume(), smallest_singular_value()):
        assert abs(f.value(panda, q) - length) <= ROUNDING * length
    np.testing.assert_allclose(volume().gradient(panda, q), smallest_singular_value().gradient(panda, q), atol=1e-13)


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e9])
def test_simple_is_told_by_shares(size):
    """Singular values apart by twice, or half, the share that counts: told so in any unit of J, and in any member."""
    simple, double = size * np.array([1.0, 0.5 + 2 * SIMPLE, 0.5]), size * np.array([1.0, 0.5 + SIMPLE / 2, 0.5])
    require_simple(PLANAR_3R, np.stack([simple, simple]), "sigma")
    with pytest.raises(NotDifferentiableError, match="configuration 1"):
        require_simple(PLANAR_3R, np.stack([simple, double]), "sigma")
