"""M17: minimum kinetic energy of virtual loads."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from problems import robots
from problems.methods import augmented_jacobian, inertia_weighted
from problems.methods.virtual_load import METHOD
from problems.robots.planar import PLANAR_3R
from problems.sets import textbook
from problems.weightings.virtual_load import LoadError, hand_load
from sandbox.errors import ConditionSevenError
from sandbox.law import rates
from sandbox.tolerances import UNIT
from tests.problems.methods.agreeing import agrees

F1 = np.array(textbook.F1.q)[None]
ROUNDING = 256 * UNIT  # of numbers below 10 through matrices of condition below 50
ROBOTS = ("planar_3r", "planar_4r", "seven_joint", "panda")


@pytest.mark.parametrize("mass, inertia", [(1.0, 1.0), (0.0, 1.0), (100.0, 0.25), (0.5, 30.0)])
def test_hand_load_with_inertia_at_f1(mass, inertia):
    """F1, a load with inertia Iz on the hand, position task: qdot = (ydot, -xdot - ydot, xdot) for every m and Iz > 0."""
    bodies = [hand_load(PLANAR_3R, mass, inertia * np.eye(3))]
    for law in (METHOD.original, lambda *x, **p: rates(METHOD, *x, **p)):
        for x, y in ((1, 1), (0.3, -0.7)):
            qdot = law(PLANAR_3R, F1, np.array([[x, y]]), bodies=bodies)
            # N'K_p of the original adds m N'J', zero but for rounding
            np.testing.assert_allclose(qdot[0], [y, -x - y, x], atol=ROUNDING * (1 + mass / inertia))


def test_hand_load_is_an_augmented_orientation():
    """K_p = m J'J + Iz 11' moves as M11 with g = q_1 + q_2 + q_3 held still (I21), in every generic situation."""
    drawn = augmented_jacobian.METHOD.draw(PLANAR_3R, np.random.default_rng(0), 100)
    held = rates(augmented_jacobian.METHOD, PLANAR_3R, drawn.q, drawn.xdot, E=np.ones((1, 3)), gbar=np.zeros(1))
    loaded = rates(METHOD, PLANAR_3R, drawn.q, drawn.xdot, bodies=[hand_load(PLANAR_3R, 3.0, 0.5 * np.eye(3))])
    stacked = np.concatenate([PLANAR_3R.jacobian(drawn.q), np.ones((100, 1, 3))], axis=1)
    bound = 200 * UNIT * np.linalg.cond(stacked) ** 2 * np.abs(held).max(axis=-1)
    assert (np.abs(loaded - held).max(axis=-1) <= bound).all()


@pytest.mark.parametrize("name, inertia", [("planar_3r", 0.0), ("panda", 1.0), ("planar_4r", 1.0)])
def test_a_load_at_rest_under_self_motion_is_refused(name, inertia):
    """A mass on the tip, any load under a pose task, one inertia for two freedoms: N'K_pN is singular, (7) fails."""
    robot = robots.load(name)
    q = np.random.default_rng(1).uniform(0.3, 0.9, (3, robot.n)) + (robot.lower + robot.upper) / 2
    for one in q:
        with pytest.raises(ConditionSevenError):
            rates(METHOD, robot, one[None], np.ones((1, robot.m)), bodies=[hand_load(robot, 2.0, inertia * np.eye(3))])


def test_tip_mass_at_f1_is_refused():
    """F1, a point mass on the tip: K_p = m J'J, which null J does not see."""
    with pytest.raises(ConditionSevenError):
        rates(METHOD, PLANAR_3R, F1, np.ones((1, 2)), bodies=[hand_load(PLANAR_3R, 1.0)])


@pytest.mark.parametrize("robot", ROBOTS)
def test_agrees_with_its_original(robot):
    """Eq. (6) and the energy of the velocity recursion agree within their bounds, also after the shifts."""
    assert agrees(METHOD, robot)


@pytest.mark.parametrize("robot", ROBOTS)
def test_default_loads_agree_with_their_original(robot):
    """So they do for the balls that stand where no bodies are given."""

    def draw(robot, rng, count):
        drawn = METHOD.draw(robot, rng, count)
        return drawn._replace(parameters={})

    assert agrees(replace(METHOD, draw=draw), robot, 50)


def test_own_bodies_move_as_the_inertia_weight():
    """Without rotors, the robot's own bodies as loads give the motion of M16."""
    drawn = METHOD.draw(PLANAR_3R, np.random.default_rng(2), 50)
    loaded = rates(METHOD, PLANAR_3R, drawn.q, drawn.xdot, bodies=PLANAR_3R.bodies())
    khatib = rates(inertia_weighted.METHOD, PLANAR_3R, drawn.q, drawn.xdot)
    bound = 150 * UNIT * np.linalg.cond(PLANAR_3R.inertia(drawn.q)) * np.linalg.cond(PLANAR_3R.jacobian(drawn.q)) ** 2
    assert (np.abs(loaded - khatib).max(axis=-1) <= bound * np.abs(khatib).max(axis=-1)).all()


@pytest.mark.parametrize(
    "body", [(3, -1.0), (3, 1.0, np.zeros(3), -np.eye(3)), (3, 1.0, np.zeros(3), np.diag([1.0, 1, 2.1]))],
    ids=["mass", "inertia", "triangle"],
)  # fmt: skip
def test_impossible_loads_are_refused(body):
    """A negative mass, an inertia that is not positive semidefinite or breaks the triangle inequality: refused."""
    with pytest.raises(LoadError):
        METHOD.cast(PLANAR_3R, F1, np.ones((1, 2)), bodies=[body])


def centres_forgotten(robot, q, xdot, *, bodies):
    return METHOD.cast(robot, q, xdot, bodies=[body._replace(centre=np.zeros(3)) for body in bodies])


def points(robot, q, xdot, *, bodies):
    return METHOD.cast(robot, q, xdot, bodies=[body._replace(inertia=np.zeros((3, 3))) for body in bodies])


def one_mass(robot, q, xdot, *, bodies):
    """The mass of a link in the middle: on the hand of a pose task it would not show (I20)."""
    return METHOD.cast(robot, q, xdot, bodies=[*bodies[:2], bodies[2]._replace(mass=50.0), *bodies[3:]])


@pytest.mark.parametrize("cast", [centres_forgotten, points, one_mass])
@pytest.mark.parametrize("robot", ["planar_4r", "panda"])
def test_wrong_loads_disagree(robot, cast):
    """Centres at the joints, bodies without inertia, or one wrong mass: none agrees with the original."""
    assert not agrees(replace(METHOD, cast=cast), robot, 20)


def test_inertia_in_the_wrong_axes_disagrees():
    """An original that leaves I_b in the body's axes while turning in the base's does not agree on a spatial arm."""

    def unturned(robot, q, xdot, *, bodies):
        K = sum(
            np.swapaxes(J := robot.point_jacobian(q, body.joint, body.centre), 1, 2)
            @ np.block([[body.mass * np.eye(3), np.zeros((3, 3))], [np.zeros((3, 3)), body.inertia]])
            @ J
            for body in bodies
        )
        N = np.swapaxes(np.linalg.svd(robot.jacobian(q))[2][:, robot.m :, :], 1, 2)
        particular = np.linalg.pinv(robot.jacobian(q)) @ xdot[..., None]
        NtK = np.swapaxes(N, 1, 2) @ K
        return (particular - N @ np.linalg.solve(NtK @ N, NtK @ particular))[..., 0]

    assert not agrees(replace(METHOD, original=unturned), "panda", 20)
    assert agrees(replace(METHOD, original=unturned), "planar_3r", 20)  # where axes stay parallel it is right
