"""Truths by certificate are those of exact arithmetic, which decides what no certificate does."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sandbox.closed_form.vectorised import LARGEST
from sandbox.problem import VelocityProblem
from sandbox.reference import certified as module
from sandbox.reference import truth
from sandbox.reference.certified import CLOSE, REASON, certified, proved
from sandbox.reference.truth import REASONS
from sandbox.weight import Weight
from sandbox.yardstick import Yardstick

Array = np.ndarray


def ordinary(B: int = 5, m: int = 2, n: int = 3, k: int = 0) -> VelocityProblem:
    """Well-conditioned problems with a minimum."""
    rng = np.random.default_rng([81, m, n, k])
    weight = Weight(np.eye(n), np.tile(rng.normal(size=(1, k, n)), (B, 1, 1)), np.ones((B, k))) if k else Weight(np.eye(n))
    return VelocityProblem(J=rng.normal(size=(B, m, n)), xdot=rng.normal(size=(B, m)), W=weight, a=rng.normal(size=(B, n)))


def test_every_truth_is_the_exact_one(decided: list[Any]) -> None:
    """Class, reason, rank, inertia; margin and value but for rounding; answers within their radius, exact ones to the bit."""
    for name, problem, truths in decided:
        found = certified(problem, worthwhile=1)
        assert len(found.truths) == len(problem)
        for i, (ours, right) in enumerate(zip(found.truths, truths, strict=True)):
            told = name, problem.J[i].tolist(), problem.W.base[i].tolist()
            assert (ours.expected, ours.reason, ours.rank, ours.inertia) == (
                right.expected,
                right.reason,
                right.rank,
                right.inertia,
            ), told
            assert ours.margin == pytest.approx(right.margin, rel=1e-6, abs=1e-13), told
            assert ours.freedom.shape == right.freedom.shape
            if right.x is None:
                assert ours.x is None and ours.y is None and ours.value is None and np.isnan(found.x_radius[i])
                continue
            if found.exactly[i]:
                assert (ours.x == right.x).all() and (ours.y == right.y).all() and ours.value == right.value
                continue
            assert (
                np.abs(ours.x - right.x).max() <= 2 * found.x_radius[i]
                and np.abs(ours.y - right.y).max() <= 2 * found.y_radius[i]
            )
            terms = np.abs(right.x) @ (np.abs(problem.W.dense()[i]) @ np.abs(right.x) / 2 + np.abs(problem.a[i]))
            assert abs(ours.value - right.value) <= 1e-13 * terms, told


def test_arrays_say_what_the_truths_say(decided: list[Any]) -> None:
    """Reasons, rank, inertia, x and y of a stack are those of its truths."""
    for _, problem, _ in decided[::7]:
        found = certified(problem, worthwhile=1)
        assert [REASON[code] for code in found.reason] == [t.reason for t in found.truths]
        assert found.rank.tolist() == [t.rank for t in found.truths]
        assert list(map(tuple, found.inertia.tolist())) == [t.inertia for t in found.truths]
        for part in ("x", "y"):
            whole = [np.full_like(getattr(found, part)[0], np.nan) if t.x is None else getattr(t, part) for t in found.truths]
            np.testing.assert_array_equal(getattr(found, part), whole)


def test_a_certified_answer_is_close(decided: list[Any]) -> None:
    """Radii of x are within CLOSE of its largest entry, and nearly always rounding is all there is."""
    shares = []
    for _, problem, _ in decided:
        if problem.m <= problem.n:
            found = proved(problem)
            size = np.abs(found.x).max(axis=1)
            known = np.isfinite(size)
            assert (found.x_radius[known] <= CLOSE * size[known]).all()
            shares += (found.x_radius[known] <= np.spacing(size[known])).tolist()
    assert len(shares) > 1500 and np.mean(shares) > 0.95


def test_exact_arithmetic_is_left_little(decided: list[Any]) -> None:
    """Of manufactured problems that are not exactly singular, planar and seven_joint less than one in a hundred is left."""
    for chosen in ("manufactured", "planar", "seven_joint", "trajectories", "methods", "badly_scaled"):
        left = [
            code < 0 for name, problem, truths in decided if name == chosen
            for code, one in zip(proved(problem).reason, truths, strict=True) if one.inertia[2] == 0 and one.rank == problem.m
        ]  # fmt: skip
        assert len(left) > 50 and np.mean(left) < 0.01, chosen


def test_what_is_open_goes_to_exact_arithmetic(monkeypatch: pytest.MonkeyPatch) -> None:
    """And nothing else: the members are counted, asked for once, and their answers rounded once."""
    problem = ordinary(6)
    J = problem.J.copy()
    J[2, 1] = 2 * J[2, 0]
    asked: list[int] = []

    def counted(part: VelocityProblem, task: str = "exact") -> Any:
        asked.append(len(part))
        return truth(part, task)

    monkeypatch.setattr(module, "truth", counted)
    found = certified(VelocityProblem(J=J, xdot=problem.xdot, W=problem.W, a=problem.a), worthwhile=1)
    assert asked == [1] and found.exactly.tolist() == [False, False, True, False, False, False]
    assert REASON[found.reason[2]] == "inconsistent" and np.isnan(found.x[2]).all()
    assert not certified(problem, worthwhile=1).exactly.any() and asked == [1]
    small = certified(problem)
    assert small.exactly.all() and asked == [1, 6]
    assert (small.x_radius == np.spacing(np.abs(small.x).max(axis=1)) / 2).all()


@pytest.mark.parametrize(
    "problem",
    [ordinary(3, 3, 2), ordinary(3, 2, LARGEST + 1), ordinary(3, 1, 2, LARGEST + 1)], ids=["rows", "joints", "factor rows"],
)  # fmt: skip
def test_sizes_without_machine_code_are_decided_exactly(problem: VelocityProblem) -> None:
    """More rows than joints, more joints or factor rows than code is written out for: exact arithmetic decides."""
    found = certified(problem, worthwhile=1)
    assert found.exactly.all() and [t.expected for t in found.truths] == [t.expected for t in truth(problem)]


def test_a_motion_at_rest_is_certified_at_zero() -> None:
    """Where xdot = 0 and a = 0 the problem has the answer zero, exactly: a radius of zero, and no exact arithmetic."""
    rest = VelocityProblem(J=ordinary(4).J, xdot=np.zeros(2), W=ordinary(4).W)
    found = certified(rest, worthwhile=1)
    assert not found.exactly.any() and not found.x.any() and not found.y.any()
    assert not found.x_radius.any() and not found.y_radius.any()


def test_multipliers_that_are_not_known_well_enough_are_left_to_exact_arithmetic(monkeypatch: pytest.MonkeyPatch) -> None:
    """A wide enclosure of either part leaves the problem open."""
    problem = ordinary(5)
    sound = module.enclosed(problem)
    for part in ("x_radius", "y_radius"):
        wide = np.array(getattr(sound, part))
        wide[1, -1] = 1e-6
        changed = {**vars(sound), part: wide}
        monkeypatch.setattr(module, "enclosed", lambda _, changed=changed: type(sound)(**changed))
        assert proved(problem).reason.tolist() == [REASON.index("condition_7"), -1, *[REASON.index("condition_7")] * 3]


def test_the_largest_entry_may_round_up_to_the_next_power_of_two(monkeypatch: pytest.MonkeyPatch) -> None:
    """The unit in the last place is that of the rounded centre, and the sum of radius and rounding is rounded up."""
    problem = ordinary(1)
    sound = module.enclosed(problem)
    below = np.nextafter(1.0, 0.0)
    x, low = np.array([[below, 0.25, 0.25]]), np.array([[2.0**-54 * 1.5, 0.0, 0.0]])
    changed = {**vars(sound), "x": x, "x_low": low, "x_radius": np.full((1, 3), 2.0**-120)}
    monkeypatch.setattr(module, "enclosed", lambda _: type(sound)(**changed))
    found = proved(problem)
    assert found.x[0, 0] == 1.0 and found.x_radius[0] > 2.0**-53


def test_truths_measure_a_yardstick(decided: list[Any]) -> None:
    """What judges answers takes certified truths as it takes exact ones: the same sizes and tolerances but for rounding."""
    for name, problem, truths in decided:
        if name in ("planar", "indefinite", "no_minimum"):
            ours = Yardstick.of(problem, "exact", certified(problem, worthwhile=1).truths)
            right = Yardstick.of(problem, "exact", truths)
            np.testing.assert_array_equal(ours.expected, right.expected)
            np.testing.assert_allclose(ours.spread, right.spread, rtol=1e-9)


def test_answers_cannot_be_written_to() -> None:
    """As those of exact arithmetic."""
    found = certified(ordinary(3), worthwhile=1)
    with pytest.raises(ValueError, match="read-only"):
        found.x[0] = 0.0
    with pytest.raises(ValueError, match="read-only"):
        found.truths[0].x[0] = 0.0


def test_every_reason_has_its_code() -> None:
    """Codes are places in the table of reasons, and what a certificate can say is among them."""
    assert REASON == tuple(REASONS) and set(module.PROVED) <= set(REASONS)
