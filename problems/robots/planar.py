"""Planar nR arms: relative joint angles q [rad], task the tip position [m] and, if asked for, its angle [rad]."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

Array = np.ndarray


@dataclass(frozen=True)
class PlanarArm:
    """A planar arm with point masses at its link ends.

    name : how records call it
    lengths : link lengths [m]
    masses : point mass at the end of each link [kg]
    """

    name: str
    lengths: tuple[float, ...]
    masses: tuple[float, ...]

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.lengths)

    def _links(self, q: Array) -> tuple[Array, Array]:
        """Link vectors (..., n) [m]: components along x and y."""
        angle = np.cumsum(q, axis=-1)
        lengths = np.array(self.lengths)
        return lengths * np.cos(angle), lengths * np.sin(angle)

    def forward(self, q: Array) -> Array:
        """Tip (x, y, angle) (..., 3) [m, m, rad] at q (..., n)."""
        x, y = self._links(q)
        return np.stack([x.sum(-1), y.sum(-1), q.sum(-1)], axis=-1)

    def jacobian(self, q: Array, *, angle: bool = False) -> Array:
        """J (..., m, n): rows -Y_i and X_i [m/rad], X_i = sum over l >= i of the links; with `angle` a row of ones."""
        X, Y = (_tail(part) for part in self._links(q))
        rows = [-Y, X, np.ones_like(X)] if angle else [-Y, X]
        return np.stack(rows, axis=-2)

    def jacobian_derivative(self, q: Array, *, angle: bool = False) -> Array:
        """dJ/dq (..., n, m, n), [..., k, :, :] = dJ/dq_k: Hess x_ij = -X_max(i,j), Hess y_ij = -Y_max(i,j)."""
        X, Y = (_tail(part) for part in self._links(q))
        later = np.maximum.outer(np.arange(self.n), np.arange(self.n))
        rows = [-X[..., later], -Y[..., later]]
        if angle:
            rows.append(np.zeros_like(rows[0]))
        return np.stack(rows, axis=-2)

    def inertia(self, q: Array) -> Array:
        """M (..., n, n) [kg m^2] = sum over links of mass J_l'J_l, J_l the Jacobian of the end of link l."""
        x, y = self._links(q)
        M = np.zeros((*q.shape, self.n))
        for last, mass in enumerate(self.masses):
            reached = np.arange(self.n) <= last
            for part in (x, y):
                row = np.where(reached, _tail(np.where(reached, part, 0.0)), 0.0)
                M = M + mass * row[..., :, None] * row[..., None, :]
        return M


def _tail(part: Array) -> Array:
    """Sum of the entries from i to the end, for every i."""
    return np.cumsum(part[..., ::-1], axis=-1)[..., ::-1]


PLANAR_3R = PlanarArm("planar_3r", (1.0, 1.0, 1.0), (1.0, 1.0, 1.0))
PLANAR_4R = PlanarArm("planar_4r", (1.0, 1.0, 1.0, 1.0), (1.0, 1.0, 1.0, 1.0))
