"""Checks of what a method, a measure or a weighting is given: each refusal names the parameter, the place and the value."""

from __future__ import annotations

import numbers
import reprlib
from collections.abc import Iterable
from typing import Any

import numpy as np

from sandbox import check
from sandbox.errors import RangeError, ShapeError, UnknownNameError

Array = np.ndarray


def told(value: object) -> str:
    """A value in a message: on one short line."""
    return check.line(reprlib.repr(value))


def number(
    value: Any, field: str, *, above: float | None = None, least: float | None = None, most: float = np.inf,
    infinite: bool = False,
) -> float:  # fmt: skip
    """One real number, above `above` or at least `least` where they are given, at most `most`, and finite unless `infinite`.

    Raises ShapeError; NonFiniteError, or with a bound RangeError, for what lies outside, NaN among it.
    """
    bounded = above is not None or least is not None
    given = extended(value, field) if bounded else check.real(value, field)
    if given.shape != ():
        raise ShapeError(f"{field} has shape {given.shape}; it must be one number", field=field, shape=given.shape)
    found = float(given)
    inside = (above is None or found > above) and (least is None or found >= least) and (infinite or found < np.inf)
    inside = inside and not found > most
    if not inside:
        bound = "positive" if above == 0 else f"above {above:g}" if above is not None else f"at least {least:g}"
        bound += f" and at most {most:g}" if most < np.inf else "" if infinite else " and finite"
        raise RangeError(f"{field} is {found:g}; it must be {bound}", field=field, value=found)
    return found


def scalar(value: Any) -> bool:
    """Whether a value is one number, and not one per joint."""
    return isinstance(value, numbers.Number) or (isinstance(value, np.ndarray) and not value.ndim)


def whole(value: Any, field: str, least: int, most: int | None = None, of: str = "a whole number") -> int:
    """One whole number of least..most; 2.0 is one, True is not.

    Raises RangeError.
    """
    integral = isinstance(value, numbers.Integral) and not isinstance(value, bool)
    fits = integral or (isinstance(value, float | np.floating) and float(value).is_integer())
    if not (fits and least <= value and (most is None or value <= most)):
        upto = f"of {least}..{most}" if most is not None else f"of at least {least}"
        raise RangeError(f"{field} is {told(value)}; it must be {of} {upto}", field=field, value=value)
    return int(value)


def flag(value: Any, field: str) -> bool:
    """True or False, and nothing that merely counts as one of them.

    Raises ShapeError.
    """
    if not isinstance(value, bool | np.bool_):
        raise ShapeError(f"{field} is {told(value)}; it must be True or False", field=field)
    return bool(value)


def chosen(kind: str, name: Any, known: Iterable[str]) -> str:
    """A name among `known`.

    Raises UnknownNameError for any other, and for what is no name at all.
    """
    if not isinstance(name, str) or name not in known:
        raise UnknownNameError.of(kind, check.line(name) if isinstance(name, str) else told(name), known)
    return name


def text(value: Any, field: str) -> str:
    """A name that the caller makes up.

    Raises ShapeError for what is none.
    """
    if not isinstance(value, str) or not value:
        raise ShapeError(f"{field} is {told(value)}; it must be a name", field=field)
    return value


def unused(choice: str, **parameters: Any) -> None:
    """Refuse (RangeError) a parameter that `choice`, in words, has no use for: it would be ignored silently."""
    for field, value in parameters.items():
        if value is not None:
            raise RangeError(f"{field} is given, but {choice} has no use for it; leave it out, or None", field=field)


def extended(values: Any, field: str) -> Array:
    """Real numbers (...), infinite ones and NaN too, for whoever asks where they lie.

    Raises ShapeError for what is no number, NonFiniteError for masked entries, RangeError.
    """
    try:
        given = np.asarray(values)
    except ValueError:  # ragged: told below
        given = np.zeros((), dtype=int)
    strange = ~np.isfinite(given) if given.dtype.kind == "f" else np.zeros(given.shape, dtype=bool)
    if np.ma.is_masked(values) or not strange.any():
        return check.real(values, field)
    return np.where(strange, given, check.real(np.where(strange, 0.0, given), field))


def within(lead: tuple[int, ...], values: tuple[int, ...], field: str) -> None:
    """Refuse (ShapeError) a parameter with the leading axes `values` that does not go with configurations (*lead, n)."""
    if check.leading({"q": lead, field: values}) != lead:
        raise ShapeError(f"{field} has the leading axes {values}, q only {lead}: give q for each", field=field, shape=values)


def vectors(values: Any, field: str, size: int, *, letter: str = "n", lead: tuple[int, ...] | None = None) -> Array:
    """Vectors (..., size), `letter` being that size in the message; with `lead` they go with configurations (*lead, n).

    Raises ShapeError, NonFiniteError, RangeError.
    """
    given = check.real(values, field)
    check.shape(given, (letter,), {letter: size}, field)
    if lead is not None:
        within(lead, given.shape[:-1], field)
    return given


def configuration(index: tuple[int, ...]) -> str:
    """How a configuration is named in a message, by its place in the stack."""
    return f"configuration {', '.join(map(str, index))}" if index else "this configuration"


def matrix(values: Any, field: str, size: int) -> Array:
    """A symmetric matrix (..., size, size) from a number, its diagonal (size,), or itself.

    Raises ShapeError, AsymmetricWeightError.
    """
    given = check.real(values, field)
    if given.ndim < 2:
        if given.shape not in ((), (size,)):
            raise ShapeError(
                f"{field} has shape {given.shape}; it must be a number, ({size},), ({size}, {size}) or (B, {size}, {size})",
                field=field, shape=given.shape,
            )  # fmt: skip
        given = given * np.eye(size)
    check.shape(given, ("n", "n"), {"n": size}, field)
    return check.symmetric(given, field)


def single(values: Array, field: str, size: int) -> Array:
    """A matrix of all configurations, (size, size).

    Raises ShapeError for a stack of them.
    """
    if values.ndim > 2:
        raise ShapeError(
            f"{field} has shape {values.shape}; it is one for all configurations: a number, ({size},) or ({size}, {size})",
            field=field, shape=values.shape,
        )  # fmt: skip
    return values
