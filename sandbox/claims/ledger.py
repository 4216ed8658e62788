"""The claims carried out into a run folder, some beside each other; what one of them costs or loses is its own."""

from __future__ import annotations

import json
import multiprocessing
import signal
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, wait
from dataclasses import replace
from datetime import UTC, datetime
from difflib import get_close_matches
from multiprocessing import resource_tracker
from pathlib import Path
from typing import Any

import pyarrow as pa
from pebble import ProcessPool

from sandbox.check import line
from sandbox.claims.claim import Check, Claim, Evidence, Role, Trial
from sandbox.claims.exhibit import as_json
from sandbox.errors import UnknownNameError
from sandbox.records import CHECKS, CLAIMS, EXHIBITS, read_run, write_json, write_parquet
from sandbox.run_folder import beginning, emptied

Told = Callable[[str, int, int], None]

PATIENCE = 900.0
"""Seconds for the claims of one file; where they take longer, or their process dies, each is tried in a process of its own."""

GLANCE = 0.2
"""Seconds between two looks at what is done."""


def chosen(table: dict[str, Claim], names: Sequence[str] | None) -> list[Claim]:
    """The claims named, in the order of the paper; all where none is named.

    Raises UnknownNameError for another name, with those that are near.
    """
    for name in names or ():
        if name not in table:
            near = ", ".join(get_close_matches(name, table, n=5))
            raise UnknownNameError(
                f"no claim is called {line(repr(name))}; {f'near it: {near}' if near else 'none is near it'}; "
                "`sandbox list claims` has them all", name=name,
            )  # fmt: skip
    return [claim for name, claim in table.items() if not names or name in names]


def carry_out(
    claims: Sequence[Claim],
    out: Path,
    *,
    command: str,
    trial: Trial,
    overwrite: bool = False,
    told: Told = lambda *_: None,
    ledger: int | None = None,
) -> dict[str, Any]:
    """Examine `claims` into the run folder `out` and return its run.json; every claim is kept as soon as it is done.

    ledger : how many claims there are in all, where `claims` may be some of them

    Raises InputFileError if `out` holds anything, unless that is a run and `overwrite` says to replace it.
    """
    with emptied(out, overwrite) as folder:
        _clear(folder)
        started, begun = datetime.now(UTC), time.perf_counter()
        content = beginning(command, started) | {
            "kind": "paper", "seed": trial.seed, "full": trial.full, "jobs": trial.jobs, "planned": len(claims),
            "ledger": len(claims) if ledger is None else ledger,
        }  # fmt: skip
        write_json(content, folder / "run.json")
        work = _Work(claims, replace(trial, folder=folder), told)
        try:
            work.carry_out()
            content["complete"] = True
        finally:
            content["timing"] = {"wall": round(time.perf_counter() - begun, 3)}
            content["finished"] = datetime.now(UTC).isoformat(timespec="seconds")
            write_json(content, folder / "run.json")
    return content


def _clear(folder: Path) -> None:
    """Remove the runs that claims of an earlier run kept in `folder`, and nothing else."""
    for kept in folder.glob("*/run.json"):
        if str(read_run(kept.parent).get("command")).startswith("sandbox paper "):
            with emptied(kept.parent, overwrite=True):
                kept.unlink()


class _Work:
    """The claims of one file share a process, for they share what they compute; those that must be alone come last."""

    def __init__(self, claims: Sequence[Claim], trial: Trial, told: Told) -> None:
        assert trial.folder is not None
        self.places = {claim: place for place, claim in enumerate(claims)}
        self.trial, self.folder, self.told = trial, trial.folder, told
        self.ends: dict[Claim, str] = {}

    def carry_out(self) -> None:
        self._tell()
        beside = [claim for claim in self.places if not claim.alone]
        files: dict[str, list[Claim]] = {}
        for claim in beside:
            files.setdefault(claim.examine.__module__, []).append(claim)
        if self.trial.jobs > 1 and len(files) > 1:
            self._pooled(list(files.values()))
            # a claim whose process died or took too long: once more, alone, so that the others of its file go on
            self._pooled([[claim] for claim in self._missing(beside)])
            for claim in self._missing(beside):
                self._lost(claim)
        for claim in self._missing(self.places):
            examine(claim, self.places[claim], self.trial)
            self._tell()

    def _pooled(self, groups: list[list[Claim]]) -> None:
        """Each group one after the other in a process, `jobs` of them beside each other."""
        if not groups:
            return
        context = multiprocessing.get_context("spawn")  # a fork would copy the threads that numerical libraries hold
        pool = ProcessPool(max_workers=self.trial.jobs, max_tasks=0, context=context)
        resource_tracker.ensure_running()  # the first process starts it, and that would unblock what is blocked below
        try:
            # blocked while the pool starts: its threads and processes inherit that, and Ctrl-C is this process's business alone
            signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
            try:
                futures: dict[Any, list[Claim]] = {
                    pool.schedule(
                        _examine_all, ([(claim, self.places[claim]) for claim in group], self.trial), timeout=PATIENCE
                    ): group
                    for group in groups
                }
            finally:
                signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
            waiting: set[Any] = set(futures)
            while waiting:
                done, waiting = wait(waiting, timeout=GLANCE, return_when=FIRST_COMPLETED)
                for future in done:
                    if (error := future.exception()) is not None:
                        self.ends |= dict.fromkeys(futures[future], f"{type(error).__name__}: {line(error)}")
                self._tell()
        except BaseException:
            pool.stop()
            raise
        finally:
            pool.close()
            pool.join()

    def _missing(self, claims: Iterable[Claim]) -> list[Claim]:
        return [claim for claim in claims if not _part(self.folder, "claims", claim, self.places[claim]).is_file()]

    def _tell(self) -> None:
        self.told("claims", len(self.places) - len(self._missing(self.places)), len(self.places))

    def _lost(self, claim: Claim) -> None:
        lost = broken_off(self.ends.get(claim, "its process ended"))
        _keep(claim, self.places[claim], self.trial, lost, lost, lost, None)


def _examine_all(claims: Sequence[tuple[Claim, int]], trial: Trial) -> None:
    for claim, place in claims:
        if not _part(trial.folder or Path(), "claims", claim, place).is_file():
            examine(claim, place, trial)


def examine(claim: Claim, place: int, trial: Trial) -> None:
    """One claim: its evidence, and what becomes of it at the reduced size when its fault is planted; kept in trial.folder."""
    begun = time.perf_counter()
    evidence = examined(claim, trial)
    seconds = time.perf_counter() - begun
    small = replace(trial, full=False, folder=None)
    sound = examined(claim, small) if trial.full else evidence
    _keep(claim, place, trial, evidence, sound, examined(claim, small, faulty=True), seconds)


def examined(claim: Claim, trial: Trial, *, faulty: bool = False) -> Evidence:
    """The claim's evidence; an examination that breaks off is evidence that does not stand, with its last words."""
    try:
        return claim.evidence(trial, faulty=faulty)
    except Exception as error:  # whatever one claim meets, the others go on
        return broken_off(f"{type(error).__name__}: {line(error)}")


def broken_off(words: str) -> Evidence:
    """The evidence of an examination that did not come to its end."""
    return Evidence((Check("the examination comes to its end", False, words, "no error", role=Role.OURS),), ())


def noticed(sound: Evidence, faulty: Evidence) -> bool:
    """Whether a planted fault turned the claim red; one that is red without it must turn to evidence that fails."""
    return faulty.state.red and faulty.state is not sound.state


def _part(folder: Path, kind: str, claim: Claim, place: int) -> Path:
    return folder / kind / f"{place:02}-{claim.name}.parquet"


def _keep(
    claim: Claim, place: int, trial: Trial, evidence: Evidence, sound: Evidence, faulty: Evidence, seconds: float | None
) -> None:
    first, second = claim.paths
    row = {
        "place": place, "claim": claim.name, "title": claim.title, "where": claim.place, "says": claim.says,
        "formula": claim.formula, "tested": claim.tested, "accepted": claim.accepted, "first": first.name,
        "first_words": first.words, "second": second.name, "second_words": second.words, "sources": list(claim.sources),
        "state": str(evidence.state), "fault": claim.fault.words, "fault_state": str(faulty.state),
        "noticed": noticed(sound, faulty), "seconds": seconds, "seed": trial.seed, "full": trial.full,
        "command": f"sandbox paper --claim {claim.name} --seed {trial.seed}{'' if trial.full else ' --quick'}",
    }  # fmt: skip
    checks = [
        {
            "claim": claim.name, "place": i, "says": check.says, "role": str(check.role), "holds": check.holds,
            "found": json.dumps(check.found), "asked": json.dumps(check.asked), "count": check.count, "range": check.range,
        }
        for i, check in enumerate(evidence.checks)
    ]  # fmt: skip
    exhibits = [
        {"claim": claim.name, "place": i, "kind": exhibit.kind, "content": as_json(exhibit)}
        for i, exhibit in enumerate(evidence.exhibits)
    ]
    # the claim's own row last: where it is, all is
    for kind, schema, rows in (("checks", CHECKS, checks), ("exhibits", EXHIBITS, exhibits), ("claims", CLAIMS, [row])):
        write_parquet(pa.Table.from_pylist(rows, schema), _part(trial.folder or Path(), kind, claim, place))
