"""convexified and augmented_lagrangian: W made positive definite without moving minimiser or multipliers.

By Finsler's lemma condition (7) holds exactly if W + c J'J > 0 for some c. On the constraint the added term is
constant, and its gradient vanishes, so x and y stay.
"""

from __future__ import annotations

import numpy as np

from sandbox.formulation.direct import recover
from sandbox.formulation.formulation import Formulation, Posed, Posing
from sandbox.problem import VelocityProblem
from sandbox.qp import QP
from sandbox.solution import Status
from sandbox.spectrum import Spectrum, reduced_weight, smallest_eigenvalue, spectral_norm
from sandbox.stacked import solve, symmetric, times, transpose
from sandbox.tolerances import CONDITION_SEVEN, CONVEXITY_SHARE, UNIT

Array = np.ndarray


def build_convexified(problem: VelocityProblem) -> Posing:
    """H = W + c VV', g = a - c V(V'q_p), V an orthonormal basis of range J', q_p = J^+ xdot.

    c = max(0, -2 lambda_min(S_V)) plus a share of |W|_2, S_V = V'WV - V'WN (N'WN)^-1 N'WV.
    """
    return _build(problem, unit=True)


def build_augmented(problem: VelocityProblem) -> Posing:
    """H = W + c J'J, g = a - c J'xdot, as textbooks write it; c from S = Y'WY - Y'WN (N'WN)^-1 N'WY, Y = J^+.

    The same answer in exact arithmetic; c and with it the condition of H grow as 1/sigma_min(J)^2.
    """
    return _build(problem, unit=False)


def _build(problem: VelocityProblem, *, unit: bool) -> Posing:
    """Both, over Y = V (unit) or Y = J^+ restricted to range J: W + c Y^+' Y^+ with Y^+ = V' or J."""
    spectrum = Spectrum.of(problem)
    dense = problem.W.dense()
    size = spectral_norm(dense)
    parts: list[Posed] = []
    refused: dict[int, tuple[Status, str]] = {}
    for r, members in spectrum.by_rank():
        part, W = problem[members], dense[members]
        V, N = spectrum.range_basis(r, members), spectrum.null_basis(r, members)
        S_N = reduced_weight(part, N)
        smallest = smallest_eigenvalue(S_N)
        holds = smallest > CONDITION_SEVEN * problem.n * (problem.n - r) * 2 * UNIT * size[members]
        for i, value in zip(members[~holds], smallest[~holds], strict=True):
            words = f"condition (7) fails: the smallest eigenvalue of N'WN is {value:.6g}, no c makes W + cJ'J definite"
            refused[int(i)] = (Status.CONDITION_SEVEN, words)
        keep = np.flatnonzero(holds)
        if not len(keep):
            continue
        part, W, V, N, S_N = part[keep], W[keep], V[keep], N[keep], S_N[keep]
        sigma = np.ones((len(keep), r)) if unit else spectrum.sigma[members[keep], :r]
        Y = V / sigma[:, None, :]
        YW = part.W.left(Y)
        S = symmetric(YW @ Y - (YW @ N) @ solve(S_N, transpose(YW @ N)))
        largest = sigma[:, 0] if r else np.ones(len(keep))
        c = np.maximum(0, -2 * smallest_eigenvalue(S)) if r else np.zeros(len(keep))
        c = c + CONVEXITY_SHARE * size[members[keep]] / largest**2
        if unit:
            q_p = spectrum.solve(r, members[keep], part.xdot)
            H = W + c[:, None, None] * (V @ transpose(V))
            g = part.a - c[:, None] * times(V, times(transpose(V), q_p))
        else:
            H = W + c[:, None, None] * (transpose(part.J) @ part.J)
            g = part.a - c[:, None] * times(transpose(part.J), part.xdot)
        parts.append(Posed(members[keep], QP(symmetric(H), g, part.J, part.xdot)))
    return Posing(parts, refused)


CONVEXIFIED = Formulation(
    "convexified", "exact", "H = W + cVV', V an orthonormal basis of range J': same x and y", build_convexified, recover
)
AUGMENTED_LAGRANGIAN = Formulation(
    "augmented_lagrangian", "exact", "H = W + cJ'J, g = a - cJ'xdot: same x and y, worse conditioned", build_augmented, recover
)
