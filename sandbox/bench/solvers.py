"""Bare loops over QP solvers, each through the fastest of its own documented Python interfaces, with its own settings."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np

from sandbox.bench.closed_forms import Prepared, machine
from sandbox.bench.measured import Measured, each, ratio
from sandbox.bench.race import Effort, one_core, race
from sandbox.bench.stack import Stack, stack
from sandbox.errors import SandboxError

Array = np.ndarray

AGREE = 1e-3
"""Largest difference to eq. (6) relative to the largest entry, up to which an answer counts: engines stop at 1e-5 or so."""

Loop = Callable[[], None]


def daqp(given: Stack, X: Array) -> Loop:
    """daqp.solve: its equality sense is 5."""
    from daqp import solve

    rows = list(zip(given.W, given.a, given.J, given.xdot, strict=True))
    sense = np.full(given.J.shape[1], 5, dtype=np.int32)

    def run() -> None:
        for i, (H, f, A, b) in enumerate(rows):
            X[i] = solve(H, f, A, b, b, sense)[0]

    return run


def daqp_update(given: Stack, X: Array) -> Loop:
    """daqp.Model: set up once, then updated."""
    from daqp import Model

    rows = list(zip(given.W, given.a, given.J, given.xdot, strict=True))
    sense = np.full(given.J.shape[1], 5, dtype=np.int32)
    model = Model()
    H, f, A, b = rows[0]
    model.setup(H, f, A, b, b, sense)

    def run() -> None:
        for i, (H, f, A, b) in enumerate(rows):
            model.update(H, f, A, b, b, sense)
            X[i] = model.solve()[0]

    return run


def quadprog(given: Stack, X: Array) -> Loop:
    """quadprog.solve_qp: minimise x'Gx/2 - a'x, the first rows of C'x >= b being equalities."""
    from quadprog import solve_qp

    columns = np.ascontiguousarray(given.J.transpose(0, 2, 1))
    rows = list(zip(given.W, -given.a, columns, given.xdot, strict=True))
    m = given.J.shape[1]

    def run() -> None:
        for i, (G, a, C, b) in enumerate(rows):
            X[i] = solve_qp(G, a, C, b, m)[0]

    return run


def piqp(given: Stack, X: Array) -> Loop:
    """piqp.DenseSolver: set up once, then updated; it takes columns."""
    from piqp import DenseSolver

    columns = [(np.asfortranarray(H), c, np.asfortranarray(A), b) for H, c, A, b in _rows(given)]
    solver = DenseSolver()
    solver.setup(*columns[0])

    def run() -> None:
        for i, (H, c, A, b) in enumerate(columns):
            solver.update(P=H, c=c, A=A, b=b)
            solver.solve()
            X[i] = solver.result.x

    return run


def proxqp(given: Stack, X: Array) -> Loop:
    """proxsuite.proxqp.dense.QP: initialised once, then updated."""
    from proxsuite import proxqp as library

    rows = _rows(given)
    qp = library.dense.QP(given.J.shape[2], given.J.shape[1], 0)
    qp.init(*rows[0])

    def run() -> None:
        for i, (H, g, A, b) in enumerate(rows):
            qp.update(H=H, g=g, A=A, b=b)
            qp.solve()
            X[i] = qp.results.x

    return run


def _rows(given: Stack) -> list[tuple[Any, ...]]:
    return list(zip(given.W, given.a, given.J, given.xdot, strict=True))


LOOPS: dict[str, tuple[str, Callable[[Stack, Array], Loop]]] = {
    "daqp.solve": ("daqp", daqp), "daqp.Model": ("daqp", daqp_update), "quadprog.solve_qp": ("quadprog", quadprog),
    "piqp.DenseSolver": ("piqp", piqp), "proxqp.dense": ("proxsuite", proxqp),
}  # fmt: skip
"""Interface -> the module that it needs, and what makes its loop."""


def against_solvers(effort: Effort) -> Measured:
    """Times by which the fastest of LOOPS takes longer than eq. (6) with multipliers; those not installed are named.

    Raises SandboxError where none is installed, or one that is does not find the minimum: its time would mean nothing.
    """
    given = stack(6, 7, effort.problems(8192))
    B, _, n = given.J.shape
    eq6 = Prepared(machine("eq6", 6, 7), given)
    loops: dict[str, Loop] = {}
    answers: dict[str, Array] = {}
    beside: dict[str, float | str] = {}
    for name, (module, make) in LOOPS.items():
        try:
            import_module(module)
        except ImportError:
            beside[name] = f"absent: pip install {module}"
            continue
        answers[name] = np.full((B, n), np.nan)
        loops[name] = make(given, answers[name])
    if not loops:
        raise SandboxError(
            f"no QP solver is installed: pip install {' '.join(dict.fromkeys(one for one, _ in LOOPS.values()))}"
        )
    with one_core():
        times = race({"eq6": eq6, **loops}, effort.rounds)
    x = eq6.outputs[0]
    for name, found in answers.items():
        off = float(np.abs(found - x).max() / np.abs(x).max())
        if not off <= AGREE:
            raise SandboxError(f"{name} is off by {off:.1e} of the largest entry: its time would mean nothing")
    fastest = min(loops, key=lambda name: times[name].min())
    beside |= {f"{name} us": each(seconds, B).value for name, seconds in times.items()}
    return ratio(times[fastest], times["eq6"]).with_({"fastest": fastest, **beside, "problems": B})
