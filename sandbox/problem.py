"""The velocity-control problem of the paper, one or a stack."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from sandbox import check
from sandbox.errors import ShapeError
from sandbox.weight import Weight

Array = np.ndarray


@dataclass(frozen=True, eq=False, kw_only=True)
class VelocityProblem:
    """Minimise  1/2 qdot' W qdot + a' qdot   subject to   J qdot = xdot,   a = alpha grad f.

    In the least-squares sense (eq. 13) the constraint becomes: (J qdot - xdot)' Wx (J qdot - xdot) minimal.

    Leading axes are a stack, as in numpy.linalg; they broadcast. Frozen: arrays are read-only float64.

    Parameters
    ----------
    J : (..., m, n) Jacobian [m/rad, rad/rad, ...]
    xdot : (..., m) task velocity [m/s, rad/s]
    W : (..., n, n) symmetric, or a Weight
    a : (..., n), alpha grad f; zero if left out
    Wx : (..., m, m) symmetric weight of the task space; None is the identity

    Raises
    ------
    ShapeError, NonFiniteError, RangeError, AsymmetricWeightError
        naming the field, the index in the stack and the value.

    Source: eqs. (1)-(7) and (13), English & Maciejewski.
    """

    J: Array
    xdot: Array
    W: Weight
    a: Array
    Wx: Array | None = None

    def __init__(self, J: Any, xdot: Any, W: Any, a: Any = None, Wx: Any = None) -> None:
        J = check.matrices(J, "J")
        check.shape(J, ("m", "n"), {}, "J")
        sizes = {"m": J.shape[-2], "n": J.shape[-1]}
        xdot = check.real(xdot, "xdot")
        check.shape(xdot, ("m",), sizes, "xdot")
        weight = W if isinstance(W, Weight) else Weight(W)
        check.shape(weight.base, ("n", "n"), sizes, "W")
        a = np.zeros(sizes["n"]) if a is None else check.real(a, "a")
        check.shape(a, ("n",), sizes, "a")
        stacks = {"J": J.shape[:-2], "xdot": xdot.shape[:-1], "W": weight.lead, "a": a.shape[:-1]}
        if Wx is not None:
            Wx = check.matrices(Wx, "Wx")
            check.shape(Wx, ("m", "m"), sizes, "Wx")
            Wx = check.symmetric(Wx, "Wx")
            stacks["Wx"] = Wx.shape[:-2]
        lead = check.leading(stacks)
        self._set(
            np.broadcast_to(J, (*lead, *J.shape[-2:])),
            np.broadcast_to(xdot, (*lead, xdot.shape[-1])),
            weight.broadcast(lead),
            np.broadcast_to(a, (*lead, a.shape[-1])),
            None if Wx is None else np.broadcast_to(Wx, (*lead, *Wx.shape[-2:])),
        )

    def _set(self, J: Array, xdot: Array, W: Weight, a: Array, Wx: Array | None) -> None:
        for name, value in (("J", J), ("xdot", xdot), ("a", a), ("Wx", Wx)):
            object.__setattr__(self, name, None if value is None else check.frozen(value))
        object.__setattr__(self, "W", W)

    @property
    def m(self) -> int:
        """Number of task rows."""
        return int(self.J.shape[-2])

    @property
    def n(self) -> int:
        """Number of joints."""
        return int(self.J.shape[-1])

    @property
    def lead(self) -> tuple[int, ...]:
        """Shape of the stack; () for one problem."""
        return tuple(self.J.shape[:-2])

    def __len__(self) -> int:
        if not self.lead:
            raise ShapeError("this is one problem, not a stack; `stacked()` makes it a stack of one")
        return self.lead[0]

    def __getitem__(self, index: Any) -> VelocityProblem:
        """Members of the stack, by anything that indexes the leading axes."""
        if not self.lead:
            raise ShapeError("this is one problem, not a stack; `stacked()` makes it a stack of one")
        return self._of(
            self.J[index], self.xdot[index], self.W[index], self.a[index], None if self.Wx is None else self.Wx[index]
        )

    def __iter__(self) -> Iterator[VelocityProblem]:
        return (self[i] for i in range(len(self)))

    def stacked(self) -> VelocityProblem:
        """The same problems with exactly one leading axis."""
        if len(self.lead) == 1:
            return self
        flat = (-1,) if 0 not in self.lead else (0,)
        return self._of(
            self.J.reshape(*flat, self.m, self.n),
            self.xdot.reshape(*flat, self.m),
            self.W.reshape((int(np.prod(self.lead, dtype=int)),)),
            self.a.reshape(*flat, self.n),
            None if self.Wx is None else self.Wx.reshape(*flat, self.m, self.m),
        )

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self)._of, (self.J, self.xdot, self.W, self.a, self.Wx)  # copies are read-only too

    @classmethod
    def _of(cls, J: Array, xdot: Array, W: Weight, a: Array, Wx: Array | None) -> VelocityProblem:
        """Parts of a checked problem: not checked again."""
        self = object.__new__(cls)
        self._set(J, xdot, W, a, Wx)
        return self


def given(problem: object) -> VelocityProblem:
    """`problem` if it is one; ShapeError if it is anything else, which says how to make one, or an empty stack."""
    if not isinstance(problem, VelocityProblem):
        raise ShapeError(f"expected a VelocityProblem, not {type(problem).__name__}: VelocityProblem(J=..., xdot=..., W=...)")
    if 0 in problem.lead:
        raise ShapeError(f"the problem is an empty stack, with leading axes {problem.lead}; give at least one")
    return problem
