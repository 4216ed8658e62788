"""The paper's algorithms as plain scalar loops on preallocated arrays.

One source, three uses: compiled by numba over a stack (`compiled.py`), run as they stand on counting numbers
(Tables I and II) and on exact rationals. So no literal but 0 in a comparison, no call but each other and `abs`,
the square root written `** 0.5`, and a copy, a negation or a comparison costs nothing.

Eq. (6) works in pivoted coordinates: p[j] is the joint at position j. The caller fills rows m.. of N with the identity.
Where a branch depends on the data it refuses, or stands in one of the four functions that know what p is, start, pivot,
to_joints and to_positions: `lanes.py` has its own of these, and traces the rest as it stands.
"""

from __future__ import annotations

from typing import Any

import numpy as np

Array = np.ndarray

SOLVED, WEIGHT, RANK, CURVATURE = 0, 1, 2, 3
"""What a kernel returns: solved; W not positive definite; J not of full rank; N'WN not positive definite."""


def cholesky(A: Array) -> bool:
    """Overwrite the lower triangle of A by L, A = L L'; False at the first pivot that is not positive."""
    for j in range(A.shape[0]):
        for i in range(j, A.shape[0]):
            s = A[i, j]
            for k in range(j):
                s = s - A[i, k] * A[j, k]
            A[i, j] = s
        if not A[j, j] > 0:
            return False
        A[j, j] = A[j, j] ** 0.5
        for i in range(j + 1, A.shape[0]):
            A[i, j] = A[i, j] / A[j, j]
    return True


def forward(L: Array, b: Array) -> None:
    """Overwrite b by L^-1 b."""
    for i in range(b.shape[0]):
        s = b[i]
        for k in range(i):
            s = s - L[i, k] * b[k]
        b[i] = s / L[i, i]


def backward(L: Array, b: Array) -> None:
    """Overwrite b by L'^-1 b."""
    for i in range(b.shape[0] - 1, -1, -1):
        s = b[i]
        for k in range(i + 1, b.shape[0]):
            s = s - L[k, i] * b[k]
        b[i] = s / L[i, i]


def eq2_5(
    J: Array,
    xdot: Array,
    W: Array,
    gradf: Array,
    alpha: Any,
    weighted: bool,
    L: Array,
    Jh: Array,
    zh: Array,
    M: Array,
    x: Array,
    y: Array,
) -> int:
    """Eqs. (2)-(5) in the order of section IV; y solves (Jh Jh') y = xdot - Jh zh, so W x + a = J'y.

    L (n, n), Jh (m, n), zh (n,), M (m, m) are work space; without `weighted` W is the identity and not read.
    """
    m, n = J.shape
    for j in range(n):
        zh[j] = -(alpha * gradf[j])
        for i in range(m):
            Jh[i, j] = J[i, j]
    if weighted:
        for i in range(n):
            for j in range(i + 1):
                L[i, j] = W[i, j]
        if not cholesky(L):  # W = L L'
            return WEIGHT
        forward(L, zh)  # zh = L^-1 (-alpha grad f)
        for i in range(m):
            forward(L, Jh[i])  # Jh = (L^-1 J')'
    for i in range(m):
        for j in range(i + 1):
            s = Jh[i, 0] * Jh[j, 0]
            for k in range(1, n):
                s = s + Jh[i, k] * Jh[j, k]
            M[i, j] = s
    if not cholesky(M):
        return RANK
    for i in range(m):
        s = xdot[i]
        for j in range(n):
            s = s - Jh[i, j] * zh[j]
        y[i] = s
    forward(M, y)
    backward(M, y)
    for j in range(n):
        s = zh[j]
        for i in range(m):
            s = s + Jh[i, j] * y[i]
        x[j] = s
    if weighted:
        backward(L, x)  # qdot = L'^-1 (Jh'y + zh)
    return SOLVED


def eliminate(A: Array, i: int) -> None:
    """Reduce row i by the rows above it: multipliers left of the diagonal, row i of U from there on."""
    for k in range(i):
        A[i, k] = A[i, k] / A[k, k]
        for j in range(k + 1, A.shape[1]):
            A[i, j] = A[i, j] - A[i, k] * A[k, j]


def start(p: Array) -> None:
    """Every joint at its own position."""
    for j in range(p.shape[0]):
        p[j] = j


def pivot(A: Array, p: Array, i: int, m: int) -> bool:
    """Exchange two columns of A[:m] for the largest entry of row i, from the diagonal on; False where that is zero."""
    best = i
    for j in range(i + 1, A.shape[1]):
        if abs(A[i, j]) > abs(A[i, best]):
            best = j
    if not abs(A[i, best]) > 0:
        return False
    if best != i:
        for k in range(m):
            held = A[k, i]
            A[k, i] = A[k, best]
            A[k, best] = held
        kept = p[i]
        p[i] = p[best]
        p[best] = kept
    return True


def to_joints(v: Array, p: Array, out: Array) -> None:
    """A vector by position, in the order of the joints."""
    for j in range(v.shape[0]):
        out[p[j]] = v[j]


def to_positions(v: Array, p: Array, out: Array) -> None:
    """A vector by joint, in the order of the positions; as many as `out` has."""
    for j in range(out.shape[0]):
        out[j] = v[p[j]]


def factor_rows(J: Array, A: Array, p: Array) -> bool:
    """LU with column pivoting of rectangular J: A[:m] holds L (unit) and U; False where a row vanishes."""
    m, n = J.shape
    for i in range(m):
        for j in range(n):
            A[i, j] = J[i, j]
    start(p)
    for i in range(m):
        eliminate(A, i)
        if not pivot(A, p, i, m):
            return False
    return True


def null_vectors(A: Array, m: int, N: Array) -> None:
    """Complete each column of N = [.; I] to a null vector of U by back-substitution."""
    n = A.shape[1]
    for c in range(n - m):
        for i in range(m - 1, -1, -1):
            s = A[i, i + 1] * N[i + 1, c]
            for j in range(i + 2, n):
                s = s + A[i, j] * N[j, c]
            N[i, c] = -s / A[i, i]


def substitute(A: Array, p: Array, b: Array, x: Array) -> None:
    """Forward and back-substitution with the square LU in A; overwrites b, x is in the order of the joints."""
    n = A.shape[0]
    for i in range(n):
        for k in range(i):
            b[i] = b[i] - A[i, k] * b[k]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            b[i] = b[i] - A[i, k] * b[k]
        b[i] = b[i] / A[i, i]
    to_joints(b, p, x)


def weigh(W: Array, E: Array, gamma: Array, weighted: bool, v: Array, t: Array, row: Array) -> None:
    """Set row = W v through the factors: base v + E'(Gamma (E v)); all in the order of the joints, t (2, k) is work space."""
    n = v.shape[0]
    for j in range(n):
        if weighted:
            s = v[0] * W[0, j]
            for i in range(1, n):
                s = s + v[i] * W[i, j]
            row[j] = s
        else:
            row[j] = v[j]
    for r in range(E.shape[0]):
        s = v[0] * E[r, 0]
        for i in range(1, n):
            s = s + v[i] * E[r, i]
        t[0, r] = s
    for r in range(E.shape[0]):
        s = t[0, 0] * gamma[0, r]
        for q in range(1, E.shape[0]):
            s = s + t[0, q] * gamma[q, r]
        t[1, r] = s
    for j in range(n):
        for r in range(E.shape[0]):
            row[j] = row[j] + t[1, r] * E[r, j]


def eq6(
    J: Array,
    xdot: Array,
    W: Array,
    E: Array,
    gamma: Array,
    gradf: Array,
    alpha: Any,
    weighted: bool,
    A: Array,
    N: Array,
    p: Array,
    b: Array,
    t: Array,
    v: Array,
    x: Array,
) -> int:
    """Eq. (6) as section IV computes it: LU of J with column pivoting, extended by the rows N'W.

    Without further pivoting the trailing pivots are those of N'WN, so all of them positive is condition (7)
    (methods 1.9). A (n, n), N (n, n-m) with the identity below, p (n,) ints, b (n,), t (2, k), v (n,) are work
    space; E (k, n) with k = 0 where W is not factored; without `weighted` the base of W is the identity and not read.
    """
    m, n = J.shape
    if not factor_rows(J, A, p):
        return RANK
    null_vectors(A, m, N)
    for i in range(m):
        b[i] = xdot[i]
    for c in range(n - m):
        to_joints(N[:, c], p, v)
        weigh(W, E, gamma, weighted, v, t, x)
        to_positions(x, p, A[m + c])
        eliminate(A, m + c)
        if not A[m + c, m + c] > 0:
            return CURVATURE
    to_positions(gradf, p, v)
    for c in range(n - m):
        s = v[m + c]
        for i in range(m):
            s = s + N[i, c] * v[i]
        b[m + c] = -(alpha * s)
    substitute(A, p, b, x)
    return SOLVED


def eq6_implicit(rows: Array, b: Array, A: Array, p: Array, x: Array) -> int:
    """Eq. (6) from its rows [J; N'W] and right side b = [xdot; -N'a], W and a unseen; b is overwritten.

    N is anything that spans null J, so the rows N'W are pivoted too and their pivots decide nothing.
    """
    if not factor_rows(rows, A, p):
        return CURVATURE
    substitute(A, p, b, x)
    return SOLVED


def multipliers(
    W: Array, E: Array, gamma: Array, gradf: Array, alpha: Any, weighted: bool, A: Array, p: Array, t: Array, v: Array,
    x: Array, y: Array,
) -> None:  # fmt: skip
    """Solve W x + a + J'y = 0 for y on the pivot columns of J, from the LU of J that eq. (6) left in A; t, v as there."""
    weigh(W, E, gamma, weighted, x, t, v)
    for j in range(x.shape[0]):
        v[j] = -(v[j] + alpha * gradf[j])
    to_positions(v, p, y)
    transposed_substitute(A, y)


def transposed_substitute(A: Array, y: Array) -> None:
    """Overwrite y (m,) by the solution of B'z = y, B = L U the pivot columns of J."""
    m = y.shape[0]
    for i in range(m):
        for k in range(i):
            y[i] = y[i] - A[k, i] * y[k]
        y[i] = y[i] / A[i, i]
    for i in range(m - 1, -1, -1):
        for k in range(i + 1, m):
            y[i] = y[i] - A[k, i] * y[k]


def pivot_roundings(
    W: Array, E: Array, gamma: Array, weighted: bool, A: Array, N: Array, p: Array, m: int,
    G: Array, X: Array, w: Array, v: Array, d: Array, g: Array, size: Array, t: Array, bound: Array,
) -> None:  # fmt: skip
    """Rounding error of every pivot that eq. (6) computed, in units of n u, to first order (ours, not the paper's).

    Pivot i of J is the largest entry of w'J, w' = row i of L^-1: it is off by |w|'|L||U|. Trailing pivot c is the
    curvature d'Wd along d = N w, w' = row c of the inverse of the trailing L: it is off by |d|'|base||d| +
    2 |d|'|E'||Gamma| sum_k |E N_k w_k| + 2 |Wd|'|dN w|, where |dN| <= |B^-1||L||U||N|, B = L U the pivot columns of J.
    Work: G (m, n), X (m, m), w, v, d, g, size (n,), t (2, k).
    """
    n = A.shape[0]
    for i in range(m):
        for j in range(n):
            s = abs(A[i, j]) if j >= i else abs(A[i, j] * A[j, j])
            for k in range(min(i, j)):
                s = s + abs(A[i, k] * A[k, j])
            G[i, j] = s  # |L||U|
    for i in range(m):
        w[i] = 1
        for j in range(i - 1, -1, -1):
            s = w[i] * A[i, j]
            for k in range(j + 1, i):
                s = s + w[k] * A[k, j]
            w[j] = -s
        bound[i] = 0
        for j in range(i, n):
            s = G[i, j]
            for k in range(i):
                s = s + abs(w[k]) * G[k, j]
            bound[i] = max(bound[i], s)
    for c in range(m):  # columns of B^-1
        for i in range(m):
            s = 1.0 if i == c else 0.0
            for k in range(i):
                s = s - A[i, k] * X[k, c]
            X[i, c] = s
        for i in range(m - 1, -1, -1):
            s = X[i, c]
            for k in range(i + 1, m):
                s = s - A[i, k] * X[k, c]
            X[i, c] = s / A[i, i]
    for c in range(n - m):
        w[c] = 1
        for j in range(c - 1, -1, -1):
            s = w[c] * A[m + c, m + j]
            for k in range(j + 1, c):
                s = s + w[k] * A[m + k, m + j]
            w[j] = -s
        for i in range(n):
            g[i] = 0
            size[i] = 0
        for q in range(E.shape[0]):
            t[0, q] = 0
            t[1, q] = 0
        for k in range(c + 1):
            for i in range(n):
                v[i] = N[i, k] * w[k]
                g[i] = g[i] + v[i]
                size[i] = size[i] + abs(v[i])
            to_joints(v, p, d)
            for q in range(E.shape[0]):
                s = 0.0
                for j in range(n):
                    s = s + E[q, j] * d[j]
                t[0, q] = t[0, q] + s
                t[1, q] = t[1, q] + abs(s)
        to_joints(g, p, d)  # d = N w, and |N||w|
        to_joints(size, p, v)
        total = 0.0
        for i in range(n):
            g[i] = d[i]
            size[i] = v[i]
            if weighted:
                g[i] = 0
                size[i] = 0
                for j in range(n):
                    g[i] = g[i] + W[i, j] * d[j]
                    size[i] = size[i] + abs(W[i, j]) * v[j]
            for r in range(E.shape[0]):
                for q in range(E.shape[0]):
                    g[i] = g[i] + E[r, i] * gamma[r, q] * t[0, q]
                    size[i] = size[i] + 2 * abs(E[r, i] * gamma[r, q]) * t[1, q]
            total = total + v[i] * size[i]
        to_positions(g, p, d)
        to_positions(v, p, size)
        for i in range(m):
            off = 0.0
            for k in range(m):
                s = G[k, 0] * size[0]
                for j in range(1, n):
                    s = s + G[k, j] * size[j]
                off = off + abs(X[i, k]) * s
            total = total + 2 * abs(d[i]) * off
        bound[m + c] = total


def eq2_5_stack(
    J: Array, xdot: Array, W: Array, a: Array, alpha: Any, weighted: bool, x: Array, y: Array, L: Array, M: Array, code: Array
) -> None:
    """Eqs. (2)-(5) on every member; L (B, n, n) and M (B, m, m) keep the Cholesky factors, y is our multiplier."""
    m, n = J.shape[1:]
    Jh = np.empty((m, n), J.dtype)
    zh = np.empty(n, J.dtype)
    for i in range(J.shape[0]):
        code[i] = eq2_5(J[i], xdot[i], W[i], a[i], alpha, weighted, L[i], Jh, zh, M[i], x[i], y[i])
        for k in range(m):
            y[i, k] = -y[i, k]


def eq6_stack(
    J: Array,
    xdot: Array,
    W: Array,
    E: Array,
    gamma: Array,
    a: Array,
    alpha: Any,
    weighted: bool,
    x: Array,
    y: Array,
    pivot: Array,
    bound: Array,
    code: Array,
) -> None:
    """Eq. (6) on every member, with multipliers, pivots (B, n) and the rounding of each in units of n u."""
    m, n = J.shape[1:]
    k = E.shape[1]
    A = np.empty((n, n), J.dtype)
    N = np.zeros((n, n - m), J.dtype)
    for c in range(n - m):
        N[m + c, c] = 1
    p = np.empty(n, np.int64)
    b, w, v, d = np.empty(n, J.dtype), np.empty(n, J.dtype), np.empty(n, J.dtype), np.empty(n, J.dtype)
    g, size = np.empty(n, J.dtype), np.empty(n, J.dtype)
    t = np.empty((2, k), J.dtype)
    G = np.empty((m, n), J.dtype)
    X = np.zeros((m, m), J.dtype)
    for i in range(J.shape[0]):
        code[i] = eq6(J[i], xdot[i], W[i], E[i], gamma[i], a[i], alpha, weighted, A, N, p, b, t, v, x[i])
        if code[i] == SOLVED:
            multipliers(W[i], E[i], gamma[i], a[i], alpha, weighted, A, p, t, v, x[i], y[i])
            pivot_roundings(W[i], E[i], gamma[i], weighted, A, N, p, m, G, X, w, v, d, g, size, t, bound[i])
            for j in range(n):
                pivot[i, j] = A[j, j]


def eq6_implicit_stack(rows: Array, b: Array, x: Array, code: Array) -> None:
    """Eq. (6) from rows (B, n, n) and right sides b (B, n), which it overwrites."""
    A = np.empty(rows.shape[1:], rows.dtype)
    p = np.empty(rows.shape[2], np.int64)
    for i in range(rows.shape[0]):
        code[i] = eq6_implicit(rows[i], b[i], A, p, x[i])


def null_basis_stack(J: Array, N: Array, code: Array) -> None:
    """Null vectors N (B, n, n - m) of every J (B, m, n), the identity on the joints that no row pivots on."""
    m, n = J.shape[1:]
    A = np.empty((m, n), J.dtype)
    p = np.empty(n, np.int64)
    Z = np.zeros((n, n - m), J.dtype)
    for c in range(n - m):
        Z[m + c, c] = 1
    for i in range(J.shape[0]):
        code[i] = RANK
        if factor_rows(J[i], A, p):
            code[i] = SOLVED
            null_vectors(A, m, Z)
            for j in range(n):
                for c in range(n - m):
                    N[i, p[j], c] = Z[j, c]


def cholesky_stack(A: Array, code: Array) -> None:
    """Cholesky factor of every member, in place below the diagonal."""
    for i in range(A.shape[0]):
        code[i] = SOLVED if cholesky(A[i]) else WEIGHT
