"""Planar 3R and 4R arms at seeded configurations: W = I, the inertia matrix, random, and augmented Jacobians."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from problems.measures.joint_limits import quadratic
from problems.measures.manipulability import volume
from problems.robots.planar import PLANAR_3R, PLANAR_4R
from problems.robots.robot import Robot
from problems.sets import construct as make
from problems.sets.collect import FULL, Member, draw, grouped
from sandbox.problem_set import Group
from sandbox.weight import Weight

Array = np.ndarray

TASKS = ("exact", "damped")
ROUNDS = 5
ANGLE = 2.5  # configurations are drawn within [rad]
ALPHA = {"joint limits": 0.5, "manipulability": -0.5}  # alpha > 0 drives f down: towards mid-range, and w up
DAMPED = 2.0**-7  # base weight under an augmented Jacobian (methods M19)


class Case(NamedTuple):
    """Arm, with its task; W, and f in a = alpha grad f."""

    arm: Robot
    W: str
    f: str


CASES = tuple(
    Case(arm, *pair)
    for arm in (PLANAR_3R, PLANAR_4R, PLANAR_4R.task("planar pose"))
    for pair in (
        ("identity", "joint limits"),
        ("identity", "manipulability"),
        ("inertia", "joint limits"),
        ("inertia", "manipulability"),
        ("random", "joint limits"),
        ("random", "manipulability"),
        ("augmented", "secondary functions"),
        ("damped augmented", "secondary functions"),
    )
)


def member(case: Case, rng: np.random.Generator) -> Member:
    """One configuration, one task velocity [m/s, rad/s]."""
    arm = case.arm
    q = make.short(rng.uniform(-ANGLE, ANGLE, arm.n))
    J = make.short(arm.jacobian(q))
    xdot = make.vector(rng, len(J))
    W, a = _augmented(case, rng) if "augmented" in case.W else (_weight(case, q, rng), _gradient(case, q))
    task = "position and angle" if arm.m == 3 else "position"
    labels = {"robot": arm.name, "q": q.tolist(), "method": case.W, "case": f"{task}; W {case.W}; f {case.f}"}
    return Member(J, xdot, W, a, None, labels)


def _weight(case: Case, q: Array, rng: np.random.Generator) -> Array:
    if case.W == "identity":
        return np.eye(case.arm.n)
    return make.short(case.arm.inertia(q)) if case.W == "inertia" else make.positive_definite(rng, case.arm.n)


def _gradient(case: Case, q: Array) -> Array:
    f = quadratic(case.arm) if case.f == "joint limits" else volume()
    return make.short(ALPHA[case.f] * f.gradient(case.arm, q))


def _augmented(case: Case, rng: np.random.Generator) -> tuple[Weight, Array]:
    """Eqs. (8), (9): W = E'Gamma E, a = -E'Gamma gbar; one secondary function for each degree of redundancy."""
    n = case.arm.n
    first, tip = np.eye(n)[:1], np.ones((1, n))  # g = q_1, and g = q_1 + ... + q_n: the tip's angle
    E = first if case.arm.m == 3 else tip if n == 3 else np.vstack([first, tip])
    gamma, gbar = rng.uniform(0.5, 2.0, len(E)), make.vector(rng, len(E))
    base = (DAMPED if case.W.startswith("damped") else 0.0) * np.eye(n)
    return Weight(base, E, gamma), -make.product(E.T, gamma * gbar)


def build(seed: int, full: bool) -> tuple[Group, ...]:
    """The groups of the set."""
    return grouped(draw(CASES, member, seed, rounds=ROUNDS * (FULL if full else 1)), TASKS)
