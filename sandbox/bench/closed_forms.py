"""Eq. (6) and eqs. (2)-(5) on stacks: against moving the same bytes, LAPACK on the KKT systems, and each other."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from sandbox.bench.measured import Measured, each, ratio
from sandbox.bench.race import Effort, one_core, race
from sandbox.bench.stack import Stack, stack
from sandbox.closed_form.solve import solve
from sandbox.closed_form.uncompiled import Counted, Operations, eq6_on, operations
from sandbox.closed_form.vectorised import eq2_5_machine, eq6_machine
from sandbox.lanes import Machine

Array = np.ndarray

BEYOND_CACHE = 3
"""Times the largest cache that the buffers of a copy hold."""

LEAST, MOST = 128 * 2**20, 2**30
"""Bytes of those buffers: no smaller than a usual cache, no larger than a usual machine has to spare."""


IN_CACHE = 512
"""Problems that fit in a core's own cache with their answers."""

AGAIN = 32
"""Times that they are solved in a round."""


class Prepared:
    """A machine with touched inputs and outputs; called, it solves the stack."""

    def __init__(self, machine: Machine, given: Stack) -> None:
        self.machine, inputs = machine, given.flat(machine.bits)
        B, number = len(inputs[0]), inputs[0].dtype
        self.outputs = [np.ones((B, size), number) for size in machine.sizes[machine.given :]]
        self.arguments = (*inputs, *self.outputs)

    def __call__(self, threads: int = 1) -> None:
        """Solve all."""
        self.machine(*self.arguments, threads=threads)


def machine(method: str, m: int, n: int, bits: int = 64, judged: bool = False) -> Machine:
    """Of eq6 or eq2_5, with a general W; `judged`: pivots and the bounds of their roundings come out too."""
    return eq6_machine(m, n, 0, True, bits, judged) if method == "eq6" else eq2_5_machine(m, n, True, bits)


def against_copy(method: str, n: int, m: int, judged: bool = False) -> Callable[[Effort], Measured]:
    """Times np.copyto of as many bytes as the inputs and outputs have, read once and written once."""

    def measure(effort: Effort) -> Measured:
        size = sum(machine(method, m, n, judged=judged).sizes)
        B = effort.problems(int(np.clip(BEYOND_CACHE * (largest_cache() or 0), LEAST, MOST)) // (8 * size))
        given = stack(m, n, B)
        with one_core():
            times = _with_copy(Prepared(machine(method, m, n, 64, judged), given), effort.rounds)
            single = _with_copy(Prepared(machine(method, m, n, 32, judged), given), effort.rounds)
        every = Prepared(machine(method, m, n, 64, judged), given)
        cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        whole = race({"all": lambda: every(threads=cores)}, effort.rounds, wall=True)["all"]
        return ratio(times["solve"], times["copy"]).with_({
            "us per problem": each(times["solve"], B).value,
            "copy GB/s": 8 * size * B / float(times["copy"].min()) / 1e9,
            "float32": ratio(single["solve"], single["copy"]).value,
            "float32 us": each(single["solve"], B).value,
            f"us on {cores} cores": each(whole, B).value,
            "problems": B,
        })  # fmt: skip

    return measure


def _with_copy(solve_all: Prepared, rounds: int) -> dict[str, Array]:
    source = np.ones(sum(values.size for values in solve_all.arguments), solve_all.arguments[0].dtype)
    target = np.ones_like(source)
    return race({"solve": solve_all, "copy": lambda: np.copyto(target, source)}, rounds)


def against_kkt(effort: Effort) -> Measured:
    """Times by which numpy.linalg.solve on assembled KKT systems takes longer; the assembling is not timed."""
    given = stack(6, 7, effort.problems(16384))
    K, right = given.kkt()
    run = Prepared(machine("eq6", 6, 7), given)
    with one_core():
        times = race({"lapack": lambda: np.linalg.solve(K, right), "eq6": run}, effort.rounds)
    return ratio(times["lapack"], times["eq6"]).with_(
        {f"{name} us": each(seconds, len(K)).value for name, seconds in times.items()}
    )


def against_each_other(n: int, m: int) -> Callable[[Effort], Measured]:
    """Time of eq. (6) by time of eqs. (2)-(5) in cache, beside the ratio of their operations, counted by running them.

    Table I counts eq. (6) without the multipliers, which the machine computes; so the ratio with them stands there too.
    """

    def measure(effort: Effort) -> Measured:
        given = stack(m, n, min(IN_CACHE, effort.problems(IN_CACHE)))
        runs = {name: Prepared(machine(name, m, n), given) for name in ("eq6", "eq2_5")}

        def again(run: Prepared) -> None:
            for _ in range(AGAIN):
                run()

        with one_core():
            times = race({name: partial(again, run) for name, run in runs.items()}, effort.rounds)
        counted = {name: operations(name, n, m, weighted=True) for name in runs}
        totals = {name: count.multiplications + count.additions for name, count in counted.items()}
        return ratio(times["eq6"], times["eq2_5"]).with_({
            "Table I": totals["eq6"] / totals["eq2_5"],
            "with multipliers": (totals["eq6"] + _multiplying(given)) / totals["eq2_5"],
            **{f"{name} operations": total for name, total in totals.items()},
            **{f"{name} us": each(seconds, AGAIN * len(given.J)).value for name, seconds in times.items()},
        })  # fmt: skip

    return measure


def _multiplying(given: Stack) -> int:
    """Operations that the multipliers of eq. (6) take."""
    totals = []
    for multipliers in (True, False):
        total = Operations()
        number = partial(Counted, operations=total)
        eq6_on(number, given.J[0], given.xdot[0], given.W[0], given.a[0], 1.0, multipliers=multipliers)
        totals.append(total.multiplications + total.additions)
    return totals[0] - totals[1]


def whole_solve(effort: Effort) -> Measured:
    """sandbox.solve on a stack: statuses, words and refusals included."""
    problem = stack(6, 7, effort.problems(65536)).problem
    with one_core():
        times = race({"eq6": lambda: solve(problem), "eq2_5": lambda: solve(problem, "eq2_5")}, effort.rounds)
    return each(times["eq6"], len(problem)).with_({"eq2_5 us": each(times["eq2_5"], len(problem)).value})


def largest_cache() -> int | None:
    """Bytes of the largest cache of the first core, None where the system does not tell."""
    found = []
    for place in Path("/sys/devices/system/cpu/cpu0/cache").glob("index*/size"):
        text = place.read_text().strip()
        unit = {"K": 2**10, "M": 2**20, "G": 2**30}.get(text[-1:])
        if unit and text[:-1].isdigit():
            found.append(int(text[:-1]) * unit)
    return max(found, default=None)
