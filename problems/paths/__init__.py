"""Curves for the hand: displacement from where it starts, over time."""

from __future__ import annotations

from collections.abc import Callable
from inspect import signature
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
from sandbox.parameters import chosen

PATHS: dict[str, Callable[..., Path]] = {
    curve.__name__: curve
    for curve in (
        straight, circle, square, figure_eight, through_kinematic_singularity, through_algorithmic_singularity,
    )
}  # fmt: skip


def load(name: str, size: float | None = None, **options: Any) -> Path:
    """The path called `name`, of that size [m] (side, radius, length; its own where None), with options of its curve.

    Raises UnknownNameError where there is none, or no such option, and what the curve refuses.
    """
    curve = PATHS[chosen("path", name, PATHS)]
    known = list(signature(curve).parameters)[0 if size is None else 1 :]  # its size comes first
    for option in options:
        chosen(f"option of {name}", option, known)
    return curve(*([] if size is None else [size]), **options)
