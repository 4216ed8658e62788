"""The table of robots: every name loads, a wrong one lists the right ones, a missing extra says what to install."""

from __future__ import annotations

from importlib import metadata

import numpy as np
import pytest

from problems.robots import ROBOTS, example_robots, load
from problems.robots.planar import PLANAR_3R, PLANAR_4R
from problems.robots.robot import TASKS
from sandbox.errors import SandboxError, UnknownNameError

SIZES = {
    "planar_3r": (2, 3), "planar_4r": (2, 4), "seven_joint": (6, 7), "panda": (6, 7),
    "panda_urdf": (6, 7), "xarm7": (6, 7), "baxter_left": (6, 7), "talos_left": (6, 9),
}  # fmt: skip


def test_the_table_is_complete():
    """Each robot has a row under its own name; four need no extra."""
    assert {name: row.name for name, row in ROBOTS.items()} == {name: name for name in SIZES}
    assert [name for name, row in ROBOTS.items() if row.extra is None] == ["planar_3r", "planar_4r", "seven_joint", "panda"]
    assert {row.extra for row in ROBOTS.values()} == {None, "robots"}


@pytest.mark.parametrize("name", SIZES)
def test_every_robot_loads(request, name):
    """A robot is called as its row is, has the size that the row states, redundancy, limits, rates and a description."""
    if ROBOTS[name].extra:
        request.getfixturevalue("extra")
    robot = load(name)
    assert (robot.name, robot.m, robot.n) == (name, *SIZES[name])
    assert f"({robot.m} x {robot.n})" in ROBOTS[name].about and robot.about
    assert np.isfinite([robot.lower, robot.upper, robot.rate_limits]).all()
    assert np.all(robot.lower < robot.upper) and np.all(robot.rate_limits > 0)
    assert load(name) is robot


def test_joints_of_the_example_robots(extra):
    """Seven joints of each arm, and on Talos two of the torso before them, in the order of the chain."""
    expected = {
        "panda_urdf": [f"panda_joint{i}" for i in range(1, 8)],
        "xarm7": [f"joint{i}" for i in range(1, 8)],
        "baxter_left": [f"left_{joint}" for joint in ("s0", "s1", "e0", "e1", "w0", "w1", "w2")],
        "talos_left": ["torso_1_joint", "torso_2_joint", *(f"arm_left_{i}_joint" for i in range(1, 8))],
    }
    for name, joints in expected.items():
        assert list(load(name).model.names)[1:] == joints


def test_planar_arms_of_any_size():
    """planar_Nr is an arm of N unit links; 3 and 4 are those of the problem sets."""
    assert load("planar_3r") is PLANAR_3R and load("planar_4r") is PLANAR_4R
    for n in (1, 2, 6, 30):
        robot = load(f"planar_{n}r")
        assert (robot.name, robot.n) == (f"planar_{n}r", n)
        np.testing.assert_allclose(robot.forward(np.zeros(n))[0], [n, 0, 0], atol=1e-15 * n)
    assert load("planar_6r") is load("planar_6r")


def test_a_task_may_be_named():
    """A name is loaded with its usual task or with the one that is asked for."""
    assert load("panda").rows == TASKS["pose"] and load("panda", "position").rows == (0, 1, 2)
    assert load("planar_4r", "planar pose").m == 3 and load("planar_4r", (1,)).m == 1
    assert load("panda", task="position") is load("panda").task("position")
    with pytest.raises(UnknownNameError, match="no task is called 'place'"):
        load("panda", "place")


@pytest.mark.parametrize("name", ["pandas", "planar_0r", "planar_03r", "planar_100r", "planar_3r ", "", "Panda"])
def test_wrong_names_list_the_right_ones(name):
    """A name that is none is refused; the message lists all."""
    with pytest.raises(UnknownNameError, match=r"no robot is called .*; there are: baxter_left, panda, .*planar_Nr") as caught:
        load(name)
    assert all(known in str(caught.value) for known in ROBOTS)


def test_a_missing_extra_says_what_to_install(monkeypatch, tmp_path):
    """Without the package, or with one that lacks the file, the error names the extra."""

    def gone(name):
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(example_robots.metadata, "distribution", gone)
    says = r"example-robot-data is not installed: pip install velocity-sandbox\[robots\]"
    with pytest.raises(ImportError, match=says) as caught:
        example_robots.xarm7()
    assert isinstance(caught.value, SandboxError)

    class Empty:
        version = "0.0"

        def locate_file(self, path):
            return tmp_path / path

    monkeypatch.setattr(example_robots.metadata, "distribution", lambda name: Empty())
    with pytest.raises(SandboxError, match=r"example-robot-data 0.0 has no .*xarm7.urdf: pip install .*\[robots\]"):
        example_robots.xarm7()
