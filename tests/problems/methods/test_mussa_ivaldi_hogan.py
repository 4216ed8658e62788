"""M18: W = C^-1 - Gamma."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from problems import robots
from problems.methods import extended_jacobian
from problems.methods.mussa_ivaldi_hogan import METHOD, cast
from problems.robots.planar import PLANAR_3R
from problems.weightings.extended import extremum
from problems.weightings.hessian import PartialOrientationError
from problems.weightings.impedance import OffEquilibriumError, elastic
from sandbox.closed_form.solve import solve
from sandbox.errors import AsymmetricWeightError, ConditionSevenError, RankDeficientError, WeightNotPositiveDefiniteError
from sandbox.law import rates
from sandbox.problem import VelocityProblem
from sandbox.weight import Weight
from tests.problems.methods.test_extended_jacobian import PARTIAL
from tests.problems.secondary import EACH_ROBOT, F1, NULL, Q0, agrees, answers, at, faulty, rest, rounding

TIGHT = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13}
DRIFT = 1e-12
"""Of one closed square, integrated to rtol 1e-12 (methods.md: 2.7e-14)."""


@EACH_ROBOT
def test_agrees_with_the_original(name):
    """Framework and (C^-1 - Gamma)^-1 J'(J (C^-1 - Gamma)^-1 J')^-1 xdot agree, also after shifts of W."""
    agrees(METHOD, name)


@pytest.mark.parametrize("xdot", [(1.0, 0.0), (0.0, 1.0), (0.3, -0.7)])
def test_f1(xdot):
    """F = (-1, -1), C = I: qdot = (0, -xdot, xdot + ydot)."""
    answers(METHOD, PLANAR_3R, F1, at(*xdot), (0.0, -xdot[0], sum(xdot)), rest=Q0)


def test_weight_at_f1():
    """W = [[-2, -2, -1], [-2, -1, -1], [-1, -1, 0]], indefinite, and n'Wn = 1."""
    W = cast(PLANAR_3R, F1, at(0, 0), rest=Q0).W.dense()[0]
    allowed = rounding(PLANAR_3R, F1, 5.0)[0]
    np.testing.assert_allclose(W, [[-2, -2, -1], [-2, -1, -1], [-1, -1, 0]], rtol=0, atol=allowed)
    np.testing.assert_allclose(np.linalg.eigvalsh(W), (-4.048917, 0.356896, 0.692021), rtol=0, atol=5e-7)
    np.testing.assert_allclose(NULL @ W @ NULL, 1, rtol=0, atol=allowed)


@pytest.mark.parametrize("F", [(-1.0, -1.0), (0.7, 0.2), (-1.5, 0.0), (-2.0, 0.0), (0.0, 3.0)])
def test_curvature_at_f1(F):
    """Curvature n'Wn = 3 + 2 F_x for every force."""
    W = cast(PLANAR_3R, F1, at(0, 0), rest=rest(PLANAR_3R, F1, F)).W.dense()[0]
    assert abs(NULL @ W @ NULL - (3 + 2 * F[0])) <= rounding(PLANAR_3R, F1, 10 * (1 + np.abs(F).max()))[0]


def test_constrained_buckling_is_refused():
    """F = (-1.5, 0): n'Wn = 0 although W, eigenvalues -4.12, .12, 1, is nonsingular."""
    problem = cast(PLANAR_3R, F1, at(1, 1), rest=rest(PLANAR_3R, F1, (-1.5, 0.0)))
    np.testing.assert_allclose(np.linalg.eigvalsh(problem.W.dense()[0]), (-4.12, 0.12, 1), rtol=0, atol=5e-3)
    with pytest.raises(ConditionSevenError):
        solve(problem)


def test_unstable_equilibrium_is_refused():
    """F = (-2, 0): n'Wn = -1, the equilibrium is unstable with the hand held."""
    with pytest.raises(ConditionSevenError, match="maximum"):
        solve(cast(PLANAR_3R, F1, at(1, 1), rest=rest(PLANAR_3R, F1, (-2.0, 0.0))))


def test_is_the_derivative_of_the_equilibrium():
    """(C^-1 - Gamma) qdot = J'Fdot: the balance of C^-1 (q - rest) = J'F, differentiated by differences of J alone."""
    robot = robots.load("planar_4r")
    q, xdot, parameters = METHOD.draw(robot, np.random.default_rng(1), 20)
    K = np.diag(1 / parameters["compliance"])
    F = extremum(robot, q, elastic(robot, K, parameters["rest"])).multipliers
    qdot = rates(METHOD, robot, q, xdot, **parameters)
    step = np.finfo(float).eps ** (1 / 3)
    change = (robot.jacobian(q + step * qdot) - robot.jacobian(q - step * qdot)) / (2 * step)
    J = robot.jacobian(q)
    torque = qdot @ K - np.einsum("bmn,bm->bn", change, F)
    for one, Jt in zip(torque, np.swapaxes(J, 1, 2), strict=True):
        left = one - Jt @ np.linalg.lstsq(Jt, one)[0]
        assert np.abs(left).max() <= 1e-7 * (1 + np.abs(qdot).max())


def test_closed_square_does_not_drift():
    """From F1, side .2: the joints come back."""
    q = F1[0]
    for side in ((-0.2, 0.0), (0.0, 0.2), (0.2, 0.0), (0.0, -0.2)):

        def law(_, q, side=side):
            return rates(METHOD, PLANAR_3R, q[None], np.array([side]), rest=Q0, tolerance=np.inf)[0]

        q = solve_ivp(law, (0, 1), q, **TIGHT).y[:, -1]
    assert np.abs(q - F1[0]).max() < DRIFT


def wrong_gamma(transform):
    """The cast of M18 with Gamma changed."""

    def wrong(robot, q, xdot, *, compliance=1.0, rest=None):
        K = np.diag(1 / np.asarray(compliance))
        Gamma = transform(extremum(robot, q, elastic(robot, K, rest)).T)
        W = K - (Gamma + np.swapaxes(Gamma, 1, 2)) / 2
        return VelocityProblem(J=robot.jacobian(q), xdot=xdot, W=Weight(W))

    return wrong


def swapped(T):
    """Gamma with each row contracted in the place of a column: dJ_kj/dq_i read as dJ_ki/dq_j of reversed joints."""
    return T[:, ::-1, :]


@EACH_ROBOT
@pytest.mark.parametrize("transform", [np.negative, np.zeros_like, swapped], ids=["wrong sign", "left out", "rows reversed"])
def test_fault_in_gamma(transform, name):
    """With Gamma of wrong sign, left out or misplaced, framework and original disagree."""
    faulty(METHOD, wrong_gamma(transform), name)


def test_fault_transposed_gamma():
    """With a part of the angular velocity free Gamma and its transpose give different rates, and neither is symmetric."""
    arm = robots.load("seven_joint", PARTIAL)
    drawn = extended_jacobian.METHOD.draw(arm, np.random.default_rng(3), 20)
    condition = extremum(arm, drawn.q, elastic(arm, **drawn.parameters))
    right = METHOD  # its weight refuses; the exact motion is the extended Jacobian's
    with pytest.raises(PartialOrientationError):
        right.cast(arm, drawn.q, drawn.xdot, compliance=1 / drawn.parameters["stiffness"], rest=drawn.parameters["rest"])
    exact = extended_jacobian.METHOD.witness(arm, drawn.q, drawn.xdot, **drawn.parameters)
    H = np.swapaxes(condition.N, 1, 2) @ (condition.hessian - np.swapaxes(condition.T, 1, 2))
    A = np.concatenate([condition.J, H], axis=1)
    transposed = np.linalg.solve(A, np.concatenate([drawn.xdot, np.zeros((20, arm.k))], axis=1)[:, :, None])[:, :, 0]
    assert np.median(np.linalg.norm(transposed - exact, axis=1) / np.linalg.norm(exact, axis=1)) > 1e-2
    with pytest.raises(AsymmetricWeightError):
        Weight(condition.hessian - np.swapaxes(condition.T, 1, 2))


def test_refuses_off_equilibrium():
    """No force balances the springs: the configuration, the share and the way out are named."""
    q = np.vstack([F1, [[0.2, 1.1, -0.6]]])
    with pytest.raises(OffEquilibriumError, match=r"configuration 1 of planar_3r.*for any force F") as refusal:
        cast(PLANAR_3R, q, np.ones((2, 2)), rest=Q0)
    assert refusal.value.evidence["residual"] > 1e-6


@pytest.mark.parametrize("part, refused", [(5e-7, False), (2e-6, True)])
def test_residual_of_1e_6_is_the_border(part, refused):
    """|C^-1 (q - rest) - J'F| above 1e-6 of |C^-1 (q - rest)| is off equilibrium."""
    pull = F1[0] - Q0
    home = Q0 + part * np.linalg.norm(pull) * NULL / np.linalg.norm(NULL)
    if refused:
        with pytest.raises(OffEquilibriumError):
            cast(PLANAR_3R, F1, at(1, 1), rest=home)
    else:
        cast(PLANAR_3R, F1, at(1, 1), rest=home)


@pytest.mark.parametrize("compliance", [np.array([1.0, -1, 1]), np.zeros((3, 3)), 0.0, np.diag([1.0, 1, -1e-3])])
def test_refuses_a_compliance_that_is_not_positive_definite(compliance):
    """C must be positive definite."""
    with pytest.raises(WeightNotPositiveDefiniteError, match="compliance is not positive definite"):
        cast(PLANAR_3R, F1, at(1, 1), compliance=compliance, rest=Q0)


def test_refuses_an_asymmetric_compliance_and_a_singular_arm():
    """C must be symmetric, J of full rank."""
    with pytest.raises(AsymmetricWeightError):
        cast(PLANAR_3R, F1, at(1, 1), compliance=np.eye(3) + np.eye(3, k=1) / 4, rest=Q0)
    with pytest.raises(RankDeficientError):
        cast(PLANAR_3R, np.zeros((1, 3)), at(1, 1))
