"""M19: a positive definite base under the secondary task."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest

from problems import robots
from problems.methods import augmented_jacobian, damped_secondary, extended_jacobian
from problems.methods.damped_secondary import METHOD, cast
from problems.methods.draw import generic
from problems.robots.planar import PLANAR_3R, PLANAR_4R
from problems.weightings.damped import damped
from sandbox.closed_form.solve import solve
from sandbox.errors import (
    AsymmetricWeightError,
    ConditionSevenError,
    NonFiniteError,
    RangeError,
    ShapeError,
    UnknownNameError,
    WeightNotPositiveDefiniteError,
)
from sandbox.law import rates
from sandbox.problem import VelocityProblem
from tests.problems.secondary import (
    COUNT,
    EACH_ROBOT,
    F1,
    F2,
    NULL,
    Q0,
    agrees,
    answers,
    at,
    faulty,
    found,
    generic_3r,
    rest,
    rounding,
)

XDOT = at(0.3, -0.7)
SUM = np.ones((1, 3))
BASE = 0.01 * np.array([1.0, 2.0, 3.0])


@EACH_ROBOT
def test_agrees_with_the_original(name):
    """Framework and one least-squares problem in the self-motion agree, also after shifts of W."""
    agrees(METHOD, name)


@EACH_ROBOT
@pytest.mark.parametrize("off", [0.0, 0.3])
def test_extended_rows_agree_with_the_original(name, off):
    """W~ + H'H, on the extremal manifold and off it."""
    robot = robots.load(name)
    rng = np.random.default_rng(1)
    q, xdot, springs = extended_jacobian.situations(robot, rng, COUNT, extended_jacobian.transversal, off=off)
    parameters = {"secondary": "extended", "base": 0.02, **springs}
    x, allowed = found(METHOD, robot, q, xdot, **parameters)
    assert (np.abs(x - METHOD.witness(robot, q, xdot, **parameters)) <= allowed).all()


def test_f1():
    """W~ = .01 diag(1, 2, 3), e = (1, 1, 1), gbar = .9: printed rates and secondary error."""
    parameters = {"base": BASE, "E": SUM, "gbar": np.array([0.9])}
    printed = (-1.526415094340, 1.226415094340, 1.126415094340)
    answers(METHOD, PLANAR_3R, F1, XDOT, printed, digits=12, **parameters)
    assert abs(rates(METHOD, PLANAR_3R, F1, XDOT, **parameters).sum() - 0.9 - -0.073584905660) < 5e-13


def test_closed_form_of_one_degree_of_redundancy():
    """Rates qdot = q_p + n y, y = (e'n gam (gbar - e'q_p) - n'W~q_p) / (gam (e'n)^2 + n'W~n)."""
    q, xdot = generic_3r()
    e, gamma, gbar = np.array([0.4, -1.0, 2.0]), 0.7, 0.9
    J = PLANAR_3R.jacobian(q)
    n, particular = np.cross(J[:, 0], J[:, 1]), np.einsum("bnm,bm->bn", np.linalg.pinv(J), xdot)
    y = (n @ e * gamma * (gbar - particular @ e) - (n * particular) @ BASE) / (gamma * (n @ e) ** 2 + n**2 @ BASE)
    parameters = {"base": BASE, "E": e[None], "gbar": np.array([gbar]), "gamma": np.array([gamma])}
    x, allowed = found(METHOD, PLANAR_3R, q, xdot, **parameters)
    assert (np.abs(x - (particular + n * y[:, None])) <= allowed).all()


def test_algorithmic_singularity_is_harmless():
    """The row e = (1, 1, 0) at F1 moves nothing: what is left is J^+ xdot; without a base eq. (6) refuses."""
    E = np.array([[1.0, 1.0, 0.0]])
    assert E[0] @ NULL == 0
    expected = np.linalg.pinv(PLANAR_3R.jacobian(F1)[0]) @ XDOT[0]
    answers(METHOD, PLANAR_3R, F1, XDOT, expected, base=0.01, E=E, gbar=np.array([0.9]))
    undamped = VelocityProblem(J=PLANAR_3R.jacobian(F1), xdot=XDOT, W=augmented_jacobian.augmented(E[None]))
    with pytest.raises(ConditionSevenError):
        solve(undamped)


def test_bifurcation_is_harmless():
    """At F1 under F = (-1.5, 0) the extended Jacobian has no answer, its damped form has one."""
    home = rest(PLANAR_3R, F1, (-1.5, 0.0))
    x, _ = found(METHOD, PLANAR_3R, F1, XDOT, secondary="extended", base=0.01, rest=home)
    np.testing.assert_allclose(PLANAR_3R.jacobian(F1)[0] @ x[0], XDOT[0], rtol=0, atol=rounding(PLANAR_3R, F1, 3.0)[0])


def test_task_stays_exact():
    """The secondary task is damped, J qdot = xdot is not (I1)."""
    q, xdot = generic_3r()
    x, _ = found(METHOD, PLANAR_3R, q, xdot, base=5.0, gbar=np.array([0.9]))
    left = np.abs(np.einsum("bmn,bn->bm", PLANAR_3R.jacobian(q), x) - xdot).max(axis=1)
    assert (left <= rounding(PLANAR_3R, q, 3 * np.abs(x).max(axis=1))).all()


def test_condition_seven_always_holds():
    """With a base N'WN is positive definite for any E, gamma > 0, also fewer or more rows than k, or none that act."""
    q, xdot, _ = generic(PLANAR_4R, np.random.default_rng(2), 20)
    for E in (np.ones((1, 4)), np.zeros((2, 4)), np.random.default_rng(3).standard_normal((3, 4))):
        assert np.isfinite(solve(cast(PLANAR_4R, q, xdot, E=E, base=1e-3)).x).all()


def test_gamma_matters():
    """Damping destroys gamma-invariance: F1 with gam 1 and 10."""
    one, two = (rates(METHOD, PLANAR_3R, F1, XDOT, base=BASE, gbar=np.array([0.9]), gamma=np.array([g])) for g in (1.0, 10.0))
    assert np.abs(one - two).max() > 0.05


def test_scaling_of_the_null_vector_matters():
    """W~ + c^2 H'H depends on c: damping destroys the invariance of the extended Jacobian."""
    condition = extended_jacobian.extremum(PLANAR_3R, F1, extended_jacobian.elastic(PLANAR_3R, 1.0, Q0))
    one, two = (
        solve(VelocityProblem(J=condition.J, xdot=XDOT, W=damped(augmented_jacobian.augmented(c * condition.H), 0.1))).x
        for c in (1.0, np.sqrt(3.0))
    )
    assert np.abs(one - two).max() > 0.01


def test_error_of_damping_is_proportional_to_it():
    """W~ = eps I: the distance from the undamped rates falls tenfold per decade of eps (I24)."""
    q, xdot = generic_3r(5)
    keep = augmented_jacobian.clear(PLANAR_3R, q, SUM)[0] > 0.1
    q, xdot, asked = q[keep], xdot[keep], {"E": SUM, "gbar": np.array([0.9])}
    exact = rates(augmented_jacobian.METHOD, PLANAR_3R, q, xdot, **asked)
    errors = [np.abs(rates(METHOD, PLANAR_3R, q, xdot, base=eps, **asked) - exact).max(axis=1) for eps in (1e-5, 1e-6, 1e-7)]
    for coarse, fine in pairwise(errors):
        np.testing.assert_allclose(fine / coarse, 0.1, rtol=0.01)


def test_error_of_a_penalty_is_inversely_proportional_to_it():
    """W = I + c E'E, a = -c E'gbar: the distance from the augmented Jacobian falls tenfold per decade of c (I24)."""
    q, xdot = generic_3r(5)
    asked = {"E": SUM, "gbar": np.array([0.9])}
    keep = augmented_jacobian.clear(PLANAR_3R, q, SUM)[0] > 0.1
    q, xdot = q[keep], xdot[keep]
    exact = rates(augmented_jacobian.METHOD, PLANAR_3R, q, xdot, **asked)
    errors = [
        np.abs(rates(METHOD, PLANAR_3R, q, xdot, base=1.0, gamma=np.array([c]), **asked) - exact).max(axis=1)
        for c in (1e5, 1e6, 1e7)
    ]
    for coarse, fine in pairwise(errors):
        np.testing.assert_allclose(fine / coarse, 0.1, rtol=0.01)


def test_printed_rates_are_the_exact_ones():
    """The closed form over the rationals gives the printed decimals."""
    b, x, y = Fraction(9, 10), Fraction(3, 10), Fraction(-7, 10)
    particular = [y / 3, -x - y / 3, x + 2 * y / 3]
    W = [Fraction(i, 100) for i in (1, 2, 3)]
    top = (b - sum(particular)) - sum(w * n * p for w, n, p in zip(W, (-1, 1, 1), particular, strict=True))
    step = top / (1 + sum(W))
    exact = [float(p + n * step) for p, n in zip(particular, (-1, 1, 1), strict=True)]
    answers(METHOD, PLANAR_3R, F1, XDOT, exact, base=BASE, E=SUM, gbar=np.array([0.9]))


def undamped(robot, q, xdot, *, base=0.01, **asked):
    return augmented_jacobian.cast(robot, q, xdot, **asked)


def whole_system_damped(robot, q, xdot, *, base=0.01, **asked):
    right = cast(robot, q, xdot, base=base, **asked)
    return VelocityProblem(J=right.J, xdot=0.99 * right.xdot, W=right.W, a=right.a)


@pytest.mark.parametrize("fault", [undamped, whole_system_damped])
def test_fault_in_the_damping(fault):
    """Without the base, or with the task damped too, framework and original disagree."""
    faulty(METHOD, fault)


def test_fault_wrong_sign_of_alpha(monkeypatch):
    """With a = +E' Gamma gbar they disagree."""
    right = damped_secondary.secondary_rate
    monkeypatch.setattr(damped_secondary, "secondary_rate", lambda *given: -right(*given))
    faulty(METHOD, cast)


@pytest.mark.parametrize("base", [0.0, -1.0, np.array([1.0, 0, 1]), np.diag([1.0, 1, -1e-9]), np.ones((3, 3))])
@pytest.mark.parametrize("secondary", ["augmented", "extended"])
def test_refuses_a_base_that_is_not_positive_definite(base, secondary):
    """W~ must be positive definite."""
    with pytest.raises(WeightNotPositiveDefiniteError, match="base is not positive definite"):
        cast(PLANAR_3R, F1, XDOT, secondary=secondary, base=base)


def test_other_refusals():
    """An asymmetric or misshapen base, gamma <= 0, another kind of secondary task, NaN: each by its own error."""
    with pytest.raises(AsymmetricWeightError, match="base"):
        cast(PLANAR_3R, F1, XDOT, base=np.eye(3) + np.eye(3, k=1) / 4)
    with pytest.raises(ShapeError, match="base"):
        cast(PLANAR_3R, F1, XDOT, base=np.ones(4))
    with pytest.raises(NonFiniteError, match="base"):
        cast(PLANAR_3R, F1, XDOT, base=np.nan)
    with pytest.raises(RangeError, match="gamma"):
        cast(PLANAR_4R, F2, at(1, 1), gamma=np.array([1.0, 0.0]))
    with pytest.raises(UnknownNameError, match="there are: augmented, extended"):
        cast(PLANAR_3R, F1, XDOT, secondary="task priority")


@pytest.mark.parametrize("secondary, field", [
    ("extended", "E"), ("extended", "gbar"), ("extended", "gamma"), ("augmented", "stiffness"), ("augmented", "rest"),
])  # fmt: skip
def test_refuses_parameters_of_the_other_task(secondary, field):
    """What the chosen secondary task would ignore is refused by its name."""
    with pytest.raises(RangeError, match=f"{field} is given, but the {secondary} Jacobian has no use for it"):
        cast(PLANAR_3R, F1, at(1, 1), secondary=secondary, **{field: np.ones((1, 3)) if field == "E" else 1.0})
