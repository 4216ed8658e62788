"""The curves: straight, circle, square, figure eight, and two that meet a singularity; all at finite, known speed."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.paths.path import Path
from sandbox import check
from sandbox.errors import RangeError, ShapeError, UnknownNameError
from sandbox.tolerances import ORTHONORMAL

Array = np.ndarray

PLANES = {
    "xy": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    "yz": ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    "xz": ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
}
"""Planes by name, as two directions u, v in base axes; planar arms move in xy."""


def straight(length: float = 0.3, duration: float = 1.0, *, direction: Any = (1.0, 0.0, 0.0)) -> Path:
    """A line of `length` [m] along `direction` (3,), of any length but zero, at constant speed. Open."""
    toward = check.real(direction, "direction")
    if toward.shape != (3,) or not toward.any():
        raise ShapeError(f"direction must be three numbers (x, y, z), not all zero, not {toward.tolist()}")
    toward = toward / np.linalg.norm(toward)
    return _polyline("straight", [_positive(length, "length") * toward], duration, "a line at constant speed")


def square(side: float = 0.4, duration: float = 4.0, *, plane: Any = "xy") -> Path:
    """Sides -u, v, u, -v of `side` [m] in the plane (u, v), at constant speed. Closed, three corners."""
    u, v = _plane(plane) * _positive(side, "side")
    return _polyline("square", [-u, v, u, -v], duration, "four sides at constant speed", closed=True)


def circle(radius: float = 0.2, duration: float = 4.0, *, plane: Any = "xy") -> Path:
    """Radius ((cos s - 1) u + sin s v), s = 2 pi t / duration: once around, at constant speed, begun at its outermost u."""
    u, v = _plane(plane) * _positive(radius, "radius")
    rate = 2 * np.pi / _positive(duration, "duration")
    return Path(
        name="circle", duration=duration, closed=True, about="once around, at constant speed",
        displacement=lambda t: _column(np.cos(rate * np.asarray(t)) - 1) * u + _column(np.sin(rate * np.asarray(t))) * v,
        velocity=lambda t: rate * (_column(-np.sin(rate * np.asarray(t))) * u + _column(np.cos(rate * np.asarray(t))) * v),
    )  # fmt: skip


def figure_eight(size: float = 0.2, duration: float = 4.0, *, plane: Any = "xy") -> Path:
    """Size (sin s u + sin 2s / 2 v), s = 2 pi t / duration: two loops of opposite sense, begun where they cross."""
    u, v = _plane(plane) * _positive(size, "size")
    rate = 2 * np.pi / _positive(duration, "duration")
    return Path(
        name="figure_eight", duration=duration, closed=True, about="two loops of opposite sense, begun where they cross",
        displacement=lambda t: _column(np.sin(rate * np.asarray(t))) * u + _column(np.sin(2 * rate * np.asarray(t))) * v / 2,
        velocity=lambda t: rate * (_column(np.cos(rate * np.asarray(t))) * u + _column(np.cos(2 * rate * np.asarray(t))) * v),
    )  # fmt: skip


def through_kinematic_singularity(length: float = 0.9, duration: float = 1.0) -> Path:
    """A line outward along the ray from the base of planar_3r through its tip, past full reach if longer than 3 - sqrt 5 m.

    From `start` = (0, pi/2, -pi/2), tip (2, 1): sigma_min(J) = 0 at 0.7639 m, where no exact law can go on.
    """
    line = straight(length, duration, direction=(2.0, 1.0, 0.0))
    return _renamed(line, "through_kinematic_singularity", "planar_3r outward past full reach, where J loses rank")


def through_algorithmic_singularity(length: float = 0.7, duration: float = 1.0) -> Path:
    """A line along (1, 1) on which planar_3r cannot hold the angle q1 + q2 + q3 of its hand beyond 2 - sqrt 2 m.

    From `start` = (0, pi/2, -pi/2): with E = (1, 1, 1), det [J; E] = sin q2 is 0 at 0.5858 m, where the first two links
    are in line, though J has full rank there and the tip could go on to full reach.
    """
    line = straight(length, duration, direction=(1.0, 1.0, 0.0))
    return _renamed(line, "through_algorithmic_singularity", "planar_3r to where tip and hand angle are no longer independent")


def _renamed(line: Path, name: str, about: str) -> Path:
    return Path(
        name=name, duration=line.duration, displacement=line.displacement, velocity=line.velocity, closed=False, about=about,
        start=(0.0, np.pi / 2, -np.pi / 2),
    )  # fmt: skip


def _polyline(name: str, sides: list[Array], duration: float, about: str, *, closed: bool = False) -> Path:
    """Straight sides (p, 3) [m] one after the other, at one constant speed."""
    duration = _positive(duration, "duration")
    steps = np.array(sides)
    shares = np.linalg.norm(steps, axis=-1)
    instants = duration * np.concatenate([[0.0], np.cumsum(shares) / shares.sum()])
    instants[-1] = duration
    places = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    if closed:
        places[-1] = 0.0
    rates = steps / np.diff(instants)[:, None]

    def side(t: Any) -> Array:
        found: Array = np.clip(np.searchsorted(instants, t, side="right") - 1, 0, len(steps) - 1)
        return found

    def displacement(t: Any) -> Array:
        i = side(t)
        share = (np.asarray(t) - instants[i]) / (instants[i + 1] - instants[i])
        return places[i] + _column(share) * (places[i + 1] - places[i])

    return Path(
        name=name, duration=duration, displacement=displacement, velocity=lambda t: rates[side(t)], closed=closed,
        corners=tuple(float(instant) for instant in instants[1:-1]), about=about,
    )  # fmt: skip


def _plane(plane: Any) -> Array:
    """Two orthonormal directions (2, 3), by a name in PLANES or as given."""
    if isinstance(plane, str):
        if plane not in PLANES:
            raise UnknownNameError.of("plane", plane, PLANES)
        return np.array(PLANES[plane])
    axes = check.real(plane, "plane")
    if axes.shape != (2, 3) or np.abs(axes @ axes.T - np.eye(2)).max() > ORTHONORMAL:
        raise ShapeError(f"a plane is two orthonormal directions (2, 3) or one of {', '.join(PLANES)}, not {axes.tolist()}")
    return axes


def _positive(value: float, name: str) -> float:
    number = check.real(value, name)
    if number.shape != () or not number > 0:
        raise RangeError(f"{name} is {check.line(value)}; it must be one positive number", field=name, value=value)
    return float(number)


def _column(values: Any) -> Array:
    return np.asarray(values)[..., None]
