"""Velocity control of kinematically redundant manipulators: formulations and QP solvers judged against exact truth."""

from __future__ import annotations

import importlib
from typing import Any

from sandbox.errors import (
    AsymmetricWeightError,
    ConditionSevenError,
    NonFiniteError,
    RangeError,
    RankDeficientError,
    RefusalError,
    SandboxError,
    ShapeError,
)
from sandbox.problem import VelocityProblem
from sandbox.solution import Solution, Status
from sandbox.weight import Weight

__version__ = "0.1.0"

_LATER = {
    "solve": "sandbox.closed_form.solve",
    "truth": "sandbox.reference.truth",
    "Truth": "sandbox.reference.truth",
    "cross_validate": "sandbox.cross_validate",
}
"""Functions whose modules load heavy libraries: imported when first used."""

__all__ = [
    "AsymmetricWeightError",
    "ConditionSevenError",
    "NonFiniteError",
    "RangeError",
    "RankDeficientError",
    "RefusalError",
    "SandboxError",
    "ShapeError",
    "Solution",
    "Status",
    "Truth",
    "VelocityProblem",
    "Weight",
    "cross_validate",
    "solve",
    "truth",
]


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


def __getattr__(name: str) -> Any:
    if name not in _LATER:
        raise AttributeError(f"module 'sandbox' has no attribute {name!r}")
    value = getattr(importlib.import_module(_LATER[name]), name)
    globals()[name] = value  # the submodule of the same name must not shadow the function
    return value
