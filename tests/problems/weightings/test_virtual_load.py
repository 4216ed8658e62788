"""Virtual loads: K_p against velocities, inertia matrices and polarisation."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from problems import robots
from problems.original.virtual_load import kinetic_energy, load_matrix
from problems.robots.planar import PLANAR_3R
from problems.robots.robot import TASKS, Robot
from problems.weightings.virtual_load import LoadError, VirtualBody, balls, hand_load, virtual_load
from sandbox.errors import AsymmetricWeightError, RangeError
from sandbox.tolerances import UNIT

GENERIC = np.array([[0.3, 1.1, -0.7], [1.2, -0.4, 0.9]])
ROUNDING = 1000 * UNIT  # a few hundred operations on numbers of order one
LARGE = np.diag([1.0, 1.0, 2.5])


def mixed_robot():
    model = pin.Model()
    place = pin.SE3(pin.exp3(np.array([0.3, -0.5, 0.2])), np.array([0.4, 0.1, 0.3]))
    joint = model.addJoint(0, pin.JointModelRZ(), place, "turn")
    joint = model.addJoint(joint, pin.JointModelPX(), place, "slide")
    joint = model.addJoint(joint, pin.JointModelRevoluteUnaligned(np.array([0.6, 0.0, 0.8])), place, "twist")
    model.addFrame(pin.Frame("tip", joint, 0, place, pin.FrameType.OP_FRAME))
    return Robot("mixed", model, "tip", TASKS["planar"])


def some_bodies(robot):
    rng = np.random.default_rng(4)
    return [VirtualBody(joint, 1.5, rng.uniform(-0.3, 0.3, 3), np.diag([0.1, 0.2, 0.25])) for joint in robot.joints]


@pytest.mark.parametrize("robot", [PLANAR_3R, robots.load("panda"), mixed_robot()], ids=lambda robot: robot.name)
def test_matrix_by_jacobians_is_the_matrix_by_velocities(robot):
    """Sum of J_b'M_b J_b equals the polarised kinetic energy of the velocity recursion, sliding joints included."""
    q = np.random.default_rng(3).uniform(-1, 1, (5, robot.n))
    for bodies in (balls(robot), some_bodies(robot)):
        expected = load_matrix(robot, q, bodies)
        np.testing.assert_allclose(virtual_load(robot, q, bodies).dense(), expected, atol=ROUNDING * np.abs(expected).max())


@pytest.mark.parametrize("name", ["planar_3r", "seven_joint", "panda"])
def test_the_robots_own_bodies_give_its_inertia_matrix(name):
    """Loads that are the robot's own bodies give M without the rotors; energy is 1/2 qdot'K_p qdot."""
    robot = robots.load(name)
    rng = np.random.default_rng(5)
    q, qdot = rng.uniform(-1, 1, (2, 4, robot.n))
    K = virtual_load(robot, q, robot.bodies()).dense()
    M = robot.inertia(q) - np.diag(robot.model.armature)
    np.testing.assert_allclose(K, M, atol=ROUNDING * np.abs(M).max())
    energy = np.einsum("bi,bij,bj->b", qdot, K, qdot) / 2
    np.testing.assert_allclose(energy, kinetic_energy(robot, q, qdot, robot.bodies()), atol=ROUNDING * np.abs(M).max())


def test_hand_load_of_the_planar_arm():
    """A hand load of mass m and inertia Iz has K_p = m J'J + Iz 11' (position task), kept factored."""
    W = virtual_load(PLANAR_3R, GENERIC, [hand_load(PLANAR_3R, 2.0, 0.5 * np.eye(3))])
    J = PLANAR_3R.jacobian(GENERIC)
    np.testing.assert_allclose(W.dense(), 2 * np.swapaxes(J, 1, 2) @ J + 0.5, atol=ROUNDING * 10)
    assert W.factored and not W.base.any()


@pytest.mark.parametrize(
    "body, error, words",
    [
        (VirtualBody(1, -1.0), LoadError, "mass of -1 kg"),
        (VirtualBody(1, 1.0, np.zeros(3), np.diag([1.0, -0.1, 1.0])), LoadError, "principal moments"),
        (VirtualBody(1, 1.0, np.zeros(3), LARGE), LoadError, "none larger than the sum"),
        (VirtualBody(1, 1.0, np.zeros(3), [[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]), AsymmetricWeightError, "symmetric"),
        (VirtualBody(4, 1.0), RangeError, "joint 4 of a virtual body is not one of 1..3"),
    ],
    ids=["mass", "moment", "triangle", "asymmetric", "joint"],
)
def test_impossible_bodies_are_refused(body, error, words):
    """No body has a negative mass, a negative moment, or a moment above the sum of the other two."""
    with pytest.raises(error, match=words):
        virtual_load(PLANAR_3R, GENERIC, [body])


def test_bodies_on_the_edge_pass():
    """A massless body, a thin rod and a thin plate (equality in the triangle inequality) are bodies; none at all is not."""
    for inertia in (np.zeros((3, 3)), np.diag([0.0, 1, 1]), np.diag([1.0, 1, 2])):
        virtual_load(PLANAR_3R, GENERIC, [VirtualBody(3, 0.0, np.zeros(3), inertia)])
    with pytest.raises(LoadError, match="no virtual body"):
        virtual_load(PLANAR_3R, GENERIC, [])
