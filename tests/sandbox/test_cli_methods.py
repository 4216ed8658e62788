"""The commands for methods: what they list, follow and run, and that a wrong word is one line, status 2 and nothing written."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np
import pytest

from problems.methods import METHODS
from problems.paths import PATHS
from problems.robots import ROBOTS
from sandbox import cli
from sandbox.records import read_run, read_table

F1 = "0,1.5707963267948966,-1.5707963267948966"
DRIFT = float(np.linalg.norm((0.03204222423, -0.03306882381, -0.03101509742)))
"""Of the pseudoinverse around one square of side 0.4 from F1 (methods, Repeatability)."""

EXPLICIT = """
import numpy as np

alpha = 0.3

def method(robot, q):
    return robot.inertia(q)

def f(robot, q):
    return np.sum((np.asarray(q, float) - 0.2)**2, axis=-1) / 2

def gradient(robot, q):
    return q - 0.2
"""

IMPLICIT = """
import numpy as np

def implicit(robot, q, N):
    Nt = np.swapaxes(N, -1, -2)
    return Nt @ robot.inertia(q), 0.3 * (Nt @ (q - 0.2)[..., None])[..., 0]
"""

WITNESS = """
import numpy as np

def method(robot, q):
    return np.eye(robot.n)

def original(robot, q, xdot):
    return np.einsum("bnm,bm->bn", np.linalg.pinv(robot.jacobian(q)), xdot)
"""

LINK = """<link name="{name}"><inertial><mass value="1"/>
<inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial></link>
"""

JOINT = """<joint name="j{k}" type="revolute"><parent link="l{before}"/><child link="l{k}"/>
<origin xyz="{x} 0 0"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
"""

URDF = (
    '<robot name="three">'
    + "".join(LINK.format(name=name) for name in ("l0", "l1", "l2", "l3", "tip"))
    + "".join(JOINT.format(k=k, before=k - 1, x=int(k > 1)) for k in (1, 2, 3))
    + '<joint name="end" type="fixed"><parent link="l3"/><child link="tip"/><origin xyz="1 0 0"/></joint></robot>'
)
"""A planar arm of three unit links, as a file of one's own."""

ONE_METHOD = ["--robot", "planar_3r", "--backend", "numpy", "--out", "new", "--count", "5"]


class Done(NamedTuple):
    """What a command left behind."""

    status: int
    out: str
    err: str


Command = Callable[..., Done]


@pytest.fixture
def sandbox(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Iterator[Command]:
    """The command line, in this process, in a folder of its own that holds some files of the user's."""
    for name, text in (
        ("own.py", EXPLICIT), ("implicit.py", IMPLICIT), ("witness.py", WITNESS), ("three.urdf", URDF), ("none.py", "x = 1\n"),
        ("cut.urdf", URDF[:200]), ("page.urdf", "<html/>"), ("fails.py", "def method(robot, q):\n    return q.nothing\n"),
    ):  # fmt: skip
        (tmp_path / name).write_text(text)
    (tmp_path / "used").mkdir()
    (tmp_path / "used" / "thesis.tex").write_text("mine")
    monkeypatch.chdir(tmp_path)
    kept = signal.getsignal(signal.SIGTERM)  # main takes it for itself

    def command(*words: str) -> Done:
        monkeypatch.setattr(sys, "argv", ["sandbox", *words])
        with pytest.raises(SystemExit) as stop:
            cli.main()
        assert isinstance(stop.value.code, int)
        return Done(stop.value.code, *capfd.readouterr())

    yield command
    signal.signal(signal.SIGTERM, kept)


def test_all_methods_are_listed(sandbox: Command) -> None:
    """Twenty-three rows, M1 to M20 and C1 to C3, each with its fields; the table has them all."""
    done = sandbox("list", "methods", "--json")
    rows = json.loads(done.out)
    assert done.status == 0 and done.err == ""
    assert [row["id"] for row in rows] == [f"M{k}" for k in range(1, 21)] + ["C1", "C2", "C3"]
    assert [row["name"] for row in rows] == list(METHODS)
    for row in rows:
        assert set(row) == {"id", "name", "method", "W", "a", "condition (7)", "reference", "attribution"}
        assert all(isinstance(value, str) and value for value in row.values())
    drawn = sandbox("list", "methods")
    assert drawn.status == 0 and all(f" {row['id']} " in drawn.out for row in rows)


def test_robots_and_paths_are_listed(sandbox: Command) -> None:
    """By the names that other commands take."""
    robots = json.loads(sandbox("list", "robots", "--json").out)
    assert [row["name"] for row in robots] == list(ROBOTS) and {"planar_3r", "planar_4r", "panda"} <= set(ROBOTS)
    assert {row["needs"] for row in robots} == {"nothing more", "extra robots"}
    paths = json.loads(sandbox("list", "paths", "--json").out)
    assert [row["name"] for row in paths] == list(PATHS) and {row["closed"] for row in paths} == {"yes", "no"}
    for what, rows in (("robots", robots), ("paths", paths)):
        drawn = sandbox("list", what)
        assert drawn.status == 0 and drawn.out.count("\n") >= len(rows) + 4 and rows[0]["name"] in drawn.out


def test_follow_prints_a_table_and_keeps_the_motions(sandbox: Command, tmp_path: Path) -> None:
    """The printed drift, a run folder with both motions and the command that makes it again."""
    words = ["follow", "M1", "augmented_jacobian", "--out", "new", "--start", F1, "--parameter", "M1.alpha=0"]
    done = sandbox(*words)
    assert done.status == 0 and done.err == "" and f"{DRIFT:.3g}" in done.out
    for name in ("drift, first cycle", "smallest lambda_min(N'WN)", "peak joint rate", "Lie bracket", "path square, cycles 1"):
        assert name in done.out
    rows = read_table(tmp_path / "new", "motions").to_pylist()
    assert [row["method"] for row in rows] == ["gradient_projection", "augmented_jacobian"]
    assert rows[0]["drift"][0] == pytest.approx(DRIFT, abs=1e-11) and rows[1]["drift"][0] < 1e-11
    about = read_run(tmp_path / "new")
    assert [card["id"] for card in about["methods"]] == ["M1", "M11"] and about["complete"]
    assert about["command"] == (
        f"sandbox follow M1 augmented_jacobian --robot planar_3r --path square --cycles 1 --start {F1} --parameter M1.alpha=0"
    )
    page = sandbox("report", "new", "--page", "page.html")
    assert page.status == 0 and "Augmented Jacobian" in (tmp_path / "page.html").read_text(encoding="utf-8")


def test_follow_speaks_json_and_draws(sandbox: Command, tmp_path: Path) -> None:
    """With --json standard output is JSON alone, floats in full; the figure is an SVG of both methods."""
    done = sandbox(
        "follow", "gradient_projection", "augmented_jacobian", "--out", "new", "--start", F1, "--cycles", "2", "--size", "0.4",
        "--parameter", "gradient_projection.alpha=0", "--json", "--svg", "figures/drift.svg",
    )  # fmt: skip
    first, second = json.loads(done.out)
    assert done.status == 0 and done.err == "figure: figures/drift.svg\n"
    assert first["drift, first cycle"] == pytest.approx(DRIFT, abs=1e-11) and second["drift, last cycle"] < 1e-11
    assert (first["method"], first["robot"], first["path"], first["cycles"]) == (
        "gradient_projection", "planar_3r", "square", 2,
    )  # fmt: skip
    assert first["stopped"] is None and first["singularities"] == "" and second["secondary error"] < 1e-12
    root = ElementTree.parse(tmp_path / "figures" / "drift.svg").getroot()
    titles = [text.text for text in root.iter("{http://www.w3.org/2000/svg}text") if text.get("class") == "h"]
    assert titles == ["Liegeois gradient projection", "Augmented Jacobian"]


def test_a_motion_that_stops_is_told_not_failed(sandbox: Command) -> None:
    """Into its algorithmic singularity: exit status 0, where it ended, why, and which singularity it met."""
    done = sandbox(
        "follow", "M11", "--out", "new", "--path", "through_algorithmic_singularity", "--start", F1, "--json",
    )  # fmt: skip
    (row,) = json.loads(done.out)
    assert done.status == 0 and row["stopped"] and row["drift, first cycle"] is None
    assert row["singularities"].startswith("algorithmic, sigma_min(N'E') = ") and "t = 0.8368 s (end)" in row["singularities"]


def test_follow_takes_steps_and_any_robot(sandbox: Command, tmp_path: Path) -> None:
    """A robot of the planar family by its name, a given number of control steps, a run that is replaced."""
    words = ["follow", "M16", "--robot", "planar_5r", "--path", "circle", "--size", "0.1", "--out", "new"]
    assert sandbox(*words, "--steps", "50").status == 0
    (row,) = read_table(tmp_path / "new", "motions").to_pylist()
    assert (row["integrator"], len(row["t"]), row["n"]) == ("steps", 51, 5)
    refused = sandbox(*words)
    assert refused.status == 2 and "new holds a run" in refused.err
    assert sandbox(*words, "--overwrite").status == 0
    (row,) = read_table(tmp_path / "new", "motions").to_pylist()
    assert row["integrator"] == "solve_ivp"


FOLLOW = ["follow", "inertia_weighted", "--out", "new"]

WRONG_FOLLOW: list[tuple[list[str], str]] = [
    (["follow", "inertia_weigthed", "--out", "new"], "no method is called 'inertia_weigthed'; there are: C1, C2"),
    ([*FOLLOW, "--robot", "pandaa"], "no robot is called 'pandaa'; there are: baxter_left, panda"),
    ([*FOLLOW, "--path", "sqare"], "no path is called 'sqare'; there are: circle, figure_eight"),
    ([*FOLLOW, "--start", "0,1"], "--start has 2 numbers; this robot has 3 joints"),
    ([*FOLLOW, "--start", "0,a,1"], "--start '0,a,1': could not convert string to float: 'a'; give 3 numbers"),
    ([*FOLLOW, "--start", ""], "give 3 numbers, q_1,...,q_n"),
    ([*FOLLOW, "--start", "0,nan,1"], "q[1] is nan"),
    ([*FOLLOW, "--start", "0,0,0"], "its singular values are (3.74166, 0)"),
    (["follow", "M11", "--out", "new", "--start", "0,0,0"], "its singular values are (3.74, 0)"),
    (["follow", "M18", "--out", "new", "--start", F1], "condition (7) fails"),
    ([*FOLLOW, "--parameter", "alpha=0"], "'alpha=0' is not METHOD.NAME=JSON with a METHOD of inertia_weighted"),
    ([*FOLLOW, "--parameter", "inertia_weighted.alpha"], "is not METHOD.NAME=JSON"),
    ([*FOLLOW, "--parameter", "gradient_projection.alpha=0"], "is not METHOD.NAME=JSON with a METHOD of inertia_weighted"),
    (
        [*FOLLOW, "--parameter", "inertia_weighted.alpha=0"],
        "no parameter of inertia_weighted is called 'alpha'; there are: none",
    ),
    (
        ["follow", "M1", "--out", "new", "--parameter", "M1.alpah=0"],
        "no parameter of gradient_projection is called 'alpah'; there",
    ),
    (["follow", "M1", "--out", "new", "--parameter", "M1.alpha=0,5"], "'0,5' is no JSON"),
    (["follow", "M1", "--out", "new", "--parameter", "M1.alpha=[1,2]"], "alpha has shape (2,); it must be one number"),
    (["follow", "M1", "--out", "new", "--parameter", 'M1.alpha="a"'], "alpha must hold real numbers"),
    (["follow", "M1", "--out", "new", "--parameter", "M1.alpha=NaN"], "alpha is nan"),
    ([*FOLLOW, "--size", "0"], "side is 0.0; it must be one positive number"),
    ([*FOLLOW, "--size", "nan"], "side is nan"),
    ([*FOLLOW, "--path", "straight", "--cycles", "2"], "straight is open: it cannot be followed 2 times"),
    ([*FOLLOW, "--path", "straight", "--svg", "new.svg"], "--svg draws the postures after each round; straight is open"),
    ([*FOLLOW, "--svg", "used"], "used is a folder; --svg names a file"),
    ([*FOLLOW[:2], "--out", "used"], "used holds files that are no run"),
    ([*FOLLOW[:2], "--out", "own.py"], "own.py is a file; --out names a folder"),
    (FOLLOW[:2], "Missing option"),
    ([*FOLLOW, "--cycles", "0"], "Invalid value"),
    ([*FOLLOW, "--steps", "0"], "Invalid value"),
]

WRONG_RUN: list[tuple[list[str], str]] = [
    (["own.py"], "own.py is a method: say for which robot, --robot planar_3r|planar_4r"),
    (["own.py", "--robot", "nobody"], "no robot is called 'nobody'; there are: baxter_left"),
    (["own.py", "--robot", "absent.urdf", "--hand", "tip"], "cannot read absent.urdf: No such file"),
    (["own.py", "--robot", "cut.urdf", "--hand", "tip"], "cut.urdf is no URDF file that pinocchio reads"),
    (["own.py", "--robot", "page.urdf", "--hand", "tip"], "page.urdf is no URDF file that pinocchio reads"),
    (
        ["own.py", "--robot", "three.urdf"],
        "no frame of three.urdf is called ''; there are: end, j1, j2, j3, l0, l1, l2, l3, tip",
    ),
    (
        ["own.py", "--robot", "three.urdf", "--hand", "tipp"],
        "no frame of three.urdf is called 'tipp'; there are: end, j1, j2, j3",
    ),
    (["own.py", "--robot", "planar_3r", "--hand", "tip"], "--hand is for a URDF file; planar_3r is none"),
    (["own.py", "--robot", "planar_3r", "--rows", "xy"], "no task is called 'xy'; there are: orientation, planar"),
    (["own.py", "--robot", "planar_3r", "--full"], "--full is for problem sets; own.py is a method"),
    (["own.py", "--robot", "planar_3r", "--task", "best"], "no task is called 'best'"),
    (["own.py", "--robot", "planar_3r", "--backend", "gurobi"], "no backend is called 'gurobi'"),
    (["own.py", "--robot", "planar_3r", "--count", "0"], "Invalid value"),
    (["absent.py", "--robot", "planar_3r"], "absent.py: no such file"),
    (["none.py", "--robot", "planar_3r"], "none.py must define one of method(robot, q) and implicit(robot, q, N)"),
    (["fails.py", "--robot", "planar_3r"], "fails.py: method failed: AttributeError"),
    (["textbook", "--robot", "planar_3r"], "--robot is for a method of your own, a .py file; textbook is none"),
    (["textbook", "--rows", "pose"], "--rows is for a method of your own"),
]


@pytest.mark.parametrize(
    ("words", "said"),
    [*WRONG_FOLLOW, *((["run", *words, "--out", "new"], said) for words, said in WRONG_RUN)],
    ids=lambda value: " ".join(value)[:60] if isinstance(value, list) else "",
)
def test_what_is_wrong_is_one_line(sandbox: Command, tmp_path: Path, words: list[str], said: str) -> None:
    """Exit status 2, the reason on standard error and nothing on standard output, no folder or file left behind."""
    before = sorted(tmp_path.rglob("*"))
    done = sandbox(*words)
    assert done.status == 2 and said in done.err and done.out == ""
    assert "Traceback" not in done.err
    if "Usage:" not in done.err:
        assert done.err.startswith("error: ") and done.err.count("\n") == 1
    assert sorted(tmp_path.rglob("*")) == before and (tmp_path / "used" / "thesis.tex").read_text() == "mine"


@pytest.mark.parametrize("name", ["own", "implicit"])
def test_a_method_of_ones_own_is_run(sandbox: Command, tmp_path: Path, name: str) -> None:
    """Explicit or implicit: its situations are posed, answered and judged; the records say of which method and robot."""
    done = sandbox("run", f"{name}.py", *ONE_METHOD)
    assert done.status == 0 and "numpy:lstsq" in done.out and "agree within" not in done.out
    problems = read_table(tmp_path / "new", "problems").to_pylist()
    assert len(problems) == 5 and {(row["set"], row["method"], row["robot"]) for row in problems} == {(name, name, "planar_3r")}
    records = read_table(tmp_path / "new", "records").to_pylist()
    assert {row["verdict"] for row in records} == {"verified"} and {row["problem"] for row in records} == {
        row["problem"] for row in problems
    }
    assert read_run(tmp_path / "new")["command"] == (
        f"sandbox run {name}.py --robot planar_3r --count 5 --seed 0 --backend numpy"
    )  # fmt: skip


def test_explicit_and_implicit_are_the_same_motion(sandbox: Command, tmp_path: Path) -> None:
    """The weights differ by what the task rows hide; the rates do not."""
    rates = []
    for name in ("own", "implicit"):
        assert sandbox("run", f"{name}.py", *ONE_METHOD, "--overwrite").status == 0
        rows = read_table(tmp_path / "new", "truth").to_pylist()
        rates.append(np.array(sorted(row["x"] for row in rows)))
    np.testing.assert_allclose(rates[0], rates[1], rtol=1e-9)
    assert sandbox("run", "own.py", *ONE_METHOD, "--overwrite", "--seed", "1").status == 0
    other = np.array(sorted(row["x"] for row in read_table(tmp_path / "new", "truth").to_pylist()))
    assert np.abs(other - rates[0]).max() > 1e-3


def test_an_original_of_ones_own_is_compared(sandbox: Command, tmp_path: Path) -> None:
    """How many agree is printed; a wrong sign agrees nowhere."""
    done = sandbox("run", "witness.py", *ONE_METHOD)
    assert done.status == 0
    assert "condition (7) holds at 5 of 5 configurations of planar_3r" in done.out and "within their bounds at 5," in done.out
    (tmp_path / "witness.py").write_text(WITNESS.replace("xdot)\n", "-xdot)\n"))
    wrong = sandbox("run", "witness.py", *ONE_METHOD, "--overwrite")
    assert wrong.status == 0 and "within their bounds at 0," in wrong.out


def test_a_robot_of_ones_own_is_read(sandbox: Command, tmp_path: Path) -> None:
    """A URDF, the frame of the task and its rows: the numbers are those of the same arm by name."""
    words = ["--backend", "numpy", "--out", "new", "--count", "5"]
    done = sandbox("run", "witness.py", "--robot", "three.urdf", "--hand", "tip", "--rows", "planar", *words)
    assert done.status == 0 and "5 of 5 configurations of three" in done.out
    problems = read_table(tmp_path / "new", "problems").to_pylist()
    assert {(row["robot"], row["m"], row["n"]) for row in problems} == {("three", 2, 3)}
    for row in problems:
        turn = np.cumsum(row["q"])
        steps = np.stack([-np.sin(turn), np.cos(turn)])
        J = np.cumsum(steps[:, ::-1], axis=1)[:, ::-1]
        np.testing.assert_allclose(np.reshape(row["J"], (2, 3)), J, atol=1e-12)


def test_the_status_leaves_the_process(sandbox: Command, tmp_path: Path) -> None:
    """The same as a program: status 2 and one line on standard error, status 0 and JSON on standard output."""
    for words, status in ((["list", "paths", "--json"], 0), (["follow", "M99", "--out", "new"], 2)):
        done = subprocess.run(
            [sys.executable, "-m", "sandbox.cli", *words], capture_output=True, text=True, cwd=tmp_path, timeout=120,
            check=False,
        )  # fmt: skip
        assert done.returncode == status and done.stderr.count("\n") == (1 if status else 0)
        told: Any = done.stderr.startswith("error: no method is called 'M99'") if status else json.loads(done.stdout)
        assert told and not (tmp_path / "new").exists()
