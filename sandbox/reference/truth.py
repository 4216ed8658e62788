"""The truth of a problem, decided over the rationals: every float is one, so nothing is rounded before the end."""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from flint import fmpz, fmpz_mat

from sandbox import check, tolerances
from sandbox.errors import NonFiniteError, ShapeError, UnknownNameError
from sandbox.problem import VelocityProblem, given
from sandbox.reference import margin as margins
from sandbox.reference.exact import (
    Dyadic,
    Rationals,
    beside,
    block,
    column,
    dot,
    inertia,
    kernel,
    nearest,
    orthogonalised,
    without,
)
from sandbox.task import TASKS

Array = np.ndarray

REASONS = {
    "no_freedom": "the rows leave one point",
    "condition_7": "N'WN is positive definite",
    "singular": "N'WN is singular, positive semidefinite, and the gradient vanishes along its null space",
    "descending": "N'WN is singular, positive semidefinite, and the objective falls along its null space",
    "saddle": "N'WN has eigenvalues of both signs",
    "maximum": "N'WN is negative definite",
    "indefinite_singular": "N'WN has a negative eigenvalue and is singular",
    "target_unbounded": "(J qdot - xdot)'Wx (J qdot - xdot) has no minimum",
    "inconsistent": "xdot is not in the range of J",
}
"""Why a problem is in its class (the classes stand in verdict.EXPECTED)."""


@dataclass(frozen=True, eq=False)
class Truth:
    """What is right for one problem and task (design: tasks and truth).

    x (n,) is the minimiser, of least norm where it is not unique, each entry correctly rounded; y (m,) its multipliers
    (W x + a + J'y = 0); freedom (n, d) orthonormal columns Z, so that x + range(Z) are all minimisers; value the
    optimal 1/2 x'Wx + a'x (task damped: of methods C1). They are None, and Z has no columns, where there is no minimum.
    inertia counts the (positive, negative, zero) eigenvalues of N'WN; N spans what the task's constraint leaves free.
    rank is that of J. margin is the smallest relative perturbation of the data at which the class changes.

    y: exact with rank(J) < m, only J'y is determined, and zeros stand on dependent rows; least_squares, y is in
    Wx range(J) and equals -d value / d xdot.
    """

    task: str
    expected: str
    reason: str
    margin: float
    rank: int
    inertia: tuple[int, int, int]
    x: Array | None
    y: Array | None
    freedom: Array
    value: float | None
    _x: Rationals | None = field(default=None, repr=False)
    _y: Rationals | None = field(default=None, repr=False)
    _value: Rationals | None = field(default=None, repr=False)

    @property
    def x_exact(self) -> tuple[Fraction, ...] | None:
        """The minimiser before rounding."""
        return None if self._x is None else self._x.fractions()

    @property
    def y_exact(self) -> tuple[Fraction, ...] | None:
        """The multipliers before rounding."""
        return None if self._y is None else self._y.fractions()

    @property
    def value_exact(self) -> Fraction | None:
        """The optimal value before rounding."""
        return None if self._value is None else self._value.fractions()[0]


def truth(problem: VelocityProblem, task: str = "exact", *, damping: float = tolerances.DAMPING) -> Truth | list[Truth]:
    """Decide `problem` for one task; a list for a stack, in flat order.

    task "exact": J qdot = xdot; "least_squares": eq. (13), the minimisers of (J qdot - xdot)'Wx(J qdot - xdot);
    "damped": methods C1 with lambda = `damping` [unit of sqrt(xdot'Wx xdot / qdot'W qdot)], a float taken exactly.

    Raises UnknownNameError for another task; ShapeError, NonFiniteError, RangeError for a `damping` out of range.
    """
    if task not in TASKS:
        raise UnknownNameError.of("task", task, TASKS)
    factor = check.real(damping, "damping")
    if factor.ndim:
        raise ShapeError(f"damping has shape {factor.shape}; it must be one number", field="damping")
    stack, truths = given(problem).stacked(), []
    for i in range(len(stack)):
        E = None if stack.W.E is None else stack.W.E[i]
        gamma = None if stack.W.gamma is None else stack.W.gamma[i]
        Wx = None if stack.Wx is None else stack.Wx[i]
        member = _Given(stack.J[i], stack.xdot[i], stack.W.base[i], E, gamma, stack.a[i], Wx)
        truths.append(member.damped(float(factor)) if task == "damped" else getattr(member, task)())
    return truths if problem.lead else truths[0]


def truth_of_qp(H: Array, g: Array, A: Array, b: Array) -> Truth | list[Truth]:
    """Decide a QP as posed in floats: minimise 1/2 x'Hx + g'x subject to Ax = b; a list for a stack.

    H (..., n, n), its symmetric part counts; g (..., n); A (..., p, n) and b (..., p), p may be 0. Magnitudes are free.
    The answer is that of task "exact" with J = A: rank is that of A, y (p,) are the multipliers of Ax = b.

    Raises NonFiniteError where an entry is NaN or infinite, ShapeError where shapes do not agree.
    """
    H, g, A, b = (np.asarray(part, dtype=np.float64) for part in (H, g, A, b))
    if not g.ndim or not b.ndim:
        raise ShapeError("g and b must be vectors or stacks of them", field="b" if g.ndim else "g")
    lead, n, p = g.shape[:-1], g.shape[-1], b.shape[-1]
    for part, name, shape in ((H, "H", (n, n)), (g, "g", (n,)), (A, "A", (p, n)), (b, "b", (p,))):
        if part.shape != (*lead, *shape):
            raise ShapeError(f"{name} has shape {part.shape}; it must be {(*lead, *shape)}", field=name)
        if not np.isfinite(part).all():
            raise NonFiniteError(f"{name} holds NaN or infinity; every entry must be finite", field=name)
    members = [_Given(A[i], b[i], H[i], None, None, g[i], None) for i in np.ndindex(*lead)]
    truths = [one.exact() for one in members]
    return truths if lead else truths[0]


class _Minimum(NamedTuple):
    """Class of: minimise 1/2 x+'M x+ over C x+ = 0, x+ = (x, 1); `x` (n+1, 1) and `freedom` (n+1, d) homogeneous."""

    expected: str
    reason: str
    pivots: list[int]  # independent columns of A
    inertia: tuple[int, int, int]
    x: fmpz_mat | None = None
    freedom: fmpz_mat | None = None


def _minimise(M: fmpz_mat, C: fmpz_mat) -> _Minimum:
    """Steps (a), (c)-(f) of the decision; M = [H g; g' 0], C = [A -b]."""
    rows = kernel(C)
    N = rows.directions
    S = N.transpose() * M * N
    signs = inertia(S)
    told = rows.pivots, signs
    if rows.point is None:
        return _Minimum("infeasible", "inconsistent", *told)
    if rows.free == 0:
        return _Minimum("unique_minimum", "no_freedom", *told, rows.point, N)
    positive, negative, zero = signs
    if negative:
        return _Minimum("no_minimum", "indefinite_singular" if zero else "saddle" if positive else "maximum", *told)
    # x+ = [N q_p] (y, 1), and stationarity in y is again a kernel: N'M [N q_p] (y, 1) = S y + h = 0
    basis = rows.basis()
    reduced = kernel(N.transpose() * M * basis)
    if reduced.point is None:
        return _Minimum("no_minimum", "descending", *told)
    x, freedom = basis * reduced.point, basis * reduced.directions
    if zero:
        return _Minimum("minimum_not_unique", "singular", *told, x, freedom)
    return _Minimum("unique_minimum", "condition_7", *told, x, freedom)


class _Given(NamedTuple):
    """One problem's arrays; the weight is W + E' gamma E."""

    J: Array
    xdot: Array
    W: Array
    E: Array | None
    gamma: Array | None
    a: Array
    Wx: Array | None

    def exact(self) -> Truth:
        """Minimise 1/2 x'Wx + a'x subject to J x = xdot."""
        M, C = self.objective(), self.rows()
        found = _minimise(M.integers, C.integers)
        y = None
        if found.x is not None:
            y = Rationals.of(*_multipliers(M.integers, C.integers, found.x), M.exponent - C.exponent)
        ratio, N = margins.spaces(self.J, len(found.pivots))
        terms = [ratio]
        if found.expected == "infeasible":
            terms.append(margins.inconsistency(self.xdot, self.J[:, found.pivots]))
        elif len(found.pivots) < len(self.xdot):
            terms.append(0.0)
        return self.report("exact", found, len(found.pivots), M, y, [*terms, *self.bend(found, N)])

    def least_squares(self) -> Truth:
        """Eq. (13): J'Wx J x = J'Wx xdot is the constraint, in a basis of range(J): J_c independent columns of J."""
        M, C, Wx = self.objective(), self.rows(), self.target()
        pivots = kernel(C.integers).pivots
        Jc = C.columns(pivots)
        target = Jc.T @ Wx @ C
        P = block(target.integers, range(len(pivots)), pivots)  # J_c'Wx J_c
        _, negative, zero = inertia(P)
        found = _minimise(M.integers, target.integers)
        if negative or found.expected == "infeasible":
            found = _Minimum("no_minimum", "target_unbounded", found.pivots, found.inertia)
        y = None
        if found.x is not None:
            mu, pivot = _multipliers(M.integers, target.integers, found.x)
            across = (Wx @ Jc).integers * column(mu)  # J'Wx J_c mu: y is Wx J_c mu
            y = Rationals.of(across.entries(), pivot, M.exponent - target.exponent + Wx.exponent + Jc.exponent)
        ratio, N = margins.spaces(self.J, len(pivots))
        terms = [ratio]
        if zero and not negative:
            terms.append(0.0)
        elif self.Wx is not None and pivots:
            terms.append(margins.target_curvature(self.Wx, self.J[:, pivots]))
        if found.reason != "target_unbounded" and not zero:
            terms += self.bend(found, N)
        return self.report("least_squares", found, len(pivots), M, y, terms)

    def damped(self, damping: float) -> Truth:
        """Methods C1: minimise lambda^2 (1/2 x'Wx + a'x) + 1/2 s'Wx s, s = xdot - J x.

        The slack joints s are eliminated: [I; -J] spans null [J I], so N~'W~N~ = lambda^2 W + J'WxJ.
        """
        C, Wx = self.rows(), self.target()
        M = self.objective().scaled(damping).scaled(damping) + C.T @ Wx @ C
        n = len(self.a)
        found = _minimise(M.integers, fmpz_mat(0, n + 1, []))
        y = None
        if found.x is not None:  # stationarity in s: Wx s + y = 0
            y = Rationals.of((Wx @ C).integers * found.x, found.x[n, 0], Wx.exponent + C.exponent)
        terms = [0.0]
        if found.expected != "minimum_not_unique" and found.reason != "descending":
            Wx_float = np.eye(len(self.xdot)) if self.Wx is None else self.Wx
            terms = [margins.slack_curvature(self.J, damping**2 * self.dense(), Wx_float)]
        rank = len(kernel(C.integers).pivots)
        return self.report("damped", found, rank, M, y, terms)

    def objective(self) -> Dyadic:
        """[W a; a' 0], the factored part formed exactly."""
        n = len(self.a)
        M = np.zeros((n + 1, n + 1))
        M[:n, :n], M[:n, n], M[n, :n] = self.W, self.a, self.a
        whole = Dyadic.of(M)
        if not np.array_equal(self.W, self.W.T):  # a posed H: its symmetric part is what the objective sees
            whole = (whole + whole.T).scaled(0.5)
        if self.E is None or self.gamma is None:
            return whole
        E = Dyadic.of(np.column_stack([self.E, np.zeros(len(self.E))]))
        return whole + E.T @ Dyadic.of(self.gamma) @ E

    def rows(self) -> Dyadic:
        """[J -xdot]."""
        return Dyadic.of(np.column_stack([self.J, -self.xdot]))

    def target(self) -> Dyadic:
        """Wx; the identity where it is not given."""
        return Dyadic.of(np.eye(len(self.xdot)) if self.Wx is None else self.Wx)

    def dense(self) -> Array:
        """W in floats, for the margin; infinite or NaN where the product of the factors overflows."""
        if self.E is None or self.gamma is None:
            return self.W
        with np.errstate(over="ignore", invalid="ignore"):
            return self.W + self.E.T @ self.gamma @ self.E

    def bend(self, found: _Minimum, N: Array) -> list[float]:
        """The margin's term for the eigenvalue of N'WN that decides, if one does."""
        if found.expected == "minimum_not_unique" or found.reason == "descending":
            return [0.0]
        if found.expected == "infeasible" or found.reason == "no_freedom":
            return []
        return [margins.curvature(self.dense(), N)]

    def report(self, task: str, found: _Minimum, rank: int, M: Dyadic, y: Rationals | None, terms: list[float]) -> Truth:
        """Round what was found, once."""
        n, margin = len(self.a), min(1.0, *terms)
        told = task, found.expected, found.reason, margin, rank, found.inertia
        if found.x is None or found.freedom is None or y is None:
            return Truth(*told, None, None, np.zeros((n, 0)), None)
        directions = orthogonalised(found.freedom)
        point = without(found.x, directions)  # of least norm: the last coordinate of a direction is 0
        x = Rationals.of(point.entries()[:n], point[n, 0])
        value = Rationals.of([dot(point, M.integers * point)], 2 * point[n, 0] ** 2, M.exponent)
        freedom = np.zeros((n, len(directions)))
        for j, direction in enumerate(directions):
            length = int(max(abs(v) for v in direction.entries()))
            freedom[:, j] = [nearest(int(v), length) for v in direction.entries()[:n]]
        freedom /= np.linalg.norm(freedom, axis=0)
        freedom.setflags(write=False)
        return Truth(*told, x.nearest(), y.nearest(), freedom, float(value.nearest()[0]), x, y, value)


def _multipliers(M: fmpz_mat, C: fmpz_mat, x: fmpz_mat) -> tuple[list[fmpz], fmpz]:
    """Multipliers mu of C x+ = 0 over one denominator: H x + g + A'mu = 0, zero on dependent rows."""
    n = C.ncols() - 1
    gradient = M * x
    system = beside(block(C.transpose(), range(n), range(C.nrows())), block(gradient, range(n), [0]))
    mu = kernel(system).point
    assert mu is not None, "a minimiser is stationary"
    entries = mu.entries()
    # mu is over its last coordinate, and the gradient over that of x
    return entries[:-1], entries[-1] * x[n, 0]
