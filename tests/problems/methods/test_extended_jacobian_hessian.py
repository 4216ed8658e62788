"""M13: W = Hess L."""

from __future__ import annotations

import numpy as np
import pytest

from problems import robots
from problems.measures.measure import Measure, NotTwiceDifferentiableError
from problems.methods import extended_jacobian
from problems.methods.extended_jacobian_hessian import METHOD, cast, cast_function
from problems.robots.planar import PLANAR_3R, PLANAR_4R
from problems.weightings.extended import OffManifoldError, extremum
from problems.weightings.hessian import PartialOrientationError
from problems.weightings.impedance import elastic
from sandbox.closed_form.solve import solve
from sandbox.errors import ConditionSevenError, RankDeficientError
from sandbox.problem import VelocityProblem
from sandbox.weight import Weight
from tests.problems.methods.test_extended_jacobian import PARTIAL, manipulability
from tests.problems.secondary import COUNT, EACH_ROBOT, F1, NULL, Q0, agrees, answers, at, faulty, found, rest, rounding


@EACH_ROBOT
def test_agrees_with_the_original(name):
    """Framework and the differentiated optimality conditions agree, also after shifts of W."""
    agrees(METHOD, name)


def test_four_degrees_of_redundancy():
    """The seven-joint arm asked for its position alone."""
    agrees(METHOD, "seven_joint", task="position")


def test_elastic_energy_at_f1():
    """E1: qdot = (0, -xdot, xdot + ydot)."""
    answers(METHOD, PLANAR_3R, F1, at(0.3, -0.7), (0.0, -0.3, -0.4), rest=Q0)


def test_manipulability_at_f1():
    """E2: W = Hess w is indefinite, n'Wn = 5/sqrt 3 > 0, and the rates are those of the extended Jacobian."""
    xdot = np.array([[0.3, -0.7], [-1.0, 2.0]])
    problem = cast_function(PLANAR_3R, np.repeat(F1, 2, axis=0), xdot, function=manipulability())
    W = problem.W.dense()[0]
    allowed = rounding(PLANAR_3R, F1, 10.0)[0]
    np.testing.assert_allclose(W * np.sqrt(3), [[0, 0, 0], [0, 1, 2], [0, 2, 0]], rtol=0, atol=allowed)
    np.testing.assert_allclose(np.linalg.eigvalsh(W), (-0.9016, 0, 1.4789), rtol=0, atol=5e-5)
    np.testing.assert_allclose(NULL @ W @ NULL, 5 / np.sqrt(3), rtol=0, atol=allowed)
    x, y = xdot[0]
    expected = [(-0.2 * x + 0.4 * y, -0.8 * x - 0.4 * y, 1.2 * x + 0.6 * y), (1, 0, 0)]
    np.testing.assert_allclose(solve(problem).x, expected, rtol=0, atol=allowed)


@EACH_ROBOT
def test_weights_are_often_indefinite(name):
    """A good part of the drawn minima have an indefinite W, and condition (7) holds in all of them."""
    robot = robots.load(name)
    drawn = METHOD.draw(robot, np.random.default_rng(1), COUNT)
    lowest = np.linalg.eigvalsh(cast(robot, drawn.q, drawn.xdot, **drawn.parameters).W.dense())[:, 0]
    assert 0.1 < (lowest < 0).mean() < 0.9


def test_maxima_are_followed_with_the_negative_hessian():
    """F1 under F = (-2, 0) is a maximum: Hess L is refused, -Hess L gives what the extended Jacobian gives."""
    home = rest(PLANAR_3R, F1, (-2.0, 0.0))
    with pytest.raises(ConditionSevenError, match="maximum"):
        solve(cast(PLANAR_3R, F1, at(0.3, -0.7), rest=home))
    one, allowed = found(METHOD, PLANAR_3R, F1, at(0.3, -0.7), rest=home, maximum=True)
    two, more = found(extended_jacobian.METHOD, PLANAR_3R, F1, at(0.3, -0.7), rest=home)
    assert (np.abs(one - two) <= allowed + more).all()
    assert (np.abs(one - METHOD.witness(PLANAR_3R, F1, at(0.3, -0.7), rest=home, maximum=True)) <= allowed).all()


@pytest.mark.parametrize("maximum", [False, True])
def test_saddles_are_refused_either_way(maximum):
    """A saddle on the self-motion fails condition (7) with both signs."""
    drawn = extended_jacobian.METHOD.draw(PLANAR_4R, np.random.default_rng(9), COUNT)
    condition = extremum(PLANAR_4R, drawn.q, elastic(PLANAR_4R, **drawn.parameters))
    reduced = np.linalg.eigvalsh(condition.H @ condition.N)
    i = int(np.flatnonzero((reduced[:, 0] < -0.1) & (reduced[:, 1] > 0.1))[0])
    springs = {"stiffness": drawn.parameters["stiffness"], "rest": drawn.parameters["rest"][i]}
    with pytest.raises(ConditionSevenError, match="saddle"):
        solve(cast(PLANAR_4R, drawn.q[[i]], drawn.xdot[[i]], maximum=maximum, **springs))


def wrong_sign(robot, q, xdot, *, stiffness=1.0, rest=None):
    condition = extremum(robot, q, elastic(robot, stiffness, rest))
    T = (condition.T + np.swapaxes(condition.T, 1, 2)) / 2
    return VelocityProblem(J=condition.J, xdot=xdot, W=Weight(condition.hessian + T))


@EACH_ROBOT
def test_fault_wrong_sign_of_t(name):
    """With Hess g + T framework and original disagree."""
    faulty(METHOD, wrong_sign, name)


def symmetrised(robot, q, xdot, *, stiffness=1.0, rest=None):
    condition = extremum(robot, q, elastic(robot, stiffness, rest))
    T = (condition.T + np.swapaxes(condition.T, 1, 2)) / 2
    return VelocityProblem(J=condition.J, xdot=xdot, W=Weight(condition.hessian - T))


def test_fault_symmetrised_t_with_partial_orientation():
    """Where a part of the angular velocity is free, Hess g - (T + T')/2 is wrong: what the refusal protects from."""
    arm = robots.load("seven_joint", PARTIAL)
    drawn = extended_jacobian.METHOD.draw(arm, np.random.default_rng(2), COUNT)
    solution = solve(symmetrised(arm, drawn.q, drawn.xdot, **drawn.parameters), on_refusal="status")
    held = np.isfinite(solution.x).all(axis=1)
    right = METHOD.witness(arm, drawn.q, drawn.xdot, **drawn.parameters)[held]
    cost = np.linalg.norm(solution.x[held] - right, axis=1) / np.linalg.norm(right, axis=1)
    assert held.any() and np.median(cost) > 1e-2


def test_refuses_partial_orientation():
    """Refused by name, and the extended Jacobian is named as the way out."""
    arm = robots.load("seven_joint", PARTIAL)
    drawn = extended_jacobian.METHOD.draw(arm, np.random.default_rng(2), 3)
    with pytest.raises(PartialOrientationError, match=r"rows \(0, 1, 2, 3, 4\).*extended_jacobian"):
        cast(arm, drawn.q, drawn.xdot, **drawn.parameters)


def test_refuses_off_the_manifold_without_hessian_and_singular():
    """Each by its own error."""
    with pytest.raises(OffManifoldError):
        cast(PLANAR_3R, np.array([[0.2, 1.1, -0.6]]), at(1, 1), rest=Q0)
    w = manipulability()
    rough = Measure("rough", w.unit, w.about, w.source, w.domain, w.value, w.gradient)
    with pytest.raises(NotTwiceDifferentiableError):
        cast_function(PLANAR_3R, F1, at(1, 1), function=rough)
    with pytest.raises(RankDeficientError):
        cast(PLANAR_3R, np.zeros((1, 3)), at(1, 1))
