"""What a formulation is: a pair that poses a QP and recovers joint rates and multipliers from its answer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from sandbox.problem import VelocityProblem
from sandbox.qp import QP
from sandbox.solution import Status

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class Posed:
    """QPs of one size, posed from the members `index` of a problem stack.

    keep : what recover needs besides the problem, stacked like the QP
    """

    index: Array
    qp: QP
    keep: dict[str, Array] = field(default_factory=dict)

    def __getitem__(self, members: Array) -> Posed:
        """Some of the QPs, by an index array into this stack."""
        return Posed(self.index[members], self.qp[members], {name: part[members] for name, part in self.keep.items()})


@dataclass(frozen=True, eq=False)
class Posing:
    """A whole problem stack, posed: stacks of QPs by size, and the members that the formulation refused."""

    parts: list[Posed]
    refused: dict[int, tuple[Status, str]] = field(default_factory=dict)


@dataclass(frozen=True)
class Formulation:
    """A tested pair build / recover for one task.

    build(problem) -> Posing
    then(problem, posed, x) -> Posed, for a formulation in two stages: the second QPs from the answers to the first
    recover(problem, posed, x, y) -> joint rates (b, n) and multipliers (b, m) with W qdot + a + J'y = 0,
        given `problem` already cut down to posed.index
    """

    name: str
    task: str
    about: str
    build: Callable[[VelocityProblem], Posing]
    recover: Callable[[VelocityProblem, Posed, Array, Array], tuple[Array, Array]]
    then: Callable[[VelocityProblem, Posed, Array], Posed] | None = None


def transpose(matrices: Array) -> Array:
    """Swap the last two axes."""
    return np.swapaxes(matrices, -1, -2)


def times(matrices: Array, vectors: Array) -> Array:
    """M v for stacks (b, p, q) and (b, q)."""
    return (matrices @ vectors[..., None])[..., 0]


def symmetric(matrices: Array) -> Array:
    """(M + M')/2: engines and eigenvalue routines read one triangle only."""
    return (matrices + transpose(matrices)) / 2
