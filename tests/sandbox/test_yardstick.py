"""The yardstick against formulas that never form or invert K, against unit perturbations in fractions, and invariances.

K^-1 = [N S^-1 N'  G; G' -S'] by methods 1.2 and 1.3: from a null space and a pseudoinverse, one problem at a time.
"""

from __future__ import annotations

from fractions import Fraction as F
from typing import NamedTuple

import numpy as np
import pytest

from sandbox.problem import VelocityProblem
from sandbox.reference.truth import truth
from sandbox.tolerances import DAMPING
from sandbox.verdict import EXPECTED
from sandbox.weight import Weight
from sandbox.yardstick import Yardstick, _inverse
from tests.oracle import oracle

Array = np.ndarray


class Figures(NamedTuple):
    """What a yardstick measures."""

    primal_gain: float
    dual_gain: float
    spread: float
    size: float


def blocks(W: Array, C: Array) -> tuple[Array, Array]:
    """X11, X12 of the inverse of [W C'; C 0], C of full row rank (methods 1.2)."""
    N = np.linalg.svd(C)[2][len(C) :].T
    X11 = N @ np.linalg.solve(N.T @ W @ N, N.T) if N.shape[1] else np.zeros_like(W)
    return X11, (np.eye(len(W)) - X11 @ W) @ np.linalg.pinv(C)


def figures(problem: VelocityProblem, task: str, Z: Array, x: Array) -> Figures:
    """One problem's figures from the formulas; the multipliers from stationarity at x, not from the truth."""
    J, xdot, W, a = problem.J, problem.xdot, problem.W.dense(), problem.a
    m, n = J.shape
    Wx = np.eye(m) if problem.Wx is None else problem.Wx
    U = np.linalg.svd(J)[0]
    r = np.linalg.matrix_rank(J)
    ways = [np.eye(m)]  # how a residual reaches the rows that decide
    C, d, z = J, xdot, x
    if task == "damped":
        zero = np.zeros((n, m))
        W, a = np.block([[DAMPING**2 * W, zero], [zero.T, Wx]]), np.append(DAMPING**2 * a, np.zeros(m))
        C, z = np.hstack([J, np.eye(m)]), np.append(x, xdot - J @ x)
    elif task == "least_squares":
        left = U[:, :r].T @ Wx
        C, d, ways = left @ J, left @ xdot, [np.eye(r), np.linalg.pinv(J.T @ U[:, :r])]
    elif r < m:
        C, d, ways = U[:, :r].T @ J, U[:, :r].T @ xdot, [U[:, :r].T]
    mu = np.linalg.lstsq(C.T, -(W @ z + a), rcond=None)[0]
    np.testing.assert_allclose(W @ z + a + C.T @ mu, 0, atol=1e-9)  # x is what the figures are about
    Z = np.vstack([Z, np.zeros((len(z) - n, Z.shape[1]))])
    whole = np.vstack([C, Z.T])
    X11, X12 = blocks(W, whole)
    mu, d = np.append(mu, np.zeros(Z.shape[1])), np.append(d, np.zeros(Z.shape[1]))
    top, right = np.abs(X11[:n]), np.abs(X12[:n])
    rates = abs(W) @ abs(z) + abs(whole).T @ abs(mu) + abs(a)
    spread = top @ rates + right @ (abs(whole) @ abs(z) + abs(d))
    s = top @ abs(a) + right @ abs(d)
    primal = max((float(np.abs(X12[:n, : len(C)] @ way).sum(axis=1).max()) for way in ways if len(C)), default=0.0)
    return Figures(primal, float(top.sum(axis=1).max()), float(spread.max()), float(max(abs(x).max(), s.max())))


def indefinite(rng: np.random.Generator, J: Array, free: int = 0) -> Array:
    """A weight that is indefinite, positive on null J but for `free` directions that cost nothing."""
    N = np.linalg.svd(J)[2][np.linalg.matrix_rank(J) :].T
    k = N.shape[1] - free
    A = rng.standard_normal((k, len(J[0])))
    A[:, :] = A @ (np.eye(len(J[0])) - N[:, k:] @ N[:, k:].T)
    return A.T @ A - 2 * J.T @ J


def small(rng: np.random.Generator, m: int, n: int, rank: int) -> Array:
    """Integer Jacobian of exact rank `rank`."""
    while True:
        J = (rng.integers(-2, 3, (m, rank)) @ rng.integers(-2, 3, (rank, n))).astype(float)
        if np.linalg.matrix_rank(J) == rank:
            return J


def stack(task: str, m: int, n: int, ranks: list[int], *, target: bool, seed: int = 0) -> VelocityProblem:
    """Well-posed problems of several ranks in one stack; xdot achievable where the task asks for it."""
    rng = np.random.default_rng(seed)
    J = np.array([small(rng, m, n, r) for r in ranks])
    W = np.array([indefinite(rng, j) for j in J])
    if task == "damped":  # lambda^2 W + J'WxJ > 0 needs more of W
        W = np.array([3 * np.eye(n) + w @ w / np.abs(w).max() for w in W])
    xdot = (J @ rng.integers(-2, 3, (len(J), n, 1)))[..., 0]
    if task != "exact":
        xdot = xdot + rng.integers(-2, 3, xdot.shape)
    B = rng.integers(-1, 2, (len(J), m, m))
    Wx = B @ np.swapaxes(B, -1, -2) + np.eye(m) if target else None
    return VelocityProblem(J, xdot, (W + np.swapaxes(W, -1, -2)) / 2, rng.integers(-3, 4, (len(J), n)), Wx)


STACKS = [
    ("exact", 2, 4, [2, 1, 2, 0, 1], False),
    ("exact", 3, 3, [3, 2, 3], False),
    ("least_squares", 2, 4, [2, 1, 0, 1], False),
    ("least_squares", 3, 4, [2, 3, 1, 2], True),
    ("least_squares", 4, 2, [2, 1], True),
    ("damped", 2, 4, [2, 1, 0], False),
    ("damped", 3, 2, [2, 1], True),
]


@pytest.mark.parametrize(("task", "m", "n", "ranks", "target"), STACKS)
def test_every_figure_is_its_formula(task: str, m: int, n: int, ranks: list[int], target: bool) -> None:
    """Gains, spread and size of each member of a stack of mixed ranks are those of the formulas."""
    problem = stack(task, m, n, ranks, target=target, seed=m + n)
    truths = truth(problem, task)
    yardstick = Yardstick.of(problem, task, truths)
    assert [EXPECTED[code] for code in yardstick.expected] == ["unique_minimum"] * len(ranks)
    for i, t in enumerate(truths):
        measured = Figures(*(float(getattr(yardstick, name)[i]) for name in Figures._fields))
        np.testing.assert_allclose(measured, figures(problem[i], task, t.freedom, t.x), rtol=1e-9, atol=1e-13)
        largest = np.abs(t.x).max()
        if largest > 0:
            np.testing.assert_allclose(yardstick.kappa[i], measured.spread / largest)


def test_gains_of_dependent_rows_are_per_row_of_the_task() -> None:
    """With r < m a unit residual is one of the m rows as given, not of the r combinations that decide."""
    problem = VelocityProblem([[0.25, 0, 0], [0.25, 1, 0], [0, 0, 0]], [1.0, 2, 0], np.eye(3)).stacked()
    yardstick = Yardstick.of(problem, "exact", truth(problem))
    np.testing.assert_allclose(yardstick.primal_gain[0], 4, rtol=1e-13)  # x1 = 4 xdot1, x2 = xdot2 - xdot1


@pytest.mark.parametrize("task", ["exact", "least_squares", "damped"])
def test_a_minimum_that_is_not_unique_is_measured_across_its_freedom(task: str) -> None:
    """With Z bordered on, the figures are those of the answer of least norm; unique members beside it keep theirs."""
    J = np.array([[[1.0, 0, 0, 2]], [[1, 1, 0, 0]], [[0, 2, 0, 0]]])
    W = np.array([np.diag([1.0, 0, 2, 0]), np.diag([0.0, 3, 2, 1]), np.diag([1.0, 5, 0, 0])])
    a = np.array([[1.0, 0, 3, 2], [0, 1, 1, 2], [2, 1, 0, 0]])
    if task == "damped":  # what costs nothing must now lie in null J; the rest stiff, so that it hides nothing
        W[0], a[0] = np.diag([0.0, 0, 512, 0]), 0
    problem = VelocityProblem(J, [[3.0], [2], [4]], W, a)
    truths = truth(problem, task)
    degrees = [t.freedom.shape[1] for t in truths]
    assert 0 in degrees and 2 in degrees
    yardstick = Yardstick.of(problem, task, truths)
    for i, t in enumerate(truths):
        measured = [float(getattr(yardstick, name)[i]) for name in Figures._fields]
        np.testing.assert_allclose(measured, figures(problem[i], task, t.freedom, t.x), rtol=1e-9)
        np.testing.assert_allclose(yardstick.freedom[i], t.freedom @ t.freedom.T)


def response(H: oracle.Matrix, g: oracle.Vector, A: oracle.Matrix, b: oracle.Vector, n: int) -> tuple[F, F]:
    """How far a unit residual of each row of A x = b, and of each stationarity row, moves the first n of x at worst."""

    def moved(parts: list[oracle.Vector]) -> F:
        return max(sum(abs(step[i]) for step in parts) for i in range(n))

    def answer(g: oracle.Vector, b: oracle.Vector) -> oracle.Vector:
        x = oracle.qp(H, g, A, b).x
        assert x is not None
        return x

    def bumped(v: oracle.Vector, j: int) -> oracle.Vector:
        return [u + (i == j) for i, u in enumerate(v)]

    x = answer(g, b)
    rows = [[u - v for u, v in zip(answer(g, bumped(b, j)), x, strict=True)] for j in range(len(b))]
    slopes = [[u - v for u, v in zip(answer(bumped(g, j), b), x, strict=True)] for j in range(len(g))]
    return moved(rows), moved(slopes)


def test_gains_are_what_unit_residuals_do() -> None:
    """|X12|_inf and |X11|_inf are the worst motion of x by a unit residual, found by solving perturbed QPs exactly."""
    J, W = [[-1, -1, 0], [2, 1, 1]], [[-1, 0, 1], [0, 1, 0], [1, 0, 3]]
    problem = VelocityProblem(J, [1, 1], W, [1, -2, 3])
    yardstick = Yardstick.of(problem.stacked(), "exact", [truth(problem)])
    rows, slopes = response(oracle.rational(W), oracle.vector([1, -2, 3]), oracle.rational(J), oracle.vector([1, 1]), 3)
    np.testing.assert_allclose((yardstick.primal_gain[0], yardstick.dual_gain[0]), (float(rows), float(slopes)), rtol=1e-13)


def test_gains_of_damping_count_the_slack_joints() -> None:
    """For damping a residual of the slack joints' own stationarity moves the joints too, more so where Wx is small."""
    J, W, Wx = [[-1.0, -1, 0], [2, 1, 1]], [[2.0, 0, 1], [0, 1, 0], [1, 0, 2]], [[0.125, 0], [0, 0.25]]
    problem = VelocityProblem(J, [1, 1], W, [1, -2, 3], Wx)
    yardstick = Yardstick.of(problem.stacked(), "damped", [truth(problem, "damped")])
    s = F(DAMPING) ** 2
    H = [[*(s * v for v in row), F(0), F(0)] for row in oracle.rational(W)] + [[F(0)] * 3 + row for row in oracle.rational(Wx)]
    A = [[*row, *unit] for row, unit in zip(oracle.rational(J), oracle.identity(2), strict=True)]
    rows, slopes = response(H, [s, -2 * s, 3 * s, F(0), F(0)], A, oracle.vector([1, 1]), 3)
    np.testing.assert_allclose((yardstick.primal_gain[0], yardstick.dual_gain[0]), (float(rows), float(slopes)), rtol=1e-12)


@pytest.mark.parametrize("scale", [2.0**-7, 2.0**7])
def test_least_squares_takes_the_worse_of_two_posings(scale: float) -> None:
    """With J small the normal equations let more through, with J large the r rows do: the larger gain counts."""
    J = np.array([[3.0, 1, 0], [1, 2, 2]]) * scale
    problem = VelocityProblem(J, [1, 1], np.eye(3))
    yardstick = Yardstick.of(problem.stacked(), "least_squares", [truth(problem, "least_squares")])
    U = np.linalg.svd(J)[0]
    across_rows = np.abs(np.linalg.pinv(J) @ U).sum(axis=1).max()  # x = J^+ U d
    normal = np.abs(np.linalg.pinv(J.T @ J)).sum(axis=1).max()  # x = (J'J)^+ residual
    assert (normal > across_rows) == (scale < 1)
    np.testing.assert_allclose(yardstick.primal_gain[0], max(across_rows, normal), rtol=1e-12)


@pytest.mark.parametrize(
    ("weight", "rows", "joints"),
    [(2.0**20, [1, 1], [1, 1, 1, 1]), (2.0**-20, [2.0**17, 2.0**-9], [1, 1, 1, 1]), (1, [1, 1], [0.5, 0.5, 0.5, 0.5])],
)
def test_units_do_not_change_the_condition(weight: float, rows: list[float], joints: list[float]) -> None:
    """Kappa, and with it any relative tolerance, stays when W is scaled against J, rows of J scaled, or all joints."""
    problem = stack("exact", 2, 4, [2, 2, 2], target=False, seed=9)
    D, S = np.array(rows), np.array(joints)
    scaled = VelocityProblem(
        D[:, None] * problem.J * S, D * problem.xdot, weight * S[:, None] * problem.W.dense() * S, weight * S * problem.a
    )
    before, after = (Yardstick.of(p, "exact", truth(p)) for p in (problem, scaled))
    np.testing.assert_allclose(after.kappa, before.kappa, rtol=1e-6)
    np.testing.assert_allclose(after.size, before.size / S[0], rtol=1e-6)
    np.testing.assert_allclose(after.spread, before.spread / S[0], rtol=1e-6)
    np.testing.assert_allclose(after.dual_gain, before.dual_gain / weight / S[0] ** 2, rtol=1e-6)


def test_columns_are_those_of_each_problem() -> None:
    """Eigenvalues, norms, margins and reasons are each member's own; figures are null where there is no minimum."""
    J = np.array([[[1.0, 2, 0]], [[0, 0, 0]], [[1, 0, 1]], [[0, 3, 4]]])
    W = np.array([np.diag([1.0, 2, -3]), np.diag([1.0, 2, 3]), -np.eye(3), [[2.0, 1, 0], [1, 2, -4], [0, -4, 9]]])
    problem = VelocityProblem(J, [[1.0], [2], [3], [0]], W, np.zeros((4, 3)))
    truths = truth(problem)
    yardstick = Yardstick.of(problem, "exact", truths)
    assert [EXPECTED[c] for c in yardstick.expected] == ["no_minimum", "infeasible", "no_minimum", "unique_minimum"]
    assert yardstick.solvable.tolist() == [False, False, False, True]
    assert yardstick.reason == [t.reason for t in truths]
    assert yardstick.margin.tolist() == [t.margin for t in truths]
    assert yardstick.rank.tolist() == [1, 0, 1, 1]
    for i in range(4):
        N = np.linalg.svd(J[i])[2][yardstick.rank[i] :].T
        np.testing.assert_allclose(yardstick.lambda_min_W[i], np.linalg.eigvalsh(W[i]).min())
        np.testing.assert_allclose(yardstick.lambda_min_reduced[i], np.linalg.eigvalsh(N.T @ W[i] @ N).min())
        np.testing.assert_allclose(yardstick.sigma_min_J[i], np.linalg.norm(J[i]))
        np.testing.assert_allclose(yardstick.norm_W[i], np.linalg.norm(W[i], np.inf))
    missing = np.array([yardstick.primal_gain, yardstick.dual_gain, yardstick.spread, yardstick.size, yardstick.x[:, 0]])
    assert np.isnan(missing[:, :3]).all() and not np.isnan(missing[:, 3]).any()
    assert np.isnan(yardstick.kappa).all()  # the only minimum is at zero: nothing to be relative to
    held = VelocityProblem([[1.0, 1]], [0.0], np.eye(2), [1.0, 1]).stacked()
    stick = Yardstick.of(held, "exact", truth(held))
    assert stick.spread[0] > 0 and not stick.x.any() and np.isnan(stick.kappa[0])
    taken = yardstick[np.array([3, 0, 3])]
    assert taken.expected.tolist() == [0, 2, 0] and taken.reason == [truths[i].reason for i in (3, 0, 3)]
    np.testing.assert_array_equal(taken.view.problem.J, J[[3, 0, 3]])
    np.testing.assert_array_equal(taken.spread, yardstick.spread[[3, 0, 3]])
    assert (taken.view.task, taken.view.scale) == ("exact", 1.0)


def test_a_full_set_of_rows_leaves_no_reduced_weight() -> None:
    """With no null space there is no eigenvalue to report, and W has no say in the answer."""
    problem = VelocityProblem([[2.0, 0], [0, 4]], [1, 1], -np.eye(2)).stacked()
    yardstick = Yardstick.of(problem, "exact", truth(problem))
    assert np.isnan(yardstick.lambda_min_reduced[0])
    assert (yardstick.dual_gain[0], yardstick.primal_gain[0]) == (0, 0.5)
    assert yardstick[np.array([0])].sigma_min_J[0] == 2


def test_the_reduced_eigenvalue_comes_through_the_factors() -> None:
    """lambda_min(N'WN) of W = E'E is (E N)^2 also where it lies below the rounding of W."""
    d = 2.0**-28
    problem = VelocityProblem([[[1.0, 1]]], [[1.0]], Weight(np.zeros((2, 2)), [[1 + d, 1.0]]))
    yardstick = Yardstick.of(problem, "exact", truth(problem))
    np.testing.assert_allclose(yardstick.lambda_min_reduced[0], d**2 / 2, rtol=1e-6)


def test_inverses_do_not_care_for_units() -> None:
    """A matrix scaled by 2^+-40 at both sides is inverted to the digits of the unscaled one, against fractions."""
    K = np.array([[2.0, 1, 1, 0], [1, -3, 0, 1], [1, 0, 0, 0], [0, 1, 0, 0]])
    D = 2.0 ** np.array([40, -35, 12, -40])
    exact = [oracle.solve(oracle.rational(K), unit).solution for unit in oracle.identity(4)]
    inverse = _inverse(np.array([K, D[:, None] * K * D, K]))
    for found, scales in zip(inverse, (np.ones(4), D, np.ones(4)), strict=True):
        np.testing.assert_allclose(found * scales[:, None] * scales, np.array(exact, dtype=float), rtol=1e-14, atol=1e-15)


def test_a_singular_matrix_has_no_inverse_but_its_neighbours_do() -> None:
    """One singular member is infinite; the rest of the stack is inverted all the same."""
    K = np.array([[[2.0, 0], [0, 4]], [[0, 0], [0, 3]], [[1, 1], [1, 1]], [[0, 1], [1, 0]]])
    inverse = _inverse(K)
    np.testing.assert_allclose(inverse[0], np.diag([0.5, 0.25]), rtol=1e-15)
    np.testing.assert_array_equal(inverse[3], K[3])
    assert np.isinf(inverse[1]).all() and np.isinf(inverse[2]).all()
