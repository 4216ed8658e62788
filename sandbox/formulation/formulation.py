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

    def pose(self, problem: VelocityProblem) -> Posing:
        """Build a stack; a member whose QP overflows float64 is refused, whatever becomes of its neighbours."""
        with np.errstate(all="ignore"):
            posing = self.build(problem)
        parts, refused = [], dict(posing.refused)
        for posed in posing.parts:
            entries = [part.reshape(len(posed.qp), -1) for part in (posed.qp.H, posed.qp.g, posed.qp.A, posed.qp.b)]
            finite = np.isfinite(np.concatenate(entries, axis=-1)).all(axis=-1)
            refused |= {int(i): (Status.FAILED, "posing overflows float64: choose other units") for i in posed.index[~finite]}
            parts.append(posed[np.flatnonzero(finite)])
        return Posing([posed for posed in parts if len(posed.index)], refused)
