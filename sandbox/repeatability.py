"""Whether closed paths of the hand close in the joints: drift per cycle, limit cycles, and the Lie brackets of a law."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from sandbox import check
from sandbox.errors import RangeError, RankDeficientError, RefusalError, ShapeError, UnknownNameError
from sandbox.law import rates
from sandbox.method import Method, Robot
from sandbox.motion import Motion
from sandbox.parameters import number
from sandbox.spectrum import Spectrum
from sandbox.tolerances import BRACKET_ROUNDING, BRACKET_STEP, CLOSED_CYCLE, LIMIT_KNOWN, LINEARITY, RANK, UNIT

Array = np.ndarray

STENCIL = np.array([4 / 5, -1 / 5, 4 / 105, -1 / 280])
"""Weights of (f(h) - f(-h))/h, (f(2h) - f(-2h))/h, ...: a central difference of eighth order."""


FEWEST_CYCLES = 4
"""Fewer postures cannot tell a limit from drift."""


def drift(motion: Motion) -> Array:
    """Joint displacement (cycles, n) [rad, m] over each finished cycle: zero where the law is repeatable.

    Raises RangeError where no cycle was finished.
    """
    if not len(motion.cycle_ends):
        raise RangeError(f"no cycle of {motion.path} was finished: {motion.stopped or 'the path is empty'}")
    steps: Array = np.diff(motion.postures, axis=0)
    return steps


@dataclass(frozen=True, eq=False)
class LimitCycle:
    """The sequence of postures at the ends of cycles.

    kind : "closed" (no drift beyond the integration's own error), "converges" (the drift shrinks, and the limit it leads to
        is known to a hundredth of the way there), "shrinks" (the drift does, but no limit is in sight yet), "drifts"
    ratio : by which the drift changed over the last cycle; NaN where it is closed
    limit (n,) : where the postures go if it goes on shrinking so (Aitken); None for "drifts"
    remaining : distance of the last posture from that limit [rad, m]; inf for "drifts"
    """

    kind: str
    ratio: float
    limit: Array | None
    remaining: float


def limit_cycle(motion: Motion) -> LimitCycle:
    """Whether the postures after each cycle converge; from at least four cycles.

    Raises RangeError for fewer.
    """
    steps = drift(motion)
    if len(steps) < FEWEST_CYCLES:
        raise RangeError(f"{len(steps)} cycles cannot tell a limit from drift; follow at least 4", cycles=len(steps))
    lengths = np.linalg.norm(steps, axis=-1)
    last = motion.postures[-1]
    if lengths.max() <= CLOSED_CYCLE:
        return LimitCycle("closed", np.nan, last, 0.0)
    if lengths[-1] <= CLOSED_CYCLE:
        return LimitCycle("converges", float(lengths[-1] / lengths[-2]), last, float(lengths[-1]))
    ratios = lengths[-3:] / lengths[-4:-1]
    ratio = float(ratios[-1])
    if not ratios.max() < 1:
        return LimitCycle("drifts", ratio, None, np.inf)
    rest = steps[-1] * ratio / (1 - ratio)
    remaining = float(np.linalg.norm(rest))
    kind = "converges" if remaining <= LIMIT_KNOWN * np.linalg.norm(last - motion.postures[0]) else "shrinks"
    return LimitCycle(kind, ratio, last + rest, remaining)


@dataclass(frozen=True, eq=False)
class Brackets:
    """Lie brackets of the columns of G, qdot = G(q) xdot, at one configuration; p = m (m - 1) / 2 pairs.

    pairs : (i, j) of the task rows
    bracket (p, n) : DG_j G_i - DG_i G_j
    outside (p, n) : the part (I - G J) [G_i, G_j] that lies in null J: zero for all pairs where the law is integrable
    reduced (p, k) : N'W [G_i, G_j], N orthonormal; None for a plain law, which has no W
    value : the largest |outside|, each over |DG_j||G_i| + |DG_i||G_j| (2-norms): 0 is integrable, 1 is as far as can be
    error : of `value`, by halving the step of the differences, and by rounding
    """

    pairs: tuple[tuple[int, int], ...]
    bracket: Array
    outside: Array
    reduced: Array | None
    value: float
    error: float

    @property
    def integrable(self) -> bool:
        """Whether nothing but the error of the differences keeps the brackets from range G."""
        return self.value <= self.error


def lie_brackets(
    method: Method | Callable[[Array, Array], Array], robot: Robot, q: Any, *, step: float = BRACKET_STEP, **parameters: Any
) -> Brackets:
    """Frobenius's test at q (n,): closed paths near q close in the joints only if every [G_i, G_j] lies in range G.

    G is the framework's answer to unit task velocities, DG its eighth-order central difference [step in rad, m]. A law
    that is a plain function (q, xdot) -> qdot does as well.

    Raises RefusalError where the law is not linear in xdot (a secondary motion of its own, or weights that depend on the
    direction of motion), and what the law raises at q or at a neighbour 4 steps away. RangeError for a step not positive.

    RankDeficientError where J has not full row rank, ShapeError for more than one configuration.

    Source: methods, Repeatability; Shamir & Yomdin 1988, Roberts & Maciejewski 1993.
    """
    if not (isinstance(method, Method) or callable(method)):
        raise UnknownNameError.of("law", type(method).__name__, ("a Method", "a function (q, xdot) -> qdot"))
    step = number(step, "step", above=0)
    q = check.real(q, "q")
    n, m = robot.n, robot.m
    if q.shape != (n,):
        raise ShapeError(f"q has shape {q.shape}; brackets are taken at one configuration ({n},)", shape=q.shape)
    J = robot.jacobian(q)
    sigma = np.linalg.svd(J, compute_uv=False)
    if m > n or not sigma[-1] > RANK * n * UNIT * sigma[0]:
        raise RankDeficientError(
            "J has not full row rank there: no G with J G = I, and no brackets to take; choose another configuration",
            singular_values=sigma.tolist(),
        )  # fmt: skip

    def law(q: Array, xdot: Array) -> Array:
        """Joint rates (B, n)."""
        if isinstance(method, Method):
            return rates(method, robot, q, xdot, **parameters)
        rows = check.real([method(*row) for row in zip(q, xdot, strict=True)], "the law's rates")
        check.shape(rows, ("B", "n"), {"B": len(q), "n": n}, "the law's rates")
        return rows

    def G(q: Array) -> Array:
        """Columns of G (B, n, m) at q (B, n); refuses a law that moves the joints while the hand rests."""
        units = np.concatenate([np.eye(m), np.zeros((1, m))])
        columns = law(np.repeat(q, m + 1, axis=0), np.tile(units, (len(q), 1))).reshape(len(q), m + 1, n)
        still = np.abs(columns[:, m]).max()
        if still > LINEARITY * np.abs(columns[:, :m]).max():
            raise RefusalError(
                f"the law moves the joints by {still:.3g} while the hand rests: brackets are of qdot = G xdot alone; take its "
                "secondary motion out (alpha = 0)"
            )  # fmt: skip
        return np.swapaxes(columns[:, :m], -1, -2)

    def derivative(step: float) -> Array:
        """DG (n, m, n): [:, i, k] = dG_i/dq_k."""
        offsets = step * np.arange(1, len(STENCIL) + 1)
        shifted = q + np.concatenate([offsets, -offsets])[:, None, None] * np.eye(n)  # (2s, n, n)
        ahead, behind = np.split(G(shifted.reshape(-1, n)).reshape(-1, n, n, m), 2)
        slope = np.einsum("s,skim->kim", STENCIL, ahead - behind) / step
        return np.moveaxis(slope, 0, -1)

    here = G(q[None])[0]
    backwards = law(q[None], -np.ones((1, m)))[0]
    if np.abs(backwards + here.sum(axis=-1)).max() > LINEARITY * np.abs(here).max():
        raise RefusalError("the law is not linear in the task velocity: there is no matrix G of which to take brackets")
    fine, coarse = derivative(step / 2), derivative(step)
    pairs = tuple(combinations(range(m), 2))

    def outside(DG: Array) -> tuple[Array, Array]:
        brackets = np.array([DG[:, j] @ here[:, i] - DG[:, i] @ here[:, j] for i, j in pairs]).reshape(len(pairs), n)
        return brackets, brackets - brackets @ J.T @ here.T

    bracket, beyond = outside(fine)
    if not pairs:
        return Brackets((), bracket, beyond, None, 0.0, 0.0)
    spectral = [np.linalg.norm(fine[:, i], 2) for i in range(m)]
    length = np.linalg.norm(here, axis=0)
    scale = np.array([spectral[j] * length[i] + spectral[i] * length[j] for i, j in pairs])
    scale = np.where(scale > 0, scale, 1.0)
    # rounding of G is u cond(J) |G|, divided by the step and multiplied by |G|
    rounding = BRACKET_ROUNDING * n * UNIT * sigma[0] / sigma[-1] * length.max() ** 2 / (step / 2)
    truncated = np.linalg.norm(outside(coarse)[1] - beyond, axis=-1)
    return Brackets(
        pairs, bracket, beyond, _reduced(method, robot, q, bracket, parameters),
        value=float((np.linalg.norm(beyond, axis=-1) / scale).max()), error=float(((truncated + rounding) / scale).max()),
    )  # fmt: skip


def _reduced(method: Any, robot: Robot, q: Array, bracket: Array, parameters: Any) -> Array | None:
    """N'W of each bracket (p, k)."""
    if not isinstance(method, Method):
        return None
    problem = method.cast(robot, q[None], np.zeros((1, robot.m)), **parameters)
    N = Spectrum.of(problem, np.array([problem.m])).V[:, :, problem.m :]
    product: Array = bracket @ problem.W.left(N)[0].T
    return product
