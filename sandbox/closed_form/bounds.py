"""Relative forward error bounds of the closed forms, with the matrices they measure; inf outside a form's domain.

Relative to max(|qdot|_inf, s), s the largest entry of |X11||a| + |X12||xdot|, X the inverse of the KKT matrix:
what the data can move qdot by.
"""

from __future__ import annotations

import numpy as np

from sandbox.closed_form.geometry import Geometry, norm, positive_definite
from sandbox.closed_form.linear import cholesky
from sandbox.problem import VelocityProblem
from sandbox.stacked import eigenvalues, solve, svd, symmetric, transpose
from sandbox.tolerances import FORWARD, UNIT

Array = np.ndarray

SIX = (
    "50 n u (cond2 of the row-equilibrated [J; N'W] + cond2(J) |V'W| / lambda_min(N'WN)), "
    "[V N] orthonormal, V spanning range J', rows of J scaled to one"
)
BORDERED = "50 (n + m) u cond2 of [t W, J'; J, 0], rows of J scaled to one and |t W| = sigma_min(J)"
SINGULAR_VALUES = "50 n u cond(J L^-T) cond(L)^2, W = L L'"
NORMAL = "50 n u (cond(J L^-T)^2 + cond(J L^-T) cond(L)^2), W = L L'"


def condition(A: Array) -> Array:
    """2-norm condition number (B,); inf where singular or not finite."""
    sigma = svd(A)[1]
    ratio = sigma[:, 0] / sigma[:, -1]
    return np.where(np.isfinite(ratio), ratio, np.inf)


def framework(problem: VelocityProblem, top: Array, top_size: Array, V: Array, N: Array, turn: Array) -> Array:
    """What rounding is multiplied by in the solution of A x = b, A = [top; N'W]: |A^-1 D|_2 + turn |V'W| / lambda_min(N'WN).

    D (B, n) is what the rows of A are sums of, `top_size` (B, r) above, so that cancellation between base and factors
    counts. `turn` (B,) u is the error of N, which moves N'(W x + a) by that share of V'W x, V (B, n, r) a basis of
    range J'. The condition of A alone does not see V'W: W + 1e8 J'J exceeds it a millionfold.
    """
    NtW = problem.W.left(N)
    terms = np.abs(transpose(N) @ problem.W.base)
    across = norm(problem.W.left(V)) / eigenvalues(symmetric(NtW @ N))[:, 0] if N.shape[-1] else np.zeros(len(problem))
    E, gamma = problem.W.E, problem.W.gamma
    if E is not None and gamma is not None:
        EN = E @ N
        inner = np.abs(transpose(N)) @ np.abs(transpose(E))
        if E.shape[-2] == N.shape[-1] > 0:
            # W = E' Gamma E with as many rows as null J has columns: an error of N'E' only mixes equations E qdot = gbar
            alone: Array = np.equal(norm(problem.W.base), 0)
            inner = np.where(alone[:, None, None], np.abs(transpose(EN)), inner)
            across = np.where(alone, norm(E) / svd(EN)[1][:, -1], across)
        terms = terms + inner @ np.abs(gamma) @ np.abs(E)
    D = np.concatenate([top_size, np.linalg.norm(terms, axis=2)], axis=1)
    sigma = svd(np.concatenate([top, NtW], axis=1) / D[:, :, None])[1]
    kappa = np.maximum(sigma[:, 0], 1) / sigma[:, -1] + np.where(across > 0, turn * across, 0.0)
    return np.where(np.isfinite(kappa), kappa, np.inf)


@np.errstate(all="ignore")
def six(problem: VelocityProblem) -> Array:
    """The bound of eq. (6) (B,)."""
    if problem.n < problem.m:
        return np.full(len(problem), np.inf)
    geometry = Geometry.of(problem)
    J = problem.J / geometry.scale[:, :, None]
    V, turn = geometry.V[:, :, : problem.m], geometry.sigma[:, 0] / geometry.sigma[:, -1]
    bound = FORWARD * problem.n * UNIT * framework(problem, J, np.linalg.norm(J, axis=2), V, geometry.N, turn)
    return np.where(geometry.sound, bound, np.inf)


def growth(problem: VelocityProblem) -> Array:
    """How much larger the terms of W = base + E' Gamma E are than W (B,): the digits that forming W loses."""
    E, gamma = problem.W.E, problem.W.gamma
    if E is None or gamma is None:
        return np.ones(len(problem))
    terms = np.abs(problem.W.base) + np.abs(transpose(E)) @ np.abs(gamma) @ np.abs(E)
    ratio = norm(terms) / norm(problem.W.dense())
    return np.where(ratio >= 1, ratio, np.inf)


def bordered_matrix(geometry: Geometry) -> tuple[Array, Array]:
    """K = [t W, J'; J, 0] with rows of J scaled to one, and t (B,) with |t W| = sigma_min(J): K is then best conditioned."""
    problem = geometry.problem
    B, m, n = len(problem), problem.m, problem.n
    t = geometry.sigma[:, -1] / np.where(geometry.size > 0, geometry.size, 1.0)
    J = problem.J / geometry.scale[:, :, None]
    K = np.zeros((B, n + m, n + m))
    K[:, :n, :n] = t[:, None, None] * problem.W.dense()
    K[:, n:, :n], K[:, :n, n:] = J, transpose(J)
    return K, t


@np.errstate(all="ignore")
def bordered(problem: VelocityProblem) -> Array:
    """The bound of the bordered system (B,)."""
    geometry = Geometry.of(problem)
    bound = FORWARD * (problem.n + problem.m) * UNIT * condition(bordered_matrix(geometry)[0]) * growth(problem)
    return np.where(geometry.sound, bound, np.inf)


@np.errstate(all="ignore")
def normal(problem: VelocityProblem) -> Array:
    """The bound of eqs. (2)-(5) (B,)."""
    geometry = Geometry.of(problem)
    Jh, L2 = normal_conditions(problem.W.dense(), geometry)
    L2 = L2 * growth(problem)
    return np.where(geometry.full_row_rank, FORWARD * problem.n * UNIT * (Jh**2 + Jh * L2), np.inf)


@np.errstate(all="ignore")
def singular_values(problem: VelocityProblem) -> Array:
    """The bound of the weighted pseudoinverse (B,): nothing is squared."""
    geometry = Geometry.of(problem)
    Jh, L2 = normal_conditions(problem.W.dense(), geometry)
    L2 = L2 * growth(problem)
    return np.where(geometry.full_row_rank, FORWARD * problem.n * UNIT * Jh * L2, np.inf)


def normal_conditions(W: Array, geometry: Geometry) -> tuple[Array, Array]:
    """cond(J L^-T), rows of J scaled to one, and cond(L)^2 (B,); inf where W is not positive definite."""
    L, positive = cholesky(W)
    J = geometry.problem.J / geometry.scale[:, :, None]
    Jh = condition(transpose(solve(L, transpose(J))))
    return Jh, np.where(positive & positive_definite(W), condition(W), np.inf)


def shifted_weight(geometry: Geometry) -> tuple[Array, Array]:
    """(W + c J'D^-2 J, c): c = max(0, -2 lambda_min(S)) + |W|, twice what Finsler's lemma asks for and a little more.

    S = Y'WY - Y'WN (N'WN)^-1 N'WY, Y = (D^-1 J)^+ = V Sigma^-1 (up to a rotation, which leaves the eigenvalues).
    """
    problem, m = geometry.problem, geometry.problem.m
    N, Y = geometry.N, geometry.V[:, :, :m] / geometry.sigma[:, None, :]
    YtW = problem.W.left(Y)
    S = YtW @ Y
    if problem.n > m:
        across = YtW @ N
        S = S - across @ solve(symmetric(problem.W.left(N) @ N), transpose(across))
    c = np.maximum(0.0, -2 * eigenvalues(symmetric(S))[:, 0]) + geometry.size
    J = problem.J / geometry.scale[:, :, None]
    return symmetric(problem.W.dense() + c[:, None, None] * (transpose(J) @ J)), c


def shifted_bound(problem: VelocityProblem, W: Array, geometry: Geometry) -> Array:
    """The bound of eqs. (2)-(5) on the shifted weight W (B,)."""
    Jh, L2 = normal_conditions(W, geometry)
    return FORWARD * problem.n * UNIT * (Jh**2 + Jh * L2 * growth(problem))


@np.errstate(all="ignore")
def finsler_bound(problem: VelocityProblem) -> Array:
    """That of eqs. (2)-(5) on the shifted weight (B,); inf where condition (7) fails."""
    if problem.n < problem.m:
        return np.full(len(problem), np.inf)
    geometry = Geometry.of(problem)
    return np.where(geometry.sound, shifted_bound(problem, shifted_weight(geometry)[0], geometry), np.inf)
