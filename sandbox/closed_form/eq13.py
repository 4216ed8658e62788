"""Eq. (13): the least-squares sense, for Jacobians of any rank."""

from __future__ import annotations

import numpy as np

from sandbox.closed_form.bounds import SIX, framework
from sandbox.closed_form.form import CONDITION_SEVEN_HOLDS, ClosedForm, Ledger, numbers
from sandbox.closed_form.geometry import Geometry, gradient, norm, null_rounding, weight_size
from sandbox.closed_form.linear import equilibrated
from sandbox.problem import VelocityProblem
from sandbox.solution import Solution, Status
from sandbox.stacked import eigenvalues, solve, symmetric, times, transpose
from sandbox.task import task_weight
from sandbox.tolerances import CONDITION_SEVEN, FORWARD, RANK, RANK_GAP, UNIT

Array = np.ndarray


@np.errstate(all="ignore")
def eq13(problem: VelocityProblem, *, rank_tolerance: float | None = None) -> Solution:
    """Solve [R'J'Wx J; N'W] qdot = [R'J'Wx xdot; -N'a], R = V_r T^-1 (J = Q T V_r', Q orthonormal), N the whole
    null space.

    Rows of J are scaled to one first (Wx, xdot and y with them). A singular value counts as zero up to `rank_tolerance`
    (default 16 max(m, n) u) times the largest; what remains must stand 1000 times above what was dropped.
    Refuses unless (JR)'Wx(JR) > 0 (TARGET_UNBOUNDED) and N'WN > 0 (CONDITION_SEVEN). y is in Wx range(J).
    Source: eq. (13), English & Maciejewski; methods 6.
    """
    B, m, n = len(problem), problem.m, problem.n
    ledger = Ledger(problem)
    x, y = np.full((B, n), np.nan), np.full((B, m), np.nan)
    geometry = Geometry.of(problem)
    ledger.show(geometry)
    rank, ambiguous = declared_rank(geometry, rank_tolerance)
    ledger.refuse(ambiguous, Status.RANK_AMBIGUOUS, lambda i: (
        f"the singular values of J, {numbers(ledger.evidence['singular_values'][i])}, show no gap of {RANK_GAP:g}: no rank"
    ))  # fmt: skip
    for r in np.unique(rank[ledger.open]):
        members = np.flatnonzero(ledger.open & (rank == r))
        bucket = Bucket(geometry[members], int(r))
        decide(ledger, members, bucket)
        keep = ledger.open[members]
        if keep.any():
            x[members[keep]], y[members[keep]] = Bucket(geometry[members[keep]], int(r)).solve()
    return ledger.solution(x, y)


def declared_rank(geometry: Geometry, rank_tolerance: float | None) -> tuple[Array, Array]:
    """(rank, whether it is ambiguous) of every member, from the singular values of the equilibrated J."""
    m, n = geometry.problem.m, geometry.problem.n
    sigma = geometry.sigma
    floor = max(m, n) * UNIT
    share = RANK * floor if rank_tolerance is None else rank_tolerance
    rank = (sigma > share * sigma[:, :1]).sum(axis=1)
    padded = np.concatenate([sigma[:, :1], sigma, np.zeros((len(sigma), 1))], axis=1)
    last = np.take_along_axis(padded, rank[:, None], axis=1)[:, 0]
    dropped = np.take_along_axis(padded, rank[:, None] + 1, axis=1)[:, 0]
    ambiguous = (rank > 0) & ~(last > RANK_GAP * np.maximum(dropped, floor * sigma[:, 0]))
    return rank, ambiguous | ~np.isfinite(sigma).all(axis=1)


class Bucket:
    """Members of one rank r: eq. (13) in rows scaled to one.

    J = diag(scale) U_r Sigma V_r' = Q T V_r', Q (b, m, r) an orthonormal basis of range J in the rows as given, so
    R = V_r T^-1 and (JR)'Wx(JR) = P = Q'Wx Q is as well conditioned as Wx. At full row rank Wx has no effect once it is
    positive definite, and the rows are those of J (methods 6.2).
    """

    def __init__(self, geometry: Geometry, r: int) -> None:
        problem = geometry.problem
        self.problem, self.geometry, self.r, self.scale = problem, geometry, r, geometry.scale
        self.N, self.Vr, self.sigma = geometry.V[:, :, r:], geometry.V[:, :, :r], geometry.sigma[:, :r]
        Q, T = np.linalg.qr(geometry.U[:, :, :r] * self.scale[:, :, None])
        self.WxQ = task_weight(problem) @ Q
        self.P = symmetric(transpose(Q) @ self.WxQ)
        self.P_size = norm(task_weight(problem))
        self.T = T * self.sigma[:, None, :]
        self.spread = norm(T) * norm(solve(T, np.broadcast_to(np.eye(r), T.shape)))  # how unequal rows tilt range J
        self.S = symmetric(problem.W.left(self.N) @ self.N)

    @property
    def top(self) -> Array:
        """R'J'Wx J, or J itself, rows scaled to one, at full row rank."""
        if self.r == self.problem.m:
            return self.problem.J / self.scale[:, :, None]
        return self.P @ self.T @ transpose(self.Vr)

    @property
    def top_size(self) -> Array:
        """What each row of `top` is a sum of (b, r)."""
        if self.r == self.problem.m:
            return np.linalg.norm(self.top, axis=2)
        return np.broadcast_to((self.P_size * norm(self.T))[:, None], self.sigma.shape)

    def solve(self) -> tuple[Array, Array]:
        """(x, y); W x + a + J'y = 0 on range J', y = Wx Q c."""
        problem, r = self.problem, self.r
        full = r == problem.m
        target = problem.xdot / self.scale if full else times(transpose(self.WxQ), problem.xdot)
        right = np.concatenate([target, -times(transpose(self.N), problem.a)], axis=1)
        A, b = equilibrated(np.concatenate([self.top, problem.W.left(self.N)], axis=1), right)
        x = solve(A, b[:, :, None])[:, :, 0]
        if not r:
            return x, np.zeros((len(x), problem.m))
        g = gradient(problem, x)
        if full:
            return x, -self.geometry.range_solve(g)
        inner = solve(transpose(self.T), transpose(self.Vr) @ g[:, :, None])
        return x, -(self.WxQ @ solve(self.P, inner))[:, :, 0]


def decide(ledger: Ledger, members: Array, bucket: Bucket) -> None:
    """Refuse what eq. (13) must not answer (methods 6.1): the target first, then condition (7)."""
    problem, r = bucket.problem, bucket.r
    n, m = problem.n, problem.m
    everyone = np.zeros((2, len(ledger.codes)), dtype=bool)
    if r:
        lowest = eigenvalues(bucket.P)[:, 0]
        everyone[0, members] = ~(lowest > CONDITION_SEVEN * r * m * 2 * UNIT * bucket.P_size)
        values = dict(zip(members.tolist(), lowest.tolist(), strict=True))
        ledger.refuse(everyone[0], Status.TARGET_UNBOUNDED, lambda i: (
            f"Wx is not positive definite on range J: the smallest eigenvalue of (JR)'Wx(JR) is {values[i]:.6g}, so the "
            "least-squares target has no minimum or more minima than null J explains"
        ))  # fmt: skip
    if r < n:
        curvature = eigenvalues(bucket.S)
        threshold = CONDITION_SEVEN * (n - r) * n * 2 * UNIT * weight_size(problem, bucket.N)
        ledger.evidence["lambda_min_reduced"][members] = curvature[:, 0]
        ledger.evidence["lambda_max_reduced"][members] = curvature[:, -1]
        ledger.threshold[members] = threshold
        rounding = null_rounding(problem, bucket.Vr, bucket.N, bucket.sigma)
        size = np.abs(curvature[:, 0])
        everyone[1, members] = (size > threshold) & (size <= threshold + rounding)
        ledger.refuse(everyone[1], Status.ILL_CONDITIONED, ledger.unsure_words)
        everyone[1, members] = ~(curvature[:, 0] > threshold)
        ledger.refuse(everyone[1], Status.CONDITION_SEVEN, ledger.curvature_words)


@np.errstate(all="ignore")
def bound(problem: VelocityProblem, *, rank_tolerance: float | None = None) -> Array:
    """That of eq. (6) with the rows of eq. (13), plus what a residual adds (B,); inf where eq. (13) refuses.

    Range J, in the rows as given, is known to u cond(J) alone, and the target moves by that share of the residual.
    """
    geometry = Geometry.of(problem)
    ledger = Ledger(problem)
    rank, ambiguous = declared_rank(geometry, rank_tolerance)
    out = np.full(len(problem), np.inf)
    for r in np.unique(rank[~ambiguous]):
        members = np.flatnonzero(~ambiguous & (rank == r))
        bucket = Bucket(geometry[members], int(r))
        decide(ledger, members, bucket)
        part, sigma = bucket.problem, bucket.sigma
        x = bucket.solve()[0]
        turn = sigma[:, 0] / sigma[:, -1] if r else np.zeros(len(members))
        kappa = framework(part, bucket.top, bucket.top_size, bucket.Vr, bucket.N, turn)
        if 0 < r < problem.m:
            residual = np.linalg.norm(part.xdot - times(part.J, x), axis=1)
            inverse = solve(bucket.T, np.broadcast_to(np.eye(r), bucket.T.shape))
            gain = bucket.P_size / eigenvalues(bucket.P)[:, 0] * turn * bucket.spread * norm(inverse)
            kappa = kappa + np.where(residual > 0, gain * residual / np.linalg.norm(x, axis=1), 0.0)
        out[members] = FORWARD * problem.n * UNIT * kappa
    return np.where(ledger.open & np.isfinite(out), out, np.inf)


EQ13 = ClosedForm(
    name="eq13", task="least_squares", domain=CONDITION_SEVEN_HOLDS + ", Wx > 0 on range J", function=eq13, bound=bound,
    bound_text=SIX.replace("[J; N'W]", "[R'J'Wx J; N'W]")
    + "; below full row rank also 50 n u cond(J) cond(Q'Wx Q) |J^+| |xdot - J qdot| / |qdot|, Q a basis of range J",
    about="least-squares sense at any rank of J", source="English & Maciejewski, eq. (13); methods 6",
)  # fmt: skip
