"""Every robot: pinocchio's numbers against the CasADi twin, against differences, and the laws of mechanics between them."""

from __future__ import annotations

import pickle
import sys
from concurrent.futures import ThreadPoolExecutor

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from problems.robots import denavit_hartenberg, load
from problems.robots.denavit_hartenberg import Link
from problems.robots.planar import PLANAR_3R, planar_arm
from problems.robots.robot import Robot
from problems.robots.twin import twin
from problems.weightings.identity import MixedUnitsError, identity
from sandbox.errors import NonFiniteError, RangeError, ShapeError, UnknownNameError

SAME = 1e-12  # of the largest entry: a few hundred operations round to 1e-14
STEP = 1e-5
DIFFERENCE = 1e-9  # of the largest entry: STEP^2 truncated, UNIT/STEP rounded


def assert_same(found, expected, share=SAME, scale=None):
    """Equal to a share of the largest entry."""
    scale = np.abs(expected).max() if scale is None else scale
    np.testing.assert_allclose(found, expected, rtol=0, atol=share * max(scale, np.finfo(float).tiny))


def slope(f, q):
    """Central differences of f along every joint: (..., n, *shape of f)."""
    steps = STEP * np.eye(q.shape[-1])
    parts = [(f(q + step) - f(q - step)) / (2 * STEP) for step in steps]
    return np.stack(parts, axis=q.ndim - 1)


def twin_jacobian_derivative(robot, q):
    """dJ/dq (..., n, m, n) by CasADi."""
    symbols = twin(robot)
    columns = [ca.jacobian(symbols.jacobian[:, i], symbols.q) for i in range(robot.n)]
    return np.moveaxis(np.stack(symbols.evaluator(*columns)(q), axis=-2), -1, -3)


def test_twin_has_the_same_kinematics(robot, q):
    """Position, rotation and Jacobian are those of the twin."""
    symbols = twin(robot)
    position, rotation, J, geometric = symbols.evaluator(
        symbols.position, symbols.rotation, symbols.jacobian, symbols.geometric
    )(q)
    found = robot.forward(q)
    assert_same(found[0], position)
    assert_same(found[1], rotation)
    assert_same(robot.jacobian(q), J)
    assert_same(robot.geometric(q), geometric)


def test_twin_has_the_same_second_order(robot, q):
    """dJ/dq is that of the twin."""
    assert_same(robot.jacobian_derivative(q), twin_jacobian_derivative(robot, q), scale=np.abs(robot.jacobian(q)).max())


def test_twin_has_the_same_dynamics(robot, q):
    """Inertia matrix, gravity torque and its derivative are those of the twin."""
    symbols = twin(robot)
    torque = symbols.gravity_torque
    M, tau, dtau = symbols.evaluator(symbols.inertia, torque, ca.jacobian(torque, symbols.q))(q)
    assert_same(robot.inertia(q), M)
    assert_same(robot.gravity_torque(q), tau)
    assert_same(robot.gravity_torque_derivative(q), dtau, scale=np.abs(tau).max())


def test_jacobian_is_the_derivative_of_the_pose(robot, q):
    """The linear rows are the derivative of the position; the angular rows turn the rotation, dR R' = [w]x."""
    J, R = robot.geometric(q), robot.forward(q)[1]
    linear = np.swapaxes(slope(lambda q: robot.forward(q)[0], q), -1, -2)
    assert_same(J[:, :3], linear, DIFFERENCE)
    turning = slope(lambda q: robot.forward(q)[1], q) @ np.swapaxes(R, -1, -2)[:, None]
    assert_same(turning, -np.swapaxes(turning, -1, -2), DIFFERENCE, scale=1)
    assert_same(J[:, 3:], np.swapaxes(turning[..., [2, 0, 1], [1, 2, 0]], -1, -2), DIFFERENCE, scale=1)
    np.testing.assert_array_equal(robot.jacobian(q), J[:, robot.rows])


def test_jacobian_derivative_by_differences(robot, q):
    """dJ/dq_k is the change of J along joint k."""
    assert_same(robot.jacobian_derivative(q), slope(robot.jacobian, q), DIFFERENCE, scale=np.abs(robot.jacobian(q)).max())


def test_gravity_torque_is_the_slope_of_the_potential(robot, q):
    """tau_g is the gradient of the weights' potential energy, and its derivative the symmetric Hessian."""

    def potential(q):
        gravity = np.asarray(robot.model.gravity.linear)
        return sum(-mass * robot.point(q, joint, centre) @ gravity for joint, mass, centre, _ in robot.bodies())

    scale = np.abs(potential(q)).max()
    assert_same(robot.gravity_torque(q), slope(potential, q), DIFFERENCE, scale)
    hessian = robot.gravity_torque_derivative(q)
    assert_same(hessian, np.swapaxes(slope(robot.gravity_torque, q), -1, -2), DIFFERENCE, scale)
    assert_same(hessian, np.swapaxes(hessian, -1, -2), scale=scale)


def test_inverse_dynamics(robot, q):
    """At rest the torque is M qddot + tau_g; without gravity M qddot; and with the rates the power balance holds."""
    rng = np.random.default_rng(3)
    rates, accelerations = rng.uniform(-1, 1, (2, *q.shape))
    M, tau = robot.inertia(q), robot.gravity_torque(q)
    inertial = np.einsum("...ij,...j->...i", M, accelerations)
    assert_same(robot.inverse_dynamics(q, 0 * q, accelerations), inertial + tau)
    assert_same(robot.inverse_dynamics(q, 0 * q, accelerations, gravity=False), inertial)

    def energy(q, rates):
        return np.einsum("...i,...ij,...j->...", rates, robot.inertia(q), rates) / 2

    ahead = energy(q + STEP * rates, rates + STEP * accelerations)
    behind = energy(q - STEP * rates, rates - STEP * accelerations)
    power = np.sum(rates * robot.inverse_dynamics(q, rates, accelerations, gravity=False), axis=-1)
    assert_same(power, (ahead - behind) / (2 * STEP), DIFFERENCE, scale=np.abs(M).max() * robot.n**2)


def test_inertia_is_that_of_the_kinetic_energy(robot, q):
    """Twice the kinetic energy, rates'M rates, is that of the bodies as points' Jacobians move them, and of the rotors."""
    M = np.asarray(robot.model.armature) * np.eye(robot.n)
    for joint, mass, centre, about_centre in robot.bodies():
        J = robot.point_jacobian(q, joint, centre)
        far = [robot.point(q, joint, axis) - robot.point(q, joint) for axis in np.eye(3)]
        R = np.stack(far, axis=-1)
        linear, angular = J[:, :3], J[:, 3:]
        turned = R @ about_centre @ np.swapaxes(R, -1, -2)
        M = M + mass * np.swapaxes(linear, -1, -2) @ linear + np.swapaxes(angular, -1, -2) @ turned @ angular
    assert_same(robot.inertia(q), M)


def test_inertia_is_positive_definite(robot, q):
    """No motion is free of kinetic energy."""
    eigenvalues = np.linalg.eigvalsh(robot.inertia(q))
    assert np.all(eigenvalues[:, 0] > SAME * eigenvalues[:, -1])


def test_points(robot, q):
    """A point's Jacobian is the derivative of the point, its columns zero off the chain; the hand is such a point."""
    offset = np.array([0.1, -0.2, 0.3])
    for joint in robot.joints:
        J = robot.point_jacobian(q, joint, offset)
        moved = slope(lambda q, joint=joint: robot.point(q, joint, offset), q)
        assert_same(J[:, :3], np.swapaxes(moved, -1, -2), DIFFERENCE, scale=np.abs(J).max())
        off = [i - 1 for i in robot.joints if i not in list(robot.model.supports[joint])]
        assert not J[..., off].any()
        symbols = twin(robot)
        assert_same(robot.point(q, joint, offset), symbols.evaluator(symbols.point(joint, offset))(q)[0])
    frame = robot.model.frames[robot.frame(robot.hand)]
    place = np.array(frame.placement.translation)
    assert_same(robot.point(q, frame.parentJoint, place), robot.forward(q)[0])
    assert_same(robot.point_jacobian(q, frame.parentJoint, place), robot.geometric(q))


def test_axes_of_the_twin(robot, q):
    """The twin's axes and links are those that the Jacobian turns or slides along."""
    symbols = twin(robot)
    axes = symbols.evaluator(*(symbols.axis(i) for i in robot.joints))(q)
    links = symbols.evaluator(*(symbols.link(i) for i in robot.joints))(q)
    for i in robot.joints:
        own = robot.point_jacobian(q, i)[..., i - 1]
        assert_same(own[:, :3] if robot.prismatic[i - 1] else own[:, 3:], axes[i - 1], scale=1)
        assert_same(np.einsum("...ij,j->...i", links[i - 1], robot.axes[i - 1]), axes[i - 1], scale=1)


@pytest.mark.parametrize(
    "compute",
    ["jacobian", "geometric", "jacobian_derivative", "inertia", "gravity_torque", "gravity_torque_derivative"],
)
def test_stacks(robot, q, compute):
    """A stack of configurations gives the stack of the single answers."""
    f = getattr(robot, compute)
    whole = f(q[:6].reshape(2, 3, robot.n))
    np.testing.assert_array_equal(whole, np.stack([[f(one) for one in row] for row in q[:6].reshape(2, 3, robot.n)]))


def test_twin_stacks_and_parameters():
    """The twin's numbers are stacked as q is, parameters go with each configuration or with all."""
    robot = load("planar_3r")
    symbols, p = twin(robot), ca.SX.sym("p", 2)
    q, given = np.linspace(-1, 1, 18).reshape(2, 3, 3), np.arange(12.0).reshape(2, 3, 2)
    evaluate = symbols.evaluator(p[0] * ca.sum1(symbols.q), p[1] * symbols.jacobian, ca.SX(2, 1), parameters=[p])
    for values in (given, given[0, 0]):
        first, second, zero = evaluate(q, values)
        values = np.broadcast_to(values, given.shape)
        assert_same(first, values[..., 0] * q.sum(-1))
        assert_same(second, values[..., 1, None, None] * robot.jacobian(q))
        assert zero.shape == (2, 3, 2) and not zero.any()
    assert evaluate(q[0, 0], given[0, 0])[0].shape == ()


def test_wrong_second_orders_are_noticed():
    """dJ/dq with its joints exchanged, or read row by row from pinocchio's columns, is not that of the twin."""
    robot = load("panda")
    q = np.random.default_rng(1).uniform(robot.lower, robot.upper, (3, 7))
    expected = twin_jacobian_derivative(robot, q)
    frame, data, columns = robot.frame(robot.hand), robot.model.createData(), []
    for one in q:
        pin.computeJointKinematicHessians(robot.model, data, one)
        pin.updateFramePlacement(robot.model, data, frame)
        columns.append(pin.getFrameKinematicHessian(robot.model, data, frame, pin.LOCAL_WORLD_ALIGNED).copy())
    for wrong in (np.moveaxis(robot.jacobian_derivative(q), -1, -3).swapaxes(-1, -2), np.moveaxis(np.array(columns), -1, -3)):
        assert wrong.shape == expected.shape
        with pytest.raises(AssertionError):
            assert_same(wrong, expected)


def test_slides(mixed, oblique, slides):
    """Which joints slide, in metres; mixed with turning ones W = I is refused until scales are given."""
    assert mixed.prismatic.tolist() == [False, False, True, False]
    assert oblique.prismatic.tolist() == [False, True, False, False]
    assert slides.prismatic.all() and not load("panda").prismatic.any()
    for robot in (mixed, oblique):
        joint = int(np.flatnonzero(robot.prismatic)[0]) + 1
        with pytest.raises(MixedUnitsError, match=f"joint {joint} slides.*scales="):
            identity(robot, np.zeros(4))
        W = identity(robot, np.zeros(4), np.array([1, 2, 0.5, 4])).dense()
        np.testing.assert_array_equal(W, np.diag([1, 0.25, 4, 0.0625]))
    np.testing.assert_array_equal(identity(slides, np.zeros(4)).dense(), np.eye(4))


def test_gantry_moves_along_its_axes(slides):
    """Slides carry the hand along their axes, never turn it, and know no limit."""
    robot, diagonal = slides, 3**-0.5
    q = np.array([0.3, -0.2, 0.7, 0.5])
    position, rotation = robot.forward(q)
    assert_same(position, q[:3] + np.array([0.1, 0.2, 0.3]) + diagonal * q[3])
    np.testing.assert_array_equal(rotation, np.eye(3))
    assert_same(robot.geometric(q), np.vstack([np.column_stack([np.eye(3), np.full(3, diagonal)]), np.zeros((3, 4))]))
    assert not robot.jacobian_derivative(q).any()
    assert_same(robot.gravity_torque(q), 9.81 * np.array([0, 0, 4 + 5, 5 * diagonal]))
    assert np.all(robot.lower == -np.inf) and np.all(robot.upper == np.inf) and np.all(robot.rate_limits == np.inf)


def test_tasks():
    """A task chooses rows by name or number; the same task is the same robot; the rest stays."""
    robot = load("panda")
    q = np.full(7, 0.3)
    assert (robot.n, robot.m, robot.k, robot.rows) == (7, 6, 1, (0, 1, 2, 3, 4, 5))
    position = robot.task("position")
    assert (position.m, position.k, position.name, position.model) == (3, 4, "panda", robot.model)
    assert robot.task([0, 1, 2]) is position and position.task("pose") is robot and robot.task(robot.rows) is robot
    np.testing.assert_array_equal(robot.task((5, 0)).jacobian(q), robot.geometric(q)[[5, 0]])
    with pytest.raises(UnknownNameError, match="no task is called 'place'; there are: orientation, planar"):
        robot.task("place")
    for rows in ((), (0, 0), (6,), (-1,), (0.5,), ("x",)):
        with pytest.raises(RangeError, match=r"different numbers of 0\.\.5"):
            robot.task(rows)
        with pytest.raises(RangeError, match=r"different numbers of 0\.\.5"):
            Robot("x", robot.model, "hand_tcp", rows)


def test_bad_configurations():
    """A configuration of the wrong length, with NaN or of no numbers is refused by name; so are stacks that disagree."""
    robot, q = load("panda"), np.zeros((2, 7))
    for compute in ("forward", "jacobian", "jacobian_derivative", "inertia", "gravity_torque"):
        f = getattr(robot, compute)
        with pytest.raises(ShapeError, match=r"q has shape \(2, 6\)"):
            f(q[:, :6])
        with pytest.raises(NonFiniteError, match=r"q\[1, 2\] is nan"):
            f(np.where(np.arange(14).reshape(2, 7) == 9, np.nan, q))
        with pytest.raises(ShapeError, match="real numbers"):
            f(["a"] * 7)
        with pytest.raises(ShapeError, match="empty stack"):
            f(np.zeros((0, 7)))
    with pytest.raises(ShapeError, match="qddot has shape"):
        robot.inverse_dynamics(q, q, q[:, :3])
    with pytest.raises(ShapeError, match="stacks do not agree"):
        robot.inverse_dynamics(q, np.zeros((3, 7)), q)
    symbols = twin(robot)
    with pytest.raises(ShapeError, match="q has shape"):
        symbols.evaluator(symbols.position)(q[:, :6])


def test_bad_points():
    """A joint there is not, or an offset that is no point, is refused."""
    robot, q = load("panda"), np.zeros(7)
    for joint in (0, 8, -1):
        with pytest.raises(RangeError, match=r"joint -?\d is not one of 1..7 of panda"):
            robot.point(q, joint)
        with pytest.raises(RangeError, match="is not one of"):
            robot.point_jacobian(q, joint)
    with pytest.raises(ShapeError, match=r"offset has shape \(2,\)"):
        robot.point(q, 1, (0.0, 1.0))
    with pytest.raises(NonFiniteError, match="offset"):
        robot.point_jacobian(q, 1, (0.0, np.nan, 1.0))


def test_missing_frame_lists_those_there_are():
    """A hand that is no frame is refused; the message lists the frames."""
    listed = r"no frame of panda is called 'tcp'; there are: frame_1, .*, hand_tcp, "
    with pytest.raises(UnknownNameError, match=listed) as caught:
        Robot("panda", load("panda").model, "tcp")
    assert "\n" not in str(caught.value)
    with pytest.raises(UnknownNameError, match="no frame of planar_3r is called 'elbow'; there are: tip, universe"):
        load("planar_3r").frame("elbow")


def made(joint=None, mass=1.0, limits=(-1.0, 1.0)):
    """One link on one joint."""
    model = pin.Model()
    model.addJoint(0, joint or pin.JointModelRZ(), pin.SE3.Identity(), "only")
    model.appendBodyToJoint(1, pin.Inertia(mass, np.zeros(3), np.eye(3)), pin.SE3.Identity())
    if model.nq == 1:
        model.lowerPositionLimit, model.upperPositionLimit = np.array(limits[:1]), np.array(limits[1:])
    model.addFrame(pin.Frame("hand", 1, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    return Robot("made", model, "hand")


def test_what_is_no_arm_is_refused():
    """Joints of several coordinates, helices, no joint, no axis, no room, no mass that is a number: each by name."""
    assert made().n == 1
    for joint in (pin.JointModelFreeFlyer(), pin.JointModelRUBZ(), pin.JointModelHZ(0.1), pin.JointModelPlanar()):
        with pytest.raises(ShapeError, match=rf"joint 'only' of made is a {joint.shortname()}.*lock it"):
            made(joint)
    with pytest.raises(ShapeError, match="nothing has no joint"):
        Robot("nothing", pin.Model(), "universe")
    for mass in (-1.0, np.nan, np.inf):
        with pytest.raises(RangeError, match=f"'only' of made has mass {mass:g}"):
            made(mass=mass)
    for limits in ((0.0, 0.0), (1.0, -1.0), (np.nan, 1.0)):
        with pytest.raises(RangeError, match=r"'only' of made has lower limit .* lower < upper"):
            made(limits=limits)


def test_pickled(robot, q):
    """A robot that was pickled gives the same numbers."""
    again = pickle.loads(pickle.dumps(robot))
    assert (again.name, again.hand, again.rows, again.about) == (robot.name, robot.hand, robot.rows, robot.about)
    for compute in ("jacobian", "inertia", "gravity_torque"):
        np.testing.assert_array_equal(getattr(again, compute)(q), getattr(robot, compute)(q))
    np.testing.assert_array_equal(again.lower, robot.lower)


def test_threads_do_not_disturb_each_other():
    """Four threads that share a robot each get the numbers of their own configurations."""
    robot = load("panda")
    stacks = np.random.default_rng(5).uniform(robot.lower, robot.upper, (4, 2000, 7))
    alone = [(robot.forward(q)[0], robot.point_jacobian(q, 5)) for q in stacks]
    pause = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(4) as threads:
            together = list(threads.map(lambda q: (robot.forward(q)[0], robot.point_jacobian(q, 5)), stacks))
    finally:
        sys.setswitchinterval(pause)
    for (p, J), (p0, J0) in zip(together, alone, strict=True):
        np.testing.assert_array_equal(p, p0)
        np.testing.assert_array_equal(J, J0)


def test_the_planar_arm_is_as_documented():
    """Gravity 9.81 m/s^2 towards -y, every joint within 2.75 rad and 2 rad/s; it tells points from rods."""
    np.testing.assert_array_equal(PLANAR_3R.model.gravity.linear, [0.0, -9.81, 0.0])
    np.testing.assert_array_equal(PLANAR_3R.upper, np.full(3, 2.75))
    np.testing.assert_array_equal(PLANAR_3R.lower, np.full(3, -2.75))
    np.testing.assert_array_equal(PLANAR_3R.rate_limits, np.full(3, 2.0))
    assert "point masses" in PLANAR_3R.about and "rods" in planar_arm([1.0, 1.0], rods=True).about


def test_nobody_writes_into_a_robot():
    """Limits are copies, and the kinds of joints, which are kept, are read-only."""
    PLANAR_3R.upper[:] = 0
    assert (PLANAR_3R.upper == 2.75).all()
    with pytest.raises(ValueError, match="read-only"):
        PLANAR_3R.prismatic[0] = True


def test_a_link_left_blank_moves_nothing_along():
    """Of a Denavit-Hartenberg table what is left out is zero: blank rows turn about one axis through one point."""
    model = denavit_hartenberg.arm("blank", [Link(), Link(), Link(d=0.5)])
    robot = Robot("blank", model, "hand", (0, 1, 2))
    position, rotation = robot.forward(np.array([0.3, 0.4, -0.7]))
    np.testing.assert_allclose(position, [0, 0, 0.5], atol=1e-15)
    np.testing.assert_allclose(rotation, np.eye(3), atol=1e-15)
