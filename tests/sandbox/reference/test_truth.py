"""The exact truth against an independent decision in fractions, the fixtures, and identities that hold exactly."""

from __future__ import annotations

import pickle
from collections import Counter
from fractions import Fraction as F
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from sandbox.errors import NonFiniteError, RangeError, ShapeError, UnknownNameError
from sandbox.problem import VelocityProblem
from sandbox.reference import REASONS, truth, truth_of_qp
from sandbox.task import TASKS
from sandbox.verdict import EXPECTED
from sandbox.weight import Weight
from tests.oracle import oracle

F1 = np.array([[-1.0, -1, 0], [2, 1, 1]])
F1B = np.array([[-2.0, -2, -1], [1, 0, 0]])
F2 = np.array([[-2.0, -2, -1, -1], [2, 1, 1, 0]])
F0 = np.array([[0.0, 0, 0], [3, 2, 1]])
DAMPINGS = (0.125, 1.0, 0.3)


def integers(seed: int, count: int) -> list[dict]:
    """Problems with small integer entries: every class comes up, boundaries included."""
    rng = np.random.default_rng(seed)
    problems = []
    for _ in range(count):
        n, m = rng.integers(1, 5), rng.integers(1, 4)
        J = rng.integers(-2, 3, (m, n))
        if rng.random() < 0.5:
            J[rng.integers(m)] = rng.integers(-1, 2) * J[rng.integers(m)]
        W = symmetric(rng.integers(-2, 3, (n, n)), rng, rng.random())
        consistent = rng.random() < 0.6
        xdot = J @ rng.integers(-2, 3, n) if consistent else rng.integers(-2, 3, m)
        a = rng.integers(-2, 3, n) * rng.integers(0, 2)
        if rng.random() < 0.5:
            a = W @ rng.integers(-1, 2, n)
        Wx = None if rng.random() < 0.4 else symmetric(rng.integers(-1, 3, (m, m)), rng, rng.random())
        problems.append({"J": J, "xdot": xdot * rng.integers(0, 2), "W": W, "a": a, "Wx": Wx})
    return problems


def symmetric(A: np.ndarray, rng: np.random.Generator, kind: float) -> np.ndarray:
    """A matrix of one of several inertias, with integer entries."""
    if kind < 0.3:
        return A.T @ A
    if kind < 0.5:
        return A.T @ A + np.eye(len(A), dtype=int)
    if kind < 0.7:
        low = A[: max(1, len(A) - 1)]
        return low.T @ np.diag(rng.integers(-1, 2, len(low))) @ low
    return A + A.T


def floats(seed: int, count: int) -> list[dict]:
    """Problems with full 53-bit entries of mixed size, factored weights among them."""
    rng = np.random.default_rng(seed)
    problems = []
    for i in range(count):
        n, m = (3, 2) if i % 2 else (3, 1)
        size = 10.0 ** rng.integers(-9, 9, n)
        J = rng.standard_normal((m, n)) * size
        A = rng.standard_normal((n, n))
        W: np.ndarray | Weight = (A + A.T) if i % 3 else A @ A.T
        if i % 3 == 1:
            E = rng.standard_normal((n - m, n))
            W = Weight(np.zeros((n, n)) if i % 2 else (A + A.T) / 1e3, E, rng.uniform(0.1, 3, n - m))
        B = rng.standard_normal((m, m))
        Wx = (None, B @ B.T, B + B.T)[i % 3]
        problems.append({"J": J, "xdot": rng.standard_normal(m), "W": W, "a": rng.standard_normal(n), "Wx": Wx})
    return problems


def rational_weight(W: np.ndarray | Weight) -> oracle.Matrix:
    """W of a case as fractions, the factors unrounded."""
    if isinstance(W, Weight):
        return oracle.factored(W.base, W.E, W.gamma)
    return oracle.rational(W)


def expected(case: dict, task: str, damping: float) -> oracle.Answer:
    """What the oracle says of a case."""
    J, xdot, W, a, Wx = case["J"], case["xdot"], rational_weight(case["W"]), case["a"], case["Wx"]
    if task == "exact":
        return oracle.exact(J, xdot, W, a)
    if task == "least_squares":
        return oracle.least_squares(J, xdot, W, a, Wx)
    return oracle.damped(J, xdot, W, a, damping, Wx)


def agree(case: dict, task: str, damping: float = 0.125) -> tuple[str, str]:
    """Assert that truth and oracle agree in every field, exactly; return class and reason."""
    t, right = truth(VelocityProblem(**case), task, damping=damping), expected(case, task, damping)
    J, n = oracle.rational(case["J"]), case["J"].shape[1]
    assert (t.expected, t.reason, t.inertia) == (right.expected, right.reason, right.inertia)
    assert t.rank == oracle.solve(J, [F(0)] * len(J)).rank
    assert 0 <= t.margin <= 1
    if right.x is None:
        assert t.x is None and t.y is None and t.x_exact is None and t.y_exact is None and t.value is None
        assert t.freedom.shape == (n, 0)
        return t.expected, t.reason
    x, y, scale = list(t.x_exact), list(t.y_exact), F(damping) ** 2 if task == "damped" else F(1)
    W, a = rational_weight(case["W"]), oracle.vector(case["a"])
    gradient = [scale * (u + v) for u, v in zip(oracle.apply(W, x), a, strict=True)]
    assert [u + v for u, v in zip(gradient, oracle.apply(oracle.transpose(J), y), strict=True)] == [0] * n
    free = oracle.independent([z[:n] for z in right.freedom])
    gap = [u - v for u, v in zip(x, right.x[:n], strict=True)]
    assert not any(gap) or oracle.solve(oracle.transpose(free), gap).solution is not None
    assert all(oracle.inner(z, x) == 0 for z in free), "of least norm"
    assert t.freedom.shape == (n, len(free))
    if free:
        Z = np.linalg.qr(np.array(free, dtype=float).T)[0]
        np.testing.assert_allclose(t.freedom @ t.freedom.T, Z @ Z.T, atol=1e-12)
        np.testing.assert_allclose(t.freedom.T @ t.freedom, np.eye(len(free)), atol=1e-15)
    assert t.value_exact == right.value
    if task == "least_squares":
        Wx = oracle.identity(len(J)) if case["Wx"] is None else oracle.rational(case["Wx"])
        assert oracle.solve(oracle.times(Wx, J), y).solution is not None, "y is in Wx range(J)"
    if task == "damped":  # the slack joints hold y up: Wx s + y = 0
        Wx = oracle.identity(len(J)) if case["Wx"] is None else oracle.rational(case["Wx"])
        s = [v - w for v, w in zip(oracle.vector(case["xdot"]), oracle.apply(J, x), strict=True)]
        assert y == [-v for v in oracle.apply(Wx, s)]
    if task == "exact" and t.rank == len(J):
        assert y == right.y
    for rounded, exact in ((t.x, x), (t.y, y), ([t.value], [t.value_exact])):
        assert all(is_nearest(v, w) for v, w in zip(rounded, exact, strict=True))
    return t.expected, t.reason


def is_nearest(rounded: float, exact: F) -> bool:
    """Whether no neighbour of `rounded` is closer to `exact`; a tie goes to the even one."""
    error = abs(F(float(rounded)) - exact)
    for other in (np.nextafter(rounded, np.inf), np.nextafter(rounded, -np.inf)):
        distance = abs(F(float(other)) - exact)
        if distance < error or (distance == error != 0 and int(np.float64(rounded).view(np.int64)) % 2):
            return False
    return True


@pytest.mark.parametrize("task", TASKS)
def test_small_integer_problems(task: str) -> None:
    """On random integer problems class, reason, inertia, x, y, freedom and value are the oracle's, exactly."""
    told = Counter(agree(case, task, DAMPINGS[i % 3 if i % 30 == 0 else i % 2]) for i, case in enumerate(integers(3, 320)))
    reasons = {
        "exact": {"no_freedom", "inconsistent"},
        "least_squares": {"no_freedom", "target_unbounded"},
        "damped": set(),
    }[task] | {"condition_7", "singular", "descending", "saddle", "maximum", "indefinite_singular"}
    assert {reason for _, reason in told} == reasons
    assert {kind for kind, _ in told} <= set(EXPECTED)
    assert reasons <= set(REASONS)
    assert all(count >= 4 for count in told.values()), told


@pytest.mark.parametrize("task", TASKS)
def test_float_problems(task: str) -> None:
    """The same with full 53-bit entries of mixed size and factored weights: nothing is rounded on the way."""
    told = Counter(kind for kind, _ in (agree(case, task) for case in floats(5, 30)))
    assert told["unique_minimum"] >= 5
    assert told["no_minimum"] >= 3


def test_exact_rank_deficiency() -> None:
    """Fewer joints than rows, equal numbers, and rank-deficient rows each get their class."""
    W = np.eye(2)
    tall = np.array([[1.0, 0], [0, 1], [1, 1]])
    assert truth(VelocityProblem(tall, [1, 2, 3], W)).reason == "no_freedom"
    assert truth(VelocityProblem(tall, [1, 2, 3], W)).margin == 0.0
    assert truth(VelocityProblem(tall, [1, 2, 4], W)).expected == "infeasible"
    assert truth(VelocityProblem(tall, [1, 2, 4], W), "least_squares").x_exact == (F(4, 3), F(7, 3))
    square = truth(VelocityProblem([[2.0, 1], [1, 1]], [1, 0], -W))
    assert (square.expected, square.reason, square.inertia) == ("unique_minimum", "no_freedom", (0, 0, 0))
    assert square.x_exact == (1, -1)
    zero = truth(VelocityProblem(np.zeros((1, 2)), [0.0], W, [1, -2]))
    assert (zero.rank, zero.x_exact, zero.y_exact) == (0, (-1, 2), (0,))
    assert truth(VelocityProblem(np.zeros((1, 2)), [3.0], W, [1, -2]), "least_squares").x_exact == (-1, 2)


@pytest.mark.parametrize(("m", "n"), [(6, 7), (3, 7), (6, 12), (11, 12), (1, 12), (9, 7)])
@pytest.mark.parametrize("task", TASKS)
def test_large_problems(m: int, n: int, task: str) -> None:
    """Up to twelve joints: the KKT conditions hold with residual 0, the inertia is that of the eigenvalues, and the
    float paths of the oracle agree.
    """
    rng = np.random.default_rng(100 * m + n)
    J, A, B = rng.standard_normal((m, n)), rng.standard_normal((n, n)), rng.standard_normal((m, m))
    xdot, a, Wx = J @ rng.standard_normal(n), rng.standard_normal(n), B @ B.T + np.eye(m)
    S = J @ np.linalg.solve(A @ A.T + np.eye(n), J.T)
    W = A @ A.T + np.eye(n) - 3 * J.T @ J / np.linalg.norm(S, 2)  # indefinite along J for m < n
    W = (W + W.T) / 2
    t = truth(VelocityProblem(J, xdot, W, a, Wx), task)
    if (m, task) == (9, "exact"):
        assert t.expected == "infeasible"  # fl(J q) is not in range J
        return
    if t.x is None:
        assert task == "damped" and t.reason == "saddle"
        return
    x, y, rows = list(t.x_exact), list(t.y_exact), oracle.rational(J)
    scale = F(1, 64) if task == "damped" else F(1)
    Wx_ = [scale * v for v in oracle.apply(oracle.rational(W), x)]
    Jty = oracle.apply(oracle.transpose(rows), y)
    assert [u + scale * F(v) + w for u, v, w in zip(Wx_, a.tolist(), Jty, strict=True)] == [0] * n
    s = [F(v) - w for v, w in zip(xdot.tolist(), oracle.apply(rows, x), strict=True)]
    weighted = oracle.apply(oracle.rational(Wx), s)
    if task == "exact":
        assert s == [0] * m
        np.testing.assert_allclose(t.x, oracle.paper_eq6(J, xdot, W, a), rtol=1e-6, atol=1e-9)
        np.testing.assert_allclose(t.y, oracle.kkt(J, xdot, W, a)[1], rtol=1e-6, atol=1e-9)
    elif task == "least_squares":
        assert oracle.apply(oracle.transpose(rows), weighted) == [0] * n
        np.testing.assert_allclose(t.x, oracle.paper_eq13(J, xdot, W, a, Wx, min(m, n)), rtol=1e-6, atol=1e-9)
    else:
        assert [u + v for u, v in zip(weighted, y, strict=True)] == [0] * m
    N = np.eye(n) if task == "damped" else oracle.null_space(J, min(m, n))
    lam = np.linalg.eigvalsh(N.T @ (W / 64 + J.T @ Wx @ J if task == "damped" else W) @ N)
    assert t.inertia == (int((lam > 0).sum()), int((lam < 0).sum()), 0)
    assert all(is_nearest(v, w) for v, w in zip([*t.x, *t.y, t.value], [*x, *y, t.value_exact], strict=True))


# --- fixtures of the paper's mathematics ---


def test_f1_diagonal_weights() -> None:
    """F1: diag(-1,1,1) is valid with y = (-3,-1); diag(-2,1,1) is singular, diag(-3,1,1) has a maximum."""
    valid = truth(VelocityProblem(F1, [1, 1], np.diag([-1.0, 1, 1])))
    assert valid.x_exact == (1, -2, 1) and valid.y_exact == (-3, -1) and valid.value_exact == 2
    assert (valid.expected, valid.reason, valid.inertia) == ("unique_minimum", "condition_7", (1, 0, 0))
    singular = truth(VelocityProblem(F1, [1, 1], np.diag([-2.0, 1, 1])))
    assert (singular.expected, singular.inertia, singular.margin) == ("no_minimum", (0, 0, 1), 0.0)
    maximum = truth(VelocityProblem(F1, [1, 1], np.diag([-3.0, 1, 1])))
    assert (maximum.expected, maximum.reason) == ("no_minimum", "maximum")


@pytest.mark.parametrize(
    ("weights", "kind", "reason", "inertia"),
    [
        ((-1, 1, 1, 1), "unique_minimum", "condition_7", (2, 0, 0)),
        ((1, 1, 1, -2), "no_minimum", "saddle", (1, 1, 0)),
        ((-3, 3 / 8, 3 / 8, 3 / 8), "no_minimum", "saddle", (1, 1, 0)),
    ],
)
def test_f2_diagonal_weights(weights: tuple, kind: str, reason: str, inertia: tuple) -> None:
    """F2: the table of the simplest indefinite weights."""
    t = truth(VelocityProblem(F2, [1, 1], np.diag(np.array(weights, dtype=float))))
    assert (t.expected, t.reason, t.inertia) == (kind, reason, inertia)


def test_f2_boundary() -> None:
    """F2: 3 diag(-8/3,1,1,1) is exactly singular; its rounded form diag(-8/3,1,1,1) is not, and its margin says so."""
    exact = truth(VelocityProblem(F2, [1, 1], np.diag([-8.0, 3, 3, 3])))
    assert exact.inertia == (1, 0, 1) and exact.margin == 0.0
    rounded = truth(VelocityProblem(F2, [1, 1], np.diag([-8 / 3, 1, 1, 1])))
    assert rounded.inertia == (2, 0, 0)  # fl(-8/3) lies above -8/3
    assert rounded.margin < 1e-15


def test_invisible_weights() -> None:
    """W = J'AJ never satisfies (7), W = I - cJ'J always does and gives J^+ xdot."""
    A = np.array([[2.0, 1], [1, -3]])
    assert truth(VelocityProblem(F1, [1, 1], F1.T @ A @ F1)).expected == "minimum_not_unique"
    assert truth(VelocityProblem(F1, [1, 1], np.eye(3) - 4 * F1.T @ F1)).x_exact == (F(1, 3), F(-4, 3), F(5, 3))


@pytest.mark.parametrize(
    ("J", "W", "a", "xdot", "x"),
    [
        (F1, np.eye(3), [0, 0, 0], (1, 1), (F(1, 3), F(-4, 3), F(5, 3))),
        (F1, [[2, 0.75, 0.25], [0.75, 4, -0.5], [0.25, -0.5, 6]], [0, 0, 0], (1, 1), None),
        (F1B, np.eye(3), [0, 0, -1], (0, 0), (0, F(-2, 5), F(4, 5))),
        (F1, np.diag([1.0, 2, 3]), [0, 0, 0], (1, 0), (F(1, 6), F(-7, 6), F(5, 6))),
        (F1, np.diag([1.0, 2, 3]), [0, 0, 0], (0, 1), (F(1, 2), F(-1, 2), F(1, 2))),
    ],
)
def test_rational_fixtures(J, W, a, xdot, x) -> None:
    """Fixtures F1 and F1b have their rational answers."""
    t = truth(VelocityProblem(J, xdot, W, a))
    right = oracle.exact(J, xdot, np.asarray(W, dtype=float), a)
    assert list(t.x_exact) == right.x
    assert x is None or t.x_exact == x


def test_symmetrised_weight() -> None:
    """F1 with W + W' of methods 1.10: the true minimiser is (7/8, -15/8, 9/8), not eq. (6) on the raw matrix."""
    W = np.array([[10.0, 8, 0], [0, 20, -5], [3, 0, 30]])
    assert truth(VelocityProblem(F1, [1, 1], W + W.T)).x_exact == (F(7, 8), F(-15, 8), F(9, 8))
    posed = truth_of_qp(W, np.zeros(3), F1, np.ones(2))
    assert posed.x_exact == (F(7, 8), F(-15, 8), F(9, 8))
    posed = truth_of_qp(W, np.array([1.0, 2, 3]), F1, np.ones(2))
    same = truth(VelocityProblem(F1, [1, 1], (W + W.T) / 2, [1, 2, 3]))
    assert (posed.x_exact, posed.y_exact, posed.value_exact) == (same.x_exact, same.y_exact, same.value_exact)


def test_decimal_fixture() -> None:
    """F1, W = diag(1,2,3), 10 a = (1,-2,4), 10 xdot = (3,-7): ten times (-17/60, -1/60, -7/60)."""
    t = truth(VelocityProblem(F1, [3, -7], np.diag([1.0, 2, 3]), [1, -2, 4]))
    assert t.x_exact == (F(-17, 6), F(-1, 6), F(-7, 6))


def test_augmented_jacobian() -> None:
    """F1 with one function, F2 with two: the answer meets [J; E] x = [xdot; gbar] whatever gamma is (methods 4.2, 4.3)."""
    for gamma in (1.0, 2.0**-10, 57.0):
        t = truth(VelocityProblem(F1, [3, -7], Weight(np.zeros((3, 3)), [[1, 1, 1]], [gamma]), gamma * np.full(3, -9.0)))
        assert t.x_exact == (-16, 13, 12)
    E, xd, gbar = np.array([[1.0, 0, 0, 0], [1, 1, 1, 1]]), np.array([3.0, -5]), np.array([2.0, 7])
    answers = set()
    for gamma in ((1, 1), (10, 1), (0.125, 3)):
        weight = Weight(np.zeros((4, 4)), E, np.array(gamma, dtype=float))
        answers.add(truth(VelocityProblem(F2, xd, weight, -E.T @ (gamma * gbar))).x_exact)
    assert len(answers) == 1
    (x,) = answers
    assert oracle.apply(oracle.rational(np.vstack([F2, E])), list(x)) == oracle.vector(np.concatenate([xd, gbar]))


def test_overdetermined_augmentation() -> None:
    """Two functions on F1 are one too many: gamma decides, (-.7,.4,.3) against (-1.436364,1.136364,1.036364)."""
    E, gbar = np.array([[1.0, 1, 1], [1, 0, 0]]), np.array([9.0, 2])
    for gamma, x in (((1, 1), (-7, 4, 3)), ((10, 1), (F(-158, 11), F(125, 11), F(114, 11)))):
        weight = Weight(np.zeros((3, 3)), E, np.array(gamma, dtype=float))
        assert truth(VelocityProblem(F1, [3, -7], weight, -E.T @ (gamma * gbar))).x_exact == x


def test_factors_are_not_rounded() -> None:
    """W = e e' with e = (1 + 1e-8, 1, 0): rounded it is singular along N, in factors it is not (methods 4.4)."""
    e = np.array([[1 + 1e-8, 1.0, 0.0]])
    factored = truth(VelocityProblem(F1, [1, 1], Weight(np.zeros((3, 3)), e), -e[0]))
    assert factored.reason == "condition_7"
    assert oracle.inner(oracle.vector(e[0]), list(factored.x_exact)) == 1
    rounded = truth(VelocityProblem(F1, [1, 1], e.T @ e, -e[0]))
    assert rounded.x_exact != factored.x_exact


def test_rank_deficient_fixture() -> None:
    """F0, Wx = [[2,1],[1,1]], W = diag(1,1,-1/20): (-6/7,-4/7,40/7); with Wx = I it halves (methods 6.6)."""
    W = np.diag([20.0, 20, -1])
    t = truth(VelocityProblem(F0, [1, 1], W, Wx=[[2, 1], [1, 1]]), "least_squares")
    assert t.x_exact == (F(-6, 7), F(-4, 7), F(40, 7))
    assert (t.rank, t.inertia, t.expected) == (1, (2, 0, 0), "unique_minimum")
    assert truth(VelocityProblem(F0, [1, 1], W), "least_squares").x_exact == (F(-3, 7), F(-2, 7), F(20, 7))
    assert truth(VelocityProblem(F0, [1, 1], W)).reason == "inconsistent"


@pytest.mark.parametrize(
    ("Wx", "reason", "boundary"),
    [
        (np.diag([1.0, -1]), "target_unbounded", False),  # negative on range J = span e2
        (np.diag([-1.0, 1]), "condition_7", False),  # indefinite, but positive on range J
        (np.diag([1.0, 0]), "maximum", True),  # nothing asked of range J: minimised over all of R^3
        (np.array([[0.0, 1], [1, 0]]), "target_unbounded", True),  # J'WxJ = 0, J'Wx xdot is not
    ],
)
def test_target_weights(Wx: np.ndarray, reason: str, boundary: bool) -> None:
    """What counts of Wx is its form on range J (methods 6.1)."""
    W = np.eye(3) if reason != "maximum" else -np.eye(3)
    t = truth(VelocityProblem(F0, [1, 1], W, Wx=Wx), "least_squares")
    assert t.reason == reason
    assert (t.margin == 0) == boundary


def test_damped_fixture() -> None:
    """F1, lambda = 1: J* = [[-1/12,1/4],[-1/3,0],[1/4,1/4]] (methods C1)."""
    columns = [truth(VelocityProblem(F1, e, np.eye(3)), "damped", damping=1.0).x_exact for e in np.eye(2)]
    assert columns == [(F(-1, 12), F(-1, 3), F(1, 4)), (F(1, 4), 0, F(1, 4))]
    t = truth(VelocityProblem(F1, [1, 1], np.eye(3)), "damped", damping=-1.0)
    assert t.x_exact == (F(1, 6), F(-1, 3), F(1, 2))


def test_damping_without_lambda() -> None:
    """Lambda = 0 leaves the freedom of J: not unique, and of least norm it is J^+ xdot."""
    t = truth(VelocityProblem(F1, [1, 1], np.eye(3)), "damped", damping=0.0)
    assert t.expected == "minimum_not_unique" and t.x_exact == (F(1, 3), F(-4, 3), F(5, 3))


# --- identities that hold exactly (methods section 7) ---


@cache
def cases() -> list[dict]:
    """Problems with a unique minimum, full row rank and freedom; many with an indefinite W."""
    kept = []
    for case in integers(11, 900):
        t = truth(VelocityProblem(**case))
        if t.reason == "condition_7" and t.rank == len(case["J"]):
            kept.append({name: case[name] for name in ("J", "xdot", "W", "a")})
    assert len(kept) > 60
    assert sum(np.linalg.eigvalsh(case["W"])[0] < -1e-9 for case in kept) > 10
    return kept


def solution(**case) -> tuple[list[F], list[F], F]:
    """Minimiser, multipliers and value of a case."""
    t = truth(VelocityProblem(**case))
    return list(t.x_exact), list(t.y_exact), t.value_exact


def test_shift_of_the_task_block() -> None:
    """I4: W + J'AJ has the same x, y - A xdot, and a value higher by 1/2 xdot'A xdot."""
    rng = np.random.default_rng(1)
    for case in cases():
        A = symmetric(rng.integers(-9, 9, (len(case["J"]),) * 2), rng, 1.0)
        x, y, value = solution(**case)
        shifted = solution(**case | {"W": case["W"] + case["J"].T @ A @ case["J"]})
        lift = oracle.vector(A @ case["xdot"])
        right = x, [u - v for u, v in zip(y, lift, strict=True)], value + F(int(case["xdot"] @ A @ case["xdot"]), 2)
        assert shifted == right


def test_shift_of_the_mixed_block() -> None:
    """I5: W + J'B + B'J together with a - B'xdot has the same x, and y - B x."""
    rng = np.random.default_rng(2)
    for case in cases():
        J, B = case["J"], rng.integers(-9, 9, case["J"].shape)
        x, y, _ = solution(**case)
        moved = solution(**case | {"W": case["W"] + J.T @ B + B.T @ J, "a": case["a"] - B.T @ case["xdot"]})
        assert moved[:2] == (x, [u - v for u, v in zip(y, oracle.apply(oracle.rational(B), x), strict=True)])


def test_shift_of_the_gradient() -> None:
    """I6: a + J'mu has the same x, and y - mu."""
    rng = np.random.default_rng(3)
    for case in cases():
        mu = rng.integers(-9, 9, len(case["J"]))
        x, y, _ = solution(**case)
        moved = solution(**case | {"a": case["a"] + case["J"].T @ mu})
        assert moved[:2] == (x, [u - int(v) for u, v in zip(y, mu, strict=True)])


def test_change_of_task_coordinates() -> None:
    """I7: T J, T xdot with a nonsingular T have the same x and value, and T' y' = y."""
    rng = np.random.default_rng(4)
    for case in cases():
        m = len(case["J"])
        T = np.tril(rng.integers(-3, 4, (m, m)), -1) + np.diag(rng.integers(1, 4, m))
        x, y, value = solution(**case)
        new = solution(**case | {"J": T @ case["J"], "xdot": T @ case["xdot"]})
        assert (new[0], oracle.apply(oracle.rational(T.T), new[1]), new[2]) == (x, y, value)


def test_homogeneity() -> None:
    """I8: (W, a) scaled by 3 has the same x, and 3 y."""
    for case in cases():
        x, y, value = solution(**case)
        assert solution(**case | {"W": 3 * case["W"], "a": 3 * case["a"]}) == (x, [3 * v for v in y], 3 * value)


def test_change_of_joint_coordinates() -> None:
    """I9: J S, S'WS, S'a with a nonsingular S have S x' = x, and the same y and value."""
    rng = np.random.default_rng(5)
    for case in cases():
        n = case["J"].shape[1]
        S = np.triu(rng.integers(-3, 4, (n, n)), 1) + np.diag(rng.integers(1, 4, n))
        x, y, value = solution(**case)
        new = solution(**case | {"J": case["J"] @ S, "W": S.T @ case["W"] @ S, "a": S.T @ case["a"]})
        assert (oracle.apply(oracle.rational(S), new[0]), new[1], new[2]) == (x, y, value)


def test_superposition() -> None:
    """I11: answers to (xdot_1, a_1) and (xdot_2, a_2) add up."""
    rng = np.random.default_rng(6)
    for case in cases():
        more = {"xdot": rng.integers(-5, 5, len(case["J"])), "a": rng.integers(-5, 5, case["J"].shape[1])}
        both = {name: case[name] + value for name, value in more.items()}
        one, two, sum_ = solution(**case), solution(**case | more), solution(**case | both)
        assert sum_[0] == [u + v for u, v in zip(one[0], two[0], strict=True)]


def test_manufactured_solutions() -> None:
    """Methods 1.7 with J = [I K] and N = [-K; I], all integer: x = Y xdot + N y, lam = -(S_T xdot + C y + mu)."""
    rng = np.random.default_rng(7)
    for _ in range(60):
        m, k = int(rng.integers(1, 5)), int(rng.integers(1, 4))
        K, C = rng.integers(-3, 4, (m, k)), rng.integers(-3, 4, (m, k))
        L = np.tril(rng.integers(-1, 2, (k, k)), -1) + np.eye(k, dtype=int)
        S_N, S_T = L @ L.T, symmetric(rng.integers(-9, 4, (m, m)), rng, 1.0)
        mu, nu, xd = rng.integers(-5, 6, m), rng.integers(-5, 6, k), rng.integers(-5, 6, m)
        J = np.hstack([np.eye(m, dtype=int), K])
        dual = np.vstack([J, np.hstack([np.zeros((k, m), dtype=int), np.eye(k, dtype=int)])])  # [Y N]^-1
        W = dual.T @ np.block([[S_T, C], [C.T, S_N]]) @ dual
        y = np.rint(np.linalg.inv(S_N)).astype(int) @ -(nu + C.T @ xd)  # det S_N = 1: an integer inverse
        t = truth(VelocityProblem(J, xd, W, dual.T @ np.concatenate([mu, nu])))
        assert t.x_exact == tuple([*(xd - K @ y), *y])
        assert t.y_exact == tuple(-(S_T @ xd + C @ y + mu))
        assert t.inertia == (k, 0, 0)


def test_value_derivative() -> None:
    """I15, and eq. (13): y is -d value / d xdot, by exact differences (the value is quadratic in xdot)."""
    for task in ("exact", "least_squares"):
        for case in cases()[:30]:
            t = truth(VelocityProblem(**case), task)
            for i in range(len(case["J"])):
                step = np.eye(len(case["J"]))[i]
                up, down = (
                    truth(VelocityProblem(**case | {"xdot": case["xdot"] + s * step}), task).value_exact for s in (1, -1)
                )
                assert (up - down) / 2 == -t.y_exact[i]


def test_least_squares_derivative_on_deficient_rows() -> None:
    """With rank J < m too, the y in Wx range(J) is -d value / d xdot."""
    W, Wx = np.diag([20.0, 20, -1]), np.array([[2.0, 1], [1, 1]])
    t = truth(VelocityProblem(F0, [1, 1], W, [1, 2, 3], Wx), "least_squares")
    for i, step in enumerate(np.eye(2)):
        up, down = (
            truth(VelocityProblem(F0, [1, 1] + s * step, W, [1, 2, 3], Wx), "least_squares").value_exact for s in (1, -1)
        )
        assert (up - down) / 2 == -t.y_exact[i]


def test_consistent_rows_need_no_target_weight() -> None:
    """With full row rank the least-squares answer is the exact one, whatever Wx > 0 is (methods 6.2)."""
    for case in cases()[:40]:
        m = len(case["J"])
        Wx = np.eye(m) + np.ones((m, m))
        one, other = truth(VelocityProblem(**case)), truth(VelocityProblem(**case, Wx=Wx), "least_squares")
        assert (one.x_exact, one.y_exact, one.inertia) == (other.x_exact, other.y_exact, other.inertia)


# --- margin ---


def test_margin_of_f1() -> None:
    """F1, diag(w,1,1): |N'WN| / |W| = |2 + w| / 3 / max(1, |w|), or the row-equilibrated ratio 2 - sqrt 3."""
    ratio = 2 - np.sqrt(3)  # rows (-1,-1,0)/sqrt2, (2,1,1)/sqrt6 have cosine sqrt(3)/2
    for w in (-1.0, -1.5, -1.9, -2.1, -3.0, 5.0):
        t = truth(VelocityProblem(F1, [1, 1], np.diag([w, 1, 1])))
        assert t.margin == pytest.approx(min(ratio, abs(2 + w) / 3 / max(1, abs(w))), rel=1e-13)


def test_margin_is_where_the_class_changes() -> None:
    """A change of W by 1.01 margins along the deciding direction turns the class over, by 0.99 margins it does not."""
    rng = np.random.default_rng(8)
    J, turned = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0]]), 0
    for _ in range(40):
        A = rng.standard_normal((4, 4))
        W = A + A.T + 2 * np.eye(4)
        t = truth(VelocityProblem(J, [1, 1], W))
        if t.reason not in ("condition_7", "saddle") or t.margin > 0.3:
            continue
        lam, v = np.linalg.eigh(W[2:, 2:])
        z = np.concatenate([[0, 0], v[:, 0]])
        change = -np.sign(lam[0]) * t.margin * np.linalg.norm(W, 2) * np.outer(z, z)
        assert truth(VelocityProblem(J, [1, 1], W + 0.99 * change)).expected == t.expected
        assert truth(VelocityProblem(J, [1, 1], W + 1.01 * change)).expected != t.expected
        turned += 1
    assert turned > 15


@pytest.mark.parametrize("level", [1e-3, 1e-8, 1e-12, 1e-17])
def test_margin_of_near_singular_rows(level: float) -> None:
    """sigma_r / sigma_1 of the row-equilibrated J bounds the margin; below rounding it is tiny, never negative."""
    t = truth(VelocityProblem([[1, 0, 0], [1, level, 0]], [1, 1], np.eye(3)))
    if level > 1e-16:
        assert t.rank == 2 and t.margin == pytest.approx(level / 2, rel=1e-3)
    assert truth(VelocityProblem([[1, 0, 0], [0, level, 0]], [1, 1], np.eye(3))).margin == 1.0  # rows are scaled
    assert 0 <= t.margin < level


def test_margin_of_inconsistent_rates() -> None:
    """Infeasible by |(I - JJ^+) xdot| / |xdot| = 3/5; consistent with dependent rows is a boundary."""
    J = np.array([[1.0, 2, 0], [0, 0, 0]])
    assert truth(VelocityProblem(J, [4, 3], np.eye(3))).margin == pytest.approx(0.6, rel=1e-15)
    assert truth(VelocityProblem(J, [4, 1e-12], np.eye(3))).margin == pytest.approx(2.5e-13, rel=1e-3)
    assert truth(VelocityProblem(J, [4, 0], np.eye(3))).margin == 0.0
    assert truth(VelocityProblem(J, [4, 0], np.eye(3)), "least_squares").margin == 1.0


def test_margin_of_target_weights() -> None:
    """Wx counts by its smallest eigenvalue on range J, by its most negative one where there is one."""
    J = np.eye(2, 3)
    for small, margin in ((1e-5, 1e-5), (-1e-4, 1e-4), (0.0, 0.0)):
        p = VelocityProblem(J, [1, 1], np.eye(3), Wx=np.diag([1, small]))
        assert truth(p, "least_squares").margin == pytest.approx(margin, rel=1e-9)
    rank_one = np.array([[9.0, 3, 21], [3, 1, 7], [21, 7, 49]])  # singular on range J: a boundary, exactly 0
    p = VelocityProblem([[1.0, 2, 0, 5], [3, -1, 1, 0], [2, 2, 7, 1]], [1, 2, 3], np.eye(4), Wx=rank_one)
    assert truth(p, "least_squares").margin == 0.0


def test_margin_of_damped() -> None:
    """J = 0 and W = diag(1, w): lambda^2 w decides, against the larger of lambda^2 |W| and |Wx|."""
    for w in (-0.5, 0.25):
        t = truth(VelocityProblem([[0.0, 0]], [1], np.diag([1, w])), "damped", damping=0.5)
        assert t.margin == pytest.approx(0.25 * abs(min(w, 1)), rel=1e-14)
    assert truth(VelocityProblem([[0.0, 0]], [1], np.diag([1.0, 0])), "damped").margin == 0.0


def test_margin_is_zero_on_boundaries() -> None:
    """Not unique and descending are boundaries: margin exactly 0, in every task."""
    for case in integers(13, 200):
        for task in TASKS:
            t = truth(VelocityProblem(**case), task)
            if t.reason in ("singular", "descending"):
                assert t.margin == 0.0
            if task == "exact" and t.expected != "infeasible" and t.rank < len(case["J"]):
                assert t.margin == 0.0


# --- posed QPs, stacks, the door ---


def test_posed_qp_is_the_exact_task() -> None:
    """A QP in floats gets the class, x, y and value of the exact task on the same numbers; without rows too."""
    for case in integers(17, 150):
        t, q = truth(VelocityProblem(**case)), truth_of_qp(case["W"], case["a"], case["J"], case["xdot"])
        for name in ("expected", "reason", "margin", "rank", "inertia", "x_exact", "y_exact", "value_exact"):
            assert getattr(t, name) == getattr(q, name)
    free = truth_of_qp(np.diag([2.0, 4]), np.array([-2.0, 4]), np.zeros((0, 2)), np.zeros(0))
    assert (free.x_exact, free.y_exact, free.y.shape, free.rank, free.value_exact) == ((1, -1), (), (0,), 0, -3)
    assert free.margin == pytest.approx(0.5)


def test_posed_stack() -> None:
    """A stack of QPs gives a list, one Truth each."""
    H = np.array([np.eye(2), -np.eye(2)])
    both = truth_of_qp(H, np.ones((2, 2)), np.ones((2, 1, 2)), np.ones((2, 1)))
    assert [t.reason for t in both] == ["condition_7", "maximum"]


def test_rounded_normal_equations_have_another_rank() -> None:
    """fl(J'WxJ) is not J'WxJ: the posed QP has its own exact class, which the truth of the problem has not."""
    rng = np.random.default_rng(9)
    J, W = rng.standard_normal((2, 4)), np.eye(4)
    given = VelocityProblem(J, [1, 1], W)
    assert truth(given, "least_squares").rank == 2
    posed = truth_of_qp(W, np.zeros(4), J.T @ J, J.T @ np.ones(2))
    assert posed.rank > 2


def test_stack_is_its_members() -> None:
    """A stack gives the list of its members' truths, in C order for more axes than one."""
    rng = np.random.default_rng(10)
    W = np.array([np.eye(3), np.diag([-3.0, 1, 1])])
    stack = VelocityProblem(F1, rng.standard_normal((3, 2, 2)), W, rng.standard_normal(3))
    together = truth(stack)
    alone = [truth(stack[i, j]) for i in range(3) for j in range(2)]
    assert [t.reason for t in together] == [t.reason for t in alone] == ["condition_7", "maximum"] * 3
    assert [t.x_exact for t in together] == [t.x_exact for t in alone]
    assert [t.margin for t in together] == [t.margin for t in alone]
    assert [t.reason for t in truth(stack[:1].stacked()[:1], "damped")] == ["condition_7"]


def test_result_is_frozen() -> None:
    """Arrays of a Truth are read-only, and it survives pickling between processes."""
    t = truth(VelocityProblem(F1, [1, 1], np.eye(3)))
    for array in (t.x, t.y, t.freedom):
        assert not array.flags.writeable
    assert pickle.loads(pickle.dumps(t)).x_exact == t.x_exact


def test_extreme_magnitudes() -> None:
    """Entries from 1e-150 to 1e150 are decided like any others, without a warning; what overflows is infinite."""
    J, W = np.array([[1e150, 1e-150, 0], [1e-150, 0, 1e150]]), np.diag([1e150, 1e-150, 1.0])
    for task in TASKS:
        agree({"J": J, "xdot": np.array([1e150, -1e-150]), "W": W, "a": np.full(3, 1e-150), "Wx": None}, task)
    t = truth(VelocityProblem([[1e-150, 0]], [1e150], np.eye(2), [0, 1e150]))
    assert (t.x[0], t.value) == (1e150 / 1e-150, np.inf)
    huge = Weight(np.zeros((2, 2)), [[0, 1e150]], [1e150])
    unseen = truth(VelocityProblem([[1.0, 0]], [1], huge))
    assert (unseen.reason, unseen.margin) == ("condition_7", 0.0)  # W overflows in float64: not decidable there


def test_refusals() -> None:
    """Unknown tasks, dampings that are no number, and QPs with NaN or wrong shapes are refused by name."""
    p = VelocityProblem(F1, [1, 1], np.eye(3))
    with pytest.raises(UnknownNameError, match=r"'exat'.*damped, exact, least_squares"):
        truth(p, "exat")
    with pytest.raises(NonFiniteError, match="damping"):
        truth(p, "damped", damping=np.nan)
    with pytest.raises(RangeError, match="damping"):
        truth(p, "damped", damping=1e300)
    with pytest.raises(ShapeError, match="damping"):
        truth(p, "damped", damping=np.ones(2))  # type: ignore[arg-type]
    with pytest.raises(NonFiniteError, match="H"):
        truth_of_qp(np.full((2, 2), np.nan), np.ones(2), np.ones((1, 2)), np.ones(1))
    with pytest.raises(ShapeError, match="A has shape"):
        truth_of_qp(np.eye(2), np.ones(2), np.ones((2, 2)), np.ones(1))


def test_truth_is_monotone_in_the_weight() -> None:
    """Along W = I - t n n'/n'n the class goes from unique to boundary to maximum, with the margin falling to 0."""
    n = np.array([-1.0, 1, 1])
    truths = [truth(VelocityProblem(F1, [0, 0], 3 * np.eye(3) - t * np.outer(n, n))) for t in (0.25, 0.5, 0.75, 1)]
    assert [t.expected for t in truths] == ["unique_minimum"] * 3 + ["minimum_not_unique"]
    assert all(a.margin >= b.margin for a, b in pairwise(truths)) and truths[-1].margin == 0.0
