"""Five thousand problems with their exact truths, drawn once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

from problems import sets
from sandbox.certificate_study import FAMILIES, SIZES
from sandbox.problem import VelocityProblem
from sandbox.reference import truth
from sandbox.reference.truth import Truth

MOST_JOINTS = 7
"""Machine code for more takes long to compile; `sandbox certify` goes there."""

EACH = 80
"""Problems of each family and size."""


class Stack(NamedTuple):
    """Problems of one set or family and one size, decided exactly."""

    name: str
    problem: VelocityProblem
    truths: list[Truth]


def _stack(name: str, problem: VelocityProblem) -> Stack:
    truths = truth(problem)
    assert isinstance(truths, list)
    return Stack(name, problem, truths)


@pytest.fixture(scope="session")
def decided() -> list[Stack]:
    """All sets up to MOST_JOINTS, and every family in every size: conditions to 1e16, scales, factors, signs, edges."""
    groups = [(name, group.problem) for name in sets.SETS for group in sets.load(name).groups if "exact" in group.tasks]
    stacks = [_stack(name, problem) for name, problem in groups if problem.n <= MOST_JOINTS]
    for place, (name, draw) in enumerate(FAMILIES.items()):
        stacks += [_stack(name, draw(np.random.default_rng([71, place, m, n]), m, n, EACH)) for m, n in SIZES]
    return stacks
