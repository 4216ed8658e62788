"""Consecutive problems along paths, as a controller meets them: thousands of related QPs, cold and warm-started."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from problems import methods, paths, robots
from problems.paths.path import Path
from problems.robots.robot import Robot
from problems.sets import construct as make
from problems.sets.collect import Member, grouped
from sandbox.method import Method, start
from sandbox.problem_set import Group

Array = np.ndarray

STEPS = 12
"""Control steps per trajectory of the standard form."""

SIZE = 0.1
"""Of every path [m]."""

LONG = 150
"""And of those that the full form adds."""


class Case(NamedTuple):
    """Method, robot, path, and the plane the path lies in."""

    method: str
    robot: str
    path: str
    plane: str


CASES = (
    Case("gradient_projection", "planar_3r", "circle", "xy"),
    Case("mussa_ivaldi_hogan", "planar_3r", "figure_eight", "xy"),
    Case("augmented_jacobian", "planar_4r", "square", "xy"),
    Case("inertia_weighted", "planar_4r", "circle", "xy"),
    Case("inertia_weighted", "panda", "circle", "yz"),
    Case("manipulability_gradient", "panda", "figure_eight", "xy"),
)


def members(case: Case, seed: int, steps: int) -> Iterator[Member]:
    """One trajectory of `steps` problems; the configuration at each, to 2**-30, comes from the original law."""
    method, robot = methods.load(case.method), robots.load(case.robot)
    path = paths.load(case.path, SIZE, plane=case.plane)
    begun = start(method, robot, seed)
    q, parameters = begun.q, {**begun.parameters, **method.still}
    for step in range(steps):
        t = path.duration * step / steps
        problem = make.shortened(method.cast(robot, q, robot.translating(path.velocity(np.array([t]))), **parameters))[0]
        labels = {"robot": robot.name, "method": method.name, "seed": seed, "step": step, "q": q[0].tolist(), "case": case.path}
        yield Member(problem.J, problem.xdot, problem.W, problem.a, problem.Wx, labels)
        q = make.short(stepped(method, robot, path, q, t, path.duration / steps, parameters))


def stepped(method: Method, robot: Robot, path: Path, q: Array, t: float, h: float, parameters: Mapping[str, Any]) -> Array:
    """Configuration (1, n) after one classical Runge-Kutta step of h [s] of the original law."""

    def law(q: Array, t: float) -> Array:
        return method.witness(robot, q, robot.translating(path.velocity(np.array([t]))), **parameters)

    k1 = law(q, t)
    k2 = law(q + h / 2 * k1, t + h / 2)
    k3 = law(q + h / 2 * k2, t + h / 2)
    k4 = law(q + h * k3, t + h)
    step: Array = q + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return step


def build(seed: int, full: bool) -> tuple[Group, ...]:
    """The groups of the set, one after the other the trajectories of equal size; the full form adds long ones."""
    lengths = (STEPS, LONG) if full else (STEPS,)
    rows = [(case, steps) for steps in lengths for case in CASES]
    drawn = (member for number, (case, steps) in enumerate(rows) for member in members(case, seed + number, steps))
    return grouped(drawn, ("exact",), sequence=True)
