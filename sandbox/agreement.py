"""Framework against original: one method in many seeded situations, each difference measured by the sum of two bounds."""

from __future__ import annotations

import json
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from sandbox.closed_form import CLOSED_FORMS
from sandbox.law import answer
from sandbox.method import Method, Robot
from sandbox.parameters import whole
from sandbox.problem import VelocityProblem
from sandbox.spectrum import Spectrum
from sandbox.stacked import eigenvalues, solve, svd, symmetric, times, transpose
from sandbox.task import task_weight
from sandbox.tolerances import DAMPING, ORIGINAL, ROBOT_RANK, UNIT
from sandbox.weight import Weight

Array = np.ndarray

SHIFTS = ("J'AJ", "J'B + B'J")
"""Changes of W that leave the motion alone (methods I4, I5) and make W indefinite."""

MOST_DOUBLINGS = 40
"""Of a shift, from 2**-10 of W on, until W is indefinite."""


def study(method: Method, robot: Robot, *, count: int = 200, seed: int = 0) -> list[dict[str, Any]]:
    """Rows (records.METHODS): the method as cast and, where eq. (6) answers it, after each shift of W.

    count : seeded situations, drawn by the method itself inside its own domain

    Raises RangeError for count or seed, and what the method's draw, cast and original raise.
    """
    count, seed = whole(count, "count", 1), whole(seed, "seed", 0)
    rng = np.random.default_rng([seed, *robot.name.encode()])
    drawn = method.draw(robot, rng, count)
    start = time.perf_counter()
    problem = method.cast(robot, drawn.q, drawn.xdot, **drawn.parameters)
    seconds = time.perf_counter() - start
    original = method.witness(robot, drawn.q, drawn.xdot, **drawn.parameters)
    posed: dict[str | None, VelocityProblem] = {None: problem}
    if method.form == "eq6":
        posed |= {shift: shifted(problem, shift, rng) for shift in SHIFTS}
    common = {"method": method.name, "robot": robot.name, "n": robot.n, "m": robot.m, "situations": count, "seconds": seconds}
    return [{**common, "shift": shift, **compare(method, robot, p, original, drawn.parameters)} for shift, p in posed.items()]


def compare(
    method: Method, robot: Robot, problem: VelocityProblem, original: Array, parameters: Mapping[str, Any]
) -> dict[str, Any]:
    """What the framework answers beside what the original says (B, n): the figures of a row of records.METHODS."""
    solution = answer(method, robot, problem, parameters, on_refusal="status")
    solved = np.array([status.answered for status in solution.status])
    words = Counter(said for said, ok in zip(solution.said, solved, strict=True) if not ok)
    kept = np.flatnonzero(solved)
    x = solution.x[kept]
    difference = np.abs(x - original[kept]).max(axis=-1)
    ratio = difference / sum(bounds(method, problem[kept], x, parameters)) if len(kept) else difference
    relative = difference / np.abs(x).max(axis=-1)
    return {
        "held": len(kept),
        "refused": len(solved) - len(kept),
        "refusals": json.dumps(words),
        "indefinite": int((eigenvalues(problem.W.dense())[:, 0] < 0).sum()),
        "agreed": int((ratio <= 1).sum()),  # NaN does not agree
        "difference_median": float(np.median(relative)) if len(kept) else None,
        "difference_max": float(relative.max()) if len(kept) else None,
        "ratio_max": float(ratio.max()) if len(kept) else None,
    }


def shifted(problem: VelocityProblem, shift: str, rng: np.random.Generator) -> VelocityProblem:
    """The same motion from another weight: W + J'AJ, A negative definite; or W + J'B + B'J with a - B'xdot.

    Each is large enough to make W indefinite, and not much larger; they change nothing as N'J' = 0 (methods I4, I5).
    """
    J, B, m, n = problem.J, len(problem), problem.m, problem.n
    turn = np.linalg.qr(rng.standard_normal((B, m, m)))[0]
    A = -(turn * rng.uniform(1.0, 2.0, (B, 1, m))) @ transpose(turn)
    mixed = rng.standard_normal((B, m, n))
    more = symmetric(transpose(J) @ A @ J) if shift == "J'AJ" else transpose(J) @ mixed + transpose(mixed) @ J
    size = np.linalg.norm(problem.W.dense(), axis=(-1, -2)) / np.linalg.norm(more, axis=(-1, -2)) / 2**10
    for _ in range(MOST_DOUBLINGS):
        W = Weight(problem.W.base + size[:, None, None] * more, problem.W.E, problem.W.gamma)
        definite = eigenvalues(W.dense())[:, 0] >= 0
        if not definite.any():
            break
        size = np.where(definite, 2 * size, size)
    a = problem.a if shift == "J'AJ" else problem.a - size[:, None] * times(transpose(mixed), problem.xdot)
    return VelocityProblem(J=J, xdot=problem.xdot, W=W, a=a, Wx=problem.Wx)


def bounds(method: Method, problem: VelocityProblem, x: Array, parameters: Mapping[str, Any]) -> tuple[Array, Array]:
    """Bounds (B,) [unit of qdot], in the max norm, on the errors of the framework's answer x (B, n) and of the original's.

    framework : the closed form's own relative bound, for the problem as cast, times max(|x|, s) as for `error`
    original : it forms J, W and a on another path, each off by c n u of its norm, and multiplies by an explicit J^+
        (and W^-1, where it inverts W), which costs their condition numbers; to first order in u

    A method that minimises nothing (task None) is measured as eq. (6) would be.
    """
    framework, original = np.empty(len(problem)), np.empty(len(problem))
    relative = CLOSED_FORMS[method.form if method.form in CLOSED_FORMS else "eq6"].bound(problem)
    for members, plain, rates in _as_exact(problem, x, method.task or "exact", parameters.get("damping", DAMPING)):
        J, W = plain.J, plain.W.dense()
        _, sigma, V = svd(J)
        N, pinv = V[:, :, plain.m :], np.linalg.pinv(J)
        X11 = N @ solve(symmetric(plain.W.left(N) @ N), transpose(N))  # what the solution makes of -a
        X12 = pinv - X11 @ (W @ pinv)  # what it makes of xdot: G of methods 1.2
        y = times(transpose(X12), times(W, rates) + plain.a)
        size_a, size_xdot, step, multipliers = (np.linalg.norm(v, axis=-1) for v in (plain.a, plain.xdot, rates, y))
        size_W, gain_a, gain_xdot = (np.linalg.norm(A, 2, axis=(-1, -2)) for A in (W, X11, X12))
        effect = gain_a * (size_W * step + size_a + sigma[:, 0] * multipliers) + gain_xdot * (sigma[:, 0] * step + size_xdot)
        conditions = sigma[:, 0] / sigma[:, -1]
        if method.inverts_weight:
            spread = np.abs(eigenvalues(W))
            conditions = conditions + spread.max(axis=-1) / spread.min(axis=-1)
        s = (np.abs(X11) @ np.abs(plain.a)[..., None] + np.abs(X12) @ np.abs(plain.xdot)[..., None])[..., 0].max(axis=-1)
        framework[members] = relative[members] * np.maximum(np.abs(rates).max(axis=-1), s)
        original[members] = ORIGINAL * plain.n * UNIT * conditions * effect
    return framework, original


def _as_exact(problem: VelocityProblem, x: Array, task: str, damping: float) -> Iterator[tuple[Array, VelocityProblem, Array]]:
    """The same answers x as those of problems with J qdot = xdot and J of full row rank: (members, problem, x) by size."""
    if task == "damped":  # slack joints s = xdot - J qdot (methods C1)
        B, m, n = len(problem), problem.m, problem.n
        W = np.zeros((B, n + m, n + m))
        W[:, :n, :n], W[:, n:, n:] = damping**2 * problem.W.dense(), task_weight(problem)
        J = np.concatenate([problem.J, np.broadcast_to(np.eye(m), (B, m, m))], axis=-1)
        a = np.concatenate([damping**2 * problem.a, np.zeros((B, m))], axis=-1)
        slack = problem.xdot - times(problem.J, x)
        plain = VelocityProblem(J=J, xdot=problem.xdot, W=W, a=a)
        yield np.arange(B), plain, np.concatenate([x, slack], axis=-1)
    elif task == "least_squares":  # the rows that decide: U_r'Wx J qdot = U_r'Wx xdot
        sigma = svd(problem.J)[1]
        spectrum = Spectrum.of(problem, (sigma > ROBOT_RANK * sigma[:, :1]).sum(axis=-1))
        for r, members in spectrum.by_rank():
            part = problem[members]
            rows = transpose(spectrum.image_basis(r, members)) @ task_weight(part)
            yield members, VelocityProblem(J=rows @ part.J, xdot=times(rows, part.xdot), W=part.W, a=part.a), x[members]
    else:
        yield np.arange(len(problem)), problem, x
