"""Algorithmic singularities: found where closed formulas put them, told from kinematic ones, cured at a price that adds up."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from problems.methods.augmented_jacobian import METHOD as AUGMENTED
from problems.methods.damped_secondary import METHOD as DAMPED
from problems.methods.gradient_projection import METHOD as PROJECTION
from problems.methods.inertia_weighted import METHOD as INERTIA
from problems.methods.mussa_ivaldi_hogan import METHOD as IMPEDANCE
from problems.paths import load
from problems.robots.planar import PLANAR_3R, PLANAR_4R
from problems.weightings.identity import identity
from sandbox.algorithmic_singularity import Price, cure, locate, secondary_rate
from sandbox.errors import RangeError, RefusalError
from sandbox.method import Method
from sandbox.motion import follow
from sandbox.problem import VelocityProblem
from sandbox.weight import Weight

F1 = np.array([0.0, np.pi / 2, -np.pi / 2])
ACROSS = np.array([0.0, 0.3, 1.2])
"""From here the pseudoinverse takes the tip along (1, 1) through q_2 = 0, where det [J; 1 1 1] = sin q_2 is 0."""

ANGLE = {"E": np.ones((1, 3))}
INSTANT = 1e-9
"""A crossing is located in a motion known between samples to 7th order in its steps, hence less sharply than brentq could."""

PINV = replace(
    PROJECTION, name="pseudoinverse",
    cast=lambda robot, q, xdot: VelocityProblem(J=robot.jacobian(q), xdot=xdot, W=identity(robot, q)),
)  # fmt: skip


def test_a_sign_change_is_located_where_q2_is_zero() -> None:
    """Along another law's motion det [J; E] = sin q_2 changes sign: one algorithmic singularity, at the root of q_2(t)."""
    done = follow(PINV, PLANAR_3R, load("straight", length=0.6, direction=(1, 1, 0)), ACROSS)
    (found,) = locate(done, AUGMENTED, PLANAR_3R, **ANGLE)
    instant = brentq(lambda t: done.between(t)[1], 0.0, 1.0, xtol=1e-14)
    assert (found.kind, found.how, found.of) == ("algorithmic", "sign change", "sigma_min(N'E')")
    assert found.t == pytest.approx(instant, abs=INSTANT) and abs(found.q[1]) < INSTANT
    assert found.value < INSTANT and done.sigma_min_J.min() > 0.05  # J is far from singular there


def test_few_samples_find_the_same_instant() -> None:
    """Ten samples and a thousand steps of a controller show the same crossing, as far as each motion is the same."""
    path = load("straight", length=0.6, direction=(1, 1, 0))
    fine, coarse = (
        locate(follow(PINV, PLANAR_3R, path, ACROSS, samples=count), AUGMENTED, PLANAR_3R, **ANGLE)[0].t for count in (500, 10)
    )
    assert coarse == pytest.approx(fine, abs=INSTANT)
    stepped = follow(PINV, PLANAR_3R, path, ACROSS, integrator="steps", steps=1000)
    (found,) = locate(stepped, AUGMENTED, PLANAR_3R, **ANGLE)
    assert found.how == "sign change" and found.t == pytest.approx(fine, abs=0.01)


def test_the_signs_of_bases_make_no_crossing() -> None:
    """Rows E whose basis turns over from one configuration to the next, as an SVD's does, change neither count nor instant."""

    def cast(robot: Any, q: np.ndarray, xdot: np.ndarray) -> VelocityProblem:
        sign = np.where(np.floor(1e6 * q[:, :1]) % 2 == 0, 1.0, -1.0)
        rows = [sign * np.ones((len(q), robot.n)), np.eye(robot.n)[0] * np.ones((len(q), 1))]
        E = np.stack(rows[: robot.n - robot.m], axis=1)
        return VelocityProblem(J=robot.jacobian(q), xdot=xdot, W=Weight(np.zeros((len(q), robot.n, robot.n)), E))

    restless = replace(AUGMENTED, name="restless", cast=cast)
    done = follow(PINV, PLANAR_3R, load("straight", length=0.6, direction=(1, 1, 0)), ACROSS)
    (steady,) = locate(done, AUGMENTED, PLANAR_3R, **ANGLE)
    (found,) = locate(done, restless, PLANAR_3R)
    assert found.how == "sign change" and found.t == pytest.approx(steady.t, abs=INSTANT)
    # planted: the determinant of N'E' itself, with E as it comes
    E = cast(PLANAR_3R, done.q, done.xdot).W.E
    N = np.linalg.svd(PLANAR_3R.jacobian(done.q))[2][:, 2:, :].swapaxes(1, 2)
    assert E is not None and np.sum(np.diff(np.sign(np.linalg.det(E @ N))) != 0) > 10
    q0 = np.array([0.2, 0.9, -0.6, 0.8])
    calm = follow(PINV, PLANAR_4R, load("circle"), q0)
    assert locate(calm, restless, PLANAR_4R, below=0.05) == ()


def test_a_law_meets_its_own_singularity_at_the_end_of_its_motion() -> None:
    """The augmented Jacobian cannot go beyond 2 - sqrt 2 m: its motion ends at the singularity, which is algorithmic only."""
    path = load("through_algorithmic_singularity", length=0.7, duration=0.7)
    done = follow(AUGMENTED, PLANAR_3R, path, F1, **ANGLE)
    (found,) = locate(done, AUGMENTED, PLANAR_3R, **ANGLE)
    assert (found.kind, found.how) == ("algorithmic", "end")
    assert found.t == pytest.approx(2 - np.sqrt(2), abs=INSTANT) and found.value < 1e-6
    assert done.stopped and done.sigma_min_J[-1] > 0.3
    # sigma_min(N'E')^2 is the smallest eigenvalue of N'WN for Gamma = 1
    np.testing.assert_allclose(found.value**2, done.lambda_min_reduced[-1], rtol=1e-6)


def test_a_kinematic_singularity_is_called_so() -> None:
    """At full reach J itself loses rank, whatever the weight."""
    done = follow(PINV, PLANAR_3R, load("through_kinematic_singularity", length=0.9, duration=0.9), F1)
    kinds = [(one.kind, one.how, one.of) for one in locate(done, PINV, PLANAR_3R)]
    assert kinds == [("kinematic", "end", "sigma_min(J)")]


def test_a_near_miss_is_a_minimum() -> None:
    """An eight of 0.5 m brings sigma_min(J) to a minimum between samples: as deep as a fine scan finds it."""
    done = follow(PINV, PLANAR_3R, load("figure_eight", size=0.5), F1)
    found = [one for one in locate(done, PINV, PLANAR_3R, below=0.15) if one.how == "minimum"]
    assert len(found) == 1 and found[0].kind == "kinematic"
    times = found[0].t + np.linspace(-0.05, 0.05, 401)
    sigma = [np.linalg.svd(PLANAR_3R.jacobian(done.between(t)), compute_uv=False) for t in times]
    lowest = min(s[-1] / s[0] for s in sigma)
    assert found[0].share <= lowest * (1 + 1e-12) and found[0].share == pytest.approx(lowest, rel=1e-4)


def dense(level: float) -> Method:
    """W = diag(-2 + 4 (q_2 - level), 1, 1): no factors, and N'WN changes sign."""

    def cast(robot: Any, q: np.ndarray, xdot: np.ndarray) -> VelocityProblem:
        W = np.zeros((len(q), 3, 3)) + np.eye(3)
        W[:, 0, 0] = -2 + 4 * (q[:, 1] - level)
        return VelocityProblem(J=robot.jacobian(q), xdot=xdot, W=W)

    return replace(PINV, name="dense", cast=cast)


def test_a_dense_weight_shows_its_smallest_eigenvalue() -> None:
    """N'WN of a weight without factors changes sign where n'Wn does, n the cross product of the rows of J."""
    done = follow(PINV, PLANAR_3R, load("straight", length=0.5), F1)

    def curvature(t: float) -> float:
        q = done.between(t)
        n = np.cross(*PLANAR_3R.jacobian(q))
        return float(n @ np.diag([-2 + 4 * (q[1] - 1.2), 1, 1]) @ n)

    assert curvature(0.0) > 0 > curvature(1.0)
    (found,) = locate(done, dense(1.2), PLANAR_3R)
    assert (found.kind, found.how, found.of) == ("algorithmic", "sign change", "lambda_min(N'WN)")
    assert found.t == pytest.approx(brentq(curvature, 0.0, 1.0, xtol=1e-14), abs=INSTANT)


def test_elastic_buckling_nearby_is_seen() -> None:
    """From F = (-1.4, 0), where n'Wn = 3 + 2 F_x = 0.2, moving along -x lowers the equilibrium's stability, then lifts it."""
    rest = F1 - PLANAR_3R.jacobian(F1).T @ np.array([-1.4, 0.0])
    done = follow(IMPEDANCE, PLANAR_3R, load("straight", length=0.6, direction=(-1, 0, 0)), F1, rest=rest)
    assert done.lambda_min_reduced[0] == pytest.approx(0.2 / 3, rel=1e-12)  # n'n = 3
    (found,) = locate(done, IMPEDANCE, PLANAR_3R, rest=rest)
    assert (found.how, found.of) == ("minimum", "lambda_min(N'WN)")
    assert 0 < found.value <= done.lambda_min_reduced.min() and found.value == pytest.approx(
        done.lambda_min_reduced.min(), rel=1e-2
    )


@pytest.fixture(scope="module")
def prices() -> tuple[Price, ...]:
    return cure(AUGMENTED, DAMPED, PLANAR_3R, load("through_algorithmic_singularity"), F1, dampings=(0.1, 0.01, 0.001), **ANGLE)


def test_damping_takes_the_hand_through(prices: tuple[Price, ...]) -> None:
    """Undamped the motion stops short; with every base it follows the whole path, the task as exact as ever."""
    undamped, *damped = prices
    assert undamped.stopped and undamped.share == pytest.approx((2 - np.sqrt(2)) / 0.7, abs=1e-9)
    assert [one.damping for one in prices] == [0.0, 0.1, 0.01, 0.001]
    for one in damped:
        assert not one.stopped and one.share == 1 and one.task_error < 5e-11


def test_the_price_of_damping_is_secondary_error(prices: tuple[Price, ...]) -> None:
    """Less damping costs faster joints; the hand's angle, held exactly before, is lost by what it really turned."""
    undamped, *damped = prices
    assert undamped.secondary_rate < 1e-6 < undamped.peak_rate  # up to the rounding of rates of 1e7
    peaks = [one.peak_rate for one in damped]
    assert peaks == sorted(peaks) and peaks[-1] < undamped.peak_rate / 1e4
    for one in damped:
        angle = one.motion.q.sum(axis=1)
        turned = np.abs(angle - angle[0]).max()  # g is integrable: the integral of its rate is its change
        assert one.secondary_error == pytest.approx(turned, rel=1e-2)
        assert turned > 0.18  # beyond 2 - sqrt 2 m the angle cannot be held by anything


def test_a_slide_along_the_singular_set_is_reported_once(prices: tuple[Price, ...]) -> None:
    """A lightly damped arm stays at q_2 near 0: one minimum, not one for every ripple."""
    done = prices[-1].motion
    (found,) = locate(done, DAMPED, PLANAR_3R, base=0.001, **ANGLE)
    assert found.how in ("minimum", "end") and found.of == "sigma_min(N'E')" and found.value < 1e-3
    assert np.sum(np.abs(done.q[:, 1]) < 0.01) > 10


def test_the_secondary_rate_is_that_of_the_closed_formula() -> None:
    """F1, W~ = 0.01 diag(1, 2, 3), e = (1, 1, 1), gbar = 0.9, xdot = (0.3, -0.7): -0.073584905660 (methods M19)."""
    path = load("straight", length=np.hypot(0.3, 0.7), direction=(0.3, -0.7, 0))
    parameters = {"base": 0.01 * np.diag([1.0, 2, 3]), "gbar": np.array([0.9]), **ANGLE}
    done = follow(DAMPED, PLANAR_3R, path, F1, samples=2, **parameters)
    np.testing.assert_allclose(done.qdot[0], [-1.526415094340, 1.226415094340, 1.126415094340], rtol=0, atol=1e-12)
    assert secondary_rate(done, DAMPED, PLANAR_3R, **parameters)[0, 0] == pytest.approx(-0.073584905660, abs=1e-12)


def test_a_controller_jumps_over_the_singularity_and_loses_repeatability() -> None:
    """Held steps carry a circle across det = 0 without a word: the hand closes, the arm may end in its other posture."""
    plane = np.array([[-1.0, -1, 0], [-1, 1, 0]]) / np.sqrt(2)
    gaps = {}
    for radius in (0.25, 0.32):
        gaps[radius] = []
        for steps in (300, 350, 400, 450, 500):
            done = follow(
                AUGMENTED, PLANAR_3R, load("circle", radius=radius, plane=plane), F1, integrator="steps", steps=steps,
                feedback=5.0, **ANGLE,
            )  # fmt: skip
            assert done.stopped == "" and np.abs(done.task_error[-1]).max() < 1e-3
            gaps[radius].append(np.abs(done.postures[1] - F1).max())
    assert max(gaps[0.25]) < 1e-3 and max(gaps[0.32]) > 1


def tilted(share: Callable[[np.ndarray], np.ndarray]) -> Method:
    """A factored weight with sigma_min(N'E') = share of (u), |E| = 1, u the way that joint 1 has gone."""

    def cast(robot: Any, q: np.ndarray, xdot: np.ndarray) -> VelocityProblem:
        J = robot.jacobian(q)
        n = np.cross(J[:, 0], J[:, 1])
        n, r = n / np.linalg.norm(n, axis=-1, keepdims=True), J[:, 0] / np.linalg.norm(J[:, 0], axis=-1, keepdims=True)
        s = share(q[:, :1])
        E = s * n + np.sqrt(1 - s**2) * r
        return VelocityProblem(J=J, xdot=xdot, W=Weight(np.zeros((len(q), 3, 3)), E[:, None, :]))

    return replace(AUGMENTED, name="tilted", cast=cast)


def test_ripples_are_one_minimum_and_dips_are_two() -> None:
    """Ripples of a fifth, each deeper than the last, are reported once, where they are deepest; two dips with a hill, twice."""
    spin = np.array([1.0, 0.1, 0.1])
    done = follow(lambda q, xdot: spin, PLANAR_3R, load("straight"), F1)  # q_1 = t
    ripples = tilted(lambda u: 1e-3 * (1 + 0.2 * np.cos(8 * np.pi * u) - 0.4 * u))
    (found,) = locate(done, ripples, PLANAR_3R)
    assert found.how == "minimum" and found.t == pytest.approx(0.875, abs=0.01)
    assert found.value == pytest.approx(found.share) and found.value < 1e-3 * (0.8 - 0.4 * 0.875) * (1 + 1e-9)
    dips = tilted(lambda u: 1e-3 * (1.1 + np.cos(4 * np.pi * u)))
    both = locate(done, dips, PLANAR_3R)
    np.testing.assert_allclose([one.t for one in both], [0.25, 0.75], rtol=0, atol=1e-6)
    np.testing.assert_allclose([one.value for one in both], 1e-4, rtol=1e-9)


def test_a_null_space_that_swings_round_is_no_crossing() -> None:
    """Passing close by full reach turns N by nearly half a turn between two samples; no singularity is made of that."""
    sweep = np.array([0.0, 0.2, 0.0])
    done = follow(lambda q, xdot: sweep, PLANAR_3R, load("straight"), np.array([0.0, -0.1, 1e-3]), samples=3)
    first = {"E": np.array([[1.0, 0, 0]])}  # N'E' = sin q_3 / |n| has one sign
    assert not [one for one in locate(done, AUGMENTED, PLANAR_3R, below=1e-3, **first) if one.kind == "algorithmic"]


def test_bad_input_is_refused() -> None:
    """A share outside (0, 1], a damping that is not positive, secondary functions of a weight that has none."""
    done = follow(PINV, PLANAR_3R, load("straight"), F1, samples=4)
    for below in (0.0, -1.0, 1.5, np.nan):
        with pytest.raises(RangeError, match="below"):
            locate(done, PINV, PLANAR_3R, below=below)
    for damping in (0.0, -1e-3, np.inf, np.nan):
        with pytest.raises(RangeError, match="damping"):
            cure(AUGMENTED, DAMPED, PLANAR_3R, load("straight"), F1, dampings=(damping,), **ANGLE)
    with pytest.raises(RefusalError, match="secondary functions"):
        secondary_rate(done, INERTIA, PLANAR_3R)
