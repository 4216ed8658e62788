"""Rigorous enclosures at the speed of floats: the minimiser, its multipliers, condition (7) and rank, in float64 alone.

For J of full row rank and N'WN > 0, which it proves. Rounding errors are bounded a priori, and every bound is rounded up
by `UP`, so that what is proved holds whatever the data. The approximate answer, inverse and null vectors may come from
anywhere: they come from eq. (6). After S. M. Rump, "Verification methods: rigorous results using floating-point
arithmetic", Acta Numerica 19, 2010 (I - RB small proves B regular and bounds what is left), S. M. Rump, "Verification of
positive definiteness", BIT 46, 2006, and T. Ogita, S. M. Rump, S. Oishi, "Accurate sum and dot product", SIAM J. Sci.
Comput. 26(6), 2005 (residuals in twice the precision, by the error-free transformations of Knuth and Dekker).

The text is one problem's; it is traced to code for eight problems side by side (`lanes.py`), so a comparison is a demand:
where it does not hold, nothing is proved and the problem goes to exact arithmetic.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, reduce
from typing import Any

import numpy as np

from sandbox.closed_form import kernels, vectorised
from sandbox.closed_form.vectorised import Exchanges, identity_below, larger, threads, traced, zeros
from sandbox.lanes import Code, Machine
from sandbox.problem import VelocityProblem
from sandbox.tolerances import UNIT

Array = np.ndarray

UP = 1.0 + 2.0**-30
"""A bound is a sum of fewer than 2^20 products of numbers that are not negative: computed, it is off by less than this."""

CONTRACTION = 0.25
"""Norm of I - RB up to which R is taken for an inverse of B."""

SPLITTER = 2.0**27 + 1.0

SMALLEST, LARGEST = 2.0**-200, 2.0**200
"""Nonzero entries outside go to exact arithmetic: error-free products could underflow or overflow."""

FLOOR = 2.0**-600
"""What underflow takes from a sum is less: 2^-1074 a product, times |E||Gamma||N| and the numbers of them, below 2^430.
Every bound has it added where it arises, so that it is off relatively from there on, which `UP` sees to."""

TINY = 5e-324
"""Below the smallest positive number there is zero alone."""


@dataclass(frozen=True, eq=False)
class Enclosure:
    """What was proved of a stack of B problems, task exact; NaN where nothing was.

    proved (B,) : J has full row rank, N'WN > 0, and the minimiser is unique
    x (B, n), y (B, m) : nearest floats known of minimiser and multipliers
    x_low, y_low : what is to be added for the whole centre; x_radius, y_radius : the exact ones are no further from it
    """

    proved: Array
    x: Array
    x_low: Array
    x_radius: Array
    y: Array
    y_low: Array
    y_radius: Array


def enclosed(problem: VelocityProblem) -> Enclosure:
    """Enclose every minimiser of a stack with one leading axis, m <= n."""
    B, m, n = len(problem), problem.m, problem.n
    given = [part.reshape(B, -1) for part in _parts(problem)]
    out = [np.empty((B, size)) for size in (n, n, n, m, m, m)]
    proved = np.empty((B, 1))
    _machine("enclose", problem)(*given, *out, proved, threads=threads())
    fit = proved[:, 0] > 0
    if not fit.all():
        for values in out:
            values[~fit] = np.nan
    return Enclosure(fit, *out)


def inertias(problem: VelocityProblem) -> tuple[Array, Array]:
    """(positive, negative) eigenvalues of N'WN of every member of a stack, m < n, -1 where they are not proved.

    Proved where J has full row rank and no eigenvalue is within rounding of zero: with Q near the eigenvectors, Q'SQ is
    diagonal up to less than its diagonal (Gershgorin), and has the signs of S (Sylvester). The bounds hold for sums in any
    order, fused or not: BLAS may choose.
    """
    B, k = len(problem), problem.n - problem.m
    given = [part.reshape(B, -1) for part in _parts(problem, vectors=False)]
    S: Array = np.empty((B, k * k))
    radius, proved = np.empty_like(S), np.empty((B, 1))
    _machine("reduce", problem)(*given, S, radius, proved, threads=threads())
    fit = (proved[:, 0] > 0) & np.isfinite(S).all(axis=-1) & np.isfinite(radius).all(axis=-1)
    S, radius = (np.where(fit[:, None, None], values.reshape(B, k, k), 0.0) for values in (S, radius))
    Q: Array = np.linalg.eigh(S)[1]
    Qt, size = np.swapaxes(Q, -1, -2), np.abs(Q)
    turned = Qt @ S @ Q
    off = np.swapaxes(size, -1, -2) @ (radius + _gamma(2 * k + 2) * np.abs(S)) @ size * UP
    diagonal = np.diagonal(turned, axis1=-1, axis2=-2)
    aside = np.where(np.eye(k, dtype=bool), 0.0, np.abs(turned))  # not a difference of sums: that would cancel
    rest = (aside + off).sum(axis=-1) * UP
    regular = np.abs(Qt @ Q - np.eye(k)).sum(axis=-1).max(axis=-1) < CONTRACTION  # far from 1: rounding of Q'Q is no matter
    fit &= regular & (np.abs(diagonal) > rest).all(axis=-1)
    return tuple(np.where(fit, (sign * diagonal > 0).sum(axis=-1), -1) for sign in (1, -1))  # type: ignore[return-value]


def _parts(problem: VelocityProblem, *, vectors: bool = True) -> list[Array]:
    W = problem.W
    factors = [] if W.E is None or W.gamma is None else [W.E, W.gamma]
    matrices = [W.base, *factors]
    parts = [problem.J, problem.xdot, *matrices, problem.a] if vectors else [problem.J, *matrices]
    return [np.ascontiguousarray(part) for part in parts]


def _machine(what: str, problem: VelocityProblem) -> Machine:
    return machine(what, problem.m, problem.n, 0 if problem.W.E is None else problem.W.E.shape[-2])


@cache
def machine(what: str, m: int, n: int, k: int) -> Machine:
    """The code of `enclose` or `reduce` for J (m, n) and a weight with k factor rows."""
    shapes = {"J": (m, n), "xdot": (m,), "base": (n, n), "E": (k, n), "gamma": (k, k), "a": (n,)}
    whole = what == "enclose"
    if not whole:
        del shapes["xdot"], shapes["a"]
    inputs = [int(np.prod(shape)) for shape in shapes.values() if all(shape)]

    def write(code: Code) -> None:
        place = iter(range(len(inputs)))
        given = {
            name: code.given(next(place)).reshape(shape) if all(shape) else zeros(*shape) for name, shape in shapes.items()
        }
        for size in (abs(entry) for part in given.values() for entry in part.flat):
            demand((size > SMALLEST) | (size < TINY))
            demand(size < LARGEST)
        for i, values in enumerate((enclose if whole else reduce_weight)(**given, run=traced())):
            for value in values.flat:
                demand(abs(value) < np.inf)
            code.keep(len(inputs) + i, list(values.flat))
        code.keep(len(inputs) + len(outputs) - 1, [code.validity()])

    outputs = [n, n, n, m, m, m, 1] if whole else [(n - m) ** 2] * 2 + [1]
    return Machine(f"{what}_{m}x{n}_{k}", 64, inputs, outputs, write, [kernels, vectorised, sys.modules[__name__]])


# ---- one problem -----------------------------------------------------------------------------------------------


def enclose(
    J: Array, xdot: Array, base: Array, E: Array, gamma: Array, a: Array, run: Mapping[str, Any]
) -> tuple[Array, Array, Array, Array, Array, Array]:
    """(x, its rest, radius, y, its rest, radius); `run` are the kernels."""
    m, n = J.shape
    weight = _Weight(base, E, gamma)
    A, N, p, x, y = zeros(n, n), identity_below(m, n), Exchanges(n), zeros(n), zeros(m)
    t, v = zeros(2, len(E)), zeros(n)
    run["eq6"](J, xdot, base, E, gamma, a, 1.0, True, A, N, p, zeros(n), t, v, x)
    run["multipliers"](base, E, gamma, a, 1.0, True, A, p, t, v, x, y)
    frame = _Frame.of(J, A, N, p, run)
    S, radius = frame.reduced(weight)
    curvature = _positive(S, radius, run)
    # the answer's residuals in twice the precision, and one correction
    r, off_r = _sum(xdot, [(-J, x)])
    rho, off_rho = weight.residual(a, x, [(J.T, y)])
    dx, dy = zeros(n), zeros(m)
    run["substitute"](A, p, np.concatenate([r, -(frame.Nt @ rho)]), dx)
    dy[:] = frame.positions(-(rho + weight @ dx))[:m]
    run["transposed_substitute"](A, dy)
    # what is left of them, in floats with its rounding, and how far that can be from the answer
    left = abs(r - J @ dx) + _gamma(n) * (abs(r) + abs(J) @ abs(dx)) + off_r + FLOOR
    rest = abs(rho + weight @ dx + J.T @ dy) + off_rho + FLOOR
    rest = rest + _gamma(2 * n + m + 2 * len(E)) * (abs(rho) + weight.size(abs(dx)) + abs(J.T) @ abs(dy))
    along, wide = frame.joints(frame.inverse.bound(left)), abs(frame.Nt) + frame.drift  # |N*|'
    ex = (along + wide.T @ curvature.bound(wide @ (rest + weight.size(along)))) * UP
    ey = frame.inverse.transposed_bound(frame.positions(rest + weight.size(ex))[:m]) * UP
    return x, dx, ex, y, dy, ey


def reduce_weight(J: Array, base: Array, E: Array, gamma: Array, run: Mapping[str, Any]) -> tuple[Array, Array]:
    """(S, radius): the exact N'WN is no further from S, entry by entry; J is proved to have full row rank."""
    m, n = J.shape
    A, N, p = zeros(n, n), identity_below(m, n), Exchanges(n)
    run["factor_rows"](J, A, p)
    run["null_vectors"](A, m, N)
    return _Frame.of(J, A, N, p, run).reduced(_Weight(base, E, gamma))


@dataclass(frozen=True)
class _Frame:
    """The pivot columns B of J with nearly their inverse, and the null vectors with how far they are off.

    Nt (k, n) in the order of the joints; the exact ones with the same identity are no further from it than `drift`.
    """

    inverse: _Inverse
    Nt: Array
    drift: Array
    p: Exchanges
    run: Mapping[str, Any]

    @classmethod
    def of(cls, J: Array, A: Array, N: Array, p: Exchanges, run: Mapping[str, Any]) -> _Frame:
        """From the LU of J in A (m rows), its null vectors N and its exchanges p."""
        m, n = J.shape
        bare = cls(None, zeros(0, n), zeros(0, n), p, run)  # type: ignore[arg-type]
        pivots = np.stack([bare.positions(row) for row in J])
        R = identity_below(0, m)  # its rows solve B'z = e
        for row in R:
            run["transposed_substitute"](A[:m, :m], row)
        inverse = _Inverse.of(pivots[:, :m], R)  # J has full row rank
        off = (abs(pivots @ N) + _gamma(n) * (abs(pivots) @ abs(N))).T + FLOOR
        drift = np.array([bare.joints(inverse.bound(column)) for column in off], dtype=object).reshape(n - m, n)
        Nt = np.array([bare.joints(column) for column in N.T], dtype=object).reshape(n - m, n)
        return cls(inverse, Nt, drift, p, run)

    def joints(self, values: Array) -> Array:
        """By position, the last ones zero, in the order of the joints."""
        n = self.p.shape[0]
        out = zeros(n)
        self.run["to_joints"](np.concatenate([values, zeros(n - len(values))]), self.p, out)
        return out

    def positions(self, values: Array) -> Array:
        """By joint, in the order of the positions."""
        out = zeros(self.p.shape[0])
        self.run["to_positions"](values, self.p, out)
        return out

    def reduced(self, weight: _Weight) -> tuple[Array, Array]:
        """(S, radius) of N'WN."""
        k, n = self.Nt.shape
        size, moved = weight.size(abs(self.Nt).T), weight.size(self.drift.T)
        S = self.Nt @ (weight @ self.Nt.T)
        S = np.array([[S[max(i, j), min(i, j)] for j in range(k)] for i in range(k)], dtype=object).reshape(k, k)
        radius = abs(self.Nt) @ (moved + _gamma(2 * n + 2 * len(weight.E)) * size) + self.drift @ (size + moved)
        return S, (radius + radius.T + FLOOR) * UP


def _positive(S: Array, radius: Array, run: Mapping[str, Any]) -> _Inverse:
    """Proof that every matrix within `radius` of S is positive definite: condition (7); and nearly its inverse."""
    k = len(S)
    # Rump: if floats find a Cholesky factor of S - c I, c at least |radius| and gamma_(k+1) / (1 - gamma_(k+1)) tr S, then
    # S > 0; u |S_ii| more is for the difference
    shift = (_largest(radius.sum(axis=1)) + _gamma(4 * k) * sum(abs(np.diagonal(S)))) * UP
    L = S.copy()
    for i in range(k):
        L[i, i] = S[i, i] - shift
    demand(run["cholesky"](L))
    H = identity_below(0, k)
    for row in H:
        run["forward"](L, row)
        run["backward"](L, row)
    return _Inverse.of(S, H, radius)


def demand(condition: Any) -> None:
    """Where it does not hold nothing is proved: a traced comparison keeps that to itself, another one must hold."""
    if not condition:
        raise ArithmeticError("nothing is proved of this problem")


def _gamma(terms: int) -> float:
    """Gamma_k = k u / (1 - k u) of a sum of so many products, rounded up generously."""
    return 1.01 * (terms + 4) * UNIT


@dataclass(frozen=True)
class _Weight:
    """W = base + E' Gamma E, never formed; `size` bounds |base| v + |E|'|Gamma||E| v for v >= 0."""

    base: Array
    E: Array
    gamma: Array

    def __matmul__(self, v: Array) -> Array:
        return self.base @ v + self.E.T @ (self.gamma @ (self.E @ v)) if len(self.E) else self.base @ v

    def size(self, v: Array) -> Array:
        plain = abs(self.base) @ v + FLOOR
        return plain + abs(self.E.T) @ (abs(self.gamma) @ (abs(self.E) @ v)) if len(self.E) else plain

    def residual(self, a: Array, x: Array, more: list[tuple[Array, Array]]) -> tuple[Array, Array]:
        """The sum a + W x + ... in twice the precision: floats, and how far they are off."""
        if not len(self.E):
            return _sum(a, [(self.base, x), *more])
        h, h_low, h_off = _pair(zeros(len(self.E)), [(self.E, x)])
        g, g_low, g_off = _pair(zeros(len(self.E)), [(self.gamma, h)])
        g_low = g_low + self.gamma @ h_low
        size = abs(self.gamma)
        g_off = (g_off + size @ h_off + _gamma(len(size)) * (size @ abs(h_low) + abs(g_low))) * UP
        s, low, off = _pair(a, [(self.base, x), (self.E.T, g), *more])
        size = abs(self.E.T)
        low = low + self.E.T @ g_low
        off = (off + size @ g_off + _gamma(len(self.E) + 1) * (size @ abs(g_low) + abs(low))) * UP
        value = s + low
        return value, (off + UNIT * abs(value)) * UP


def _sum(start: Array, products: list[tuple[Array, Array]]) -> tuple[Array, Array]:
    """The sum start + A v + ..., rounded once, and a bound on its error."""
    s, low, off = _pair(start, products)
    value = s + low
    return value, (off + UNIT * abs(value)) * UP


def _pair(start: Array, products: list[tuple[Array, Array]]) -> tuple[Array, Array, Array]:
    """The sum start + A v + ... as s + low, and a bound on what that misses: Dot2 of Ogita, Rump and Oishi."""
    s, low, size, terms = start, zeros(len(start)), abs(start), 1
    for A, v in products:
        high_A, low_A = _split(A)
        high_v, low_v = _split(v)
        for j in range(len(v)):
            product = A[:, j] * v[j]
            error = low_A[:, j] * low_v[j] - (
                ((product - high_A[:, j] * high_v[j]) - low_A[:, j] * high_v[j]) - high_A[:, j] * low_v[j]
            )
            whole = s + product
            part = whole - s
            low = low + (((s - (whole - part)) + (product - part)) + error)
            s, size, terms = whole, size + abs(product), terms + 1
    return s, low, _gamma(2 * terms) * _gamma(2 * terms) * size * UP


def _split(a: Array) -> tuple[Array, Array]:
    """Two parts of 26 bits each whose sum is a (Dekker 1971)."""
    c = SPLITTER * a
    high = c - (c - a)
    return high, a - high


@dataclass(frozen=True)
class _Inverse:
    """R, nearly the inverse of a matrix B that is thereby proved regular; contractions bound what B^-1 is beyond R."""

    R: Array
    rows: Any
    columns: Any

    @classmethod
    def of(cls, B: Array, R: Array, radius: Array | None = None) -> _Inverse:
        """Of every matrix within `radius` of B, entry by entry."""
        k = len(B)
        beyond = abs(identity_below(0, k) - R @ B) + _gamma(k) * (np.eye(k) + abs(R) @ abs(B))
        if radius is not None:
            beyond = beyond + abs(R) @ radius
        norms = []
        for norm in (_largest(beyond.sum(axis=1)) * UP, _largest(beyond.sum(axis=0)) * UP):
            if k:
                demand(norm < CONTRACTION)
            norms.append(norm / (1.0 - norm) * UP)
        return cls(R, *norms)

    def bound(self, v: Array) -> Array:
        """At least |B^-1 w| for every |w| <= v: B^-1 = (I - E)^-1 R with E = I - RB."""
        w = abs(self.R) @ v
        return (w + self.rows * _largest(w) + FLOOR) * UP

    def transposed_bound(self, v: Array) -> Array:
        """At least |B'^-1 w| for every |w| <= v: B'^-1 = R'(I - E')^-1."""
        return (abs(self.R.T) @ (v + self.columns * _largest(v)) + FLOOR) * UP


def _largest(values: Array) -> Any:
    """Of numbers that are not negative; `larger` would pass over NaN, so that it is refused here."""
    for value in values:
        demand(value < np.inf)
    return reduce(larger, values, 0.0)
