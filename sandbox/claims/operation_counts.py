"""Operations counted without running eqs. (2)-(5) or (6): the paper's tables, and the text of Section IV taken by hand.

Everything is exact integers for n joints and m task rows, n > m; k = n - m. Multiplications are counted with divisions,
additions with subtractions; square roots, comparisons and negations are not counted.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

Array = np.ndarray

Row = tuple[str, bool]
"""A row of Tables I and II: the method, and whether W is general."""

ROWS: tuple[Row, ...] = (("eq2_5", False), ("eq2_5", True), ("eq6", False), ("eq6", True))

TABLE_I: dict[Row, tuple[tuple[tuple[int, int, int], ...], ...]] = {
    ("eq2_5", False): (
        ((2, 1, 0), (9, 2, 0), (1, 3, 0), (6, 0, 1), (15, 1, 1), (3, 2, 1)),
        ((-10, 1, 0), (3, 2, 0), (1, 3, 0), (15, 1, 1), (3, 2, 1)),
    ),
    ("eq2_5", True): (
        ((2, 1, 0), (9, 2, 0), (1, 3, 0), (8, 0, 1), (18, 1, 1), (3, 2, 1), (9, 0, 2), (3, 1, 2), (1, 0, 3)),
        ((3, 2, 0), (-10, 1, 0), (1, 3, 0), (-7, 0, 1), (12, 1, 1), (3, 2, 1), (6, 0, 2), (3, 1, 2), (1, 0, 3)),
    ),
    ("eq6", False): (
        ((-6, 1, 0), (-9, 2, 0), (3, 3, 0), (4, 0, 1), (9, 1, 1), (-9, 2, 1), (6, 0, 2), (6, 1, 2), (2, 0, 3)),
        ((3, 2, 0), (3, 3, 0), (-5, 0, 1), (-3, 1, 1), (-9, 2, 1), (3, 0, 2), (6, 1, 2), (2, 0, 3)),
    ),
    ("eq6", True): (
        ((-6, 1, 0), (-9, 2, 0), (3, 3, 0), (4, 0, 1), (9, 1, 1), (-9, 2, 1), (6, 0, 2), (8, 0, 3)),
        ((3, 2, 0), (3, 3, 0), (-5, 0, 1), (3, 1, 1), (-9, 2, 1), (-3, 0, 2), (8, 0, 3)),
    ),
}
"""Table I as printed: multiplies/divides and adds/subtracts, six times each, as (coefficient, power of m, power of n)."""

TABLE_II: dict[Row, tuple[int, int]] = {
    ("eq2_5", False): (330, 275), ("eq2_5", True): (631, 499), ("eq6", False): (195, 154), ("eq6", True): (244, 196),
}  # fmt: skip
"""Table II as printed: multiplies/divides and adds/subtracts at n = 7, m = 6."""


@dataclass(frozen=True)
class Count:
    """Multiplications with divisions, additions with subtractions."""

    multiplications: int = 0
    additions: int = 0

    @property
    def total(self) -> int:
        """Floating-point operations in all."""
        return self.multiplications + self.additions

    @property
    def both(self) -> tuple[int, int]:
        """(multiplications, additions)."""
        return self.multiplications, self.additions

    def __add__(self, other: Count) -> Count:
        return Count(self.multiplications + other.multiplications, self.additions + other.additions)

    def __mul__(self, times: int) -> Count:
        return Count(self.multiplications * times, self.additions * times)


def sixfold(row: Row, n: int, m: int) -> tuple[int, int]:
    """The two numerators of a row of Table I, before they are divided by six."""
    first, second = (sum(factor * m**i * n**j for factor, i, j in polynomial) for polynomial in TABLE_I[row])
    return first, second


def table_1(method: str, n: int, m: int, *, weighted: bool) -> Count:
    """A row of Table I at (n, m). Raises ValueError where the printed polynomial is no integer."""
    parts = [divmod(value, 6) for value in sixfold((method, weighted), n, m)]
    if any(rest for _, rest in parts):
        raise ValueError(f"Table I is no integer at n = {n}, m = {m}")
    return Count(*(value for value, _ in parts))


def limiting_share(cheaper: Row, dearer: Row) -> float:
    """The share m / n above which, for large n, `cheaper` takes fewer operations than `dearer` (cubic terms of Table I)."""
    cubic = np.zeros(4)
    for sign, row in ((1, cheaper), (-1, dearer)):
        for polynomial in TABLE_I[row]:
            for factor, i, j in polynomial:
                cubic[3 - i] += sign * factor if i + j == 3 else 0
    roots = np.roots(cubic)
    return float(next(root.real for root in roots if abs(root.imag) < 1e-9 and 0 < root.real < 1))


# ---- section IV by hand: what each sentence of its two lists costs


def _dot(length: int) -> Count:
    """A sum of `length` products."""
    return Count(length, length - 1)


def _less(length: int) -> Count:
    """A sum of `length` products added to what is there."""
    return Count(length, length)


def _over(cases: Any, of: Callable[[int], Count]) -> Count:
    return sum((of(case) for case in cases), Count())


def _triangular(size: int, *, unit: bool = False) -> Count:
    """A triangular system of `size` rows: row i takes i products off its right side and divides."""
    return _over(range(size), _less) + Count(0 if unit else size)


def _cholesky(size: int) -> Count:
    """Entry (i, j), j <= i, of L: j products taken off, a division below the diagonal, a square root on it."""
    return _over(range(size), lambda j: _less(j) * (size - j)) + Count(size * (size - 1) // 2)


def _eliminated(row: int, n: int) -> Count:
    """Row `row` (from 0) of an LU with n columns: for each row above a division, and a product off every entry behind."""
    return _over(range(row), lambda above: Count(1) + _less(n - 1 - above))


def _null_vector(n: int, m: int, identity: bool) -> Count:
    """One column of N_J by back-substitution: dense over the entries below, or over the pivot columns and one more."""
    return _over(range(m), lambda i: (_less(m - 1 - i) if identity else _dot(n - 1 - i)) + Count(1))


def steps(method: str, n: int, m: int, *, weighted: bool, identity: bool = False) -> dict[str, Count]:
    """What each step of section IV's description takes, in its order; names are text with TeX.

    `identity`: the products with the zeros and ones of N_J are left out in every step, not only in N'grad f.
    Raises KeyError for another method.
    """
    k = n - m
    if method == "eq2_5":
        return {
            r"$-\alpha \nabla f$": Count(n),
            "$W = L L^T$": _cholesky(n) if weighted else Count(),
            r"$\hat J$ and $\hat z$ by $L^{-1}$": _triangular(n) * (m + 1) if weighted else Count(),
            r"$\hat J \hat J^T$, one triangle": _dot(n) * (m * (m + 1) // 2),
            r"Cholesky of $\hat J \hat J^T$": _cholesky(m),
            r"$\dot x - \hat J \hat z$": _less(n) * m,
            "$y$ by two substitutions": _triangular(m) * 2,
            r"$\hat J^T y + \hat z$": _less(m) * n,
            r"$\dot q$ by $L^{-T}$": _triangular(n) if weighted else Count(),
        }
    if method == "eq6":
        return {
            "LU of $J$": _over(range(m), lambda row: _eliminated(row, n)),
            "null vectors $N_J$": _null_vector(n, m, identity) * k,
            "rows $N_J^T W$": (_less(m) if identity else _dot(n)) * (n * k) if weighted else Count(),
            "LU extended by these rows": _over(range(m, n), lambda row: _eliminated(row, n)),
            r"$-\alpha (\nabla f)^T N_J$": (_less(m) + Count(1)) * k,
            "forward substitution": _triangular(n, unit=True),
            "back-substitution": _triangular(n),
        }
    raise KeyError(method)


def accounting(method: str, n: int, m: int, *, weighted: bool, identity: bool = False) -> Count:
    """Operations of a method by the description of section IV."""
    return sum(steps(method, n, m, weighted=weighted, identity=identity).values(), Count())


# ---- the projection method, W = I: written out here, run on any kind of number


def projection(
    J: Array, xdot: Array, gradf: Array, alpha: Any, identity: bool, A: Array, N: Array, p: Array, G: Array, z: Array, x: Array
) -> None:
    """Any solution qp less what it must not have along null J: qdot = qp - N (N'N)^-1 N'(alpha grad f + qp), W = I.

    For one degree of redundancy qdot = qp - n n'(alpha grad f + qp) / (n'n). qp has zeros on the joints that no row of
    J pivots on, N is found as for eq. (6), N'N is factored L D L' (no square root). A (m, n), N (n, k) with the identity
    below, p (n,) ints, G (k, k) and z (n,) are work space, of the numbers of J. Without `identity` the block is
    multiplied by in the null vectors and in N'N, as Table I does for (6). Our reading of [31]-[33].
    """
    m, n = J.shape
    k = n - m
    for j in range(n):
        p[j] = j
        for i in range(m):
            A[i, j] = J[i, j]
    for i in range(m):  # J P = L U, L in the place of the zeros
        best = i
        for j in range(i + 1, n):
            if abs(A[i, j]) > abs(A[i, best]):
                best = j
        p[i], p[best] = p[best], p[i]
        for row in range(m):
            A[row, i], A[row, best] = A[row, best], A[row, i]
        for row in range(i + 1, m):
            A[row, i] = A[row, i] / A[i, i]
            for j in range(i + 1, n):
                A[row, j] = A[row, j] - A[row, i] * A[i, j]
    for i in range(m):  # qp on the pivot joints
        x[i] = xdot[i]
        for j in range(i):
            x[i] = x[i] - A[i, j] * x[j]
    for i in range(m - 1, -1, -1):
        for j in range(i + 1, m):
            x[i] = x[i] - A[i, j] * x[j]
        x[i] = x[i] / A[i, i]
    for c in range(k):
        for i in range(m - 1, -1, -1):
            s = A[i, m + c] if identity else A[i, i + 1] * N[i + 1, c]
            for j in range(i + 1, m) if identity else range(i + 2, n):
                s = s + A[i, j] * N[j, c]
            N[i, c] = -s / A[i, i]
    for j in range(n):  # z = alpha grad f + qp
        z[j] = alpha * gradf[p[j]]
        if j < m:
            z[j] = z[j] + x[j]
    for c in range(k):  # h = N'z, kept in x[m:]
        x[m + c] = z[m + c]
        for i in range(m):
            x[m + c] = x[m + c] + N[i, c] * z[i]
        for d in range(c + 1):  # G = N'N, one triangle
            s = N[0, c] * N[0, d]
            for i in range(1, m if identity else n):
                s = s + N[i, c] * N[i, d]
            G[c, d] = s + N[m + c, c] if identity and c == d else s
    for c in range(k):  # G = L D L', D L' kept above the diagonal
        for r in range(c + 1, k):
            G[c, r] = G[r, c]
            G[r, c] = G[r, c] / G[c, c]
        for r in range(c + 1, k):
            for d in range(c + 1, r + 1):
                G[r, d] = G[r, d] - G[r, c] * G[c, d]
    for c in range(k):
        for d in range(c):
            x[m + c] = x[m + c] - G[c, d] * x[m + d]
    for c in range(k):
        x[m + c] = x[m + c] / G[c, c]
    for c in range(k - 1, -1, -1):
        for r in range(c + 1, k):
            x[m + c] = x[m + c] - G[r, c] * x[m + r]
    for i in range(m):  # qdot = qp - N s
        for c in range(k):
            x[i] = x[i] - N[i, c] * x[m + c]
    for c in range(k):
        x[m + c] = -x[m + c]
    for j in range(n):
        z[p[j]] = x[j]
    for j in range(n):
        x[j] = z[j]


def projected(number: Callable[[Any], Any], J: Array, xdot: Array, gradf: Array, alpha: Any, identity: bool) -> Array:
    """`projection` on one problem whose entries are made by `number`; qdot (n,), objects."""
    m, n = J.shape

    def of(values: Any) -> Array:
        values = np.asarray(values)
        out = np.empty(values.shape, dtype=object)
        for index in np.ndindex(values.shape):
            out[index] = number(values[index].item())
        return out

    N, work = of(np.eye(n, n - m, -m)), (of(np.zeros((n - m, n - m))), of(np.zeros(n)), of(np.zeros(n)))
    args = of(J), of(xdot), of(gradf), number(alpha), identity, of(np.zeros((m, n))), N, np.arange(n), *work
    projection(*args)
    return work[-1]


class Tally:
    """A float that puts every operation with it down in `log`: "*" for multiplications and divisions, "+" for the others."""

    def __init__(self, value: float, log: list[str]) -> None:
        self.value, self.log = value, log

    def _put(self, value: float, sign: str) -> Tally:
        self.log.append(sign)
        return Tally(value, self.log)

    def __mul__(self, other: Tally) -> Tally:
        return self._put(self.value * other.value, "*")

    def __truediv__(self, other: Tally) -> Tally:
        return self._put(self.value / other.value, "*")

    def __add__(self, other: Tally) -> Tally:
        return self._put(self.value + other.value, "+")

    def __sub__(self, other: Tally) -> Tally:
        return self._put(self.value - other.value, "+")

    def __neg__(self) -> Tally:
        return Tally(-self.value, self.log)

    def __abs__(self) -> Tally:
        return Tally(abs(self.value), self.log)

    def __gt__(self, other: Tally) -> bool:
        return self.value > other.value


def projection_operations(n: int, m: int, *, identity: bool) -> Count:
    """Operations of the projection method, counted by running it on one problem of full rank."""
    log: list[str] = []
    J = np.cos(np.outer(np.arange(1, m + 1), (np.arange(n) + 0.5) * np.pi / n))  # rows of a cosine transform: orthogonal
    projected(lambda value: Tally(value, log), J, np.ones(m), np.ones(n), 0.5, identity)
    return Count(log.count("*"), log.count("+"))


def projection_accounting(n: int, m: int, *, identity: bool) -> Count:
    """Operations of the projection method by hand."""
    k = n - m
    lu = _over(range(m), lambda row: _eliminated(row, n))
    particular = _triangular(m, unit=True) + _triangular(m)
    null = _null_vector(n, m, identity) * k
    along = Count(n, m) + _less(m) * k
    gram = (_dot(m) * (k * (k + 1) // 2) + Count(0, k)) if identity else _dot(n) * (k * (k + 1) // 2)
    factors = _over(range(k), lambda c: Count(c) + _less(c * (c + 1) // 2))
    solved = _triangular(k, unit=True) * 2 + Count(k)
    return lu + particular + null + along + gram + factors + solved + _less(k) * m
