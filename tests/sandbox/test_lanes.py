"""Straight-line code traced from plain functions: every lane computes, bit for bit, what the function computes."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import llvmlite.binding as llvm
import numpy as np
import pytest

from sandbox import check, lanes
from sandbox.lanes import LANES, Code, Lane, Machine, target

Array = np.ndarray
TYPES = {64: np.float64, 32: np.float32}
SPECIAL = [0.0, -0.0, 1.0, -1.5, np.inf, -np.inf, np.nan, 2.0**-126, 1e-40, 3.0e38, 1 / 3, 7.0]


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Object code of these tests is kept apart."""
    monkeypatch.setattr(lanes, "CACHE", tmp_path / "cache")
    return tmp_path / "cache"


def written(function: Callable[..., Any], sizes: list[int], outputs: list[int]) -> Callable[[Code], None]:
    """What traces `function` of arrays to arrays, and whether no lane was refused after them."""

    def write(code: Code) -> None:
        for i, values in enumerate(function(*(code.given(i) for i in range(len(sizes))))):
            code.keep(len(sizes) + i, list(values))
        if len(outputs) > i + 1:
            code.keep(len(sizes) + i + 1, [code.validity()])

    return write


def run(
    function: Callable[..., Any], inputs: list[Array], outputs: list[int], *, bits: int = 64, threads: int = 1
) -> list[Array]:
    """`function` on stacks of rows, by a machine."""
    inputs = [np.ascontiguousarray(values, dtype=TYPES[bits]) for values in inputs]
    sizes = [values.shape[1] for values in inputs]
    out = [np.full((len(inputs[0]), size), 99, TYPES[bits]) for size in outputs]
    Machine("test", bits, sizes, outputs, written(function, sizes, outputs), [])(*inputs, *out, threads=threads)
    return out


OPERATIONS: dict[str, Callable[[Any, Any], Any]] = {
    "+": lambda a, b: a + b, "-": lambda a, b: a - b, "*": lambda a, b: a * b, "/": lambda a, b: a / b,
    "1.5 +": lambda a, b: 1.5 + a, "1.5 -": lambda a, b: 1.5 - a, "1.5 *": lambda a, b: 1.5 * a, "1.5 /": lambda a, b: 1.5 / a,
    "- 1.5": lambda a, b: a - 1.5, "/ 1.5": lambda a, b: a / 1.5, "negative": lambda a, b: -a, "abs": lambda a, b: abs(a),
    "root": lambda a, b: a**0.5,
}  # fmt: skip


@pytest.mark.parametrize("bits", LANES)
def test_every_operation_is_that_of_ieee_754(bits: int) -> None:
    """On zeros of both signs, infinities, NaN, subnormals and random numbers each operation gives numpy's bits."""
    rng = np.random.default_rng(1)
    special = np.array(np.meshgrid(SPECIAL, SPECIAL)).reshape(2, -1)
    a, b = np.concatenate([special, rng.normal(size=(2, 100)) * 10.0 ** rng.integers(-30, 30, (2, 100))], axis=1).astype(
        TYPES[bits]
    )
    found = run(
        lambda a, b: [[f(a[0], b[0]) for f in OPERATIONS.values()]], [a[:, None], b[:, None]], [len(OPERATIONS)], bits=bits
    )[0]
    for j, (name, operation) in enumerate(OPERATIONS.items()):
        with np.errstate(all="ignore"):
            right = operation(a, b) if name != "root" else np.sqrt(a)
        assert right.dtype == TYPES[bits]
        same = (found[:, j] == right) & (np.signbit(found[:, j]) == np.signbit(right)) | (
            np.isnan(found[:, j]) & np.isnan(right)
        )
        assert same.all(), name


@pytest.mark.parametrize("bits", LANES)
def test_comparisons_choose_lane_by_lane(bits: int) -> None:
    """Greater, less, either of two, and what they choose; NaN compares with nothing."""
    a, b = np.array(np.meshgrid(SPECIAL, SPECIAL)).reshape(2, -1).astype(TYPES[bits])

    def function(a: Array, b: Array) -> Any:
        either = (a[0] > b[0]) | (a[0] < b[0])
        return [[(a[0] > b[0]).choose(1.0, a[0]), (a[0] < 1.0).choose(b[0], 0.0), either.choose(1, 0)]]

    found = run(function, [a[:, None], b[:, None]], [3], bits=bits)[0]
    np.testing.assert_array_equal(found, np.stack([np.where(a > b, 1, a), np.where(a < 1, b, 0), (a > b) | (a < b)], axis=1))


def test_a_refusal_is_its_lane_s_own() -> None:
    """Where a comparison that the function branches on does not hold the problem is refused, and its neighbours go on."""

    def function(a: Array) -> Any:
        if not a[0] > 0:
            raise AssertionError("a trace takes every comparison for true")
        if a[1] < 2.0:
            return [[a[0] ** 0.5 + a[1]]]
        raise AssertionError

    a = np.array([[4.0, 1], [-1, 1], [np.nan, 1], [9, 1], [9, 2], [9, np.nan], [0, 0], [1, 0], [16, -1], [-16, -1]])
    root, fit = run(function, [a], [1, 1])
    np.testing.assert_array_equal(fit[:, 0], [1, 0, 0, 1, 0, 0, 0, 1, 1, 0])
    np.testing.assert_array_equal(root[fit > 0], [3, 4, 1, 3])


@pytest.mark.parametrize("bits", LANES)
def test_any_number_of_problems_of_any_size(bits: int) -> None:
    """Stacks that do not fill the last block, rows that do not fill a register: every row right, and nothing beside them."""
    rng = np.random.default_rng(2)
    for size in (1, 3, 8, 11, 16, 35):
        machine = Machine(
            f"size{size}", bits, [size, 1], [size + 1],
            written(lambda a, b: [[*(a * b[0]), a[0]]], [size, 1], [size + 1]), [],
        )  # fmt: skip
        for B in (0, 1, 7, 8, 9, 16, 17, 35):
            a, b = (rng.normal(size=(B, s)).astype(TYPES[bits]) for s in (size, 1))
            whole = np.full((B + 2, size + 1), 99, TYPES[bits])
            machine(a, b, whole[1:-1])
            np.testing.assert_array_equal(whole[1:-1], np.concatenate([a * b, a[:, :1]], axis=1))
            assert (whole[[0, -1]] == 99).all()


def test_threads_share_the_stack(monkeypatch: pytest.MonkeyPatch) -> None:
    """Any number of threads computes every block once; short stacks get one."""
    rng, lengths = np.random.default_rng(3), []
    plain = Machine._run

    def counted(self: Machine, arguments: Any, begin: int, end: int) -> None:
        lengths.append(end - begin)
        plain(self, arguments, begin, end)

    monkeypatch.setattr(Machine, "_run", counted)
    a = rng.normal(size=(1003, 3))
    for stretch, threads, calls in (
        (lanes.STRETCH, 4, [125, 1]),
        (10, 4, [31, 31, 31, 32, 1]),
        (10, 99, [*[10] * 7, *[11] * 5, 1]),
    ):
        monkeypatch.setattr(lanes, "STRETCH", stretch)
        lengths.clear()
        np.testing.assert_array_equal(run(lambda a: [a + 1.0], [a], [3], threads=threads)[0], a + 1)
        assert sum(lengths) == 126 and sorted(lengths) == sorted(calls)


def test_object_code_is_kept_until_its_source_changes(tmp_path: Path, cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same sources: compiled once. A source, a library or a processor of another kind: written anew."""
    source, traces = ModuleType("source"), []
    source.__file__ = str(tmp_path / "source.py")
    Path(source.__file__).write_text("one")

    def write(code: Code) -> None:
        traces.append(1)
        code.keep(1, [code.given(0)[0] + 1.0])

    def found() -> float:
        out = np.zeros((1, 1))
        Machine("kept", 64, [1], [1], write, [source])(np.ones((1, 1)), out)
        return float(out[0, 0])

    assert [found(), found(), found()] == [2.0, 2.0, 2.0] and len(traces) == 1
    Path(source.__file__).write_text("two")
    assert [found(), found()] == [2.0, 2.0] and len(traces) == 2
    for module, name in ((np, "__version__"), (sys.modules["llvmlite"], "__version__")):
        monkeypatch.setattr(module, name, "another")
        found()
    assert len(traces) == 4 == len(list(cache.iterdir())) and all(path.suffix == ".o" for path in cache.iterdir())


def test_a_folder_that_cannot_be_written_costs_time_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Object code that cannot be kept is made again."""
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setattr(lanes, "CACHE", tmp_path / "file" / "cache")
    for _ in range(2):
        np.testing.assert_array_equal(run(lambda a: [a * 2.0], [np.ones((3, 2))], [2])[0], 2)


@pytest.mark.parametrize(
    "bad",
    [
        lambda a: a[:, :2], lambda a: a.astype(np.float32), lambda a: a[::-1], lambda a: np.asfortranarray(a), lambda a: a[0],
        lambda a: np.zeros((4, 3)),
    ],
)  # fmt: skip
def test_an_argument_that_is_not_such_rows_is_refused(bad: Callable[[Array], Array]) -> None:
    """Another shape, type, order or length would be read as something else: ValueError names the machine and what it takes."""
    machine = Machine("picky", 64, [3], [3], written(lambda a: [a], [3], [3]), [])
    with pytest.raises(ValueError, match=r"picky takes contiguous arrays \(B, 3\) of float64"):
        machine(np.zeros((5, 3)), bad(np.ones((5, 3))))
    with pytest.raises(ValueError):
        machine(np.zeros((5, 3)))
    with pytest.raises(ValueError, match="writable"):
        machine(np.zeros((5, 3)), check.frozen(np.ones((5, 3))))


def test_only_the_root_is_a_power() -> None:
    """Another power than 1/2 is not traced to something else."""
    with pytest.raises(AssertionError):
        run(lambda a: [a**2.0], [np.ones((1, 1))], [1])


def product_and_sum(fused: bool) -> Code:
    """The square of a less b, contracted where `fused`."""
    code = Code("product", 64, [2], [1])
    a, b = code.given(0)
    flags = ("contract",) if fused else ()
    square = code.builder.fmul(a.value, a.value, flags=flags)
    code.keep(1, [Lane(code, code.builder.fsub(square, b.value, flags=flags)) if fused else a * a - b])
    return code


def test_nothing_is_contracted() -> None:
    """A product and a sum are rounded twice: no fused instruction, where the check would see one."""
    assembly = target().emit_assembly(product_and_sum(False).finished())
    assert "mul" in assembly and "fma" not in assembly and "fnma" not in assembly and "fms" not in assembly
    a = 1 + 2.0**-27
    found = run(lambda a: [[a[0] * a[0] - a[1]]], [np.array([[a, a * a]])], [1])[0]
    assert found[0, 0] == 0.0 and math.fsum([a * a, -1, -(2.0**-26)]) == 0
    if llvm.get_host_cpu_features().get("fma"):  # of the usual 64-bit processors
        assert "vfm" in target().emit_assembly(product_and_sum(True).finished())
