"""Problems to measure speed on: dense, well-conditioned, feasible, W > 0, so that everything that is timed solves them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sandbox.problem import VelocityProblem

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class Stack:
    """B problems of m rows and n joints as plain arrays: J (B, m, n), xdot (B, m), W (B, n, n), a (B, n)."""

    J: Array
    xdot: Array
    W: Array
    a: Array

    @property
    def problem(self) -> VelocityProblem:
        """The same as the library's own noun."""
        return VelocityProblem(J=self.J, xdot=self.xdot, W=self.W, a=self.a)

    def flat(self, bits: int) -> list[Array]:
        """J, xdot, W, a with one contiguous row of numbers per problem."""
        kind = {64: np.float64, 32: np.float32}[bits]
        return [np.ascontiguousarray(v.reshape(len(v), -1), dtype=kind) for v in (self.J, self.xdot, self.W, self.a)]

    def kkt(self) -> tuple[Array, Array]:
        """Matrices (B, n + m, n + m) and right sides (B, n + m, 1) of W x + J'y = -a, J x = xdot."""
        B, m, n = self.J.shape
        K = np.zeros((B, n + m, n + m))
        K[:, :n, :n], K[:, n:, :n], K[:, :n, n:] = self.W, self.J, self.J.transpose(0, 2, 1)
        return K, np.concatenate([-self.a, self.xdot], axis=1)[..., None]


def stack(m: int, n: int, B: int, seed: int = 0) -> Stack:
    """B seeded problems."""
    rng = np.random.default_rng(seed)
    R = rng.standard_normal((B, n, n))
    W = R @ R.transpose(0, 2, 1) / n + np.eye(n)
    return Stack(
        rng.standard_normal((B, m, n)), rng.standard_normal((B, m)), (W + W.transpose(0, 2, 1)) / 2, rng.standard_normal((B, n))
    )
