"""Problems in the user's own files: .npz and .json, never pickles."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from sandbox.check import line, named
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
    path = Path(path)
    name = named(path)
    if not path.is_file():
        raise InputFileError(f"{name}: {'is no regular file' if path.exists() else 'no such file'}")
    readers = {".npz": (_npz, "complete .npz file"), ".json": (_json, "JSON")}
    if path.suffix not in readers:
        raise InputFileError(f"{name}: a problem file ends in {' or '.join(readers)}, not in {path.suffix!r}")
    read, kind = readers[path.suffix]
    try:
        parts = read(path)
    except InputFileError as error:
        raise InputFileError(f"{name}: {error}") from error
    except Exception as error:  # zip, deflate, array header, JSON: a damaged file fails in ways that nobody lists
        raise InputFileError(f"{name}: is no {kind} ({line(error) or type(error).__name__})") from error
    groups: list[Group] = []
    for place, content in parts:
        try:
            problem = _problem(content).stacked()
        except SandboxError as error:
            raise InputFileError(f"{name}{place}: {error}") from error
        wanted = tasks or (("exact",) if problem.Wx is None else ("exact", "least_squares"))
        first = sum(len(group) for group in groups)
        places = list(range(first, first + len(problem)))  # where a problem stands in the file
        groups.append(Group(problem, {"step": places}, wanted))
    if not groups:
        raise InputFileError(f"{name}: holds no problem")
    return ProblemSet(named(path.stem), tuple(groups), f"read from {named(path.name)}")


def _npz(path: Path) -> list[tuple[str, Any]]:
    pairs = []
    with zipfile.ZipFile(path) as archive:
        for member in archive.namelist():
            name = member.removesuffix(".npy")
            with archive.open(member) as handle:
                try:
                    pairs.append((name, np.lib.format.read_array(handle, allow_pickle=False)))
                except ValueError as error:
                    pickled = "allow_pickle" in str(error)
                    why = "Python objects (a pickle)" if pickled else f"no plain array ({line(error)})"
                    raise InputFileError(f"field {line(name)} holds {why}; store plain numbers") from error
    return [("", tuple(pairs))]


def _json(path: Path) -> list[tuple[str, Any]]:
    content = json.loads(path.read_text(encoding="utf-8-sig"), object_pairs_hook=tuple)  # arrays are lists: no confusion
    return [(f"[{i}]", one) for i, one in enumerate(content)] if isinstance(content, list) else [("", content)]


def _problem(pairs: Any) -> VelocityProblem:
    """The problem of (name, values) pairs; null is a field left out."""
    if not isinstance(pairs, tuple):
        raise InputFileError(f"is no object with the fields {', '.join(FIELDS)}")
    fields: dict[str, Any] = {}
    for name, values in pairs:
        if name not in FIELDS:
            raise InputFileError(f"holds a field {line(repr(name))}; the fields are {', '.join(FIELDS)}")
        if name in fields:
            raise InputFileError(f"holds the field {name} twice")
        fields[name] = values
    fields = {name: values for name, values in fields.items() if values is not None}
    for name in ("J", "xdot"):
        if name not in fields:
            raise InputFileError(f"lacks the field {name}")
    parts = [name for name in ("W_base", "W_E", "W_gamma") if name in fields]
    if ("W" in fields) == ("W_base" in parts) or ("W" in fields and parts):
        raise InputFileError("must hold either W, or W_base with W_E and W_gamma")
    W: Any = fields["W"] if "W" in fields else Weight(fields["W_base"], fields.get("W_E"), fields.get("W_gamma"))
    return VelocityProblem(J=fields["J"], xdot=fields["xdot"], W=W, a=fields.get("a"), Wx=fields.get("Wx"))
