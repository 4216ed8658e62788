"""Eq. (6) from N'W and N'a alone: neither W nor grad f is formed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sandbox import check
from sandbox.closed_form.compiled import compiled
from sandbox.closed_form.form import Ledger
from sandbox.closed_form.geometry import Standing, norm
from sandbox.errors import AsymmetricWeightError, RangeError, SandboxError, ShapeError
from sandbox.problem import VelocityProblem
from sandbox.solution import Solution
from sandbox.stacked import eigenvalues, svd, symmetric, transpose
from sandbox.tolerances import CONDITION_SEVEN, FORWARD, NULL_BASIS, RANK, REDUCED_ASYMMETRY, UNIT

Array = np.ndarray

IMPLICIT = (
    "50 n u (cond2 of the row-equilibrated [J; N'W] + cond2(J) cond2(N) size / lambda_min(N'WN)), rows of J and columns of N "
    "scaled to one, N'WN taken in the orthonormal basis"
)
"""The error bound as a formula."""


class NullBasisError(SandboxError, ValueError):
    """The columns of N do not span null J: eq. (6) would solve another problem."""


@np.errstate(all="ignore")
def eq6_implicit(J: Any, xdot: Any, N: Any, NtW: Any, Nta: Any, *, size: Any = None) -> Solution:
    """Solve [J; N'W] qdot = [xdot; -N'a], one problem or a stack; leading axes broadcast.

    Parameters
    ----------
    J : (..., m, n) Jacobian; xdot : (..., m) task velocity
    N : (..., n, n - m), any columns that span null J
    NtW : (..., n - m, n) N'W; Nta : (..., n - m) N'a, a = alpha grad f
    size : (...,) Frobenius norm of W where it is known: what N'W was summed from, and what an error of N is multiplied by.
        N'W does not show what cancelled in it. Without `size` that of N'W itself stands, columns of N scaled to one.

    Returns
    -------
    Solution, its status, reason and evidence (eigenvalues of N'WN per unit of joint rate, singular values of J) per
    member; never raises on rank or curvature. The multipliers y are NaN: they need W along range J', which nobody knows here.

    Raises
    ------
    ShapeError, NonFiniteError, RangeError
        for a field that is none.
    NullBasisError
        where |J_i N_c| > 1e3 eps |J_i||N_c|, or the columns of N are dependent.
    AsymmetricWeightError
        where N'WN is not symmetric beyond rounding: a wrong N'W. With n - m = 1 nothing of the kind can be seen.

    Source: eq. (6) and the end of section III, English & Maciejewski.
    """
    given = _Reduced.of(J, xdot, N, NtW, Nta, size)
    problem, lead = given.problem, given.lead
    B, m, n = len(problem), problem.m, problem.n
    ledger = Ledger(problem)
    ledger.refuse_by(given)
    x = np.full((B, n), np.nan)
    i = np.flatnonzero(ledger.open)
    if i.size:
        rows = np.concatenate([problem.J[i], given.NtW[i]], axis=1)
        b = np.concatenate([problem.xdot[i], -given.Nta[i]], axis=1)
        found, code = np.empty((len(i), n)), np.empty(len(i), dtype=np.int64)
        compiled("eq6_implicit_stack")(rows, b, found, code)
        x[i] = np.where((code == 0)[:, None], found, np.nan)
    flat = ledger.solution(x, np.zeros((B, m)))
    return replace(
        flat, x=flat.x.reshape((*lead, n)), y=np.full((*lead, m), np.nan),
        status=flat.status.reshape(lead) if lead else flat.status[0],
        said=np.array(flat.said, dtype=object).reshape(lead) if lead else flat.said[0],
        evidence={name: values.reshape((*lead, *values.shape[1:])) for name, values in flat.evidence.items()},
    )  # fmt: skip


@np.errstate(all="ignore")
def implicit_bound(J: Any, N: Any, NtW: Any, *, size: Any = None) -> Array:
    """Relative forward error (...,) that eq6_implicit stays within, as bounds.py measures it; inf where it refuses.

    For N'W off by rounding of |N||W|, so `size` is to be given wherever W is larger than N'W shows.
    """
    J = check.matrices(J, "J")
    given = _Reduced.of(J, np.zeros(J.shape[-2]), N, NtW, np.zeros(max(J.shape[-1] - J.shape[-2], 0)), size)
    n, m = given.problem.n, given.problem.m
    bound = np.full(len(given.problem), np.inf)
    i = np.flatnonzero(given.sound)
    if i.size:
        A = np.concatenate([given.Jeq, given.NtW / given.row_size[:, :, None]], axis=1)[i]
        sigma = svd(A)[1]
        kappa = np.maximum(sigma[:, 0], 1) / sigma[:, -1]
        if n > m:
            kappa = kappa + (given.turn * given.size / given.curvature[:, 0])[i]
        bound[i] = FORWARD * n * UNIT * np.where(np.isfinite(kappa), kappa, np.inf)
    return bound.reshape(given.lead)


@dataclass(frozen=True, eq=False)
class _Reduced(Standing):
    """A stack of B problems of which only N'W and N'a are known, columns of N scaled to one, and what decides them.

    problem : J and xdot, with weight zero: nothing reads it
    Jeq (B, m, n) : rows of J scaled to one; size (B,) of W; turn (B,) : error of span N in units of n u
    row_size (B, k) : what the rows N'W were summed from; the others as in Standing
    """

    lead: tuple[int, ...]
    problem: VelocityProblem
    NtW: Array
    Nta: Array
    Jeq: Array
    sigma: Array
    singular_values: Array
    curvature: Array
    size: Array
    row_size: Array
    turn: Array
    threshold: Array
    rounding: Array

    @classmethod
    def of(cls, J: Any, xdot: Any, N: Any, NtW: Any, Nta: Any, size: Any) -> _Reduced:
        """Check at the door, then measure."""
        J = check.matrices(J, "J")
        check.shape(J, ("m", "n"), {}, "J")
        m, n = J.shape[-2:]
        k = max(n - m, 0)
        N, NtW, Nta = (check.real(values, name) for values, name in ((N, "N"), (NtW, "NtW"), (Nta, "Nta")))
        for values, name, letters, want in (
            (N, "N", "n, n - m", (n, k)), (NtW, "NtW", "n - m, n", (k, n)), (Nta, "Nta", "n - m", (k,)),
        ):  # fmt: skip
            if values.shape[max(values.ndim - len(want), 0) :] != want:
                raise ShapeError(f"{name} has shape {values.shape}; it must be (..., {letters}) = (..., {want})", field=name)
        xdot = check.real(xdot, "xdot")
        stacks = {"J": J.shape[:-2], "xdot": xdot.shape[:-1]}
        stacks |= {"N": N.shape[:-2], "NtW": NtW.shape[:-2], "Nta": Nta.shape[:-1]}
        if size is not None:
            size = check.real(size, "size")
            if (size < 0).any():
                raise RangeError("size is a norm of W; it must not be negative", field="size")
            stacks["size"] = size.shape
        lead = check.leading(stacks)
        J = np.broadcast_to(J, (*lead, m, n))
        problem = VelocityProblem(J=J, xdot=xdot, W=np.zeros((n, n))).stacked()
        B = len(problem)
        N, NtW, Nta = (
            np.broadcast_to(v, (*lead, *tail)).reshape(B, *tail) for v, tail in ((N, (n, k)), (NtW, (k, n)), (Nta, (k,)))
        )
        length = np.linalg.norm(N, axis=1)
        whole = np.where(length > 0, length, 1.0)
        N, NtW, Nta = N / whole[:, None, :], NtW / whole[:, :, None], Nta / whole
        row = np.linalg.norm(problem.J, axis=2)
        Jeq = problem.J / np.where(row > 0, row, 1.0)[:, :, None]
        eps = 2 * UNIT
        outside = np.abs(Jeq @ N)
        if (outside > NULL_BASIS * eps).any():
            at = check.first(outside > NULL_BASIS * eps)
            raise NullBasisError(
                f"N is no basis of null J: in member {_place(at[0], lead)} row {at[1]} of J times column {at[2]} of N is "
                f"{outside[at]:.3g} of |J_i||N_c|; take it from closed_form.null_basis, at the same configuration as J",
                index=_place(at[0], lead), value=float(outside[at]),
            )  # fmt: skip
        spread = np.ones(B)
        curvature, across, asymmetry = np.full((B, 0), np.inf), np.zeros(B), np.zeros(B)
        known = norm(NtW) if size is None else np.broadcast_to(size, lead).reshape(B)
        largest = np.maximum(norm(NtW), known)
        if k:
            Q, s, V = _thin(N)
            if not (s[:, -1] > RANK * n * UNIT).all():
                i = int(np.argmin(s[:, -1]))
                raise NullBasisError(
                    f"the {k} columns of N do not span null J: in member {_place(i, lead)} they are dependent, with singular "
                    f"values from {s[i, 0]:.3g} to {s[i, -1]:.3g}",
                    index=_place(i, lead), value=float(s[i, -1]),
                )  # fmt: skip
            S = NtW @ N
            asymmetry = np.abs(S - transpose(S)).max(axis=(1, 2))
            wrong = asymmetry > REDUCED_ASYMMETRY * eps * largest
            if wrong.any():
                i = int(np.flatnonzero(wrong)[0])
                raise AsymmetricWeightError(
                    f"N'WN is not symmetric in member {_place(i, lead)}: its entries differ by {asymmetry[i]:.3g} where N'W is "
                    f"of size {largest[i]:.3g}; either N'W is that of another N, or the W behind it is not symmetric",
                    field="NtW", index=_place(i, lead), value=float(asymmetry[i]),
                )  # fmt: skip
            T = V / s[:, None, :]  # N T = Q
            inner = transpose(T) @ symmetric(S) @ T
            curvature = eigenvalues(symmetric(inner))
            across = norm(transpose(T) @ NtW - inner @ transpose(Q))
            spread = s[:, 0] / s[:, -1]
        singular_values = np.linalg.svd(problem.J, compute_uv=False)
        sigma = np.linalg.svd(Jeq, compute_uv=False)
        # the error of span N: rounding of whatever made it, or what J N shows if that is more
        turn = (sigma[:, 0] + norm(outside) / (n * UNIT)) / sigma[:, -1] * spread
        return cls(
            lead, problem, NtW, Nta, Jeq, sigma, singular_values, curvature, largest,
            row_size=np.maximum(np.linalg.norm(NtW, axis=2), largest[:, None]), turn=turn,
            threshold=CONDITION_SEVEN * k * n * eps * largest * spread**2,
            rounding=2 * np.where(across > 0, across * turn * n * UNIT, 0.0),
        )  # fmt: skip


def _thin(N: Array) -> tuple[Array, Array, Array]:
    """(Q, s, V) of every N (B, n, k) = Q diag(s) V'."""
    Q, s, Vt = np.linalg.svd(N, full_matrices=False)
    return Q, s, transpose(Vt)


def _place(i: int, lead: tuple[int, ...]) -> list[int]:
    return [int(part) for part in np.unravel_index(i, lead)] if lead else []
