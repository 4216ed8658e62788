"""M14 and 5.5 of methods.md."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from problems import robots
from problems.methods import extended_jacobian
from problems.methods.extremum_feedback import METHOD, cast
from problems.robots.planar import PLANAR_3R
from problems.weightings.augmented import AlgorithmicSingularityError
from problems.weightings.extended import extremum
from problems.weightings.impedance import elastic
from sandbox.errors import NonFiniteError, RankDeficientError
from sandbox.law import rates
from sandbox.problem import VelocityProblem
from tests.problems.secondary import COUNT, EACH_ROBOT, F1, NULL, Q0, agrees, at, faulty, found, rest

START = 1e-3
"""h = n'grad g at the start of the motions of 5.5, n the cross product of the rows of J."""

RTOL = 1e-10


@EACH_ROBOT
def test_agrees_with_the_original(name):
    """Framework and [J; H] qdot = [xdot; -kappa h - alpha (N'H')^-1 h] agree off the manifold."""
    agrees(METHOD, name)


def test_is_the_extended_jacobian_on_the_manifold():
    """Where h = 0: nothing to feed back, at any gain."""
    robot = robots.load("panda")
    q, xdot, springs = extended_jacobian.METHOD.draw(robot, np.random.default_rng(1), COUNT)
    one, allowed = found(extended_jacobian.METHOD, robot, q, xdot, **springs)
    two, more = found(METHOD, robot, q, xdot, kappa=2.0, alpha=0.3, **springs)
    assert (np.abs(one - two) <= allowed + more).all()


def h_of(q, home):
    """Condition h = n'(q - home), n the cross product of the rows of J."""
    J = PLANAR_3R.jacobian(q)
    return np.cross(J[..., 0, :], J[..., 1, :]) @ (q - home)


def decay(home, duration, **gains):
    """Ratio h / h(0) after self-motion from START off F1, the hand at rest."""
    off = home - START / 3 * NULL  # n'n = 3
    assert abs(h_of(F1[0], off) - START) < 1e-15

    def law(_, q):
        return rates(METHOD, PLANAR_3R, q[None], np.zeros((1, 2)), rest=off, **gains)[0]

    end = solve_ivp(law, (0, duration), F1[0], method="DOP853", rtol=RTOL, atol=1e-14).y[:, -1]
    return h_of(end, off) / START


@pytest.mark.parametrize("alpha, printed", [(2.0, 1.8e-5), (-2.0, 5e-2)])
def test_rates_of_the_papers_feedback(alpha, printed):
    """F1: h 1e-3 -> 1.8e-5 in 2 s with alpha = 2, -> 5e-2 with alpha = -2, in the gauge of the cross product (5.5).

    There |n|^2 = 3, and W = H'H is three times that of an orthonormal N: the same motion has alpha / 3.
    """
    end = START * decay(Q0, 2.0, kappa=0.0, alpha=alpha / 3)
    assert abs(end / printed - 1) < (0.03 if alpha > 0 else 0.15)
    assert abs(end / (START * np.exp(-2 * alpha)) - 1) < (0.03 if alpha > 0 else 0.15)


def test_sign_rule_of_the_papers_feedback():
    """Gains alpha > 0 attracts to minima and repels from maxima; alpha < 0 the reverse (5.5)."""
    minimum, maximum = Q0, rest(PLANAR_3R, F1, (-2.0, 0.0))[0]
    for alpha, home, attracted in ((0.3, minimum, True), (0.3, maximum, False), (-0.3, minimum, False), (-0.3, maximum, True)):
        assert (abs(decay(home, 1.0, kappa=0.0, alpha=alpha)) < 1) == attracted


@pytest.mark.parametrize("F", [(-1.0, -1.0), (-2.0, 0.0)], ids=["minimum", "maximum"])
def test_uniform_rate(F):
    """Decay hdot = -kappa h at minima and maxima alike: exp(-kappa t), of |h| with an orthonormal N (5.5)."""
    home = rest(PLANAR_3R, F1, F)[0]
    kappa, duration = 1.5, 2.0
    assert abs(decay(home, duration, kappa=kappa) / np.exp(-kappa * duration) - 1) < 10 * START


@EACH_ROBOT
def test_rate_of_h_itself(name):
    """d|h|/dt = -kappa |h| along the drawn motions, by central differences of |N'grad g|."""
    robot = robots.load(name)
    q, xdot, parameters = METHOD.draw(robot, np.random.default_rng(2), COUNT)
    springs = {key: parameters[key] for key in ("stiffness", "rest")}
    qdot = rates(METHOD, robot, q, xdot, kappa=1.5, **springs)
    step = np.finfo(float).eps ** (1 / 3) / np.abs(qdot).max(axis=1, keepdims=True)
    g = elastic(robot, **springs)
    before, after = (np.linalg.norm(extremum(robot, q + s * step * qdot, g).h, axis=1) for s in (-1, 1))
    size = np.linalg.norm(extremum(robot, q, g).h, axis=1)
    rate = (after - before) / (2 * step[:, 0])
    clear = size > 1e-2  # |h| has a kink at zero
    assert clear.mean() > 0.5
    speed = np.abs(qdot).max(axis=1)
    assert (np.abs(rate + 1.5 * size)[clear] <= 1e-6 * (1 + speed[clear]) ** 2).all()


def wrong(robot, q, xdot, *, kappa=1.0, alpha=0.0, **springs):
    return cast(robot, q, xdot, kappa=-kappa, alpha=alpha, **springs)


def negative_alpha(robot, q, xdot, *, kappa=1.0, alpha=0.0, **springs):
    return cast(robot, q, xdot, kappa=kappa, alpha=-alpha, **springs)


def gradient_fed_back(robot, q, xdot, *, kappa=1.0, alpha=0.0, **springs):
    right = cast(robot, q, xdot, kappa=0.0, alpha=alpha + kappa, **springs)
    return VelocityProblem(J=right.J, xdot=right.xdot, W=right.W, a=right.a)


@pytest.mark.parametrize("fault", [wrong, negative_alpha, gradient_fed_back])
def test_fault_in_the_feedback(fault):
    """With the wrong sign of kappa or alpha, or grad g in the place of H'h, framework and original disagree."""
    faulty(METHOD, fault)


def test_refusals():
    """A bifurcation, a singular arm and gains that are not finite: each by its own error."""
    with pytest.raises(AlgorithmicSingularityError):
        cast(PLANAR_3R, F1, at(1, 1), rest=rest(PLANAR_3R, F1, (-1.5, 0.0)))
    with pytest.raises(RankDeficientError):
        cast(PLANAR_3R, np.zeros((1, 3)), at(1, 1))
    for gain in ("kappa", "alpha"):
        with pytest.raises(NonFiniteError, match=gain):
            cast(PLANAR_3R, F1, at(1, 1), rest=Q0, **{gain: np.nan})
