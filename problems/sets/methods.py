"""Every method of the paper that minimises something, on every built-in robot, at seeded generic configurations."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from problems import robots
from problems.methods import METHODS
from problems.methods.draw import generic
from problems.robots.robot import Robot
from problems.sets import construct as make
from problems.sets.collect import Member, grouped
from sandbox.method import Draw, Method
from sandbox.problem_set import Group

Array = np.ndarray

FROZEN = (*(f"M{i}" for i in range(1, 21)), *(f"C{i}" for i in range(1, 4)))
"""Methods whose problems bear the name of this set; a later one gets a set of its own."""

ROBOTS = ("planar_3r", "planar_4r", "seven_joint", "panda")
STANDARD, FULL = 1, 20
"""Configurations per method and robot."""


def situations(method: Method, robot: Robot, drawn: Draw, seed: int, *, shortened: bool = False) -> Iterator[Member]:
    """The problems of a method in the situations `drawn`, labelled; every number to 2**-30 where they are to be frozen.

    Raises what the method's cast raises.
    """
    problem = method.cast(robot, drawn.q, drawn.xdot, **drawn.parameters)
    for q, one in zip(drawn.q, make.shortened(problem) if shortened else problem, strict=True):
        labels = {"robot": robot.name, "method": method.name, "seed": seed, "q": q.tolist(), "case": method.id}
        yield Member(one.J, one.xdot, one.W, one.a, one.Wx, labels)


def members(method: Method, robot: Robot, seed: int, part: int, count: int) -> Iterator[Member]:
    """Situations of one method on one robot, drawn by default_rng([seed, part])."""
    rng = np.random.default_rng([seed, part])
    drawn = method.draw(robot, rng, count)
    if method.task == "least_squares":
        drawn = drawn._replace(q=aligned(robot, rng, count))
    elif method.task == "damped":  # its own search for singularities ends in last bits that differ between machines
        drawn = drawn._replace(q=generic(robot, rng, count).q)
    return situations(method, robot, drawn, seed, shortened=True)


def aligned(robot: Robot, rng: np.random.Generator, count: int) -> Array:
    """Planar arms stretched out along an axis (count, n): a row of J is zero exactly, and stays so when rounded."""
    q = np.zeros((count, robot.n))
    q[:, 0] = rng.integers(-1, 2, count) * np.pi / 2
    return q


def build(seed: int, full: bool) -> tuple[Group, ...]:
    """The groups of the set, methods of one task together; the full form adds members at their ends."""
    rows = [
        (method, robots.load(name))
        for method in METHODS.values()
        for name in ROBOTS
        if method.id in FROZEN and method.task is not None and (method.task != "least_squares" or name.startswith("planar"))
    ]
    piles: dict[str, list[Member]] = {}
    for part, count in enumerate((STANDARD, FULL - STANDARD) if full else (STANDARD,)):
        for number, (method, robot) in enumerate(rows):
            piles.setdefault(str(method.task), []).extend(members(method, robot, seed + number, part, count))
    return tuple(group for task, pile in piles.items() for group in grouped(pile, (task,)))
