"""The claims carried out one after the other into a run folder; what one of them costs or loses is its own."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pyarrow as pa

from sandbox.check import line
from sandbox.claims.claim import Check, Claim, Evidence, Role, Trial
from sandbox.claims.exhibit import as_json
from sandbox.errors import UnknownNameError
from sandbox.records import CHECKS, CLAIMS, EXHIBITS, write_json, write_parquet
from sandbox.run_folder import beginning, emptied

Told = Callable[[str, int, int], None]


def chosen(table: dict[str, Claim], names: Sequence[str] | None) -> list[Claim]:
    """The claims named, in the order of the paper; all where none is named.

    Raises UnknownNameError for another name, with those that are near.
    """
    for name in names or ():
        if name not in table:
            raise UnknownNameError.of("claim", name, table)
    return [claim for name, claim in table.items() if not names or name in names]


def carry_out(
    claims: Sequence[Claim], out: Path, *, command: str, trial: Trial, overwrite: bool = False, told: Told = lambda *_: None
) -> dict[str, Any]:
    """Examine `claims` into the run folder `out` and return its run.json; every claim is kept as soon as it is done.

    Raises InputFileError if `out` holds anything, unless that is a run and `overwrite` says to replace it.
    """
    with emptied(out, overwrite) as folder:
        started = datetime.now(UTC)
        content = beginning(command, started) | {"kind": "paper", "seed": trial.seed, "full": trial.full, "jobs": trial.jobs}
        write_json(content, folder / "run.json")
        begun = time.perf_counter()
        for place, claim in enumerate(claims):
            told(claim.name, place, len(claims))
            _keep(claim, place, replace(trial, folder=folder), folder)
        told("claims", len(claims), len(claims))
        content["timing"] = {"wall": round(time.perf_counter() - begun, 3)}
        content["finished"] = datetime.now(UTC).isoformat(timespec="seconds")
        content["complete"] = True
        write_json(content, folder / "run.json")
    return content


def _keep(claim: Claim, place: int, trial: Trial, folder: Path) -> None:
    begun = time.perf_counter()
    evidence = examined(claim, trial)
    seconds = time.perf_counter() - begun
    small = replace(trial, full=False, folder=None)
    sound = evidence if not trial.full else examined(claim, small)
    faulty = examined(claim, small, faulty=True)
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
    for kind, schema, rows in (("checks", CHECKS, checks), ("exhibits", EXHIBITS, exhibits), ("claims", CLAIMS, [row])):
        write_parquet(pa.Table.from_pylist(rows, schema), folder / kind / f"{place:02}-{claim.name}.parquet")


def examined(claim: Claim, trial: Trial, *, faulty: bool = False) -> Evidence:
    """The claim's evidence; an examination that breaks off is evidence that does not stand, with its last words."""
    try:
        return claim.evidence(trial, faulty=faulty)
    except Exception as error:  # whatever one claim meets, the others go on
        words = f"{type(error).__name__}: {line(error)}"
        return Evidence((Check("the examination comes to its end", False, words, "no error", role=Role.OURS),), ())


def noticed(sound: Evidence, faulty: Evidence) -> bool:
    """Whether a planted fault turned the claim red; one that is red without it must turn to evidence that fails."""
    return faulty.state.red and faulty.state is not sound.state
