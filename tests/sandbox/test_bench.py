"""The benchmarks measure what they say: at tiny sizes every figure comes out, with its target; nothing here is about speed."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from problems import robots
from problems.methods import METHODS
from sandbox.bench import differential_ik, solvers
from sandbox.bench.closed_forms import Prepared, machine
from sandbox.bench.measured import Measured, each, rate, ratio
from sandbox.bench.race import Effort, one_core, race
from sandbox.bench.run import bench, text_beside, text_rows
from sandbox.bench.stack import stack
from sandbox.bench.table import BENCHMARKS, Benchmark
from sandbox.errors import SandboxError, UnknownNameError
from sandbox.law import rates
from sandbox.tolerances import UNIT

TINY = Effort(share=1 / 512, rounds=2)


@pytest.mark.parametrize("name", BENCHMARKS)
def test_every_figure_comes_out(name: str) -> None:
    """A benchmark gives a finite figure with its target beside it, or says how to install what it needs."""
    (row,) = bench([name], TINY)["figures"]
    (shown,) = text_rows({"figures": [row]})
    known = BENCHMARKS[name]
    missing = [package for module, package in known.needs if find_spec(module) is None]
    if missing:
        assert row["verdict"] == f"absent: pip install {' '.join(missing)}" and row["value"] is None and shown["measured"] == ""
    else:
        assert math.isfinite(row["value"]) and row["value"] >= 0
        assert row["value"] > 0 or known.unit == "%"
        assert row["verdict"] in (("shown",) if known.target is None else ("missed", "met", "stretch met"))
        assert all(isinstance(value, str) or math.isfinite(value) for value in row["beside"].values())
    if known.target is not None:
        assert shown["target"] == f"{'≥' if known.at_least else '≤'} {known.target:g}"


def test_targets_are_those_that_were_promised() -> None:
    """The bounds: 5 (3) and 9 (6) copies, 25 (40) times a solver, 5 times LAPACK, 3 us, 1 % of three sets."""
    bounds = {name: (row.at_least, row.target, row.stretch) for name, row in BENCHMARKS.items() if row.target is not None}
    expected = {
        "solvers": (True, 25, 40), "kkt": (True, 5, None), "enclosure": (False, 3, None),
        **{f"fallback_{name}": (False, 1, None) for name in ("manufactured", "planar", "seven_joint")},
        **{f"{name}_7x6{more}": (False, 5, 3) for name, more in (("eq6", ""), ("eq6", "_pivots"), ("eq2_5", ""))},
        **{f"{name}_12x6{more}": (False, 9, 6) for name, more in (("eq6", ""), ("eq6", "_pivots"), ("eq2_5", ""))},
    }  # fmt: skip
    assert bounds == expected


@pytest.mark.parametrize(
    "at_least, value, verdict",
    [(False, 3, "stretch met"), (False, 4, "met"), (False, 6, "missed"), (False, math.nan, "missed"), (True, 6, "stretch met"),
     (True, 4, "met"), (True, 2, "missed"), (True, math.nan, "missed")],
)  # fmt: skip
def test_a_target_is_met_or_missed(at_least: bool, value: float, verdict: str) -> None:
    """At most 5, stretch 3; at least 3, stretch 5: what is between is met, NaN is missed."""
    target, stretch = (3, 5) if at_least else (5, 3)
    row = Benchmark("b", "", "times", lambda effort: Measured(value), target, stretch, at_least)
    assert bench(["b"], TINY, table={"b": row})["figures"][0]["verdict"] == verdict


def test_what_is_not_installed_is_said() -> None:
    """A benchmark that needs a package that there is not says how to install it, and does not run."""
    row = Benchmark("b", "", "times", lambda effort: 1 / 0, 5, needs=(("no_such_module", "no-such"),))  # type: ignore[arg-type]
    (found,) = bench(["b"], TINY, table={"b": row})["figures"]
    assert found["verdict"] == "absent: pip install no-such" and found["value"] is None


def test_the_spread_is_that_of_the_rounds() -> None:
    """A ratio is of the least times; its median and quartiles are of the rounds' own ratios."""
    found = ratio(np.array([2.0, 6.0, 4.0]), np.array([1.0, 2.0, 4.0]))
    assert (found.value, found.low, found.median, found.high, found.rounds) == (2.0, 1.5, 2.0, 2.5, 3)
    assert each(np.array([4e-6, 2e-6]), 2).value == pytest.approx(1.0) and rate(np.array([4.0, 2.0]), 6).value == 3.0


def test_a_race_is_run_in_turn() -> None:
    """Every round runs all functions once, each beginning another; the first round is not timed."""
    ran: list[str] = []
    times = race({name: lambda name=name: ran.append(name) for name in "ab"}, 2)  # type: ignore[misc]
    assert ran == ["a", "b", "a", "b", "b", "a"] and {len(seconds) for seconds in times.values()} == {2}


def test_one_core_is_given_back(monkeypatch: pytest.MonkeyPatch) -> None:
    """Within one_core there is one core; after it, also after an error, there are those of before."""
    bound = [{0, 1, 3}]
    monkeypatch.setattr(os, "sched_getaffinity", lambda pid: bound[-1], raising=False)
    monkeypatch.setattr(os, "sched_setaffinity", lambda pid, cores: bound.append(cores), raising=False)
    with pytest.raises(KeyError), one_core():
        assert bound[-1] == {3}
        raise KeyError
    assert bound == [{0, 1, 3}, {3}, {0, 1, 3}]


@pytest.mark.parametrize("method", ["eq6", "eq2_5"])
def test_what_is_timed_solves_the_problems(method: str) -> None:
    """The machine that is timed finds the solution of the KKT systems that LAPACK is timed on, for every problem."""
    given = stack(6, 7, 40)
    K, right = given.kkt()
    run = Prepared(machine(method, 6, 7), given)
    run()
    whole = np.concatenate(run.outputs[:2], axis=1)
    residual = np.abs((K @ whole[..., None] - right)[..., 0]).max(axis=1)
    assert run.outputs[-1].all()
    size = np.linalg.norm(K, axis=(1, 2)) * np.linalg.norm(whole, axis=1)
    grown = np.linalg.cond(K) if method == "eq2_5" else np.linalg.cond(given.J) * np.linalg.cond(given.W)
    assert (residual <= 50 * 13 * UNIT * size * grown).all()


def test_a_solver_that_is_wrong_is_not_timed(monkeypatch: pytest.MonkeyPatch) -> None:
    """An engine whose answers are not those of eq. (6) ends the benchmark; one that is absent is named."""
    lost = {"lost": ("no_such_module", solvers.daqp), "daqp.solve": solvers.LOOPS["daqp.solve"]}
    monkeypatch.setattr(solvers, "LOOPS", lost)
    assert solvers.against_solvers(TINY).beside["lost"] == "absent: pip install no_such_module"

    def idle(given: object, X: np.ndarray) -> solvers.Loop:
        return lambda: X.fill(0.0)

    monkeypatch.setattr(solvers, "LOOPS", {"idle": ("numpy", idle)})
    with pytest.raises(SandboxError, match=r"idle is off by .* its time would mean nothing"):
        solvers.against_solvers(TINY)


def test_the_panda_is_asked_for_the_same_motion() -> None:
    """Rates by `law.rates` carry the hand to the target that the peers are given, but for the square of the step."""
    import pinocchio as pin

    robot = robots.load("panda")
    q, xdot, targets = differential_ik.motions(robot, 5)
    moved = q + differential_ik.STEP * rates(METHODS["gradient_projection"], robot, q, xdot, alpha=0.0)
    data = robot.model.createData()
    for after, target in zip(moved, targets, strict=True):
        pin.forwardKinematics(robot.model, data, after)
        pose = pin.updateFramePlacement(robot.model, data, robot.frame(robot.hand))
        assert np.linalg.norm(pin.log6(pose.actInv(target)).vector) < 2 * differential_ik.STEP**2


def test_the_same_arm_goes_to_mujoco() -> None:
    """Its description nests one body with one joint for every joint of the robot, and the hand on the last."""
    import xml.etree.ElementTree as ET

    robot = robots.load("panda")
    body = ET.fromstring(differential_ik.mjcf(robot)).find("worldbody")
    depth = 0
    while body is not None and (deeper := body.find("body")) is not None:
        body, depth = deeper, depth + 1
        assert len(body.findall("joint")) == 1
    assert depth == robot.n and body is not None and body.find("site") is not None


def test_an_unknown_name_is_a_line() -> None:
    """`--only` with a name that is none: UnknownNameError with the names there are, before anything is measured."""
    with pytest.raises(UnknownNameError, match=r"no benchmark is called 'eq7'; there are: campaign, "):
        bench(["kkt", "eq7"], TINY)
    done = _command("--only", "eq7")
    assert done.returncode == 2 and done.stderr.startswith("error: no benchmark is called 'eq7'; there are: ")
    assert len(done.stderr.splitlines()) == 1


def test_the_command_prints_table_and_json(tmp_path: Path) -> None:
    """The file that --out names holds what --json prints; versions, threads and the target stand in it."""
    file = tmp_path / "bench.json"
    done = _command("--only", "fallback_planar", "--json", "--out", str(file))
    content = json.loads(done.stdout)
    assert content == json.loads(file.read_text())
    assert content["conditions"]["threads"] == "1" and content["packages"]["numpy"] == np.__version__
    (row,) = content["figures"]
    assert (row["name"], row["bound"], row["target"], row["unit"]) == ("fallback_planar", "at most", 1, "%")
    assert text_beside(content) == [f"fallback_planar: problems {row['beside']['problems']}"]
    done = _command("--only", "fallback_planar")
    assert "fallback_planar" in done.stdout and "≤ 1" in done.stdout and "numpy" in done.stdout


def test_a_file_that_cannot_be_written_is_refused_first(tmp_path: Path) -> None:
    """--out with a folder, or in a folder that there is not, is one line before anything is measured."""
    for place in (tmp_path, tmp_path / "no" / "bench.json"):
        done = _command("--out", str(place))
        assert done.returncode == 2 and "names one in a folder that there is" in done.stderr


def _command(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "sandbox.cli", "bench", *words], capture_output=True, text=True)
