"""Problems in the user's own files: .npz and .json, never pickles."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from sandbox.errors import InputFileError, SandboxError
from sandbox.problem import VelocityProblem
from sandbox.problem_set import Group, ProblemSet
from sandbox.weight import Weight

FIELDS = ("J", "xdot", "W", "W_base", "W_E", "W_gamma", "a", "Wx")
"""Names a problem file may hold; J, xdot and W (or W_base and W_E) must be there."""


def read_problems(path: Path, tasks: tuple[str, ...] | None = None) -> ProblemSet:
    """The problems of `path`: an .npz of arrays named as FIELDS, or a .json of one such object or a list of them.

    Every array may be one problem's or a stack's. `tasks` defaults to exact, and least_squares where Wx is given.

    Raises
    ------
    InputFileError
        naming file, field, index and value.
    """
    path = Path(path)
    if not path.is_file():
        raise InputFileError(f"{path}: no such file")
    readers = {".npz": _npz, ".json": _json}
    if path.suffix not in readers:
        raise InputFileError(f"{path}: a problem file ends in {' or '.join(readers)}, not in {path.suffix!r}")
    groups: list[Group] = []
    for place, arrays in readers[path.suffix](path):
        try:
            problem = _problem(arrays).stacked()
        except SandboxError as error:
            raise InputFileError(f"{path}{place}: {error}") from error
        wanted = tasks or (("exact",) if problem.Wx is None else ("exact", "least_squares"))
        first = sum(len(group) for group in groups)
        places = list(range(first, first + len(problem)))  # where a problem stands in the file
        groups.append(Group(problem, {"step": places}, wanted))
    if not groups:
        raise InputFileError(f"{path}: holds no problem")
    return ProblemSet(path.stem, tuple(groups), f"read from {path.name}")


def _npz(path: Path) -> list[tuple[str, dict[str, Any]]]:
    try:
        # opened here: numpy leaves its own handle open when the archive is broken
        with path.open("rb") as handle, np.load(handle, allow_pickle=False) as archive:
            arrays = {}
            for name in archive.files:
                try:
                    arrays[name] = archive[name]
                except ValueError as error:
                    why = "holds Python objects (a pickle)" if "allow_pickle" in str(error) else str(error)
                    raise InputFileError(f"{path}: field {name} {why}; store plain numbers") from error
    except (zipfile.BadZipFile, EOFError, OSError, ValueError) as error:
        raise InputFileError(f"{path}: is no complete .npz file ({error})") from error
    return [("", arrays)]


def _json(path: Path) -> list[tuple[str, dict[str, Any]]]:
    try:
        content = json.loads(path.read_text())
    except (ValueError, UnicodeDecodeError) as error:
        raise InputFileError(f"{path}: is no JSON ({error})") from error
    listed = content if isinstance(content, list) else [content]
    for i, one in enumerate(listed):
        if not isinstance(one, dict):
            raise InputFileError(f"{path}[{i}]: is no object with the fields {', '.join(FIELDS)}")
    return [(f"[{i}]" if isinstance(content, list) else "", one) for i, one in enumerate(listed)]


def _problem(arrays: dict[str, Any]) -> VelocityProblem:
    strange = [name for name in arrays if name not in FIELDS]
    if strange:
        raise InputFileError(f"holds a field {strange[0]!r}; the fields are {', '.join(FIELDS)}")
    for name in ("J", "xdot"):
        if name not in arrays:
            raise InputFileError(f"lacks the field {name}")
    if ("W" in arrays) == ("W_base" in arrays):
        raise InputFileError("must hold either W, or W_base with W_E and W_gamma")
    W: Any = arrays["W"] if "W" in arrays else Weight(arrays["W_base"], arrays.get("W_E"), arrays.get("W_gamma"))
    return VelocityProblem(J=arrays["J"], xdot=arrays["xdot"], W=W, a=arrays.get("a"), Wx=arrays.get("Wx"))
