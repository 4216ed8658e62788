"""URDF files: what is read, what is locked, and what is refused in one line with the way out."""

from __future__ import annotations

import os
import re

import numpy as np
import pinocchio as pin
import pytest

from problems.robots.urdf import from_urdf
from sandbox.errors import InputFileError, RangeError, SandboxError, ShapeError, UnknownNameError

TREE = """<robot name="tree">
  <link name="base"/>
  <link name="upper"><inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="lower"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="finger"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <axis xyz="0 0 1"/><limit lower="-1" upper="2" velocity="3" effort="1"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/>
    <origin xyz="1 0 0"/><axis xyz="0 0 1"/><limit lower="-2" upper="1" velocity="4" effort="1"/></joint>
  <joint name="grip" type="prismatic"><parent link="lower"/><child link="finger"/>
    <origin xyz="1 0 0"/><axis xyz="1 0 0"/><limit lower="0" upper="1" velocity="5" effort="1"/></joint>
</robot>"""


def written(tmp_path, text, name="arm.urdf"):
    path = tmp_path / name
    path.write_text(text)
    return path


def changed(old, new):
    """TREE with one passage changed."""
    assert old in TREE
    return TREE.replace(old, new, 1)


def test_joints_between_base_and_hand_move(tmp_path):
    """What is not between base and hand is locked and its mass carried; limits and rates are the file's."""
    path = written(tmp_path, TREE)
    arm = from_urdf(path, "lower", rows="planar")
    assert (arm.name, arm.n, arm.m, arm.hand, arm.about) == ("tree", 2, 2, "lower", "from arm.urdf")
    assert (arm.lower.tolist(), arm.upper.tolist(), arm.rate_limits.tolist()) == ([-1, -2], [2, 1], [3, 4])
    assert from_urdf(path, "finger").n == 3
    carried = sum(mass for _, mass, _, _ in arm.bodies())
    assert carried == 4
    assert arm.inertia(np.zeros(2))[1, 1] == 1 + 1 + 1  # both links about the elbow, the finger 1 m from it


def test_chosen_joints_move(tmp_path):
    """`keep` says which joints move, in the order of the file; `name` how records call the robot."""
    arm = from_urdf(written(tmp_path, TREE), "finger", keep=["grip", "shoulder"], name="mine", rows=(0, 1), about="a test")
    assert (arm.name, arm.n, arm.prismatic.tolist(), arm.about) == ("mine", 2, [False, True], "a test")
    np.testing.assert_allclose(arm.jacobian(np.array([0.0, 0.5])), [[0, 1], [2.5, 0]], atol=1e-15)


def test_link_and_joint_of_one_name(tmp_path):
    """Where a joint is called like a link, the hand is the link; where pinocchio cannot lock then, the way out is told."""
    same = written(tmp_path, changed('<joint name="elbow"', '<joint name="lower"'))
    arm = from_urdf(same, "lower")
    assert arm.frame("lower") == arm.model.getFrameId("lower", pin.FrameType.BODY)
    assert arm.frame("lower") != arm.model.getFrameId("lower", pin.FrameType.JOINT)
    q, other = np.array([0.4, -1.2]), from_urdf(written(tmp_path, TREE, "other.urdf"), "lower")
    for compute in ("jacobian", "inertia", "gravity_torque"):
        np.testing.assert_array_equal(getattr(arm, compute)(q), getattr(other, compute)(q))
    with pytest.raises(InputFileError, match=r"cannot lock joints of .*different names"):
        from_urdf(written(tmp_path, changed('<joint name="shoulder"', '<joint name="upper"')), "lower")


def test_file_without_a_name(tmp_path):
    """A robot without a name is called like its file."""
    assert from_urdf(written(tmp_path, changed(' name="tree"', ' name=""'), "crane.urdf"), "lower").name == "crane"


TURNS = changed('type="revolute"', 'type="{}"')


@pytest.mark.parametrize(
    "text, says",
    {
        "empty": ("", "no element found"),
        "no xml": ("hello", "syntax error"),
        "cut off": (TREE[:-30], "unclosed token|not well-formed|mismatched"),
        "unknown encoding": ("<?xml version='1.0' encoding='klingon'?>" + TREE, "unknown encoding"),
        "other root": ("<house/>", "Could not find the 'robot' element"),
        "no links": ("<robot name='r'/>", "No link elements"),
        "no limits": (changed('<limit lower="-1" upper="2" velocity="3" effort="1"/>', ""), "does not specify limits"),
        "unknown type": (changed('type="revolute"', 'type="rotary"'), "no known type .rotary"),
        "unknown parent": (changed('<parent link="base"/>', '<parent link="bass"/>'), r"parent link \[bass\]"),
        "no number": (changed('lower="-1"', 'lower="low"'), "not a valid float"),
        "NaN limit": (changed('lower="-1"', 'lower="nan"'), "not a valid float"),
        "NaN axis": (changed('<axis xyz="0 0 1"/>', '<axis xyz="0 0 nan"/>'), "Malformed axis"),
        "an inertia that would be dropped": (changed('ixx="1"', 'ixx="nan"'), "ixx is not a valid double"),
    }.values(),
    ids=lambda value: None,
)
def test_files_that_do_not_parse(tmp_path, capfd, text, says):
    """A file that pinocchio does not read without complaint is refused with its complaint, and nothing is printed."""
    path = written(tmp_path, text)
    with pytest.raises(InputFileError, match=says) as caught:
        from_urdf(path, "lower")
    assert str(path) in str(caught.value) and "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


def test_stderr_is_given_back(tmp_path, capfd):
    """After a file was refused the process writes to its stderr as before."""
    with pytest.raises(InputFileError):
        from_urdf(written(tmp_path, "<house/>"), "lower")
    os.write(2, b"still here")
    assert capfd.readouterr().err == "still here"


def test_files_that_are_not_there(tmp_path):
    """A missing file and a folder are refused by name."""
    with pytest.raises(InputFileError, match=r"cannot read .*gone.urdf: No such file"):
        from_urdf(tmp_path / "gone.urdf", "lower")
    with pytest.raises(InputFileError, match=re.escape(f"cannot read {tmp_path}: Is a directory")):
        from_urdf(str(tmp_path), "lower")


@pytest.mark.parametrize(
    "arguments, kind, says",
    [
        ({"hand": "hand"}, UnknownNameError, "no frame of .* is called 'hand'; there are: base, elbow, finger, "),
        ({"keep": ["wrist"]}, UnknownNameError, "no movable joint of .* is called 'wrist'; there are: elbow, grip, shoulder"),
        ({"keep": []}, ShapeError, "no joint of .* moves 'lower'"),
        ({"hand": "base"}, ShapeError, "no joint of .* moves 'base'; choose another hand"),
        ({"rows": "place"}, UnknownNameError, "no task is called 'place'"),
        ({"rows": (1, 1)}, RangeError, r"different numbers of 0\.\.5"),
    ],
    ids=lambda value: str(value) if isinstance(value, dict) else "",
)
def test_wrong_names(tmp_path, arguments, kind, says):
    """A frame, joint or task that there is not is refused; the message lists those there are."""
    with pytest.raises(kind, match=says) as caught:
        from_urdf(written(tmp_path, TREE), **{"hand": "lower", **arguments})
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "text, kind, says",
    [
        (TURNS.format("continuous"), ShapeError, "'shoulder' .* is continuous.*limits and the type revolute.*keep"),
        (TURNS.format("floating"), ShapeError, "'shoulder' .* is floating.*lock it"),
        (TURNS.format("planar"), ShapeError, "'shoulder' .* is planar.*lock it"),
        (changed("</joint>", '<mimic joint="elbow"/></joint>'), ShapeError, "'shoulder' .* mimics 'elbow'; lock it"),
        (changed('<axis xyz="0 0 1"/>', '<axis xyz="0 0 0"/>'), RangeError, "'shoulder' of tree has no axis"),
        (changed('mass value="2"', 'mass value="-2"'), RangeError, "'shoulder' of tree has mass -2"),
        (changed('lower="-1" upper="2" ', ""), RangeError, "'shoulder' of tree has lower limit 0, upper limit 0"),
    ],
    ids=["continuous", "floating", "planar", "mimic", "no axis", "negative mass", "no room"],
)
def test_joints_that_are_not_supported(tmp_path, text, kind, says):
    """A joint that does not turn or slide by one bounded coordinate of its own is refused, with the way out, which works."""
    path = written(tmp_path, text)
    with pytest.raises(kind, match=says) as caught:
        from_urdf(path, "lower")
    assert isinstance(caught.value, SandboxError) and "\n" not in str(caught.value)
    if "mass" not in says:
        assert from_urdf(path, "lower", keep=["elbow"]).n == 1
