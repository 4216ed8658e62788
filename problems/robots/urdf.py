"""Robots from URDF files."""

from __future__ import annotations

import os
import tempfile
import threading
from collections.abc import Callable, Collection, Iterable
from pathlib import Path
from typing import Any, TypeVar
from xml.etree import ElementTree

import pinocchio as pin

from problems.robots.robot import SLIDES, TASKS, Robot, frame
from sandbox import check
from sandbox.errors import InputFileError, ShapeError
from sandbox.parameters import chosen, told

T = TypeVar("T")


def from_urdf(
    path: str | Path,
    hand: str,
    *,
    name: str | None = None,
    keep: Collection[str] | None = None,
    rows: str | Iterable[int] = TASKS["pose"],
    about: str = "",
) -> Robot:
    """A robot from a URDF file; joints that are not kept are locked at their neutral position, meshes are not read.

    hand : link or frame whose velocity is the task
    name : how records call it; the file's own if left out
    keep : names of the joints that move; those between the base and the hand if left out
    rows : task rows, as in Robot.task

    Raises
    ------
    InputFileError
        for a file that is missing or that pinocchio does not read without complaint, with its first complaint; for
        joints to be locked that are called like a link
    UnknownNameError
        for a hand or joint that the file does not have; lists those it has
    ShapeError
        for a kept joint that is continuous, free, planar or mimics another one: says how to go on
    """
    if not isinstance(path, str | Path):
        raise InputFileError(f"{told(path)} names no file; give the path of a URDF file")
    path = Path(path)
    tree, model = _read(path)
    title = name or model.name or path.stem
    number = frame(model, hand, check.named(path))
    joints = list(model.names)[1:]
    if keep is None:
        keep = [model.names[i] for i in model.supports[model.frames[number].parentJoint] if i]
    keep = [keep] if isinstance(keep, str) or not isinstance(keep, Collection) else keep
    for joint in keep:
        chosen(f"movable joint of {check.named(path)}", joint, joints)
    types = {joint.get("name"): joint for joint in tree.iter("joint")}
    for joint in keep:
        _supported(joint, model, types.get(joint), path)
    locked = [i for i, joint in enumerate(model.names) if i and joint not in keep]
    try:
        model = pin.buildReducedModel(model, locked, pin.neutral(model)) if locked else model
    except ValueError as error:
        trouble = f"cannot lock joints of {check.named(path)}: {check.line(error)}"
        raise InputFileError(f"{trouble}; give its links and joints different names") from None
    if not model.nv:
        raise ShapeError(f"no joint of {check.named(path)} moves {hand!r}; choose another hand, or keep some joint")
    return Robot(title, model, hand, about=about or f"from {path.name}").task(rows)


def _supported(joint: str, model: pin.Model, element: Any, path: Path) -> None:
    told = f"joint {joint!r} of {check.named(path)}"
    if element is not None and element.find("mimic") is not None:
        raise ShapeError(f"{told} mimics {element.find('mimic').get('joint')!r}; lock it: name the others in keep", joint=joint)
    if model.joints[model.getJointId(joint)].shortname() not in SLIDES:
        kind = "free" if element is None else element.get("type")
        way = "give it limits and the type revolute, or " if kind == "continuous" else ""
        raise ShapeError(f"{told} is {kind}, not a bounded angle or slide; {way}lock it: name the others in keep", joint=joint)


def _read(path: Path) -> tuple[Any, pin.Model]:
    told = f"{check.named(path)} is no URDF file that pinocchio reads"
    try:
        text = path.read_bytes()
        tree = ElementTree.fromstring(text)
    except OSError as error:
        raise InputFileError(f"cannot read {check.named(path)}: {error.strerror or check.line(error)}") from None
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise InputFileError(f"{told}: {check.line(error)}") from None
    model, words = _heard(lambda: pin.buildModelFromXML(text.decode("utf-8", errors="replace")))
    # the parser drops an inertia or a link that it cannot read, says so, and goes on
    complaints = [line.partition(":")[2].strip() for line in words.splitlines() if line.startswith("Error:")]
    if isinstance(model, Exception) or complaints:
        raise InputFileError(f"{told}: {check.line(complaints[0] if complaints else model)}")
    return tree, model


_LOCK = threading.Lock()


def _heard(function: Callable[[], T]) -> tuple[T | Exception, str]:
    """What `function` returns or raises, and what it wrote to the process's stderr: C++ writes past sys.stderr."""
    with _LOCK, tempfile.TemporaryFile() as heard:
        kept = os.dup(2)
        os.dup2(heard.fileno(), 2)
        try:
            result: T | Exception = function()
        except Exception as error:  # boost's own kinds among them
            result = error
        finally:
            os.dup2(kept, 2)
            os.close(kept)
        heard.seek(0)
        return result, heard.read().decode(errors="replace")
