"""A configuration measure f(q): value, gradient and, where it has one, Hessian; by CasADi from one expression."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from problems.robots.robot import Robot
from problems.robots.twin import Symbol, twin
from sandbox import check
from sandbox.errors import RangeError, RefusalError, ShapeError
from sandbox.parameters import vectors, within

Array = np.ndarray

Function = Callable[[Robot, Array], Array]
Guard = Callable[[Robot, Array], None]
"""Raises a SandboxError, naming configuration and joint, where a measure has no value or gradient."""

KEPT = 256
"""Compiled functions kept; one each per expression, robot and order of derivative."""


class OutsideDomainError(RangeError):
    """A measure has no value at a configuration."""


class NotDifferentiableError(RefusalError):
    """A measure has a value at a configuration, but no gradient."""


class NotTwiceDifferentiableError(RefusalError):
    """A method needs the Hessian of a measure that has none."""


class Card(NamedTuple):
    """What a measure is called, the unit of f, what it is, where it comes from, and where it is defined; all in words."""

    name: str
    unit: str
    about: str
    source: str
    domain: str


def anywhere(robot: Robot, q: Array) -> None:
    """Every configuration is in the domain."""


@dataclass(frozen=True, eq=False)
class Measure:
    """A row: f and its derivatives, stacked over q (..., n); alpha > 0 in a = alpha grad f drives f down.

    name, about, source : how it is called, what it is, where it comes from
    unit : of f
    domain : where it is defined, in words
    value, gradient : (robot, q) -> (...,) [unit], (..., n) [unit/rad, unit/m]; refuse outside the domain
    hessian : (robot, q) -> (..., n, n), or None
    """

    name: str
    unit: str
    about: str
    source: str
    domain: str
    value: Function
    gradient: Function
    hessian: Function | None = field(default=None)

    def curvature(self, robot: Robot, q: Array) -> Array:
        """Hessian (..., n, n).

        Raises NotTwiceDifferentiableError where the measure has none.
        """
        if self.hessian is None:
            raise NotTwiceDifferentiableError(f"{self.name} has no Hessian; choose a measure that is twice differentiable")
        return self.hessian(robot, q)


def symbolic(
    name: str, unit: str, about: str, source: str, expression: Callable[..., Symbol],
    *, parameters: Sequence[Any] = (), constants: tuple[Hashable, ...] = (),
    domain: str = "everywhere", guard: Guard = anywhere, smooth: Guard = anywhere, value: Function | None = None,
) -> Measure:  # fmt: skip
    """A measure from an expression of the twin's q, compiled when first asked for; `guard` refuses before it is evaluated.

    expression : (twin, *constants, *symbols) -> scalar expression, one column of symbols per parameter; compiled once for
        each robot if it is the same function each time, so let it be one of a module
    parameters : numbers (p,), or (..., p) to go with each configuration
    constants : what the expression is made of beside them
    smooth : refuses, after `guard`, where there is a value but no gradient
    value : how the value is computed, where the expression would lose digits
    """
    values = [np.asarray(check.real(v, f"parameter of {name}")) for v in parameters]
    for v in values:
        if not v.ndim:
            raise ShapeError(f"a parameter of {name} is one number, {float(v):g}; give one per joint or coordinate")
    sizes = tuple(v.shape[-1] for v in values)

    def evaluated(order: int) -> Function:
        def function(robot: Robot, q: Array) -> Array:
            q = vectors(q, "q", robot.n)
            for v in values:
                within(q.shape[:-1], v.shape[:-1], f"parameter of {name}")
            guard(robot, q)
            if order:
                smooth(robot, q)
            elif value is not None:
                return value(robot, q)
            return compiled(expression, constants, sizes, robot, order)(q, *values)[0]

        return function

    return Measure(name, unit, about, source, domain, evaluated(0), evaluated(1), evaluated(2))


@lru_cache(maxsize=KEPT)
def compiled(
    expression: Callable[..., Symbol], constants: tuple[Hashable, ...], sizes: tuple[int, ...], robot: Robot, order: int = 0
) -> Callable[..., tuple[Array, ...]]:
    """The evaluator of an expression (order 0), of its gradient (1) or its Hessian (2) on a robot."""
    symbols = twin(robot)
    given = [ca.SX.sym(f"p{i}", size) for i, size in enumerate(sizes)]
    f = expression(symbols, *constants, *given)
    if order:
        f = ca.gradient(f, symbols.q) if order == 1 else ca.hessian(f, symbols.q)[0]
    return symbols.evaluator(f, parameters=given, axes=[order] if order else None)
