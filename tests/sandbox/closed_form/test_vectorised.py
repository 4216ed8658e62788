"""Side by side or one after the other, eq. (6) and eqs. (2)-(5) give the same bits, the same refusals and the same words."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sandbox import lanes
from sandbox.closed_form import CLOSED_FORMS, vectorised
from sandbox.closed_form.compiled import compiled
from sandbox.closed_form.eq6 import arrays, factored
from sandbox.closed_form.kernels import CURVATURE, RANK, SOLVED
from sandbox.closed_form.vectorised import Exchanges, eq2_5_machine, eq6_machine
from sandbox.lanes import Machine
from sandbox.problem import VelocityProblem
from sandbox.solution import Status
from sandbox.weight import Weight

Array = np.ndarray
FORMS = ("eq6", "eq2_5")
CASES = (
    (1, 1, 0), (1, 2, 0), (2, 2, 0), (2, 3, 0), (2, 3, 1), (2, 4, 2), (3, 5, 3), (1, 5, 0), (4, 4, 2), (3, 7, 0), (6, 7, 0),
)  # fmt: skip
"""(m, n, factor rows): square, one and more degrees of redundancy, more and fewer factor rows than these."""


def problems(m: int, n: int, k: int, B: int = 203) -> VelocityProblem:
    """W of every inertia; some J of lower rank, exactly and nearly; ties between pivots; motions at rest."""
    rng = np.random.default_rng([m, n, k])
    J = rng.normal(size=(B, m, n))
    J[::3] = np.round(J[::3])
    J[5::40], J[7::40, -1] = 0.0, 1e-16 * J[7::40, -1]
    W = np.eye(n) * rng.choice([0.0, 1.0, 5.0], (B, 1, 1)) + rng.normal(size=(B, n, n))
    W = W + np.swapaxes(W, 1, 2)
    weight = Weight(W, *((rng.normal(size=(B, k, n)), rng.normal(size=(B, k)) ** 2) if k else ()))
    still = rng.uniform(size=(2, B, 1)) < 0.1
    xdot, a = np.where(still[0], 0.0, rng.normal(size=(B, m))), np.where(still[1], 0.0, rng.normal(size=(B, n)))
    return VelocityProblem(J=J, xdot=xdot, W=weight, a=a)


def both(monkeypatch: pytest.MonkeyPatch, function: Any, *arguments: Any) -> tuple[Any, Any]:
    """What comes of it side by side, and one after the other."""
    answers = []
    for worth in (1, 10**9):
        monkeypatch.setattr(vectorised, "WORTH", worth)
        answers.append(function(*arguments))
    return answers[0], answers[1]


def run_eq6(given: tuple[Array, ...]) -> list[Array]:
    """x, y, pivots, their roundings, NaN where they were refused; codes."""
    B, m, n = given[0].shape
    out = [np.full((B, size), np.nan, given[0].dtype) for size in (n, m, n, n)]
    code = factored(given, *out)
    return [*(np.where(code[:, None] == SOLVED, values, np.nan) for values in out), code]


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("case", CASES, ids=str)
def test_eq6_gives_the_same_bits(monkeypatch: pytest.MonkeyPatch, case: tuple[int, int, int], dtype: Any) -> None:
    """Answers, multipliers, pivots and codes are those of the scalar kernel; their rounding bounds too, in double precision.

    In single precision the scalar kernel takes the literals in a bound for doubles, and adds up in double.
    """
    given = arrays(problems(*case), dtype)
    fast, slow = both(monkeypatch, run_eq6, given)
    for name, ours, scalar in zip(("x", "y", "pivots", "bounds", "codes"), fast, slow, strict=True):
        if name == "bounds" and dtype is np.float32:
            np.testing.assert_allclose(ours, scalar, rtol=100 * np.finfo(dtype).eps)
        else:
            np.testing.assert_array_equal(ours, scalar)
    assert (fast[-1] == SOLVED).sum() > 50
    m, n, _ = case
    assert set(fast[-1]) == {SOLVED, RANK} | ({CURVATURE} if n > m else set())


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("name", FORMS)
@pytest.mark.parametrize("case", CASES, ids=str)
def test_whole_answers_are_the_same(monkeypatch: pytest.MonkeyPatch, name: str, case: tuple[int, int, int], dtype: Any) -> None:
    """Status, words and evidence of every member too, refused or not."""
    problem = problems(*case)
    fast, slow = both(monkeypatch, lambda: CLOSED_FORMS[name](problem, dtype=dtype))
    assert fast.x.dtype == fast.y.dtype == dtype
    for part in ("x", "y"):
        np.testing.assert_array_equal(getattr(fast, part), getattr(slow, part))
    assert (fast.status == slow.status).all() and fast.said == slow.said
    for key, values in slow.evidence.items():
        np.testing.assert_array_equal(fast.evidence[key], values)
    assert {Status.SOLVED, Status.RANK_DEFICIENT} <= set(fast.status)


@pytest.mark.parametrize("name", FORMS)
def test_a_stack_without_refusals_is_answered_in_full(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """Where nothing is refused nothing is explained: no word, no evidence, every status solved, the numbers as they came."""
    rng = np.random.default_rng(7)
    problem = VelocityProblem(J=rng.normal(size=(40, 2, 3)), xdot=rng.normal(size=(40, 2)), W=np.eye(3))
    fast, slow = both(monkeypatch, lambda: CLOSED_FORMS[name](problem))
    for one in (fast, slow):
        assert (one.status == Status.SOLVED).all() and one.said == [""] * 40
        assert np.isfinite(one.x).all() and np.isnan(one.evidence["singular_values"]).all()
    np.testing.assert_array_equal(fast.x, slow.x)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_member_that_is_not_finite_leaves_its_neighbours_unharmed(monkeypatch: pytest.MonkeyPatch, bad: float) -> None:
    """NaN or infinity in any array of one member: its lane ends as the scalar kernel does, the others are as without it."""
    clean = arrays(problems(2, 4, 2, 48), np.float64)
    whole, _ = both(monkeypatch, run_eq6, clean)
    for part in range(len(clean)):
        given = tuple(values.copy() for values in clean)
        given[part][::5].flat[:: max(1, given[part][0].size)] = bad
        hurt = ~np.isfinite(given[part].reshape(48, -1)).all(axis=1)
        assert 0 < hurt.sum() < 24
        fast, slow = both(monkeypatch, run_eq6, given)
        for ours, scalar, unharmed in zip(fast, slow, whole, strict=True):
            np.testing.assert_array_equal(ours[~hurt], unharmed[~hurt])
            np.testing.assert_array_equal(ours, scalar)


@pytest.mark.parametrize("k", [0, 2])
def test_the_identity_is_not_multiplied(k: int) -> None:
    """Without `weighted` both machines solve with the identity for base, as the scalar kernels do."""
    m, n = 2, 4
    J, xdot, W, E, gamma, a = arrays(problems(m, n, k), np.float64)
    fit = np.linalg.svd(J)[1][:, -1] > 1e-6
    J, xdot, W, E, gamma, a = (np.ascontiguousarray(v[fit]) for v in (J, xdot, W, E, gamma, a))
    B = len(J)
    x, y, z, u = (np.full((B, size), np.nan) for size in (n, m, n, m))
    solved, code, none = np.zeros((B, 1)), np.zeros(B, np.int64), np.zeros((B, 0, 0))
    eq6_machine(m, n, k, False, 64, False)(*(v.reshape(B, -1) for v in (J, xdot, E, gamma, a) if v.size), x, y, solved)
    compiled("eq6_stack")(J, xdot, W, E, gamma, a, 1.0, False, z, u, np.empty((B, n)), np.empty((B, n)), code)
    assert (solved[:, 0] == (code == SOLVED)).all() and solved.all()
    np.testing.assert_array_equal(x, z)
    np.testing.assert_array_equal(y, u)
    shares = np.zeros((B, 2))
    eq2_5_machine(m, n, False, 64)(*(v.reshape(B, -1) for v in (J, xdot, a)), x, y, shares, solved)
    compiled("eq2_5_stack")(J, xdot, W, a, 1.0, False, z, u, np.zeros((B, n, n)), np.zeros((B, m, m)), code)
    assert solved.all() and (shares[:, 0] == 1).all() and none.size == 0
    np.testing.assert_array_equal(x, z)
    np.testing.assert_array_equal(y, u)


def test_pivoting_by_masks_exchanges_what_pivoting_exchanges(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """The largest of a row from the diagonal on, the first of equals; both orders, joints and positions; zero rows refused."""
    monkeypatch.setattr(lanes, "CACHE", tmp_path)
    rng = np.random.default_rng(8)
    rows = np.concatenate([rng.integers(-2, 3, (80, 5)), rng.normal(size=(80, 5)), np.full((1, 5), np.nan)]).astype(float)

    def write(code: Any) -> None:
        A = np.stack([code.given(0), code.given(1)])
        p, joints, positions = Exchanges(5), vectorised.zeros(5), vectorised.zeros(3)
        vectorised.start(p)
        vectorised.pivot(A, p, 0, 2)
        vectorised.pivot(A[::-1], p, 1, 2)  # by the same row again, from its second place on
        vectorised.to_joints(code.given(1), p, joints)
        vectorised.to_positions(code.given(1), p, positions)
        for i, values in enumerate([*A, joints, positions, [code.validity()]]):
            code.keep(2 + i, list(values))

    out = [np.empty((len(rows), size)) for size in (5, 5, 5, 3, 1)]
    mark = np.tile(np.arange(5.0), (len(rows), 1))
    Machine("exchanges", 64, [5, 5], [5, 5, 5, 3, 1], write, [])(np.ascontiguousarray(rows), mark, *out)
    for i, row in enumerate(rows):
        order = np.arange(5)
        size = np.nan_to_num(np.abs(row))  # NaN is larger than nothing
        for place in (0, 1):
            best = place + int(np.argmax(size[order][place:]))
            order[[place, best]] = order[[best, place]]
        np.testing.assert_array_equal(out[0][i], row[order])
        np.testing.assert_array_equal(out[1][i], order)
        np.testing.assert_array_equal(out[2][i], np.argsort(order))
        np.testing.assert_array_equal(out[3][i], order[:3])
        assert out[4][i, 0] == (np.count_nonzero(size) > 1)


def test_where_machine_code_is_worth_it() -> None:
    """Large stacks of up to fourteen joints and factor rows; one core where the environment says so."""
    rows = np.zeros((1, vectorised.LARGEST + 1, 7))
    assert vectorised.worth(vectorised.WORTH, vectorised.LARGEST) and not vectorised.worth(vectorised.WORTH - 1, 2)
    assert not vectorised.worth(10**6, vectorised.LARGEST + 1)
    assert vectorised.worth(10**6, 7, rows[:, 1:]) and not vectorised.worth(10**6, 7, rows)


@pytest.mark.parametrize("told, threads", [("1", 1), ("3", 3), ("0", None), ("", None), ("2,1", None)])
def test_threads_are_those_of_the_environment(monkeypatch: pytest.MonkeyPatch, told: str, threads: int | None) -> None:
    """OMP_NUM_THREADS where it is a positive number, else every core."""
    monkeypatch.setenv("OMP_NUM_THREADS", told)
    monkeypatch.setattr("os.sched_getaffinity", lambda pid: {0, 1, 2, 5, 6}, raising=False)
    assert vectorised.threads() == (threads or 5)
