"""A velocity-control method: how it casts a robot's motion as (J, xdot, W, a), and its own original formulation."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np

from sandbox.errors import EmptyPlanError
from sandbox.problem import VelocityProblem

Array = np.ndarray

Certainty = Literal["certain", "very likely", "likely", "plausible", "guess", "not identified"]


class Robot(Protocol):
    """What a method and a motion need of a robot; problems/robots/robot.py has all of it."""

    @property
    def name(self) -> str:
        """How records call it."""

    @property
    def n(self) -> int:
        """Number of joints."""

    @property
    def m(self) -> int:
        """Number of task rows."""

    def jacobian(self, q: Any) -> Array:
        """J (..., m, n) at q (..., n)."""

    def forward(self, q: Any) -> tuple[Array, Array]:
        """Position (..., 3) [m] and rotation (..., 3, 3) of the hand."""


class Draw(NamedTuple):
    """Seeded situations in which a method is defined: q (B, n), xdot (B, m), and what parameters go with them."""

    q: Array
    xdot: Array
    parameters: Mapping[str, Any] = {}


@dataclass(frozen=True, eq=False, kw_only=True)
class Method:
    """One row of the table of methods.

    id : "M1".."M20", "C1".."C3"; name : as typed; title : as read
    formula : the original law, one line
    weight, vector : W and a = alpha grad f, as formulas
    condition : where condition (7) holds
    number : the paper's reference number, "" where it has none; certainty : how sure the attribution is
    works : the publications, one line each
    cast : (robot, q (B, n), xdot (B, m), **parameters) -> VelocityProblem, a stack; refuses by a SandboxError
    original : the same arguments -> qdot (B, n), on a code path that shares nothing with the framework; None without one
    draw : (robot, generator, count) -> Draw; generic situations inside the method's domain
    form : the closed form that answers the cast; task : the task it is posed for, None where it minimises nothing
    still : parameters with which its secondary functions rest, so that a closed path can close in the joints
    inverts_weight : its original multiplies by W^-1, and so loses W's condition number
    refuses : what is refused, one line each
    """

    id: str
    name: str
    title: str
    formula: str
    weight: str
    vector: str
    condition: str
    number: str
    certainty: Certainty
    works: tuple[str, ...]
    cast: Callable[..., VelocityProblem]
    original: Callable[..., Array] | None
    draw: Callable[[Any, np.random.Generator, int], Draw]
    form: str = "eq6"
    task: Literal["exact", "least_squares", "damped"] | None = "exact"
    still: Mapping[str, Any] = field(default_factory=dict)
    inverts_weight: bool = False
    refuses: tuple[str, ...] = ()

    def witness(self, robot: Any, q: Array, xdot: Array, **parameters: Any) -> Array:
        """Joint rates (B, n) of the original formulation.

        Raises EmptyPlanError where the method has none.
        """
        if self.original is None:
            raise EmptyPlanError(f"{self.name} has no original formulation to compare with")
        return self.original(robot, q, xdot, **parameters)


STARTS = 20
"""Situations drawn for a start."""


def start(method: Method, robot: Robot, seed: int) -> Draw:
    """Of some seeded situations of the method, the one whose J is best conditioned: a motion can begin there."""
    drawn = [method.draw(robot, np.random.default_rng([seed, i]), 1) for i in range(STARTS)]
    sigma = np.linalg.svd(robot.jacobian(np.concatenate([one.q for one in drawn])), compute_uv=False)
    return drawn[int(np.argmax(sigma[:, -1] / sigma[:, 0]))]
