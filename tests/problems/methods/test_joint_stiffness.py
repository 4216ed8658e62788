"""M15: minimum elastic energy of the joints."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from problems import robots
from problems.methods.joint_stiffness import METHOD
from problems.robots.planar import PLANAR_3R
from problems.sets import textbook
from problems.weightings.stiffness import UnitMismatchError
from sandbox.errors import RangeError, WeightNotPositiveDefiniteError
from sandbox.law import rates
from sandbox.tolerances import UNIT
from tests.problems.methods.agreeing import agrees

F1 = np.array(textbook.F1.q)[None]
K, C = np.array([1.0, 2, 3]), np.array([1, 1 / 2, 1 / 3])
G = np.array([[1 / 6, 1 / 2], [-7 / 6, -1 / 2], [5 / 6, 1 / 2]])
G_LITERAL = np.array([[-1, 2], [-10, -2], [12, 9]]) / 11  # W = C
ROUNDING = 256 * UNIT  # of numbers below 10 through matrices of condition below 50
ROBOTS = ("planar_3r", "planar_4r", "seven_joint", "panda")


def inverse(law, **given):
    """G at F1, column by column."""
    return np.stack([law(PLANAR_3R, F1, xdot[None], **given)[0] for xdot in np.eye(2)], axis=-1)


@pytest.mark.parametrize("given", [{"stiffness": K}, {"compliance": C}, {"stiffness": np.diag(K), "unit": "Nm/rad"}])
def test_f1(given):
    """F1, K = diag(1, 2, 3) Nm/rad: the G of M2; C = diag(1, 1/2, 1/3) is the same arm."""
    for law in (METHOD.original, lambda *x, **p: rates(METHOD, *x, **p)):
        np.testing.assert_allclose(inverse(law, **given), G, atol=ROUNDING)


def test_compliance_taken_literally_is_another_law():
    """W = C, as the paper may be read, has another G, and only the name compliance_as_printed gives it."""
    for law in (METHOD.original, lambda *x, **p: rates(METHOD, *x, **p)):
        np.testing.assert_allclose(inverse(law, compliance_as_printed=C), G_LITERAL, atol=ROUNDING)
    assert np.abs(G_LITERAL - G).max() > 0.3


@pytest.mark.parametrize("robot", ROBOTS)
def test_agrees_with_its_original(robot):
    """Eq. (6) and the wrench form agree within their bounds, also where shifts make W indefinite."""
    assert agrees(METHOD, robot)


@pytest.mark.parametrize("name", ["compliance", "compliance_as_printed", None])
def test_every_label_agrees_with_its_original(name):
    """So they do for compliances, for compliances taken literally, and for the default stiffness."""

    def draw(robot, rng, count):
        q, xdot, given = METHOD.draw(robot, rng, count)[:3]
        return type(METHOD.draw(robot, rng, count))(q, xdot, {} if name is None else {name: given["stiffness"]})

    assert agrees(replace(METHOD, draw=draw), "panda", 50)


def test_no_displacement_stores_less_energy():
    """1/2 dq'K dq [J] is larger by 1/2 y'N'KN y at dq + N y, for every y (I14)."""
    drawn = METHOD.draw(robots.load("panda"), np.random.default_rng(5), 30)
    panda, stiffness = robots.load("panda"), drawn.parameters["stiffness"]
    dq = rates(METHOD, panda, drawn.q, drawn.xdot, stiffness=stiffness)
    n = np.linalg.svd(panda.jacobian(drawn.q))[2][:, -1, :]
    for y in (-0.5, 1e-2, 0.5):
        more = [np.einsum("bi,ij,bj->b", x, stiffness, x) / 2 for x in (dq + y * n, dq)]
        extra = y**2 / 2 * np.einsum("bi,ij,bj->b", n, stiffness, n)
        np.testing.assert_allclose(more[0] - more[1], extra, atol=1e4 * UNIT * np.abs(more[1]).max())


def test_refusals():
    """Two matrices at once, one that is not positive definite, and a wrong unit are refused."""
    for given, error in (
        ({"stiffness": K, "compliance": C}, RangeError),
        ({"stiffness": [1, 2, 0]}, WeightNotPositiveDefiniteError),
        ({"compliance": np.diag([1.0, -1, 1])}, WeightNotPositiveDefiniteError),
        ({"stiffness": K, "unit": "rad/Nm"}, UnitMismatchError),
        ({"compliance": C, "unit": "Nm/rad"}, UnitMismatchError),
    ):
        with pytest.raises(error):
            METHOD.cast(PLANAR_3R, F1, np.ones((1, 2)), **given)


def compliance_for_stiffness(robot, q, xdot, *, stiffness):
    return METHOD.cast(robot, q, xdot, compliance=stiffness)


def unweighted(robot, q, xdot, *, stiffness):
    return METHOD.cast(robot, q, xdot, stiffness=np.ones(robot.n))


@pytest.mark.parametrize("cast", [compliance_for_stiffness, unweighted])
@pytest.mark.parametrize("robot", ["planar_3r", "panda"])
def test_a_wrong_weight_disagrees(robot, cast):
    """A stiffness taken for a compliance, or none at all, does not agree with the original."""
    assert not agrees(replace(METHOD, cast=cast), robot, 20)
