"""What the implicit forms of eq. (6) save: operations and times of N'W and N'a, against forming W and grad f first.

Everything else in eq. (6) - LU of J, null vectors, elimination, substitution - is the same on both sides; its count stands
in each row as `rest` (Table I without the product N'W, which eq. (6) with W = I is). Four forms:

inertia : N'M by k recursions of Newton and Euler; explicitly M by composite bodies, then N' times M
augmented : (N'E') Gamma E with as many functions as null J has columns; explicitly E' Gamma E, then N' times it
gradient : N' grad f by k forward derivatives, f half the squared gravity torque; explicitly grad f in reverse mode, and N'
black_box : the same f, known by its values alone: one complex step per column of N; explicitly one per joint, then N' times it

The dynamics are counted on CasADi's symbols, not on counting numbers: zeros, ones and quarter turns of a robot drop out of
both sides, as they do in generated code; a count that kept them would be of loops nobody runs. Products and sums of matrices
are counted by running them on counting numbers, as Tables I and II are. A doubling counts as an addition; sines and cosines
are the same on both sides and counted in neither; negations are free.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass
from functools import cache
from typing import Any

import casadi as ca
import numpy as np
import pinocchio as pin

from problems.implicit import recursions
from problems.robots.planar import planar_arm
from problems.robots.robot import Robot
from problems.robots.twin import twin
from sandbox.closed_form.uncompiled import Counted, Operations, operations
from sandbox.errors import RangeError, UnknownNameError

Array = np.ndarray

SIZES = (3, 4, 5, 6, 7, 8, 10, 12, 16, 20, 25, 30)
"""Numbers of joints."""

FORMS = ("inertia", "augmented", "gradient", "black_box")

ROWS = {"planar": 2, "planar pose": 3, "spatial": 6}
"""Task rows m of each family of arms."""

LONGEST_GRADIENT = 16
"""Joints up to which gradient and black_box are counted: forward mode of k columns grows with the square of n."""


@dataclass(frozen=True)
class Row:
    """One form on one arm. Multiplications with divisions, additions with subtractions; seconds per configuration.

    break_even : number of columns of N, k, up to which the implicit form takes fewer operations; None where it always does
    saved, saved_of_all : share of the explicit operations that the implicit form saves, of this part and with `rest`;
        negative where it costs more
    time_ratio : implicit time by explicit time
    """

    form: str
    family: str
    n: int
    m: int
    k: int
    explicit_multiplications: int
    explicit_additions: int
    implicit_multiplications: int
    implicit_additions: int
    rest_multiplications: int
    rest_additions: int
    saved: float
    saved_of_all: float
    break_even: float | None
    explicit_time: float
    implicit_time: float
    time_ratio: float


def implicit_study(
    sizes: Iterable[int] = SIZES, *, families: Iterable[str] = tuple(ROWS), forms: Iterable[str] = FORMS, seed: int = 0,
    repeat: int = 5,
) -> list[dict[str, Any]]:  # fmt: skip
    """Rows (see Row) for every family and size, with k = n - m and, the task longer by so many rows, k = 1.

    Times are the best of `repeat`, both sides in turn in the same loop; inertia by pinocchio's rnea and crba, called from
    Python, gradient and black_box by CasADi's interpreter, augmented by numpy on a stack.

    Raises UnknownNameError for a family or form that is none, RangeError for a size below 2. A size that is no larger than
    a family's m gives the row k = 1 alone.
    """
    rows: list[dict[str, Any]] = []
    forms = tuple(forms)
    for name in forms:
        if name not in FORMS:
            raise UnknownNameError.of("form", name, FORMS)
    for family in families:
        if family not in ROWS:
            raise UnknownNameError.of("family", family, ROWS)
        for n in sizes:
            if n < 2:
                raise RangeError(f"an arm of {n} joints has no redundancy to study", n=n)
            for m in sorted({ROWS[family], n - 1}):
                if m < n:
                    rows.extend(asdict(row) for row in _rows(family, n, m, forms, seed, repeat))
    return rows


def _rows(family: str, n: int, m: int, forms: tuple[str, ...], seed: int, repeat: int) -> Iterator[Row]:
    k = n - m
    rest = operations("eq6", n, m, weighted=False)
    rng = np.random.default_rng(seed)
    for form in forms:
        if form in ("gradient", "black_box") and n > LONGEST_GRADIENT:
            continue
        explicit, implicit, even = COUNTS[form](family, n, k)
        pair = TIMERS[form](family, n, k, rng)
        explicit_time, implicit_time = best(pair, repeat)
        whole, part, around = _sum(explicit), _sum(implicit), _sum(rest)
        yield Row(
            form, family, n, m, k, explicit.multiplications, explicit.additions, implicit.multiplications, implicit.additions,
            rest.multiplications, rest.additions, saved=1 - part / whole, saved_of_all=(whole - part) / (whole + around),
            break_even=even, explicit_time=explicit_time, implicit_time=implicit_time, time_ratio=implicit_time / explicit_time,
        )  # fmt: skip


def _sum(count: Operations) -> int:
    return count.multiplications + count.additions


def _plus(*counts: Operations) -> Operations:
    return Operations(sum(c.multiplications for c in counts), sum(c.additions for c in counts))


# arms


@cache
def arm(family: str, n: int) -> Robot:
    """An arm of n joints: planar rods, or spatial links of general inertia with axes a quarter turn apart and rotors."""
    if family != "spatial":
        return planar_arm([0.3] * n, [1.7] * n, rods=True, name=f"planar_{n}r").task(family)
    model, joint, place = pin.Model(), 0, pin.SE3.Identity()
    onwards = pin.SE3(np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]), np.array([0.07, 0.0, 0.31]))
    about_centre = np.array([[0.021, 0.002, 0.001], [0.002, 0.023, -0.003], [0.001, -0.003, 0.009]])
    for i in range(n):
        joint = model.addJoint(joint, pin.JointModelRZ(), place, f"joint_{i + 1}")
        model.appendBodyToJoint(joint, pin.Inertia(1.7, np.array([0.03, 0.02, 0.14]), about_centre), pin.SE3.Identity())
        place = onwards
    model.addFrame(pin.Frame("tip", joint, 0, place, pin.FrameType.OP_FRAME))
    model.armature = np.full(n, 0.05)
    return Robot(f"spatial_{n}r", model, "tip")


# counts: (explicit, implicit, break-even number of columns)

Count = tuple[Operations, Operations, float | None]


def inertia_counts(family: str, n: int, k: int) -> Count:
    """Composite bodies and the dense product N'M against k recursions."""
    matrix, recursion = dynamics(family, n)
    product = product_count(k, n, n)
    each = _sum(recursion) - n * (2 * n - 1)  # what a column costs more than its row of the product
    explicit = _plus(matrix, product)
    implicit = Operations(k * recursion.multiplications, k * recursion.additions)
    return explicit, implicit, _sum(matrix) / each if each > 0 else None


@cache
def dynamics(family: str, n: int) -> tuple[Operations, Operations]:
    """Operations of the inertia matrix by composite bodies, and of one recursion of Newton and Euler."""
    links = recursions.chain(arm(family, n))
    c, s, v = (ca.SX.sym(name, n) for name in "csv")
    cosines, sines, along = (ca.vertsplit(part) for part in (c, s, v))
    M = recursions.composite(links, cosines, sines)
    matrix = instructions([c, s], ca.vertcat(*(M[i][j] for i in range(n) for j in range(i + 1))))
    return matrix, instructions([c, s, v], ca.vertcat(*recursions.newton_euler(links, cosines, sines, along)))


def augmented_counts(family: str, n: int, k: int) -> Count:
    """E' Gamma E and N' times it against (N'E') Gamma E, k functions: k (3 n^2 + n) - n (n + 1)/2 against k n (4 k - 1)."""
    counts = []
    for explicit in (True, False):
        total = Operations()
        E, N = _counted(total, k, n), _counted(total, k, n)
        gamma = _counted(total, k, 1)
        if explicit:
            weighted = gamma * E
            for i in range(n):
                for j in range(i + 1):  # W is symmetric
                    _dot(E[:, i], weighted[:, j])
            matmul(N, _counted(total, n, n))
        else:
            matmul(matmul(N, E.T) * gamma.T, E)
        counts.append(total)
    return counts[0], counts[1], (3 * n + 2 + ((3 * n + 2) ** 2 - 8 * (n + 1)) ** 0.5) / 8


def gradient_counts(family: str, n: int, k: int) -> Count:
    """Grad f in reverse mode and N' times it against k columns in forward mode."""
    q, f = _energy(family, n)
    along = ca.SX.sym("along", n, k)
    explicit = _plus(instructions([q], ca.gradient(f, q)), product_count(k, n, 1))
    implicit = instructions([q, along], ca.jtimes(f, q, along))
    first, second = (_sum(instructions([q, along], ca.jtimes(f, q, along[:, :c]))) for c in (1, min(2, k)))
    # a second column shares with the first what does not depend on N
    each = (second - first if k > 1 else first) - (2 * n - 1)
    shared = first - (second - first) if k > 1 else 0
    even = (_sum(explicit) - k * (2 * n - 1) - shared) / each if each > 0 else None
    return explicit, implicit, even


def black_box_counts(family: str, n: int, k: int) -> Count:
    """The function n times and N' of what comes of it, against k times; complex arithmetic is dearer on both sides alike."""
    q, f = _energy(family, n)
    once = instructions([q], f)
    times = [Operations(count * once.multiplications, count * once.additions) for count in (n, k)]
    return _plus(times[0], product_count(k, n, 1)), times[1], None


COUNTS: dict[str, Callable[[str, int, int], Count]] = {
    "inertia": inertia_counts, "augmented": augmented_counts, "gradient": gradient_counts, "black_box": black_box_counts,
}  # fmt: skip


@cache
def _energy(family: str, n: int) -> tuple[Any, Any]:
    symbols = twin(arm(family, n))
    return symbols.q, ca.sumsqr(symbols.gravity_torque) / 2


MULTIPLICATIONS = (ca.OP_MUL, ca.OP_DIV, ca.OP_SQ, ca.OP_INV)
ADDITIONS = (ca.OP_ADD, ca.OP_SUB, ca.OP_TWICE)
FREE = (ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_CONST, ca.OP_NEG, ca.OP_SIN, ca.OP_COS)


def instructions(inputs: list[Any], output: Any) -> Operations:
    """Operations that evaluating `output` takes, what occurs twice computed once.

    Raises UnknownNameError for an operation that is neither counted nor free.
    """
    function = ca.Function("f", inputs, [output], {"cse": True})
    count = Operations()
    for i in range(function.n_instructions()):
        kind = function.instruction_id(i)
        if kind in MULTIPLICATIONS:
            count.multiplications += 1
        elif kind in ADDITIONS:
            count.additions += 1
        elif kind not in FREE:
            raise UnknownNameError(f"CasADi's operation {kind} is not counted here", name=str(kind))
    return count


def product_count(rows: int, inner: int, columns: int) -> Operations:
    """Operations of a dense product (rows, inner) times (inner, columns), as it runs."""
    total = Operations()
    matmul(_counted(total, rows, inner), _counted(total, inner, columns))
    return total


def matmul(A: Array, B: Array) -> Array:
    """A B by plain loops, on any kind of number."""
    return np.array([[_dot(row, column) for column in B.T] for row in A], dtype=object)


def _dot(u: Array, v: Array) -> Any:
    total = u[0] * v[0]
    for a, b in zip(u[1:], v[1:], strict=True):
        total = total + a * b
    return total


def _counted(total: Operations, *shape: int) -> Array:
    out = np.empty(shape, dtype=object)
    for index in np.ndindex(shape):
        out[index] = Counted(1.0, total)
    return out


# times: (explicit, implicit) functions and how many configurations one call of them does

Timer = tuple[Callable[[], Any], Callable[[], Any], int]


def _inertia_timer(family: str, n: int, k: int, rng: np.random.Generator) -> Timer:
    robot = arm(family, n)
    model = robot.model.copy()
    model.gravity = pin.Motion.Zero()
    data, still, q = model.createData(), np.zeros(n), rng.uniform(-1, 1, n)
    N = rng.normal(size=(k, n))  # a row per column of N

    def explicit() -> Array:
        return N @ pin.crba(model, data, q)

    def implicit() -> list[Array]:
        return [pin.rnea(model, data, q, still, row) for row in N]

    return explicit, implicit, 1


def _augmented_timer(family: str, n: int, k: int, rng: np.random.Generator) -> Timer:
    count = 200
    E, N = rng.normal(size=(2, count, k, n))
    gamma = rng.uniform(1, 2, (count, k, 1))

    def explicit() -> Array:
        return N @ (np.swapaxes(E, 1, 2) @ (gamma * E))

    def implicit() -> Array:
        return (N @ np.swapaxes(E, 1, 2) * np.swapaxes(gamma, 1, 2)) @ E

    return explicit, implicit, count


def _gradient_timer(family: str, n: int, k: int, rng: np.random.Generator) -> Timer:
    q, f = _energy(family, n)
    along = ca.SX.sym("along", n, k)
    full = ca.Function("full", [q, along], [along.T @ ca.gradient(f, q)], {"cse": True})
    part = ca.Function("part", [q, along], [ca.jtimes(f, q, along)], {"cse": True})
    given = [ca.DM(rng.uniform(-1, 1, n)), ca.DM(rng.normal(size=(n, k)))]
    return lambda: full.call(given), lambda: part.call(given), 1


def _black_box_timer(family: str, n: int, k: int, rng: np.random.Generator) -> Timer:
    q, f = _energy(family, n)
    value = ca.Function("value", [q], [f], {"cse": True})
    N, steps = rng.normal(size=(k, n)), [ca.DM(rng.uniform(-1, 1, n)) for _ in range(n)]

    def explicit() -> Array:
        return N @ np.array([float(value(step)) for step in steps])

    def implicit() -> list[float]:
        return [float(value(step)) for step in steps[:k]]

    return explicit, implicit, 1


TIMERS: dict[str, Callable[[str, int, int, np.random.Generator], Timer]] = {
    "inertia": _inertia_timer, "augmented": _augmented_timer, "gradient": _gradient_timer, "black_box": _black_box_timer,
}  # fmt: skip


def best(timer: Timer, repeat: int, shortest: float = 2e-3) -> tuple[float, float]:
    """Seconds per configuration of both functions, the best of `repeat` turns of at least `shortest` seconds each."""
    *functions, count = timer
    calls = []
    for function in functions:
        function()
        start = time.perf_counter()
        function()
        calls.append(max(1, int(shortest / max(time.perf_counter() - start, 1e-7))))
    found = [np.inf, np.inf]
    for _ in range(repeat):
        for which, function in enumerate(functions):
            start = time.perf_counter()
            for _ in range(calls[which]):
                function()
            found[which] = min(found[which], (time.perf_counter() - start) / calls[which] / count)
    return found[0], found[1]
