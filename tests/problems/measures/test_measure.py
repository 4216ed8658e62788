"""Measures from expressions: compiled when asked for, once; parameters per configuration; the user's own errors."""

from __future__ import annotations

from inspect import signature

import casadi as ca
import numpy as np
import pytest

from problems.measures import MEASURES, load
from problems.measures import measure as module
from problems.measures.measure import symbolic
from problems.measures.posture import posture
from problems.robots.planar import PLANAR_3R
from sandbox.errors import NonFiniteError, RangeError, ShapeError, UnknownNameError


def test_compiled_when_asked_for(monkeypatch):
    """Value and gradient do not wait for the Hessian to be compiled."""

    def never(*arguments):
        raise AssertionError("a Hessian was made")

    monkeypatch.setattr(ca, "hessian", never)
    f = symbolic("f", "1", "sine", "here", lambda twin: ca.sin(twin.q[0]))
    q = np.full(3, 0.5)
    assert f.value(PLANAR_3R, q) == np.sin(0.5)
    np.testing.assert_allclose(f.gradient(PLANAR_3R, q), [np.cos(0.5), 0, 0], rtol=1e-15)
    with pytest.raises(AssertionError, match="a Hessian"):
        f.curvature(PLANAR_3R, q)


def test_compiled_once():
    """The same expression with other parameters is not compiled again."""
    module.compiled.cache_clear()
    for target in (np.zeros(3), np.ones(3)):
        posture(target).gradient(PLANAR_3R, np.zeros((2, 3)))
    assert module.compiled.cache_info().misses == 1


def test_parameter_for_each_configuration():
    """A target for each configuration is used with its own."""
    q, targets = np.arange(6.0).reshape(2, 3), np.ones((2, 3)) * [[1.0], [2.0]]
    np.testing.assert_array_equal(posture(targets).gradient(PLANAR_3R, q), q - targets)
    np.testing.assert_array_equal(posture(targets).value(PLANAR_3R, q), [(1 + 0 + 1) / 2, (1 + 4 + 9) / 2])


@pytest.mark.parametrize("lead", [(3,), (2, 2)], ids=str)
def test_parameters_that_do_not_go_with_q(lead):
    """Parameters for more configurations than there are, or for others, are refused by their axes."""
    with pytest.raises(ShapeError, match="posture"):
        posture(np.zeros((*lead, 3))).value(PLANAR_3R, np.zeros((2, 3)))


def test_non_finite_parameter():
    """A target that is not finite is refused where it is given."""
    with pytest.raises(NonFiniteError, match="posture"):
        posture([0.0, np.nan, 0.0])


def test_measures_by_name():
    """Each row of the table makes its measure by name; the posture left out is zero, and one given is used."""
    q = np.array([0.3, 1.1, -0.7])
    for name, row in MEASURES.items():
        given = {"obstacle": np.array([0.5, 0.0, 0.0]), "reach": 1.0} if "obstacle" in signature(row.factory).parameters else {}
        assert np.isfinite(load(name, PLANAR_3R, **given).value(PLANAR_3R, q)), name
        assert row.name == name
    assert load("posture", PLANAR_3R).value(PLANAR_3R, q) == pytest.approx(q @ q / 2)
    assert load("posture", PLANAR_3R, target=q - 1).value(PLANAR_3R, q) == pytest.approx(1.5)


@pytest.mark.parametrize("name, parameter", [("posture", "targets"), ("manipulability", "target"), ("kfm", "fails")])
def test_unknown_parameter(name, parameter):
    """A parameter that the measure does not take is refused with those it does, or none."""
    known = "target" if name == "posture" else "none" if name == "manipulability" else "failures"
    with pytest.raises(UnknownNameError, match=rf"no parameter of {name} is called '{parameter}'; there are: .*{known}"):
        load(name, PLANAR_3R, **{parameter: 1})


def test_measure_that_needs_more():
    """The obstacle potential without an obstacle is refused by what it lacks."""
    with pytest.raises(RangeError, match="obstacle_potential is no measure without obstacle and reach"):
        load("obstacle_potential", PLANAR_3R)


def test_parameters_are_vectors():
    """A parameter that is one number says nothing of which joint it is for: refused, the posture by its name."""
    with pytest.raises(ShapeError, match="parameter of f is one number"):
        symbolic("f", "1", "sine", "here", lambda twin, p: p * twin.q[0], parameters=(0.5,))
    with pytest.raises(ShapeError, match="posture"):
        posture(0.5)
