"""A campaign kept on disk: a folder with run.json and Parquet parts, complete at every moment."""

from __future__ import annotations

import fcntl
import os
import platform
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc

from sandbox import __version__
from sandbox.backends import BACKENDS
from sandbox.campaign import Campaign, Plan, Progress, quiet
from sandbox.closed_form import CLOSED_FORMS
from sandbox.errors import InputFileError
from sandbox.formulation import FORMULATIONS
from sandbox.plan import RUNNABLE
from sandbox.records import FORMAT, KINDS, read_run, read_table, write_json, write_parquet


def carry_out(plan: Plan, out: Path, *, command: str, progress: Progress = quiet, overwrite: bool = False) -> dict[str, Any]:
    """Run `plan` into the folder `out` and return its run.json; an interrupted run keeps what was done.

    Raises
    ------
    InputFileError
        if `out` holds anything, unless that is a run and `overwrite` says to replace it.
    """
    with emptied(out, overwrite) as folder:
        return _carry_out(plan, folder, command, progress)


@contextmanager
def emptied(out: Path, overwrite: bool) -> Iterator[Path]:
    """The folder `out` for one run alone, without the parts of an earlier one.

    Raises InputFileError as `carry_out` does.
    """
    out = Path(out)
    refuse_foreign(out, overwrite)
    out.mkdir(parents=True, exist_ok=True)
    with _locked(out):
        for kind in KINDS:  # only the parts of a run of our own are ever removed
            for part in (out / kind).glob("*.parquet"):
                part.unlink()
        yield out


def add_study(out: Path, methods: list[dict[str, Any]], tables: dict[str, pa.Table]) -> None:
    """Add the study of methods to a run: what they are, and its tables by kind ("methods", "motions")."""
    content = read_run(out)
    for kind, table in tables.items():
        write_parquet(table, out / kind / "study.parquet")
    write_json({**content, "methods": methods}, out / "run.json")


def keep_motions(out: Path, methods: list[dict[str, Any]], motions: pa.Table, *, command: str, overwrite: bool = False) -> None:
    """A run folder that holds motions alone.

    Raises InputFileError as `carry_out` does.
    """
    carry_out(Plan(sets=[], backends=[], levels={}), out, command=command, overwrite=overwrite)
    add_study(Path(out), methods, {"motions": motions})


def _carry_out(plan: Plan, out: Path, command: str, progress: Progress) -> dict[str, Any]:
    started = datetime.now(UTC)
    content = _describe(plan, command, started)

    def keep(kind: str, name: str, table: pa.Table) -> None:
        write_parquet(table, out / kind / f"{name}.parquet")

    write_json(content, out / "run.json")
    campaign = Campaign(plan, keep, progress, run_id=content["id"])
    try:
        campaign.carry_out()
        content["complete"] = True
    finally:
        content["finished"] = datetime.now(UTC).isoformat(timespec="seconds")
        content["timing"] = {
            name: round(getattr(campaign.tally, name), 3) for name in ("wall", "solve", "build", "reference", "judge")
        }
        for row in content["backends"]:
            _note_presence(row, campaign)
        content["not_run"] = _not_run(out)
        write_json(content, out / "run.json")
    return content


def refuse_foreign(out: Path, overwrite: bool) -> None:
    """Let `out` be a new or empty folder, or a run that may be replaced."""
    if out.exists() and not out.is_dir():
        raise InputFileError(f"{out} is a file; --out names a folder")
    if not out.exists() or not any(out.iterdir()):
        return
    if not (out / "run.json").is_file():
        raise InputFileError(f"{out} holds files that are no run; name another folder with --out")
    read_run(out)
    if not overwrite:
        raise InputFileError(f"{out} holds a run; name another folder with --out, or replace it with --overwrite")


@contextmanager
def _locked(out: Path) -> Iterator[None]:
    """The folder for this run alone."""
    lock = out / ".lock"
    with lock.open("w") as handle:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise InputFileError(f"{out} is being written by another run; name another folder with --out") from None
        try:
            yield
        finally:
            lock.unlink(missing_ok=True)


def _describe(plan: Plan, command: str, started: datetime) -> dict[str, Any]:
    """What is known of a run before it begins."""
    return {
        **beginning(command, started),
        "jobs": plan.jobs,
        "time_limit": plan.time_limit,
        "sample_every": plan.sample_every,
        "warm": plan.warm,
        "sets": [
            {
                "name": s.name,
                "about": s.about,
                "problems": len(s),
                "groups": [[g.problem.m, g.problem.n, len(g)] for g in s.groups],
                "tasks": list(dict.fromkeys(task for g in s.groups for task in g.tasks)),
            }
            for s in plan.sets
        ],
        "backends": [
            _backend(name, name in plan.backends) for name in BACKENDS if name in plan.backends or _known_to_fail(name, plan)
        ],
        "closed_forms": [
            {"name": f.name, "task": f.task, "domain": f.domain, "bound": f.bound_text, "about": f.about, "source": f.source}
            for f in (CLOSED_FORMS[name] for name in plan.closed_forms)
        ],
        "formulations": [
            {"name": f.name, "task": f.task, "about": f.about} for f in (FORMULATIONS[name] for name in plan.formulations)
        ],
        "settings": list(plan.levels),
        "levels": {level: list(names) for level, names in plan.levels.items()},
        "not_run": [],
        "probe": None,
        "timing": {},
    }


def beginning(command: str, started: datetime) -> dict[str, Any]:
    """What run.json says of any run: which, when, and on what machine with what versions."""
    return {
        "format": FORMAT,
        "id": started.strftime("%Y%m%dT%H%M%SZ"),
        "command": command,
        "started": started.isoformat(timespec="seconds"),
        "finished": None,
        "complete": False,
        "sandbox_version": __version__,
        "python": platform.python_version(),
        "platform": platform.platform(),
        "cpu": _processor(),
        "cores": os.cpu_count(),
        "packages": _versions(),
    }


def _known_to_fail(name: str, plan: Plan) -> bool:
    """Whether a backend is left out only because it is known to fail: all others of its library are planned."""
    peers = [other for other in RUNNABLE if BACKENDS[other].library == BACKENDS[name].library]
    return name not in RUNNABLE and all(other in plan.backends for other in peers)


def _backend(name: str, planned: bool) -> dict[str, Any]:
    """A row of the table for run.json; one that is not planned is named with its reason."""
    row = BACKENDS[name]
    why = "" if planned else f"{row.expected}: {row.message}"
    return {
        "name": name, "library": row.library, "engine": row.engine, "licence": row.licence, "method": row.method,
        "promise": {key: getattr(row.promise, key) for key in ("H", "A", "quote", "source", "version")},
        "expected": row.expected, "message": row.message, "sampled": row.sampled, "install": row.install,
        "state": "not_run", "why": why, "library_version": None, "engine_version": None, "effective_settings": {},
    }  # fmt: skip


def _note_presence(row: dict[str, Any], campaign: Campaign) -> None:
    presence = campaign.presence.get(row["name"])
    if presence is None:
        return
    row.update(state=presence.state, why=presence.why)
    for level, engine in presence.engines.items():
        row.update(library_version=engine.library_version, engine_version=engine.engine_version)
        row["effective_settings"][level] = {"eps": list(engine.eps), **engine.settings}


def _not_run(out: Path) -> list[dict[str, Any]]:
    """Records with the verdict not_run, counted by backend, formulation, settings, set and reason."""
    keys = ["backend", "formulation", "settings", "mode", "set", "said"]
    try:
        records = read_table(out, "records", [*keys, "verdict"])
    except InputFileError:  # nothing was recorded before the run ended
        return []
    left = records.filter(pc.equal(records["verdict"].cast(pa.string()), "not_run")).select(keys)
    left = pa.table({name: left[name].cast(pa.string()) for name in keys})
    counted = left.group_by(keys).aggregate([([], "count_all")]).to_pylist()
    return [
        {**{k: row[k] for k in keys[:-1]}, "count": row["count_all"], "why": row["said"]}
        for row in sorted(counted, key=lambda row: tuple(str(row[k]) for k in keys))
    ]


def _versions() -> dict[str, str]:
    """Installed versions of everything the distribution depends on."""
    names = ["numpy", "scipy", "numba", "python-flint", "pyarrow", "duckdb"]
    names += sorted({package for row in BACKENDS.values() for package in row.install.removeprefix("pip install ").split()})
    found = {}
    for name in dict.fromkeys(names):
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "absent"
    return found


def _processor() -> str:
    """The processor's own name where the system tells it."""
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.is_file():
        for line in cpuinfo.read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()


def default_folder(command: str) -> Path:
    """runs/COMMAND-DATE-TIME below the current folder."""
    return Path("runs") / f"{command}-{datetime.now():%Y%m%d-%H%M%S}"


def exported(run: Path, file: Path, told: Callable[[str], None]) -> None:
    """All records of a run in one Parquet file."""
    table = read_table(run, "records")
    write_parquet(table, file)
    told(f"{table.num_rows} records in {file}")
