"""M2: Whitney's weighted pseudoinverse."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from problems.methods.weighted_pseudoinverse import METHOD
from problems.robots.planar import PLANAR_3R
from problems.sets import textbook
from sandbox.closed_form.solve import solve
from sandbox.errors import RankDeficientError, WeightNotPositiveDefiniteError
from sandbox.law import rates
from sandbox.problem import VelocityProblem
from sandbox.tolerances import UNIT
from tests.problems.methods.agreeing import agrees

F1 = np.array(textbook.F1.q)[None]
G = np.array([[1 / 6, 1 / 2], [-7 / 6, -1 / 2], [5 / 6, 1 / 2]])
S = np.array([[29 / 6, 5 / 2], [5 / 2, 3 / 2]])
ROUNDING = 256 * UNIT  # of numbers below 10 through matrices of condition below 50
ROBOTS = ("planar_3r", "planar_4r", "seven_joint", "panda")


def test_f1():
    """F1 with W = diag(1, 2, 3): G and S = (J W^-1 J')^-1 are the published fractions, and y = -S xdot."""
    for i, xdot in enumerate(np.eye(2)):
        for law in (METHOD.original, lambda *x, **p: rates(METHOD, *x, **p)):
            np.testing.assert_allclose(law(PLANAR_3R, F1, xdot[None], weight=[1, 2, 3])[0], G[:, i], atol=ROUNDING)
        solution = solve(METHOD.cast(PLANAR_3R, F1, xdot[None], weight=[1, 2, 3]))
        np.testing.assert_allclose(solution.y[0], -S[:, i], atol=ROUNDING)


@pytest.mark.parametrize("robot", ROBOTS)
def test_agrees_with_its_original(robot):
    """Eq. (6) and the pseudoinverse in scaled joints agree within their bounds, also where shifts make W indefinite."""
    assert agrees(METHOD, robot)


def test_scaled_joints():
    """In joints p = L'q the weighted answer is the plain pseudoinverse (I9): J -> J L^-T, W -> I."""
    drawn = METHOD.draw(PLANAR_3R, np.random.default_rng(7), 50)
    L = np.linalg.cholesky(drawn.parameters["weight"])
    back = np.swapaxes(np.linalg.inv(L), 1, 2)
    J = PLANAR_3R.jacobian(drawn.q)
    scaled = solve(VelocityProblem(J=J @ back, xdot=drawn.xdot, W=np.eye(3))).x
    expected = np.einsum("bij,bj->bi", back, scaled)
    bound = ROUNDING * np.linalg.cond(J @ back) * np.linalg.cond(L) * np.abs(expected).max(axis=-1)
    difference = np.abs(rates(METHOD, PLANAR_3R, drawn.q, drawn.xdot, **drawn.parameters) - expected).max(axis=-1)
    assert (difference <= bound).all()


def test_an_indefinite_weight_is_refused_here_alone():
    """diag(-1, 1, 1) at F1 is refused by this method, although eq. (6) answers it, with (1, -2, 1)."""
    W = np.diag([-1.0, 1, 1])
    with pytest.raises(WeightNotPositiveDefiniteError):
        METHOD.cast(PLANAR_3R, F1, np.ones((1, 2)), weight=W)
    posed = VelocityProblem(J=PLANAR_3R.jacobian(F1), xdot=np.ones((1, 2)), W=W)
    np.testing.assert_allclose(solve(posed).x[0], [1, -2, 1], atol=ROUNDING)


def test_a_singular_configuration_is_refused():
    """The weight is always definite; what can fail is the rank of J, as on the arm stretched out."""
    with pytest.raises(RankDeficientError):
        rates(METHOD, PLANAR_3R, np.zeros((1, 3)), np.ones((1, 2)))


def inverse_weight(robot, q, xdot, *, weight):
    return METHOD.cast(robot, q, xdot, weight=(A := np.linalg.inv(weight)) + np.swapaxes(A, 1, 2))


def unweighted(robot, q, xdot, *, weight):
    return METHOD.cast(robot, q, xdot, weight=np.ones(robot.n))


def diagonal_only(robot, q, xdot, *, weight):
    return METHOD.cast(robot, q, xdot, weight=weight * np.eye(robot.n))


@pytest.mark.parametrize("cast", [inverse_weight, unweighted, diagonal_only])
@pytest.mark.parametrize("robot", ["planar_3r", "panda"])
def test_a_wrong_weight_disagrees(robot, cast):
    """W^-1 for W, no weight, or its diagonal alone does not agree with the original."""
    assert not agrees(replace(METHOD, cast=cast), robot, 20)


def test_unscaled_joints_disagree():
    """An original that forgets to scale back, (J L^-T)^+ xdot, does not agree with the framework."""

    def forgetful(robot, q, xdot, *, weight):
        back = np.swapaxes(np.linalg.inv(np.linalg.cholesky(weight)), 1, 2)
        return np.einsum("bnm,bm->bn", np.linalg.pinv(robot.jacobian(q) @ back), xdot)

    assert not agrees(replace(METHOD, original=forgetful), "planar_3r", 20)
