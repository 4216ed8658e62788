"""Real robots from the URDF files of example-robot-data: the extra `robots`.

The package has no Python module of its own; only its files are used, and of them the kinematics, limits and inertias.
"""

from __future__ import annotations

from importlib import metadata
from pathlib import Path

from problems.robots.robot import Robot
from problems.robots.urdf import from_urdf
from sandbox.errors import SandboxError

DISTRIBUTION = "example-robot-data"
FOLDER = Path("cmeel.prefix/share/example-robot-data/robots")


class MissingExtraError(SandboxError, ImportError):
    """A robot needs files of a package that is not installed."""


def panda_urdf() -> Robot:
    """Franka Panda with its hand: the tool centre point's pose, fingers locked closed."""
    path = _file("panda_description/urdf/panda.urdf")
    return from_urdf(path, "panda_hand_tcp", name="panda_urdf", about="Franka Panda of example-robot-data")


def xarm7() -> Robot:
    """UFACTORY xArm7: the pose of its tool flange."""
    path = _file("xarm_description/urdf/xarm7.urdf")
    return from_urdf(path, "link_eef", name="xarm7", about="UFACTORY xArm7 of example-robot-data")


def baxter_left() -> Robot:
    """Rethink Baxter, left arm of seven joints: the pose of its gripper; head, right arm and fingers locked."""
    path = _file("baxter_description/urdf/baxter.urdf")
    return from_urdf(path, "left_gripper", name="baxter_left", about="left arm of Rethink Baxter, of example-robot-data")


def talos_left() -> Robot:
    """PAL Talos, two joints of the torso and seven of the left arm: the pose of the plate that carries the gripper.

    The pelvis is fixed; legs, head, right arm and gripper are locked at zero, so the torso carries what hangs on it.
    """
    path = _file("talos_data/robots/talos_reduced.urdf")
    about = "torso and left arm of PAL Talos, of example-robot-data"
    return from_urdf(path, "wrist_left_ft_tool_link", name="talos_left", about=about)


def _file(name: str) -> Path:
    try:
        package = metadata.distribution(DISTRIBUTION)
    except metadata.PackageNotFoundError:
        raise MissingExtraError(f"{DISTRIBUTION} is not installed: pip install velocity-sandbox[robots]") from None
    path = Path(str(package.locate_file(FOLDER / name)))
    if not path.is_file():
        told = f"{DISTRIBUTION} {package.version} has no {FOLDER / name}"
        raise MissingExtraError(f"{told}: pip install --force-reinstall velocity-sandbox[robots]")
    return path
