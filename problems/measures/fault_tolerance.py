"""Kinematic fault tolerance: what is left of J when joints lock (Maciejewski 1990; Roberts, Maciejewski 1996; methods M9)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations
from math import comb
from typing import Any

import numpy as np

from problems.measures.jacobian import Decomposition, decompose, pairing_gradient, require_full_rank
from problems.measures.measure import Card, Measure, NotDifferentiableError, OutsideDomainError
from problems.measures.singular_value import require_simple
from problems.robots.robot import Robot
from sandbox import check
from sandbox.errors import RangeError, RefusalError, SandboxError, ShapeError
from sandbox.parameters import configuration, told, whole
from sandbox.tolerances import RANK, TIE, UNIT

Array = np.ndarray

KFM = Card(
    "kfm", "the task's unit per rad", "smallest singular value of J after the worst failure",
    "Maciejewski 1990; methods M9", "everywhere; no gradient where it is 0 or not simple, one of several at a tie",
)  # fmt: skip
LEAST = Card(
    "least_relative_manipulability", "1", "share of the manipulability that the worst failure leaves",
    "Roberts, Maciejewski 1996; methods M9", "where J has full row rank; no gradient where it is 0, one of several at a tie",
)  # fmt: skip
FAULT_TOLERANCE = Card(
    "fault_tolerance", "1", "minus the sum of the logarithms of the relative manipulabilities, their smooth minimum",
    "after Roberts, Maciejewski 1996; methods M9", "where J has full row rank and no failure costs the task",
)  # fmt: skip


class TooManyFailuresError(RefusalError):
    """More joints fail than there are degrees of redundancy: the task is lost wherever the arm stands."""


def kfm(robot: Robot, *, failures: int = 1, joints: Sequence[int] | None = None) -> Measure:
    """Measure kfm = min_S sigma_m(^SJ), the worst smallest singular value once the joints of a set S have locked.

    failures : how many joints lock at once; joints : those that may (1..n), all without it

    Its gradient is that of the first set that attains the minimum; at a tie it is one of several (see `tied`). It refuses a
    reduced Jacobian without full row rank (RankDeficientError), or whose last singular values are not told apart
    (NotDifferentiableError). Raises TooManyFailuresError where failures > n - m, RangeError for joints that are not there.
    """
    sets = failure_sets(robot, failures, joints)

    def value(robot: Robot, q: Array) -> Array:
        return reduced_singular_values(robot.jacobian(q), sets).min(axis=-1)

    def gradient(robot: Robot, q: Array) -> Array:
        q = check.real(q, "q")
        J = robot.jacobian(q)
        worst = reduced_singular_values(J, sets).argmin(axis=-1)
        left = _kept(robot.n, sets)[worst]  # (..., n - f)
        reduced = np.take_along_axis(J, left[..., None, :], axis=-1)
        U, sigma, Vt = np.linalg.svd(reduced, full_matrices=False)
        require_full_rank(robot, reduced, sigma, "what the worst failure leaves of it has no gradient there: keep away")
        require_simple(robot, sigma, "the smallest singular value left by the worst failure")
        v = np.zeros(np.shape(q))
        np.put_along_axis(v, left, Vt[..., -1, :], axis=-1)
        return pairing_gradient(robot, q, U[..., :, -1, None] * v[..., None, :])

    return Measure(*KFM, value, gradient)


def least_relative_manipulability(robot: Robot, *, failures: int = 1, joints: Sequence[int] | None = None) -> Measure:
    """Measure min_S rho_S, rho_S = w(^SJ)/w(J), of 0..1; arguments as `kfm`.

    Refuses a Jacobian without full row rank (RankDeficientError). Its gradient is that of the first set that attains the
    minimum, see `tied`, and refuses rho_S = 0 (NotDifferentiableError).
    """
    sets = failure_sets(robot, failures, joints)

    def value(robot: Robot, q: Array) -> Array:
        return Redundancy.of(robot, check.real(q, "q")).relative(sets).min(axis=-1)

    def gradient(robot: Robot, q: Array) -> Array:
        q = check.real(q, "q")
        redundancy = Redundancy.of(robot, q)
        rho = redundancy.relative(sets)
        least = rho.min(axis=-1)
        _refuse_zero(robot, redundancy, least[..., None], sets, NotDifferentiableError)
        weights = np.zeros_like(rho)
        np.put_along_axis(weights, rho.argmin(axis=-1)[..., None], least[..., None], axis=-1)
        return pairing_gradient(robot, q, redundancy.log_slope(sets, weights))

    return Measure(*LEAST, value, gradient)


def fault_tolerance(robot: Robot, *, failures: int = 1, joints: Sequence[int] | None = None) -> Measure:
    """Measure f = -sum_S ln rho_S, the smooth form: infinite where a failure would cost the task; arguments as `kfm`.

    Refuses a Jacobian without full row rank (RankDeficientError) and rho_S = 0 (OutsideDomainError), which names the joints.
    """
    sets = failure_sets(robot, failures, joints)

    def value(robot: Robot, q: Array) -> Array:
        redundancy = Redundancy.of(robot, check.real(q, "q"))
        rho = redundancy.relative(sets)
        _refuse_zero(robot, redundancy, rho, sets, OutsideDomainError)
        return -np.log(rho).sum(axis=-1)

    def gradient(robot: Robot, q: Array) -> Array:
        q = check.real(q, "q")
        redundancy = Redundancy.of(robot, q)
        rho = redundancy.relative(sets)
        _refuse_zero(robot, redundancy, rho, sets, OutsideDomainError)
        return -pairing_gradient(robot, q, redundancy.log_slope(sets, np.ones_like(rho)))

    return Measure(*FAULT_TOLERANCE, value, gradient)


Sets = tuple[tuple[int, ...], ...]
"""Sets of joints that lock together, by their places 0..n-1."""


def failure_sets(robot: Robot, failures: int = 1, joints: Sequence[int] | None = None) -> Sets:
    """Every choice of `failures` joints out of `joints` (1..n).

    Raises TooManyFailuresError where they exceed n - m, RangeError for joints that are not there or no such choice,
    ShapeError for what is no list of joints.
    """
    if joints is not None and (isinstance(joints, str) or not isinstance(joints, Iterable)):
        raise ShapeError(f"joints is {told(joints)}; give the numbers of those that may fail, of 1..{robot.n}", field="joints")
    given = robot.joints if joints is None else list(joints)
    chosen = sorted({whole(joint, f"joints[{place}] of {robot.name}", 1, robot.n) for place, joint in enumerate(given)})
    if not chosen:
        raise RangeError("joints is empty: name at least one that may fail, or leave it out for all", field="joints")
    failures = whole(failures, f"failures of {len(chosen)} joints", 1, len(chosen))
    if failures > robot.k:
        raise TooManyFailuresError(
            f"{robot.name} has n - m = {robot.k} degrees of redundancy: with {failures} joints locked the task is lost, "
            "rho = 0 everywhere; ask for fewer task rows",
            redundancy=robot.k, failures=failures,
        )  # fmt: skip
    return tuple(combinations((joint - 1 for joint in chosen), failures))


def reduced_singular_values(J: Array, sets: Sets) -> Array:
    """sigma_m(^SJ) (..., |sets|): smallest singular value of J (..., m, n) without the columns of each set."""
    left = _kept(J.shape[-1], sets)
    reduced = np.moveaxis(J[..., left], -2, -3)  # (..., |sets|, m, n - f)
    return np.linalg.svd(reduced, compute_uv=False)[..., -1]


def relative_manipulability(J: Array, sets: Sets) -> Array:
    """rho_S = w(^SJ)/w(J) (..., |sets|): the volume of the rows S of an orthonormal N; sum rho_S^2 over all S is C(n-m, f)."""
    return Redundancy(*np.linalg.svd(J)).relative(sets)


def bound(n: int, m: int, failures: int = 1) -> float:
    """The largest that min_S rho_S can be: sqrt(C(n - m, f)/C(n, f))."""
    return float(np.sqrt(comb(n - m, failures) / comb(n, failures)))


def tied(values: Array, scale: Any = 1.0) -> Array:
    """Which members (..., |sets|) tie for the minimum, by TIE of `scale` (...,): where several do, the gradient is one of many.

    values : rho_S, or sigma_m(^SJ) with scale sigma_1
    """
    return values - values.min(axis=-1, keepdims=True) <= TIE * np.asarray(scale)[..., None]


class Redundancy(Decomposition):
    """The Jacobian decomposed, and what locked joints leave of it."""

    @classmethod
    def of(cls, robot: Robot, q: Array) -> Redundancy:
        """That of a robot at q; refuses a Jacobian without full row rank."""
        return cls(*decompose(robot, robot.jacobian(q), "relative manipulability has no value there: keep away"))

    def relative(self, sets: Sets) -> Array:
        """rho_S (..., |sets|)."""
        rows = self.N[..., np.array(sets), :]  # (..., |sets|, f, k)
        return np.prod(np.linalg.svd(rows, compute_uv=False), axis=-1)

    def log_slope(self, sets: Sets, weights: Array) -> Array:
        """A (..., m, n) with d/dq_k of sum_S weights_S ln rho_S = <A, dJ/dq_k>.

        d ln rho_S = -tr(P_SS^-1 (J^+ dJ P)_SS), P = NN', and P_SS^-1 meets N through the pseudoinverse of its rows S.
        """
        places = np.array(sets)
        N = self.N
        across = N[..., None, :, :] @ np.linalg.pinv(N[..., places, :])  # (..., |sets|, n, f)
        inner = np.einsum("...s,...snf,...sfm->...mn", weights, across, self.pinv[..., places, :])
        return -inner


def _kept(n: int, sets: Sets) -> Array:
    """The columns (|sets|, n - f) that each set leaves."""
    return np.array([[i for i in range(n) if i not in gone] for gone in sets])


def _refuse_zero(robot: Robot, redundancy: Redundancy, rho: Array, sets: Sets, error: type[SandboxError]) -> None:
    """Refuse relative manipulabilities (..., s) that are zero by rounding: N is known to n u cond(J)."""
    bad = ~(rho > (RANK * robot.n * UNIT * redundancy.condition)[..., None])
    if not bad.any():
        return
    *where, _ = check.first(bad)
    index = tuple(where)
    every = redundancy.relative(sets)[index]
    lost = [place + 1 for place in sets[int(every.argmin())]]
    raise error(
        f"at {configuration(index)} of {robot.name} the self-motion does not move joint {', '.join(map(str, lost))} (relative "
        f"manipulability {every.min():.3g}): locked there, the arm loses the task, and the measure has no gradient; leave "
        "those joints out of `joints`, or keep away",
        index=index, joints=lost, value=float(every.min()),
    )  # fmt: skip
