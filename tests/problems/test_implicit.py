"""N'W and N'a without W or grad f: the same numbers as with them, on every robot, and faults that show."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from problems.implicit import recursions
from problems.implicit.augmented import augmented_along
from problems.implicit.directional import NotAnalyticError, plain_along, symbolic_along
from problems.implicit.inertia import inertia_along
from problems.methods.draw import generic
from problems.robots import ROBOTS, load
from problems.robots.planar import planar_arm
from problems.robots.robot import Robot
from problems.robots.twin import twin
from sandbox import truth
from sandbox.closed_form import null_basis
from sandbox.closed_form.bounds import six
from sandbox.closed_form.eq6 import eq6
from sandbox.closed_form.eq6_implicit import eq6_implicit, implicit_bound
from sandbox.errors import AsymmetricWeightError, NonFiniteError, ShapeError
from sandbox.problem import VelocityProblem
from sandbox.solution import Status
from sandbox.stacked import times, transpose
from sandbox.tolerances import UNIT
from sandbox.weight import Weight
from sandbox.yardstick import Yardstick

Array = np.ndarray

BASES = {"pivoted": null_basis.pivoted, "orthonormal": null_basis.orthonormal}


@pytest.fixture(params=ROBOTS)
def robot(request: pytest.FixtureRequest) -> Robot:
    """Every robot of the table."""
    return load(request.param)


def situations(robot: Robot, count: int = 20) -> tuple[Array, Array, Array]:
    """Generic q and xdot, and J."""
    drawn = generic(robot, np.random.default_rng(3), count)
    return drawn.q, drawn.xdot, robot.jacobian(drawn.q)


def rounding(robot: Robot, q: Array, N: Array) -> Array:
    """What N'M may be off by: 50 n u |M||N|, to be compared with entries (B, 1, 1)."""
    return 50 * robot.n * UNIT * (norms(robot.inertia(q)) * norms(N))[:, None, None]


def norms(A: Array) -> Array:
    return np.linalg.norm(A, axis=(-1, -2))


def agree(problem: VelocityProblem, N: Array, NtW: Array, Nta: Array) -> tuple[Array, Array]:
    """Error of the implicit answer against the truth and against explicit eq. (6), each as a share of what it may be."""
    size = norms(problem.W.dense())
    if problem.W.factored and problem.W.E is not None and problem.W.gamma is not None:
        size = size + norms(problem.W.E) ** 2 * norms(problem.W.gamma)
    found = eq6_implicit(problem.J, problem.xdot, N, NtW, Nta, size=size)
    assert all(status is Status.SOLVED for status in found.status)
    truths = truth(problem)
    yardstick = Yardstick.of(problem, "exact", truths)
    own = implicit_bound(problem.J, N, NtW, size=size)
    theirs = eq6(problem).x
    against_truth = np.abs(found.x - yardstick.x).max(axis=1) / (own * yardstick.size)
    against_eq6 = np.abs(found.x - theirs).max(axis=1) / ((own + six(problem)) * yardstick.size)
    return against_truth, against_eq6


@pytest.mark.parametrize("basis", BASES)
def test_inverse_dynamics_gives_n_times_m(robot: Robot, basis: str) -> None:
    """Torques of N's columns as accelerations, at rest and without gravity, are the rows of N'M: rotors included."""
    q, _, J = situations(robot)
    N = BASES[basis](J)
    assert (np.abs(inertia_along(robot, q, N) - transpose(N) @ robot.inertia(q)) <= rounding(robot, q, N)).all()


@pytest.mark.parametrize("basis", BASES)
def test_inertia_weight_is_never_formed(robot: Robot, basis: str) -> None:
    """W = M by inverse dynamics: the answer is that of explicit eq. (6) and of the exact truth, within their bounds."""
    q, xdot, J = situations(robot)
    N = BASES[basis](J)
    problem = VelocityProblem(J=J, xdot=xdot, W=robot.inertia(q))
    shares = agree(problem, N, inertia_along(robot, q, N), np.zeros((len(q), robot.k)))
    assert max(share.max() for share in shares) <= 1


def test_khatib_at_f1() -> None:
    """F1 with unit point masses at the link ends: qdot = (0, -xdot, xdot + ydot) from three torques (methods M16)."""
    robot = load("planar_3r")
    q = np.array([0, np.pi / 2, -np.pi / 2])
    J = robot.jacobian(q)
    N = null_basis.pivoted(J)
    np.testing.assert_allclose(inertia_along(robot, q, N * np.sign(N[2])), [[-2, 0, 0]], atol=1e-14)
    x = eq6_implicit(J, [0.3, -0.7], N, inertia_along(robot, q, N), [0.0]).x
    np.testing.assert_allclose(x, [0, -0.3, -0.4], atol=1e-14)


@pytest.mark.parametrize("fault", ["gravity left in", "rotors left out", "negative", "another basis"])
def test_faults_of_inverse_dynamics_show(fault: str) -> None:
    """Gravity, missing rotors, a wrong sign and torques of another N each leave rounding far behind, on the same check."""
    robot = load("seven_joint")
    q, _, J = situations(robot)
    N = null_basis.orthonormal(J)
    bare = robot.model.copy()
    bare.armature = np.zeros(robot.n)
    assert np.abs(np.asarray(robot.model.armature)).min() > 0
    torques = {
        "gravity left in": lambda: robot.inverse_dynamics(q, np.zeros_like(q), N[..., 0])[:, None, :],
        "rotors left out": lambda: inertia_along(Robot("bare", bare, robot.hand, robot.rows), q, N),
        "negative": lambda: -inertia_along(robot, q, N),
        "another basis": lambda: inertia_along(robot, q, null_basis.pivoted(J)),
    }[fault]()
    wrong = np.abs(torques - transpose(N) @ robot.inertia(q)) > rounding(robot, q, N)
    assert wrong.any(axis=(1, 2)).all()


def test_inertia_keeps_leading_axes() -> None:
    """Stacks of any shape, one configuration for many N, and one of each."""
    robot = load("planar_4r")
    q, _, J = situations(robot, 6)
    N = null_basis.orthonormal(J)
    whole = inertia_along(robot, q, N)
    np.testing.assert_array_equal(inertia_along(robot, q.reshape(2, 3, 4), N.reshape(2, 3, 4, 2)).reshape(6, 2, 4), whole)
    np.testing.assert_array_equal(inertia_along(robot, q[2], N[2]), whole[2])
    assert inertia_along(robot, q[0], N).shape == (6, 2, 4)


def test_what_is_no_basis_is_refused_by_shape() -> None:
    """Wrong shapes and numbers that are none are refused at the door."""
    robot = load("planar_3r")
    with pytest.raises(ShapeError, match="N has shape"):
        inertia_along(robot, np.zeros(3), np.zeros((4, 1)))
    with pytest.raises(ShapeError, match="q has shape"):
        inertia_along(robot, np.zeros(4), np.zeros((3, 1)))
    with pytest.raises(NonFiniteError):
        inertia_along(robot, [0, np.nan, 0], np.zeros((3, 1)))
    with pytest.raises(ShapeError, match="gbar"):
        augmented_along(np.ones((2, 3)), np.ones((3, 1)), np.ones(3))
    with pytest.raises(ShapeError, match="N has shape"):
        plain_along(lambda q: q.sum(axis=-1), np.zeros(3), np.zeros((4, 1)))


def test_ten_thousand_configurations_are_quick() -> None:
    """N'M of 10,000 Panda configurations takes under two seconds."""
    robot = load("panda")
    q, _, J = situations(robot, 10)
    N = np.concatenate([null_basis.pivoted(J)] * 1000)
    inertia_along(robot, q, N[:10])
    start = time.perf_counter()
    inertia_along(robot, np.concatenate([q] * 1000), N)
    assert time.perf_counter() - start < 2


# augmented Jacobian


def functions(robot: Robot, q: Array, count: int) -> Array:
    """Gradients of `count` secondary functions: seeded mixtures of the joints' coordinates, squared."""
    mixture = np.random.default_rng(5).normal(size=(count, robot.n))
    return mixture * (1 + q[:, None, :] ** 2)


@pytest.mark.parametrize("basis", BASES)
def test_augmented_jacobian_is_never_formed(robot: Robot, basis: str) -> None:
    """(N'E') Gamma E gives the rates of explicit eq. (6), of the exact truth, and makes E qdot = gbar for every gamma > 0."""
    q, xdot, J = situations(robot)
    N = BASES[basis](J)
    E, gbar = functions(robot, q, robot.k), np.random.default_rng(6).normal(size=(len(q), robot.k))
    for gamma in (np.ones(robot.k), np.linspace(0.5, 40, robot.k)):
        NtW, Nta = augmented_along(E, N, gbar, gamma)
        W = Weight(np.zeros((robot.n, robot.n)), E, gamma)
        a = -times(transpose(E), gamma * gbar)
        shares = agree(VelocityProblem(J=J, xdot=xdot, W=W, a=a), N, NtW, Nta)
        assert max(share.max() for share in shares) <= 1
        x = eq6_implicit(J, xdot, N, NtW, Nta).x
        condition = np.linalg.cond(np.concatenate([J, E], axis=1))
        reach = np.linalg.norm(x, axis=1) * norms(E) * condition
        assert (np.abs(times(E, x) - gbar).max(axis=1) <= 50 * robot.n * UNIT * reach * np.linalg.cond(N)).all()


def test_one_function_and_one_degree_of_redundancy() -> None:
    """F1, g = q1 + q2 + q3: N'W = (N' grad g) grad g', and qdot = (-1.6, 1.3, 1.2) for any gamma (methods 4.2)."""
    J, N, e = np.array([[-1.0, -1, 0], [2, 1, 1]]), np.array([[-1.0], [1], [1]]), np.ones((1, 3))
    for gamma in (1e-3, 1.0, 57.3):
        NtW, Nta = augmented_along(e, N, [0.9], [gamma])
        np.testing.assert_allclose(NtW, gamma * (N.T @ e.T) @ e, rtol=1e-15)
        np.testing.assert_allclose(eq6_implicit(J, [0.3, -0.7], N, NtW, Nta).x, [-1.6, 1.3, 1.2], rtol=1e-13)


def test_algorithmic_singularity_is_refused() -> None:
    """F1, g = q1 + q2: N'grad g = 0, so the answer is refused by (7) and not guessed (methods 4.2)."""
    J, N = np.array([[-1.0, -1, 0], [2, 1, 1]]), np.array([[-1.0], [1], [1]])
    assert eq6_implicit(J, [1, 1], N, *augmented_along([[1.0, 1, 0]], N, [0.9])).status is Status.CONDITION_SEVEN


@pytest.mark.parametrize("fault", ["sign of gbar", "gamma forgotten on one side", "transposed product"])
def test_faults_of_the_augmented_jacobian_show(fault: str) -> None:
    """A wrong sign of alpha, Gamma on one side only and a transposed N'W miss gbar, or are refused as asymmetric."""
    robot = load("planar_4r")
    q, xdot, J = situations(robot)
    N, E = null_basis.orthonormal(J), functions(robot, q, 2)
    gbar, gamma = np.ones((len(q), 2)), np.array([1.0, 7.0])
    NtW, Nta = augmented_along(E, N, gbar, gamma)
    plain = augmented_along(E, N, gbar)[1]
    turned = transpose(E) @ (gamma[:, None] * (E @ N))
    NtW, Nta = {
        "sign of gbar": (NtW, -Nta),
        "gamma forgotten on one side": (NtW, plain),
        "transposed product": (turned.reshape(NtW.shape), Nta),
    }[fault]
    try:
        x = eq6_implicit(J, xdot, N, NtW, Nta).x
    except AsymmetricWeightError:
        assert fault == "transposed product"
    else:
        assert (np.abs(times(E, x) - gbar).max(axis=1) > 1e-6).all()


# directional derivatives

EXPRESSIONS: dict[str, Callable[[Any], Any]] = {
    "posture": lambda s: ca.sumsqr(s.q - 0.3) / 2,
    "potential energy": lambda s: s.potential,
    "gravity torque squared": lambda s: ca.sumsqr(s.gravity_torque) / 2,
    "manipulability squared": lambda s: ca.det(s.jacobian @ s.jacobian.T),
}


@pytest.mark.parametrize("measure", EXPRESSIONS)
@pytest.mark.parametrize("name", ["planar_3r", "planar_4r", "panda"])
def test_directional_derivatives_are_n_times_gradient(name: str, measure: str) -> None:
    """Forward mode along the columns of N gives N' grad f, grad f itself from reverse mode, to rounding."""
    robot = load(name)
    q, _, J = situations(robot)
    N = null_basis.pivoted(J)
    symbols = twin(robot)
    f = EXPRESSIONS[measure](symbols)
    (gradient,) = symbols.evaluator(ca.gradient(f, symbols.q))(q)
    found = symbolic_along(robot, EXPRESSIONS[measure])(q, N)
    allowed = 1e3 * UNIT * (np.linalg.norm(gradient, axis=1) * norms(N) + np.abs(symbols.evaluator(f)(q)[0]))
    assert found.shape == (len(q), robot.k)
    assert (np.abs(found - times(transpose(N), gradient)).max(axis=1) <= allowed).all()


def test_gravity_torque_along_n_is_the_potential_s_slope() -> None:
    """N' tau_g by directional derivatives of the potential energy is N' times pinocchio's gravity torque, on Panda."""
    robot = load("panda")
    q, _, J = situations(robot)
    N = null_basis.pivoted(J)
    torque = robot.gravity_torque(q)
    found = symbolic_along(robot, lambda s: s.potential)(q, N)
    allowed = 1e-12 * (np.linalg.norm(torque, axis=1) * norms(N))[:, None]
    assert (np.abs(found - times(transpose(N), torque)) <= allowed).all()
    assert (np.abs(symbolic_along(robot, lambda s: -s.potential)(q, N) - times(transpose(N), torque)) > allowed).any()


def test_columns_are_differentiated_entry_by_entry() -> None:
    """Of a column f the derivatives along N are rows N'(df/dq)': those of the hand's position are JN = 0."""
    robot = load("planar_4r")
    q, _, J = situations(robot)
    N = null_basis.orthonormal(J)
    found = symbolic_along(robot, lambda s: s.position[:2])(q, N)
    assert found.shape == (len(q), 2, 2)
    assert np.abs(found).max() <= 1e-13
    gravity = symbolic_along(robot, lambda s: s.gravity_torque)(q, N)
    np.testing.assert_allclose(gravity, transpose(N) @ robot.gravity_torque_derivative(q), atol=1e-12)


def test_gradient_projection_without_the_gradient(robot: Robot) -> None:
    """M1 with f = 1/2 |q|^2: N'W = N' and N'grad f from plain complex steps give the rates of explicit eq. (6)."""
    q, xdot, J = situations(robot)
    N = null_basis.orthonormal(J)
    alpha = 0.5
    along = alpha * plain_along(lambda q: (q * q).sum(axis=-1) / 2, q, N)
    problem = VelocityProblem(J=J, xdot=xdot, W=np.eye(robot.n), a=alpha * q)
    assert max(share.max() for share in agree(problem, N, transpose(N), along)) <= 1
    assert max(share.max() for share in agree(problem, N, transpose(N), -along)) > 1


def test_complex_steps_round_nothing() -> None:
    """A plain function's slope is that of calculus to a few units: sin(q1) exp(q2) + q3^3 along two directions."""
    q = np.random.default_rng(8).normal(size=(30, 3))
    N = np.random.default_rng(9).normal(size=(30, 3, 2))
    found = plain_along(lambda q: np.sin(q[..., 0]) * np.exp(q[..., 1]) + q[..., 2] ** 3, q, N)
    gradient = np.stack([np.cos(q[:, 0]) * np.exp(q[:, 1]), np.sin(q[:, 0]) * np.exp(q[:, 1]), 3 * q[:, 2] ** 2], axis=1)
    allowed = 8 * UNIT * (np.abs(gradient)[:, None, :] @ np.abs(N))[:, 0, :]
    assert (np.abs(found - times(transpose(N), gradient)) <= allowed).all()


@pytest.mark.parametrize(
    "f", [lambda q: np.abs(q).sum(axis=-1), lambda q: (q * q.conj()).sum(axis=-1), lambda q: np.sin(q.real).sum(axis=-1)]
)
def test_functions_that_are_not_analytic_are_refused(f: Callable) -> None:
    """Abs, conjugates and real parts give a complex step that is no derivative: refused, and the configuration is named."""
    q, N = np.full((2, 3), 0.4), np.ones((2, 3, 1))
    with pytest.raises(NotAnalyticError, match=r"configuration \[0\]"):
        plain_along(f, q, N)


def test_a_function_of_the_wrong_shape_is_refused() -> None:
    """One number per configuration is asked for."""
    with pytest.raises(ShapeError, match="one number per configuration"):
        plain_along(lambda q: q, np.zeros((2, 3)), np.zeros((2, 3, 1)))


# recursions on plain numbers


def turned_arm() -> Robot:
    """Five revolute joints about x, y, z and two oblique axes, general inertias and rotors."""
    rng = np.random.default_rng(10)
    model, joint = pin.Model(), 0
    axes = [np.array([0.6, 0.0, 0.8]), None, None, np.array([2.0, -1, 2]) / 3, None]
    kinds = [None, pin.JointModelRX(), pin.JointModelRY(), None, pin.JointModelRZ()]
    for i, (axis, kind) in enumerate(zip(axes, kinds, strict=True)):
        place = pin.SE3(np.linalg.qr(rng.normal(size=(3, 3)))[0], rng.normal(size=3))
        if np.linalg.det(place.rotation) < 0:
            place = pin.SE3(-place.rotation, place.translation)
        joint = model.addJoint(joint, kind or pin.JointModelRevoluteUnaligned(axis), place, f"joint_{i}")
        A = rng.normal(size=(3, 3))
        model.appendBodyToJoint(joint, pin.Inertia(1.5 + i, rng.normal(size=3), A @ A.T + np.eye(3)), pin.SE3.Identity())
    model.addFrame(pin.Frame("tip", joint, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    model.armature = rng.uniform(0.1, 0.2, 5)
    return Robot("turned", model, "tip", (0, 1, 2))


ARMS = {
    "planar": lambda: planar_arm([0.4, 0.3, 0.2, 0.5], [1.0, 2.0, 3.0, 4.0], rods=True),
    "seven_joint": lambda: load("seven_joint"),
    "panda": lambda: load("panda"),
    "turned": turned_arm,
}


@pytest.mark.parametrize("name", ARMS)
def test_recursions_are_pinocchio_s(name: str) -> None:
    """Plain loops give pinocchio's inertia matrix and inverse dynamics, whatever the axes, and their rotors."""
    robot = ARMS[name]()
    links = recursions.chain(robot)
    rng = np.random.default_rng(11)
    for q, qddot in rng.normal(size=(10, 2, robot.n)):
        c, s = list(np.cos(q)), list(np.sin(q))
        M = robot.inertia(q)
        allowed = 50 * robot.n * UNIT * np.linalg.norm(M)
        assert np.abs(np.array(recursions.composite(links, c, s)) - M).max() <= allowed
        torque = np.array(recursions.newton_euler(links, c, s, list(qddot)))
        assert np.abs(torque - M @ qddot).max() <= allowed * np.linalg.norm(qddot)
        assert np.abs(torque[::-1] - M @ qddot).max() > allowed * np.linalg.norm(qddot)


def test_recursions_want_a_serial_revolute_arm() -> None:
    """A sliding joint has no place in them and is refused; pinocchio's inverse dynamics takes it."""
    model = pin.Model()
    first = model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "turn")
    second = model.addJoint(first, pin.JointModelPX(), pin.SE3.Identity(), "slide")
    for joint in (first, second):
        model.appendBodyToJoint(joint, pin.Inertia(1.0, np.array([0.1, 0.2, 0.0]), np.eye(3)), pin.SE3.Identity())
    model.addFrame(pin.Frame("tip", second, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    robot = Robot("sliding", model, "tip", (0,))
    with pytest.raises(ShapeError, match="serial arm"):
        recursions.chain(robot)
    q, N = np.array([0.3, 0.4]), np.array([[1.0], [2.0]])
    np.testing.assert_allclose(inertia_along(robot, q, N), N.T @ robot.inertia(q), rtol=1e-13)


@pytest.mark.parametrize("field, changed", [
    ("E", {"E": np.ones((0, 2, 3))}), ("E", {"E": np.ones(3)}), ("N", {"N": np.ones((4, 1))}), ("N", {"N": np.ones(3)}),
    ("gbar", {"gbar": np.ones(3)}), ("gamma", {"gamma": np.ones(3)}), ("gamma", {"gamma": 1.0}),
])  # fmt: skip
def test_augmented_jacobian_wants_matching_shapes(field: str, changed: dict) -> None:
    """E (p, n), N (n, k), gbar (p,) and gamma (p,): each other shape is refused by its name."""
    given = {"E": np.ones((2, 3)), "N": np.ones((3, 1)), "gbar": np.ones(2), "gamma": np.ones(2)}
    with pytest.raises(ShapeError, match=f"^{field} "):
        augmented_along(**{**given, **changed})


def test_gamma_left_out_is_one() -> None:
    """Without gamma N'W and N'a are those of gamma = (1, 1)."""
    E, N, gbar = np.array([[1.0, 2, 3], [0, 1, -1]]), np.array([[1.0], [2], [-1]]), np.array([0.5, -2.0])
    NtW, Nta = augmented_along(E, N, gbar)
    np.testing.assert_array_equal(NtW, N.T @ E.T @ E)
    np.testing.assert_array_equal(Nta, -(N.T @ E.T) @ gbar)


@pytest.mark.parametrize("q", [0.0, np.zeros((0, 3))], ids=["number", "empty"])
@pytest.mark.parametrize("along", ["plain", "symbolic"])
def test_directional_derivatives_want_configurations(q: Any, along: str) -> None:
    """A number is no configuration, and an empty stack holds none: refused by the name of q."""
    function = {
        "plain": lambda q, N: plain_along(lambda q: q.sum(axis=-1), q, N),
        "symbolic": symbolic_along(load("planar_3r"), lambda twin: ca.sum1(twin.q)),
    }[along]
    with pytest.raises(ShapeError, match=r"^q "):
        function(q, np.ones((3, 1)))


def test_a_function_may_answer_with_a_list() -> None:
    """Numbers in a list are as good as an array: N' grad f of f = q1 q2 at (2, 3) along (1, 1) is 5."""
    np.testing.assert_allclose(plain_along(lambda q: [row[0] * row[1] for row in q], [[2.0, 3.0]], [[1.0], [1.0]]), [[5.0]])
