"""Every backend of the table passes one suite, each library in a process of its own.

A missing backend fails in CI (CI=true) and is a named skip elsewhere.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from dataclasses import replace
from importlib import metadata

import numpy as np
import pytest

from sandbox.backends import BACKENDS
from sandbox.backends.backend import Backend, Engine, Start, WarmStart
from sandbox.qp import QP
from sandbox.solution import STATUSES, Status
from sandbox.tolerances import ASKED, CONFORMANCE_FLOOR, CONFORMANCE_ROUNDING, CONFORMANCE_SLACK
from sandbox.worker import Answers, Workers
from tests.trajectories import lines

Array = np.ndarray

TIME_LIMIT = 1.5
"""Seconds for one of these small problems; two plug-ins of CasADi never come back from a Hessian of NaN."""

REACHED = "mid_accuracy"
"""A level that every engine reaches: cvxpy's CVXOPT gives up on most problems at 1e-9."""

BY_VALUE = ("qpsolvers:ecos", "cvxpy:ECOS", "cvxpy:CVXOPT", "scipy:slsqp")
"""They stop on the objective (an epigraph's gap, its last change), whose error is the square of that of x."""

DEAF = ("casadi:fatrop",)
"""They take no tolerance; the one in force is recorded."""

KNOWN = {"casadi:ipqp": "says success with x = NaN where there are two or more equality rows"}
"""Where reality falls short of the suite: when a version mends it, the strict xfail says so."""

GARBAGE, FAR = 1e3, 1e6
"""Entries of a starting point that is wrong, and of one so far off that its rounding shows in the answer."""

FEWER = ("osqp", "qpsolvers:osqp")
"""They need fewer iterations where they start near the answer. The others factor, or begin with a whole solve; SCS, given
x alone, starts its slacks and multipliers at 0."""

pytestmark = pytest.mark.conformance


def rows(expected: str, *, known: bool = False, without_rows: bool = False, warm: bool | None = None) -> list[object]:
    """The backends of which the table says `expected`, as parameters; those that can be warm, cannot, or (None) all."""
    marks = {name: [pytest.mark.xfail(strict=True, reason=reason)] for name, reason in KNOWN.items() if known}
    return [
        pytest.param(row, id=name, marks=marks.get(name, []))
        for name, row in BACKENDS.items()
        if row.expected == expected and (row.without_rows or not without_rows) and warm in (None, row.warm)
    ]


def missing(row: Backend) -> list[str]:
    """Distributions that the row's install line names and that are not installed."""
    absent = []
    for distribution in row.install.split()[2:]:
        try:
            metadata.version(distribution)
        except metadata.PackageNotFoundError:
            absent.append(distribution)
    return absent


def present(row: Backend) -> None:
    """Skip a missing backend by name; in CI, fail."""
    if absent := missing(row):
        told = f"{row.name}: {' and '.join(absent)} not installed; install it with: {row.install}"
        if os.environ.get("CI") == "true":
            pytest.fail(told)
        pytest.skip(told)


@pytest.fixture(scope="module")
def workers() -> Iterator[Workers]:
    """One process per library for the whole suite."""
    with Workers() as started:
        yield started


def stack(*members: tuple[Array, Array, Array, Array]) -> QP:
    """QPs of one shape as a stack."""
    return QP(*(np.stack(parts) for parts in zip(*members, strict=True)))


def convex(seed: int, n: int, p: int) -> tuple[Array, Array, Array, Array]:
    """A strictly convex QP whose H and A have their eigenvalues and singular values in [1/2, 8]."""
    rng = np.random.default_rng(seed)
    Q = np.linalg.qr(rng.standard_normal((n, n)))[0]
    H = (Q * np.geomspace(0.5, 8.0, n)) @ Q.T
    A = (np.linalg.qr(rng.standard_normal((n, p)))[0] * np.geomspace(0.5, 2.0, p)).T if p else np.zeros((0, n))
    return (H + H.T) / 2, rng.standard_normal(n), A, rng.standard_normal(p)


def kkt(qp: QP, i: int) -> tuple[Array, Array]:
    """Matrix and right-hand side of the optimality conditions of member `i`."""
    n, p = qp.n, qp.p
    K = np.block([[qp.H[i], qp.A[i].T], [qp.A[i], np.zeros((p, p))]])
    return K, np.concatenate([-qp.g[i], qp.b[i]]).reshape(n + p)


def allowed(row: Backend, engine: Engine, K: Array, z: Array) -> float:
    """How far x and y may be off: c |K^-1| eps, eps absolute plus relative times the size of the solution."""
    primal, primal_relative, dual, dual_relative = engine.eps
    eps = max(primal, dual) + max(primal_relative, dual_relative) * max(1.0, float(np.abs(K @ z).max()))
    if row.name.startswith(BY_VALUE):
        eps = float(np.sqrt(eps))
    return CONFORMANCE_SLACK * float(np.linalg.norm(np.linalg.inv(K), np.inf)) * eps + CONFORMANCE_FLOOR


def assert_solved(row: Backend, answers: Answers, qp: QP, members: range) -> None:
    """The members are said to be solved, and x and y are right."""
    assert answers.engine is not None, answers.said[0]
    for i in members:
        assert STATUSES[answers.status[i]] is Status.SOLVED, answers.said[i]
        K, right = kkt(qp, i)
        z = np.linalg.solve(K, right)
        tolerance = allowed(row, answers.engine, K, z)
        assert np.abs(answers.x[i] - z[: qp.n]).max() <= tolerance
        assert np.abs(answers.y[i] - z[qp.n :]).max(initial=0.0) <= tolerance


TEXTBOOK = stack(
    (
        np.array([[6.0, 2.0, 1.0], [2.0, 5.0, 2.0], [1.0, 2.0, 4.0]]), np.array([-8.0, -3.0, -3.0]),
        np.array([[1.0, 0.0, 1.0], [0.0, 1.0, 1.0]]), np.array([3.0, 0.0]),
    )
)  # fmt: skip
"""Nocedal & Wright, Numerical Optimization, example 16.2: x = (2, -1, 1); theirs is -y = (3, -2)."""


@pytest.mark.parametrize("row", rows("runs", known=True))
def test_textbook(row: Backend, workers: Workers) -> None:
    """Nocedal & Wright's example 16.2 has x = (2, -1, 1) and, in Hx + g + A'y = 0, y = (-3, 2)."""
    present(row)
    answers = workers.solve(row.name, TEXTBOOK, time_limit=TIME_LIMIT)
    assert_solved(row, answers, TEXTBOOK, range(1))
    K, _ = kkt(TEXTBOOK, 0)
    assert np.array_equal(K @ [2.0, -1.0, 1.0, -3.0, 2.0], [8.0, 3.0, 3.0, 3.0, 0.0])  # the numbers are theirs


@pytest.mark.parametrize("row", rows("runs", known=True))
def test_stack(row: Backend, workers: Workers) -> None:
    """Seven variables, six rows: each of a stack is solved, and another kind of problem between them changes nothing."""
    present(row)
    first = convex(1, 7, 6)
    twisted = (-first[0], *first[1:])
    qp = stack(first, convex(2, 7, 6), convex(3, 7, 6), twisted, first)
    answers = workers.solve(row.name, qp, settings=REACHED, time_limit=TIME_LIMIT)
    assert_solved(row, answers, qp, range(3))
    again = np.abs(answers.x[4] - answers.x[0]).max()
    assert again <= CONFORMANCE_ROUNDING  # cold: nothing is left of the problems before


@pytest.mark.parametrize("row", rows("runs", without_rows=True))
def test_without_rows(row: Backend, workers: Workers) -> None:
    """A QP without equality rows is solved, and y is empty."""
    present(row)
    qp = stack(convex(4, 5, 0))
    answers = workers.solve(row.name, qp, settings=REACHED, time_limit=TIME_LIMIT)
    assert_solved(row, answers, qp, range(1))
    assert answers.y.shape == (1, 0)


def solution(qp: QP, i: int) -> Start:
    """Right x and y of member `i`."""
    z = np.linalg.solve(*kkt(qp, i))
    return Start(z[: qp.n], z[qp.n :])


@pytest.mark.parametrize("place", ["right", "wrong"])
@pytest.mark.parametrize("row", rows("runs", warm=True))
def test_warm(row: Backend, place: str, workers: Workers) -> None:
    """Started from the right answer or from garbage, a backend that can be warm answers rightly."""
    present(row)
    for seed, n, p in ((1, 7, 6), (6, 5, 2), (4, 5, 0)):
        if p == 0 and not row.without_rows:
            continue
        qp = stack(convex(seed, n, p))
        start = solution(qp, 0) if place == "right" else Start(np.full(n, GARBAGE), np.full(p, GARBAGE))
        answers = workers.solve(row.name, qp, settings=REACHED, time_limit=TIME_LIMIT, start=start)
        assert_solved(row, answers, qp, range(1))


def heeds(row: Backend, workers: Workers) -> bool:
    """Whether the answer or the number of iterations depends on where the engine is started.

    At low accuracy: what an engine stops at early still shows where it came from.
    """
    qp = stack(convex(6, 5, 2))
    right, far = solution(qp, 0), Start(np.full(5, FAR), np.full(2, FAR))
    cold, *others = (
        workers.solve(row.name, qp, settings="low_accuracy", time_limit=TIME_LIMIT, start=start) for start in (None, right, far)
    )
    assert np.isfinite(cold.x).all()
    return any(
        not np.abs(other.x - cold.x).max() <= CONFORMANCE_ROUNDING or other.iterations != cold.iterations for other in others
    )


@pytest.mark.parametrize("row", rows("runs", warm=True))
def test_a_starting_point_is_heeded(row: Backend, workers: Workers) -> None:
    """What the table says can be warm depends on where it is started."""
    present(row)
    assert heeds(row, workers)


@pytest.mark.parametrize(
    "row", [row for row in rows("runs", known=True, warm=False) if row.values[0].library in ("qpsolvers", "casadi")]
)
def test_the_others_heed_none(row: Backend, workers: Workers, monkeypatch: pytest.MonkeyPatch) -> None:
    """Given a starting point all the same, an engine that the table calls cold does not look at it."""
    present(row)
    monkeypatch.setitem(BACKENDS, row.name, replace(row, start=WarmStart("tried")))
    assert not heeds(BACKENDS[row.name], workers)


@pytest.mark.parametrize("name", FEWER)
def test_warm_takes_fewer_iterations(name: str, workers: Workers) -> None:
    """Along a smooth path an iterative engine needs fewer iterations in all when each starts from the one before."""
    present(BACKENDS[name])
    problem = lines(3, steps=40).problem
    qp = QP(problem.W.dense(), problem.a, problem.J, problem.xdot)
    cold = workers.solve(name, qp, time_limit=TIME_LIMIT)
    warm = workers.solve(name, qp, time_limit=TIME_LIMIT, follows=np.arange(len(qp)) > 0)
    assert_solved(BACKENDS[name], warm, qp, range(len(qp)))
    assert warm.iterations[0] == cold.iterations[0]
    assert sum(i for i in warm.iterations if i) < sum(i for i in cold.iterations if i)


@pytest.mark.parametrize("settings", ["default", *ASKED])
@pytest.mark.parametrize("row", rows("runs"))
def test_settings_are_recorded(row: Backend, settings: str, workers: Workers) -> None:
    """The effective settings are JSON, carry the stopping tolerances, and are those asked for or visibly not."""
    present(row)
    engine = workers.solve(row.name, TEXTBOOK, settings=settings, time_limit=TIME_LIMIT).engine
    assert engine is not None
    assert json.loads(json.dumps(engine.settings, allow_nan=False)) == engine.settings
    assert engine.library_version and engine.engine_version
    assert len(engine.eps) == 4
    assert all(0.0 <= value < 1.0 for value in engine.eps)
    assert {value for value in engine.eps if value} <= {v for v in engine.settings.values() if isinstance(v, float)}
    if settings != "default" and row.name not in DEAF:
        assert max(engine.eps) <= ASKED[settings]


@pytest.mark.parametrize("row", rows("runs"))
def test_hopeless_problems(row: Backend, workers: Workers) -> None:
    """Inconsistent rows, an objective without minimum and a Hessian of NaN: a status comes back, nothing is raised."""
    present(row)
    H, g, A, b = convex(5, 6, 3)
    inconsistent = np.vstack([A[:2], A[:1]]), np.array([1.0, 2.0, 5.0])
    qp = stack((H, g, *inconsistent), (-H, g, A, b), (np.full_like(H, np.nan), g, A, b))
    answers = workers.solve(row.name, qp, time_limit=TIME_LIMIT)
    ends = [STATUSES[code] for code in answers.status]
    assert Status.NOT_RUN not in ends
    assert all(answers.said)


@pytest.mark.parametrize("row", rows("loads but fails"))
def test_loads_but_fails(row: Backend, workers: Workers) -> None:
    """A backend of which the table says that it fails, fails, and in the words the table gives."""
    present(row)
    answers = workers.solve(row.name, TEXTBOOK, time_limit=TIME_LIMIT)
    assert STATUSES[answers.status[0]].refused
    assert row.message in answers.said[0]


def test_absent() -> None:
    """What the table calls absent is not installed."""
    assert [row.name for row in BACKENDS.values() if row.expected == "absent" and not missing(row)] == []


@pytest.mark.parametrize("name", sorted(KNOWN))
def test_known_deviation(name: str, workers: Workers) -> None:
    """The known deviation is the one described: solved, it says, and x is NaN."""
    present(BACKENDS[name])
    answers = workers.solve(name, TEXTBOOK, time_limit=TIME_LIMIT)
    assert STATUSES[answers.status[0]] is Status.SOLVED
    assert np.isnan(answers.x[0]).all()
