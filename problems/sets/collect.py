"""From single problems to groups: stacks of equal size and structure, one label row per member."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from sandbox.problem import VelocityProblem
from sandbox.problem_set import LABELS, Group
from sandbox.weight import Weight

Array = np.ndarray

FULL = 6
"""The full form of a set draws this many times as many rounds of its cases."""


class Member(NamedTuple):
    """One problem of a set and its labels; arrays as in VelocityProblem, without leading axes."""

    J: Array
    xdot: Array
    W: Array | Weight
    a: Array
    Wx: Array | None
    labels: dict[str, Any]


def draw(
    cases: Sequence[Any], member: Callable[[Any, np.random.Generator], Member], seed: int, *, rounds: int
) -> Iterator[Member]:
    """One member per case and round, member i from its own generator, default_rng(seed + i).

    More rounds only add members at the end: the standard form of a set is a prefix of its full form.
    """
    for number, case in enumerate(list(cases) * rounds):
        drawn = member(case, np.random.default_rng(seed + number))
        yield drawn._replace(labels={"seed": seed + number, **drawn.labels})


def grouped(members: Iterable[Member], tasks: tuple[str, ...], *, sequence: bool = False) -> tuple[Group, ...]:
    """Groups of equal (m, n), weight structure and presence of Wx, in the order of first appearance.

    sequence : members follow each other along trajectories, as their labels `seed` and `step` say
    """
    piles: dict[tuple[Any, ...], list[Member]] = {}
    for member in members:
        k = member.W.E.shape[0] if isinstance(member.W, Weight) and member.W.E is not None else None
        piles.setdefault((member.J.shape, k, member.Wx is not None), []).append(member)
    return tuple(_group(pile, tasks, sequence) for pile in piles.values())


def _group(members: list[Member], tasks: tuple[str, ...], sequence: bool) -> Group:
    weights = [m.W if isinstance(m.W, Weight) else Weight(m.W) for m in members]
    parts = [
        np.stack([getattr(w, part) for w in weights])
        for part in ("base", "E", "gamma")
        if weights[0].factored or part == "base"
    ]
    problem = VelocityProblem(
        J=np.stack([m.J for m in members]),
        xdot=np.stack([m.xdot for m in members]),
        W=Weight(*parts),
        a=np.stack([m.a for m in members]),
        Wx=None if members[0].Wx is None else np.stack([m.Wx for m in members if m.Wx is not None]),
    )
    columns = {name: [m.labels.get(name) for m in members] for name in LABELS}
    return Group(problem, {name: col for name, col in columns.items() if any(x is not None for x in col)}, tasks, sequence)
