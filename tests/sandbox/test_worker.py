"""Solvers crash, hang, shout and lie: each costs its own problem, and the neighbours are answered."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from sandbox.backends import BACKENDS
from sandbox.backends.backend import Backend, Promise, Start, WarmStart
from sandbox.errors import RefusalError, UnknownNameError
from sandbox.qp import QP
from sandbox.solution import STATUSES
from sandbox.worker import Answers, Workers
from tests.fakes import unruly_

SILENT = Promise(None, None, "", "", "")


@pytest.fixture(scope="module")
def workers() -> Iterator[Workers]:
    """Workers that know the unruly backends."""
    rows = {
        name: Backend(
            name, "unruly", engine, "none", "none", SILENT, install="pip install manners", package="tests.fakes",
            start=WarmStart("start"),
        )
        for name, engine in (("unruly", "good"), ("unruly:missing", "missing"), ("unruly:bursts", "bursts"))
    }  # fmt: skip
    BACKENDS.update(rows)
    with Workers() as workers:
        yield workers
    for name in rows:
        del BACKENDS[name]


def stack(*first: float, n: int = 3) -> QP:
    """Problems with H = I, one row, and the given first entries of g."""
    g = np.zeros((len(first), n))
    g[:, 0] = first
    B = len(first)
    return QP(np.broadcast_to(np.eye(n), (B, n, n)), g, np.ones((B, 1, n)), np.ones((B, 1)))


def names(answers: Answers) -> list[str]:
    return [STATUSES[code].name for code in answers.status]


def right(answers: Answers, qp: QP, i: int) -> bool:
    """Whether answer `i` is the projection that this problem asks for."""
    x = -qp.g[i] + (1 + qp.g[i].sum()) / qp.n
    return bool(np.allclose(answers.x[i], x, rtol=0, atol=1e-12))


@pytest.mark.parametrize(
    ("fault", "status", "words"),
    [
        (unruly_.SEGFAULT, "CRASHED", "SIGSEGV"),
        (unruly_.HANG, "TIMED_OUT", "overran 0.5 s"),
        (unruly_.EXIT, "CRASHED", "ended with status 3"),
        (unruly_.RAISE, "FAILED", "out of cheese"),
        (unruly_.EAT, "FAILED", "memory"),
    ],
)
def test_a_fault_costs_one_problem(workers: Workers, fault: float, status: str, words: str) -> None:
    """The problem that fails has its status and reason; the others, before and after, are answered rightly."""
    qp = stack(0.0, 1.0, fault, 2.0, 3.0)
    answers = workers.solve("unruly", qp, time_limit=0.5)
    assert names(answers) == ["SOLVED", "SOLVED", status, "SOLVED", "SOLVED"]
    assert words.lower() in answers.said[2].lower()
    assert all(right(answers, qp, i) for i in (0, 1, 3, 4))
    assert np.isnan(answers.x[2]).all()


def test_several_faults_in_one_stack(workers: Workers) -> None:
    """Each of several failures is found at its own place."""
    qp = stack(unruly_.SEGFAULT, 1.0, unruly_.EXIT, 2.0, unruly_.SEGFAULT)
    answers = workers.solve("unruly", qp, time_limit=0.5)
    assert names(answers) == ["CRASHED", "SOLVED", "CRASHED", "SOLVED", "CRASHED"]
    assert right(answers, qp, 1) and right(answers, qp, 3)


def test_print_out_is_caught_and_shortened(workers: Workers, capfd: pytest.CaptureFixture[str]) -> None:
    """What a solver prints to its descriptors is kept with its own problem, shortened, and shown to nobody else."""
    answers = workers.solve("unruly", stack(unruly_.SHOUT, 0.0), time_limit=5)
    assert answers.said[0].startswith("solved | banner") and answers.said[0].endswith("the end")
    assert len(answers.said[0]) < 2000 and answers.said[1] == "solved"
    assert capfd.readouterr() == ("", "")


def test_garbage_is_kept_as_given(workers: Workers) -> None:
    """NaN claimed as a solution stays SOLVED: the verdict, not the worker, calls it false. A short answer is none."""
    answers = workers.solve("unruly", stack(unruly_.GARBAGE, unruly_.SHORT), time_limit=5)
    assert names(answers) == ["SOLVED", "SOLVED"]
    assert np.isnan(answers.x).all()


def test_lies_about_types_cost_nothing_else(workers: Workers) -> None:
    """Text for numbers, complex multipliers, absurd counts and broken text are kept as nothing, and can be stored."""
    answers = workers.solve("unruly", stack(unruly_.LIE, 0.0), time_limit=5)
    assert names(answers) == ["SOLVED", "SOLVED"]
    assert np.isnan(answers.x[0]).all() and np.isnan(answers.y[0]).all() and answers.iterations[0] is None
    assert answers.said[0].encode("utf-8")


def test_a_stuck_solver_is_stopped_at_once(workers: Workers) -> None:
    """A request to stop reaches a process that is deep in C, and keeps what was answered before."""
    stopped = threading.Event()
    with Workers(stopped) as mine:
        threading.Timer(1.0, stopped.set).start()
        began = time.monotonic()
        answers = mine.solve("unruly", stack(0.0, unruly_.STUCK, 0.0), time_limit=50)
        assert time.monotonic() - began < 5
    assert names(answers)[1:] == ["NOT_RUN", "NOT_RUN"] and answers.said[2] == "interrupted"


ORPHAN = """
import sys
from sandbox.backends import BACKENDS
from sandbox.worker import Workers
from tests.sandbox.test_worker import SILENT, Backend, stack, unruly_
BACKENDS["unruly"] = Backend("unruly", "unruly", "good", "none", "none", SILENT, package="tests.fakes")
with Workers() as workers:
    workers.solve("unruly", stack(0.0))
    print(workers._processes["unruly"].child.pid, flush=True)
    workers.solve("unruly", stack(unruly_.STUCK), time_limit=50)
"""


def test_no_solver_outlives_its_parent() -> None:
    """Kill -9 of the parent ends a solver process that is stuck in C with the interpreter's lock held."""
    parent = subprocess.Popen([sys.executable, "-c", ORPHAN], stdout=subprocess.PIPE, text=True, cwd=Path(__file__).parents[2])
    assert parent.stdout is not None
    child = int(parent.stdout.readline())
    time.sleep(1)
    os.kill(child, 0)  # it lives
    parent.kill()
    parent.communicate()
    deadline = time.monotonic() + 5
    while _alive(child) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not _alive(child)


def _alive(pid: int) -> bool:
    """Whether a process runs; one that has ended and waits for init to notice does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().split()[2] != "Z" if Path("/proc/self").exists() else not os.kill(pid, 0)
    except OSError:
        return False


def starts(answers: Answers) -> list[int | None]:
    """Which member each was started from, found by its words; None where it was started cold."""
    words = {f"solved from {x.tolist()}, {y.tolist()}": i for i, (x, y) in enumerate(zip(answers.x, answers.y, strict=True))}
    return [words[said] if "from" in said else None for said in answers.said]


def test_a_chain_starts_each_from_the_one_before(workers: Workers) -> None:
    """A member that follows is started from its predecessor's answer, x and y to the bit; the others are cold."""
    qp = stack(0.0, 1.0, 2.0, 3.0, 4.0)
    answers = workers.solve("unruly", qp, follows=np.array([False, True, True, False, True]))
    assert starts(answers) == [None, 0, 1, None, 3]
    assert starts(workers.solve("unruly", qp)) == [None] * 5
    given = Start(np.full(3, 1e3), np.full(1, 0.1))
    first = workers.solve("unruly", qp, start=given).said
    assert first == ["solved from [1000.0, 1000.0, 1000.0], [0.1]", *["solved"] * 4]


@pytest.mark.parametrize(
    "fault",
    [unruly_.SEGFAULT, unruly_.HANG, unruly_.EXIT, unruly_.RAISE, unruly_.GARBAGE, unruly_.SHORT, unruly_.LIE],
)
def test_a_chain_starts_cold_after_a_failure(workers: Workers, fault: float) -> None:
    """After a death, an overrun, an error or an answer that is none, the next is cold and the chain goes on from it."""
    answers = workers.solve("unruly", stack(0.0, 1.0, fault, 2.0, 3.0), time_limit=0.5, follows=np.arange(5) > 0)
    assert starts(answers) == [None, 0, None, None, 3]


def test_a_chain_survives_what_was_lost_unsent(workers: Workers) -> None:
    """Answers that died unsent are solved again from where they had been started."""
    qp = stack(0.0, unruly_.SLOW, 1.0, 2.0, unruly_.SEGFAULT, 3.0, 4.0, unruly_.EXIT, 5.0)
    answers = workers.solve("unruly", qp, time_limit=0.5, follows=np.arange(9) > 0)
    assert [i for i, name in enumerate(names(answers)) if name == "CRASHED"] == [4, 7]
    assert starts(answers) == [None, 0, 1, 2, None, None, 5, None, None]
    assert all(right(answers, qp, i) for i in (0, 1, 2, 3, 5, 6, 8))


def test_a_backend_without_a_starting_point_is_given_none() -> None:
    """Warm starts of a backend that takes no starting point are refused before anything runs."""
    with Workers() as mine, pytest.raises(RefusalError, match="numpy:lstsq takes no starting point"):
        mine.solve("numpy:lstsq", stack(0.0), follows=np.zeros(1, dtype=bool))


def test_patience_ends(workers: Workers) -> None:
    """After so many failures the rest is not run, and says so."""
    answers = workers.solve("unruly", stack(unruly_.EXIT, unruly_.EXIT, 0.0, 1.0), time_limit=0.5, patience=2)
    assert names(answers)[:2] == ["CRASHED", "CRASHED"]
    assert names(answers)[2:] == ["NOT_RUN", "NOT_RUN"] and "too many crashes" in answers.said[2]


@pytest.mark.parametrize("backend", ["unruly:missing", "unruly:bursts"])
def test_a_backend_that_cannot_be_opened_is_not_run(workers: Workers, backend: str) -> None:
    """A missing library is no crash of the run: NOT_RUN, with the line that installs it."""
    answers = workers.solve(backend, stack(0.0), time_limit=5)
    assert names(answers) == ["NOT_RUN"]
    assert answers.engine is None and "pip install manners" in answers.absent


def test_unknown_names(workers: Workers) -> None:
    """A typo is an error that lists what there is."""
    with pytest.raises(UnknownNameError, match="no backend is called 'osqp2'"):
        workers.solve("osqp2", stack(0.0))
    with pytest.raises(UnknownNameError, match="no settings level is called 'best'"):
        workers.solve("unruly", stack(0.0), settings="best")
