"""Fixtures of methods.md (planar arms with unit links, exact in quarter turns) and the checks that the tests share."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from problems import robots
from problems.methods.draw import generic
from problems.robots.planar import PLANAR_3R
from sandbox.agreement import bounds, study
from sandbox.law import answer
from sandbox.method import Method
from sandbox.tolerances import ORIGINAL, UNIT

Array = np.ndarray

QUARTER = np.pi / 2
F1 = np.array([[0.0, QUARTER, -QUARTER]])
F1B = np.array([[0.0, QUARTER, 0.0]])
F2 = np.array([[0.0, QUARTER, -QUARTER, QUARTER]])
Q0 = np.array([1.0, QUARTER, 1.0 - QUARTER])
"""Rest posture for which F1 is an equilibrium of unit springs under F = (-1, -1)."""

NULL = np.array([-1.0, 1.0, 1.0])
"""Null vector of J at F1."""

ROBOTS = ("planar_3r", "planar_4r", "panda")
COUNT = 200

EACH_ROBOT = pytest.mark.parametrize("name", ROBOTS)


def at(*xdot: float) -> Array:
    """One task velocity."""
    return np.array([xdot])


def rest(robot: Any, q: Array, F: Any) -> Array:
    """The rest posture of unit springs for which q is in balance with the force F on the hand."""
    return q - np.einsum("bmn,m->bn", robot.jacobian(q), np.asarray(F, dtype=float))


def found(method: Method, robot: Any, q: Array, xdot: Array, **parameters: Any) -> tuple[Array, Array]:
    """The framework's rates (B, n) and what their bound, and that of an explicit formula, allow them to be off (B, 1)."""
    problem = method.cast(robot, q, xdot, **parameters)
    x = answer(method, robot, problem, parameters).x
    return x, sum(bounds(method, problem, x, parameters))[:, None]


def answers(
    method: Method, robot: Any, q: Array, xdot: Array, expected: Any, digits: int | None = None, **parameters: Any
) -> None:
    """Framework and original give these rates, to the printed digits or to what rounding allows."""
    x, allowed = found(method, robot, q, xdot, **parameters)
    if digits is not None:
        allowed = np.full_like(allowed, 0.5 * 10.0**-digits)
    for who, rates in (("framework", x), ("original", method.witness(robot, q, xdot, **parameters))):
        assert (np.abs(rates - np.asarray(expected)) <= allowed).all(), (who, rates, expected)


def agrees(method: Method, name: str, *, task: Any = None) -> None:
    """Framework and original agree in every drawn situation, as cast and after the shifts of W."""
    rows = study(method, robots.load(name, task), count=COUNT)
    for row in rows:
        assert (row["held"], row["agreed"]) == (COUNT, COUNT), row


def faulty(method: Method, cast: Any, name: str = "planar_4r", *, task: Any = None) -> None:
    """The agreement check fails for the method with this cast in the place of its own."""
    with pytest.raises(AssertionError):
        agrees(replace(method, cast=cast), name, task=task)


def generic_3r(count: int = 20, seed: int = 0) -> tuple[Array, Array]:
    """Generic configurations and task velocities of the planar arm of three joints."""
    q, xdot, _ = generic(PLANAR_3R, np.random.default_rng(seed), count)
    return q, xdot


def rounding(robot: Any, q: Array, size: Any = 1.0) -> Array:
    """Allowed: c n u cond(J) size (B,): what an explicit formula in J^+ may be off."""
    return ORIGINAL * robot.n * UNIT * np.linalg.cond(robot.jacobian(q)) * size
