"""Framework against original: the bounds let rounding pass and nothing else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from problems.methods.gradient_projection import METHOD
from problems.robots.planar import PLANAR_3R, PLANAR_4R
from sandbox.agreement import SHIFTS, bounds, shifted, study
from sandbox.closed_form.solve import solve
from sandbox.errors import EmptyPlanError
from sandbox.stacked import eigenvalues

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
    from sandbox.problem import VelocityProblem

    return VelocityProblem(J=problem.J, xdot=problem.xdot, W=factor * problem.W.base, a=problem.a)


def test_a_method_without_an_original_is_not_compared():
    """There is nothing to compare with, and the error says so."""
    with pytest.raises(EmptyPlanError, match="gradient_projection has no original"):
        study(replace(METHOD, original=None), PLANAR_3R, count=3)
