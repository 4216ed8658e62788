"""The joint-rate weight W = base + E' Gamma E, kept factored to the end."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from sandbox import check
from sandbox.errors import ShapeError

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class Weight:
    """Symmetric weight W = base + E' Gamma E, one or a stack (leading axes).

    Forming E' Gamma E first loses the square of the conditioning, so products with W go
    through the factors: N'W = N'base + (N'E') Gamma E.

    Parameters
    ----------
    base : (..., n, n), symmetric; [unit of W_ij: 1/(q_i q_j) times a common unit]
    E : (..., k, n) or None; rows are gradients of secondary functions
    gamma : (..., k, k) symmetric, or (..., k) for a diagonal; identity if E is given alone

    Raises
    ------
    ShapeError, NonFiniteError, RangeError, AsymmetricWeightError
        naming the field, the index and the value.
    """

    base: Array
    E: Array | None = None
    gamma: Array | None = None

    def __post_init__(self) -> None:
        base = check.matrices(self.base, "W" if self.E is None else "W_base")
        n = base.shape[-1]
        check.shape(base, ("n", "n"), {"n": n}, "W" if self.E is None else "W_base")
        base = check.symmetric(base, "W" if self.E is None else "W_base")
        E, gamma = self.E, self.gamma
        if E is None and gamma is not None:
            raise ShapeError("W_gamma is given without W_E; give both, or neither")
        if E is not None:
            E = check.matrices(E, "W_E")
            check.shape(E, ("k", "n"), {"n": n}, "W_E")
            k = E.shape[-2]
            if gamma is None:
                gamma = np.broadcast_to(np.eye(k), (*E.shape[:-2], k, k))
            gamma = check.real(gamma, "W_gamma")
            if gamma.shape == (k, k) and k > 1 and E.shape[:-2] == (k,):
                raise ShapeError(
                    f"W_gamma of shape {gamma.shape} may be one matrix or {k} diagonals; "
                    f"give it as (1, {k}, {k}) or ({k}, {k}, {k})"
                )
            if gamma.shape[-1:] == (k,) and gamma.shape[-2:] != (k, k):
                gamma = gamma[..., :, None] * np.eye(k)
            check.shape(gamma, ("k", "k"), {"k": k}, "W_gamma")
            gamma = check.symmetric(gamma, "W_gamma")
            lead = check.leading({"W_base": base.shape[:-2], "W_E": E.shape[:-2], "W_gamma": gamma.shape[:-2]})
            base = np.broadcast_to(base, (*lead, n, n))
            E = check.frozen(np.broadcast_to(E, (*lead, k, n)))
            gamma = check.frozen(np.broadcast_to(gamma, (*lead, k, k)))
        object.__setattr__(self, "base", check.frozen(base))
        object.__setattr__(self, "E", E)
        object.__setattr__(self, "gamma", gamma)

    @property
    def n(self) -> int:
        """Number of joints."""
        return int(self.base.shape[-1])

    @property
    def lead(self) -> tuple[int, ...]:
        """Shape of the stack; () for one weight."""
        return tuple(self.base.shape[:-2])

    @property
    def factored(self) -> bool:
        """Whether W carries a factor E' Gamma E."""
        return self.E is not None

    def dense(self) -> Array:
        """W as one matrix (..., n, n), rounded: where accuracy matters use `times`."""
        if self.E is None or self.gamma is None:
            return self.base
        outer = np.swapaxes(self.E, -1, -2) @ (self.gamma @ self.E)
        return self.base + (outer + np.swapaxes(outer, -1, -2)) / 2

    def times(self, X: Array) -> Array:
        """W X for X (..., n, p), through the factors."""
        product = self.base @ X
        if self.E is None or self.gamma is None:
            return product
        return product + np.swapaxes(self.E, -1, -2) @ (self.gamma @ (self.E @ X))

    def left(self, N: Array) -> Array:
        """N'W for N (..., n, k), through the factors: N'base + (N'E') Gamma E."""
        Nt = np.swapaxes(N, -1, -2)
        product = Nt @ self.base
        if self.E is None or self.gamma is None:
            return product
        return product + ((Nt @ np.swapaxes(self.E, -1, -2)) @ self.gamma) @ self.E

    def broadcast(self, lead: tuple[int, ...]) -> Weight:
        """The same weight on a stack of shape `lead`."""
        if lead == self.lead:
            return self
        E = None if self.E is None else np.broadcast_to(self.E, (*lead, *self.E.shape[-2:]))
        gamma = None if self.gamma is None else np.broadcast_to(self.gamma, (*lead, *self.gamma.shape[-2:]))
        return Weight._trusted(np.broadcast_to(self.base, (*lead, self.n, self.n)), E, gamma)

    def reshape(self, lead: tuple[int, ...]) -> Weight:
        """The same stack with other leading axes."""
        E = None if self.E is None else self.E.reshape(*lead, *self.E.shape[-2:])
        gamma = None if self.gamma is None else self.gamma.reshape(*lead, *self.gamma.shape[-2:])
        return Weight._trusted(self.base.reshape(*lead, self.n, self.n), E, gamma)

    def __getitem__(self, index: Any) -> Weight:
        E = None if self.E is None else self.E[index]
        return Weight._trusted(self.base[index], E, None if self.gamma is None else self.gamma[index])

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        return np.array(self.dense(), dtype=dtype)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self)._trusted, (self.base, self.E, self.gamma)  # copies are read-only too

    @classmethod
    def _trusted(cls, base: Array, E: Array | None, gamma: Array | None) -> Weight:
        """Parts of a checked weight: not checked again."""
        self = object.__new__(cls)
        for name, value in (("base", base), ("E", E), ("gamma", gamma)):
            object.__setattr__(self, name, None if value is None else check.frozen(value))
        return self
