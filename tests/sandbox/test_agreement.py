"""Framework against original: the bounds let rounding pass and nothing else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from problems.methods import METHODS
from problems.methods.gradient_projection import METHOD
from problems.robots.planar import PLANAR_3R, PLANAR_4R
from sandbox.agreement import SHIFTS, bounds, shifted, study
from sandbox.closed_form.solve import solve
from sandbox.errors import EmptyPlanError, RangeError
from sandbox.law import answer
from sandbox.problem import VelocityProblem
from sandbox.stacked import eigenvalues
from sandbox.weight import Weight

COUNT = 60
ARMS = pytest.mark.parametrize("robot", [PLANAR_3R, PLANAR_4R], ids=lambda robot: robot.name)


@ARMS
def test_every_situation_agrees_as_cast_and_after_each_shift(robot):
    """Liegeois's projection is eq. (6) with W = I, and with every W that differs by what the task rows hide."""
    rows = study(METHOD, robot, count=COUNT)
    assert [row["shift"] for row in rows] == [None, *SHIFTS]
    for row in rows:
        assert row["agreed"] == row["held"] == row["situations"] == COUNT
        assert row["refused"] == 0


@ARMS
@pytest.mark.parametrize("shift", SHIFTS)
def test_a_shift_makes_w_indefinite_and_keeps_the_motion(robot, shift):
    """W + J'AJ and W + J'B + B'J have negative eigenvalues, condition (7) and the old answer."""
    rng = np.random.default_rng(5)
    drawn = METHOD.draw(robot, rng, COUNT)
    problem = METHOD.cast(robot, drawn.q, drawn.xdot)
    moved = shifted(problem, shift, rng)
    assert (eigenvalues(moved.W.dense())[:, 0] < 0).mean() > 0.9
    before, after = solve(problem).x, solve(moved).x
    allowed = sum(sum(bounds(METHOD, p, before, {})) for p in (problem, moved))
    assert (np.abs(after - before).max(axis=-1) <= allowed).all()


def wrong_sign(robot, q, xdot, **parameters):
    return METHOD.original(robot, q, xdot, alpha=-0.5)


def slightly_off(robot, q, xdot, **parameters):
    return METHOD.original(robot, q, xdot) * (1 + 1e-6)


def lost(robot, q, xdot, **parameters):
    return np.full_like(q, np.nan)


@ARMS
@pytest.mark.parametrize("original", [wrong_sign, slightly_off, lost])
def test_a_wrong_original_disagrees(robot, original):
    """The sign of alpha, a relative error of 1e-6 and NaN all exceed the bounds, in every situation."""
    for row in study(replace(METHOD, original=original), robot, count=COUNT):
        assert row["held"] == COUNT and row["agreed"] == 0


def test_refusals_are_counted_with_their_words():
    """Where the closed form refuses, the situation is counted as refused, by its words, and not compared."""

    def cast(robot, q, xdot):
        problem = METHOD.cast(robot, q, xdot)
        return replace_weight(problem, -1.0)

    (row,) = [r for r in study(replace(METHOD, cast=cast), PLANAR_3R, count=COUNT) if r["shift"] is None]
    assert (row["held"], row["refused"], row["agreed"]) == (0, COUNT, 0)
    assert row["ratio_max"] is None and "maximum" in row["refusals"]


def replace_weight(problem, factor):
    return VelocityProblem(J=problem.J, xdot=problem.xdot, W=factor * problem.W.base, a=problem.a)


def test_a_method_without_an_original_is_not_compared():
    """There is nothing to compare with, and the error says so."""
    with pytest.raises(EmptyPlanError, match="gradient_projection has no original"):
        study(replace(METHOD, original=None), PLANAR_3R, count=3)


OTHERS = [
    "weighted_pseudoinverse", "joint_stiffness", "inertia_weighted", "augmented_jacobian", "extended_jacobian",
    "damped_secondary", "least_squares_rank_deficient", "damped_least_squares",
]  # fmt: skip
"""Methods of every task, with weights that are inverted, factored, damped and asked of a slack."""


@pytest.mark.parametrize("name", OTHERS)
def test_bounds_are_no_wider_than_rounding(name):
    """Whatever the task and the weight, an original that is off by a millionth disagrees in nearly every situation."""
    method = METHODS[name]

    def off(robot, q, xdot, **parameters):
        return method.original(robot, q, xdot, **parameters) * (1 + 1e-6)

    for row in study(replace(method, original=off), PLANAR_4R, count=COUNT):
        assert row["held"] == COUNT and row["agreed"] <= COUNT // 20
        assert row["difference_median"] <= row["difference_max"] < 1e-5


@pytest.mark.parametrize("name", OTHERS)
def test_bounds_have_the_unit_of_the_rates(name):
    """Of xdot and a a hundred times as large both bounds are a hundred times as large; of W and a, they stay."""
    method = METHODS[name]
    drawn = method.draw(PLANAR_4R, np.random.default_rng(6), COUNT)
    problem = method.cast(PLANAR_4R, drawn.q, drawn.xdot, **drawn.parameters)
    x = answer(method, PLANAR_4R, problem, drawn.parameters).x
    faster = VelocityProblem(J=problem.J, xdot=128 * problem.xdot, W=problem.W, a=128 * problem.a, Wx=problem.Wx)
    for one, other in zip(
        bounds(method, problem, x, drawn.parameters), bounds(method, faster, 128 * x, drawn.parameters), strict=True
    ):
        np.testing.assert_allclose(other, 128 * one, rtol=1e-6)
        assert (one > 0).all()
    if method.task != "damped":  # where W is weighed against the task
        W = Weight(128 * problem.W.base, problem.W.E, None if problem.W.gamma is None else 128 * problem.W.gamma)
        heavier = VelocityProblem(J=problem.J, xdot=problem.xdot, W=W, a=128 * problem.a, Wx=problem.Wx)
        _, one = bounds(method, problem, x, drawn.parameters)
        _, other = bounds(method, heavier, x, drawn.parameters)
        np.testing.assert_allclose(other, one, rtol=1e-6)


@pytest.mark.parametrize("name", ["weighted_pseudoinverse", "joint_stiffness", "inertia_weighted"])
def test_what_inverts_w_may_lose_its_condition(name):
    """With W of condition 1e6 the original's bound is wider by about that, and only where the method inverts W."""
    method, J = METHODS[name], PLANAR_4R.jacobian(np.array([[0.3, 1.1, -0.7, 0.5]]))
    problem = VelocityProblem(J=J, xdot=np.ones((1, 2)), W=np.diag([1e6, 1.0, 1.0, 1.0]))
    x = solve(problem).x
    sigma = np.linalg.svd(J[0], compute_uv=False)
    (_, inverting), (_, plain) = (bounds(replace(method, inverts_weight=flag), problem, x, {}) for flag in (True, False))
    assert inverting[0] / plain[0] == pytest.approx(1 + 1e6 / (sigma[0] / sigma[-1]), rel=1e-6)
    assert method.inverts_weight


def test_count_and_seed_are_whole_numbers():
    """What is no count, or no seed, is refused by its name; one situation is enough."""
    for given in ({"count": 0}, {"count": True}, {"count": 2.5}, {"seed": -1}, {"seed": None}):
        with pytest.raises(RangeError, match=next(iter(given))):
            study(METHOD, PLANAR_3R, **{"count": 3, **given})
    assert [row["held"] for row in study(METHOD, PLANAR_3R, count=1)] == [1, 1, 1]
