"""Robots, by name: numbers by pinocchio (`Robot`), expressions by CasADi (`Twin`), stacked over configurations."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from functools import cache
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, NamedTuple

from sandbox.check import line
from sandbox.errors import UnknownNameError
from sandbox.parameters import told

if TYPE_CHECKING:
    from problems.robots.robot import Robot


class Row(NamedTuple):
    """One robot: name, what it is, `load` gives it with its usual task; `extra` of the package that its files need."""

    name: str
    about: str
    load: Callable[[], Robot]
    extra: str | None = None


def _module(name: str) -> ModuleType:
    """Imported when a robot is asked for: the table itself needs neither pinocchio nor any file."""
    return import_module(f"problems.robots.{name}")


ROBOTS = {
    row.name: row
    for row in (
        Row("planar_3r", "planar arm, 3 unit links; position (2 x 3)", lambda: _module("planar").PLANAR_3R),
        Row("planar_4r", "planar arm, 4 unit links; position (2 x 4)", lambda: _module("planar").PLANAR_4R),
        Row("seven_joint", "spherical-revolute-spherical arm; pose (6 x 7)", lambda: _module("seven_joint").SEVEN_JOINT),
        Row("panda", "Franka Panda, published parameters; pose (6 x 7)", lambda: _module("panda").PANDA),
        Row("panda_urdf", "Franka Panda from its URDF; pose (6 x 7)", lambda: _module("example_robots").panda_urdf(), "robots"),
        Row("xarm7", "UFACTORY xArm7; pose (6 x 7)", lambda: _module("example_robots").xarm7(), "robots"),
        Row("baxter_left", "Rethink Baxter, left arm; pose (6 x 7)", lambda: _module("example_robots").baxter_left(), "robots"),
        Row("talos_left", "PAL Talos, torso, left arm; pose (6 x 9)", lambda: _module("example_robots").talos_left(), "robots"),
    )
}
"""The table; beside it planar_Nr is an arm of N unit links, N = 1..99."""

PLANAR = re.compile(r"planar_([1-9][0-9]?)r")


def load(name: str, task: str | Iterable[int] | None = None) -> Robot:
    """The robot of that name, asked for its usual task or for `task`, as in Robot.task; asked again, the same object.

    Raises UnknownNameError, which lists the names, and MissingExtraError where an extra is not installed.
    """
    robot = _loaded(name if isinstance(name, str) else told(name))
    return robot if task is None else robot.task(task)


@cache
def _loaded(name: str) -> Robot:
    if name in ROBOTS:
        return ROBOTS[name].load()
    planar = PLANAR.fullmatch(name)
    if planar is None:
        raise UnknownNameError.of("robot", line(name), [*ROBOTS, "planar_Nr for any N of 1..99"])
    return _module("planar").planar_arm([1.0] * int(planar[1]))
