"""Exact linear algebra: floats as rationals without rounding, by python-flint's integer matrices.

Vectors stand in homogeneous coordinates: the column (v, d) of integers is the point v/d, and (v, 0) the direction v.
A linear system A x = b is then the kernel of [A -b], and a quadratic 1/2 x'Hx + g'x is half the form of [H g; g' 0].
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from flint import fmpz, fmpz_mat

Array = np.ndarray


@dataclass(frozen=True, eq=False, slots=True)
class Dyadic:
    """The matrix `integers` * 2**`exponent`; sums and products are exact."""

    integers: fmpz_mat
    exponent: int

    @classmethod
    def of(cls, values: Array) -> Dyadic:
        """A float64 matrix, every entry taken for the rational that it is."""
        mantissa, exponent = np.frexp(values)
        odd = np.ldexp(mantissa, 53).astype(np.int64)
        exponent = exponent.astype(np.int64) - 53
        lowest_bit = np.frexp((odd & -odd).astype(np.float64))[1] - 1  # -1 for zero
        nonzero = odd != 0
        least = int((exponent + lowest_bit)[nonzero].min()) if nonzero.any() else 0
        shifts = (exponent - least).ravel().tolist()
        entries = [i << s if s >= 0 else i >> -s for i, s in zip(odd.ravel().tolist(), shifts, strict=True)]
        height, width = values.shape
        return cls(fmpz_mat(height, width, entries), least)

    @property
    def T(self) -> Dyadic:
        """The transpose."""
        return Dyadic(self.integers.transpose(), self.exponent)

    def __add__(self, other: Dyadic) -> Dyadic:
        low, high = (self, other) if self.exponent <= other.exponent else (other, self)
        return Dyadic(low.integers + high.integers * power(high.exponent - low.exponent), low.exponent)

    def __matmul__(self, other: Dyadic) -> Dyadic:
        return Dyadic(self.integers * other.integers, self.exponent + other.exponent)

    def scaled(self, factor: float) -> Dyadic:
        """The matrix times a float, taken exactly."""
        exact = Dyadic.of(np.array([[factor]]))
        return Dyadic(self.integers * exact.integers[0, 0], self.exponent + exact.exponent)

    def columns(self, chosen: Sequence[int]) -> Dyadic:
        """The columns that `chosen` lists."""
        rows = self.integers.tolist()
        return Dyadic(fmpz_mat(len(rows), len(chosen), [row[j] for row in rows for j in chosen]), self.exponent)


@dataclass(frozen=True, eq=False, slots=True)
class Rationals:
    """A vector of rationals over one denominator."""

    numerators: tuple[int, ...]
    denominator: int

    @classmethod
    def of(cls, numerators: Iterable[fmpz], denominator: fmpz, exponent: int = 0) -> Rationals:
        """`numerators` / `denominator` * 2**`exponent`."""
        up, down = power(max(exponent, 0)), power(max(-exponent, 0))
        return cls(tuple(int(v * up) for v in numerators), int(denominator * down))

    def fractions(self) -> tuple[Fraction, ...]:
        """Each entry in lowest terms."""
        return tuple(Fraction(v, self.denominator) for v in self.numerators)

    def nearest(self) -> Array:
        """Each entry correctly rounded to float64."""
        array = np.array([nearest(v, self.denominator) for v in self.numerators])
        array.setflags(write=False)
        return array


def nearest(numerator: int, denominator: int) -> float:
    """The float64 nearest to a fraction, ties to even; infinite beyond the range."""
    try:
        return numerator / denominator  # Python rounds the quotient of two integers correctly
    except OverflowError:
        return np.inf if (numerator > 0) == (denominator > 0) else -np.inf


def power(exponent: int) -> fmpz:
    """2**exponent, exponent >= 0."""
    return fmpz(1 << exponent)


@dataclass(frozen=True, eq=False, slots=True)
class Kernel:
    """Null space of [A -b]: `directions` (n+1, k) span null(A), `point` (n+1, 1) solves A x = b; None if nothing does.

    `pivots` are independent columns of A, as many as its rank.
    """

    pivots: list[int]
    directions: fmpz_mat
    point: fmpz_mat | None

    @property
    def free(self) -> int:
        """Dimension of null(A)."""
        return int(self.directions.ncols())

    def basis(self) -> fmpz_mat:
        """Directions, then the point."""
        assert self.point is not None
        return beside(self.directions, self.point)


def kernel(Ab: fmpz_mat) -> Kernel:
    """Null space of `Ab` = [A -b] by fraction-free row reduction: the free unknowns are set to 0 but one, or all."""
    width = int(Ab.ncols())
    R, pivot, rank = Ab.rref()  # the reduced form times `pivot`
    entries = R.entries()
    rows = [entries[i * width : (i + 1) * width] for i in range(rank)]
    pivots: list[int] = []
    for row in rows:
        j = pivots[-1] + 1 if pivots else 0
        while not row[j]:
            j += 1
        pivots.append(j)
    vectors = []
    for j in (j for j in range(width) if j not in pivots):
        vector = [fmpz(0)] * width
        vector[j] = pivot
        for i, row in zip(pivots, rows, strict=True):
            vector[i] = -row[j]
        vectors.append(vector)
    point = column(vectors.pop()) if width - 1 not in pivots else None
    directions = fmpz_mat(len(vectors), width, [v for vector in vectors for v in vector]).transpose()
    return Kernel([j for j in pivots if j < width - 1], directions, point)


def inertia(S: fmpz_mat) -> tuple[int, int, int]:
    """Numbers of positive, negative and zero eigenvalues of the symmetric `S`, by fraction-free LDL' (Sylvester).

    Entries stay minors of a congruent integer matrix (Bareiss); the signs of D are those of successive quotients.
    """
    rows = S.tolist()
    size = len(rows)
    positive = negative = 0
    previous = fmpz(1)
    while rows:
        k = len(rows)
        p = next((i for i in range(k) if rows[i][i]), None)
        if p is None:
            pair = next(((i, j) for i in range(k) for j in range(i) if rows[i][j]), None)
            if pair is None:
                break
            p, j = pair  # a zero diagonal: adding row and column j to p puts 2 S_pj there
            rows[p] = [v + w for v, w in zip(rows[p], rows[j], strict=True)]
            for row in rows:
                row[p] += row[j]
        pivot, top = rows[p][p], rows[p]
        if (pivot > 0) == (previous > 0):
            positive += 1
        else:
            negative += 1
        rows = [
            [(pivot * row[j] - row[p] * top[j]) // previous for j in range(k) if j != p]  # an exact division
            for i, row in enumerate(rows)
            if i != p
        ]
        previous = pivot
    return positive, negative, size - positive - negative


def column(entries: Sequence[fmpz]) -> fmpz_mat:
    """A matrix of one column."""
    return fmpz_mat(len(entries), 1, entries)


def beside(A: fmpz_mat, B: fmpz_mat) -> fmpz_mat:
    """[A B]."""
    pairs = zip(A.tolist(), B.tolist(), strict=True)
    return fmpz_mat(A.nrows(), A.ncols() + B.ncols(), [v for left, right in pairs for v in (*left, *right)])


def block(A: fmpz_mat, rows: Sequence[int], columns: Sequence[int]) -> fmpz_mat:
    """The rows and columns of A that are listed."""
    table = A.tolist()
    return fmpz_mat(len(rows), len(columns), [table[i][j] for i in rows for j in columns])


def dot(u: fmpz_mat, v: fmpz_mat) -> fmpz:
    """The inner product of two columns."""
    return (u.transpose() * v)[0, 0]


def orthogonalised(Z: fmpz_mat) -> list[fmpz_mat]:
    """Columns of the independent `Z` made orthogonal by Gram and Schmidt, exactly; lengths are free."""
    basis: list[fmpz_mat] = []
    for j in range(Z.ncols()):
        basis.append(without(column([Z[i, j] for i in range(Z.nrows())]), basis))
    return basis


def without(z: fmpz_mat, basis: Iterable[fmpz_mat]) -> fmpz_mat:
    """A positive multiple of `z` less its projections on the orthogonal `basis`, content removed."""
    for q in basis:
        z = z * dot(q, q) - q * dot(q, z)
    content = fmpz(0)
    for v in z.entries():
        content = content.gcd(v)
    return fmpz_mat(z.nrows(), 1, [v // content for v in z.entries()]) if content > 1 else z
