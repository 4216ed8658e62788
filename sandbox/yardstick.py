"""How far off an answer may be: the condition of each problem, measured on its own KKT system.

K = [W C'; C 0] (with Z' added where the minimum is not unique), X = K^-1. The rows C are J where it has full row
rank, U_r'J where it has not, U_r'Wx J in the least-squares sense, and [J I] for damping. kappa is Skeel's condition
number of x: unchanged when W is scaled against J or rows of J are scaled.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from sandbox.problem import VelocityProblem
from sandbox.spectrum import Spectrum, smallest_eigenvalue
from sandbox.stacked import times, transpose
from sandbox.task import TaskView, task_weight
from sandbox.tolerances import DAMPING
from sandbox.verdict import EXPECTED

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class Yardstick:
    """Truth and conditioning of a stack of B problems for one task, as arrays; NaN where there is no minimum.

    expected (B,) code into verdict.EXPECTED; x (B, n), y (B, m) the exact answer rounded once;
    freedom : (B, n, n) projector onto range Z, zero where the minimum is unique
    primal_gain, dual_gain (B,) : |X12|_inf, |X11|_inf
    spread (B,) : max over joints of |X|(|K||z| + |rhs|) [unit of qdot]
    size (B,) : max(|x|_inf, s), the denominator of `error`
    """

    view: TaskView
    expected: Array
    reason: list[str]
    margin: Array
    rank: Array
    x: Array
    y: Array
    freedom: Array
    lambda_min_W: Array
    lambda_min_reduced: Array
    sigma_min_J: Array
    primal_gain: Array
    dual_gain: Array
    spread: Array
    size: Array
    norm_W: Array

    def __getitem__(self, rows: Array) -> Yardstick:
        """Members by an index array; one may come several times."""
        taken = {f.name: getattr(self, f.name)[rows] for f in fields(self) if f.name not in ("view", "reason")}
        view = TaskView(self.view.problem[rows], self.view.task, self.view.scale)
        return Yardstick(view=view, reason=[self.reason[i] for i in rows], **taken)

    @property
    def solvable(self) -> Array:
        """Where a minimum exists (B,)."""
        solvable: Array = self.expected <= 1
        return solvable

    @property
    def kappa(self) -> Array:
        """Skeel's condition number of x (B,); NaN where x is zero or missing."""
        largest = np.abs(self.x).max(axis=-1)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(largest > 0, self.spread / largest, np.nan)

    @classmethod
    @np.errstate(all="ignore")  # W and its products may overflow: the figures of that member are then not finite
    def of(cls, problem: VelocityProblem, task: str, truths: Sequence[Any], damping: float = DAMPING) -> Yardstick:
        """Measure a stack with one leading axis against its exact truths."""
        B, m, n = len(problem), problem.m, problem.n
        expected = np.array([EXPECTED.index(t.expected) for t in truths], dtype=np.int8)
        rank = np.array([t.rank for t in truths])
        x = np.array([t.x if t.x is not None else np.full(n, np.nan) for t in truths])
        y = np.array([t.y if t.y is not None else np.full(m, np.nan) for t in truths])
        degrees = np.array([0 if t.freedom is None else t.freedom.shape[1] for t in truths])
        freedom = np.zeros((B, n, n))
        for i in np.flatnonzero(degrees).tolist():
            freedom[i] = truths[i].freedom @ truths[i].freedom.T
        dense = problem.W.dense()
        spectrum = Spectrum.of(problem, rank)
        view = TaskView.of(problem, task, damping)
        reduced = np.full(B, np.nan)
        figures = {name: np.full(B, np.nan) for name in ("primal_gain", "dual_gain", "spread", "size")}
        for r, members in spectrum.by_rank():
            N = spectrum.null_basis(r, members)
            if N.shape[-1]:
                S = problem[members].W.left(N) @ N
                reduced[members] = smallest_eigenvalue((S + transpose(S)) / 2)
            for d in np.unique(degrees[members]):
                chosen = members[(degrees[members] == d) & (expected[members] <= 1)]
                if len(chosen):
                    Z = np.array([truths[int(i)].freedom for i in chosen]) if d else np.zeros((len(chosen), n, 0))
                    part = problem[chosen]
                    U = spectrum.image_basis(r, chosen)
                    measured = _condition(part, task, view.scale, dense[chosen], U, r, x[chosen], y[chosen], Z)
                    for name, values in zip(figures, measured, strict=True):
                        figures[name][chosen] = values
        return cls(
            view=view, expected=expected, reason=[t.reason for t in truths], margin=np.array([t.margin for t in truths]),
            rank=rank, x=x, y=y, freedom=freedom, lambda_min_W=smallest_eigenvalue(dense), lambda_min_reduced=reduced,
            sigma_min_J=spectrum.sigma[:, -1], norm_W=np.abs(dense).sum(axis=-1).max(axis=-1), **figures,
        )  # fmt: skip


def _condition(
    part: VelocityProblem, task: str, scale: float, W: Array, U: Array, r: int, x: Array, y: Array, Z: Array
) -> tuple[Array, Array, Array, Array]:
    """|X12|_inf, |X11|_inf, |X|(|K||z| + |rhs|) over joints, and the size of x, for problems of one rank and freedom."""
    b, m, n = len(part), part.m, part.n
    a = scale * part.a
    if task == "damped":
        Wx = task_weight(part)
        slack = part.xdot - times(part.J, x)
        W = _blocks([[scale * W, None], [None, Wx]], b, (n, m), (n, m))
        C = np.concatenate([part.J, np.broadcast_to(np.eye(m), (b, m, m))], axis=-1)
        d, variables, multipliers = part.xdot, np.concatenate([x, slack], axis=-1), y
        a = np.concatenate([a, np.zeros((b, m))], axis=-1)
        back = np.broadcast_to(np.eye(m), (b, m, m))
    elif task == "exact" and r == m:
        C, d, variables, multipliers = part.J, part.xdot, x, y
        back = np.broadcast_to(np.eye(m), (b, m, m))
    else:
        # the rows that decide: an orthonormal basis of range J, seen through Wx in the least-squares sense
        left = np.swapaxes(U if task == "exact" else task_weight(part) @ U, -1, -2)
        C, d, variables = left @ part.J, times(left, part.xdot), x
        multipliers = (np.linalg.pinv(transpose(left)) @ y[..., None])[..., 0]
        # a residual of J'Wx(J qdot - xdot) reaches the r rows through (J'U_r)^+
        back = left if task == "exact" else np.linalg.pinv(transpose(part.J) @ U)
    p, q, k = C.shape[-2], C.shape[-1], Z.shape[-1]
    border = np.zeros((b, p + k, q))
    border[:, :p] = C
    border[:, p:, :n] = transpose(Z)
    K = _blocks([[W, transpose(border)], [border, None]], b, (q, p + k), (q, p + k))
    X = _inverse(K)
    z = np.concatenate([variables, multipliers, np.zeros((b, k))], axis=-1)
    rhs = np.concatenate([a, d, np.zeros((b, k))], axis=-1)
    joints = np.abs(X[:, :n])
    spread = (joints @ (np.abs(K) @ np.abs(z)[..., None] + np.abs(rhs)[..., None]))[..., 0].max(axis=-1)
    s = (joints @ np.abs(rhs)[..., None])[..., 0].max(axis=-1)
    X12 = X[:, :n, q : q + p]
    with np.errstate(invalid="ignore"):  # a K that is singular in float64 has an infinite inverse: no tolerance at all
        through = X12 @ back
    primal = np.abs(through).sum(axis=-1).max(axis=-1) if p else np.zeros(b)
    if task == "least_squares" and p:  # posed as the r rows or as the normal equations: whichever lets more through
        primal = np.maximum(primal, np.abs(X12).sum(axis=-1).max(axis=-1))
    dual = np.abs(X[:, :n, :q]).sum(axis=-1).max(axis=-1)
    return primal, dual, spread, np.maximum(np.abs(x).max(axis=-1), s)


def _blocks(rows: list[list[Array | None]], b: int, heights: tuple[int, ...], widths: tuple[int, ...]) -> Array:
    """Block matrices, stacked; None is zero."""
    whole = np.zeros((b, sum(heights), sum(widths)))
    top = 0
    for row, height in zip(rows, heights, strict=True):
        left = 0
        for block, width in zip(row, widths, strict=True):
            if block is not None:
                whole[:, top : top + height, left : left + width] = block
            left += width
        top += height
    return whole


def _inverse(K: Array) -> Array:
    """Inverses of symmetric matrices, equilibrated first so that units do not cost digits; inf where singular."""
    scaled, scales = K, np.ones(K.shape[:-1])
    for _ in range(3):
        largest = np.sqrt(np.abs(scaled).max(axis=-1))
        scales = scales / np.where(largest > 0, largest, 1.0)
        scaled = K * scales[:, :, None] * scales[:, None, :]
    try:
        inverse = np.linalg.inv(scaled)
    except np.linalg.LinAlgError:
        inverse = np.empty_like(scaled)
        for i, matrix in enumerate(scaled):
            try:
                inverse[i] = np.linalg.inv(matrix)
            except np.linalg.LinAlgError:
                inverse[i] = np.inf
    return inverse * scales[:, :, None] * scales[:, None, :]
