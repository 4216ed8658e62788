"""The study of the methods that accompanies a verification: agreement with their originals, and motions along paths."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import pyarrow as pa

from sandbox import check
from sandbox import motion as motions_
from sandbox.agreement import study
from sandbox.algorithmic_singularity import Singularity, cure, locate, price
from sandbox.errors import SandboxError
from sandbox.law import taken
from sandbox.method import Method, start
from sandbox.motion import Motion, Path, follow
from sandbox.records import METHODS, MOTIONS
from sandbox.repeatability import FEWEST_CYCLES, lie_brackets, limit_cycle

Array = np.ndarray

KEPT = 200
"""Samples of a motion that are kept for its plots, per cycle and beside those at its corners."""

STEPS = 400
"""Control steps per cycle of a law that is not integrated."""

FRAMES = 9
"""Instants at which the arm is kept for its stroboscope."""


class Robot(motions_.Robot, Protocol):
    """What the study needs of a robot."""

    def point(self, q: Any, joint: int) -> Array:
        """Position (..., 3) [m] of the origin of joint 1..n."""


Told = Callable[[str, int, int], None]


def described(methods: Iterable[Method]) -> list[dict[str, Any]]:
    """The rows of the table of methods, as run.json keeps them."""
    names = (
        "id", "name", "title", "formula", "weight", "vector", "condition", "number", "certainty", "works", "form",
        "task", "refuses",
    )  # fmt: skip
    return [{name: getattr(method, name) for name in names} for method in methods]


def agreement_table(methods: Sequence[Method], robots: Sequence[Robot], *, count: int, seed: int = 0, told: Told) -> pa.Table:
    """Framework against original (records.METHODS): every method on every robot; `count` situations of `seed` each."""
    rows: list[dict[str, Any]] = []
    for done, (method, robot) in enumerate(_pairs(methods, robots)):
        rows += study(method, robot, count=count, seed=seed)
        told("agreement", done + 1, len(methods) * len(robots))
    return pa.Table.from_pylist(rows, METHODS)


def motions(
    methods: Sequence[Method], robots: Sequence[Robot], path: Callable[[Robot], Path], *, cycles: int, seed: int = 0, told: Told
) -> list[Followed]:
    """Every method along a path on every robot."""
    found = []
    for done, (method, robot) in enumerate(_pairs(methods, robots)):
        found.append(followed(method, robot, path(robot), cycles=cycles, seed=seed))
        told("motions", done + 1, len(methods) * len(robots))
    return found


@dataclass(frozen=True, eq=False)
class Followed:
    """A motion of a method, on which robot and path, the Lie-bracket test at its start, what it met and what it cost.

    secondary_error : largest |integral of E qdot - gbar| [unit of g]; None where the weight is no E'Gamma E
    damping : size of the base W~ where that is what the motion shows
    """

    motion: Motion
    robot: Robot
    path: Path
    cycles: int
    bracket: float | None
    singularities: tuple[Singularity, ...]
    secondary_error: float | None
    damping: float | None = None

    @property
    def share(self) -> float:
        """Of the path that was followed."""
        return float(self.motion.t[-1]) / (self.cycles * self.path.duration)

    @property
    def peak_rate(self) -> float:
        """Largest joint rate, 2-norm [rad/s, m/s]; a sample that the law refuses has none."""
        return float(np.nanmax(np.linalg.norm(self.motion.qdot, axis=-1)))

    @property
    def drift(self) -> Array | None:
        """Joint distance (c,) from the start after each finished cycle [rad, m]; None for an open or unfinished path."""
        if not (self.path.closed and len(self.motion.cycle_ends)):
            return None
        distance: Array = np.linalg.norm(self.motion.postures[1:] - self.motion.postures[0], axis=-1)
        return distance

    @property
    def limit(self) -> str | None:
        """Where the postures after each cycle lead (repeatability.LimitCycle); None for fewer than four cycles."""
        return limit_cycle(self.motion).kind if len(self.motion.cycle_ends) >= FEWEST_CYCLES else None

    def summary(self) -> dict[str, Any]:
        """What a reader wants of it first."""
        motion, drift = self.motion, self.drift
        error, held = np.linalg.norm(motion.task_error, axis=-1), motion.lambda_min_reduced
        return {
            "method": motion.method, "robot": motion.robot, "path": motion.path, "cycles": self.cycles,
            "drift, first cycle": None if drift is None else float(drift[0]),
            "drift, last cycle": None if drift is None else float(drift[-1]),
            "postures after each cycle": self.limit,
            "largest task error": float(np.nanmax(error)) if np.isfinite(error).any() else None,
            "smallest lambda_min(N'WN)": float(np.nanmin(held)) if np.isfinite(held).any() else None,
            "smallest sigma_min(J)": float(motion.sigma_min_J.min()),
            "peak joint rate": self.peak_rate,
            "secondary error": self.secondary_error,
            **{f"{name}, least and most": _range(values) for name, values in motion.measures.items()},
            "Lie bracket": self.bracket,
            "singularities": "; ".join(
                f"{one.kind}, {one.of} = {one.value:.1e} at t = {one.t:.4f} s ({one.how})" for one in self.singularities
            ),
            "stopped": motion.stopped or None,
        }  # fmt: skip


def followed(
    method: Method, robot: Robot, path: Path, *, cycles: int, seed: int = 0, q: Any = None, steps: int | None = None,
    parameters: Mapping[str, Any] | None = None, measures: Mapping[str, Callable[[Any, Array], Array]] | None = None,
) -> Followed:  # fmt: skip
    """A method along a path, its secondary functions at rest; from q (n,), or from a start that it draws with `seed`.

    steps : fixed control steps per cycle; left out, the motion is integrated to 1e-12, but for a law that holds its task
        only roughly or switches its rank: no step is ever fine enough there, and it gets STEPS control steps

    measures : name -> function (robot, q (T, n)) -> (T,), told along the way

    Raises what the law refuses at the start.
    """
    begun = {} if q is not None else start(method, robot, seed)._asdict()
    q = check.real(begun["q"][0] if q is None else q, "q")
    every = {**begun.get("parameters", {}), **method.still, **(parameters or {})}
    taken(method, every)
    # what stands still must begin where the method itself would let it: `still` may lift that condition on the way
    method.cast(robot, q[None], np.zeros((1, robot.m)), **{**begun.get("parameters", {}), **(parameters or {})})
    if steps is None and method.task != "exact":
        steps = STEPS
    how = {"integrator": "solve_ivp"} if steps is None else {"integrator": "steps", "steps": steps}
    motion = follow(method, robot, path, q, cycles=cycles, measures=measures, **how, **every)
    return Followed(
        motion, robot, path, cycles, bracket(method, robot, q, every), locate(motion, method, robot, **every),
        _secondary(motion, method, robot, cycles * path.duration, every),
    )  # fmt: skip


def _range(values: Array) -> str | None:
    return f"{np.nanmin(values):.6g} to {np.nanmax(values):.6g}" if np.isfinite(values).any() else None


def _secondary(motion: Motion, method: Method, robot: Robot, duration: float, parameters: Mapping[str, Any]) -> float | None:
    try:
        E = method.cast(robot, motion.q[:1], motion.xdot[:1], **parameters).W.E
        if E is None or E.shape[-2] > robot.n - robot.m:  # more rows than self-motions are a weight, not tasks to be held
            return None
        return price(motion, method, robot, duration, **parameters).secondary_error
    except SandboxError:  # the cast refuses a sample
        return None


def cured(method: Method, damped: Method, robot: Robot, path: Path, q: Any) -> list[Followed]:
    """An undamped method into its singularity along `path` from q (n,), and the damped one past it, at several dampings."""
    return [
        Followed(one.motion, robot, path, 1, None, locate(one.motion, method, robot), one.secondary_error, one.damping)
        for one in cure(method, damped, robot, path, q)
    ]


def bracket(method: Method, robot: Robot, q: Array, parameters: Mapping[str, Any]) -> float | None:
    """Lie-bracket test at q (n,); None where the law is not linear in xdot, or refuses nearby."""
    try:
        return lie_brackets(method, robot, q, **parameters).value
    except SandboxError:
        return None


def motion_rows(found: Sequence[Followed]) -> pa.Table:
    """Motions as a table of records.MOTIONS, thinned for their plots."""
    return pa.Table.from_pylist([_row(one) for one in found], MOTIONS)


def _row(one: Followed) -> dict[str, Any]:
    motion, robot = one.motion, one.robot
    corners = np.flatnonzero(np.diff(motion.t) == 0)
    spread = np.linspace(0, len(motion.t) - 1, KEPT * one.cycles).round().astype(int)
    kept = np.unique(np.concatenate([spread, corners, corners + 1, motion.cycle_ends])).astype(int)
    first = int(motion.cycle_ends[0]) if len(motion.cycle_ends) else len(motion.t) - 1
    # the first cycle, and the posture after each of the others
    seen = np.concatenate([np.unique(np.linspace(0, first, FRAMES).round().astype(int)), motion.cycle_ends[1:].astype(int)])
    joints = [robot.point(motion.q[seen], joint) for joint in range(1, robot.n + 1)]
    arm = np.stack([np.zeros((len(seen), 3)), *joints, motion.hand[seen]], axis=1)
    return {
        "method": motion.method, "robot": motion.robot, "path": motion.path, "closed": one.path.closed, "cycles": one.cycles,
        "integrator": motion.integrator, "stopped": motion.stopped or None, "n": robot.n, "m": robot.m,
        "t": motion.t[kept], "q": motion.q[kept].ravel(), "qdot": motion.qdot[kept].ravel(), "hand": motion.hand[kept].ravel(),
        "task_error": np.linalg.norm(motion.task_error[kept], axis=-1),
        "lambda_min_reduced": motion.lambda_min_reduced[kept], "sigma_min_J": motion.sigma_min_J[kept],
        "arm": arm.ravel(), "frames": len(seen), "drift": one.drift, "bracket": one.bracket,
        "singularities": json.dumps([
            {"kind": s.kind, "how": s.how, "of": s.of, "t": s.t, "value": s.value} for s in one.singularities
        ]),
        "share": one.share, "peak_rate": one.peak_rate, "damping": one.damping, "secondary_error": one.secondary_error,
    }  # fmt: skip


def _pairs(methods: Sequence[Method], robots: Sequence[Robot]) -> Iterator[tuple[Method, Robot]]:
    return ((method, robot) for method in methods for robot in robots)
