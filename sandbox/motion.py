"""A motion: a velocity law followed along a path, by an adaptive integrator or as a controller would run it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from scipy.integrate import DOP853, OdeSolution
from scipy.spatial.transform import Rotation

from sandbox import check
from sandbox import method as methods
from sandbox.errors import NonFiniteError, RangeError, RefusalError, SandboxError, ShapeError, UnknownNameError
from sandbox.law import answer, taken
from sandbox.method import Method
from sandbox.parameters import chosen, number, whole
from sandbox.spectrum import Spectrum, reduced_weight, smallest_eigenvalue
from sandbox.tolerances import INTEGRATION, ORTHONORMAL, SMALLEST_STEP

Array = np.ndarray

INTEGRATORS = ("solve_ivp", "steps")
"""solve_ivp: scipy's DOP853, piece by piece between corners; steps: a controller's, each joint rate held for one step."""

SAMPLES = 200
"""Samples kept per cycle of an adaptive motion, evenly, beside the integrator's own steps."""

MOST_EVALUATIONS = 100_000
"""Evaluations of the law per piece of a path: a law that chatters is stopped there."""

MOST_SAMPLES = 10_000_000
"""Steps or samples of a motion: more do not fit into memory."""

FIRST_STEP = 1 / 64
"""First step tried, as a share of the piece; the integrator adapts it at once."""

CUT = 4
"""A step on which the law refuses is cut by this and tried again."""

REFUSED = (SandboxError, ArithmeticError, np.linalg.LinAlgError)
"""What a law raises where it has no answer."""

Rates = Callable[[Array, Array], Array]
"""A law (q (n,), xdot (m,)) -> qdot (n,)."""


class Robot(methods.Robot, Protocol):
    """What a motion needs of a robot."""

    @property
    def rows(self) -> tuple[int, ...]:
        """Which of (vx, vy, vz, wx, wy, wz) are the task."""

    def translating(self, velocity: Any) -> Array:
        """Task velocity (..., m) of a hand that moves at (..., 3) [m/s] and does not turn."""


class Path(Protocol):
    """What a motion needs of a path; problems/paths/path.py has all of it."""

    @property
    def name(self) -> str:
        """How records call it."""

    @property
    def duration(self) -> float:
        """Of one round [s]."""

    @property
    def closed(self) -> bool:
        """Whether a round ends where it began."""

    @property
    def pieces(self) -> tuple[tuple[float, float], ...]:
        """Beginning and end [s] of each smooth piece."""

    @property
    def displacement(self) -> Callable[[Array], Array]:
        """Times (...,) -> (..., 3) [m]."""

    @property
    def velocity(self) -> Callable[[Array], Array]:
        """Times (...,) -> (..., 3) [m/s]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Motion:
    """What happened: T samples. At a corner, and where a cycle joins the next, an adaptive motion has one on either side.

    method, robot, path, integrator : names
    t (T,) [s]; q (T, n) [rad, m]; qdot (T, n) [rad/s, m/s]
    xdot (T, m) : task velocity asked for, feedback included [m/s, rad/s]
    hand (T, 3) : position [m]
    task_error (T, m) : where the hand is less where it should be [m, rad]; NaN in a row of rotation that has no such angle
    lambda_min_reduced (T,) : smallest eigenvalue of N'WN, N orthonormal: condition (7) is that it is positive; NaN where
        the law is a plain function, or refuses its sample
    sigma_min_J (T,) : smallest singular value of J
    measures : name -> (T,) values; NaN outside a measure's domain
    cycle_ends : index of the last sample of each finished cycle
    stopped : why the motion ended early, in the words of what stopped it; "" where it did not
    evaluations : of the law, while it was integrated
    between : a time [s] -> q (n,) between samples
    """

    method: str
    robot: str
    path: str
    integrator: str
    t: Array
    q: Array
    qdot: Array
    xdot: Array
    hand: Array
    task_error: Array
    lambda_min_reduced: Array
    sigma_min_J: Array
    measures: Mapping[str, Array]
    cycle_ends: Array
    stopped: str
    evaluations: int
    between: Callable[[float], Array] = field(repr=False)

    def __post_init__(self) -> None:
        for array in (*vars(self).values(), *self.measures.values()):
            if isinstance(array, np.ndarray):
                array.setflags(write=False)

    @property
    def postures(self) -> Array:
        """Joint angles (cycles + 1, n) at the start and after each finished cycle."""
        return self.q[np.concatenate([[0], self.cycle_ends]).astype(int)]


def follow(
    method: Method | Rates,
    robot: Robot,
    path: Path,
    q0: Any,
    *,
    cycles: int = 1,
    integrator: str = "solve_ivp",
    steps: int = 1000,
    samples: int = SAMPLES,
    feedback: float = 0.0,
    rtol: float = INTEGRATION,
    measures: Mapping[str, Callable[[Any, Array], Array]] | None = None,
    **parameters: Any,
) -> Motion:
    """Follow `path` from the configuration q0 (n,), by a method's framework answer or by a plain law (q, xdot) -> qdot.

    Where the law refuses on the way the motion ends there, and says why; a refusal at q0 itself is raised.

    Parameters
    ----------
    cycles : rounds of a closed path
    integrator : "solve_ivp" (DOP853 to `rtol`, relative and absolute [rad, m], on each piece between corners), or "steps":
        the rate is held over each of `steps` equal steps per cycle, and asks for the mean velocity of the path over the step
    samples : kept per cycle of an adaptive motion, evenly, beside the integrator's own steps; a stepped one keeps every step
    feedback : gain of the task [1/s]: xdot = velocity - feedback * task_error
    measures : name -> function (robot, q (T, n)) -> (T,)
    parameters : of the method, as its cast takes them

    Raises
    ------
    ShapeError, NonFiniteError, RangeError, UnknownNameError
        for q0, cycles, integrator, steps, samples, feedback, rtol; for an open path asked to repeat; for a path that leaves the
        robot's task rows.
    SandboxError
        what the law raises at q0.
    """
    q0 = check.real(q0, "q0")
    check.shape(q0, ("n",), {"n": robot.n}, "q0")
    if q0.ndim != 1:
        raise RangeError(f"q0 has shape {q0.shape}; a motion starts at one configuration ({robot.n},)")
    cycles, steps, samples = whole(cycles, "cycles", 1), whole(steps, "steps", 1), whole(samples, "samples", 1)
    if cycles > 1 and not path.closed:
        raise RangeError(f"{path.name} is open: it cannot be followed {cycles} times; choose a closed path, or cycles=1")
    for name, total in (("steps", steps * cycles), ("samples", samples * cycles)):
        if total > MOST_SAMPLES:
            raise RangeError(f"{name} over all cycles are {total}; at most {MOST_SAMPLES} can be kept", field=name, value=total)
    chosen("integrator", integrator, INTEGRATORS)
    feedback, rtol = number(feedback, "feedback", least=0), number(rtol, "rtol", least=INTEGRATION / 10, most=0.5)
    if measures is not None and not (isinstance(measures, Mapping) and all(map(callable, measures.values()))):
        raise ShapeError("measures must be a mapping, name -> function (robot, q (T, n)) -> (T,)", field="measures")
    if isinstance(method, Method):
        taken(method, parameters)
        name, one = method.name, _framework(method, robot, parameters)
    elif not callable(method):
        raise UnknownNameError.of("law", type(method).__name__, ("a Method", "a function (q, xdot) -> qdot"))
    elif parameters:
        raise UnknownNameError.of("parameter of a plain law", next(iter(parameters)), ("none",))
    else:
        name, one = getattr(method, "__name__", type(method).__name__), _own(method)
    asked = _Asked(robot, path, q0, feedback)
    law = _Counted(one, robot.n)
    law(q0, asked.velocity(0.0, q0))
    if integrator == "solve_ivp":
        trace = _adaptive(law, asked, q0, cycles, samples, rtol)
    else:
        trace = _stepped(law, asked, q0, cycles, steps)
    round_, local, q = trace.round_, trace.local, trace.q
    xdot = trace.xdot if trace.xdot is not None else asked.velocity(local, q, trace.clipped)
    smallest, qdot = _judged(method, one, robot, parameters, q, xdot)
    if trace.qdot is not None:
        qdot = trace.qdot  # the rates that were held, not those the law would ask for next
    return Motion(
        method=name, robot=robot.name, path=path.name, integrator=integrator,
        t=round_ * path.duration + local, q=q, qdot=qdot, xdot=xdot,
        hand=robot.forward(q)[0], task_error=asked.error(local, q), lambda_min_reduced=smallest,
        sigma_min_J=np.linalg.svd(robot.jacobian(q), compute_uv=False)[:, -1],
        measures={name: answered(lambda q, f=f: f(robot, q), q) for name, f in (measures or {}).items()},
        cycle_ends=trace.ends, stopped=trace.stopped, evaluations=law.count, between=trace.between,
    )  # fmt: skip


class _Asked:
    """What the path asks of the hand: task velocity and error at path time [s], stacked or one."""

    def __init__(self, robot: Robot, path: Path, q0: Array, gain: float) -> None:
        self.robot, self.path, self.gain = robot, path, gain
        self.rows = np.array(robot.rows)
        self.start, turned = robot.forward(q0)
        self.unturn = np.swapaxes(turned, -1, -2)
        self.all_rotation = set(robot.rows) >= {3, 4, 5}
        for axis in range(3):
            along = path.velocity(np.linspace(0.0, path.duration, 64))[:, axis]
            if axis not in robot.rows and along.any():
                raise RangeError(
                    f"{path.name} moves along {'xyz'[axis]}, which is no task row of {robot.name}: choose another plane of the "
                    "path, or other task rows of the robot",
                    axis=axis,
                )  # fmt: skip

    def velocity(self, local: Any, q: Array, clipped: Any = None) -> Array:
        """Task velocity (..., m) with feedback; `clipped` are the times at which the path's velocity is read."""
        return self.rates(self.path.velocity(np.asarray(local if clipped is None else clipped)), local, q)

    def rates(self, along: Array, local: Any, q: Array) -> Array:
        """Task velocity (..., m) for the point's velocity `along` (..., 3)."""
        asked = self.robot.translating(along)
        if not self.gain:
            return asked
        error = self.error(local, q)
        if np.isnan(error).any():
            raise RefusalError(
                "the hand turns about an axis that is no task row, so that its angle about the others is none to feed back; "
                "make all three of them task rows, or follow without feedback"
            )  # fmt: skip
        return asked - self.gain * error

    def error(self, local: Any, q: Array) -> Array:
        """Where the hand is less where it should be (..., m) [m, rad]."""
        position, rotation = self.robot.forward(q)
        turn = np.zeros(position.shape)
        if (self.rows > 2).any():
            turn = Rotation.from_matrix((rotation @ self.unturn).reshape(-1, 3, 3)).as_rotvec().reshape(position.shape)
            if not self.all_rotation:
                # rates about fewer than three axes integrate to an angle only while the hand turns about no other
                others = [axis for axis in range(3) if axis + 3 not in self.robot.rows]
                turn[np.abs(turn[..., others]).max(axis=-1) > ORTHONORMAL] = np.nan
        gap = position - self.start - self.path.displacement(np.asarray(local))
        error: Array = np.concatenate([gap, turn], axis=-1)[..., self.rows]
        return error


class _Counted:
    """A law that counts its evaluations and refuses to answer with what is not finite."""

    def __init__(self, law: Rates, n: int) -> None:
        self.law, self.n, self.count = law, n, 0

    def __call__(self, q: Array, xdot: Array) -> Array:
        self.count += 1
        try:
            qdot = check.real(self.law(q.copy(), xdot.copy()), "qdot of the law")
        except NonFiniteError as error:
            raise NonFiniteError(f"the law gives joint rates that are not finite: {error}", **error.evidence) from error
        if qdot.shape != (self.n,):
            check.shape(qdot, ("n",), {"n": self.n}, "qdot of the law")
            raise RangeError(f"the law makes rates of shape {qdot.shape} of one configuration; they must be ({self.n},)")
        return qdot


@dataclass
class _Trace:
    """Samples of a motion: cycle, path time, the time at which the path's velocity is read, q, and where it ended."""

    round_: Array
    local: Array
    clipped: Array
    q: Array
    ends: Array
    stopped: str
    between: Callable[[float], Array]
    xdot: Array | None = None
    qdot: Array | None = None


@dataclass
class _Arc:
    """The solution on one smooth piece; `stopped` says why it is shorter than the piece."""

    steps: list[float]
    dense: list[Any]
    first: Array
    last: Array
    stopped: str

    def __call__(self, times: Array) -> Array:
        """Joint angles (..., n)."""
        if not self.dense:
            return np.broadcast_to(self.first, (*np.shape(times), len(self.first)))
        values: Array = np.moveaxis(OdeSolution(self.steps, self.dense)(times), 0, -1)
        return values


def _piece(law: _Counted, asked: _Asked, a: float, b: float, q: Array, rtol: float) -> _Arc:
    """From a to b [s] with DOP853; where the law refuses, steps are cut until they end short of there."""
    before = float(np.nextafter(b, a))

    def rate(t: float, q: Array) -> Array:
        return law(q, asked.velocity(t, q, min(t, before)))

    arc, t, most = _Arc([a], [], q, q, ""), a, law.count + MOST_EVALUATIONS
    h, solver = FIRST_STEP * (b - a), None
    while t < b and not arc.stopped:
        try:
            if solver is None:
                solver = DOP853(rate, t, arc.last, b, rtol=rtol, atol=rtol, first_step=min(h, b - t))
            words = solver.step()
        except REFUSED as refusal:
            h = min(h, b - t) / CUT
            solver = None
            if h < SMALLEST_STEP * (b - a):
                arc.stopped = str(refusal)
        else:
            if solver.status == "failed":
                arc.stopped = f"no step is short enough: {words}; joint rates {np.linalg.norm(solver.f):.3g}"
            else:
                arc.dense.append(solver.dense_output())
                t, h, arc.last = float(solver.t), float(solver.h_abs), np.array(solver.y)
                arc.steps.append(t)
        if law.count > most:
            arc.stopped = f"the law was evaluated {MOST_EVALUATIONS} times on one piece: it chatters"
    return arc


def _adaptive(law: _Counted, asked: _Asked, q: Array, cycles: int, samples: int, rtol: float) -> _Trace:
    arcs: list[tuple[int, _Arc]] = []
    columns: list[tuple[Array, Array, Array, Array]] = []
    ends, stopped, count = [], "", 0
    for cycle in range(cycles):
        for a, b in asked.path.pieces:
            arc = _piece(law, asked, a, b, q, rtol)
            q, last = arc.last, arc.steps[-1]
            regular = np.linspace(a, b, max(2, round(samples * (b - a) / asked.path.duration) + 1))
            times = np.unique(np.concatenate([regular[regular < last], arc.steps]))
            along = np.array(arc(times))
            along[-1] = arc.last
            columns.append((np.full(len(times), cycle), times, np.minimum(times, np.nextafter(b, a)), along))
            arcs.append((cycle, arc))
            count += len(times)
            stopped = arc.stopped
            if stopped:
                break
        if stopped:
            break
        ends.append(count - 1)
    duration = asked.path.duration

    def between(t: float) -> Array:
        # the piece that contains t, the later one at a joint
        for cycle, arc in reversed(arcs):
            since = t - cycle * duration
            if since >= arc.steps[0]:
                return np.array(arc(np.array(min(since, arc.steps[-1]))))
        return np.array(arcs[0][1].first)

    round_, local, clipped, along = (np.concatenate(parts) for parts in zip(*columns, strict=True))
    return _Trace(round_, local, clipped, along, np.array(ends, dtype=int), stopped, between)


def _stepped(law: _Counted, asked: _Asked, q: Array, cycles: int, steps: int) -> _Trace:
    times = asked.path.duration * np.arange(steps + 1) / steps
    along = np.diff(asked.path.displacement(times), axis=0) / np.diff(times)[:, None]
    postures, held, wanted, stopped = [q], [], [], ""
    for i in range(cycles * steps):
        step = i % steps
        try:
            xdot = asked.rates(along[step], times[step], q)
            qdot = law(q, xdot)
        except REFUSED as refusal:
            stopped = str(refusal)
            break
        q = q + (times[step + 1] - times[step]) * qdot
        postures.append(q)
        held.append(qdot)
        wanted.append(xdot)
    if not held:  # the first rate was found before the motion began
        raise RefusalError(stopped)
    count = np.arange(len(postures))
    round_ = np.maximum(count - 1, 0) // steps  # the last sample of a cycle belongs to it
    local = times[count - round_ * steps]
    q_all, t_all = np.array(postures), round_ * asked.path.duration + local
    ends = steps * np.arange(1, len(held) // steps + 1)

    def between(t: float) -> Array:
        i = int(np.clip(np.searchsorted(t_all, t, side="right") - 1, 0, len(t_all) - 2))
        share = (t - t_all[i]) / (t_all[i + 1] - t_all[i])
        return np.array(q_all[i] + share * (q_all[i + 1] - q_all[i]))

    # the last sample shows the rate that brought it there
    return _Trace(
        round_, local, local, q_all, ends, stopped, between, np.array([*wanted, wanted[-1]]), np.array([*held, held[-1]])
    )


def _own(law: Rates) -> Rates:
    """The user's own law: whatever goes wrong in it is a refusal."""

    def guarded(q: Array, xdot: Array) -> Array:
        try:
            return law(q, xdot)
        except REFUSED:
            raise
        except Exception as error:
            raise RefusalError(f"the law failed: {type(error).__name__}: {check.line(error)}") from error

    return guarded


def _framework(method: Method, robot: Robot, parameters: Mapping[str, Any]) -> Rates:
    def law(q: Array, xdot: Array) -> Array:
        problem = method.cast(robot, q[None], xdot[None], **parameters)
        if problem.lead != (1,):
            raise ShapeError(f"a parameter of {method.name} is of {problem.lead} configurations; a motion needs one for all")
        found: Array = answer(method, robot, problem[0], parameters).x
        return found

    return law


def _judged(
    method: Method | Rates, one: Rates, robot: Robot, parameters: Mapping[str, Any], q: Array, xdot: Array
) -> tuple[Array, Array]:
    """Smallest eigenvalue (T,) of N'WN and joint rates (T, n) at every sample."""
    if not isinstance(method, Method):
        rows = answered(lambda q, xdot: np.array([one(*row) for row in zip(q.copy(), xdot.copy(), strict=True)]), q, xdot)
        return np.full(len(q), np.nan), rows

    def both(q: Array, xdot: Array) -> Array:
        problem = method.cast(robot, q, xdot, **parameters)
        N = Spectrum.of(problem, np.full(len(q), problem.m)).V[:, :, problem.m :]
        smallest = smallest_eigenvalue(reduced_weight(problem, N))
        return np.column_stack([smallest, answer(method, robot, problem, parameters, on_refusal="status").x])

    found = answered(both, q, xdot)
    return found[:, 0], found[:, 1:]


def answered(function: Callable[..., Array], *stacks: Array) -> Array:
    """`function` of whole stacks (T, ...), (T,) or (T, r); where it refuses, of halves, down to refused members: NaN."""
    parts = _parts(function, *stacks)
    shape = next((part.shape[1:] for part in parts if part is not None), ())
    return np.concatenate([np.full((1, *shape), np.nan) if part is None else part for part in parts])


def _parts(function: Callable[..., Array], *stacks: Array) -> list[Array | None]:
    """Answers in order; None stands for one member that was refused."""
    try:
        return [np.asarray(function(*stacks), dtype=float)]
    except REFUSED:
        count = len(stacks[0])
        if count == 1:
            return [None]
    halves = (slice(count // 2), slice(count // 2, None))
    return [part for half in halves for part in _parts(function, *(stack[half] for stack in stacks))]
