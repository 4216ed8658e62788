"""A path: where the hand is to be, and how fast, over one round."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sandbox import check
from sandbox.errors import RangeError, ShapeError
from sandbox.tolerances import DIFFERENCE, PATH_CLOSURE, UNIT

Array = np.ndarray


@dataclass(frozen=True, eq=False, kw_only=True)
class Path:
    """A curve of the hand's point, given from where it starts; the hand's orientation is held.

    name : how records call it; about : what it is
    duration : of one round [s]
    displacement : times (...,) [s] in [0, duration] -> (..., 3) [m], base axes; zero at 0
    velocity : its derivative, (..., 3) [m/s]; at a corner the one after it
    closed : whether a round ends where it began
    corners : instants strictly inside (0, duration), ascending, at which the velocity jumps
    start : joint angles (n,) from which the curve does what its name says; None where any will do

    Raises ShapeError, RangeError where these contradict one another.
    """

    name: str
    duration: float
    displacement: Callable[[Array], Array]
    velocity: Callable[[Array], Array]
    closed: bool
    corners: tuple[float, ...] = ()
    about: str = ""
    start: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        duration, corners = check.real(self.duration, "duration"), check.real(self.corners, "corners")
        if duration.shape != () or not duration > 0:
            raise RangeError(f"the duration of {self.name} is {self.duration} s; it must be positive", value=self.duration)
        instants = (0.0, *corners.tolist(), float(duration))
        if any(later <= earlier for earlier, later in pairwise(instants)):
            raise RangeError(f"corners {self.corners} of {self.name} must ascend within (0, {self.duration:g}) s")
        times = np.linspace(0.0, self.duration, 33)
        for field, function in (("displacement", self.displacement), ("velocity", self.velocity)):
            values = check.real(function(times), field)
            if values.shape != (33, 3):
                raise ShapeError(f"{field} of {self.name} makes {values.shape} of (33,) times; it must be (33, 3)")
        along = self.displacement(times)
        size = PATH_CLOSURE * np.abs(along).max()
        if np.abs(along[0]).max() > size:
            raise RangeError(f"{self.name} starts {along[0].tolist()} m from where the hand is; it must start there")
        for a, b in pairwise(instants):
            step, t = UNIT ** (1 / 3) * (b - a), a + (b - a) * np.array([0.3, 0.6])
            measured = (self.displacement(t + step) - self.displacement(t - step)) / (2 * step)
            stated = self.velocity(t)
            if np.abs(measured - stated).max() > DIFFERENCE * max(np.abs(stated).max(), np.abs(measured).max()):
                raise RangeError(
                    f"velocity of {self.name} is not the derivative of its displacement: at {t[0]:g} s it is "
                    f"{stated[0].tolist()} m/s, differences give {measured[0].tolist()}"
                )
        if self.closed != bool(np.abs(along[-1]).max() <= size):
            said = "closed" if self.closed else "open"
            raise RangeError(f"{self.name} is said to be {said}, but ends at {along[-1].tolist()} m")

    @property
    def pieces(self) -> tuple[tuple[float, float], ...]:
        """Beginning and end [s] of each smooth piece."""
        return tuple(pairwise((0.0, *self.corners, self.duration)))
