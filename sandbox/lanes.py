"""Straight-line code for many problems side by side: one problem to each lane of a vector register.

A function on plain numbers is run once on numbers that write down what is done with them, and what they write is compiled
by LLVM as it stands: no branch, no contraction, no reordering, so that every lane computes bit for bit what the function
computes. Where the function would leave early, a mask is written instead.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import sys
import tempfile
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

Array = np.ndarray

LANES = {64: 8, 32: 16}
"""Problems side by side, by the bits of a number: the widest vector register there is; others take it in parts."""

CACHE = Path(__file__).parent / "__pycache__"
"""Where object code is kept."""

STRETCH = 1024
"""Blocks for one thread at least: below that a second thread costs more than it saves."""


class Code:
    """The function being written: a loop over blocks of problems, its body the trace of a kernel."""

    def __init__(self, name: str, bits: int, inputs: Sequence[int], outputs: Sequence[int]) -> None:
        import llvmlite.ir as ir

        self.ir, self.name, self.bits, self.lanes = ir, name, bits, LANES[bits]
        self.number = {64: ir.DoubleType(), 32: ir.FloatType()}[bits]
        self.lane = ir.VectorType(self.number, self.lanes)
        self.mask = ir.VectorType(ir.IntType(1), self.lanes)
        self.word = ir.IntType(64)
        self.module = ir.Module(name)
        pointers = [self.number.as_pointer()] * (len(inputs) + len(outputs))
        function = ir.Function(self.module, ir.FunctionType(ir.VoidType(), [*pointers, self.word]), name)
        for argument in function.args[:-1]:
            argument.add_attribute("noalias")
        entry, loop, self.end = (function.append_basic_block(part) for part in ("entry", "loop", "end"))
        self.builder = ir.IRBuilder(entry)
        self.builder.cbranch(self.builder.icmp_signed(">", function.args[-1], self.word(0)), loop, self.end)
        self.builder = ir.IRBuilder(loop)
        self.block = self.builder.phi(self.word)
        self.block.add_incoming(self.word(0), entry)
        self.function, self.loop = function, loop
        self.arguments = list(zip(function.args, [*inputs, *outputs], strict=False))
        self.valid: Any = None

    # ---- numbers in and out ------------------------------------------------------------------------------------

    def _row(self, argument: int, lane: int, entry: int) -> Any:
        """Address of an entry of the problem in `lane`."""
        pointer, size = self.arguments[argument]
        b = self.builder
        problem = b.add(b.mul(self.block, self.word(self.lanes)), self.word(lane))
        place = b.gep(pointer, [b.add(b.mul(problem, self.word(size)), self.word(entry))])
        return b.bitcast(place, self.lane.as_pointer())

    def _some(self, count: int) -> Any:
        return self.ir.Constant(self.mask, [int(q < count) for q in range(self.lanes)])

    def _intrinsic(self, name: str, result: Any, *values: Any) -> Any:
        kinds = [value.type for value in values]
        function = self.module.globals.get(name) or self.ir.Function(self.module, self.ir.FunctionType(result, kinds), name)
        return self.builder.call(function, values)

    def call(self, name: str, *values: Any) -> Any:
        """fabs, sqrt, ... of lanes."""
        return self._intrinsic(f"llvm.{name}.v{self.lanes}f{self.bits}", self.lane, *values)

    def given(self, argument: int) -> Array:
        """All numbers of an input, an entry of every problem to a vector."""
        size = self.arguments[argument][1]
        out = np.empty(size, dtype=object)
        for begin in range(0, size, self.lanes):
            count = min(self.lanes, size - begin)
            rows = [self._load(self._row(argument, lane, begin), count) for lane in range(self.lanes)]
            for entry, value in enumerate(self._transposed(rows)[:count]):
                out[begin + entry] = Lane(self, value)
        return out

    def _load(self, place: Any, count: int) -> Any:
        if count == self.lanes:
            return self.builder.load(place, align=self.bits // 8)
        name = f"llvm.masked.load.v{self.lanes}f{self.bits}.p0"
        none = self.ir.Constant(self.lane, [0.0] * self.lanes)
        return self._intrinsic(name, self.lane, place, self.ir.IntType(32)(self.bits // 8), self._some(count), none)

    def keep(self, argument: int, values: Sequence[Any]) -> None:
        """Write all numbers of an output."""
        assert len(values) == self.arguments[argument][1]
        for begin in range(0, len(values), self.lanes):
            part = [self.of(value) for value in values[begin : begin + self.lanes]]
            count = len(part)
            part += [part[0]] * (self.lanes - count)
            for lane, row in enumerate(self._transposed(part)):
                place = self._row(argument, lane, begin)
                if count == self.lanes:
                    self.builder.store(row, place, align=self.bits // 8)
                else:
                    name = f"llvm.masked.store.v{self.lanes}f{self.bits}.p0"
                    self._intrinsic(
                        name, self.ir.VoidType(), row, place, self.ir.IntType(32)(self.bits // 8), self._some(count)
                    )

    def _transposed(self, rows: list[Any]) -> list[Any]:
        """Entry q of row i at entry i of row q: bit by bit of the two indices."""
        bit = 1
        while bit < self.lanes:
            low = [q if not q & bit else q - bit + self.lanes for q in range(self.lanes)]
            high = [q + bit if not q & bit else q + self.lanes for q in range(self.lanes)]
            kind = self.ir.VectorType(self.ir.IntType(32), self.lanes)
            out = list(rows)
            for i in range(self.lanes):
                if not i & bit:
                    for to, order in ((i, low), (i | bit, high)):
                        out[to] = self.builder.shuffle_vector(rows[i], rows[i | bit], self.ir.Constant(kind, order))
            rows, bit = out, bit * 2
        return rows

    def of(self, value: Any) -> Any:
        """The vector of a number, traced or plain."""
        return value.value if isinstance(value, Lane) else self.ir.Constant(self.lane, [float(value)] * self.lanes)

    # ---- refusals ----------------------------------------------------------------------------------------------

    def demand(self, condition: Any) -> None:
        """Lanes in which `condition` does not hold are refused."""
        self.valid = condition if self.valid is None else self.builder.and_(self.valid, condition)

    def validity(self) -> Lane:
        """1 where nothing was refused, else 0."""
        return Lane(self, self.builder.uitofp(self.valid, self.lane))

    def finished(self) -> Any:
        """The loop closed, the module verified."""
        import llvmlite.binding as llvm

        b = self.builder
        following = b.add(self.block, self.word(1))
        self.block.add_incoming(following, self.loop)
        b.cbranch(b.icmp_signed("<", following, self.function.args[-1]), self.loop, self.end)
        self.ir.IRBuilder(self.end).ret_void()
        module = llvm.parse_assembly(str(self.module))
        module.verify()
        return module


def target() -> Any:
    """The processor at hand with its widest vectors; its code generator neither contracts nor reorders."""
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    features = llvm.get_host_cpu_features().flatten() + ",-prefer-256-bit"
    return llvm.Target.from_default_triple().create_target_machine(cpu=llvm.get_host_cpu_name(), features=features, opt=2)


class Machine:
    """A function of stacks, one row of numbers per problem, compiled once and kept beside the source it came from.

    inputs, outputs : numbers per problem of each argument; none of them 0
    write : fills a Code with the trace, inputs being its arguments 0, 1, ..., outputs those after
    sources : modules that the trace comes from; where one changes the code is written anew
    """

    def __init__(
        self, name: str, bits: int, inputs: Sequence[int], outputs: Sequence[int], write: Callable[[Code], None],
        sources: Sequence[ModuleType],
    ) -> None:  # fmt: skip
        self.name, self.bits, self.sizes, self.given = name, bits, (*inputs, *outputs), len(inputs)
        self.number: np.dtype[Any] = np.dtype({64: np.float64, 32: np.float32}[bits])
        stored = self._stored(sources)
        try:
            code = stored.read_bytes()
        except OSError:
            written = Code(name, bits, inputs, outputs)
            write(written)
            code = target().emit_object(written.finished())
            _store(stored, code)
        self._call = self._loaded(code)

    def _stored(self, sources: Sequence[ModuleType]) -> Path:
        """Where the object code is kept: named by everything that it depends on."""
        import llvmlite
        import llvmlite.binding as llvm

        texts = [Path(source.__file__ or "").read_bytes() for source in (sys.modules[__name__], *sources)]
        machine = [llvmlite.__version__, np.__version__, llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()]
        key = hashlib.blake2b(
            b"\0".join([*texts, *(word.encode() for word in (*machine, self.name, str(self.bits)))]), digest_size=16
        )
        return CACHE / f"{self.name}.{key.hexdigest()}.o"

    def _loaded(self, code: bytes) -> Callable[..., None]:
        import llvmlite.binding as llvm

        self._engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), target())  # the code lives as long as its engine
        self._engine.add_object_file(llvm.ObjectFileRef.from_data(code))
        self._engine.finalize_object()
        kinds = [ctypes.c_void_p] * len(self.sizes) + [ctypes.c_int64]
        return ctypes.CFUNCTYPE(None, *kinds)(self._engine.get_function_address(self.name))

    def __call__(self, *arguments: Array, threads: int = 1) -> None:
        """Fill the outputs: arguments (B, size) in the order of inputs and outputs, contiguous, of the machine's type."""
        B, lanes = len(arguments[0]), LANES[self.bits]
        for values, size in zip(arguments, self.sizes, strict=True):
            if values.shape != (B, size) or values.dtype != self.number or not values.flags.c_contiguous:
                raise ValueError(f"{self.name} takes contiguous arrays (B, {size}) of {self.number}")
        if not all(values.flags.writeable for values in arguments[self.given :]):
            raise ValueError(f"{self.name} fills its outputs: they must be writable")
        blocks = B // lanes
        parts = max(1, min(threads, blocks // STRETCH))
        edges = [blocks * part // parts for part in range(parts + 1)]
        if parts == 1:
            self._run(arguments, 0, blocks)
        else:
            with ThreadPoolExecutor(parts) as pool:  # the call lets go of the interpreter
                list(pool.map(lambda k: self._run(arguments, edges[k], edges[k + 1]), range(parts)))
        if rest := B - blocks * lanes:
            ends = [np.ascontiguousarray(values[np.r_[B - rest : B, [B - 1] * (lanes - rest)]]) for values in arguments]
            self._run(ends, 0, 1)
            for values, end in zip(arguments[self.given :], ends[self.given :], strict=True):
                values[B - rest :] = end[:rest]

    def _run(self, arguments: Sequence[Array], begin: int, end: int) -> None:
        step = LANES[self.bits] * self.number.itemsize
        places = [a.ctypes.data + begin * step * size for a, size in zip(arguments, self.sizes, strict=True)]
        self._call(*places, end - begin)


def _store(path: Path, code: bytes) -> None:
    """Keep object code, whole or not at all; where the folder cannot be written it is made again next time."""
    with suppress(OSError):
        path.parent.mkdir(exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=path.parent)
        with os.fdopen(handle, "wb") as file:
            file.write(code)
        os.replace(temporary, path)


class Lane:
    """One number of every problem in a block. A comparison is taken for true; where it is not, the problem is refused."""

    __slots__ = ("code", "value")

    def __init__(self, code: Code, value: Any) -> None:
        self.code, self.value = code, value

    def _with(self, other: Any, operation: str, *, turned: bool = False) -> Lane:
        a, b = self.value, self.code.of(other)
        return Lane(self.code, getattr(self.code.builder, operation)(*((b, a) if turned else (a, b))))

    def __add__(self, other: Any) -> Lane:
        return self._with(other, "fadd")

    def __sub__(self, other: Any) -> Lane:
        return self._with(other, "fsub")

    def __mul__(self, other: Any) -> Lane:
        return self._with(other, "fmul")

    def __truediv__(self, other: Any) -> Lane:
        return self._with(other, "fdiv")

    def __radd__(self, other: Any) -> Lane:
        return self._with(other, "fadd", turned=True)

    def __rsub__(self, other: Any) -> Lane:
        return self._with(other, "fsub", turned=True)

    def __rmul__(self, other: Any) -> Lane:
        return self._with(other, "fmul", turned=True)

    def __rtruediv__(self, other: Any) -> Lane:
        return self._with(other, "fdiv", turned=True)

    def __neg__(self) -> Lane:
        return Lane(self.code, self.code.builder.fneg(self.value))

    def __abs__(self) -> Lane:
        return Lane(self.code, self.code.call("fabs", self.value))

    def __pow__(self, power: float) -> Lane:
        assert power == 0.5
        return Lane(self.code, self.code.call("sqrt", self.value))

    def __gt__(self, other: Any) -> Condition:
        return Condition(self.code, self.code.builder.fcmp_ordered(">", self.value, self.code.of(other)))

    def __lt__(self, other: Any) -> Condition:
        return Condition(self.code, self.code.builder.fcmp_ordered("<", self.value, self.code.of(other)))


class Condition:
    """A comparison, lane by lane."""

    __slots__ = ("code", "value")

    def __init__(self, code: Code, value: Any) -> None:
        self.code, self.value = code, value

    def __bool__(self) -> bool:
        self.code.demand(self.value)
        return True

    def __or__(self, other: Condition) -> Condition:
        return Condition(self.code, self.code.builder.or_(self.value, other.value))

    def choose(self, yes: Any, no: Any) -> Lane:
        """`yes` where it holds, else `no`."""
        return Lane(self.code, self.code.builder.select(self.value, self.code.of(yes), self.code.of(no)))
