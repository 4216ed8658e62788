"""A real run kept on disk: records per second, bytes per record; and against qpbenchmark's runner."""

from __future__ import annotations

from importlib.util import find_spec
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from sandbox.bench.measured import Measured, each, rate, ratio
from sandbox.bench.race import Effort, one_core, race
from sandbox.bench.stack import Stack, stack
from sandbox.plan import chosen
from sandbox.problem_set import Group, ProblemSet
from sandbox.records import KINDS, read_table
from sandbox.run_folder import carry_out

LEVEL = "high_accuracy"

BACKENDS = ("qpsolvers:daqp", "qpsolvers:quadprog", "qpsolvers:proxqp", "closed_form:eq6", "closed_form:eq2_5")

SHARED = {"daqp": "daqp", "quadprog": "quadprog", "piqp": "piqp", "proxqp": "proxsuite"}
"""Solver as qpsolvers calls it -> the module that it needs; both runners call them through qpsolvers."""

ROUNDS = 3
"""Of runs: each takes seconds, and starts processes."""


class Run:
    """Runs of the same plan, each into a new folder below `place`."""

    def __init__(self, given: Stack, backends: list[str], place: Path) -> None:
        self.plan = chosen([ProblemSet("bench", (Group(given.problem),))], backends, ["direct"], [LEVEL])
        self.place, self.numbers = place, count()
        self.last = place

    def __call__(self) -> None:
        """One whole run: processes, exact references, judgement and files included."""
        self.last = self.place / str(next(self.numbers))
        carry_out(self.plan, self.last, command="sandbox bench")

    def records(self) -> int:
        """Records of the last run; fails where one was not run."""
        table = read_table(self.last, "records", ["verdict"])
        assert "not_run" not in table["verdict"].to_pylist()
        return int(table.num_rows)

    def bytes_of(self, *kinds: str) -> int:
        """Bytes of the parts of these kinds."""
        return sum(part.stat().st_size for kind in kinds for part in (self.last / kind).glob("*.parquet"))


def campaign(effort: Effort) -> Measured:
    """Records per second of a run of 7 x 6 problems on one core."""
    given = stack(6, 7, effort.problems(1024))
    with TemporaryDirectory() as place, one_core():
        run = Run(given, list(BACKENDS), Path(place))
        times = race({"run": run}, min(effort.rounds, ROUNDS), wall=True)
        records = run.records()
        return rate(times["run"], records).with_({
            "bytes per record": run.bytes_of("records") / records,
            "with problems and truths": run.bytes_of(*KINDS) / records,
            "us per record": each(times["run"], records).value,
            "records": records,
        })  # fmt: skip


def against_qpbenchmark(effort: Effort) -> Measured:
    """Records per second of a run by those of qpbenchmark's runner, on the same problems, solvers and tolerances.

    qpbenchmark's records hold residuals by qpsolvers; ours, besides, the exact answer, the error and a verdict. Both are timed
    whole, one core each. qpbenchmark takes longer for each record the more there are.
    """
    import logging
    import os

    os.environ.setdefault("TQDM_DISABLE", "1")  # its progress bar, as ours, is not shown
    import qpbenchmark
    import qpsolvers

    given = stack(6, 7, effort.problems(256))
    solvers = [name for name, module in SHARED.items() if find_spec(module) is not None]
    problems = [
        qpbenchmark.Problem(W, a, None, None, J, xdot, None, None, name=f"{i:06d}")
        for i, (W, a, J, xdot) in enumerate(zip(given.W, given.a, given.J, given.xdot, strict=True))
    ]

    class Set(qpbenchmark.TestSet):  # type: ignore[misc]
        description, title, sparse_only = "", "bench", False

        def __iter__(self) -> Any:
            return iter(problems)

    test_set = Set()
    test_set.solvers = set(solvers) & set(qpsolvers.available_solvers)
    written: list[Any] = []

    def theirs() -> None:
        written.append(qpbenchmark.Results(Path(place) / f"{len(written)}.parquet", test_set))
        qpbenchmark.run(test_set, written[-1], only_settings=LEVEL)

    disabled = logging.root.manager.disable
    logging.disable(logging.WARNING)
    try:
        with TemporaryDirectory() as place, one_core():
            run = Run(given, [f"qpsolvers:{name}" for name in solvers], Path(place) / "ours")
            times = race({"theirs": theirs, "ours": run}, min(effort.rounds, ROUNDS), wall=True)
            records, others = run.records(), written[-1].nb_rows
    finally:
        logging.disable(disabled)
    assert records == others == len(problems) * len(solvers)
    found: np.ndarray = written[-1].df["found"].to_numpy()
    return ratio(times["theirs"], times["ours"]).with_({
        "ours per s": rate(times["ours"], records).value, "theirs per s": rate(times["theirs"], records).value,
        "records": records, "theirs found %": 100 * float(found.mean()), "solvers": " ".join(solvers),
    })  # fmt: skip
