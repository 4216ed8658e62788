"""The command line: every command a thin layer over the library."""

from __future__ import annotations

import json
import os
import shlex
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from sandbox.errors import EmptyPlanError, InputFileError, SandboxError, UnknownNameError
from sandbox.listing import LISTS

app = typer.Typer(
    no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False,
    rich_markup_mode=None,  # rich would take [m] or [all] in a help for markup, and swallow it
)  # fmt: skip

Run = Annotated[Path, typer.Argument(metavar="RUN", help="a run folder, as `verify` and `run` make them")]
Json = Annotated[bool, typer.Option("--json", help="print JSON instead of a table")]
Jobs = Annotated[int, typer.Option("--jobs", min=1, help="libraries run at the same time")]
TimeLimit = Annotated[float, typer.Option("--time-limit", min=0.001, help="seconds for one problem")]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="replace the run that --out already holds")]
Names = list[str] | None

LARGEST_SEED = 2**63 - 1
"""A seed is kept as an int64."""


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _console() -> Console:
    # a pipe or a log has no width of its own: tables must not be folded to 80 columns there
    terminal = sys.stdout is not None and sys.stdout.isatty()
    return Console(width=None if terminal else 160)


def _print_json(content: Any) -> None:
    print(json.dumps(content, indent=1, allow_nan=False))


def _print_table(rows: list[dict[str, Any]]) -> None:
    from rich.markup import escape
    from rich.table import Table

    drawn = Table()
    for name in rows[0]:
        drawn.add_column(name, overflow="fold")
    for row in rows:
        drawn.add_row(*(escape(str(value)) if value is not None else "silent" for value in row.values()))
    _console().print(drawn)


@contextmanager
def _bar() -> Iterator[Any]:
    """A progress bar with remaining time, one line per phase."""
    columns = (
        TextColumn("{task.description:<17}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(),
        TextColumn("left"), TimeRemainingColumn(),
    )  # fmt: skip
    with Progress(*columns, console=Console(stderr=True)) as bar:
        tasks: dict[str, Any] = {}

        def tell(phase: str, done: int, total: int) -> None:
            if phase not in tasks:
                tasks[phase] = bar.add_task(phase, total=total)
            bar.update(tasks[phase], completed=done, total=total)

        yield tell


def _summary(folder: Path, content: dict[str, Any]) -> None:
    from sandbox.verdict_table import counts, table

    console = _console()
    console.print(table(counts(folder)))
    for row in content["backends"]:
        if row["state"] != "ran":
            console.print(f"not run: {row['name']}: {row['why']}", markup=False, highlight=False)
    timing = content["timing"]
    console.print(
        f"{timing['wall']:.1f} s; solvers {timing['solve'] + timing['build']:.1f} s, exact arithmetic "
        f"{timing['reference']:.1f} s, judging {timing['judge']:.1f} s; records in {folder}",
        markup=False, highlight=False,
    )  # fmt: skip


def _version(wanted: bool) -> None:
    if wanted:
        from sandbox import __version__

        print(f"velocity-sandbox {__version__}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[bool, typer.Option("--version", callback=_version, is_eager=True, help="print the version")] = False,
) -> None:
    """Which velocity-control formulation and which QP solver to trust for a redundant manipulator, with the evidence."""


@app.command()
def verify(
    full: Annotated[bool, typer.Option("--full", help="the large sets (about a quarter of an hour)")] = False,
    accept: Annotated[bool, typer.Option("--accept", help="make the verdicts of this run the committed baseline")] = False,
    out: Annotated[Path | None, typer.Option("--out", help="run folder [runs/verify-DATE]")] = None,
    page: Annotated[Path, typer.Option("--page", help="where the HTML report goes")] = Path("reports/out/verification.html"),
    overwrite: Overwrite = False,
    jobs: Jobs = _cores(),
    time_limit: TimeLimit = 2.0,
) -> None:
    """Run everything on everything, and write the report.

    All standard sets go through everything installed, every method of the paper is compared with its original and
    followed along a path; the verdicts are printed.

    Exit status 1 when a closed form falls, or when something that the baseline
    has as verified (same engine version) is now a false success or a crash.
    """
    from problems import sets
    from reports.verification import write_report
    from sandbox import baseline
    from sandbox.plan import standard
    from sandbox.run_folder import carry_out, default_folder

    folder = out or default_folder("verify")
    every = 20 if full else 10  # the slow interfaces would take most of the time and tell least
    plan = standard([sets.load(name, full) for name in sets.SETS], jobs=jobs, time_limit=time_limit, sample_every=every)
    with _bar() as tell:
        content = carry_out(
            plan, folder, command=f"sandbox verify{' --full' if full else ''}", progress=tell, overwrite=overwrite
        )
        _study(folder, full, tell)
    _summary(folder, content)
    console = _console()
    written = write_report(folder, page)
    console.print(f"report: {written} ({written.stat().st_size / 1e6:.1f} MB)", markup=False, highlight=False)
    if accept:
        console.print(f"baseline: {baseline.accept(folder)} verified records", markup=False, highlight=False)
    fallen = baseline.fallen(folder)
    for row in fallen[:20]:
        console.print(f"fell: {' '.join(str(v) for v in row.values() if v is not None)}", markup=False, highlight=False)
    console.print(f"fallen against the baseline: {len(fallen)}", markup=False, highlight=False)
    if fallen:
        raise typer.Exit(1)


def _study(folder: Path, full: bool, tell: Any) -> None:
    """Every method of the paper on real robots: agreement with its original, and a closed path."""
    from problems import paths, robots
    from problems.methods import METHODS
    from problems.sets.methods import ROBOTS
    from sandbox.method_study import agreement_table, cured, described, motion_rows, motions
    from sandbox.run_folder import add_study

    methods = list(METHODS.values())
    arms = [robots.load(name) for name in ROBOTS]
    moved = [robots.load(name) for name in (("planar_3r", "panda") if full else ("planar_3r",))]
    agreement = agreement_table(methods, arms, count=400 if full else 100, told=tell)
    found = motions(methods, moved, lambda _: paths.load("circle", 0.15), cycles=2, told=tell)
    into = paths.load("through_algorithmic_singularity")
    found += cured(METHODS["augmented_jacobian"], METHODS["damped_secondary"], robots.load("planar_3r"), into, into.start)
    tables = {"methods": agreement, "motions": motion_rows(found)}
    add_study(folder, described(methods), tables)


@app.command()
def run(
    source: Annotated[
        str, typer.Argument(metavar="SET|FILE", help="a problem set, a .npz or .json file of problems, or a .py of a method")
    ],
    out: Annotated[Path, typer.Option("--out", help="run folder to make")],
    backend: Annotated[Names, typer.Option("--backend", help="backend or library; repeat for several [all]")] = None,
    formulation: Annotated[Names, typer.Option("--formulation", help="formulation; repeat for several [all]")] = None,
    settings: Annotated[Names, typer.Option("--settings", help="settings level; repeat for several [high_accuracy]")] = None,
    task: Annotated[
        Names, typer.Option("--task", help="exact, least_squares or damped [a set's own; exact, and least_squares with Wx]")
    ] = None,
    full: Annotated[bool, typer.Option("--full", help="the large form of a set")] = False,
    robot: Annotated[
        str | None, typer.Option("--robot", metavar="NAME|FILE.urdf", help="for a method: a name of `list robots`, or a URDF")
    ] = None,
    hand: Annotated[str | None, typer.Option("--hand", help="for a URDF: the frame that carries the task")] = None,
    rows: Annotated[
        str | None, typer.Option("--rows", help="for a method: task rows, as position, pose, planar [the robot's own]")
    ] = None,
    count: Annotated[int, typer.Option("--count", min=1, help="for a method: seeded configurations")] = 100,
    seed: Annotated[int, typer.Option("--seed", min=0, help="for a method: of the configurations")] = 0,
    overwrite: Overwrite = False,
    jobs: Jobs = _cores(),
    time_limit: TimeLimit = 2.0,
) -> None:
    """Run one problem set, your own problems, or your own method.

    They go through all backends, formulations and closed forms that fit, or those you name.
    """
    from sandbox.plan import chosen, known
    from sandbox.run_folder import carry_out
    from sandbox.task import TASKS

    tasks = tuple(known("task", task, TASKS)) if task else None
    of_method = {"robot": robot, "hand": hand, "rows": rows, "count": count, "seed": seed}
    own = Path(source).suffix == ".py"
    if own and full:
        raise EmptyPlanError(f"--full is for problem sets; {source} is a method: --count says how many configurations")
    for option in () if own else ("robot", "hand", "rows"):
        if of_method[option] is not None:
            raise EmptyPlanError(f"--{option} is for a method of your own, a .py file; {source} is none")
    problems = _own_method(Path(source), tasks, robot, hand, rows, count, seed) if own else _source(source, tasks, full)
    plan = chosen([problems], backend, formulation, settings or ["high_accuracy"], jobs=jobs, time_limit=time_limit)
    words = ["sandbox", "run", source, *(["--full"] if full else [])]
    words += [word for name, value in of_method.items() if own and value is not None for word in (f"--{name}", str(value))]
    for option, values in (("--backend", backend), ("--formulation", formulation), ("--settings", settings), ("--task", task)):
        words += [word for value in values or () for word in (option, value)]
    with _bar() as tell:
        content = carry_out(plan, out, command=shlex.join(words), progress=tell, overwrite=overwrite)
    _summary(out, content)


def _source(source: str, tasks: tuple[str, ...] | None, full: bool) -> Any:
    """A problem set by name, or the problems of a file."""
    from problems import sets
    from sandbox.problem_file import read_problems

    if source in sets.SETS:
        found = sets.load(source, full)
        return found if tasks is None else found.narrowed(tasks)
    if Path(source).suffix or Path(source).exists():
        if full:
            raise EmptyPlanError(f"--full is for problem sets; {source} is a file")
        return read_problems(Path(source), tasks)
    raise UnknownNameError.of("problem set", source, sets.SETS)


def _own_method(
    path: Path, tasks: tuple[str, ...] | None, robot: str | None, hand: str | None, rows: str | None, count: int, seed: int
) -> Any:
    """The situations of a method of the user's own; prints how it agrees with its own original, if it has one."""
    import numpy as np

    from problems import robots
    from problems.own_method import read_method
    from problems.robots.urdf import from_urdf
    from problems.sets.collect import grouped
    from problems.sets.methods import situations
    from sandbox.agreement import compare
    from sandbox.problem_set import ProblemSet

    method = read_method(path)
    if robot is None:
        raise EmptyPlanError(f"{path} is a method: say for which robot, --robot {'|'.join(robots.ROBOTS)}, or a URDF file")
    of_file = Path(robot).suffix == ".urdf" or Path(robot).is_file()
    if hand is not None and not of_file:
        raise EmptyPlanError(f"--hand is for a URDF file; {robot} is none")
    arm = from_urdf(Path(robot), hand or "") if of_file else robots.load(robot)
    arm = arm if rows is None else arm.task(rows)
    drawn = method.draw(arm, np.random.default_rng(seed), count)
    (group,) = grouped(situations(method, arm, drawn, seed), (method.task or "exact",))
    if method.original is not None:
        found = compare(method, arm, group.problem, method.original(arm, drawn.q, drawn.xdot), {})
        print(
            f"{method.name}: condition (7) holds at {found['held']} of {count} configurations of {arm.name}; framework and "
            f"original agree within their bounds at {found['agreed']}, largest relative difference {found['difference_max']}"
        )
    about = f"{path.name} on {arm.name}, {count} configurations of seed {seed}"
    found_set = ProblemSet(method.name, (group,), about)
    return found_set if tasks is None else found_set.narrowed(tasks)


@app.command()
def follow(
    methods: Annotated[list[str], typer.Argument(metavar="METHOD...", help="names or ids of `list methods`")],
    out: Annotated[Path, typer.Option("--out", help="run folder to make")],
    robot: Annotated[str, typer.Option("--robot", help="a name of `list robots`")] = "planar_3r",
    path: Annotated[str, typer.Option("--path", help="a curve of `list paths`")] = "square",
    size: Annotated[float | None, typer.Option("--size", help="of the curve [m]")] = None,
    cycles: Annotated[int, typer.Option("--cycles", min=1, help="rounds of a closed path")] = 1,
    begin: Annotated[
        str | None, typer.Option("--start", help="joint angles q_1,...,q_n [rad, m]; else the path's, or drawn by each method")
    ] = None,
    parameter: Annotated[
        Names, typer.Option("--parameter", metavar="METHOD.NAME=JSON", help="a parameter of one method; repeat for several")
    ] = None,
    measure: Annotated[Names, typer.Option("--measure", help="a measure to tell along the way; repeat for several")] = None,
    steps: Annotated[
        int | None, typer.Option("--steps", min=1, help="fixed control steps per round [integrated to 1e-12]")
    ] = None,
    svg: Annotated[Path | None, typer.Option("--svg", help="draw the postures after each round into this file")] = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> None:
    """Follow a path by one or several methods.

    Prints drift, task error, condition (7) on the way and singularities; keeps the motions, and draws them on request.
    """
    from rich.table import Table

    from problems import measures, paths, robots
    from problems.methods import load
    from reports.figure import write_drift_figure
    from sandbox.method_study import described, followed, motion_rows
    from sandbox.run_folder import keep_motions, refuse_foreign

    refuse_foreign(out, overwrite)
    arm, curve, chosen = robots.load(robot), paths.load(path, size), [load(name) for name in methods]
    given = _parameters(parameter or [], chosen)
    if svg is not None and not curve.closed:
        raise EmptyPlanError(f"--svg draws the postures after each round; {curve.name} is open")
    if svg is not None and svg.is_dir():
        raise InputFileError(f"{svg} is a folder; --svg names a file")
    if begin is None and curve.start is not None and len(curve.start) != arm.n:
        raise InputFileError(f"{curve.name} begins at {len(curve.start)} joint angles, {arm.name} has {arm.n}: give --start")
    start = curve.start if begin is None else _numbers(begin, arm.n)
    told = {name: measures.load(name, arm).value for name in measure or ()}
    found = [
        followed(method, arm, curve, cycles=cycles, q=start, steps=steps, parameters=given[method.name], measures=told)
        for method in chosen
    ]
    words = ["sandbox", "follow", *methods, "--robot", robot, "--path", path, "--cycles", str(cycles)]
    for option, value in (("--size", size), ("--start", begin), ("--steps", steps)):
        words += [] if value is None else [option, str(value)]
    for option, several in (("--parameter", parameter), ("--measure", measure)):
        words += [word for one in several or () for word in (option, one)]
    table = motion_rows(found)
    keep_motions(out, described(chosen), table, command=shlex.join(words), overwrite=overwrite)
    rows = [one.summary() for one in found]
    if as_json:
        _print_json(rows)
    else:
        common = ("method", "robot", "path", "cycles")
        drawn = Table("", *methods, title=", ".join(f"{name} {rows[0][name]}" for name in common[1:]), title_justify="left")
        for name in (name for name in rows[0] if name not in common):
            cells = (row[name] for row in rows)
            drawn.add_row(name, *(f"{value:.3g}" if isinstance(value, float) else str(value or "") for value in cells))
        _console().print(drawn)
    if svg is not None:
        written = write_drift_figure(out, svg, names=[method.name for method in chosen])
        print(f"figure: {written}", file=sys.stderr if as_json else sys.stdout)  # JSON stays alone


def _numbers(text: str, n: int) -> Any:
    """Joint coordinates from "q_1,...,q_n"."""
    import numpy as np

    try:
        values = [float(word) for word in text.split(",")]
    except ValueError as error:
        raise InputFileError(f"--start {text!r}: {error}; give {n} numbers, q_1,...,q_n") from error
    if len(values) != n:
        raise InputFileError(f"--start has {len(values)} numbers; this robot has {n} joints")
    return np.array(values)


def _parameters(given: list[str], methods: list[Any]) -> dict[str, dict[str, Any]]:
    """Parameters of each method from METHOD.NAME=JSON, a METHOD by its name or id."""
    named = {name: method for method in methods for name in (method.name, method.id)}
    found: dict[str, dict[str, Any]] = {method.name: {} for method in methods}
    for one in given:
        name, _, value = one.partition("=")
        method, _, parameter = name.partition(".")
        if method not in named or not parameter or not value:
            raise InputFileError(f"--parameter {one!r} is not METHOD.NAME=JSON with a METHOD of {', '.join(found)}")
        if parameter in found[named[method].name]:
            raise InputFileError(f"--parameter {method}.{parameter} is given twice; give it once")
        try:
            found[named[method].name][parameter] = json.loads(value)
        except (ValueError, RecursionError) as error:
            raise InputFileError(f"--parameter {one!r}: {value!r} is no JSON ({error})") from error
    return found


@app.command()
def paper(
    claim: Annotated[Names, typer.Option("--claim", help="a claim of `list claims`; repeat for several [all]")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="every claim at the reduced size of the tests")] = False,
    seed: Annotated[int, typer.Option("--seed", min=0, max=LARGEST_SEED, help="of everything drawn")] = 0,
    out: Annotated[Path | None, typer.Option("--out", help="run folder [runs/paper-DATE]")] = None,
    page: Annotated[Path, typer.Option("--page", help="where the HTML goes")] = Path("reports/out/paper.html"),
    overwrite: Overwrite = False,
    jobs: Annotated[int, typer.Option("--jobs", min=1, help="claims examined at the same time")] = _cores(),
) -> None:
    """Examine the paper claim by claim, and write the page that shows the evidence.

    Each claim of English & Maciejewski is computed on two code paths: reproduced, reproduced with a range, reproduced as
    corrected, or not reproduced. A fault is planted in each, at a reduced size, to see that the claim turns red.

    Exit status 1 when the evidence of a claim fails, or a planted fault goes unnoticed.
    """
    from reports.paper import write_paper
    from sandbox.claims.claim import State, Trial
    from sandbox.claims.ledger import carry_out, chosen
    from sandbox.claims.table import CLAIMS
    from sandbox.records import read_table
    from sandbox.run_folder import default_folder, refuse_foreign

    claims, folder = chosen(CLAIMS, claim), out or default_folder("paper")
    refuse_foreign(folder, overwrite)
    _refuse_no_file(page)
    words = ["sandbox", "paper", *(word for one in claims if claim for word in ("--claim", one.name))]
    words += [*(["--quick"] if quick else []), "--seed", str(seed)]
    with _bar() as tell:
        content = carry_out(
            claims, folder, command=shlex.join(words), overwrite=overwrite, told=tell, ledger=len(CLAIMS),
            trial=Trial(full=not quick, seed=seed, jobs=jobs),
        )  # fmt: skip
    rows = read_table(folder, "claims").sort_by("place").to_pylist()
    _print_table([
        {"claim": row["claim"], "where": row["where"], "state": row["state"],
         "fault": "noticed" if row["noticed"] else "NOT NOTICED"}
        for row in rows
    ])  # fmt: skip
    console = _console()
    number = {state: sum(row["state"] == state for row in rows) for state in State}
    counts = ", ".join(f"{count} {state}" for state, count in number.items() if count)
    told = f"{len(rows)} claim{'s' * (len(rows) != 1)}: {counts}; {content['timing']['wall']:.1f} s; evidence in {folder}"
    console.print(told, markup=False, highlight=False)
    try:
        _written(write_paper(folder, page))
    except OSError as error:
        raise InputFileError(f"{error}; the evidence is kept: `sandbox report {folder} --page FILE` writes its page") from error
    if any(row["state"] == State.UNSOUND or not row["noticed"] for row in rows):
        raise typer.Exit(1)


def _refuse_no_file(page: Path) -> None:
    """Let --page be a file that can be there: told before the work is done, not after it."""
    if page.is_dir():
        raise InputFileError(f"{page} is a folder; --page names a file")
    above = next(folder for folder in page.absolute().parents if folder.exists())
    if not above.is_dir():
        raise InputFileError(f"{above} is a file; --page {page} cannot lie in it")
    if not os.access(above, os.W_OK):
        raise InputFileError(f"{above} cannot be written to; name another file with --page")


def _written(page: Path) -> None:
    print(f"report: {page} ({page.stat().st_size / 1e6:.1f} MB)")


@app.command()
def report(
    folder: Run,
    page: Annotated[
        Path | None, typer.Option("--page", help="where the HTML goes [reports/out/verification.html or paper.html]")
    ] = None,
) -> None:
    """Write the HTML report of a run, or the page of the paper's claims where it holds those."""
    from reports.paper import write_paper
    from reports.verification import write_report
    from sandbox.records import read_run

    of_paper = read_run(folder).get("kind") == "paper"
    page = page or Path("reports/out") / ("paper.html" if of_paper else "verification.html")
    _refuse_no_file(page)
    _written(write_paper(folder, page) if of_paper else write_report(folder, page))


@app.command()
def query(
    statement: Annotated[
        str, typer.Argument(metavar="SELECT", help='one SELECT in SQL, as "select verdict, count(*) from records group by 1"')
    ],
    folder: Run,
    limit: Annotated[int | None, typer.Option("--limit", min=1, help="rows at most [100 in a table, else all]")] = None,
    parquet: Annotated[Path | None, typer.Option("--parquet", help="write the rows into this file instead")] = None,
    as_json: Json = False,
) -> None:
    """Answer one SELECT over a run, read-only, in DuckDB's SQL.

    Its tables are records, problems, truth, methods, motions, claims, checks and exhibits, as far as the run has them;
    `describe records` tells the columns. Neither other files nor the net are in reach.
    """
    from sandbox import query as asking

    if parquet is not None:
        if as_json:
            raise InputFileError("--json and --parquet are two places for the same rows; name one")
        print(f"{asking.write_answer(folder, statement, parquet, limit)} rows in {parquet}")
        return
    shown = limit or asking.SHOWN
    with asking.answered(folder, statement, limit if as_json else shown + 1) as answer:  # one more tells that there are more
        if as_json:
            sys.stdout.writelines(asking.json_rows(answer))
        else:
            console = _console()
            for part in asking.table(answer, shown):
                console.print(part)


@app.command()
def compare(
    before: Annotated[Path, typer.Argument(metavar="RUN", help="the earlier run folder")],
    after: Annotated[Path, typer.Argument(metavar="RUN", help="the later run folder")],
    page: Annotated[Path | None, typer.Option("--page", help="write an HTML page of it, too")] = None,
    as_json: Json = False,
) -> None:
    """Compare two runs record by record: verdicts, accuracy, what is missing, versions, and time by a rank test.

    Exit status 1 when something that was verified in the first run is a false success or a crash in the second, else 0.
    """
    from reports.comparison import write_comparison
    from sandbox import compare as comparing

    found = comparing.compare(before, after)
    if as_json:
        _print_json(found)
    else:
        console = _console()
        for part in comparing.tables(found):
            console.print(part)
    if page is not None:
        written = write_comparison(found, page)
        print(f"page: {written} ({written.stat().st_size / 1e6:.1f} MB)", file=sys.stderr if as_json else sys.stdout)
    if found["fallen"]:
        raise typer.Exit(1)


@app.command()
def show(
    folder: Run,
    problem: Annotated[str, typer.Argument(metavar="PROBLEM", help="problem id, or the beginning of one")],
    backend: Annotated[str | None, typer.Option("--backend", help="only this backend")] = None,
    formulation: Annotated[str | None, typer.Option("--formulation", help="only this formulation")] = None,
    settings: Annotated[str | None, typer.Option("--settings", help="only this settings level")] = None,
    script: Annotated[
        bool, typer.Option("--script", help="print a Python file that repeats it without the sandbox [of closed_form:eq6]")
    ] = False,
    as_json: Json = False,
) -> None:
    """One case in full, or as a stand-alone script."""
    from sandbox import case
    from sandbox.script import script as script_of

    found = case.read_case(folder, problem)
    if script:
        print(script_of(found, backend or "closed_form:eq6", formulation or "direct", settings or "high_accuracy"))
    elif as_json:
        _print_json(case.as_json(found, backend=backend, formulation=formulation, settings=settings))
    else:
        print(case.text(found, backend=backend, formulation=formulation, settings=settings))


@app.command(name="list")
def list_(
    what: Annotated[str, typer.Argument(metavar="WHAT", help=", ".join(LISTS))],
    as_json: Json = False,
) -> None:
    """List what there is."""
    from sandbox.plan import known

    rows = LISTS[known("list", [what], LISTS)[0]]()
    if as_json:
        _print_json(rows)
    else:
        _print_table(rows)


@app.command()
def implicit(
    sizes: Annotated[str | None, typer.Option("--sizes", metavar="N,N,...", help="numbers of joints [3 to 30]")] = None,
    as_json: Json = False,
) -> None:
    """Count what implicit forms save, N'W and N'a from N alone.

    Beside them W and grad f are formed first. Counted are multiplications, divisions, additions and subtractions of N'W or
    N'a; sines, cosines and negations are not, and neither is the rest of eq. (6), which both sides share: "of all" is what
    is saved of the whole. The time is implicit over explicit on this machine; above 1 the implicit form is slower.
    """
    from sandbox.implicit_study import FORMS, SIZES, implicit_study

    try:
        joints = SIZES if sizes is None else [int(word) for word in sizes.split(",")]
    except ValueError as error:
        raise InputFileError(f"--sizes {sizes!r}: {error}; give whole numbers, as 3,7,30") from error
    rows = sorted(implicit_study(joints), key=lambda row: FORMS.index(row["form"]))
    if as_json:
        _print_json(rows)
        return
    _print_table([
        {"form": row["form"], "arm": row["family"], "n": row["n"], "k": row["k"],
         "explicit": row["explicit_multiplications"] + row["explicit_additions"],
         "implicit": row["implicit_multiplications"] + row["implicit_additions"],
         "saved": f"{row['saved']:.0%}", "of all": f"{row['saved_of_all']:.0%}", "time": f"{row['time_ratio']:.2f}"}
        for row in rows
    ])  # fmt: skip


@app.command()
def probe(
    backend: Annotated[Names, typer.Option("--backend", help="backend or library; repeat for several [all]")] = None,
    instances: Annotated[int, typer.Option("--instances", min=1, help="seeded instances per claim")] = 50,
    folder: Annotated[
        Path | None, typer.Option("--into", help="keep the result in this run's run.json, for its report")
    ] = None,
    as_json: Json = False,
) -> None:
    """Measure what each backend promises, and what it does not."""
    from sandbox import probe as probing
    from sandbox.records import read_run, write_json

    content = None if folder is None else read_run(folder)
    with _bar() as tell:
        rows = probing.probe(backend, instances=instances, progress=tell)
    if folder is not None and content is not None:
        write_json({**content, "probe": rows}, folder / "run.json")
    if as_json:
        _print_json(rows)
    else:
        _console().print(probing.table(rows))


@app.command()
def certify(
    count: Annotated[int, typer.Option("--count", min=1, help="problems in all, about")] = 1_000_000,
    seed: Annotated[int, typer.Option("--seed", min=0, help="of everything drawn")] = 0,
    jobs: Annotated[int, typer.Option("--jobs", min=1, help="processes")] = _cores(),
    as_json: Json = False,
) -> None:
    """Compare certificates in floats with exact arithmetic, on problems of all sets and on harder ones.

    Exit status 1 when a certificate is wrong.
    """
    from problems.sets import SETS
    from sandbox import certificate_study

    with _bar() as tell:
        rows, wrong = certificate_study.study(list(SETS.values()), count, seed, jobs=jobs, progress=tell)
    if as_json:
        _print_json({"rows": rows, "wrong": wrong})
    else:
        console = _console()
        console.print(certificate_study.table(rows))
        for line in wrong[:20]:
            console.print(f"wrong: {line}", markup=False, highlight=False)
    if wrong:
        raise typer.Exit(1)


@app.command()
def bench(
    only: Annotated[Names, typer.Option("--only", help="a figure by its name; repeat for several [all]")] = None,
    out: Annotated[Path | None, typer.Option("--out", help="also write the JSON to this file")] = None,
    as_json: Json = False,
) -> None:
    """Measure every promised speed, each as a ratio, on this machine.

    What is compared is timed in turn, on one core unless said; the figure is of the least times, beside it median and
    quartiles over the rounds. Peers (qpbenchmark, pink, mink) are measured where they are installed.
    """
    if out is not None and (out.is_dir() or not out.parent.is_dir()):
        raise InputFileError(f"{out} is no file that could be written; --out names one in a folder that there is")
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[name] = "1"  # before numpy is loaded
    from sandbox.bench.run import bench as measured
    from sandbox.bench.run import chosen, text_beside, text_conditions, text_rows
    from sandbox.records import write_json

    chosen(only)
    words = ["sandbox", "bench", *(word for name in only or () for word in ("--only", name))]
    with _bar() as tell:
        content = measured(only, command=shlex.join(words), told=tell)
    if out is not None:
        write_json(content, out)
    if as_json:
        _print_json(content)
        return
    console = _console()
    for line in text_conditions(content):
        console.print(line, markup=False, highlight=False)
    _print_table(text_rows(content))
    for line in text_beside(content):
        console.print(line, markup=False, highlight=False)


@app.command()
def export(
    folder: Run,
    parquet: Annotated[Path, typer.Option("--parquet", help="file to write")],
) -> None:
    """All records of a run in one Parquet file."""
    from sandbox.run_folder import exported

    exported(folder, parquet, print)


def main() -> None:
    """Run the command; a wrong input is one line and exit status 2, Ctrl-C and a polite kill exit with 130."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        status = app(standalone_mode=False)
    except SandboxError as error:
        print(f"error: {' '.join(str(error).split())}", file=sys.stderr)
        status = 2
    except typer.Exit as stop:
        status = stop.exit_code
    except KeyboardInterrupt:
        status = 130
    except (typer.Abort, OSError, UnicodeError) as error:
        print(f"error: {error}", file=sys.stderr)
        status = 2
    except Exception as error:
        # click's own usage errors carry their exit code and formatting
        if hasattr(error, "show") and hasattr(error, "exit_code"):
            error.show()
            status = error.exit_code
        else:
            raise
    if status == 130:  # typer, too, makes this of Ctrl-C
        print("interrupted; what was done is kept", file=sys.stderr)
    sys.exit(status or 0)


if __name__ == "__main__":
    main()
