"""The equality-constrained quadratic programme that every backend is given."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class QP:
    """Minimise  1/2 x' H x + g' x   subject to   A x = b;   L = 1/2 x'Hx + g'x + y'(Ax - b), so Hx + g + A'y = 0.

    Always a stack with one leading axis: H (B, n, n) symmetric, g (B, n), A (B, p, n), b (B, p); p may be 0.
    """

    H: Array
    g: Array
    A: Array
    b: Array

    def __len__(self) -> int:
        return int(self.g.shape[0])

    @property
    def n(self) -> int:
        """Number of variables."""
        return int(self.g.shape[-1])

    @property
    def p(self) -> int:
        """Number of equality rows; 0 where none are left."""
        return int(self.b.shape[-1])

    def __getitem__(self, index: Any) -> QP:
        """Members of the stack (a slice or an index array, so that a stack remains)."""
        return QP(self.H[index], self.g[index], self.A[index], self.b[index])
