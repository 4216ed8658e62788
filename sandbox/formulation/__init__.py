"""Formulations: ways to pose a velocity-control problem as an equality-constrained QP."""

from __future__ import annotations

from sandbox.formulation.convexified import AUGMENTED_LAGRANGIAN, CONVEXIFIED
from sandbox.formulation.direct import DIRECT
from sandbox.formulation.formulation import Formulation, Posed, Posing
from sandbox.formulation.least_squares import HIERARCHICAL, NORMAL_EQUATIONS, RANGE_SPACE
from sandbox.formulation.null_space import NULL_SPACE
from sandbox.formulation.slack import SLACK

FORMULATIONS: dict[str, Formulation] = {
    row.name: row
    for row in (
        DIRECT,
        CONVEXIFIED,
        AUGMENTED_LAGRANGIAN,
        NULL_SPACE,
        RANGE_SPACE,
        NORMAL_EQUATIONS,
        HIERARCHICAL,
        SLACK,
    )
}
"""Every formulation, by name."""

__all__ = ["FORMULATIONS", "Formulation", "Posed", "Posing"]
