"""Curves for the hand: displacement from where it starts, over time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from problems.paths.curves import (
    circle,
    figure_eight,
    square,
    straight,
    through_algorithmic_singularity,
    through_kinematic_singularity,
)
from problems.paths.path import Path
from sandbox.errors import UnknownNameError

PATHS: dict[str, Callable[..., Path]] = {
    curve.__name__: curve
    for curve in (
        straight, circle, square, figure_eight, through_kinematic_singularity, through_algorithmic_singularity,
    )
}  # fmt: skip


def load(name: str, size: float | None = None, **options: Any) -> Path:
    """The path called `name`, of that size [m] (side, radius, length; its own where None), with options of its curve.

    Raises UnknownNameError where there is none, and what the curve refuses.
    """
    if name not in PATHS:
        raise UnknownNameError.of("path", name, PATHS)
    return PATHS[name](*([] if size is None else [size]), **options)
