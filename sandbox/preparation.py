"""What is known of a group before a solver runs: exact truths, yardsticks, and the QPs posed from it."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from multiprocessing import get_context

import numpy as np
from pebble import ProcessPool

from sandbox.formulation import FORMULATIONS, Posing
from sandbox.problem import VelocityProblem
from sandbox.problem_set import Group, ProblemSet
from sandbox.reference.posed import PosedTruth, posed_truth
from sandbox.reference.truth import Truth, truth
from sandbox.spectrum import numerical_rank
from sandbox.stacked import eigenvalues, times
from sandbox.tolerances import CONDITION_SEVEN, DAMPING, UNIT
from sandbox.verdict import EXPECTED
from sandbox.yardstick import Yardstick

Array = np.ndarray

CHUNK = 32
"""Problems per task of the exact arithmetic."""


@dataclass(frozen=True, eq=False)
class Work:
    """One group with everything that is known of it before a solver runs.

    ids, first : content hashes; position of its first member in the set
    yardsticks : by task; posings : by formulation
    """

    set_name: str
    group: Group
    ids: list[str]
    first: int
    truths: dict[str, list[Truth]]
    yardsticks: dict[str, Yardstick]
    posings: dict[str, PosedWork]


@dataclass(frozen=True, eq=False)
class PosedWork:
    """A posed group: the QPs, their class, and what posing them in floats cost.

    curvature (B,) 0 positive definite, 1 semidefinite, 2 indefinite; full_rank (B,) of the rows;
    refused (B,) by the formulation itself;
    posing_error (B,) relative, NaN where there is nothing to compare; differs (B,) the posed QP has another class
    """

    posing: Posing
    curvature: Array
    full_rank: Array
    posing_error: Array
    differs: Array
    refused: Array


@dataclass(frozen=True, eq=False)
class Chunk:
    """Problems for the exact arithmetic: their tasks, and the formulations whose posing is to be checked."""

    problem: VelocityProblem
    tasks: tuple[str, ...]
    formulations: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Reference:
    """What the exact arithmetic said of a chunk."""

    truths: dict[str, list[Truth]]
    posed: dict[str, PosedTruth]


def reference(chunk: Chunk) -> Reference:
    """Truths by task and posed truths by formulation; runs in a process of its own."""
    truths: dict[str, list[Truth]] = {}
    for task in chunk.tasks:
        found = truth(chunk.problem, task, damping=DAMPING)
        # the rationals stay here: only their rounded values travel
        truths[task] = [replace(t, _x=None, _y=None, _value=None) for t in found]  # type: ignore[union-attr]
    return Reference(truths, {name: posed_truth(chunk.problem, FORMULATIONS[name]) for name in chunk.formulations})


def _posed_work(
    problem: VelocityProblem, formulation: str, yardstick: Yardstick, expected: list[str | None], qdot: Array
) -> PosedWork:
    """Pose a group and measure what was posed."""
    posing = FORMULATIONS[formulation].pose(problem)
    B = len(problem)
    curvature, full_rank = np.zeros(B, np.int8), np.ones(B, bool)
    for posed in posing.parts:
        if posed.qp.n:
            spectrum = eigenvalues(posed.qp.H)
            rounding = CONDITION_SEVEN * posed.qp.n * 2 * UNIT * np.abs(spectrum).max(axis=-1)
            smallest = spectrum[:, 0]
            curvature[posed.index] = np.where(smallest > rounding, 0, np.where(smallest >= -rounding, 1, 2))
        if posed.qp.p:
            sigma = np.linalg.svd(posed.qp.A, compute_uv=False)
            full_rank[posed.index] = numerical_rank(sigma, posed.qp.p, posed.qp.n) == posed.qp.p
    offset = qdot - yardstick.x
    offset = offset - times(yardstick.freedom, offset)
    size = np.where(yardstick.size > 0, yardstick.size, 1.0)
    differs = np.array(
        [e is not None and EXPECTED.index(e) != yardstick.expected[i] for i, e in enumerate(expected)], dtype=bool
    )
    refused = np.isin(np.arange(B), list(posing.refused))
    return PosedWork(posing, curvature, full_rank, np.abs(offset).max(axis=-1) / size, differs, refused)


def prepare(
    sets: Sequence[ProblemSet], formulations: Sequence[str], jobs: int, progress: Callable[[int, int], None]
) -> list[Work]:
    """Truths, yardsticks and posed QPs of every group of `sets`; exact arithmetic in `jobs` processes.

    progress : told (problems done, total)
    """
    places = [(problem_set.name, group) for problem_set in sets for group in problem_set.groups]
    chunks = [chunk for _, group in places for chunk in _chunks(group, formulations)]
    total, done = sum(len(chunk.problem) for chunk in chunks), 0
    results = []
    for chunk, result in zip(chunks, _references(chunks, jobs), strict=True):
        results.append(result)
        done += len(chunk.problem)
        progress(done, total)
    works, following = [], iter(results)
    first: dict[str, int] = {}
    for set_name, group in places:
        parts = [next(following) for _ in range(0, len(group), CHUNK)]
        works.append(_work(set_name, group, first.get(set_name, 0), parts))
        first[set_name] = first.get(set_name, 0) + len(group)
    return works


def _chunks(group: Group, formulations: Sequence[str]) -> Iterator[Chunk]:
    fitting = tuple(name for name in formulations if FORMULATIONS[name].task in group.tasks)
    for start in range(0, len(group), CHUNK):
        yield Chunk(group.problem[start : start + CHUNK], group.tasks, fitting)


def _references(chunks: list[Chunk], jobs: int) -> Iterator[Reference]:
    if jobs == 1 or len(chunks) < 2 * jobs:
        yield from map(reference, chunks)
        return
    # blocked while the pool starts: its threads and processes inherit that, and Ctrl-C is this process's business alone
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        pool = ProcessPool(max_workers=jobs, context=get_context("spawn"))
        results = pool.map(reference, chunks).result()
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    with pool:
        try:
            yield from results
        except BaseException:
            pool.stop()
            raise


def _work(set_name: str, group: Group, first: int, parts: list[Reference]) -> Work:
    truths = {task: [t for part in parts for t in part.truths[task]] for task in group.tasks}
    yardsticks = {task: Yardstick.of(group.problem, task, truths[task]) for task in group.tasks}
    posings = {}
    for name in parts[0].posed:
        expected = [e for part in parts for e in part.posed[name].expected]
        qdot = np.concatenate([part.posed[name].qdot for part in parts])
        posings[name] = _posed_work(group.problem, name, yardsticks[FORMULATIONS[name].task], expected, qdot)
    return Work(set_name, group, group.ids(), first, truths, yardsticks, posings)
