"""An independent oracle: answers derived from the mathematics alone, sharing no code with the package.

Exact side: fractions.Fraction, Gauss-Jordan on the full KKT system, inertia from the characteristic polynomial.
Float side: SVD weighted pseudoinverses and the KKT system by numpy, for problems too large for fractions.
"""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from typing import NamedTuple

import numpy as np

Matrix = list[list[Fraction]]
Vector = list[Fraction]


def rational(values) -> Matrix:
    """A matrix (or vector, as one column) of floats, integers or fractions as fractions."""
    rows = values.tolist() if isinstance(values, np.ndarray) else list(values)
    return [[Fraction(v) for v in row] if isinstance(row, list | tuple) else [Fraction(row)] for row in rows]


def vector(values) -> Vector:
    """A vector of fractions."""
    return [row[0] for row in rational(values)]


def transpose(A: Matrix) -> Matrix:
    """A'."""
    return [list(column) for column in zip(*A, strict=True)]


def times(A: Matrix, B: Matrix) -> Matrix:
    """A B."""
    columns = transpose(B)
    return [[sum((u * v for u, v in zip(row, column, strict=True)), Fraction(0)) for column in columns] for row in A]


def apply(A: Matrix, x: Vector) -> Vector:
    """A x."""
    return [inner(row, x) for row in A]


def inner(u: Vector, v: Vector) -> Fraction:
    """U'v."""
    return sum((s * t for s, t in zip(u, v, strict=True)), Fraction(0))


def plus(A: Matrix, B: Matrix, factor: Fraction | int = 1) -> Matrix:
    """A + factor B."""
    return [[u + factor * v for u, v in zip(r, s, strict=True)] for r, s in zip(A, B, strict=True)]


class System(NamedTuple):
    """A x = b by Gauss-Jordan: its rank, one solution (None if there is none) and a basis of null(A), as columns."""

    rank: int
    solution: Vector | None
    null: list[Vector]


def solve(A: Matrix, b: Vector, n: int | None = None) -> System:
    """Solve any system; `n` is the number of unknowns (needed where A has no rows)."""
    n = len(A[0]) if A else int(n or 0)
    rows = [[*row, v] for row, v in zip(A, b, strict=True)]
    pivots: list[int] = []
    for j in range(n):
        i = next((i for i in range(len(pivots), len(rows)) if rows[i][j] != 0), None)
        if i is None:
            continue
        top = len(pivots)
        rows[top], rows[i] = rows[i], rows[top]
        rows[top] = [v / rows[top][j] for v in rows[top]]
        for other in range(len(rows)):
            if other != top and rows[other][j] != 0:
                c = rows[other][j]
                rows[other] = [v - c * w for v, w in zip(rows[other], rows[top], strict=True)]
        pivots.append(j)
    x: Vector | None = [Fraction(0)] * n
    if any(row[n] != 0 for row in rows[len(pivots) :]):
        x = None
    else:
        for i, j in enumerate(pivots):
            x[j] = rows[i][n]
    null = []
    for free in sorted(set(range(n)) - set(pivots)):
        z = [Fraction(0)] * n
        z[free] = Fraction(1)
        for i, j in enumerate(pivots):
            z[j] = -rows[i][free]
        null.append(z)
    return System(len(pivots), x, null)


def inertia(S: Matrix) -> tuple[int, int, int]:
    """(positive, negative, zero) eigenvalues: signs of the characteristic polynomial (Faddeev-LeVerrier).

    All roots are real, so Descartes' rule of signs counts the positive ones exactly.
    """
    k = len(S)
    identity = [[Fraction(int(i == j)) for j in range(k)] for i in range(k)]
    coefficients, M = [Fraction(1)], [[Fraction(0)] * k for _ in range(k)]
    for step in range(1, k + 1):
        M = plus(times(S, M), identity, coefficients[-1])
        coefficients.append(-sum((inner(S[i], [row[i] for row in M]) for i in range(k)), Fraction(0)) / step)
    signs = [c > 0 for c in coefficients if c != 0]
    positive = sum(s != t for s, t in pairwise(signs))
    zero = next(i for i, c in enumerate(reversed(coefficients)) if c != 0)
    return positive, k - positive - zero, zero


class Answer(NamedTuple):
    """Class, reason, rank of the rows, inertia of N'WN, a minimiser, its J'y and y, basis of the freedom, value."""

    expected: str
    reason: str
    rank: int
    inertia: tuple[int, int, int]
    x: Vector | None = None
    Jty: Vector | None = None
    y: Vector | None = None
    freedom: list[Vector] | None = None
    value: Fraction | None = None


def qp(H: Matrix, g: Vector, A: Matrix, b: Vector) -> Answer:
    """Minimise 1/2 x'Hx + g'x subject to Ax = b, A of any rank, from K = [H A'; A 0] alone.

    In(K) = In(N'HN) + (r, r, p - r) (methods 1.4 with p - r dependent rows); with feasible rows, K z = (-g, b) has a
    solution unless the objective falls along null(N'HN).
    """
    n, p = len(g), len(b)
    rank, feasible, null = solve(A, b, n)
    K = [[*H[i], *(A[j][i] for j in range(p))] for i in range(n)] + [[*A[j], *[Fraction(0)] * p] for j in range(p)]
    positive, negative, zero = inertia(K)
    signs = positive - rank, negative - rank, zero - (p - rank)
    if feasible is None:
        return Answer("infeasible", "inconsistent", rank, signs)
    if signs[1] and null:
        reason = "indefinite_singular" if signs[2] else "saddle" if signs[0] else "maximum"
        return Answer("no_minimum", reason, rank, signs)
    _, z, kernel = solve(K, [-v for v in g] + b)
    if z is None:
        return Answer("no_minimum", "descending", rank, signs)
    x, y = z[:n], z[n:]
    freedom = independent([v[:n] for v in kernel])
    value = inner(x, apply(H, x)) / 2 + inner(g, x)
    Jty = apply(transpose(A), y) if p else [Fraction(0)] * n
    told = ("unique_minimum", "condition_7") if null else ("unique_minimum", "no_freedom")
    if freedom:
        told = "minimum_not_unique", "singular"
    return Answer(*told, rank, signs, x, Jty, y, freedom, value)


def independent(vectors: list[Vector]) -> list[Vector]:
    """Those that are not combinations of the ones before."""
    kept: list[Vector] = []
    for v in vectors:
        if any(v) and (not kept or solve(transpose(kept), v).solution is None):
            kept.append(v)
    return kept


def exact(J, xdot, W, a) -> Answer:
    """Minimise 1/2 qdot'W qdot + a'qdot subject to J qdot = xdot."""
    return qp(rational(W), vector(a), rational(J), vector(xdot))


def least_squares(J, xdot, W, a, Wx=None) -> Answer:
    """Eq. (13) from its definition: the rows are all n normal equations J'Wx J qdot = J'Wx xdot.

    The target has no minimum where J'WxJ has a negative eigenvalue, or the normal equations no solution.
    """
    J, xd = rational(J), vector(xdot)
    Wx = identity(len(xd)) if Wx is None else rational(Wx)
    JtWx = times(transpose(J), Wx)
    rows = times(JtWx, J)
    found = qp(rational(W), vector(a), rows, apply(JtWx, xd))
    if inertia(rows)[1] or found.expected == "infeasible":
        return Answer("no_minimum", "target_unbounded", found.rank, found.inertia)
    if found.y is None:
        return found
    return found._replace(y=apply(times(Wx, J), found.y))  # (J'WxJ) mu = J' (Wx J mu)


def damped(J, xdot, W, a, damping, Wx=None) -> Answer:
    """Methods C1 as it stands: [J I], blkdiag(lambda^2 W, Wx), (lambda^2 a, 0) on n + m joints; all of its x."""
    J, xd, W, a = rational(J), vector(xdot), rational(W), vector(a)
    m, n, squared = len(J), len(a), Fraction(damping) ** 2
    Wx = identity(m) if Wx is None else rational(Wx)
    H = [[*(squared * v for v in row), *[Fraction(0)] * m] for row in W] + [[*[Fraction(0)] * n, *row] for row in Wx]
    A = [[*row, *unit] for row, unit in zip(J, identity(m), strict=True)]
    return qp(H, [*(squared * v for v in a), *[Fraction(0)] * m], A, xd)


def factored(base, E, gamma) -> Matrix:
    """W = base + E' gamma E."""
    E, gamma = rational(E), rational(gamma)
    return plus(rational(base), times(transpose(E), times(gamma, E)))


def identity(n: int) -> Matrix:
    """I."""
    return [[Fraction(int(i == j)) for j in range(n)] for i in range(n)]


def weighted_pseudoinverse(J: np.ndarray, W: np.ndarray) -> np.ndarray:
    """G = W^-1 J'(J W^-1 J')^-1 = L^-T (J L^-T)^+ with W = LL', by SVD (methods M2, P6); W > 0."""
    L = np.linalg.cholesky(W)
    return np.linalg.solve(L.T, np.linalg.pinv(np.linalg.solve(L, J.T).T))


def null_space(J: np.ndarray, rank: int) -> np.ndarray:
    """Orthonormal basis of null(J), by SVD."""
    return np.linalg.svd(J)[2][rank:].T


def paper_eq6(J: np.ndarray, xdot: np.ndarray, W: np.ndarray, a: np.ndarray) -> np.ndarray:
    """[J; N'W] qdot = [xdot; -N'a], N orthonormal (methods P3); J of full row rank."""
    N = null_space(J, len(J))
    return np.linalg.solve(np.vstack([J, N.T @ W]), np.concatenate([xdot, -N.T @ a]))


def paper_eq13(J: np.ndarray, xdot: np.ndarray, W: np.ndarray, a: np.ndarray, Wx: np.ndarray, rank: int) -> np.ndarray:
    """[U_r'Wx J; N'W] qdot = [U_r'Wx xdot; -N'a] (methods 6.4)."""
    U, _, Vt = np.linalg.svd(J)
    R, N = U[:, :rank].T @ Wx, Vt[rank:].T
    return np.linalg.solve(np.vstack([R @ J, N.T @ W]), np.concatenate([R @ xdot, -N.T @ a]))


def kkt(J: np.ndarray, xdot: np.ndarray, W: np.ndarray, a: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(qdot, y) from [W J'; J 0] (methods P5); J of full row rank."""
    m, n = J.shape
    z = np.linalg.solve(np.block([[W, J.T], [J, np.zeros((m, m))]]), np.concatenate([-a, xdot]))
    return z[:n], z[n:]


def damped_pseudoinverse(J: np.ndarray, xdot: np.ndarray, damping: float) -> np.ndarray:
    """Sum s_i/(s_i^2 + lambda^2) v_i u_i'xdot (methods C1, W = I, Wx = I, a = 0)."""
    U, s, Vt = np.linalg.svd(J, full_matrices=False)
    return Vt.T @ (s / (s**2 + damping**2) * (U.T @ xdot))
