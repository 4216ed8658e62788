"""Whether a method, or a planted fault in its place, agrees with its original."""

from __future__ import annotations

from problems import robots
from sandbox.agreement import study
from sandbox.method import Method


def agrees(method: Method, robot: str, count: int = 200) -> bool:
    """Whether framework and original agree in every seeded situation, as cast and after both shifts of W."""
    rows = study(method, robots.load(robot), count=count)
    return all(row["agreed"] == row["held"] == count for row in rows) and len(rows) == 3
