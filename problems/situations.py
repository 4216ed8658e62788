"""A method's seeded situations as a labelled group of problems."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from problems.robots.robot import Robot
from sandbox.method import Draw, Method
from sandbox.problem_set import Group


def situations(method: Method, robot: Robot, drawn: Draw, seed: int) -> Group:
    """The method cast in the situations `drawn`, labelled.

    Raises what the method's cast raises.
    """
    problem = method.cast(robot, drawn.q, drawn.xdot, **drawn.parameters)
    B = len(problem)
    labels: dict[str, Sequence[Any]] = {
        "robot": [robot.name] * B,
        "method": [method.name] * B,
        "seed": [seed] * B,
        "step": list(range(B)),
        "q": [row.tolist() for row in drawn.q],
    }
    return Group(problem, labels, (method.task or "exact",))
