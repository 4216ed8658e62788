"""Motions: the task is met, the integrators agree, corners are met exactly, and a refusal ends a motion but loses nothing."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from problems.methods.augmented_jacobian import METHOD as AUGMENTED
from problems.methods.gradient_projection import METHOD as PROJECTION
from problems.methods.inertia_weighted import METHOD as INERTIA
from problems.paths import load
from problems.paths.path import Path
from problems.robots import load as robot_named
from problems.robots.planar import PLANAR_3R
from problems.weightings.identity import identity
from sandbox import algorithmic_singularity, law, motion, repeatability
from sandbox.errors import ConditionSevenError, NonFiniteError, RangeError, RefusalError, ShapeError, UnknownNameError
from sandbox.method import Method
from sandbox.motion import follow
from sandbox.problem import VelocityProblem
from sandbox.tolerances import INTEGRATION, UNIT
from sandbox.weight import Weight

F1 = np.array([0.0, np.pi / 2, -np.pi / 2])
ALLOWED = 50 * INTEGRATION
"""Global error of a motion of a few hundred steps, each of them within INTEGRATION."""


def cast_by(weight: Callable[[Any, np.ndarray], Weight]) -> Method:
    """A method with this weight and no secondary motion."""
    return replace(
        PROJECTION, name="by_weight",
        cast=lambda robot, q, xdot: VelocityProblem(J=robot.jacobian(q), xdot=xdot, W=weight(robot, q)),
    )  # fmt: skip


PINV = cast_by(identity)


def pinv(q: np.ndarray, xdot: np.ndarray) -> np.ndarray:
    """J^+ xdot as a plain function."""
    rates: np.ndarray = np.linalg.pinv(PLANAR_3R.jacobian(q)) @ xdot
    return rates


@pytest.mark.parametrize("name", ["straight", "circle", "square", "figure_eight"])
@pytest.mark.parametrize("cycles", [1, 3])
def test_the_hand_follows_its_path(name: str, cycles: int) -> None:
    """The task error stays within the integration's, over every cycle, and the record says where each cycle ends."""
    path = load(name)
    if not path.closed and cycles > 1:
        with pytest.raises(RangeError, match="open"):
            follow(PINV, PLANAR_3R, path, F1, cycles=cycles)
        return
    done = follow(PINV, PLANAR_3R, path, F1, cycles=cycles)
    assert done.stopped == "" and len(done.cycle_ends) == cycles
    assert np.abs(done.task_error).max() < cycles * ALLOWED
    np.testing.assert_allclose(done.t[done.cycle_ends], path.duration * np.arange(1, cycles + 1), rtol=4 * UNIT)
    assert np.all(np.diff(done.t) >= 0)
    moved = done.hand - done.hand[0]
    local = done.t[: done.cycle_ends[0] + 1]
    np.testing.assert_allclose(moved[: len(local)], path.displacement(local), atol=ALLOWED)


def test_the_integration_is_that_of_scipy() -> None:
    """A smooth piece ends where scipy's own solve_ivp (Radau and DOP853) ends with the plain law."""
    path = load("circle")
    done = follow(PINV, PLANAR_3R, path, F1)
    for scheme, rtol in (("DOP853", 1e-12), ("LSODA", 1e-11)):
        theirs = solve_ivp(
            lambda t, q: pinv(q, path.velocity(t)[:2]), (0, path.duration), F1, method=scheme, rtol=rtol, atol=rtol
        )
        np.testing.assert_allclose(done.postures[1], theirs.y[:, -1], rtol=0, atol=1e3 * rtol)


def test_a_plain_law_moves_as_the_method_that_it_is() -> None:
    """The framework's pseudoinverse and numpy's as a function (q, xdot) -> qdot give the same motion; only (7) is unknown."""
    ours = follow(PINV, PLANAR_3R, load("square"), F1)
    plain = follow(pinv, PLANAR_3R, load("square"), F1)
    np.testing.assert_allclose(plain.postures, ours.postures, rtol=0, atol=ALLOWED)
    assert np.isnan(plain.lambda_min_reduced).all() and np.isfinite(plain.qdot).all()
    assert (plain.method, ours.method) == ("pinv", "by_weight")


def test_diagnostics_are_those_of_each_sample() -> None:
    """qdot, sigma_min(J), lambda_min(N'WN) and a measure, computed stacked, are what each sample gives by itself."""
    done = follow(INERTIA, PLANAR_3R, load("square"), F1, measures={"sum": lambda robot, q: q.sum(axis=-1)})
    for i in range(0, len(done.t), 37):
        q = done.q[i]
        J, M = PLANAR_3R.jacobian(q), PLANAR_3R.inertia(q)
        n = np.cross(*J) / np.linalg.norm(np.cross(*J))
        assert done.lambda_min_reduced[i] == pytest.approx(n @ M @ n, rel=1e-12)
        assert done.sigma_min_J[i] == pytest.approx(np.linalg.svd(J, compute_uv=False)[-1], rel=1e-12)
        np.testing.assert_allclose(
            done.qdot[i], law.rates(INERTIA, PLANAR_3R, q[None], done.xdot[i][None])[0], rtol=0, atol=1e-12
        )
        assert done.measures["sum"][i] == pytest.approx(q.sum())
    assert not done.q.flags.writeable and not done.measures["sum"].flags.writeable


def test_joint_rates_jump_at_corners_and_nowhere_else() -> None:
    """At each corner of a square two samples share the instant and the posture, and ask for the sides before and after."""
    done = follow(PINV, PLANAR_3R, load("square", side=0.4, duration=4.0), F1)
    twice = np.flatnonzero(np.diff(done.t) == 0)
    np.testing.assert_allclose(done.t[twice], [1, 2, 3], rtol=4 * UNIT)
    np.testing.assert_array_equal(done.q[twice], done.q[twice + 1])
    np.testing.assert_allclose(done.xdot[twice], [[-0.4, 0], [0, 0.4], [0.4, 0]], atol=1e-15)
    np.testing.assert_allclose(done.xdot[twice + 1], [[0, 0.4], [0.4, 0], [0, -0.4]], atol=1e-15)
    smooth = np.delete(np.abs(np.diff(done.qdot, axis=0)).max(axis=1), twice)
    assert smooth.max() < 0.02 < np.abs(done.qdot[twice + 1] - done.qdot[twice]).max(axis=1).min()


def test_a_motion_is_known_between_its_samples() -> None:
    """`between` meets the samples of a motion, and the path halfway between them."""
    path = load("circle")
    done = follow(PINV, PLANAR_3R, path, F1, cycles=2, samples=20)
    for i in range(len(done.t) - 1):
        np.testing.assert_allclose(done.between(done.t[i]), done.q[i], rtol=0, atol=ALLOWED)
    for t in (0.123, 3.9, 4.1, 7.77):
        tip = PLANAR_3R.forward(done.between(t))[0] - done.hand[0]
        np.testing.assert_allclose(tip, path.displacement(np.array(t % 4.0)), rtol=0, atol=1e-9)  # interpolated to 7th order


def test_fixed_steps_are_first_order() -> None:
    """Halving the controller's step halves its distance from the true motion, to within a tenth."""
    path = load("circle")
    true = follow(PINV, PLANAR_3R, path, F1).postures[1]
    errors = [
        np.linalg.norm(follow(PINV, PLANAR_3R, path, F1, integrator="steps", steps=count).postures[1] - true)
        for count in (100, 200, 400)
    ]
    assert errors[0] / errors[1] == pytest.approx(2, rel=0.1) and errors[1] / errors[2] == pytest.approx(2, rel=0.05)


def test_held_rates_are_what_moved_the_joints() -> None:
    """In a stepped motion each posture is the last one plus step times rate held, across cycles too."""
    done = follow(PINV, PLANAR_3R, load("square"), F1, integrator="steps", steps=50, cycles=2)
    assert done.q.shape == (101, 3) and done.cycle_ends.tolist() == [50, 100]
    np.testing.assert_allclose(np.diff(done.q, axis=0), 0.08 * done.qdot[:-1], rtol=0, atol=8 * UNIT)
    np.testing.assert_allclose(done.t, 0.08 * np.arange(101), rtol=1e-14)
    np.testing.assert_allclose(done.between(0.04), (done.q[0] + done.q[1]) / 2, rtol=0, atol=8 * UNIT)


def test_the_last_step_of_an_open_path_is_measured_at_its_end() -> None:
    """A stepped motion along a line ends at the line's end, and its task error there is that of its steps, not of a round."""
    path = load("straight", length=0.3)
    done = follow(PINV, PLANAR_3R, path, F1, integrator="steps", steps=400)
    assert done.t[-1] == path.duration and np.abs(done.task_error[-1]).max() < 1e-3
    np.testing.assert_allclose(done.hand[-1] - done.hand[0] - [0.3, 0, 0], [*done.task_error[-1], 0], atol=1e-15)


def test_feedback_removes_what_steps_lose() -> None:
    """With feedback the task error of a stepped motion stays bounded over cycles; without it it grows."""
    loose, held = (
        follow(PINV, PLANAR_3R, load("circle"), F1, integrator="steps", steps=100, cycles=5, feedback=gain) for gain in (0, 10)
    )
    size = [np.linalg.norm(one.task_error, axis=1) for one in (loose, held)]
    assert size[1].max() < size[0].max() / 5
    assert size[0][loose.cycle_ends[-1]] > 4 * size[0][loose.cycle_ends[0]]
    assert size[1][held.cycle_ends[-1]] < 1.5 * size[1][held.cycle_ends[0]]


def test_orientation_rows_are_held() -> None:
    """A planar arm asked for its pose keeps its angle along the path; a 7-joint arm asked for its pose keeps its rotation."""
    arm = robot_named("planar_4r", "planar pose")
    done = follow(PINV, arm, load("circle"), np.array([0.3, 0.9, -0.7, 0.4]))
    assert np.ptp(done.q.sum(axis=1)) < ALLOWED and np.abs(done.task_error).max() < ALLOWED
    spatial = robot_named("seven_joint")
    q0 = np.array([0.1, 0.6, 0.2, 1.2, 0.1, 0.7, 0.3])
    done = follow(PINV, spatial, load("circle", radius=0.1, plane="xz"), q0)
    turned = spatial.forward(done.q)[1]
    assert np.abs(turned - turned[0]).max() < ALLOWED and np.abs(done.task_error).max() < ALLOWED


def test_the_rotation_error_is_the_rotation_made() -> None:
    """A hand turned at a constant rate omega, base axes, about an axis that is none of its own, is off by omega t."""
    spatial = robot_named("seven_joint")
    omega = np.array([0.3, -0.5, 0.4])

    def turning(q: np.ndarray, xdot: np.ndarray) -> np.ndarray:
        rates: np.ndarray = np.linalg.pinv(spatial.jacobian(q)) @ (xdot + np.append(np.zeros(3), omega))
        return rates

    done = follow(turning, spatial, load("straight", length=0.05), np.array([0.1, 0.6, 0.2, 1.2, 0.1, 0.7, 0.3]))
    np.testing.assert_allclose(done.task_error[:, 3:], done.t[:, None] * omega, rtol=0, atol=1e-11)
    assert np.abs(done.task_error[:, :3]).max() < ALLOWED


def test_an_angle_that_does_not_exist_is_not_reported() -> None:
    """Holding the rate about one axis of a hand that turns about others too integrates to no angle: NaN."""
    spatial = robot_named("seven_joint", (0, 1, 2, 5))
    done = follow(PINV, spatial, load("circle", radius=0.1, plane="xz"), np.array([0.1, 0.6, 0.2, 1.2, 0.1, 0.7, 0.3]))
    assert np.abs(done.task_error[:, :3]).max() < ALLOWED
    assert np.isnan(done.task_error[5:, 3]).all() and done.task_error[0, 3] == 0


def test_a_path_through_full_reach_stops_there() -> None:
    """Beyond full reach no joint rates exist: the motion ends at 3 - sqrt 5 m, keeps what it did, and says why."""
    done = follow(PINV, PLANAR_3R, load("through_kinematic_singularity", length=0.9, duration=0.9), F1)
    # q goes like the root of the time left: rtol in q is its square in t
    assert done.t[-1] == pytest.approx(3 - np.sqrt(5), abs=1e-9)
    assert done.stopped and len(done.cycle_ends) == 0 and done.postures.shape == (1, 3)
    assert done.sigma_min_J[-1] < 1e-6 < done.sigma_min_J[0]
    assert np.isfinite(done.q).all() and len(done.t) > 100
    assert np.abs(done.task_error).max() < ALLOWED


def forbidden(limit: float) -> Method:
    """A pseudoinverse whose cast refuses q_2 below a limit, as a barrier does."""

    def cast(robot: Any, q: np.ndarray, xdot: np.ndarray) -> VelocityProblem:
        if (q[:, 1] < limit).any():
            raise RefusalError(f"joint 2 is below its limit of {limit} rad")
        return PINV.cast(robot, q, xdot)

    return replace(PINV, name="barrier", cast=cast)


@pytest.mark.parametrize("options", [{}, {"integrator": "steps", "steps": 500}])
def test_a_law_that_refuses_on_the_way_ends_the_motion_at_its_border(options: dict[str, Any]) -> None:
    """A barrier met on the way: the words are kept, the motion reaches the barrier, and its beginning is the free motion's."""
    path = load("straight", length=0.5)
    free = follow(PINV, PLANAR_3R, path, F1, **options)
    done = follow(forbidden(1.2), PLANAR_3R, path, F1, **options)
    assert done.stopped == "joint 2 is below its limit of 1.2 rad"
    assert 0 < done.t[-1] < path.duration
    reached = 1e-8 if not options else 0.01  # a controller steps over it and is told afterwards
    assert abs(done.q[-1, 1] - 1.2) < reached
    np.testing.assert_allclose(done.q[-1], free.between(float(done.t[-1])), rtol=0, atol=1e-9)
    assert np.isfinite(done.qdot).all()


def test_condition_seven_lost_on_the_way_ends_the_motion() -> None:
    """A dense weight whose N'WN falls through zero on the way stops the motion by name."""

    def weight(robot: Any, q: np.ndarray) -> Weight:
        W = np.zeros((len(q), 3, 3)) + np.eye(3)
        W[:, 0, 0] = -2.0 + 4 * (q[:, 1] - 1.2)  # N'WN = 0 at F1 where W_11 = -2
        return Weight(W)

    done = follow(cast_by(weight), PLANAR_3R, load("straight", length=0.5), F1)
    assert "condition (7)" in done.stopped and "Way out" in done.stopped
    assert 0 < done.t[-1] < 1 and 0 <= done.lambda_min_reduced[-1] < 1e-6 < done.lambda_min_reduced[0]


def test_a_refusal_at_the_start_is_raised() -> None:
    """Where the law refuses q0 itself there is no motion: the error is the law's own."""
    with pytest.raises(RefusalError, match="joint 2"):
        follow(forbidden(2.0), PLANAR_3R, load("circle"), F1)
    bad = cast_by(lambda robot, q: Weight(np.broadcast_to(np.diag([-3.0, 1, 1]), (len(q), 3, 3))))
    with pytest.raises(ConditionSevenError):
        follow(bad, PLANAR_3R, load("circle"), F1)


def test_a_law_that_is_not_finite_or_of_the_wrong_shape_is_told() -> None:
    """NaN rates end a motion; rates of the wrong shape are an error at once."""

    def late(q: np.ndarray, xdot: np.ndarray) -> np.ndarray:
        return pinv(q, xdot) if q[1] > 1.5 else np.full(3, np.nan)

    done = follow(late, PLANAR_3R, load("straight"), F1)
    assert "not finite" in done.stopped and done.q[-1, 1] == pytest.approx(1.5, abs=1e-6)
    with pytest.raises(NonFiniteError):
        follow(lambda q, xdot: np.full(3, np.nan), PLANAR_3R, load("straight"), F1)
    with pytest.raises(ShapeError, match="qdot of the law"):
        follow(lambda q, xdot: np.zeros(2), PLANAR_3R, load("straight"), F1)
    with pytest.raises(RangeError, match="one configuration"):
        follow(lambda q, xdot: np.zeros((1, 3)), PLANAR_3R, load("straight"), F1)


def test_a_law_that_chatters_is_stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    """A law that pulls one way and the other across a line cannot be integrated to rtol: it is stopped by its count."""
    monkeypatch.setattr(motion, "MOST_EVALUATIONS", 2000)

    def relay(q: np.ndarray, xdot: np.ndarray) -> np.ndarray:
        n = np.cross(*PLANAR_3R.jacobian(q))
        return pinv(q, xdot) - 5 * np.sign(q[0] - 0.05) * np.sign(n[0]) * n

    done = follow(relay, PLANAR_3R, load("straight"), F1)
    assert done.stopped and done.evaluations < 2100 and done.t[-1] < 1


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"integrator": "rk4"}, UnknownNameError, "solve_ivp"),
        ({"cycles": 0}, RangeError, "cycles"),
        ({"cycles": -3}, RangeError, "cycles"),
        ({"cycles": 1.5}, RangeError, "cycles"),
        ({"cycles": True}, RangeError, "cycles"),
        ({"steps": 0}, RangeError, "steps"),
        ({"samples": 0}, RangeError, "samples"),
        ({"feedback": -1.0}, RangeError, "feedback"),
        ({"feedback": np.nan}, RangeError, "feedback"),
        ({"rtol": 0.0}, RangeError, "rtol"),
        ({"rtol": 1e-15}, RangeError, "rtol"),
        ({"rtol": 1.0}, RangeError, "rtol"),
    ],
)
def test_bad_options_are_refused_by_name(options: dict[str, Any], error: type[Exception], words: str) -> None:
    """Unknown integrator, no or negative cycles, no steps, negative feedback, rtol out of range: each names itself."""
    with pytest.raises(error, match=words):
        follow(PINV, PLANAR_3R, load("circle"), F1, **options)


def test_bad_starts_paths_and_parameters_are_refused() -> None:
    """q0 of the wrong shape or not finite, a path out of the arm's plane, a parameter that the law does not take."""
    circle = load("circle")
    with pytest.raises(ShapeError, match="q0"):
        follow(PINV, PLANAR_3R, circle, F1[:2])
    with pytest.raises(RangeError, match="one configuration"):
        follow(PINV, PLANAR_3R, circle, F1[None])
    with pytest.raises(NonFiniteError, match="q0"):
        follow(PINV, PLANAR_3R, circle, [0, np.nan, 1])
    with pytest.raises(RangeError, match="along z"):
        follow(PINV, PLANAR_3R, load("circle", plane="xz"), F1)
    with pytest.raises(UnknownNameError, match="plain law"):
        follow(pinv, PLANAR_3R, circle, F1, alpha=1.0)
    with pytest.raises(UnknownNameError, match="'alpha'; there are: E, gamma, gbar"):
        follow(AUGMENTED, PLANAR_3R, circle, F1, alpha=1.0)


def test_no_method_has_a_parameter_that_a_motion_would_swallow() -> None:
    """Options of follow, locate, cure, secondary_rate, price and lie_brackets share no name with a parameter of a method."""
    from problems.methods import METHODS

    functions = (
        follow, algorithmic_singularity.locate, algorithmic_singularity.cure, algorithmic_singularity.price,
        algorithmic_singularity.secondary_rate, repeatability.lie_brackets,
    )  # fmt: skip
    options = {name for f in functions for name in inspect.signature(f).parameters} - {"robot", "q", "parameters"}
    for method in (*METHODS.values(), AUGMENTED, INERTIA):
        taken = set(inspect.signature(method.cast).parameters) - {"robot", "q", "xdot"}
        assert not options & taken, method.name


def test_a_swapped_axis_of_the_task_is_seen() -> None:
    """Planted: a law that answers for the mirrored task velocity leaves the path, and the task error says so."""
    done = follow(lambda q, xdot: pinv(q, xdot[::-1]), PLANAR_3R, load("circle"), F1)
    assert np.abs(done.task_error).max() > 0.1


def test_a_corner_that_is_not_announced_is_still_integrated_but_dear() -> None:
    """Told where the corners are, the integrator spends a fraction of what it spends finding them; the ends agree."""
    square = load("square")
    hidden = Path(
        name="hidden", duration=square.duration, displacement=square.displacement, velocity=square.velocity, closed=True
    )
    told, found = (follow(PINV, PLANAR_3R, path, F1) for path in (square, hidden))
    assert 3 * told.evaluations < found.evaluations
    np.testing.assert_allclose(told.postures, found.postures, rtol=0, atol=1e-9)
