"""A spherical-revolute-spherical arm of seven joints, by its table of Denavit-Hartenberg parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

Array = np.ndarray


@dataclass(frozen=True)
class SevenJointArm:
    """Seven revolute joints, axes of joints 1-3 through the shoulder, of joints 5-7 through the wrist.

    Link i: rotate q_i about z, shift d_i along z, then twist by alpha_i about x (standard convention, all a_i = 0).

    name : how records call it
    d : offsets [m]
    alpha : twists, in quarter turns
    masses : point masses [kg] at the origins of frames 1..7
    rotor : inertia of each joint's drive about its own axis [kg m^2]
    limits : joint limits, symmetric [rad]
    """

    name: str
    d: tuple[float, ...]
    alpha: tuple[int, ...]
    masses: tuple[float, ...]
    rotor: float
    limits: tuple[float, ...]

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.d)

    def frames(self, q: Array) -> tuple[Array, Array]:
        """Rotations (..., 8, 3, 3) and origins (..., 8, 3) [m] of frames 0 (base) to 7 (tool) at q (..., 7)."""
        R = np.broadcast_to(np.eye(3), (*q.shape[:-1], 3, 3))
        p = np.zeros((*q.shape[:-1], 3))
        rotations, origins = [R], [p]
        for i in range(self.n):
            p = p + self.d[i] * R[..., :, 2]
            R = R @ _turn(q[..., i], self.alpha[i])
            rotations.append(R)
            origins.append(p)
        return np.stack(rotations, axis=-3), np.stack(origins, axis=-2)

    def forward(self, q: Array) -> tuple[Array, Array]:
        """Position (..., 3) [m] and rotation (..., 3, 3) of the tool."""
        R, p = self.frames(q)
        return p[..., -1, :], R[..., -1, :, :]

    def jacobian(self, q: Array, *, pose: bool = True) -> Array:
        """J (..., 6, 7), rows linear [m/rad], then angular velocity [rad/rad]; without `pose` the first three."""
        R, p = self.frames(q)
        axes = R[..., :-1, :, 2]  # joint i turns about z of frame i - 1
        linear = np.cross(axes, p[..., -1:, :] - p[..., :-1, :])
        rows = np.concatenate([linear, axes], axis=-1) if pose else linear
        return np.swapaxes(rows, -1, -2)

    def inertia(self, q: Array) -> Array:
        """M (..., 7, 7) [kg m^2]: the point masses as they move, and the rotors on the diagonal."""
        R, p = self.frames(q)
        M = np.broadcast_to(self.rotor * np.eye(self.n), (*q.shape, self.n))
        for link, mass in enumerate(self.masses, start=1):
            moved = np.cross(R[..., :link, :, 2], p[..., link, None, :] - p[..., :link, :])  # (..., link, 3)
            padded = np.concatenate([moved, np.zeros((*q.shape[:-1], self.n - link, 3))], axis=-2)
            M = M + mass * padded @ np.swapaxes(padded, -1, -2)
        return M


def _turn(angle: Array, quarters: int) -> Array:
    """Rotation (..., 3, 3) by `angle` about z, then by `quarters` quarter turns about x."""
    c, s = np.cos(angle), np.sin(angle)
    ca, sa = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[quarters % 4]
    zero = np.zeros_like(c)
    rows = [[c, -s * ca, s * sa], [s, c * ca, -c * sa], [zero, zero + sa, zero + ca]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


SEVEN_JOINT = SevenJointArm(
    name="seven_joint",
    d=(0.34, 0.0, 0.4, 0.0, 0.4, 0.0, 0.126),
    alpha=(-1, 1, 1, -1, -1, 1, 0),
    masses=(0.0, 4.0, 2.0, 3.0, 1.5, 1.5, 0.5),
    rotor=0.0625,
    limits=(2.9, 2.0, 2.9, 2.0, 2.9, 2.0, 3.0),
)
