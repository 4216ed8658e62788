"""Every measure against its value written out in numpy, its gradient by complex step or differences, on five robots."""

from __future__ import annotations

import numpy as np
import pytest

from problems.measures import MEASURES, load
from problems.measures import manipulability as manipulability_module
from problems.measures.measure import NotTwiceDifferentiableError
from problems.methods.draw import generic
from problems.robots import load as robot_named
from sandbox.errors import ShapeError, UnknownNameError
from sandbox.tolerances import GRADIENT_STEP
from tests.problems.measures import chain

ROBOTS = {name: robot_named(name) for name in ("planar_3r", "planar_4r", "seven_joint", "panda")} | {"mixed": chain.MIXED}
COMPLEX_STEP = 1e-12  # of the gradient's size, times what J is conditioned by (methods I28)
DIFFERENCE = 1e-8  # fourth-order differences: h^4 truncated (methods I28)
SPREAD = 400.0  # worst condition of a generic J, squared: values from det JJ' lose it


def configurations(robot, count=4):
    """Generic ones, away from ties of any minimum."""

    def accept(q):
        clear = []
        for one in q:
            J = chain.Chain(robot, one).J
            sigma = np.linalg.svd(J, compute_uv=False)
            rho, left = np.sort(chain.relative(J, chain.failing(robot))), np.sort(chain.left(J, chain.failing(robot)))
            gaps = [sigma[-2] - sigma[-1], rho[1] - rho[0], left[1] - left[0], rho[0]]
            clear.append(min(gaps) > 0.02)
        return np.array(clear)

    return generic(robot, np.random.default_rng(3), count, accept).q


CONFIGURATIONS = {name: configurations(robot) for name, robot in ROBOTS.items()}
each_robot = pytest.mark.parametrize("robot", ROBOTS.values(), ids=ROBOTS)
each_measure = pytest.mark.parametrize("name", MEASURES)


def measure(name, robot):
    return load(name, robot, **chain.PARAMETERS.get(name, lambda r: {})(robot))


def check_gradient(name, robot, gradient):
    """`gradient` (B, n) is that of the value written out here, at every configuration."""
    for q, slope in zip(CONFIGURATIONS[robot.name], gradient, strict=True):
        if name in chain.ANALYTIC:
            other, allowed = chain.complex_step(lambda x: chain.ANALYTIC[name](robot, x), q), COMPLEX_STEP * SPREAD
        else:
            other, allowed = chain.difference(lambda x: chain.REAL[name](robot, x), q, GRADIENT_STEP), DIFFERENCE * 20
        np.testing.assert_allclose(slope, other, rtol=0, atol=allowed * np.abs(other).max())


def test_every_measure_is_written_out():
    """The table, and the values here that it is held against, name the same measures."""
    assert set(MEASURES) == set(chain.ANALYTIC) | set(chain.REAL)


@each_measure
@each_robot
def test_value(name, robot):
    """The value is that of the formula, written out from the robot's own numbers."""
    q = CONFIGURATIONS[robot.name]
    formula = {**chain.ANALYTIC, **chain.REAL}[name]
    np.testing.assert_allclose(measure(name, robot).value(robot, q), [formula(robot, x) for x in q], rtol=COMPLEX_STEP * SPREAD)


@each_measure
@each_robot
def test_gradient(name, robot):
    """The gradient is that of the value, by complex step or fourth-order differences of the formula written out here."""
    check_gradient(name, robot, measure(name, robot).gradient(robot, CONFIGURATIONS[robot.name]))


@pytest.mark.parametrize("name", MEASURES)
@pytest.mark.parametrize("robot", [ROBOTS["planar_3r"], ROBOTS["panda"]], ids=lambda r: r.name)
def test_hessian(name, robot):
    """Where there is a Hessian it is symmetric and the derivative of the gradient; where there is none it is refused."""
    f, q = measure(name, robot), CONFIGURATIONS[robot.name][0]
    if f.hessian is None:
        with pytest.raises(NotTwiceDifferentiableError, match=name):
            f.curvature(robot, q)
        return
    hessian = f.curvature(robot, q)
    size = np.abs(hessian).max()
    np.testing.assert_allclose(hessian, hessian.T, rtol=0, atol=COMPLEX_STEP * SPREAD * size)
    slopes = chain.difference(lambda x: f.gradient(robot, x), q, GRADIENT_STEP)
    np.testing.assert_allclose(hessian, slopes, rtol=0, atol=20 * DIFFERENCE * size)


@pytest.mark.parametrize("name", ["manipulability", "swing_acceleration", "least_relative_manipulability"])
def test_check_can_fail(name):
    """A gradient of the other sign, and one without its largest entry, fail the check that the right one passes."""
    robot = ROBOTS["panda"]
    right = measure(name, robot).gradient(robot, CONFIGURATIONS["panda"])
    check_gradient(name, robot, right)
    for wrong in (-right, np.where(np.abs(right) < np.abs(right).max(axis=-1, keepdims=True), right, 0)):
        with pytest.raises(AssertionError):
            check_gradient(name, robot, wrong)


def test_a_measure_without_its_factor_fails(monkeypatch):
    """Taking ln w in the place of w, the factor w of its gradient forgotten, fails the check."""
    monkeypatch.setattr(manipulability_module, "_volume", manipulability_module._log_volume)
    robot = ROBOTS["planar_3r"]
    with pytest.raises(AssertionError):
        check_gradient("manipulability", robot, measure("manipulability", robot).gradient(robot, CONFIGURATIONS["planar_3r"]))


@each_measure
def test_stacks(name):
    """A stack of stacks gives what its members give, one by one."""
    robot = ROBOTS["planar_4r"]
    q, f = CONFIGURATIONS["planar_4r"], measure(name, robot)
    stack = np.stack([q, q[::-1]])
    for function in (f.value, f.gradient):
        together = function(robot, stack)
        assert together.shape[:2] == stack.shape[:2]
        np.testing.assert_allclose(together[0], [function(robot, x) for x in q], rtol=COMPLEX_STEP)


@each_measure
def test_words(name):
    """Table and measure say the same: name, unit, what, source and domain, none of them empty."""
    row, f = MEASURES[name], measure(name, ROBOTS["planar_3r"])
    assert row[:5] == (f.name, f.unit, f.about, f.source, f.domain)
    assert all(row[:5])


@each_measure
def test_wrong_shape(name):
    """Configurations of another robot are refused by their shape."""
    robot = ROBOTS["planar_3r"]
    f = measure(name, robot)
    for function in (f.value, f.gradient):
        with pytest.raises(ShapeError):
            function(robot, np.zeros(4))


def test_unknown_name():
    """A name that is no measure's is refused with those that are."""
    with pytest.raises(UnknownNameError, match="manipulability"):
        load("dexterity", ROBOTS["planar_3r"])
