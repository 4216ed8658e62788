"""The study of methods: where motions start, what is told of them, and that tables of them lose nothing that a plot needs."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from functools import wraps
from typing import Any

import numpy as np
import pyarrow as pa
import pytest

from problems.methods import METHODS as TABLE
from problems.paths import load
from problems.robots import load as robot_named
from problems.robots.planar import PLANAR_3R, PLANAR_4R
from sandbox.algorithmic_singularity import DAMPINGS
from sandbox.errors import RangeError, RefusalError, UnknownNameError
from sandbox.method import STARTS, Method, start
from sandbox.method_study import (
    FRAMES,
    KEPT,
    STEPS,
    Followed,
    agreement_table,
    cured,
    described,
    followed,
    motion_rows,
    motions,
)
from sandbox.problem import VelocityProblem
from sandbox.records import METHODS, MOTIONS, read_part, write_parquet

Array = np.ndarray

F1 = np.array([0.0, np.pi / 2, -np.pi / 2])
REST = np.array([1.0, np.pi / 2, 1 - np.pi / 2])
"""Rest posture of which F1 is the elastic equilibrium under the force (-1, -1) (methods M18)."""

DRIFT = float(np.linalg.norm((0.03204222423, -0.03306882381, -0.03101509742)))
"""Of the pseudoinverse around one square of side 0.4 from F1 (methods, Repeatability)."""

CLOSED = 1e-11
"""Drift [rad] of a law that has a first integral: the integration's error."""

PROJECTION, AUGMENTED, DAMPED = (TABLE[name] for name in ("gradient_projection", "augmented_jacobian", "damped_secondary"))


def quiet(phase: str, done: int, total: int) -> None:
    """Nobody listens."""


def pinv(cycles: int = 1, path: Any = None, **more: Any) -> Followed:
    """The pseudoinverse from F1."""
    return followed(
        PROJECTION, PLANAR_3R, path or load("square", 0.4), cycles=cycles, q=F1, parameters={"alpha": 0.0}, **more
    )  # fmt: skip


@pytest.fixture(scope="module")
def square() -> Followed:
    """Two rounds of the square."""
    return pinv(2)


@pytest.fixture(scope="module")
def into() -> list[Followed]:
    """The augmented Jacobian into its singularity, and past it with damping."""
    path = load("through_algorithmic_singularity")
    return cured(AUGMENTED, DAMPED, PLANAR_3R, path, path.start)


def row_of(one: Followed) -> dict[str, Any]:
    """Its row of the table."""
    (row,) = motion_rows([one]).to_pylist()
    return row


def test_without_a_start_a_method_draws_the_best_conditioned_of_some() -> None:
    """The same seed gives the same start, another seed another one; no other draw has a better conditioned J."""
    method, robot, path = TABLE["inertia_weighted"], PLANAR_4R, load("straight", 0.05)
    drawn = [followed(method, robot, path, cycles=1, seed=seed).motion.q[0] for seed in (3, 3, 4)]
    assert np.array_equal(drawn[0], drawn[1]) and not np.array_equal(drawn[0], drawn[2])
    assert np.array_equal(drawn[0], start(method, robot, 3).q[0])

    def condition(q: Array) -> float:
        return float(np.linalg.cond(robot.jacobian(q)))

    others = [method.draw(robot, np.random.default_rng([3, i]), 1).q[0] for i in range(STARTS)]
    assert condition(drawn[0]) == min(map(condition, others)) < max(map(condition, others))


def test_a_given_start_is_kept_and_nothing_is_drawn() -> None:
    """Motion, drift and bracket are of that configuration, whatever the seed; a method that cannot draw is no obstacle."""

    def never(*_: Any) -> Any:
        raise AssertionError("a start was drawn")

    method = replace(TABLE["inertia_weighted"], draw=never)
    found = [followed(method, PLANAR_3R, load("straight", 0.05), cycles=1, q=F1, seed=seed) for seed in (0, 1)]
    assert np.array_equal(found[0].motion.q[0], F1) and np.array_equal(found[0].motion.q, found[1].motion.q)
    assert found[0].bracket == found[1].bracket and found[0].drift is None


def recording(method: Method, seen: list[Mapping[str, Any]]) -> Method:
    """`method` with the parameters of each of its casts written down."""

    @wraps(method.cast)
    def cast(robot: Any, q: Array, xdot: Array, **parameters: Any) -> VelocityProblem:
        seen.append(parameters)
        return method.cast(robot, q, xdot, **parameters)

    return replace(method, cast=cast)


def test_secondary_functions_rest_unless_they_are_asked_to_move() -> None:
    """What a draw brings is kept, `still` goes before it once the start is checked, the caller's word goes before both."""
    path = load("straight", 0.05)
    seen: list[Mapping[str, Any]] = []
    drawn = start(AUGMENTED, PLANAR_3R, 0)
    followed(recording(AUGMENTED, seen), PLANAR_3R, path, cycles=1)
    assert drawn.parameters["gbar"] is not None  # planted by the draw, taken back by still
    checked, *others = seen
    assert np.array_equal(checked["gbar"], drawn.parameters["gbar"])
    for parameters in others:
        assert parameters["gbar"] is None and set(parameters) == set(drawn.parameters)
    seen.clear()
    asked = followed(recording(AUGMENTED, seen), PLANAR_3R, path, cycles=1, parameters={"gbar": [0.1]})
    assert seen and all(parameters["gbar"] == [0.1] for parameters in seen)
    assert asked.secondary_error is not None and asked.secondary_error < CLOSED


def test_the_pseudoinverse_drifts_by_the_printed_number(square: Followed) -> None:
    """Around one square from F1; each further round adds to it. The Lie bracket said so."""
    assert square.drift is not None and len(square.drift) == 2
    assert square.drift[0] == pytest.approx(DRIFT, abs=1e-11) and square.drift[1] > 1.9 * DRIFT
    assert square.bracket is not None and square.bracket > 0.05
    assert square.singularities == () and square.share == 1 and square.secondary_error is None
    # planted: with the gradient's pull left in, the number is another one
    pulled = followed(PROJECTION, PLANAR_3R, load("square", 0.4), cycles=1, q=F1, parameters={"alpha": 0.01})
    assert pulled.drift is not None and abs(pulled.drift[0] - DRIFT) > 1e-4


@pytest.mark.parametrize(
    ("name", "parameters"),
    [("augmented_jacobian", {}), ("extended_jacobian", {"rest": REST}), ("mussa_ivaldi_hogan", {"rest": REST})],
)
def test_laws_with_first_integrals_close(name: str, parameters: dict[str, Any]) -> None:
    """Drift after each of two rounds is the integration's error; the bracket vanishes."""
    found = followed(TABLE[name], PLANAR_3R, load("square", 0.2), cycles=2, q=F1, parameters=parameters)
    assert found.drift is not None and len(found.drift) == 2 and found.drift.max() < CLOSED
    assert found.bracket is not None and found.bracket < 1e-8 and found.motion.stopped == ""


def test_a_motion_that_stops_is_kept_with_its_reason(into: list[Followed]) -> None:
    """What was followed, at which share of the path, why no further, and the singularity that it met."""
    undamped = into[0]
    assert undamped.motion.stopped and undamped.drift is None
    assert undamped.share == pytest.approx((2 - np.sqrt(2)) / 0.7, abs=1e-6)
    (end,) = undamped.singularities
    assert (end.kind, end.how, end.of) == ("algorithmic", "end", "sigma_min(N'E')")
    row = row_of(undamped)
    assert row["stopped"] == undamped.motion.stopped and row["drift"] is None and not row["closed"]
    assert json.loads(row["singularities"]) == [
        {"kind": "algorithmic", "how": "end", "of": "sigma_min(N'E')", "t": end.t, "value": end.value}
    ]
    assert undamped.summary()["stopped"] == undamped.motion.stopped
    assert f"sigma_min(N'E') = {end.value:.1e} at t = {end.t:.4f} s (end)" in undamped.summary()["singularities"]


def test_a_round_that_is_not_finished_has_no_drift() -> None:
    """A square too large for the arm: no cycle ended, and the table says null, not zero."""
    found = followed(AUGMENTED, PLANAR_3R, load("square", 1.9), cycles=2, q=F1)
    assert found.motion.stopped and 0 < found.share < 0.5 and found.drift is None
    row = row_of(found)
    assert row["drift"] is None and row["closed"] and row["share"] == found.share


def test_a_start_that_is_refused_is_raised() -> None:
    """There is no motion to keep."""
    with pytest.raises(RefusalError):
        followed(AUGMENTED, PLANAR_3R, load("square", 0.2), cycles=1, q=np.zeros(3))


@pytest.mark.parametrize(
    ("name", "words"), [("mussa_ivaldi_hogan", "is not J'F for any force F"), ("extended_jacobian", "no extremum of g")]
)
def test_a_start_off_its_manifold_is_refused_unless_asked_for(name: str, words: str) -> None:
    """That the condition rests on the way is no excuse at the start; a tolerance of the caller's own is."""
    off, path = F1 + np.array([0.0, 0.1, 0.2]), load("straight", 0.01)
    with pytest.raises(RefusalError, match=words):
        followed(TABLE[name], PLANAR_3R, path, cycles=1, q=off, parameters={"rest": REST})
    allowed = followed(TABLE[name], PLANAR_3R, path, cycles=1, q=off, parameters={"rest": REST, "tolerance": 1.0})
    assert allowed.share == 1


def test_a_parameter_that_the_method_lacks_is_refused() -> None:
    """By name, with those that there are."""
    with pytest.raises(UnknownNameError, match="no parameter of gradient_projection is called 'alpah'; there are: alpha"):
        followed(PROJECTION, PLANAR_3R, load("straight", 0.01), cycles=1, q=F1, parameters={"alpah": 0.0})


def test_damping_gets_past_the_singularity_at_a_price(into: list[Followed]) -> None:
    """Undamped first, then every damping: all of the path, peaks that grow and errors that shrink as damping does."""
    assert [one.damping for one in into] == [0.0, *DAMPINGS]
    assert [one.motion.method for one in into] == ["augmented_jacobian"] + ["damped_secondary"] * len(DAMPINGS)
    undamped, *damped = into
    assert all(one.share == 1 and not one.motion.stopped for one in damped)
    peaks, errors = [one.peak_rate for one in damped], [one.secondary_error for one in damped]
    assert peaks == sorted(peaks) and undamped.peak_rate > 1e3 * peaks[-1]
    assert None not in errors and errors == sorted(errors, reverse=True)  # type: ignore[type-var]
    assert undamped.secondary_error is not None and undamped.secondary_error < CLOSED < 0.1 < errors[-1]  # type: ignore[operator]
    assert [row["damping"] for row in motion_rows(into).to_pylist()] == [0.0, *DAMPINGS]
    for one, row in zip(into, motion_rows(into).to_pylist(), strict=True):
        told = (row["share"], row["peak_rate"], row["secondary_error"], row["bracket"])
        assert told == (one.share, one.peak_rate, one.secondary_error, None)


def test_rows_fit_their_schema_and_come_back_from_a_file(square: Followed, into: list[Followed], tmp_path: Any) -> None:
    """Every array has the size that its shape says; a file of them reads back the same."""
    table = motion_rows([square, *into])
    assert table.schema.equals(MOTIONS)
    write_parquet(table, tmp_path / "motions.parquet")
    assert read_part(tmp_path / "motions.parquet", MOTIONS).equals(table)
    for row in table.to_pylist():
        T, n = len(row["t"]), row["n"]
        assert {key: len(row[key]) for key in ("task_error", "lambda_min_reduced", "sigma_min_J")} == dict.fromkeys(
            ("task_error", "lambda_min_reduced", "sigma_min_J"), T
        )
        assert (len(row["q"]), len(row["qdot"]), len(row["hand"])) == (T * n, T * n, 3 * T)
        assert len(row["arm"]) == 3 * (n + 2) * row["frames"] and isinstance(json.loads(row["singularities"]), list)
    row = table.to_pylist()[0]
    assert np.array_equal(np.reshape(row["q"], (-1, 3))[[0, -1]], square.motion.q[[0, -1]])
    assert row["drift"] == list(square.drift) and row["damping"] is None  # type: ignore[arg-type]


def test_thinning_keeps_ends_and_both_sides_of_corners() -> None:
    """Each corner and each joint of rounds is there twice, whatever else of a finely sampled motion is left out."""
    path = load("square", 0.4)
    found = pinv(2)
    assert len(found.motion.t) > 2 * KEPT
    t = np.array(row_of(found)["t"])
    joints = [*path.corners, path.duration, *(path.duration + np.array(path.corners))]
    assert len(joints) == 7 and all((t == instant).sum() == 2 for instant in joints)
    assert t[0] == 0 and t[-1] == 2 * path.duration and np.all(np.diff(t) >= 0)
    assert 2 * KEPT <= len(t) <= 2 * KEPT + 2 * 7
    rates = np.reshape(row_of(found)["qdot"], (-1, 3))
    (before, after) = np.flatnonzero(t == 1.0)
    assert np.linalg.norm(rates[after] - rates[before]) > 0.1  # a corner: the rates jump there and nowhere else
    steps = np.linalg.norm(np.diff(rates, axis=0), axis=1)
    assert steps[np.diff(t) > 0].max() < 0.1


def test_the_stroboscope_holds_the_first_round_and_each_later_end(square: Followed) -> None:
    """Base, joints and hand: FRAMES instants of the first round, then one arm per round, the hand where it began."""
    row = row_of(square)
    arm = np.reshape(row["arm"], (row["frames"], 5, 3))
    assert row["frames"] == FRAMES + 1 and not arm[:, 0].any()
    assert np.array_equal(arm[0, -1], square.motion.hand[0])
    np.testing.assert_allclose(arm[[FRAMES - 1, FRAMES], -1], arm[[0, 0], -1], atol=CLOSED)
    np.testing.assert_allclose(np.linalg.norm(np.diff(arm[:, 1:], axis=1), axis=-1), 1.0, rtol=1e-12)  # unit links


@pytest.mark.parametrize("name", ["damped_least_squares", "least_squares_rank_deficient", "jacobian_transpose"])
def test_laws_that_hold_their_task_roughly_go_in_steps(name: str) -> None:
    """They get the control steps of the study; a number of steps that is given goes before."""
    path = load("straight", 0.1)
    assert TABLE[name].task != "exact"
    usual, given = (followed(TABLE[name], PLANAR_3R, path, cycles=1, q=F1, steps=steps) for steps in (None, 7))
    assert (usual.motion.integrator, len(usual.motion.t)) == ("steps", STEPS + 1)
    assert (given.motion.integrator, len(given.motion.t)) == ("steps", 8)
    assert pinv(path=path).motion.integrator == "solve_ivp" and pinv(path=path, steps=5).motion.integrator == "steps"


def test_one_refused_sample_costs_its_own_numbers_only() -> None:
    """A cast that refuses one configuration between the steps: that sample has no rates, the summary is JSON all the same."""
    path = load("straight", 0.3)
    whole = pinv(path=path)
    refused = whole.motion.q[len(whole.motion.q) // 2]

    @wraps(PROJECTION.cast)
    def cast(robot: Any, q: Array, xdot: Array, **parameters: Any) -> VelocityProblem:
        if (np.abs(q - refused).max(axis=-1) < 1e-12).any():
            raise RangeError("a hole")
        return PROJECTION.cast(robot, q, xdot, **parameters)

    found = followed(replace(PROJECTION, cast=cast), PLANAR_3R, path, cycles=1, q=F1, parameters={"alpha": 0.0})
    assert np.isnan(found.motion.qdot).any(axis=-1).sum() == 1 and found.motion.stopped == ""
    assert found.peak_rate == pytest.approx(whole.peak_rate, rel=1e-6)
    json.dumps(found.summary(), allow_nan=False)


def test_every_method_on_every_robot_is_followed_and_told() -> None:
    """Methods times robots, in that order, each told once."""
    told: list[tuple[str, int, int]] = []
    some = [TABLE["gradient_projection"], TABLE["inertia_weighted"]]
    found = motions(
        some, [PLANAR_3R, PLANAR_4R], lambda robot: load("straight", 0.01 * robot.n), cycles=1,
        told=lambda *one: told.append(one),
    )  # fmt: skip
    assert [(one.motion.method, one.motion.robot) for one in found] == [
        (method.name, robot) for method in some for robot in ("planar_3r", "planar_4r")
    ]
    assert told == [("motions", k, 4) for k in range(1, 5)]
    moved = [np.linalg.norm(one.motion.hand[-1] - one.motion.hand[0]) for one in found]
    np.testing.assert_allclose(moved, [0.03, 0.04] * 2, atol=CLOSED)


def test_the_table_of_agreement_counts_what_was_asked() -> None:
    """A row per method, robot and form of W; a planted sign of alpha disagrees in all of them."""
    method = PROJECTION
    told: list[tuple[str, int, int]] = []
    table = agreement_table([method], [PLANAR_3R, PLANAR_4R], count=20, told=lambda *one: told.append(one))
    assert table.schema.equals(METHODS) and told == [("agreement", 1, 2), ("agreement", 2, 2)]
    rows = table.to_pylist()
    assert [(row["robot"], row["shift"]) for row in rows] == [
        (robot, shift) for robot in ("planar_3r", "planar_4r") for shift in (None, "J'AJ", "J'B + B'J")
    ]
    assert all(row["situations"] == row["held"] == row["agreed"] == 20 and row["refused"] == 0 for row in rows)
    wrong = replace(method, original=lambda *given, **_: method.witness(*given, alpha=-0.5))
    assert not any(row["agreed"] for row in agreement_table([wrong], [PLANAR_3R], count=20, told=quiet).to_pylist())
    again = agreement_table([method], [PLANAR_3R, PLANAR_4R], count=20, told=quiet)
    assert again.drop_columns("seconds").equals(table.drop_columns("seconds"))


def test_what_a_method_is_goes_into_json() -> None:
    """All 23, in their order, with what the report shows; no function among it."""
    rows = described(TABLE.values())
    assert [row["name"] for row in rows] == list(TABLE) and len(rows) == 23
    assert json.loads(json.dumps(rows, allow_nan=False)) == [
        row | {"works": list(row["works"]), "refuses": list(row["refuses"])} for row in rows
    ]
    assert {"id", "title", "formula", "weight", "vector", "condition", "number", "certainty", "form", "task"} < set(rows[0])


def test_no_motion_makes_an_empty_table() -> None:
    """With the same columns."""
    assert motion_rows([]).equals(MOTIONS.empty_table()) and isinstance(motion_rows([]), pa.Table)


def test_a_motion_in_space_has_its_row_too() -> None:
    """The Panda: seven joints, six task rows, an arm of nine points a frame."""
    found = followed(TABLE["inertia_weighted"], robot_named("panda"), load("circle", 0.05), cycles=1)
    row = row_of(found)
    assert (row["n"], row["m"], row["frames"], len(row["arm"])) == (7, 6, FRAMES, 3 * 9 * FRAMES)
    assert found.drift is not None and found.drift[0] > 1e-4 and max(row["task_error"]) < 1e-10
