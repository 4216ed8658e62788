"""Every closed form is within its own error bound of the exact answer."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from flint import fmpq, fmpq_mat

from sandbox.closed_form import CLOSED_FORMS
from sandbox.closed_form.damped_least_squares import slack_problem
from sandbox.problem import VelocityProblem
from sandbox.tolerances import DAMPING
from sandbox.weight import Weight

Array = np.ndarray

KINDS = {
    "plain": {},
    "W>0": {"positive": True},
    "J 1e4": {"cond_J": 4},
    "J 1e8": {"cond_J": 8},
    "W>0, J 1e6": {"cond_J": 6, "positive": True},
    "S_T 1e4": {"tangent": 4},
    "S_T 1e8": {"tangent": 8},
    "S_T 1e4, J 1e4": {"tangent": 4, "cond_J": 4},
    "C 1e4": {"cross": 4},
    "S_N 1e4, J 1e4": {"cond_S": 4, "cond_J": 4},
    "W>0, S_N 1e4": {"cond_S": 4, "positive": True},
    "rows 1e6": {"rows": 6},
    "gradient 1e6": {"gradient": 6},
}
PER_CELL = 20


@pytest.fixture(scope="module")
def pool(manufactured: Callable, exact: Callable, reach: Callable) -> list[tuple[str, VelocityProblem, Array, Array, Array]]:
    """2080 manufactured problems with their exact answers: kind, stack, x, y, reach."""
    rng = np.random.default_rng(20000)
    stacks = []
    for kind, knobs in KINDS.items():
        for n, m in ((2, 1), (3, 2), (4, 2), (5, 3), (6, 4), (7, 6), (7, 3), (9, 6)):
            problem = manufactured(rng, n, m, PER_CELL, **knobs)
            x, y = exact(problem)
            stacks.append((kind, problem, x, y, reach(problem, x)))
    assert sum(len(stack[1]) for stack in stacks) >= 2000
    return stacks


@pytest.mark.parametrize("name", [name for name, form in CLOSED_FORMS.items() if form.task != "damped"])
def test_within_its_bound(name: str, pool: list) -> None:
    """|x - x*|_inf <= bound max(|x*|_inf, s) wherever the form answers; J'y to the same share of |W||x*| + |a|."""
    form = CLOSED_FORMS[name]
    judged = 0
    for kind, problem, x, y, reach in pool:
        answer, bound = form.function(problem), form.bound(problem)
        assert not np.isnan(bound).any()
        answered = np.array([status.answered for status in answer.status])
        assert (answered | (bound >= 1)).all(), f"{kind}: refused though its own bound is below one: {answer.said}"
        if name in ("eq2_5", "finsler"):  # their residuals grow with the bound, so past one they have nothing to say
            assert not (answered & (bound >= 1)).any(), kind
        error = np.abs(answer.x - x).max(axis=1) / reach
        miss = np.abs(np.einsum("bmn,bm->bn", problem.J, answer.y - y)).max(axis=1)
        terms = np.abs(problem.W.dense()) @ np.abs(x)[..., None]
        miss = miss / ((terms[..., 0] + np.abs(problem.a)).max(axis=1) * (reach / np.abs(x).max(axis=1)))
        for value in (error, miss):
            worst = np.nanmax(np.where(answered, value / bound, np.nan), initial=0)
            assert worst <= 1, f"{kind}, n = {problem.n}, m = {problem.m}: {worst} times the bound"
        judged += int((answered & (bound < 1)).sum())
    assert judged >= (200 if form.domain == "W > 0" else 1500)


@pytest.mark.parametrize("name", ["eq6", "eq6_orthonormal", "null_space", "kkt"])
def test_bounds_are_not_vacuous(name: str, pool: list) -> None:
    """Somewhere in the pool the error reaches a thousandth of the bound; on well-conditioned problems it is small."""
    form = CLOSED_FORMS[name]
    closest = 0.0
    for kind, problem, x, _, reach in pool:
        answer, bound = form.function(problem), form.bound(problem)
        with np.errstate(invalid="ignore"):
            closest = max(closest, np.nanmax(np.abs(answer.x - x).max(axis=1) / reach / bound))
        if kind == "plain":
            assert np.median(bound) < 1e-11
    assert closest > 1e-3


def test_factored_weights_are_within_their_bound(exact: Callable, reach: Callable) -> None:
    """Weights kept as base + E' Gamma E: with and without a base, as many rows as null J has columns or more."""
    rng = np.random.default_rng(71)
    cases = ((4, 2, 2, 0.0, 0.0), (7, 4, 3, 0.0, 0.0), (7, 4, 5, 0.0, 0.0), (5, 3, 2, 1e-2, 0.0), (6, 4, 2, 1e-6, 1e7))
    for n, m, k, share, tangent in cases:
        J = rng.normal(size=(40, m, n))
        base = share * np.eye(n) + tangent * np.swapaxes(J, 1, 2) @ J
        problem = VelocityProblem(
            J=J, xdot=rng.normal(size=(40, m)), a=rng.normal(size=(40, n)),
            W=Weight(base, rng.normal(size=(40, k, n)), rng.uniform(0.1, 10, (40, k))),
        )  # fmt: skip
        x, _ = exact(problem)
        for name in ("eq6", "eq6_orthonormal", "null_space", "kkt", "finsler", "eq13"):
            answer, bound = CLOSED_FORMS[name].function(problem), CLOSED_FORMS[name].bound(problem)
            error = np.abs(answer.x - x).max(axis=1) / reach(problem, x)
            assert (error <= bound).all(), name


def test_cancelling_factors_are_counted(exact: Callable, reach: Callable) -> None:
    """Where base and E' Gamma E nearly cancel, forming W loses digits: the bounds of the forms that do so say it."""
    rng = np.random.default_rng(74)
    E = np.round(rng.normal(size=(60, 2, 6)) * 2**10) / 2**5
    small = np.eye(6) + 0.1 * np.ones((6, 6))
    problem = VelocityProblem(
        J=rng.normal(size=(60, 3, 6)), xdot=rng.normal(size=(60, 3)), a=rng.normal(size=(60, 6)),
        W=Weight(small - np.swapaxes(E, 1, 2) @ E / 3, E, np.full((60, 2), 1 / 3)),
    )  # fmt: skip
    x, _ = exact(problem)
    reached = reach(problem, x)
    for name, form in CLOSED_FORMS.items():
        if form.task != "damped":
            answer, bound = form.function(problem), form.bound(problem)
            error = np.abs(answer.x - x).max(axis=1) / reached
            assert (error <= bound).all() and (bound < 1e-3).all(), name
    normal = CLOSED_FORMS["eq2_5"]
    bound_formed = normal.bound(VelocityProblem(J=problem.J, xdot=problem.xdot, a=problem.a, W=problem.W.dense()))
    assert (normal.bound(problem) > 100 * bound_formed).all()


def test_damping_is_within_its_bound(manufactured: Callable, exact: Callable, reach: Callable) -> None:
    """Damped least squares meets the exact answer of the arm with slack joints, also where J loses rank."""
    rng = np.random.default_rng(72)
    form = CLOSED_FORMS["damped_least_squares"]
    for n, m, cond_J in ((3, 2, 0), (4, 2, 8), (7, 6, 12), (2, 2, 0)):
        problem = manufactured(rng, n, m, 20, positive=True, cond_J=cond_J)
        slack = slack_problem(problem, DAMPING)
        x, y = exact(slack)
        answer, bound = form.function(problem), form.bound(problem)
        error = np.abs(answer.x - x[:, :n]).max(axis=1) / reach(slack, x)
        assert (error <= bound).all() and (bound < 1e-6).all()
        np.testing.assert_allclose(answer.y, y, rtol=0, atol=bound.max() * np.abs(x).max() * 10)


def test_damping_keeps_factors(exact: Callable, reach: Callable) -> None:
    """Damped least squares with W = base + E' Gamma E: lambda^2 multiplies both parts."""
    rng = np.random.default_rng(75)
    E, gamma = rng.normal(size=(20, 2, 5)), rng.uniform(0.5, 2, (20, 2))
    fields = {"J": rng.normal(size=(20, 3, 5)), "xdot": rng.normal(size=(20, 3)), "a": rng.normal(size=(20, 5))}
    factored = VelocityProblem(**fields, W=Weight(np.eye(5), E, gamma))
    dense = VelocityProblem(**fields, W=factored.W.dense())
    form = CLOSED_FORMS["damped_least_squares"]
    one, two = form.function(factored, damping=0.5), form.function(dense, damping=0.5)
    slack = slack_problem(factored, 0.5)
    allowed = (form.bound(factored, damping=0.5) + form.bound(dense, damping=0.5)) * reach(slack, exact(slack)[0])
    assert (np.abs(one.x - two.x).max(axis=1) <= allowed).all() and (allowed < 1e-8).all()


def _least_squares(J: Array, B: Array, A: Array, W: Array, Wx: Array, a: Array, xdot: Array) -> Array:
    """The exact answer to eq. (13) for J = A B of rank r: B x = (A'Wx A)^-1 A'Wx xdot, W x + a in range B'."""
    n, r = len(a), len(B)
    rows = np.zeros((0, 1))
    if r:
        AtWx = fmpq_mat([[fmpq(*float(v).as_integer_ratio()) for v in row] for row in A.T @ Wx])
        rows = (AtWx * _column(A)).solve(AtWx * _column(xdot[:, None]))
    K = [[fmpq(*float(v).as_integer_ratio()) for v in row] for row in np.block([[W, B.T], [B, np.zeros((r, r))]])]
    right = [[fmpq(*float(-v).as_integer_ratio())] for v in a] + [[rows[i, 0]] for i in range(r)]
    z = fmpq_mat(K).solve(fmpq_mat(right))
    return np.array([int(z[i, 0].p) / int(z[i, 0].q) for i in range(n)])


def _column(values: Array) -> fmpq_mat:
    return fmpq_mat([[fmpq(*float(v).as_integer_ratio()) for v in row] for row in values])


def test_eq13_is_within_its_bound_at_every_rank() -> None:
    """Integer Jacobians of every exact rank, Wx also indefinite off range J, W also indefinite: within the bound."""
    rng = np.random.default_rng(73)
    form = CLOSED_FORMS["eq13"]
    ranks = set()
    for trial in range(250):
        n, m = rng.integers(1, 8, 2)
        r = rng.integers(0, min(m, n) + 1)
        A, B = rng.integers(-4, 5, (m, r)), rng.integers(-4, 5, (r, n))
        if min(np.linalg.matrix_rank(A) if r else 0, np.linalg.matrix_rank(B) if r else 0) < r:
            continue
        J = (A @ B).astype(float)
        G, H = rng.integers(-3, 4, (m, m)), rng.integers(-2, 3, (n, n))
        Wx = G @ G.T + np.eye(m)
        if trial % 3 == 0 and r < m:  # indefinite, but positive on range J
            off = np.linalg.svd(A)[0][:, r:] if r else np.eye(m)
            Wx = np.eye(m) - np.rint(32 * off @ off.T) / 8
            Wx = (Wx + Wx.T) / 2
        W = H @ H.T + np.eye(n) - (trial % 2) * J.T @ J
        a, xdot = rng.integers(-4, 5, n).astype(float), rng.integers(-4, 5, m).astype(float)
        if trial % 4 == 0:
            xdot = J @ rng.integers(-3, 4, n)
        problem = VelocityProblem(J=J, xdot=xdot, W=W, a=a, Wx=Wx).stacked()
        answer, bound = form.function(problem), form.bound(problem)[0]
        assert answer.status[0].answered, answer.said[0]
        x = _least_squares(J, B.astype(float), A.astype(float), W, Wx, a, xdot)
        if not x.any():  # relative to nothing: only 0 is right
            assert not answer.x[0].any()
            continue
        assert np.abs(answer.x[0] - x).max() <= bound * np.abs(x).max()
        gradient, size = W @ answer.x[0] + a, np.abs(W) @ np.abs(x) + np.abs(a)
        assert np.abs(gradient + J.T @ answer.y[0]).max() <= bound * size.max()
        image = Wx @ A
        inside = image @ np.linalg.lstsq(image, answer.y[0], rcond=None)[0] if r else np.zeros(m)
        assert np.abs(inside - answer.y[0]).max() <= bound * max(np.abs(answer.y[0]).max(), 1)
        ranks.add((int(min(m, n) - r), bool(n < m)))
    assert len(ranks) >= 8


def test_a_large_residual_is_in_the_bound_of_eq13() -> None:
    """Off range J the answer depends on range J itself, known to u cond(J): with a residual of 1e6 that outweighs the rest."""
    rng = np.random.default_rng(76)
    form = CLOSED_FORMS["eq13"]
    worst = 0.0
    for _ in range(60):
        A = rng.integers(-4, 5, (4, 2)).astype(float)
        A[:, 1] = A[:, 0] + 2.0**-16 * A[:, 1]
        B = rng.integers(-4, 5, (2, 5)).astype(float)
        if np.linalg.matrix_rank(A) < 2 or np.linalg.matrix_rank(B) < 2:
            continue
        off = np.linalg.svd(A)[0][:, 2:] @ rng.normal(size=2) * 1e6
        xdot, a = A @ rng.integers(-4, 5, 2) + np.rint(off), rng.integers(-4, 5, 5).astype(float)
        problem = VelocityProblem(J=A @ B, xdot=xdot, W=np.eye(5), a=a).stacked()
        answer, bound = form.function(problem), form.bound(problem)[0]
        if answer.status[0].answered:
            x = _least_squares(A @ B, B, A, np.eye(5), np.eye(4), a, xdot)
            error = np.abs(answer.x[0] - x).max() / np.abs(x).max()
            assert error <= bound
            worst = max(worst, error / (50 * 5 * np.finfo(float).eps / 2 * np.linalg.cond(A) * np.linalg.cond(B)))
    assert worst > 1  # without the residual's term the bound would be exceeded
