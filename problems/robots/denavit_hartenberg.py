"""Serial arms from a table of Denavit-Hartenberg parameters, in the standard or the modified (Craig's) convention."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Literal, NamedTuple

import numpy as np
import pinocchio as pin

from sandbox import check
from sandbox.errors import ShapeError
from sandbox.parameters import chosen, extended, flag, told
from sandbox.tolerances import UNIT

Array = np.ndarray

CONVENTIONS = ("standard", "modified")

Convention = Literal["standard", "modified"]


class Link(NamedTuple):
    """One row of a table; the joint's own coordinate is added to theta, or to d where it slides.

    standard : T_i = Rz(theta) Tz(d) Tx(a) Rx(alpha)   (Denavit, Hartenberg 1955)
    modified : T_i = Rx(alpha) Tx(a) Rz(theta) Tz(d)   (Craig 1986; alpha and a are those of the link before)

    a, d : [m]; alpha, theta : [rad]
    """

    a: float = 0.0
    alpha: float = 0.0
    d: float = 0.0
    theta: float = 0.0
    slides: bool = False


def arm(
    name: str, links: Sequence[Link], *, convention: Convention = "standard", flange: pin.SE3 | None = None, hand: str = "hand"
) -> pin.Model:
    """A massless arm: joints joint_1 .. joint_n, and its frames 1..n and `hand`, at `flange` behind the last of them.

    The frames are called frame_1 .. frame_n; `frame_i` moves with joint i. Add bodies with `appendBodyToJoint`.

    Raises UnknownNameError for another convention, ShapeError for no links, and check's errors for a row that holds no numbers.
    """
    chosen("Denavit-Hartenberg convention", convention, CONVENTIONS)
    if not links:
        raise ShapeError("a Denavit-Hartenberg table needs at least one row")
    for i, link in enumerate(links, start=1):
        if not isinstance(link, Link):
            raise ShapeError(f"row {i} of the Denavit-Hartenberg table is {told(link)}; give a Link", row=i)
        flag(link.slides, f"slides of row {i} of the Denavit-Hartenberg table")
    model = pin.Model()
    model.name = name
    joint, place = 0, pin.SE3.Identity()
    for i, (link, (before, behind)) in enumerate(zip(links, _fixed(links, convention), strict=True), start=1):
        moving = pin.JointModelPZ() if link.slides else pin.JointModelRZ()
        joint = model.addJoint(joint, moving, place * before, f"joint_{i}")
        model.addFrame(pin.Frame(f"frame_{i}", joint, 0, behind, pin.FrameType.OP_FRAME))
        place = behind
    model.addFrame(pin.Frame(hand, joint, 0, place * (flange or pin.SE3.Identity()), pin.FrameType.OP_FRAME))
    return model


def limit(model: pin.Model, lower: Sequence[float], upper: Sequence[float], rates: Sequence[float]) -> None:
    """Set limits (n,) [rad, m] and largest rates (n,) [rad/s, m/s].

    Raises ShapeError for a wrong number of them; Robot refuses limits the wrong way round.
    """
    for what, values in (("lower limits", lower), ("upper limits", upper), ("rate limits", rates)):
        if len(values) != model.nv:
            raise ShapeError(f"{len(values)} {what} for the {model.nv} joints of {model.name}")
    model.lowerPositionLimit = extended(lower, "lower limits")
    model.upperPositionLimit = extended(upper, "upper limits")
    model.velocityLimit = extended(rates, "rate limits")


def turned(axis: Literal["x", "y", "z"], angle: float) -> Array:
    """Rotation (3, 3) by `angle` [rad] about a coordinate axis; quarter turns are exact."""
    c, s = (0.0 if abs(value) <= UNIT * abs(angle) else float(value) for value in (np.cos(angle), np.sin(angle)))
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    R = np.eye(3)
    R[i, i], R[i, j], R[j, i], R[j, j] = c, -s, s, c
    return R


def _fixed(links: Sequence[Link], convention: Convention) -> Iterator[tuple[pin.SE3, pin.SE3]]:
    """What stands before each joint (q at zero, theta in it) and what moves behind it.

    Rz and Tz about one axis commute, so d may stand on either side of the joint.
    """
    for i, link in enumerate(links, start=1):
        a, alpha, d, theta = check.real(link[:4], f"row {i} of the Denavit-Hartenberg table")
        across = pin.SE3(turned("x", alpha), np.array([a, 0.0, 0.0]))  # Tx(a) Rx(alpha) = Rx(alpha) Tx(a)
        along = pin.SE3(np.eye(3), np.array([0.0, 0.0, d]))
        about = pin.SE3(turned("z", theta), np.zeros(3))
        yield (about, along * across) if convention == "standard" else (across * along * about, pin.SE3.Identity())
