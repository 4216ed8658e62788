"""Tolerance of locked joints: printed values, identities, ties, refusals (methods M9, I27)."""

from __future__ import annotations

from itertools import combinations
from math import comb

import numpy as np
import pytest

from problems.measures.fault_tolerance import (
    TooManyFailuresError,
    bound,
    failure_sets,
    fault_tolerance,
    kfm,
    least_relative_manipulability,
    reduced_singular_values,
    relative_manipulability,
    tied,
)
from problems.measures.measure import NotDifferentiableError, OutsideDomainError
from problems.robots import load
from problems.robots.planar import PLANAR_3R, PLANAR_4R
from problems.sets import textbook
from sandbox.errors import RangeError, RankDeficientError
from sandbox.tolerances import GRADIENT_STEP, UNIT
from tests.problems.measures import chain

F1, F1B = np.array(textbook.F1.q), np.array(textbook.F1B.q)
GENERIC = np.array([0.3, 1.1, -0.7])
EACH = ((0,), (1,), (2,))
PUBLISHED = np.array([[-((2 / 3) ** 0.5), (1 / 6) ** 0.5, (1 / 6) ** 0.5], [0, -(0.5**0.5), 0.5**0.5]])
ROUNDING = 64 * UNIT
MEASURES = pytest.mark.parametrize("factory", [kfm, least_relative_manipulability, fault_tolerance])


def test_relative_manipulability():
    """Ratios rho are (1,1,1)/sqrt3 at F1, (0,1,2)/sqrt5 at F1b, and has the printed values at the generic configuration."""
    rho = relative_manipulability(PLANAR_3R.jacobian(np.stack([F1, F1B, GENERIC])), EACH)
    np.testing.assert_allclose(rho[0], np.ones(3) / 3**0.5, rtol=ROUNDING)
    np.testing.assert_allclose(rho[1], np.array([0, 1, 2]) / 5**0.5, atol=ROUNDING)
    np.testing.assert_allclose(rho[2], [0.442456647, 0.174999330, 0.879549515], atol=1e-9)


def test_reduced_singular_values():
    """sigma_m without a column is ((sqrt5-1)/2, sqrt2-1, (3-sqrt5)/2) at F1, so that kfm = .381966011250; 0 at F1b."""
    sigma = reduced_singular_values(PLANAR_3R.jacobian(F1), EACH)
    np.testing.assert_allclose(sigma, [(5**0.5 - 1) / 2, 2**0.5 - 1, (3 - 5**0.5) / 2], rtol=ROUNDING)
    values = kfm(PLANAR_3R).value(PLANAR_3R, np.stack([F1, F1B]))
    np.testing.assert_allclose(values, [0.381966011250, 0], atol=1e-12)


def test_published_optimum():
    """The published isotropic Jacobian keeps sigma_m = 1/sqrt3 whatever joint fails, and attains the bound of rho."""
    np.testing.assert_allclose(PUBLISHED @ PUBLISHED.T, np.eye(2), atol=ROUNDING)
    np.testing.assert_allclose(reduced_singular_values(PUBLISHED, EACH), np.full(3, 3**-0.5), rtol=ROUNDING)
    np.testing.assert_allclose(relative_manipulability(PUBLISHED, EACH).min(), bound(3, 2), rtol=ROUNDING)


@pytest.mark.parametrize("name, task", [("planar_3r", None), ("planar_4r", None), ("panda", None), ("panda", "position")])
def test_identities(name, task):
    """Always sum rho_S^2 = C(n-m, f) and min rho_S <= sqrt(C(n-m, f)/C(n, f)), for every number of failures."""
    robot = load(name, task)
    q = np.random.default_rng(5).uniform(0.2, 1.2, (10, robot.n))
    J = robot.jacobian(q)
    condition = np.linalg.cond(J).max()
    for f in range(1, robot.k + 1):
        rho = relative_manipulability(J, tuple(combinations(range(robot.n), f)))
        np.testing.assert_allclose(np.sum(rho**2, axis=-1), comb(robot.k, f), rtol=8 * robot.n * UNIT * condition)
        assert (rho.min(axis=-1) <= bound(robot.n, robot.m, f) * (1 + ROUNDING)).all()


def test_determinant_ratio():
    """rho_S is the ratio of the determinants with and without the columns S."""
    panda = load("panda").task("position")
    q = np.array([0.1, -0.4, 0.3, -2.0, 0.2, 1.7, 0.5])
    sets = failure_sets(panda, 2)
    ratio = chain.relative(chain.Chain(panda, q).J, panda.joints, 2)
    np.testing.assert_allclose(relative_manipulability(panda.jacobian(q), sets), ratio, rtol=1e-12)


@pytest.mark.parametrize("failures", [2, 3])
@MEASURES
def test_several_failures(factory, failures):
    """With several joints locked at once the gradients are those of the values, by differences or complex steps."""
    panda, joints = load("panda").task("position"), (1, 2, 3, 4)
    q = np.array([0.1, -0.4, 0.3, -2.0, 0.2, 1.7, 0.5])
    f = factory(panda, failures=failures, joints=joints)

    def ratios(x):
        rho = chain.relative(chain.Chain(panda, x).J, joints, failures)
        return -np.sum(np.log(rho)) if factory is fault_tolerance else min(rho, key=np.real)

    if factory is kfm:
        other, allowed = chain.difference(lambda x: f.value(panda, x), q, GRADIENT_STEP), 1e-7
    else:
        other, allowed = chain.complex_step(ratios, q), 1e-10
    np.testing.assert_allclose(f.gradient(panda, q), other, rtol=0, atol=allowed * np.abs(other).max())


def test_spherical_wrist_and_shoulder():
    """Self-motion of the spherical-revolute-spherical arm leaves the elbow alone: rho_4 = 0, refused by the joint's number."""
    arm = load("seven_joint")
    q = np.array([[0.3, 0.8, -0.4, 1.1, 0.5, -0.9, 0.2]])
    assert relative_manipulability(arm.jacobian(q), ((3,),)).max() < 1e-13
    for function in (fault_tolerance(arm).value, fault_tolerance(arm).gradient):
        with pytest.raises(OutsideDomainError, match="joint 4"):
            function(arm, q)
    with pytest.raises(NotDifferentiableError, match="joint 4"):
        least_relative_manipulability(arm).gradient(arm, q)
    with pytest.raises(RankDeficientError):
        kfm(arm).gradient(arm, q)
    others = fault_tolerance(arm, joints=(1, 2, 3, 5, 6, 7))
    assert np.isfinite(others.gradient(arm, q)).all()


def test_zero_at_f1b():
    """At F1b joint 1 does not take part in self-motion: the smooth form is refused, the minima have values 0, no gradients."""
    q = np.stack([F1, F1B])
    with pytest.raises(OutsideDomainError, match=r"configuration 1 .*joint 1 ") as caught:
        fault_tolerance(PLANAR_3R).value(PLANAR_3R, q)
    assert caught.value.evidence["joints"] == [1]
    assert least_relative_manipulability(PLANAR_3R).value(PLANAR_3R, q)[1] < ROUNDING
    with pytest.raises(NotDifferentiableError, match=r"configuration 1 .*joint 1 "):
        least_relative_manipulability(PLANAR_3R).gradient(PLANAR_3R, q)
    with pytest.raises(RankDeficientError):
        kfm(PLANAR_3R).gradient(PLANAR_3R, q)


def test_tie():
    """At F1 all three rho tie, and the gradient is one member's; at F1b and the generic configuration none do."""
    rho = relative_manipulability(PLANAR_3R.jacobian(np.stack([F1, F1B, GENERIC])), EACH)
    np.testing.assert_array_equal(tied(rho), [[True] * 3, [True, False, False], [False, True, False]])
    given = least_relative_manipulability(PLANAR_3R).gradient(PLANAR_3R, F1)
    each = [least_relative_manipulability(PLANAR_3R, joints=(i,)).gradient(PLANAR_3R, F1) for i in (1, 2, 3)]
    assert min(np.abs(given - one).max() for one in each) < ROUNDING
    assert max(np.abs(given - one).max() for one in each) > 0.1


def test_tie_of_singular_values():
    """The published optimum ties in all three members, told with sigma_1 as the scale."""
    sigma = reduced_singular_values(PUBLISHED, EACH)
    assert tied(sigma, scale=1.0).all()


@MEASURES
def test_singular(factory):
    """Where J has no full row rank there is no gradient."""
    with pytest.raises(RankDeficientError, match="configuration 1"):
        factory(PLANAR_3R).gradient(PLANAR_3R, np.stack([GENERIC, np.zeros(3)]))


@MEASURES
def test_too_many_failures(factory):
    """More failures than degrees of redundancy are refused whatever the configuration."""
    with pytest.raises(TooManyFailuresError, match="1 degrees of redundancy"):
        factory(PLANAR_3R, failures=2)
    with pytest.raises(TooManyFailuresError, match="0 degrees of redundancy"):
        factory(PLANAR_3R.task("planar pose"))


@MEASURES
@pytest.mark.parametrize(
    "parameters",
    [{"joints": (0,)}, {"joints": (5,)}, {"joints": ()}, {"failures": 0}, {"joints": (1,), "failures": 2}],
    ids=str,
)
def test_strange_failures(factory, parameters):
    """Joints that are not there, and no failure at all, are refused."""
    with pytest.raises(RangeError):
        factory(PLANAR_4R, **parameters)


def test_multiple_singular_value():
    """Where the worst failure leaves an isotropic Jacobian kfm has no gradient."""
    arm = chain_of_isotropy()
    q = np.array([0.0, 0.7, 0.75 * np.pi])
    with pytest.raises(NotDifferentiableError, match="worst failure"):
        kfm(arm, joints=(1,)).gradient(arm, q)


def chain_of_isotropy():
    """A two-link arm that is isotropic at 135 degrees, on one more link; without that joint it is the two-link arm."""
    from problems.robots.planar import planar_arm

    return planar_arm([1.0, 2**0.5, 1.0])
