"""The robots that every test of this folder runs on: those of the table, and mechanisms that no row has."""

from __future__ import annotations

import os
from importlib import metadata

import numpy as np
import pinocchio as pin
import pytest

from problems.robots import ROBOTS, load
from problems.robots import denavit_hartenberg as table
from problems.robots.denavit_hartenberg import Link
from problems.robots.example_robots import DISTRIBUTION
from problems.robots.planar import planar_arm
from problems.robots.robot import Robot
from problems.robots.urdf import from_urdf

OBLIQUE = """<robot name="oblique">
  <link name="base"/>
  {links}
  <joint name="one" type="revolute"><parent link="base"/><child link="l1"/>
    <origin xyz="0.1 0.2 0.3" rpy="0.3 -0.4 0.5"/><axis xyz="1 2 2"/>
    <limit lower="-2" upper="2" velocity="1" effort="1"/></joint>
  <joint name="two" type="prismatic"><parent link="l1"/><child link="l2"/>
    <origin xyz="-0.3 0.1 0.2" rpy="1.3 0.4 -0.5"/><axis xyz="2 -1 2"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
  <joint name="three" type="revolute"><parent link="l2"/><child link="l3"/>
    <origin xyz="0.3 0.4 0.1" rpy="-0.3 1.4 0.5"/><axis xyz="-3 0 4"/>
    <limit lower="-2" upper="2" velocity="1" effort="1"/></joint>
  <joint name="four" type="revolute"><parent link="l3"/><child link="l4"/>
    <origin xyz="0.1 -0.4 0.2" rpy="0.7 0.1 0.2"/><axis xyz="0 -1 0"/>
    <limit lower="-2" upper="2" velocity="1" effort="1"/></joint>
</robot>"""
LINK = """<link name="l{i}"><inertial><origin xyz="0.1 0.2 -0.1" rpy="0.2 0.1 0.4"/><mass value="{i}.5"/>
  <inertia ixx="0.5" iyy="0.4" izz="0.6" ixy="0.02" ixz="-0.03" iyz="0.05"/></inertial></link>"""


def rods() -> Robot:
    """Uneven rods in the plane, with the tip's angle."""
    return planar_arm([1.0, 0.7, 0.4], [2.0, 0.5, 1.5], rods=True, name="rods").task("planar pose")


def rrpr() -> Robot:
    """Two turns, a slide and a turn."""
    links = (Link(d=0.4, alpha=np.pi / 2), Link(a=0.3, alpha=1.1), Link(d=0.2, slides=True, alpha=-0.4), Link(a=0.2, theta=0.3))
    model = table.arm("rrpr", links)
    table.limit(model, [-2, -2, 0.1, -2], [2, 2, 0.9, 2], [1, 1, 0.5, 1])
    for joint, mass in enumerate((3.0, 2.0, 1.5, 0.5), start=1):
        body = pin.Inertia(mass, np.array([0.05, 0.1, -0.1]), np.diag([0.02, 0.03, 0.04]))
        model.appendBodyToJoint(joint, body, pin.SE3.Identity())
    model.armature = np.array([0.1, 0.2, 0.3, 0.4])
    return Robot("rrpr", model, "hand", (0, 1, 2))


def gantry() -> Robot:
    """Three slides along x, y, z, then one along the diagonal; no limits."""
    model, joint = pin.Model(), 0
    diagonal = pin.JointModelPrismaticUnaligned(np.ones(3) / np.sqrt(3))
    for axis, moving in enumerate((pin.JointModelPX(), pin.JointModelPY(), pin.JointModelPZ(), diagonal)):
        joint = model.addJoint(joint, moving, pin.SE3.Identity(), f"slide_{axis}")
        model.appendBodyToJoint(joint, pin.Inertia.FromSphere(2.0 + axis, 0.1), pin.SE3.Identity())
    model.addFrame(pin.Frame("hand", joint, 0, pin.SE3(np.eye(3), np.array([0.1, 0.2, 0.3])), pin.FrameType.OP_FRAME))
    return Robot("gantry", model, "hand", (0, 1, 2))


def installed() -> bool:
    """Whether the files of the extra are there."""
    try:
        metadata.version(DISTRIBUTION)
    except metadata.PackageNotFoundError:
        return False
    return True


BUILT = {"rods": rods, "rrpr": rrpr, "gantry": gantry}
NAMES = [name for name, row in ROBOTS.items() if row.extra is None or installed()]


@pytest.fixture(scope="session")
def oblique(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    """A URDF with axes along no coordinate, one of them a slide."""
    path = tmp_path_factory.mktemp("urdf") / "oblique.urdf"
    path.write_text(OBLIQUE.format(links="\n".join(LINK.format(i=i) for i in (1, 2, 3, 4))))
    return from_urdf(path, "l4", rows="position")


@pytest.fixture(scope="session")
def extra() -> None:
    """The extra `robots`; without it a failure with CI=true, else a named skip."""
    if not installed():
        told = f"{DISTRIBUTION} is not installed: pip install velocity-sandbox[robots]"
        if os.environ.get("CI") == "true":
            pytest.fail(told)
        pytest.skip(told)


@pytest.fixture(scope="session")
def mixed() -> Robot:
    """The arm of turns and a slide."""
    return rrpr()


@pytest.fixture(scope="session")
def slides() -> Robot:
    """The arm of slides alone."""
    return gantry()


@pytest.fixture(scope="session", params=[*NAMES, "planar_6r", *BUILT, "oblique"])
def robot(request: pytest.FixtureRequest) -> Robot:
    """Every robot that is there; what is missing is counted in test_table.py."""
    if request.param == "oblique":
        return request.getfixturevalue("oblique")
    return BUILT[request.param]() if request.param in BUILT else load(request.param)


@pytest.fixture(scope="session")
def q(robot: Robot) -> np.ndarray:
    """Twenty seeded configurations (20, n) within the limits."""
    rng = np.random.default_rng(20)
    return rng.uniform(np.maximum(robot.lower, -3), np.minimum(robot.upper, 3), (20, robot.n))
