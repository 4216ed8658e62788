"""Problems of a known rank over the integers, and what the rationals say of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from problems.sets.rank_deficient import Case, member
from sandbox.claims.claim import Answer, CodePath
from sandbox.closed_form import CLOSED_FORMS
from sandbox.closed_form.eq13 import eq13
from sandbox.problem import VelocityProblem
from sandbox.reference import Truth, truth
from sandbox.reference.exact import Dyadic, kernel
from sandbox.solution import Status
from sandbox.task import task_weight

Array = np.ndarray

SANDBOX = CodePath("eq. (13) of the sandbox, $R_J$ from the singular value decomposition, rows of $J$ scaled", eq13)

KINDS = (
    ("achievable", "identity", "positive definite"),
    ("achievable", "indefinite off range J", "indefinite"),
    ("unachievable", "identity", "indefinite"),
    ("unachievable", "positive definite", "positive definite"),
    ("unachievable", "positive definite", "indefinite"),
    ("unachievable", "indefinite off range J", "indefinite"),
)
"""(xdot, Wx, W) of problems/sets/rank_deficient.py for which eq. (13) has its minimum."""


class Posed(NamedTuple):
    """One exactly rank-deficient problem, and what the rationals say of it.

    N (n, n - r) spans null J, R (n, r) completes it: unit vectors of the independent columns of J; both exact.
    """

    problem: VelocityProblem
    N: Array
    R: Array
    told: Truth

    @property
    def r(self) -> int:
        """Rank of J."""
        return int(self.R.shape[1])

    @property
    def x(self) -> Array:
        """The minimiser (n,), rounded once; NaN where there is none."""
        return np.full(self.problem.n, np.nan) if self.told.x is None else self.told.x

    @property
    def parts(self) -> tuple[Array, Array, Array, Array, float, Array]:
        """J, xdot, W, grad f, alpha = 1, Wx, as `equations.rank_deficient` takes them."""
        p = self.problem
        return p.J, p.xdot, p.W.dense(), p.a, 1.0, task_weight(p)

    @property
    def matrix(self) -> Array:
        """The matrix of eq. (13) with R and N, rows scaled to one."""
        return scaled_rows(self.problem, self.N, self.R)

    @property
    def size(self) -> float:
        """max(|x|, s), s the largest entry of |X11||a| + |X12||xdot|: what errors of the closed forms are relative to."""
        J, xdot, W, a, _, Wx = self.parts
        V = np.linalg.svd(J)[2]
        V, N = V[: self.r].T, V[self.r :].T
        move = N @ np.linalg.solve(N.T @ W @ N, N.T)
        to_range = V @ np.linalg.solve((J @ V).T @ Wx @ (J @ V), (J @ V).T @ Wx)
        s = np.abs(move) @ np.abs(a) + np.abs(to_range - move @ W @ to_range) @ np.abs(xdot)
        return float(max(np.abs(self.x).max(), s.max()))

    @property
    def bound(self) -> float:
        """Relative error bound of eq13."""
        return float(CLOSED_FORMS["eq13"].bound(self.problem.stacked())[0])


def scaled_rows(problem: VelocityProblem, N: Array, R: Array) -> Array:
    """[R'J'Wx J; N'W], rows scaled to one."""
    J, W, Wx = problem.J, problem.W.dense(), task_weight(problem)
    matrix = np.vstack([R.T @ J.T @ Wx @ J, N.T @ W])
    return matrix / np.linalg.norm(matrix, axis=1, keepdims=True)


def exact_bases(J: Array) -> tuple[Array, Array]:
    """(N, R) for one J (m, n), without rounding: N integer, R unit vectors of independent columns of J."""
    n = J.shape[1]
    found = kernel(Dyadic.of(np.column_stack([J, np.zeros(len(J))])).integers)
    N = np.array([[int(v) for v in row] for row in found.directions.tolist()], dtype=float).reshape(n + 1, -1)[:n]
    return N / np.maximum(np.gcd.reduce(N.astype(np.int64), axis=0), 1), np.eye(n)[:, found.pivots]


def posed(problem: VelocityProblem, exact: Answer = truth) -> Posed:
    """One problem with its exact bases and its truth."""
    return Posed(problem, *exact_bases(problem.J), exact(problem, "least_squares"))


def drawn(rng: np.random.Generator, m: int, n: int, r: int, xdot: str, Wx: str, W: str) -> VelocityProblem:
    """One problem of integer data with rank J = r exactly."""
    one = member(Case(m, n, r, xdot, Wx, W), rng)
    return VelocityProblem(J=one.J, xdot=one.xdot, W=one.W, a=one.a, Wx=one.Wx)


def flat(*, Wx: Array | None = None) -> VelocityProblem:
    """The stretched planar 3R (0, 0, 0) with W = diag(1, 1, -1/20), xdot = (1, 1)."""
    return VelocityProblem(J=[[0, 0, 0], [3, 2, 1]], xdot=[1, 1], W=np.diag([1, 1, -1 / 20]), Wx=Wx)


def answered(thirteen: Answer, problem: VelocityProblem) -> tuple[Array, Status]:
    """(x, status) of eq. (13) on one problem."""
    solution = thirteen(problem.stacked())
    return solution.x[0], solution.status[0]


def error(x: Array, one: Posed) -> float:
    """Error of x, max norm, relative to `size`; where that is 0, J, xdot and a being so, only 0 is right."""
    off = float(np.abs(x - one.x).max())
    size = one.size
    return off / size if size else np.inf if off else 0.0
