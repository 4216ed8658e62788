"""The spherical-revolute-spherical arm at seeded configurations: tool position (3 x 7) and full pose (6 x 7)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from problems.measures.joint_limits import quadratic
from problems.robots.robot import Robot
from problems.robots.seven_joint import SEVEN_JOINT
from problems.sets import construct as make
from problems.sets.collect import FULL, Member, draw, grouped
from sandbox.problem_set import Group

Array = np.ndarray

TASKS = ("exact",)
ROUNDS = 5
ALPHA = 0.5  # of the joint-limit gradient [rad^2/s]


class Case(NamedTuple):
    """Arm, with its task; W, and f in a = alpha grad f."""

    arm: Robot
    W: str
    f: str


CASES = tuple(
    Case(arm, W, f)
    for arm in (SEVEN_JOINT.task("position"), SEVEN_JOINT.task("pose"))
    for W in ("identity", "inertia", "inertia without load", "random")
    for f in ("nothing", "joint limits")
)


def member(case: Case, rng: np.random.Generator) -> Member:
    """One configuration within nine tenths of the limits, one task velocity [m/s, rad/s]."""
    arm = case.arm
    q = make.short(rng.uniform(-0.9, 0.9, arm.n) * arm.upper)
    J = make.short(arm.jacobian(q))
    xdot = make.vector(rng, len(J))
    a = make.short(ALPHA * quadratic(arm).gradient(arm, q)) if case.f == "joint limits" else np.zeros(arm.n)
    task = "pose" if arm.m == 6 else "position"
    labels = {"robot": arm.name, "q": q.tolist(), "method": case.W, "case": f"{task}; W {case.W}; f {case.f}"}
    return Member(J, xdot, _weight(case, q, J, rng), a, None, labels)


def _weight(case: Case, q: Array, J: Array, rng: np.random.Generator) -> Array:
    n = case.arm.n
    if case.W == "identity":
        return np.eye(n)
    if case.W == "random":
        return make.positive_definite(rng, n)
    M = case.arm.inertia(q)
    if case.W == "inertia without load":  # M - c J'J: the same motion (methods M16), and indefinite for this c,
        # since c sigma_1(J)^2 >= c tr(JJ')/m = 2 tr M exceeds v'Mv for the unit vector v that J stretches most
        M = M - 2 * len(J) * np.trace(M) / np.sum(J * J) * J.T @ J
    return make.short(M)


def build(seed: int, full: bool) -> tuple[Group, ...]:
    """The groups of the set."""
    return grouped(draw(CASES, member, seed, rounds=ROUNDS * (FULL if full else 1)), TASKS)
