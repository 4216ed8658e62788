"""The kernels run as they stand, on any kind of number: exact rationals, or numbers that count operations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from types import FunctionType
from typing import Any

import numpy as np

from sandbox.closed_form import kernels

Array = np.ndarray


def eq6_on(
    number: Callable[[Any], Any],
    J: Any,
    xdot: Any,
    W: Any,
    gradf: Any,
    alpha: Any = 1,
    E: Any = None,
    gamma: Any = None,
    *,
    multipliers: bool = True,
    identity: bool = False,
) -> tuple[int, Array, Array, Array]:
    """(code, x, y, pivots) of eq. (6) on one problem, every entry made by `number`; W None is the identity.

    With Fraction the answer is exact, for eq. (6) takes no square root. The codes are those of kernels.py. y is left
    zero without `multipliers`, which the paper does not compute. `identity` multiplies by no entry of N's identity block.
    """
    J, xdot, gradf, alpha = _of(number, J), _of(number, xdot), _of(number, gradf), number(alpha)
    m, n = J.shape
    weighted = W is not None
    W = _of(number, W if weighted else np.zeros((0, 0)))
    E, gamma = _of(number, np.zeros((0, n)) if E is None else E), _of(number, np.zeros((0, 0)) if E is None else gamma)
    A, b, x, y = _zeros(number, n, n), _zeros(number, n), _zeros(number, n), _zeros(number, m)
    N, t, v, p = _of(number, np.eye(n, n - m, -m)), _zeros(number, 2, len(E)), _zeros(number, n), np.zeros(n, dtype=int)
    kernel = eq6_identity if identity else kernels.eq6
    code = kernel(J, xdot, W, E, gamma, gradf, alpha, weighted, A, N, p, b, t, v, x)
    if multipliers and code == kernels.SOLVED:
        kernels.multipliers(W, E, gamma, gradf, alpha, weighted, A, p, t, v, x, y)
    return code, x, y, np.diagonal(A).copy()


def identity_null_vectors(A: Array, m: int, N: Array) -> None:
    """`kernels.null_vectors`; the identity block of N is not multiplied by."""
    for c in range(A.shape[1] - m):
        for i in range(m - 1, -1, -1):
            s = A[i, m + c]
            for j in range(i + 1, m):
                s = s + A[i, j] * N[j, c]
            N[i, c] = -s / A[i, i]


def identity_weigh(W: Array, E: Array, gamma: Array, weighted: bool, v: Array, t: Array, row: Array) -> None:
    """`kernels.weigh`; the zeros and the one that v has of the identity block of N are not multiplied by."""
    kept = [i for i in range(len(v)) if v[i] > 0 or -v[i] > 0]

    def combined(entries: Array) -> Any:
        terms = [v[i] * entries[i] if v[i] > 1 or -v[i] > -1 else entries[i] for i in kept]
        return sum(terms[1:], terms[0])

    for j in range(len(v)):
        row[j] = combined(W[:, j]) if weighted else v[j]
    for r in range(len(E)):
        t[0, r] = combined(E[r])
    for r in range(len(E)):
        s = t[0, 0] * gamma[0, r]
        for q in range(1, len(E)):
            s = s + t[0, q] * gamma[q, r]
        for j in range(len(v)):
            row[j] = row[j] + s * E[r, j]


eq6_identity = FunctionType(
    kernels.eq6.__code__,
    {**vars(kernels), "null_vectors": identity_null_vectors, "weigh": identity_weigh},
    "eq6_identity",
)
"""`kernels.eq6`, the same source with these two steps in the place of its own (ours: Table I multiplies by the block)."""


def eq6_implicit_on(number: Callable[[Any], Any], J: Any, xdot: Any, NtW: Any, Nta: Any) -> tuple[int, Array]:
    """(code, x) of eq. (6) on one problem of which only N'W (k, n) and N'a (k,) are known."""
    rows = _of(number, np.concatenate([np.asarray(J), np.asarray(NtW)]))
    b = np.concatenate([_of(number, xdot), [-entry for entry in _of(number, Nta)]])
    n = rows.shape[1]
    x, p = _zeros(number, n), np.zeros(n, dtype=int)
    return kernels.eq6_implicit(rows, b, _zeros(number, n, n), p, x), x


def eq2_5_on(number: Callable[[Any], Any], J: Any, xdot: Any, W: Any, gradf: Any, alpha: Any = 1) -> tuple[int, Array, Array]:
    """(code, x, y) of eqs. (2)-(5) on one problem; W None is the identity."""
    J, xdot, gradf, alpha = _of(number, J), _of(number, xdot), _of(number, gradf), number(alpha)
    m, n = J.shape
    weighted = W is not None
    W = _of(number, W if weighted else np.zeros((0, 0)))
    x, y = _zeros(number, n), _zeros(number, m)
    work = _zeros(number, n, n), _zeros(number, m, n), _zeros(number, n), _zeros(number, m, m)
    code = kernels.eq2_5(J, xdot, W, gradf, alpha, weighted, *work, x, y)
    return code, x, np.array([-entry for entry in y], dtype=object)


def _of(number: Callable[[Any], Any], values: Any) -> Array:
    """An object array of the same entries, each its own number."""
    values = np.asarray(values)
    out = np.empty(values.shape, dtype=object)
    for index in np.ndindex(values.shape):
        entry = values[index]
        out[index] = number(entry.item() if isinstance(entry, np.generic) else entry)
    return out


def _zeros(number: Callable[[Any], Any], *shape: int) -> Array:
    return _of(number, np.zeros(shape, dtype=int))


@dataclass
class Operations:
    """Floating-point operations as Table I counts them: multiplications with divisions, additions with subtractions."""

    multiplications: int = 0
    additions: int = 0


class Counted:
    """A float that counts what is done with it; comparisons, negations and square roots are free (methods 8.11)."""

    def __init__(self, value: float, operations: Operations) -> None:
        self.value, self.operations = float(value), operations

    def _product(self, value: float) -> Counted:
        self.operations.multiplications += 1
        return Counted(value, self.operations)

    def _sum(self, value: float) -> Counted:
        self.operations.additions += 1
        return Counted(value, self.operations)

    def __mul__(self, other: Counted) -> Counted:
        return self._product(self.value * other.value)

    def __truediv__(self, other: Counted) -> Counted:
        return self._product(self.value / other.value)

    def __add__(self, other: Counted) -> Counted:
        return self._sum(self.value + other.value)

    def __sub__(self, other: Counted) -> Counted:
        return self._sum(self.value - other.value)

    def __neg__(self) -> Counted:
        return Counted(-self.value, self.operations)

    def __abs__(self) -> Counted:
        return Counted(abs(self.value), self.operations)

    def __pow__(self, power: float) -> Counted:
        return Counted(self.value**power, self.operations)

    def __gt__(self, other: Any) -> bool:
        return self.value > (other.value if isinstance(other, Counted) else other)


def operations(method: str, n: int, m: int, *, weighted: bool, identity: bool = False) -> Operations:
    """Operations that eq2_5 or eq6 takes on n joints and m task rows, counted by running it (Tables I and II).

    `identity`: eq6 multiplies by no entry of the identity block of N (Table I: in N'grad f only).
    Raises KeyError for another method.
    """
    # any generic problem takes the same path: a Vandermonde J has full rank, W is diagonally dominant
    J = np.vander(np.arange(1.0, n + 1) / n, m, increasing=True).T
    W = np.eye(n) * n + 1 / (1 + np.arange(n)[:, None] + np.arange(n)) if weighted else None
    total = Operations()
    kernels_by_name: dict[str, Callable[..., Any]] = {
        "eq2_5": eq2_5_on, "eq6": partial(eq6_on, multipliers=False, identity=identity),
    }  # fmt: skip
    kernels_by_name[method](lambda value: Counted(value, total), J, np.ones(m), W, np.ones(n), 0.5)
    return total


def eq6_exact(problem: Any) -> tuple[int, Array, Array, Array]:
    """`eq6_on` Fractions for one VelocityProblem: every float is a rational, so nothing is rounded."""
    W = problem.W
    return eq6_on(Fraction, problem.J, problem.xdot, W.base, problem.a, 1, W.E, W.gamma)
