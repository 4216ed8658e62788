"""A weighting: what W is, and how definite."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from sandbox.weight import Weight


@dataclass(frozen=True, eq=False, kw_only=True)
class Weighting:
    """A row of the table of weightings.

    formula : W, in the letters of NOTATION
    unit : of 1/2 qdot'W qdot with rates per second; "any" where the user's W decides
    definiteness : what is known of W before its numbers are, and so of condition (7), N'WN > 0
    source : publication or equation
    function : stacked over configurations -> Weight; refuses by a SandboxError
    """

    name: str
    formula: str
    unit: str
    definiteness: str
    source: str
    function: Callable[..., Weight]
