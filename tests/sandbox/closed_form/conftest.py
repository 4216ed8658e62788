"""Problems made to measure, and their exact answers in rational arithmetic that shares no code with the closed forms."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from flint import fmpq, fmpq_mat

from sandbox.problem import VelocityProblem

Array = np.ndarray

SIZES = ((2, 1), (3, 2), (4, 2), (5, 3), (6, 4), (7, 6), (7, 3), (9, 6))


def _manufactured(
    rng: np.random.Generator, n: int, m: int, count: int, *,
    cond_J: float = 0.0, tangent: float = 0.0, cross: float = 0.0, cond_S: float = 0.0, rows: float = 0.0,
    gradient: float = 0.0, positive: bool = False,
) -> VelocityProblem:  # fmt: skip
    """Methods 1.7: J, N, S_N, S_T and C chosen; each knob is a power of ten. `positive` completes S_T to W > 0."""
    problems = []
    k = n - m
    for _ in range(count):
        U, V = _orthogonal(rng, m), _orthogonal(rng, n)
        Y, N = V[:, :m], V[:, m:]
        J = U @ np.diag(10.0 ** -(cond_J * np.linspace(0, 1, m))) @ Y.T
        J = 10.0 ** rng.uniform(-rows, rows, (m, 1)) * J
        Q = _orthogonal(rng, k)
        S_N = Q @ np.diag(rng.uniform(0.5, 2, k) * 10.0 ** -(cond_S * rng.uniform(size=k))) @ Q.T
        C = rng.normal(size=(m, k)) * 10.0**cross
        A = rng.normal(size=(m, m))
        S_T = A @ A.T + np.eye(m) / 8 + C @ np.linalg.solve(S_N, C.T) if positive else (A + A.T) * 10.0**tangent
        W = Y @ S_T @ Y.T + Y @ C @ N.T + N @ C.T @ Y.T + N @ S_N @ N.T
        xdot = J @ rng.normal(size=n) if rng.uniform() < 0.5 else rng.normal(size=m)
        problems.append((J, xdot, (W + W.T) / 2, rng.normal(size=n) * 10.0**gradient))
    J, xdot, W, a = (np.array(parts) for parts in zip(*problems, strict=True))
    return VelocityProblem(J=J, xdot=xdot, W=W, a=a)


def _orthogonal(rng: np.random.Generator, n: int) -> Array:
    return np.linalg.qr(rng.normal(size=(n, n)))[0]


def _rational(values: Array) -> fmpq_mat:
    return fmpq_mat([[fmpq(*float(v).as_integer_ratio()) for v in row] for row in np.atleast_2d(values)])


def _floats(column: fmpq_mat) -> Array:
    return np.array([int(column[i, 0].p) / int(column[i, 0].q) for i in range(column.nrows())])


def _exact(problem: VelocityProblem) -> tuple[Array, Array]:
    """(x, y) of every member from the rational KKT system, rounded once; factored weights are multiplied out exactly."""
    xs, ys = [], []
    for p in problem:
        J, W = _rational(p.J), _rational(p.W.base)
        if p.W.factored:
            E = _rational(p.W.E)
            W = W + E.transpose() * _rational(p.W.gamma) * E
        n, m = p.n, p.m
        K = [[W[i, j] for j in range(n)] + [J[k, i] for k in range(m)] for i in range(n)]
        K += [[J[k, j] for j in range(n)] + [fmpq(0)] * m for k in range(m)]
        z = _floats(fmpq_mat(K).solve(_rational(np.concatenate([-p.a, p.xdot])).transpose()))
        xs.append(z[:n])
        ys.append(z[n:])
    return np.array(xs), np.array(ys)


def _reach(problem: VelocityProblem, x: Array) -> Array:
    """max(|x|_inf, s), s = max(|X11||a| + |X12||xdot|): what errors are relative to (B,)."""
    n, m = problem.n, problem.m
    sizes = []
    for p, found in zip(problem, x, strict=True):
        scale = np.abs(p.J).max(axis=1, keepdims=True)
        W = np.asarray(p.W)
        t = np.linalg.svd(p.J / scale)[1][-1] / max(np.abs(W).max(), np.finfo(float).tiny)
        K = np.block([[t * W, (p.J / scale).T], [p.J / scale, np.zeros((m, m))]])
        X = np.abs(np.linalg.inv(K))[:n]
        s = X[:, :n] @ np.abs(t * p.a) + X[:, n:] @ np.abs(p.xdot / scale[:, 0])
        sizes.append(max(np.abs(found).max(), s.max()))
    return np.array(sizes)


@pytest.fixture(scope="session")
def manufactured() -> Callable[..., VelocityProblem]:
    """`_manufactured`."""
    return _manufactured


@pytest.fixture(scope="session")
def exact() -> Callable[[VelocityProblem], tuple[Array, Array]]:
    """`_exact`."""
    return _exact


@pytest.fixture(scope="session")
def reach() -> Callable[[VelocityProblem, Array], Array]:
    """`_reach`."""
    return _reach


@pytest.fixture(params=SIZES, ids=lambda size: f"{size[0]}x{size[1]}")
def size(request: pytest.FixtureRequest) -> tuple[int, int]:
    """(n, m) of a stack."""
    return request.param
