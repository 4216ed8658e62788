"""M1: Liegeois's gradient projection."""

from __future__ import annotations

import numpy as np
import pytest

from problems.methods.gradient_projection import METHOD
from problems.robots.planar import PLANAR_3R
from problems.sets import textbook
from sandbox.closed_form.solve import solve
from sandbox.errors import NonFiniteError, RangeError, ShapeError
from sandbox.law import rates
from sandbox.problem import VelocityProblem
from sandbox.tolerances import UNIT

F1 = np.array(textbook.F1.q)[None]
ROUNDING = 256 * UNIT


def both(xdot, **parameters):
    """What the framework and the original say at F1."""
    xdot = np.array([xdot], dtype=float)
    return rates(METHOD, PLANAR_3R, F1, xdot, **parameters)[0], METHOD.original(PLANAR_3R, F1, xdot, **parameters)[0]


def test_pseudoinverse():
    """F1, xdot = (1, 1), a = 0: (1/3, -4/3, 5/3)."""
    for qdot in both((1, 1), alpha=0.0):
        np.testing.assert_allclose(qdot, [1 / 3, -4 / 3, 5 / 3], atol=ROUNDING)


def test_scaled_joints():
    """F1, W = diag(1, 2, 3), a = (.1, -.2, .4), xdot = (.3, -.7): (-17/60, -1/60, -7/60)."""
    given = {"alpha": 1.0, "gradient": [0.1, -0.2, 0.4], "scales": np.array([1, 1 / 2, 1 / 3]) ** 0.5}
    for qdot in both((0.3, -0.7), **given):
        np.testing.assert_allclose(qdot, [-17 / 60, -1 / 60, -7 / 60], atol=ROUNDING)


def test_indefinite_weight():
    """W = I - c J'J, indefinite, gives the same joint rates."""
    plain = METHOD.cast(PLANAR_3R, F1, np.array([[1.0, 1]]))
    W = np.eye(3) - 0.5 * plain.J.swapaxes(-1, -2) @ plain.J
    assert np.linalg.eigvalsh(W).min() < 0
    other = solve(VelocityProblem(J=plain.J, xdot=plain.xdot, W=W, a=plain.a)).x
    np.testing.assert_allclose(other, solve(plain).x, atol=ROUNDING)


def test_klein_and_huang():
    """Klein and Huang's form z + J^+(xdot - J z) is J^+ xdot + (I - J^+J) z."""
    pinv = np.array([[0, 1], [-3, -1], [3, 2]]) / 3
    J = np.array(textbook.F1.J, dtype=float)
    posture = np.array([0.4, -0.2, 0.9])
    z = -0.5 * (F1[0] - posture)
    expected = pinv @ [0.3, -0.7] + (np.eye(3) - pinv @ J) @ z
    for qdot in both((0.3, -0.7), posture=posture):
        np.testing.assert_allclose(qdot, expected, atol=ROUNDING)


def test_gradient_for_each_configuration():
    """A gradient (B, n) is used row by row, and equals the posture's where it is the posture's."""
    q, xdot = np.random.default_rng(0).uniform(-2, 2, (5, 3)), np.ones((5, 2))
    one, other = (METHOD.cast(PLANAR_3R, q, xdot, **given) for given in ({"posture": np.ones(3)}, {"gradient": q - 1}))
    np.testing.assert_allclose(one.a, other.a, atol=ROUNDING)


@pytest.mark.parametrize(
    "parameters, error, words",
    [
        ({"gradient": np.ones(2)}, ShapeError, "grad f"),
        ({"gradient": np.ones((3, 3))}, ShapeError, "stacks do not agree"),
        ({"gradient": [1, np.nan, 0]}, NonFiniteError, "grad f"),
        ({"posture": np.ones(4)}, ShapeError, "posture"),
        ({"posture": np.ones(3), "gradient": np.ones(3)}, RangeError, "give one"),
    ],
    ids=["length", "stack", "NaN", "posture", "both"],
)
def test_refusals(parameters, error, words):
    """A gradient or posture of the wrong length, one that is not finite, and both at once are refused."""
    with pytest.raises(error, match=words):
        METHOD.cast(PLANAR_3R, np.tile(F1, (2, 1)), np.ones((2, 2)), **parameters)
