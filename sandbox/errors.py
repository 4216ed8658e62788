"""Every error the sandbox raises, each with its evidence and the way out."""

from __future__ import annotations

from typing import Any


class SandboxError(Exception):
    """Root of all errors of the sandbox.

    `evidence` holds the numbers behind the refusal (indices, eigenvalues, singular values).
    """

    def __init__(self, message: str, **evidence: Any) -> None:
        super().__init__(message)
        self.evidence = evidence


class ShapeError(SandboxError, ValueError):
    """A field does not have the shape that the problem asks for."""


class NonFiniteError(SandboxError, ValueError):
    """A field holds NaN or infinity."""


class RangeError(SandboxError, ValueError):
    """A nonzero entry is so large or small that products of entries would overflow or underflow."""


class AsymmetricWeightError(SandboxError, ValueError):
    """W, Gamma or Wx is not symmetric; eq. (6) would then solve another problem (methods 1.10)."""


class UnknownNameError(SandboxError, KeyError):
    """A name (of a method, a backend, a set, ...) that is not registered."""

    def __str__(self) -> str:
        return str(self.args[0])  # KeyError would print the repr

    @classmethod
    def of(cls, kind: str, name: str, known: Any) -> UnknownNameError:
        """`name` is no `kind`; `known` lists those there are."""
        return cls(f"no {kind} is called {name!r}; there are: {', '.join(sorted(known))}", name=name)


class EmptyPlanError(SandboxError, ValueError):
    """What was asked for fits no problem: nothing would be run."""


class InputFileError(SandboxError, ValueError):
    """A file that the user named cannot be read as what it should be."""


class QueryError(SandboxError, ValueError):
    """A statement that `sandbox query` does not answer: not one SELECT, or wrong at a place that the message names."""


class RefusalError(SandboxError, ArithmeticError):
    """A well-formed problem that the chosen method must not answer."""


class ConditionSevenError(RefusalError):
    """N_J' W N_J is not positive definite: condition (7) fails, so there is no unique minimiser."""


class RankDeficientError(RefusalError):
    """J does not have full row rank: eq. (6) does not apply, eq. (13) does."""


class RankAmbiguousError(RefusalError):
    """The singular values of J show no clear gap, so that no rank can be declared."""


class WeightNotPositiveDefiniteError(RefusalError):
    """The method factors W (or another weight) and needs it positive definite."""


class IllConditionedError(RefusalError):
    """The decision the method rests on lies within its own rounding error."""
