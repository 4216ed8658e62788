"""Named collections of problems: groups of equal size, each a stack with one label row per member."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from sandbox.errors import EmptyPlanError, ShapeError
from sandbox.problem import VelocityProblem

Array = np.ndarray

LABELS = ("robot", "method", "seed", "step", "q", "knob", "value", "case")
"""Columns a group may label its members with; `knob` names what a scan varies and `value` how far."""


@dataclass(frozen=True, eq=False)
class Group:
    """One stack of equal (m, n) and weight structure, with labels.

    problem : VelocityProblem with one leading axis
    labels : column name -> sequence of one entry per member (None where it has no meaning)
    tasks : the tasks its members are posed for, of "exact", "least_squares", "damped"
    sequence : its members follow each other along trajectories: `seed` names a trajectory, `step` counts along it
    """

    problem: VelocityProblem
    labels: dict[str, Sequence[Any]] = field(default_factory=dict)
    tasks: tuple[str, ...] = ("exact",)
    sequence: bool = False

    def __post_init__(self) -> None:
        if len(self.problem.lead) != 1:
            raise ShapeError(f"a group is a stack with one leading axis, not {self.problem.lead}; use problem.stacked()")
        for name, column in self.labels.items():
            if name not in LABELS:
                raise ShapeError(f"no label is called {name!r}; there are: {', '.join(LABELS)}")
            if len(column) != len(self):
                raise ShapeError(f"label {name!r} has {len(column)} entries for {len(self)} problems")
        if self.sequence and None in self.labels.get("step", (None,)):
            raise ShapeError("the members of a sequence need the label 'step', which says where on its trajectory each stands")

    def __len__(self) -> int:
        return len(self.problem)

    def __getitem__(self, index: Any) -> Group:
        """A slice of the group, or the members an index array names."""
        rows = np.arange(len(self))[index]
        labels: dict[str, Sequence[Any]] = {name: [column[int(i)] for i in rows] for name, column in self.labels.items()}
        return Group(self.problem[rows], labels, self.tasks, self.sequence)

    def follows(self) -> Array:
        """Whether each member comes after the one before it on the same trajectory (B,).

        The two have the same robot, method and seed, and this one the later step; in a group that is no sequence nothing
        follows.
        """
        after = np.zeros(len(self), dtype=bool)
        if self.sequence:
            of = [self.labels[name] for name in ("robot", "method", "seed") if name in self.labels]
            step = self.labels["step"]
            after[1:] = [step[i] > step[i - 1] and all(c[i] == c[i - 1] for c in of) for i in range(1, len(self))]
        return after

    def ids(self) -> list[str]:
        """Content hash of each member: the same numbers have the same id, whatever set they stand in."""
        return problem_ids(self.problem)


def problem_ids(problem: VelocityProblem) -> list[str]:
    """Content hash (16 hex digits) of every member of a stack."""
    stack = problem.stacked()
    parts = [stack.J, stack.xdot, stack.W.base, stack.W.E, stack.W.gamma, stack.a, stack.Wx]
    shapes = repr([None if part is None else part.shape[1:] for part in parts]).encode()
    present = [part + 0.0 for part in parts if part is not None]  # -0.0 + 0.0 is 0.0: one id for both zeros
    ids = []
    for i in range(len(stack)):
        digest = hashlib.blake2b(shapes, digest_size=8)
        for part in present:
            digest.update(part[i].tobytes())
        ids.append(digest.hexdigest())
    return ids


@dataclass(frozen=True, eq=False)
class ProblemSet:
    """A named set of frozen numbers: changed numbers get a new name."""

    name: str
    groups: tuple[Group, ...]
    about: str = ""

    def __len__(self) -> int:
        return sum(len(group) for group in self.groups)

    def narrowed(self, tasks: tuple[str, ...]) -> ProblemSet:
        """The same set posed for these tasks only; groups posed for none of them are left out."""
        kept = [(group, tuple(task for task in group.tasks if task in tasks)) for group in self.groups]
        groups = tuple(replace(group, tasks=both) for group, both in kept if both)
        if not groups:
            raise EmptyPlanError(f"no problem of {self.name} is posed for {', '.join(tasks)}")
        return ProblemSet(self.name, groups, self.about)
