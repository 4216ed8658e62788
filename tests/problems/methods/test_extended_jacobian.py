"""M12 and section 5 of methods.md."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from problems import robots
from problems.measures.measure import Measure, NotTwiceDifferentiableError, symbolic
from problems.methods import extended_jacobian, extended_jacobian_hessian, mussa_ivaldi_hogan
from problems.methods.extended_jacobian import METHOD, cast, cast_function
from problems.robots.planar import PLANAR_3R
from problems.weightings import extended
from problems.weightings.augmented import AlgorithmicSingularityError, NotRedundantError
from problems.weightings.extended import Extremum, OffManifoldError
from problems.weightings.impedance import elastic
from sandbox.closed_form.solve import solve
from sandbox.errors import RankDeficientError, WeightNotPositiveDefiniteError
from sandbox.law import rates
from sandbox.problem import VelocityProblem
from tests.problems.secondary import COUNT, EACH_ROBOT, F1, NULL, Q0, agrees, answers, at, faulty, found, rest, rounding

STEP = np.finfo(float).eps ** (1 / 3)
"""Of central differences: h^2 truncated, u/h rounded, both near 4e-11 times the derivatives."""

DIFFERENCED = 1e4 * STEP**2
"""What such a difference of a minimiser may be off: third derivatives over its curvature, at most 1e4 here."""

PARTIAL = (0, 1, 2, 3, 4)
"""Position and two of three rows of angular velocity."""


@EACH_ROBOT
def test_agrees_with_the_original(name):
    """Framework and [J; H] qdot = [xdot; 0] agree, also after shifts of W."""
    agrees(METHOD, name)


@pytest.mark.parametrize("name, task", [("seven_joint", "pose"), ("seven_joint", "position"), ("seven_joint", PARTIAL)])
def test_agrees_whatever_the_task_rows(name, task):
    """One degree of redundancy, four, and a part of the angular velocity."""
    agrees(METHOD, name, task=task)


@pytest.mark.parametrize("xdot", [(1.0, 0.0), (0.0, 1.0), (0.3, -0.7)])
def test_elastic_energy_at_f1(xdot):
    """E1: qdot = (0, -xdot, xdot + ydot)."""
    answers(METHOD, PLANAR_3R, F1, at(*xdot), (0.0, -xdot[0], sum(xdot)), rest=Q0)


def minimiser(robot, q, x, g_rest):
    """The minimiser of 1/2 |q - rest|^2 on x(q) = x near q, by Newton's method on its own conditions."""
    for _ in range(8):
        J, dJ = robot.jacobian(q), robot.jacobian_derivative(q)
        lam = np.linalg.lstsq(J.T, q - g_rest)[0]
        K = np.eye(robot.n) - np.einsum("k,jki->ij", lam, dJ)
        system = np.block([[K, -J.T], [J, np.zeros((robot.m, robot.m))]])
        left = np.concatenate([q - g_rest - J.T @ lam, robot.forward(q)[0][: robot.m] - x])
        q = q - np.linalg.solve(system, left)[: robot.n]
    return q


@pytest.mark.parametrize("name", ["planar_3r", "planar_4r"])
def test_is_the_derivative_of_the_constrained_minimiser(name):
    """Central differences of argmin g on x(q) = x along xdot give the rates (E1; F1 among the configurations)."""
    robot = robots.load(name)
    q, xdot, parameters = extended_jacobian_hessian.METHOD.draw(robot, np.random.default_rng(4), 5)
    given = q - parameters["stiffness"] * (q - parameters["rest"])  # unit springs that pull as these do
    if name == "planar_3r":
        q, xdot, given = np.vstack([q, F1]), np.vstack([xdot, at(0.3, -0.7)]), np.vstack([given, Q0])
    curved = extended.extremum(robot, q, elastic(robot, 1.0, given))
    kept = np.linalg.eigvalsh(curved.H @ curved.N)[:, 0] > 0.1
    assert kept.any()
    qdot = rates(METHOD, robot, q[kept], xdot[kept], rest=given[kept])
    for at_q, towards, home, found_rates in zip(q[kept], xdot[kept], given[kept], qdot, strict=True):
        x = robot.forward(at_q)[0][: robot.m]
        ahead, behind = (minimiser(robot, at_q, x + s * STEP * towards, home) for s in (1, -1))
        np.testing.assert_allclose((ahead - behind) / (2 * STEP), found_rates, rtol=0, atol=DIFFERENCED)


def manipulability() -> Measure:
    """Measure w = sqrt(det JJ')."""
    return symbolic("w", "m^2", "manipulability", "M5", _manipulability)


def _manipulability(twin):
    return ca.sqrt(ca.det(twin.jacobian @ twin.jacobian.T))


def test_manipulability_at_f1():
    """E2: grad w = 0, the row is along (0, 3, 2); a turn about the base turns joint 1 alone."""
    problem = cast_function(
        PLANAR_3R, np.repeat(F1, 2, axis=0), np.array([[0.3, -0.7], [-1.0, 2.0]]), function=manipulability()
    )
    row = problem.W.E[0, 0]
    np.testing.assert_allclose(np.cross(row, (0, 3, 2)), 0, atol=rounding(PLANAR_3R, F1, 3 * np.linalg.norm(row))[0])
    x, y = 0.3, -0.7
    expected = [(-0.2 * x + 0.4 * y, -0.8 * x - 0.4 * y, 1.2 * x + 0.6 * y), (1, 0, 0)]
    np.testing.assert_allclose(solve(problem).x, expected, rtol=0, atol=rounding(PLANAR_3R, F1, 10.0)[0])


def cross(q):
    """Null vector of the 3R arm (methods 0)."""
    s2, s3, s23 = np.sin(q[1]), np.sin(q[2]), np.sin(q[1] + q[2])
    return np.array([s3, -(s3 + s23), s2 + s23])


def cross_derivative(q):
    """Its derivative (3, 3)."""
    c2, c3, c23 = np.cos(q[1]), np.cos(q[2]), np.cos(q[1] + q[2])
    return np.array([[0, 0, c3], [0, -c23, -c3 - c23], [0, c2 + c23, c23]])


def scalings(q):
    """Four scalings c(q) of the null vector, and their gradients."""
    n = cross(q)
    size = np.linalg.norm(n)
    return [
        (1.0, np.zeros(3)),
        (1 / size, -(n @ cross_derivative(q)) / size**3),
        (2 + np.sin(q[0]) + q[1] ** 2, np.array([np.cos(q[0]), 2 * q[1], 0])),
        (-np.exp(q[2]), np.array([0, 0, -np.exp(q[2])])),
    ]


def by_scaling(q, xdot):
    """Rates of [J; dh/dq] for h = c n'(q - q0) under the four scalings."""
    n, dn, g = cross(q), cross_derivative(q), q - Q0
    h, row = n @ g, dn.T @ g + n
    J = PLANAR_3R.jacobian(q)
    return [np.linalg.solve(np.vstack([J, c * row + h * dc]), [*xdot, 0.0]) for c, dc in scalings(q)]


def test_scaling_of_the_null_vector_does_not_matter_on_the_manifold():
    """Four scalings of N give the framework's rates where h = 0 (5.2)."""
    (expected,), allowed = found(METHOD, PLANAR_3R, F1, at(0.3, -0.7), rest=Q0)
    for one in by_scaling(F1[0], (0.3, -0.7)):
        assert (np.abs(one - expected) <= allowed[0]).all()


def test_scaling_of_the_null_vector_matters_off_the_manifold():
    """At q = (.2, 1.1, -.6), h = .3716, four scalings give four answers (5.2)."""
    q = np.array([0.2, 1.1, -0.6])
    assert abs(cross(q) @ (q - Q0) - 0.3716) < 5e-5
    printed = [
        (-0.4637, 0.4623, -0.3190), (-0.4901, 0.4663, -0.2549), (-0.4490, 0.4601, -0.3547), (-0.4868, 0.4657, -0.2631)
    ]  # fmt: skip
    np.testing.assert_allclose(by_scaling(q, (0.3, -0.7)), printed, rtol=0, atol=6e-5)


def test_orthonormal_null_space_off_the_manifold_is_the_second_scaling():
    """The framework's gauge, N_0 - J^+J N_0 frozen, keeps |N| = 1 to first order: scaling 1/|n|."""
    q = np.array([[0.2, 1.1, -0.6]])
    (qdot,), allowed = found(METHOD, PLANAR_3R, q, at(0.3, -0.7), rest=Q0, tolerance=np.inf)
    assert (np.abs(qdot - by_scaling(q[0], (0.3, -0.7))[1]) <= allowed[0]).all()


def test_three_methods_agree_on_the_manifold():
    """W = H'H, W = Hess L and W = C^-1 - Gamma give the same rates at stable equilibria (I23)."""
    for robot in (robots.load(name) for name in ("planar_3r", "planar_4r", "panda")):
        q, xdot, parameters = mussa_ivaldi_hogan.METHOD.draw(robot, np.random.default_rng(5), COUNT)
        springs = {"stiffness": 1 / parameters["compliance"], "rest": parameters["rest"]}
        one, allowed = found(METHOD, robot, q, xdot, **springs)
        two, more = found(extended_jacobian_hessian.METHOD, robot, q, xdot, **springs)
        three, most = found(mussa_ivaldi_hogan.METHOD, robot, q, xdot, **parameters)
        assert (np.abs(one - two) <= allowed + more).all()
        assert (np.abs(one - three) <= allowed + most).all()


def variant(transform):
    """The cast of M12 with T changed."""

    def wrong(robot, q, xdot, *, stiffness=1.0, rest=None, tolerance=np.inf):
        condition = extended.extremum(robot, q, elastic(robot, stiffness, rest))
        changed = replace(condition, T=transform(condition.T))
        return VelocityProblem(J=condition.J, xdot=xdot, W=extended.extended(changed))

    return wrong


def test_seven_joints_and_two_angular_rows():
    """Where omega_z is left free T is not symmetric, and (T + T')/2 costs percents of qdot; T itself nothing (5.4)."""
    arm = robots.load("seven_joint", PARTIAL)
    drawn = METHOD.draw(arm, np.random.default_rng(6), COUNT)
    right = METHOD.witness(arm, drawn.q, drawn.xdot, **drawn.parameters)
    wrong = solve(variant(lambda T: (T + np.swapaxes(T, 1, 2)) / 2)(arm, drawn.q, drawn.xdot, **drawn.parameters)).x
    cost = np.linalg.norm(wrong - right, axis=1) / np.linalg.norm(right, axis=1)
    assert np.median(cost) > 1e-2


@pytest.mark.parametrize("task, free", [("pose", False), ("position", False), (PARTIAL, True)])
def test_asymmetry_of_t_is_seen_where_angular_velocity_is_partly_free(task, free):
    """N'(T - T') = 0 with all of omega in the task, or none of it; T_ij - T_ji = mu.(z_j x z_i) (5.4)."""
    arm = robots.load("seven_joint", task)
    drawn = METHOD.draw(arm, np.random.default_rng(7), COUNT)
    condition = extended.extremum(arm, drawn.q, elastic(arm, **drawn.parameters))
    twist = condition.T - np.swapaxes(condition.T, 1, 2)
    mu = np.zeros((COUNT, 6))
    mu[:, arm.rows] = condition.multipliers
    axes = arm.geometric(drawn.q)[:, 3:]
    expected = np.einsum("bc,bcij->bij", mu[:, 3:], np.cross(axes[:, :, None, :], axes[:, :, :, None], axis=1))
    size = np.abs(condition.T).max(axis=(1, 2))
    allowed = rounding(arm, drawn.q, size)[:, None, None]
    assert (np.abs(twist - expected) <= allowed).all()
    seen = np.abs(np.swapaxes(condition.N, 1, 2) @ twist)
    assert (seen.max(axis=(1, 2)) > 1e-3 * size).mean() > 0.9 if free else (seen <= allowed).all()


@pytest.mark.parametrize(
    "transform", [lambda T: (T + np.swapaxes(T, 1, 2)) / 2, lambda T: np.swapaxes(T, 1, 2), lambda T: -T, np.zeros_like],
    ids=["symmetrised", "transposed", "wrong sign", "left out"],
)  # fmt: skip
def test_fault_in_t(transform):
    """With T symmetrised, transposed, of wrong sign or left out, framework and original disagree."""
    faulty(METHOD, variant(transform), "seven_joint", task=PARTIAL)


def test_fault_null_space_recomputed_in_a_difference():
    """H by differences of h with a basis computed anew each time (signs and all) is no derivative of anything."""
    rng = np.random.default_rng(8)

    def h(robot, q, g):
        condition = extended.extremum(robot, q, g)
        return np.einsum("bnk,bn->bk", condition.N * rng.choice([-1.0, 1.0], (len(q), 1, robot.k)), condition.gradient)

    def differenced(robot, q, xdot, *, stiffness=1.0, rest=None):
        g = elastic(robot, stiffness, rest)
        steps = STEP * np.eye(robot.n)
        H = np.stack([(h(robot, q + s, g) - h(robot, q - s, g)) / (2 * STEP) for s in steps], axis=-1)
        return VelocityProblem(J=robot.jacobian(q), xdot=xdot, W=extended.Weight(np.zeros((robot.n,) * 2), H))

    faulty(METHOD, differenced, "planar_3r")


def test_refuses_a_start_off_the_manifold():
    """|h| > tol without feedback: the configuration, the distance and the way out are named."""
    q = np.vstack([F1, [[0.2, 1.1, -0.6]]])
    with pytest.raises(OffManifoldError, match=r"configuration 1 of planar_3r.*extremum_feedback") as refusal:
        cast(PLANAR_3R, q, np.ones((2, 2)), rest=Q0)
    assert refusal.value.evidence["index"] == (1,)
    cast(PLANAR_3R, q, np.ones((2, 2)), rest=Q0, tolerance=np.inf)


def test_rest_itself_is_on_the_manifold():
    """At rest grad g vanishes, and so does h."""
    q = np.array([[0.3, 1.1, -0.7]])
    cast(PLANAR_3R, q, at(1, 1), rest=q[0])
    cast(PLANAR_3R, q, at(1, 1), rest=np.nextafter(q[0], 4.0))


def test_refuses_a_bifurcation():
    """F1 with lam = (-1.5, 0): the reduced Hessian n'Hess L n is zero (5.6)."""
    home = rest(PLANAR_3R, F1, (-1.5, 0.0))
    condition = extended.extremum(PLANAR_3R, F1, elastic(PLANAR_3R, 1.0, home))
    assert abs(NULL @ (condition.hessian - condition.T)[0] @ NULL) <= rounding(PLANAR_3R, F1, 9.0)[0]
    with pytest.raises(AlgorithmicSingularityError, match=r"configuration 0 of planar_3r.*bifurcates"):
        cast(PLANAR_3R, F1, at(1, 1), rest=home)


def test_refuses_a_measure_without_hessian():
    """A function g that is not twice differentiable is refused by name."""
    w = manipulability()
    rough = Measure("rough", w.unit, w.about, w.source, w.domain, w.value, w.gradient)
    with pytest.raises(NotTwiceDifferentiableError, match="rough"):
        cast_function(PLANAR_3R, F1, at(1, 1), function=rough)


def test_refuses_singular_arms_no_redundancy_and_springs_that_push():
    """J of lower rank, n = m, a stiffness that is not positive definite: each by its own error."""
    with pytest.raises(RankDeficientError, match="configuration 0 of planar_3r"):
        cast(PLANAR_3R, np.zeros((1, 3)), at(1, 1))
    with pytest.raises(NotRedundantError):
        cast(PLANAR_3R.task("planar pose"), F1, np.zeros((1, 3)), rest=Q0)
    with pytest.raises(WeightNotPositiveDefiniteError, match="stiffness"):
        cast(PLANAR_3R, F1, at(1, 1), stiffness=np.array([1.0, -1, 1]), rest=Q0)


def test_drawn_situations_hold_every_kind_of_extremum():
    """Minima, maxima and saddles: W = H'H follows them all."""
    robot = robots.load("planar_4r")
    drawn = METHOD.draw(robot, np.random.default_rng(9), COUNT)
    condition: Extremum = extended.extremum(robot, drawn.q, elastic(robot, **drawn.parameters))
    reduced = np.linalg.eigvalsh(condition.H @ condition.N)
    kinds = {tuple(row) for row in np.sign(reduced)}
    assert {(1, 1), (-1, 1)} <= kinds
    assert (condition.distance < extended_jacobian.EXTREMAL).all()
