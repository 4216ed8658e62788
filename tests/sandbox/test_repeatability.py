"""Which laws close in the joints when the hand's path closes: drift against printed numbers, brackets against derivatives."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import root

from problems.methods.augmented_jacobian import METHOD as AUGMENTED
from problems.methods.damped_secondary import METHOD as DAMPED
from problems.methods.extended_jacobian import METHOD as EXTENDED
from problems.methods.gradient_projection import METHOD as PROJECTION
from problems.methods.inertia_weighted import METHOD as INERTIA
from problems.methods.joint_stiffness import METHOD as STIFFNESS
from problems.methods.mussa_ivaldi_hogan import METHOD as IMPEDANCE
from problems.methods.weighted_least_norm import METHOD as LEAST_NORM
from problems.paths import load
from problems.robots import load as robot_named
from problems.robots.planar import PLANAR_3R
from problems.weightings.identity import identity
from sandbox.errors import RangeError, RankDeficientError, RefusalError, ShapeError, UnknownNameError
from sandbox.method import Method
from sandbox.motion import Motion, follow
from sandbox.problem import VelocityProblem
from sandbox.repeatability import LimitCycle, drift, lie_brackets, limit_cycle
from sandbox.tolerances import UNIT

F1 = np.array([0.0, np.pi / 2, -np.pi / 2])
F1B = np.array([0.0, np.pi / 2, 0.0])
GENERIC = np.array([0.3, 1.1, -0.7])
REST = np.array([1.0, np.pi / 2, 1 - np.pi / 2])
"""Rest posture of which F1 is the elastic equilibrium under the force (-1, -1) (methods M18)."""

ANGLE = {"E": np.ones((1, 3))}
"""The hand's angle as the secondary function."""

PANDA = np.array([0.1, -0.5, 0.2, -1.8, 0.1, 1.4, 0.5])

PRINTED = 1e-11
"""Drift is printed to eleven digits after the point (methods, Repeatability)."""

PINV = replace(
    PROJECTION, name="pseudoinverse",
    cast=lambda robot, q, xdot: VelocityProblem(J=robot.jacobian(q), xdot=xdot, W=identity(robot, q)),
)  # fmt: skip

REPEATABLE = [
    ("augmented", AUGMENTED, ANGLE), ("extended", EXTENDED, {"rest": REST}), ("impedance", IMPEDANCE, {"rest": REST}),
]  # fmt: skip


@pytest.mark.parametrize(
    ("method", "expected"),
    [
        (PINV, (0.03204222423, -0.03306882381, -0.03101509742)),
        (INERTIA, (0.0738853123, -0.0793407944, -0.0684149084)),
    ],
)
def test_pseudoinverse_and_inertia_drift_by_the_printed_numbers(method: Method, expected: tuple[float, ...]) -> None:
    """Around one square of side 0.4 from F1 the joints come back displaced by the catalogue's numbers."""
    moved = drift(follow(method, PLANAR_3R, load("square", side=0.4), F1))
    digits = PRINTED if method is PINV else 10 * PRINTED  # ten digits
    np.testing.assert_allclose(moved, [expected], rtol=0, atol=digits)


@pytest.mark.parametrize(
    ("method", "parameters", "side", "most"),
    [(AUGMENTED, ANGLE, 0.4, 1e-12), (EXTENDED, {"rest": REST}, 0.2, 7e-13), (IMPEDANCE, {"rest": REST}, 0.2, 7e-13)],
)
def test_laws_with_first_integrals_do_not_drift(method: Method, parameters: dict[str, Any], side: float, most: float) -> None:
    """Augmented Jacobian with gbar = 0, extended Jacobian and Mussa-Ivaldi & Hogan close within the integration's error."""
    moved = drift(follow(method, PLANAR_3R, load("square", side=side), F1, **parameters))
    assert np.abs(moved).max() < most


@pytest.mark.parametrize(("name", "size"), [("circle", "radius"), ("figure_eight", "size")])
@pytest.mark.parametrize(("label", "method", "parameters"), REPEATABLE)
def test_repeatable_laws_close_on_smooth_paths_too(
    name: str, size: str, label: str, method: Method, parameters: dict[str, Any]
) -> None:
    """A circle and an eight end where they began; the pseudoinverse misses by a million times as much."""
    done = follow(method, PLANAR_3R, load(name, **{size: 0.1}), F1, samples=1, rtol=1e-11, **parameters)
    assert np.abs(drift(done)).max() < 1e-10
    if name == "circle":
        assert np.abs(drift(follow(PINV, PLANAR_3R, load(name, **{size: 0.1}), F1, samples=1))).max() > 1e-4


def test_many_cycles_of_a_repeatable_law_are_said_to_be_closed() -> None:
    """Four rounds of the square by the augmented Jacobian add nothing up."""
    found = limit_cycle(follow(AUGMENTED, PLANAR_3R, load("square"), F1, cycles=4, samples=1, **ANGLE))
    assert found.kind == "closed" and found.remaining == 0 and found.limit is not None


def test_a_rate_asked_of_the_secondary_function_opens_the_path() -> None:
    """Planted: with gbar = 0.01 the same augmented Jacobian turns the hand by gbar times the duration."""
    done = follow(AUGMENTED, PLANAR_3R, load("square"), F1, gbar=np.array([0.01]), **ANGLE)
    assert drift(done)[0].sum() == pytest.approx(0.04, abs=1e-11)


def test_damping_destroys_repeatability() -> None:
    """With a base of 0.01 the augmented Jacobian drifts; methods M19 says so."""
    moved = drift(follow(DAMPED, PLANAR_3R, load("square", side=0.2), F1, base=0.01, **ANGLE))
    assert np.abs(moved).max() > 1e-4


def test_end_points_are_roots_of_the_algebraic_system() -> None:
    """I30: the motion ends where tip and first integral say, found by a root finder that knows no path.

    Augmented: (x(q), q1 + q2 + q3); extended and impedance: (x(q), n'(q - rest)), n the cross product of the rows of J.
    """
    curve = load("circle", radius=0.15)

    def tip(q: np.ndarray) -> np.ndarray:
        return PLANAR_3R.forward(q)[0][:2]

    def null(q: np.ndarray) -> np.ndarray:
        return np.cross(*PLANAR_3R.jacobian(q))

    instant = 0.37 * curve.duration
    wanted = tip(F1) + curve.displacement(np.array(instant))[:2]
    integrals = {"augmented": lambda q: q.sum() - F1.sum(), "extended": lambda q: null(q) @ (q - REST)}
    for label, method, parameters in REPEATABLE:
        done = follow(method, PLANAR_3R, curve, F1, **parameters)
        integral = integrals["augmented" if label == "augmented" else "extended"]
        # started some way off, so that the root is not simply what it was given
        found = root(lambda q, i=integral: np.append(tip(q) - wanted, i(q)), done.between(instant) + 0.02, tol=1e-14)
        np.testing.assert_allclose(done.between(instant), found.x, rtol=0, atol=1e-10)  # interpolated to 7th order
        for q in done.q[:: len(done.q) // 7]:
            assert abs(integral(q)) < 1e-11


@pytest.mark.parametrize(("q", "expected"), [(F1, (-2 / 9, 2 / 9, 2 / 9)), (F1B, (0, -1 / 25, 2 / 25))])
def test_brackets_of_the_pseudoinverse_are_the_printed_ones(q: np.ndarray, expected: tuple[float, ...]) -> None:
    """[G_1, G_2] at F1 and F1b, and its component along the null vector."""
    found = lie_brackets(PINV, PLANAR_3R, q)
    np.testing.assert_allclose(found.bracket, [expected], rtol=0, atol=found.error)
    assert found.error < 1e-9 < 0.01 < found.value
    n = np.cross(*PLANAR_3R.jacobian(q))
    n = n / np.linalg.norm(n)
    assert found.reduced is not None
    assert abs(found.reduced[0, 0]) == pytest.approx(abs(n @ np.array(expected)), abs=1e-9)
    if q is F1:
        assert abs(found.reduced[0, 0]) == pytest.approx(2 * np.sqrt(3) / 9, abs=1e-9)


@pytest.mark.parametrize(("robot", "q"), [("planar_3r", GENERIC), ("planar_4r", [0.2, 0.9, -0.6, 0.8]), ("panda", PANDA)])
def test_brackets_are_those_of_the_differentiated_pseudoinverse(robot: str, q: Any) -> None:
    """Independent: dJ^+ = -J^+ dJ J^+ + (I - J^+J) dJ'(JJ')^-1 with the robot's analytic dJ, within the stated error."""
    arm, q = robot_named(robot), np.asarray(q)
    J, dJ = arm.jacobian(q), arm.jacobian_derivative(q)
    P = np.linalg.pinv(J)
    dP = -P @ dJ @ P + (np.eye(arm.n) - P @ J) @ np.swapaxes(dJ, 1, 2) @ np.linalg.inv(J @ J.T)  # [k] = dP/dq_k
    DG = np.moveaxis(dP, 0, -1)  # [:, i, k]
    found = lie_brackets(PINV, arm, q)
    assert len(found.pairs) == arm.m * (arm.m - 1) // 2
    scale = max(np.linalg.norm(DG[:, i], 2) * np.linalg.norm(P[:, j]) for i in range(arm.m) for j in range(arm.m))
    for (i, j), bracket in zip(found.pairs, found.bracket, strict=True):
        exact = DG[:, j] @ P[:, i] - DG[:, i] @ P[:, j]
        assert np.linalg.norm(bracket - exact) < 2 * scale * max(found.error, 1e-12)
    assert not found.integrable


@pytest.mark.parametrize(("label", "method", "parameters"), REPEATABLE)
def test_brackets_of_repeatable_laws_vanish_within_their_error(label: str, method: Method, parameters: dict[str, Any]) -> None:
    """N'W [G_i, G_j] = 0 where a first integral exists; off the manifold only as its neighbours are needed (tolerance)."""
    given = parameters if label == "augmented" else {**parameters, "tolerance": 1.0}
    found = lie_brackets(method, PLANAR_3R, F1, **given)
    assert found.integrable and found.error < 1e-8
    assert found.reduced is not None and np.abs(found.reduced).max() < 1e-8


def test_brackets_on_a_spatial_arm() -> None:
    """On the Panda's pose task an augmented Jacobian is integrable though rotations do not commute; inertia is not."""
    panda = robot_named("panda")
    held = lie_brackets(AUGMENTED, panda, PANDA, E=np.eye(7)[2:3])
    assert held.integrable and held.error < 1e-8
    # rotations themselves have brackets, inside range G
    assert np.abs(held.bracket).max() > 0.1 and np.abs(held.outside).max() < 1e-8
    assert lie_brackets(INERTIA, panda, PANDA).value > 1e-3


def test_a_plain_law_has_the_brackets_of_the_method_that_it_is() -> None:
    """Numpy's pseudoinverse as a function gives the same brackets; it has no W, hence no N'W."""
    found = lie_brackets(lambda q, xdot: np.linalg.pinv(PLANAR_3R.jacobian(q)) @ xdot, PLANAR_3R, GENERIC)
    np.testing.assert_allclose(found.bracket, lie_brackets(PINV, PLANAR_3R, GENERIC).bracket, rtol=0, atol=1e-9)
    assert found.reduced is None


def test_the_drift_of_a_small_square_is_its_bracket() -> None:
    """Around sides -e, e, e, -e the joints move by -e^2 [G_1, G_2] + O(e^3): sign and size of the bracket, and its order."""
    bracket = lie_brackets(PINV, PLANAR_3R, F1).bracket[0]
    errors = []
    for side in (0.04, 0.02):
        moved = drift(follow(PINV, PLANAR_3R, load("square", side=side), F1))[0]
        errors.append(np.linalg.norm(moved / side**2 + bracket))
    assert errors[1] < 0.02 * np.linalg.norm(bracket)
    assert errors[0] / errors[1] == pytest.approx(2, rel=0.1)


def test_the_stated_error_holds_for_coarse_steps() -> None:
    """With steps far too large the stated error grows with the true one and still covers it."""
    exact = np.array([-2 / 9, 2 / 9, 2 / 9])
    for step in (0.4, 0.2, 0.1, 2.0**-5, 2.0**-10):
        found = lie_brackets(PINV, PLANAR_3R, F1, step=step)
        true = np.linalg.norm(found.bracket[0] - exact) / (np.linalg.norm(exact) / found.value)
        assert true < 2 * found.error


def test_zero_is_never_claimed_to_be_exact() -> None:
    """Even differences that vanish to the last bit come with the rounding that G itself may have."""
    constant = np.linalg.pinv(PLANAR_3R.jacobian(F1))
    found = lie_brackets(lambda q, xdot: constant @ xdot, PLANAR_3R, F1)
    assert found.value == 0 and found.integrable and found.error > UNIT


def test_laws_without_a_matrix_G_are_refused() -> None:
    """A secondary motion of its own, and weights that follow the direction of motion, have no brackets; a bad step neither."""
    with pytest.raises(RefusalError, match="while the hand rests"):
        lie_brackets(PROJECTION, PLANAR_3R, GENERIC, alpha=0.5)
    with pytest.raises(RefusalError, match="while the hand rests"):
        lie_brackets(AUGMENTED, PLANAR_3R, GENERIC, gbar=np.array([0.1]), **ANGLE)

    def lopsided(q: np.ndarray, xdot: np.ndarray) -> np.ndarray:
        W = np.diag([1.0, 2 if xdot[0] > 0 else 3, 1])
        J = PLANAR_3R.jacobian(q)
        return np.linalg.solve(W, J.T) @ np.linalg.solve(J @ np.linalg.solve(W, J.T), xdot)

    with pytest.raises(RefusalError, match="not linear"):
        lie_brackets(lopsided, PLANAR_3R, GENERIC)
    for step in (0.0, -0.1, np.nan):
        with pytest.raises(RangeError, match="step"):
            lie_brackets(PINV, PLANAR_3R, GENERIC, step=step)
    assert lie_brackets(LEAST_NORM, PLANAR_3R, GENERIC).value > 0  # weights that q alone decides do


def test_a_task_of_one_row_is_always_integrable() -> None:
    """One row has no pairs: any law for it is repeatable."""
    found = lie_brackets(PINV, PLANAR_3R.task((0,)), GENERIC)
    assert found.pairs == () and found.integrable and found.bracket.shape == (0, 3)


def test_a_flipped_sign_in_the_bracket_is_seen() -> None:
    """Planted: DG_j G_i + DG_i G_j in the place of their difference does not vanish for the augmented Jacobian."""
    found = lie_brackets(AUGMENTED, PLANAR_3R, GENERIC, **ANGLE)
    J, dJ = PLANAR_3R.jacobian(GENERIC), PLANAR_3R.jacobian_derivative(GENERIC)
    full = np.linalg.inv(np.vstack([J, np.ones(3)]))
    dG = -full @ np.concatenate([dJ, np.zeros((3, 1, 3))], axis=1) @ full
    DG, G = np.moveaxis(dG, 0, -1), full[:, :2]
    true, false = (DG[:, 1] @ G[:, 0] + sign * DG[:, 0] @ G[:, 1] for sign in (-1, 1))
    assert np.abs(found.bracket[0] - true).max() < 1e-9 < 0.1 < np.abs(found.bracket[0] - false).max()


def postures(steps: np.ndarray) -> Motion:
    """A motion of which only the postures at the ends of its cycles are of interest."""
    q = np.concatenate([np.zeros((1, steps.shape[1])), np.cumsum(steps, axis=0)])
    still = follow(PINV, PLANAR_3R, load("straight", length=1e-3), F1, samples=1)
    return replace(still, q=q, cycle_ends=np.arange(1, len(q)))


@pytest.mark.parametrize(
    ("kind", "lengths"),
    [
        ("closed", np.full(6, 1e-13)),
        ("converges", 0.1 * 0.5 ** np.arange(12)),
        ("converges", np.array([0.1, 0.2, 1e-3, 1e-12, 0.0])),
        ("shrinks", 0.1 * 0.5 ** np.arange(4)),
        ("shrinks", 0.1 / np.arange(1, 30)),
        ("drifts", np.full(9, 0.1)),
        ("drifts", 0.1 * 1.1 ** np.arange(9)),
    ],
)
def test_sequences_of_postures_are_told_apart(kind: str, lengths: np.ndarray) -> None:
    """Nothing, a geometric, a finite, a short geometric, a harmonic, a constant and a growing sequence of drifts."""
    direction = np.array([0.6, -0.8, 0.0])
    found = limit_cycle(postures(lengths[:, None] * direction))
    assert found.kind == kind
    assert (found.limit is None) == (kind == "drifts")


def test_the_limit_of_a_geometric_drift_is_its_sum() -> None:
    """0.1, 0.07, 0.049, ... tends to 1/3, from any number of cycles on."""
    for count in (4, 10, 25):
        found = limit_cycle(postures(0.1 * 0.7 ** np.arange(count)[:, None] * np.array([1.0, 0, 0])))
        assert found.limit is not None and found.limit[0] == pytest.approx(1 / 3, rel=1e-12)
        assert found.remaining == pytest.approx(0.7**count / 3, rel=1e-9)
        assert found.ratio == pytest.approx(0.7)


@pytest.fixture(scope="module")
def many() -> tuple[Motion, LimitCycle]:
    done = follow(INERTIA, PLANAR_3R, load("square"), F1, cycles=30, samples=1, rtol=1e-8)
    return done, limit_cycle(done)


def test_the_inertia_weighted_arm_finds_a_limit_cycle(many: tuple[Motion, LimitCycle]) -> None:
    """Thirty rounds of the square shrink the drift from 0.13 to below 1e-3; from the limit foretold one closes better."""
    done, found = many
    lengths = np.linalg.norm(drift(done), axis=1)
    assert found.kind == "converges" and lengths[-1] < 1e-3 < 0.1 < lengths[0]
    assert found.limit is not None
    again = follow(INERTIA, PLANAR_3R, load("square"), found.limit, samples=1, rtol=1e-8)
    assert np.linalg.norm(drift(again)) < 0.05 * lengths[-1]


def test_too_few_cycles_are_refused() -> None:
    """Drift needs one finished cycle, a limit four."""
    done = follow(PINV, PLANAR_3R, load("square"), F1, cycles=2, samples=1)
    with pytest.raises(RangeError, match="at least 4"):
        limit_cycle(done)
    stopped = follow(PINV, PLANAR_3R, load("through_kinematic_singularity"), F1)
    with pytest.raises(RangeError, match="no cycle"):
        drift(stopped)


def test_where_a_motion_begins_is_no_part_of_its_drift() -> None:
    """The same steps from postures a hundred radians away are the same kind, with the limit moved along."""
    for lengths in (0.1 * 0.5 ** np.arange(12), 0.1 * 0.5 ** np.arange(4), np.full(9, 0.1)):
        near = postures(lengths[:, None] * np.array([0.6, -0.8, 0.0]))
        one, other = limit_cycle(near), limit_cycle(replace(near, q=near.q + 100.0))
        assert (one.kind, one.ratio, one.remaining) == (other.kind, pytest.approx(other.ratio), pytest.approx(other.remaining))
        if one.limit is not None:
            np.testing.assert_allclose(other.limit, one.limit + 100.0, rtol=0, atol=1e-11)


@pytest.mark.parametrize(("robot", "q"), [("planar_3r", GENERIC), ("planar_4r", [0.2, 0.9, -0.6, 0.8]), ("panda", PANDA)])
def test_the_value_is_a_share_of_what_brackets_could_be(robot: str, q: Any) -> None:
    """The largest |(I - G J)[G_i, G_j]| / (|DG_j||G_i| + |DG_i||G_j|), from the robot's analytic dJ."""
    arm, q = robot_named(robot), np.asarray(q)
    J, dJ = arm.jacobian(q), arm.jacobian_derivative(q)
    P = np.linalg.pinv(J)
    inside = np.eye(arm.n) - P @ J
    DG = np.moveaxis(-P @ dJ @ P + inside @ np.swapaxes(dJ, 1, 2) @ np.linalg.inv(J @ J.T), 0, -1)
    found = lie_brackets(PINV, arm, q)
    shares = []
    for (i, j), outside in zip(found.pairs, found.outside, strict=True):
        exact = inside @ (DG[:, j] @ P[:, i] - DG[:, i] @ P[:, j])
        size = np.linalg.norm(DG[:, j], 2) * np.linalg.norm(P[:, i]) + np.linalg.norm(DG[:, i], 2) * np.linalg.norm(P[:, j])
        assert np.linalg.norm(outside - exact) <= 10 * found.error * size
        shares.append(np.linalg.norm(exact) / size)
    assert found.value == pytest.approx(max(shares), abs=10 * found.error)


def test_reduced_brackets_are_of_the_weight_that_is_followed() -> None:
    """N'W [G_i, G_j] has the W of the parameters given, up to the sign of N."""
    K = np.diag([5.0, 1.0, 0.2])
    found = lie_brackets(STIFFNESS, PLANAR_3R, GENERIC, stiffness=K)
    N = np.linalg.svd(PLANAR_3R.jacobian(GENERIC))[2][2]
    assert found.reduced is not None
    assert abs(found.reduced[0, 0]) == pytest.approx(abs(N @ K @ found.bracket[0]), rel=1e-12)
    default = lie_brackets(STIFFNESS, PLANAR_3R, GENERIC)
    assert default.reduced is not None and abs(abs(default.reduced[0, 0]) - abs(found.reduced[0, 0])) > 1e-3


def test_brackets_are_taken_of_a_law_at_one_regular_configuration() -> None:
    """A name for a law, a stack of configurations, a singular one, or rates of the wrong shape: each by its own error."""
    with pytest.raises(UnknownNameError, match="law"):
        lie_brackets("pseudoinverse", PLANAR_3R, GENERIC)  # type: ignore[arg-type]
    with pytest.raises(ShapeError, match="one configuration"):
        lie_brackets(PINV, PLANAR_3R, [GENERIC])
    with pytest.raises(RankDeficientError, match="row rank"):
        lie_brackets(lambda q, xdot: np.zeros(3), PLANAR_3R, np.zeros(3))
    with pytest.raises(ShapeError, match="rates"):
        lie_brackets(lambda q, xdot: np.zeros(4), PLANAR_3R, GENERIC)
