"""Bad input is refused in one line that names the place and the way out, with exit status 2 and nothing half-written."""

from __future__ import annotations

import copy
import io
import json
import os
import pickle
import subprocess
import sys
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sandbox
from sandbox.errors import (
    AsymmetricWeightError,
    EmptyPlanError,
    InputFileError,
    NonFiniteError,
    RangeError,
    SandboxError,
    ShapeError,
)
from sandbox.problem_file import read_problems

GOOD: dict[str, Any] = {
    "J": [[-1.0, -1.0, 0.0], [2.0, 1.0, 1.0]],
    "xdot": [1.0, 1.0],
    "W": [[1.0, 0, 0], [0, 1, 0], [0, 0, 1]],
    "a": [0.0, 0, 0],
}

FAULTS: dict[str, tuple[dict[str, Any], type[SandboxError], str]] = {
    "nan": ({"J": [[np.nan, 0, 1.0], [1, 0, 0]]}, NonFiniteError, r"J\[0, 0\] is nan"),
    "infinity": ({"a": [0.0, np.inf, 0]}, NonFiniteError, r"a\[1\] is inf"),
    "huge": ({"J": [[1e308, 0, 1.0], [1, 0, 0]]}, RangeError, r"J\[0, 0\] is 1e\+308"),
    "tiny": ({"xdot": [1e-200, 1.0]}, RangeError, r"xdot\[0\]"),
    "shape": ({"xdot": [1.0, 2, 3]}, ShapeError, r"xdot has shape \(3,\)"),
    "weight shape": ({"W": np.eye(4)}, ShapeError, r"W has shape \(4, 4\)"),
    "asymmetric": ({"W": [[1.0, 2, 0], [0, 1, 0], [0, 0, 1]]}, AsymmetricWeightError, r"W\[0, 1\] is 2 but W\[1, 0\] is 0"),
    "strings": ({"W": [["a"] * 3] * 3}, ShapeError, "W must hold real numbers"),
    "ragged": ({"J": [[1.0, 2, 3], [1.0]]}, ShapeError, "J is no rectangular array"),
    "empty stack": ({"J": np.zeros((0, 2, 3))}, ShapeError, "an empty stack"),
    "zero rows": ({"J": np.zeros((0, 3)), "xdot": np.zeros(0)}, ShapeError, "a zero size"),
    "stacks disagree": ({"xdot": np.ones((4, 2)), "a": np.ones((5, 3))}, ShapeError, "the stacks do not agree"),
    "booleans": ({"J": np.ones((2, 3), bool)}, ShapeError, "J must hold real numbers"),
    "complex": ({"a": np.ones(3, complex)}, ShapeError, "a must hold real numbers"),
    "masked": ({"J": np.ma.masked_equal([[5.0, 1, 1], [1, 9, 1]], 9.0)}, NonFiniteError, r"J\[1, 1\] is masked"),
    "no number": ({"J": [[1, 2, 3], [1, None, "x"]]}, ShapeError, r"J must hold real numbers, but J\[1, 1\] is None$"),
    "bool among objects": ({"xdot": [10**30, True]}, ShapeError, r"xdot\[1\] is True"),
    "huge integer": ({"J": [[1, 1, 1], [1, -(10**400), 1]]}, RangeError, r"J\[1, 1\] is beyond all floats"),
    "long words": ({"J": "x" * 5000}, ShapeError, "J must hold real numbers"),
    "many axes": ({"J": np.ones((1,) * 31 + (2, 3))}, ShapeError, "J has 33 axes; at most 32"),
    "nested deeper than numpy goes": ({"J": np.ones((1,) * 60).tolist() * 2}, ShapeError, "J has 60 axes; at most 32"),
    "Wx": ({"Wx": [[1.0, 3.0], [0.0, 1.0]]}, AsymmetricWeightError, "Wx"),
}


if np.finfo(np.longdouble).maxexp > np.finfo(np.float64).maxexp:  # on some machines a long double is a double
    FAULTS |= {
        "huge wide float": ({"xdot": np.array(["1", "1e4000"], np.longdouble)}, RangeError, r"xdot\[1\] is 1e\+4000;"),
        "tiny wide float": ({"xdot": np.array(["1", "1e-4000"], np.longdouble)}, RangeError, r"xdot\[1\] is 1e-4000;"),
    }


@pytest.mark.parametrize("name", FAULTS)
def test_the_door_refuses(name: str) -> None:
    """Each fault has its own error, which names field, place and value, under SandboxError."""
    change, error, words = FAULTS[name]
    with pytest.raises(error, match=words) as caught:
        sandbox.VelocityProblem(**{**GOOD, **change})
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 250


def test_python_integers_beyond_64_bits_are_numbers() -> None:
    """10**30 is a number as good as 1e30, in a list or an array of objects; 30 leading axes are a stack."""
    J = [[10**30, 1, 1], [1, 0, 1]]
    for given in (J, np.array(J, dtype=object)):
        assert np.array_equal(sandbox.VelocityProblem(**{**GOOD, "J": given}).J, np.array(J, dtype=float))
    assert sandbox.VelocityProblem(**{**GOOD, "J": np.ones((1,) * 30 + (2, 3))}).lead == (1,) * 30


def test_a_scalar_has_no_index() -> None:
    """What is one number is named without brackets."""
    with pytest.raises(NonFiniteError, match=r"^damping is nan"):
        sandbox.truth(sandbox.VelocityProblem(**GOOD), "damped", damping=np.nan)


def test_a_bad_member_of_a_stack_is_named() -> None:
    """The index in the stack is part of the error."""
    J = np.broadcast_to(np.array(GOOD["J"]), (5, 2, 3)).copy()
    J[3, 1, 2] = np.nan
    with pytest.raises(NonFiniteError, match=r"J\[3, 1, 2\] is nan") as caught:
        sandbox.VelocityProblem(**{**GOOD, "J": J})
    assert caught.value.evidence["index"] == (3, 1, 2)


def test_an_ambiguous_gamma_is_refused() -> None:
    """Matrix or diagonals: k x k numbers for a stack of k factors with k rows may be either, and are never guessed."""
    E = np.ones((2, 2, 3))
    with pytest.raises(ShapeError, match="may be one matrix or 2 diagonals"):
        sandbox.Weight(np.eye(3), E, [[2.0, 1], [1, 3]])
    assert sandbox.Weight(np.eye(3), E, [[[2.0, 1], [1, 3]]]).gamma.shape == (2, 2, 2)
    assert np.array_equal(sandbox.Weight(np.eye(3), E[0], [2.0, 3]).gamma, np.diag([2.0, 3]))


def test_arrays_are_read_only_copies() -> None:
    """Neither the caller's array nor the problem's can change the other."""
    J = np.array(GOOD["J"])
    problem = sandbox.VelocityProblem(**{**GOOD, "J": J})
    J[0, 0] = 7
    assert problem.J[0, 0] == -1
    with pytest.raises(ValueError, match="read-only"):
        problem.J[0, 0] = 7


@pytest.mark.parametrize("copied", [lambda p: pickle.loads(pickle.dumps(p)), copy.deepcopy, copy.copy])
def test_copies_are_read_only(copied: Any) -> None:
    """A problem and its weight that were pickled or copied hold the same numbers, and cannot be changed either."""
    weight = sandbox.Weight(np.eye(3), np.ones((1, 3)))
    problem = sandbox.VelocityProblem(np.ones((4, 2, 3)), GOOD["xdot"], weight, Wx=np.eye(2))
    again = copied(problem)
    for name in ("J", "xdot", "a", "Wx"):
        assert np.array_equal(getattr(again, name), getattr(problem, name)) and not getattr(again, name).flags.writeable
    for name in ("base", "E", "gamma"):
        for one, other in ((again.W, problem.W), (copied(weight), weight)):
            assert np.array_equal(getattr(one, name), getattr(other, name)) and not getattr(one, name).flags.writeable
    assert copied(sandbox.VelocityProblem(**GOOD)).Wx is None


def npz(path: Path, **arrays: Any) -> Path:
    np.savez(path, **arrays)
    return path


def pickled(path: Path) -> Path:
    np.savez(path, **{**GOOD, "W": np.array([{"a": 1}], dtype=object)})
    return path


def truncated(path: Path) -> Path:
    whole = io.BytesIO()
    np.savez(whole, **GOOD)
    path.write_bytes(whole.getvalue()[:400])
    return path


def npy(values: Any) -> bytes:
    """The content of an .npy file."""
    whole = io.BytesIO()
    np.save(whole, np.array(values))
    return whole.getvalue()


def text(path: Path, words: str) -> Path:
    path.write_text(words, encoding="utf-8")
    return path


def no_arrays(path: Path) -> Path:
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("readme.txt", "no arrays here")
    return path


def members(path: Path, *pairs: tuple[str, bytes]) -> Path:
    """An archive of raw members; zipfile warns of a name that comes twice, and writes it."""
    with zipfile.ZipFile(path, "w") as archive, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name, content in pairs:
            archive.writestr(name, content)
    return path


def header(path: Path, words: str) -> Path:
    """J.npy with `words` for a header and no numbers."""
    content = b"\x93NUMPY\x01\x00" + len(words).to_bytes(2, "little") + words.encode()
    return members(path, ("J.npy", content))


def shaped(path: Path, shape: str) -> Path:
    return header(path, f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}\n")


def array(path: Path) -> Path:
    with path.open("wb") as handle:
        np.save(handle, np.eye(3))
    return path


def changed(path: Path, local: int, central: int, byte: int) -> Path:
    """A good archive in which a byte of every header differs: encryption flag or method."""
    npz(path, **GOOD)
    content = bytearray(path.read_bytes())
    for mark, offset in ((b"PK\x03\x04", local), (b"PK\x01\x02", central)):
        at = content.find(mark)
        while at >= 0:
            content[at + offset] = byte
            at = content.find(mark, at + 4)
    path.write_bytes(content)
    return path


def corrupt(path: Path) -> Path:
    """Damage in the compressed bytes of the first array."""
    np.savez_compressed(path, **GOOD)
    content = bytearray(path.read_bytes())
    content[60:63] = bytes(b ^ 255 for b in content[60:63])
    path.write_bytes(content)
    return path


def folder(path: Path) -> Path:
    path.mkdir()
    return path


def fifo(path: Path) -> Path:
    os.mkfifo(path)
    return path


FACTORS = {"W_E": np.ones((2, 3)), "W_gamma": np.ones(2)}

FILES: dict[str, tuple[Callable[[Path], Path], str]] = {
    "nan.npz": (lambda p: npz(p, **{**GOOD, "xdot": [np.nan, 1]}), r"xdot\[0\] is nan"),
    "asymmetric.npz": (lambda p: npz(p, **{**GOOD, "W": [[1.0, 2, 0], [0, 1, 0], [0, 0, 1]]}), r"W\[0, 1\]"),
    "strings.npz": (lambda p: npz(p, **{**GOOD, "W": np.array([["a"] * 3] * 3)}), "W must hold real numbers"),
    "pickle.npz": (pickled, "field W holds Python objects"),
    "truncated.npz": (truncated, "is no complete .npz file"),
    "text.npz": (lambda p: text(p, "hello"), "is no complete .npz file"),
    "no_arrays.npz": (no_arrays, "field"),
    "unknown.npz": (lambda p: npz(p, **GOOD, Jacobian=[1.0]), "a field 'Jacobian'"),
    "no_weight.npz": (lambda p: npz(p, J=GOOD["J"], xdot=GOOD["xdot"]), "either W, or W_base"),
    "base_only_by_name.npz": (lambda p: npz(p, J=GOOD["J"], xdot=GOOD["xdot"], **FACTORS), "either W, or W_base"),
    "weight_and_factors.npz": (lambda p: npz(p, **GOOD, **FACTORS), "either W, or W_base"),
    "weight_and_gamma.npz": (lambda p: npz(p, **GOOD, W_gamma=np.ones(2)), "either W, or W_base"),
    "weight_and_base.npz": (lambda p: npz(p, **GOOD, W_base=np.eye(3)), "either W, or W_base"),
    "array.npz": (array, "is no complete .npz file"),
    "corrupt.npz": (corrupt, "is no complete .npz file"),
    "encrypted.npz": (lambda p: changed(p, 6, 8, 1), "is no complete .npz file .*encrypted"),
    "method.npz": (lambda p: changed(p, 8, 10, 97), "is no complete .npz file .*compression method"),
    "tokens.npz": (lambda p: header(p, "((((((((\n"), "is no complete .npz file"),
    "petabytes.npz": (lambda p: shaped(p, "(999999999999999,)"), "is no complete .npz file"),
    "overflow.npz": (lambda p: shaped(p, "(99999999999999999999,)"), "is no complete .npz file"),
    "negative.npz": (lambda p: shaped(p, "(2, -3)"), "field J holds no plain array"),
    "short.npz": (lambda p: shaped(p, "(2, 3)"), "field J holds no plain array"),
    "twice.npz": (lambda p: members(p, *[("xdot.npy", npy([1.0, 1])), ("J.npy", npy(GOOD["J"]))] * 2), "the field xdot twice"),
    "two_names.npz": (lambda p: members(p, ("J.npy", npy(GOOD["J"])), ("J", npy(GOOD["J"]))), "the field J twice"),
    "two\nlines.npz": (lambda p: text(p, "hello"), "is no complete .npz file"),
    "folder.npz": (folder, "is no regular file"),
    "folder.json": (folder, "is no regular file"),
    "fifo.npz": (fifo, "is no regular file"),
    "nowhere.npz": (lambda p: p, "no such file"),
    "deep.json": (lambda p: text(p, "[" * 100_000 + "]" * 100_000), "is no JSON .*recursion"),
    "digits.json": (lambda p: text(p, "1" * 5000), "is no JSON"),
    "huge.json": (lambda p: text(p, json.dumps({**GOOD, "a": [0, 10**400, 0]})), r"a\[1\] is beyond all floats"),
    "null.json": (lambda p: text(p, "null"), "null.json: is no object"),
    "null_J.json": (lambda p: text(p, json.dumps({**GOOD, "J": None})), "lacks the field J"),
    "object.json": (lambda p: text(p, json.dumps({**GOOD, "J": {"a": 1}})), "J must hold real numbers"),
    "twice.json": (
        lambda p: text(p, f"[{json.dumps(GOOD)[:-1]}, {json.dumps(GOOD)[1:]}]"),
        r"json\[0\]: holds the field J twice",
    ),
    "unknown.json": (lambda p: text(p, json.dumps([GOOD, {**GOOD, "a\nb": 1}])), r"json\[1\]: holds a field 'a\\nb'"),
    "no_xdot.json": (lambda p: text(p, json.dumps({"J": GOOD["J"], "W": GOOD["W"]})), "lacks the field xdot"),
    "list.json": (lambda p: text(p, json.dumps([GOOD, 3])), r"list.json\[1\]: is no object"),
    "shape.json": (lambda p: text(p, json.dumps([GOOD, {**GOOD, "a": [1]}])), r"shape.json\[1\]: a has shape"),
    "broken.json": (lambda p: text(p, "{"), "is no JSON"),
    "empty.json": (lambda p: text(p, "[]"), "holds no problem"),
    "binary.json": (lambda p: (p.write_bytes(b"\xff\xfe\x00\x80"), p)[1], "is no JSON"),
    "table.csv": (lambda p: text(p, "1,2"), "ends in .npz or .json"),
}


@pytest.mark.parametrize("name", FILES)
def test_problem_files(name: str, tmp_path: Path) -> None:
    """Each bad file is an InputFileError that begins with the file's name."""
    make, words = FILES[name]
    path = make(tmp_path / name)
    with pytest.raises(InputFileError, match=words) as caught:
        read_problems(path)
    told = str(caught.value)
    assert told.startswith(str(path) if str(path).isprintable() else repr(str(path)))
    assert told.count(str(tmp_path)) == 1 and len(told) < len(str(path)) + 250
    assert told.isprintable()


@pytest.mark.parametrize("call", [sandbox.solve, sandbox.truth, sandbox.cross_validate])
def test_what_is_no_problem_is_refused(call: Any) -> None:
    """The library functions say what they expect, and how to make one."""
    with pytest.raises(ShapeError, match=r"expected a VelocityProblem, not int: VelocityProblem\(J="):
        call(3)


@pytest.mark.parametrize("call", [sandbox.solve, sandbox.truth, sandbox.cross_validate])
def test_an_empty_slice_of_a_stack_is_refused(call: Any) -> None:
    """Slicing may leave nothing, as in numpy; there is nothing to solve then."""
    stack = sandbox.VelocityProblem(**{**GOOD, "J": np.broadcast_to(GOOD["J"], (3, 2, 3))})
    with pytest.raises(ShapeError, match=r"an empty stack, with leading axes \(0,\)"):
        call(stack[3:])


def test_library_options() -> None:
    """A single name needs no list; what would run nothing is an error."""
    problem = sandbox.VelocityProblem(**GOOD)
    assert sandbox.cross_validate(problem, backends="closed_form:eq6", tasks="exact").num_rows == 1
    with pytest.raises(EmptyPlanError, match="slack poses task damped"):
        sandbox.cross_validate(problem, backends="numpy", formulations="slack")
    with pytest.raises(EmptyPlanError, match="must be positive"):
        sandbox.cross_validate(problem, backends="numpy", time_limit=0)


def test_good_files_read(tmp_path: Path) -> None:
    """One problem, a stack, a list of objects and factored weights are read bit for bit."""
    stack = {**GOOD, "J": np.random.default_rng(1).normal(size=(4, 2, 3))}
    assert np.array_equal(read_problems(npz(tmp_path / "s.npz", **stack)).groups[0].problem.J, stack["J"])
    assert len(read_problems(text(tmp_path / "l.json", json.dumps([GOOD, GOOD])))) == 2
    assert len(read_problems(text(tmp_path / "marked.json", "\ufeff" + json.dumps({**GOOD, "a": None})))) == 1
    factored = {"J": GOOD["J"], "xdot": GOOD["xdot"], "W_base": np.zeros((3, 3)), "W_E": [[1.0, 1, 1]], "Wx": np.eye(2)}
    group = read_problems(npz(tmp_path / "f.npz", **factored)).groups[0]
    assert group.problem.W.factored and group.tasks == ("exact", "least_squares")


def command(*words: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "sandbox.cli", *words], capture_output=True, text=True, cwd=cwd, timeout=120, check=False
    )


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["run", "bad.npz", "--out", "new"], "bad.npz"),
        (["run", "nothing.npz", "--out", "new"], "no such file"),
        (["run", "no_such_set", "--out", "new"], "no problem set is called 'no_such_set'; there are: badly_scaled"),
        (["run", "textbook", "--out", "new", "--backend", "gurobi"], "no backend is called 'gurobi'"),
        (["run", "textbook", "--out", "new", "--formulation", "dual"], "no formulation is called 'dual'"),
        (["run", "textbook", "--out", "new", "--settings", "exact"], "no settings level is called 'exact'"),
        (["run", "textbook", "--out", "used"], "used holds files that are no run"),
        (["report", "nowhere"], "nowhere is no run folder"),
        (["show", "nowhere", "abc"], "nowhere is no run folder"),
        (["export", "nowhere", "--parquet", "x.parquet"], "nowhere is no run folder"),
        (["export", "spoilt", "--parquet", "x.parquet"], "is no Parquet file"),
        (["list", "robotz"], "no list is called 'robotz'"),
        (["run", "bad.npz", "--out", "new", "--full"], "--full is for problem sets"),
        (
            ["run", "seven_joint", "--out", "new", "--formulation", "slack"],
            "slack poses task damped, but the problems are posed for exact",
        ),
        (["run", "seven_joint", "--out", "new", "--task", "damped"], "no problem of seven_joint is posed for damped"),
        (["run", "seven_joint", "--out", "new", "--task", "best"], "no task is called 'best'"),
        (
            ["run", "textbook", "--out", "old"],
            "old holds a run; name another folder with --out, or replace it with --overwrite",
        ),
        (["run", "textbook", "--out", "foreign", "--overwrite"], "foreign/run.json is not of format 1: it was written by"),
        (["run", "textbook"], "Missing option"),
        (["run", "textbook", "--out", "new", "--time-limit", "0"], "Invalid value"),
    ],
)
def test_the_command_line_refuses(words: list[str], said: str, tmp_path: Path) -> None:
    """Exit status 2, the reason on standard error, and no folder or file left behind."""
    np.savez(tmp_path / "bad.npz", **{**GOOD, "W": np.full((3, 3), np.nan)})
    (tmp_path / "used").mkdir()
    (tmp_path / "used" / "thesis.tex").write_text("mine")
    (tmp_path / "spoilt" / "records").mkdir(parents=True)
    (tmp_path / "spoilt" / "run.json").write_text('{"format": 1}')
    (tmp_path / "spoilt" / "records" / "a.parquet").write_text("no Parquet")
    for folder, content in (("old", {"format": 1}), ("foreign", {"format": "mine"})):
        (tmp_path / folder / "records").mkdir(parents=True)
        (tmp_path / folder / "run.json").write_text(json.dumps(content))
        (tmp_path / folder / "records" / "notes.parquet").write_text("mine")
    before = sorted(tmp_path.rglob("*"))
    done = command(*words, cwd=tmp_path)
    assert done.returncode == 2, done.stderr
    assert said in done.stderr
    assert "Traceback" not in done.stderr
    if done.stderr.startswith("error: "):
        assert done.stderr.count("\n") == 1
    assert sorted(tmp_path.rglob("*")) == before
    assert (tmp_path / "used" / "thesis.tex").read_text() == "mine"
