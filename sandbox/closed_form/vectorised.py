"""The kernels side by side: eq. (6) and eqs. (2)-(5) on stacks at the speed of the machine's vectors.

The source is that of `kernels.py`; only the four functions that know where pivoting put a joint are replaced, by
exchanges of columns through masks. Bit for bit what the scalar kernels compute, wherever these solve the problem; but for
the rounding bounds of pivots in single precision, which numba adds up in double.
"""

from __future__ import annotations

import os
import sys
from functools import cache
from types import FunctionType
from typing import Any

import numpy as np

from sandbox.closed_form import kernels
from sandbox.lanes import Code, Condition, Lane, Machine

Array = np.ndarray

WORTH = 2048
"""Problems in a stack from which machine code for its size is worth compiling (a second, once)."""

LARGEST = 14
"""Joints, and factor rows of a weight, up to which there is machine code: written out in full, it grows with their cube."""


class Exchanges:
    """In place of the list p of joints: for every step of pivoting, the masks of the columns it exchanged."""

    def __init__(self, n: int) -> None:
        self.shape = (n,)
        self.steps: list[tuple[int, dict[int, Condition]]] = []


def start(p: Exchanges) -> None:
    """Nothing exchanged."""
    p.steps.clear()


def pivot(A: Array, p: Exchanges, i: int, m: int) -> bool:
    """As in the kernels: exchange two columns of A[:m] for the largest entry of row i, the first of equals."""
    largest, better = abs(A[i, i]), {}
    for j in range(i + 1, A.shape[1]):
        size = abs(A[i, j])
        better[j] = size > largest
        largest = better[j].choose(size, largest)
    masks: dict[int, Condition] = {}
    later: Any = None  # the last column that was better than all before it is the largest
    for j, condition in reversed(better.items()):
        b = condition.code.builder
        masks[j] = condition if later is None else Condition(condition.code, b.and_(condition.value, b.not_(later)))
        later = condition.value if later is None else b.or_(later, condition.value)
    p.steps.append((i, masks))
    for k in range(m):
        _exchange(A[k], i, masks)
    return bool(largest > 0)


def _exchange(v: Array, i: int, masks: dict[int, Condition]) -> None:
    old = new = v[i]
    for j, mask in masks.items():
        new = mask.choose(v[j], new)
        v[j] = mask.choose(old, v[j])
    v[i] = new


def to_joints(v: Array, p: Exchanges, out: Array) -> None:
    """A vector by position, in the order of the joints."""
    moved = np.array(v, dtype=object)
    for i, masks in reversed(p.steps):
        _exchange(moved, i, masks)
    out[:] = moved


def to_positions(v: Array, p: Exchanges, out: Array) -> None:
    """A vector by joint, in the order of the positions; as many as `out` has."""
    moved = np.array(v, dtype=object)
    for i, masks in p.steps:
        _exchange(moved, i, masks)
    out[:] = moved[: len(out)]


def larger(a: Any, b: Any) -> Any:
    """As max: b where it is more than a."""
    if not isinstance(a, Lane) and not isinstance(b, Lane):
        return max(a, b)
    code = a.code if isinstance(a, Lane) else b.code
    return (Lane(code, code.of(b)) > a).choose(b, a)


@cache
def traced() -> dict[str, Any]:
    """The kernels, seeing each other and the functions above in place of their own."""
    twins = dict(vars(kernels))
    for name, function in vars(kernels).items():
        if isinstance(function, FunctionType):
            twins[name] = FunctionType(function.__code__, twins, name)
    twins |= {"start": start, "pivot": pivot, "to_joints": to_joints, "to_positions": to_positions, "max": larger}
    return twins


def zeros(*shape: int) -> Array:
    """Work space of a trace."""
    return np.full(shape, 0.0, dtype=object)


def identity_below(m: int, n: int) -> Array:
    """N (n, n - m) as the kernels want it."""
    return np.array(np.eye(n, n - m, -m), dtype=object)


def worth(B: int, n: int, E: Array | None = None, *, least: int | None = None) -> bool:
    """Whether a stack of B problems with n joints and factor rows E (..., k, n) is worth machine code of its size."""
    return B >= (WORTH if least is None else least) and max(n, 0 if E is None else E.shape[-2]) <= LARGEST


def threads() -> int:
    """Threads that a stack may take: OMP_NUM_THREADS, or all cores."""
    told = os.environ.get("OMP_NUM_THREADS", "")
    return (
        int(told) if told.isdigit() and int(told) else len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 1
    )


@cache
def eq6_machine(m: int, n: int, k: int, weighted: bool, bits: int, judged: bool) -> Machine:
    """Eq. (6) for J (m, n) and a weight with k factor rows: x, y, whether solved; `judged`: pivots and their roundings too."""
    inputs = [size for size in (m * n, m, n * n if weighted else 0, k * n, k * k, n) if size]

    def write(code: Code) -> None:
        place = iter(range(len(inputs)))
        sizes = (m * n, m, n * n if weighted else 0, k * n, k * k, n)
        J, xdot, W, E, gamma, a = (code.given(next(place)) if size else zeros(0) for size in sizes)
        J, W, E, gamma = J.reshape(m, n), W.reshape((n, n) if weighted else (0, 0)), E.reshape(k, n), gamma.reshape(k, k)
        A, N, p, t, v, x, y = zeros(n, n), identity_below(m, n), Exchanges(n), zeros(2, k), zeros(n), zeros(n), zeros(m)
        run = traced()
        run["eq6"](J, xdot, W, E, gamma, a, 1.0, weighted, A, N, p, zeros(n), t, v, x)
        run["multipliers"](W, E, gamma, a, 1.0, weighted, A, p, t, v, x, y)
        out: list[Any] = [x, y]
        if judged:
            bound, work = zeros(n), [zeros(m, n), zeros(m, m), *(zeros(n) for _ in range(5))]
            run["pivot_roundings"](W, E, gamma, weighted, A, N, p, m, *work, t, bound)
            out += [np.diagonal(A), bound]
        for i, values in enumerate([*out, [code.validity()]]):
            code.keep(len(inputs) + i, values)

    name = f"eq6_{m}x{n}_{k}{'' if weighted else '_identity'}{'_judged' if judged else ''}"
    outputs = [n, m, *([n, n] if judged else []), 1]
    return Machine(name, bits, inputs, outputs, write, [kernels, sys.modules[__name__]])


@cache
def eq2_5_machine(m: int, n: int, weighted: bool, bits: int) -> Machine:
    """Eqs. (2)-(5) for J (m, n): x, y, the least pivot shares of the two Cholesky factors, whether solved."""
    inputs = [size for size in (m * n, m, n * n if weighted else 0, n) if size]

    def write(code: Code) -> None:
        place = iter(range(len(inputs)))
        J, xdot, W, a = (code.given(next(place)) if size else zeros(0) for size in (m * n, m, n * n if weighted else 0, n))
        L, M, x, y = zeros(n, n), zeros(m, m), zeros(n), zeros(m)
        W = W.reshape((n, n) if weighted else (0, 0))
        traced()["eq2_5"](J.reshape(m, n), xdot, W, a, 1.0, weighted, L, zeros(m, n), zeros(n), M, x, y)
        out: list[Any] = [
            x,
            [-entry for entry in y],
            [_pivot_share(L) if weighted else 1.0, _pivot_share(M)],
            [code.validity()],
        ]
        for i, values in enumerate(out):
            code.keep(len(inputs) + i, values)

    return Machine(
        f"eq2_5_{m}x{n}{'' if weighted else '_identity'}", bits, inputs, [n, m, 2, 1], write, [kernels, sys.modules[__name__]]
    )


def _pivot_share(L: Array) -> Any:
    """The least pivot of a Cholesky factor as a share of its diagonal entry, as in linear.py."""
    least = None
    for i in range(len(L)):
        share = L[i, i] * L[i, i] / sum(L[i, j] * L[i, j] for j in range(i + 1))
        least = share if least is None else -larger(-share, -least)
    return least
