"""Constructions with known answers: J, N and the blocks S_N, S_T, C of W are chosen, W and a follow (methods 1.7).

With [J; Z] [Y N] = I every symmetric W is, uniquely,

    W = J'S_T J + J'C Z + Z'C'J + Z'S_N Z,   S_T = Y'WY,  C = Y'WN,  S_N = N'WN,

and with a = J'mu + Z'nu the stationary point is qdot = Y xdot + N y with S_N y = -(nu + C'xdot), its multipliers
lam = -(S_T xdot + C y + mu). S_N alone decides between minimum, saddle and maximum.

A name of a set means frozen numbers. So nothing here goes through BLAS or LAPACK, whose last bits differ from one
processor to the next: only elementwise arithmetic, which IEEE 754 fixes, and integers.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from typing import NamedTuple

import numpy as np

from sandbox.problem import VelocityProblem
from sandbox.weight import Weight

Array = np.ndarray
Generator = np.random.Generator

LARGEST = 3
"""Largest entry of an integer basis and of its inverse: products of five factors stay far below 2**53."""


def product(*factors: Array) -> Array:
    """Matrix product in one fixed order of operations; the last factor may be a vector."""
    return reduce(_product, factors)


def _product(A: Array, B: Array) -> Array:
    total = np.zeros((A.shape[0], *B.shape[1:]))
    for column, row in zip(A.T, B, strict=True):
        total = total + (column * row if B.ndim == 1 else column[:, None] * row)
    return total


def short(values: Array) -> Array:
    """`values` to the nearest multiple of 2**-30: what a robot's sines and BLAS leave in the last bits is gone."""
    return np.round(values * 2.0**30) / 2.0**30


def shortened(problem: VelocityProblem) -> VelocityProblem:
    """The same problem with every number to 2**-30."""
    W = problem.W
    parts = [short(part) for part in (W.base, W.E, W.gamma) if part is not None]
    Wx = None if problem.Wx is None else short(problem.Wx)
    return VelocityProblem(J=short(problem.J), xdot=short(problem.xdot), W=Weight(*parts), a=short(problem.a), Wx=Wx)


def symmetrised(A: Array) -> Array:
    """(A + A')/2."""
    return (A + A.T) / 2


def vector(rng: Generator, n: int) -> Array:
    """Vector of n entries, uniform in [-1, 1)."""
    return rng.uniform(-1.0, 1.0, n)


def symmetric(rng: Generator, n: int) -> Array:
    """A generic symmetric matrix (n, n), entries in [-1, 1)."""
    return symmetrised(rng.uniform(-1.0, 1.0, (n, n)))


def orthogonal(rng: Generator, n: int) -> Array:
    """An orthogonal matrix (n, n): the product of n reflections."""
    Q = np.eye(n)
    for _ in range(n):
        v = vector(rng, n)
        Q = Q - product(Q, v)[:, None] * v * (2.0 / sum((v * v).tolist()))
    return Q


def with_eigenvalues(rng: Generator, eigenvalues: Sequence[float] | Array) -> Array:
    """A symmetric matrix Q diag(eigenvalues) Q', Q a random orthogonal matrix."""
    Q = orthogonal(rng, len(eigenvalues))
    return symmetrised(product(Q * np.asarray(eigenvalues), Q.T))


def positive_definite(rng: Generator, n: int) -> Array:
    """A symmetric matrix (n, n) with eigenvalues in [0.5, 2)."""
    return with_eigenvalues(rng, rng.uniform(0.5, 2.0, n))


def integers(rng: Generator, *shape: int, largest: int = LARGEST) -> Array:
    """Integers in [-largest, largest], as float64."""
    return rng.integers(-largest, largest, shape, endpoint=True).astype(float)


def nonzero_integers(rng: Generator, *shape: int, largest: int = LARGEST) -> Array:
    """Integers in [-largest, largest] of which none is zero, as float64."""
    return rng.integers(1, largest, shape, endpoint=True) * rng.choice([-1.0, 1.0], shape)


def integer_symmetric(rng: Generator, n: int) -> Array:
    """A generic symmetric matrix (n, n) of integers."""
    upper = np.triu(integers(rng, n, n))
    return upper + np.triu(upper, 1).T


def unimodular(rng: Generator, n: int) -> tuple[Array, Array]:
    """An integer matrix (n, n) of determinant 1 and its inverse, no entry of either above `LARGEST`."""
    T, inverse = np.eye(n), np.eye(n)
    for _ in range(4 * n if n > 1 else 0):
        i, j = rng.choice(n, 2, replace=False)
        sign = float(rng.choice([-1.0, 1.0]))
        row, column = T[i] + sign * T[j], inverse[:, j] - sign * inverse[:, i]  # T -> (I + s e_i e_j')T
        if max(np.abs(row).max(), np.abs(column).max()) <= LARGEST:
            T[i], inverse[:, j] = row, column
    return T, inverse


def integer_form(rng: Generator, pivots: Sequence[float] | Array) -> tuple[Array, Array]:
    """S = F' diag(pivots) F and the unimodular F: integer, and its inertia is the signs of `pivots` exactly."""
    F, _ = unimodular(rng, len(pivots))
    return F.T @ (np.asarray(pivots, dtype=float)[:, None] * F), F


class Basis(NamedTuple):
    """[J; Z] [Y N] = I: J (m, n), Y (n, m), N (n, k), Z (k, n); N spans null J."""

    J: Array
    Y: Array
    N: Array
    Z: Array


def integer_basis(rng: Generator, m: int, n: int) -> Basis:
    """Small integers, so that J N = 0, J Y = I, ... hold exactly in float64."""
    T, inverse = unimodular(rng, n)
    return Basis(T[:m], inverse[:, :m], inverse[:, m:], T[m:])


def orthonormal_basis(rng: Generator, m: int, n: int) -> Basis:
    """J' and N orthonormal, so that the blocks of W have the eigenvalues of N'WN and Y'WY."""
    Q = orthogonal(rng, n)
    return Basis(Q[:, :m].T, Q[:, :m], Q[:, m:], Q[:, m:].T)


def real_basis(rng: Generator, m: int, n: int, singular_values: Array | None = None) -> Basis:
    """J with the given singular values (default: in [0.5, 2)) and N not orthonormal."""
    s = rng.uniform(0.5, 2.0, m) if singular_values is None else singular_values
    t = rng.uniform(0.5, 2.0, n - m)
    U, V, K = orthogonal(rng, m), orthogonal(rng, n), orthogonal(rng, n - m)
    V1, V2 = V[:, :m], V[:, m:]
    return Basis(product(U * s, V1.T), product(V1 / s, U.T), product(V2 * t, K.T), product(K / t, V2.T))


def weight(basis: Basis, S_T: Array, C: Array, S_N: Array) -> Array:
    """W (n, n) with Y'WY = S_T, Y'WN = C, N'WN = S_N (methods 1.6)."""
    J, Z = basis.J, basis.Z
    return symmetrised(product(J.T, product(S_T, J) + 2 * product(C, Z)) + product(Z.T, S_N, Z))


def gradient(basis: Basis, mu: Array, nu: Array) -> Array:
    """The vector a = J'mu + Z'nu (n,)."""
    return product(basis.J.T, mu) + product(basis.Z.T, nu)


def valid_indefinite(rng: Generator, basis: Basis) -> Array:
    """W with N'WN positive definite, C generic, and Y'WY negative definite, eigenvalues in (-2, -0.5]."""
    m, k = len(basis.J), len(basis.Z)
    S_T = with_eigenvalues(rng, -rng.uniform(0.5, 2.0, m))
    return weight(basis, S_T, rng.uniform(-1.0, 1.0, (m, k)), positive_definite(rng, k))
