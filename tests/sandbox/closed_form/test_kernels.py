"""The scalar loops: counted, exact, compiled, and the same in all three."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pytest

from sandbox.closed_form import kernels
from sandbox.closed_form.compiled import compiled
from sandbox.closed_form.eq2_5 import eq2_5
from sandbox.closed_form.eq6 import arrays, eq6
from sandbox.closed_form.uncompiled import eq2_5_on, eq6_exact, eq6_on, operations
from sandbox.problem import VelocityProblem
from sandbox.tolerances import UNIT
from sandbox.weight import Weight

TABLE_I = {
    ("eq2_5", False): (
        lambda n, m: 2 * m + 9 * m**2 + m**3 + 6 * n + 15 * m * n + 3 * m**2 * n,
        lambda n, m: -10 * m + 3 * m**2 + m**3 + 15 * m * n + 3 * m**2 * n,
    ),
    ("eq2_5", True): (
        lambda n, m: 2 * m + 9 * m**2 + m**3 + 8 * n + 18 * m * n + 3 * m**2 * n + 9 * n**2 + 3 * m * n**2 + n**3,
        lambda n, m: 3 * m**2 - 10 * m + m**3 - 7 * n + 12 * m * n + 3 * m**2 * n + 6 * n**2 + 3 * m * n**2 + n**3,
    ),
    ("eq6", False): (
        lambda n, m: -6 * m - 9 * m**2 + 3 * m**3 + 4 * n + 9 * m * n - 9 * m**2 * n + 6 * n**2 + 6 * m * n**2 + 2 * n**3,
        lambda n, m: 3 * m**2 + 3 * m**3 - 5 * n - 3 * m * n - 9 * m**2 * n + 3 * n**2 + 6 * m * n**2 + 2 * n**3,
    ),
    ("eq6", True): (
        lambda n, m: -6 * m - 9 * m**2 + 3 * m**3 + 4 * n + 9 * m * n - 9 * m**2 * n + 6 * n**2 + 8 * n**3,
        lambda n, m: 3 * m**2 + 3 * m**3 - 5 * n + 3 * m * n - 9 * m**2 * n - 3 * n**2 + 8 * n**3,
    ),
}
"""Six times the polynomials printed in Table I: multiplications with divisions, additions with subtractions."""

TABLE_II = {("eq2_5", False): (330, 275), ("eq2_5", True): (631, 499), ("eq6", False): (195, 154), ("eq6", True): (244, 196)}


@pytest.mark.parametrize(("method", "weighted"), TABLE_I)
def test_counts_are_table_one(method: str, weighted: bool) -> None:
    """Run on counting numbers the kernels take exactly the operations of Table I, for every 1 <= m < n <= 8."""
    multiplications, additions = TABLE_I[method, weighted]
    for n in range(2, 9):
        for m in range(1, n):
            total = operations(method, n, m, weighted=weighted)
            assert (6 * total.multiplications, 6 * total.additions) == (multiplications(n, m), additions(n, m)), (n, m)


@pytest.mark.parametrize(("method", "weighted"), TABLE_II)
def test_counts_are_table_two(method: str, weighted: bool) -> None:
    """At n = 7, m = 6 the counts are those of Table II."""
    total = operations(method, 7, 6, weighted=weighted)
    assert (total.multiplications, total.additions) == TABLE_II[method, weighted]


def test_eq6_on_rationals_is_exact(manufactured: Callable[..., VelocityProblem]) -> None:
    """On Fractions eq. (6) and its multipliers satisfy J x = xdot and W x + a + J'y = 0 with no error at all."""
    rng = np.random.default_rng(61)
    for n, m in ((2, 1), (3, 2), (4, 2), (5, 2), (4, 4)):
        for p in manufactured(rng, n, m, 3, cross=1):
            code, x, y, _ = eq6_exact(p)
            fraction = np.vectorize(Fraction, otypes=[object])
            J, W = fraction(p.J), fraction(p.W.base)
            assert code == kernels.SOLVED
            assert (J @ x == fraction(p.xdot)).all()
            assert (W @ x + fraction(p.a) + J.T @ y == 0).all()


def test_exact_kernel_is_the_exact_kkt_solution(manufactured: Callable[..., VelocityProblem], exact: Callable) -> None:
    """The Fractions of eq. (6), rounded once, are bit for bit those of the rational KKT system; factored weights too."""
    rng = np.random.default_rng(62)
    dense = manufactured(rng, 4, 2, 5, cross=1, tangent=1)
    factored = VelocityProblem(
        J=dense.J, xdot=dense.xdot, a=dense.a, W=Weight(np.eye(4), rng.normal(size=(5, 3, 4)), rng.normal(size=(5, 3)) ** 2)
    )
    for problem in (dense, factored):
        x, y = exact(problem)
        for i, p in enumerate(problem):
            _, ours, multipliers, _ = eq6_exact(p)
            np.testing.assert_array_equal([float(v) for v in ours], x[i])
            np.testing.assert_array_equal([float(v) for v in multipliers], y[i])


def test_compiled_and_uncompiled_agree_bitwise(manufactured: Callable[..., VelocityProblem]) -> None:
    """Compiled or not, on plain floats both kernels give the same bits: one source, one order of operations."""
    problem = manufactured(np.random.default_rng(63), 6, 4, 20, positive=True, cross=1)
    six, normal = eq6(problem), eq2_5(problem)
    for i, p in enumerate(problem):
        _, x, y, _ = eq6_on(float, p.J, p.xdot, p.W.base, p.a)
        np.testing.assert_array_equal(x.astype(float), six.x[i])
        np.testing.assert_array_equal(y.astype(float), six.y[i])
        _, x, y = eq2_5_on(float, p.J, p.xdot, p.W.base, p.a)
        np.testing.assert_array_equal(x.astype(float), normal.x[i])
        np.testing.assert_array_equal(y.astype(float), normal.y[i])


def test_trailing_pivots_decide_condition_seven(manufactured: Callable[..., VelocityProblem]) -> None:
    """All last n - m pivots of the exact LU are positive exactly where N'WN is positive definite (methods 1.9)."""
    rng = np.random.default_rng(64)
    seen = set()
    for n, m in ((3, 1), (4, 2), (5, 2), (5, 4)):
        for p in manufactured(rng, n, m, 10, tangent=1, cross=1):
            N = np.linalg.svd(p.J)[2][m:].T
            shift = rng.choice([0, 1.25, 2.5]) * np.linalg.norm(p.W.base, 2) / 10 * (N @ np.diag(rng.uniform(size=n - m)) @ N.T)
            W = p.W.base - (shift + shift.T) / 2
            lowest = np.linalg.eigvalsh(N.T @ W @ N)[0]
            code, *_ = eq6_on(Fraction, p.J, p.xdot, W, p.a)
            assert (code == kernels.SOLVED) == (lowest > 0)
            seen.add(code)
    assert seen == {kernels.SOLVED, kernels.CURVATURE}


def test_trailing_pivots_are_those_of_the_reduced_weight() -> None:
    """Pivot by pivot, the trailing LU is the LDL' of N'WN with N completed by the identity (methods 1.9)."""
    J, W = [[-2, -2, -1, -1], [2, 1, 1, 0]], np.diag([-1, 1, 1, 1])
    code, _, _, pivots = eq6_on(Fraction, J, [1, 1], W, [0, 0, 0, 0])
    # rows of J pick columns 1 and 2; the free joints are 3 and 4 with N = [-1/2, 0, 1, 0]', [1/2, -1, 0, 1]'
    N = np.array([[Fraction(-1, 2), 0, 1, 0], [Fraction(1, 2), -1, 0, 1]], dtype=object).T
    assert not (np.array(J, dtype=object) @ N).any()
    S = N.T @ W.astype(object) @ N
    assert code == kernels.SOLVED
    assert list(pivots[2:]) == [S[0, 0], S[1, 1] - S[0, 1] ** 2 / S[0, 0]]


def test_pivots_are_within_their_rounding_bound() -> None:
    """Every pivot that eq. (6) computes is within n u of its bound from the exact one, with J, C and S_N of any condition."""
    rng = np.random.default_rng(66)
    worst = {"rank": 0.0, "curvature": 0.0}
    for _ in range(300):
        n = int(rng.integers(2, 6))
        m = int(rng.integers(1, n))
        U, V, Q = (np.linalg.qr(rng.normal(size=(size, size)))[0] for size in (m, n, n - m))
        Y, N = V[:, :m], V[:, m:]
        J = U @ np.diag(10.0 ** -(rng.choice([0, 4, 8]) * np.linspace(0, 1, m))) @ Y.T
        C = Y @ rng.normal(size=(m, n - m)) @ N.T * rng.choice([0, 1, 1e4])
        W = C + C.T + N @ Q @ np.diag(10.0 ** -rng.uniform(0, 9, n - m)) @ Q.T @ N.T + Y @ Y.T * rng.choice([0, 1, 1e3])
        problem = VelocityProblem(J=J, xdot=np.ones(m), W=(W + W.T) / 2).stacked()
        x, y, pivot, bound = np.empty((1, n)), np.empty((1, m)), np.empty((1, n)), np.empty((1, n))
        code = np.empty(1, dtype=np.int64)
        compiled("eq6_stack")(*arrays(problem, np.float64), 1.0, True, x, y, pivot, bound, code)
        exact_code, _, _, exact = eq6_on(Fraction, J, np.ones(m), problem.W.base[0], np.zeros(n))
        if code[0] == exact_code == kernels.SOLVED:
            share = [float(abs(Fraction(pivot[0, i]) - exact[i])) / (n * UNIT * bound[0, i]) for i in range(n)]
            worst["rank"], worst["curvature"] = max(worst["rank"], *share[:m]), max(worst["curvature"], *share[m:])
    assert 1e-2 < worst["rank"] < 1 and 1e-2 < worst["curvature"] < 1


def test_single_precision_stays_single(manufactured: Callable[..., VelocityProblem]) -> None:
    """With dtype float32 nothing is computed in double: the answers are float32 numbers, off by single rounding."""
    problem = manufactured(np.random.default_rng(65), 7, 4, 50, positive=True)
    for form in (eq6, eq2_5):
        double, single = form(problem), form(problem, dtype=np.float32)
        assert (single.x == single.x.astype(np.float32)).all()
        off = np.abs(single.x - double.x).max()
        assert 1e-9 < off < 1e-2


def test_compiled_kernels_raise_nothing_on_division_by_zero() -> None:
    """A singular member ends with a code, not with an exception that would stop the stack."""
    problem = VelocityProblem(J=np.zeros((3, 2, 4)), xdot=np.ones(2), W=np.eye(4))
    x, y, pivot, bound = np.empty((3, 4)), np.empty((3, 2)), np.empty((3, 4)), np.empty((3, 4))
    code = np.empty(3, dtype=np.int64)
    compiled("eq6_stack")(*arrays(problem, np.float64), 1.0, True, x, y, pivot, bound, code)
    assert (code == kernels.RANK).all()
