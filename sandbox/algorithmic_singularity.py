"""Algorithmic singularities along a motion: where the secondary task loses its hold, and what damping there costs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.optimize import brentq, minimize_scalar

from sandbox.errors import RefusalError
from sandbox.law import taken
from sandbox.method import Method
from sandbox.motion import REFUSED, Motion, Path, Robot, answered, follow
from sandbox.parameters import number
from sandbox.problem import VelocityProblem
from sandbox.spectrum import reduced_weight
from sandbox.stacked import eigenvalues, svd, transpose
from sandbox.tolerances import NEAR_SINGULAR, SINGULAR_TIME

Array = np.ndarray

DAMPINGS = (1e-1, 1e-2, 1e-3, 1e-4)
"""Sizes of the base W~ that `cure` tries."""


@dataclass(frozen=True, eq=False)
class Singularity:
    """Where a motion meets, or comes near, a singularity.

    kind : "kinematic" (J loses rank) or "algorithmic" (the secondary task loses its hold on the self-motion)
    how : "sign change" (of det N'E', or of the smallest eigenvalue of N'WN), "minimum", or "end" (of the motion, towards
        which the value falls)
    of : what was watched: "sigma_min(J)", "sigma_min(N'E')" for a factored weight, "lambda_min(N'WN)" for a dense one
    t, q : instant [s] and configuration (n,)
    value : of what was watched, N orthonormal; share : value over sigma_max(J), |E|_2 or |W|_2
    """

    kind: Literal["kinematic", "algorithmic"]
    how: Literal["sign change", "minimum", "end"]
    of: str
    t: float
    q: Array
    value: float
    share: float


@dataclass(frozen=True, eq=False)
class _Watched:
    """A distance from singularity (B,), what it is a share of (B,), and what gives it a sign, if anything does.

    low (B,) : smallest eigenvalue of N'WN; or E (B, k, n) and N (B, n, k), whose bases may change from member to member
    """

    distance: Array
    scale: Array
    low: Array | None = None
    E: Array | None = None
    N: Array | None = None

    @property
    def share(self) -> Array:
        """Distance over scale (B,)."""
        return self.distance / self.scale

    def signs(self, before: _Watched) -> tuple[Array, Array] | None:
        """Numbers that change sign where N'WN or N'E' turns over between the members of `before` and these: (there, here).

        det(N'E') times the signs of det(E_0 E') and det(N_0'N), by which the bases of E and N are made to agree.
        """
        if self.low is not None and before.low is not None:
            return before.low, self.low
        if self.E is None or self.N is None or before.E is None or before.N is None:
            return None
        agree = np.linalg.det(before.E @ transpose(self.E)) * np.linalg.det(transpose(before.N) @ self.N)
        return np.linalg.det(before.E @ before.N), np.sign(agree) * np.linalg.det(self.E @ self.N)

    def __getitem__(self, members: Any) -> _Watched:
        """The members a slice names."""
        parts = (self.low, self.E, self.N)
        return _Watched(self.distance[members], self.scale[members], *(None if p is None else p[members] for p in parts))


def locate(
    motion: Motion, method: Method, robot: Robot, *, below: float = NEAR_SINGULAR, **parameters: Any
) -> tuple[Singularity, ...]:
    """Singularities of `method` along `motion`, in order of time; the motion may be another law's, which went on.

    Watched are sigma_min(J), and what condition (7) rests on: sigma_min(N'E') for a factored weight W = W~ + E'Gamma E, W~
    left out, so that a damped method shows where its undamped one fails; lambda_min(N'WN) for a dense one. Reported are
    sign changes and minima below the share `below`, refined between the samples; what dips between two samples and shows at
    neither is not seen (more `samples` when following).

    A configuration that the cast refuses counts as singular. Raises UnknownNameError for a parameter that the method does not
    have, RangeError for a `below` outside (0, 1].
    """
    taken(method, parameters)
    below = number(below, "below", above=0, most=1)

    def kinematic(q: Array) -> _Watched:
        sigma = np.linalg.svd(robot.jacobian(q), compute_uv=False)
        return _Watched(sigma[:, -1], sigma[:, 0])

    t, first = np.unique(motion.t, return_index=True)
    q = motion.q[first]
    found = _search(motion, t, q, kinematic, "kinematic", "sigma_min(J)", below)
    if robot.n > robot.m:
        for where in _castable(method, robot, q, parameters):
            held = _held(method.cast(robot, q[where][:1], np.zeros((1, robot.m)), **parameters))
            of = "lambda_min(N'WN)" if held.low is not None else "sigma_min(N'E')"

            def algorithmic(q: Array, held: _Watched = held) -> _Watched:
                return _reduced(method, robot, q, parameters, held)

            found += _search(motion, t[where], q[where], algorithmic, "algorithmic", of, below)
    return tuple(sorted(found, key=lambda one: one.t))


def _castable(method: Method, robot: Robot, q: Array, parameters: Mapping[str, Any]) -> list[slice]:
    """Runs of q (B, n) that the cast does not refuse; it does refuse what is singular to rounding."""

    def cast(q: Array) -> Array:
        return np.zeros(len(method.cast(robot, q, np.zeros((len(q), robot.m)), **parameters)))

    inside = np.isfinite(answered(cast, q))
    edges = np.flatnonzero(np.diff(inside, prepend=False, append=False))
    return [slice(first, end) for first, end in edges.reshape(-1, 2).tolist()]


def _reduced(method: Method, robot: Robot, q: Array, parameters: Mapping[str, Any], like: _Watched) -> _Watched:
    """What condition (7) rests on at q (B, n); a configuration that the cast refuses is singular."""
    try:
        return _held(method.cast(robot, q, np.zeros((len(q), robot.m)), **parameters))
    except REFUSED:
        if len(q) > 1:
            raise
        nothing = (None if part is None else np.zeros_like(part[:1]) for part in (like.low, like.E, like.N))
        return _Watched(np.zeros(1), np.ones(1), *nothing)


def _held(problem: VelocityProblem) -> _Watched:
    N = svd(problem.J)[2][:, :, problem.m :]
    E, k = problem.W.E, problem.n - problem.m
    if E is None:
        low = eigenvalues(reduced_weight(problem, N))[:, 0]
        return _Watched(np.abs(low), np.abs(eigenvalues(problem.W.dense())).max(axis=-1), low)
    held = np.linalg.svd(E @ N, compute_uv=False)
    distance = held[:, -1] if E.shape[-2] >= k else np.zeros(len(E))
    square = E.shape[-2] == k
    return _Watched(distance, np.linalg.norm(E, 2, axis=(-2, -1)), None, E if square else None, N if square else None)


def _search(
    motion: Motion, t: Array, q: Array, watch: Callable[[Array], _Watched], kind: Any, of: str, below: float
) -> list[Singularity]:
    """Sign changes and minima of what is watched, at the samples t, q and between them."""
    seen = watch(q)
    share = seen.share
    resolution = SINGULAR_TIME * max(t[-1] - t[0], SINGULAR_TIME)

    def at(time: float) -> _Watched:
        return watch(motion.between(time)[None])

    def one(how: Any, time: float) -> Singularity:
        there = at(time)
        value = there.distance if there.low is None else there.low
        return Singularity(kind, how, of, time, motion.between(time), float(value[0]), float(there.share[0]))

    found: list[Singularity] = []
    crossed = np.zeros(len(t), dtype=bool)
    signs = seen[1:].signs(seen[:-1])
    for i in [] if signs is None else np.flatnonzero(np.sign(signs[0]) * np.sign(signs[1]) < 0):
        before = seen[i : i + 1]

        def signed(time: float, before: _Watched = before) -> float:
            both = at(time).signs(before)
            return 0.0 if both is None else float(both[1][0])

        first, last = float(signs[0][i]), float(signs[1][i])  # type: ignore[index]
        if signed(t[i]) * signed(t[i + 1]) >= 0:  # an interpolated end may lie beyond the crossing: it is the crossing
            crossing = one("sign change", float(t[i] if abs(first) < abs(last) else t[i + 1]))
        else:
            crossing = one("sign change", float(brentq(signed, t[i], t[i + 1], xtol=resolution)))
        if crossing.share < below:  # else the sign jumps, as it does where J loses rank
            found.append(crossing)
            crossed[i : i + 2] = True
    last_index = len(t) - 1
    for j in _lowest(share, (share < below) & ~crossed):
        if j in (0, last_index):
            found.append(one("end", float(t[j])))
            continue
        # a V-shaped minimum, of a singular value that touches zero, is found as well as a smooth one
        best = minimize_scalar(
            lambda time: float(at(float(time)).share[0]), bounds=(t[j - 1], t[j + 1]), method="bounded",
            options={"xatol": resolution},
        )  # fmt: skip
        found.append(one("minimum", float(best.x) if best.fun <= share[j] else float(t[j])))
    return found


def _lowest(share: Array, allowed: Array) -> list[int]:
    """Members at which `share` is lowest; two count apart only if it doubles between them: a slide along zero is one."""
    kept: list[int] = []
    padded = np.concatenate([[np.inf], share, [np.inf]])
    falls, rises = padded[1:-1] < padded[:-2], padded[1:-1] <= padded[2:]
    for i in map(int, np.flatnonzero(allowed & falls & rises)):
        apart = not kept or share[kept[-1] : i].max() > 2 * max(share[i], share[kept[-1]])
        if apart:
            kept.append(i)
        elif share[i] < share[kept[-1]]:
            kept[-1] = i
    return kept


def secondary_rate(motion: Motion, method: Method, robot: Robot, **parameters: Any) -> Array:
    """E qdot - gbar (T, p) [unit of g/s] along a motion: how far the secondary functions are from the rates asked of them.

    E and gbar are those of the cast, W = W~ + E'Gamma E and a = -E'Gamma gbar (what of a is no such vector is left out).

    Raises RefusalError for a weight without factors, and what the cast refuses.
    """
    problem = method.cast(robot, motion.q, motion.xdot, **parameters)
    E, gamma = problem.W.E, problem.W.gamma
    if E is None or gamma is None:
        raise RefusalError(f"{method.name} has no secondary functions: its weight is no E'Gamma E")
    wanted = -np.linalg.solve(gamma, np.linalg.pinv(np.swapaxes(E, -1, -2)) @ problem.a[..., None])
    rate: Array = (E @ motion.qdot[..., None] - wanted)[..., 0]
    return rate


@dataclass(frozen=True, eq=False)
class Price:
    """What a motion cost.

    damping : size of the base W~; 0 for the undamped method
    stopped : why it ended early, "" where it did not; share : of the path that was followed
    peak_rate : largest joint rate, 2-norm [rad/s, m/s]; task_error : largest, 2-norm [m, rad]
    secondary_rate : largest |E qdot - gbar| [unit of g/s]; secondary_error : largest |integral of it| [unit of g]
    """

    damping: float
    stopped: str
    share: float
    peak_rate: float
    task_error: float
    secondary_rate: float
    secondary_error: float
    motion: Motion


def price(motion: Motion, method: Method, robot: Robot, duration: float, size: float = 0.0, **parameters: Any) -> Price:
    """The price of a motion that was to last `duration` [s], by the secondary functions of `method`; `size` of its W~."""
    rate = secondary_rate(motion, method, robot, **parameters)
    drift = cumulative_trapezoid(rate, motion.t, axis=0, initial=0.0)
    return Price(
        size, motion.stopped, float(motion.t[-1] / duration), _largest(motion.qdot), _largest(motion.task_error),
        _largest(rate), _largest(drift), motion,
    )  # fmt: skip


def cure(
    method: Method, damped: Method, robot: Robot, path: Path, q0: Any, *,
    knob: str = "base", dampings: Sequence[float] = DAMPINGS, following: Mapping[str, Any] | None = None, **parameters: Any,
) -> tuple[Price, ...]:  # fmt: skip
    """The same path by `method` and by `damped` with its parameter `knob` at each of `dampings`: what damping costs.

    `following` are options of `follow`; `parameters` are of both methods.

    Raises RangeError for a damping that is not positive, and what `follow` raises at q0.
    """
    for damping in dampings:
        number(damping, "a damping", above=0)
    taken(damped, [knob])
    options = dict(following or {})
    duration = path.duration * options.get("cycles", 1)
    rows = [price(follow(method, robot, path, q0, **options, **parameters), method, robot, duration, 0.0, **parameters)]
    for damping in dampings:
        given = {**parameters, knob: float(damping)}
        rows.append(price(follow(damped, robot, path, q0, **options, **given), damped, robot, duration, damping, **given))
    return tuple(rows)


def _largest(rows: Array) -> float:
    """Largest 2-norm of the rows (T, p) that are known; NaN where none is."""
    lengths = np.linalg.norm(rows, axis=-1)
    return float(np.nanmax(lengths)) if np.isfinite(lengths).any() else float("nan")
