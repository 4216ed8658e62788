"""Checks at the door: each refusal names the field, the place in the stack and the value."""

from __future__ import annotations

import numbers
import reprlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from sandbox.errors import AsymmetricWeightError, NonFiniteError, RangeError, ShapeError
from sandbox.tolerances import LARGEST_ENTRY, SMALLEST_ENTRY, SYMMETRY

Array = np.ndarray

MOST_AXES = 32
"""Axes of a field: numpy broadcasts no more."""

SHOWN = 200
"""Letters of somebody else's message that are passed on."""


def line(words: object) -> str:
    """`words` on one short line, for a message: what does not print is escaped."""
    told = " ".join(str(words).split())
    told = told if told.isprintable() else repr(told)
    return told if len(told) <= SHOWN else told[:SHOWN] + "..."


def named(path: object) -> str:
    """The name of a file on one line, whole; quoted where it holds what does not print."""
    name = str(path)
    return name if name.isprintable() else repr(name)


def frozen(values: Any) -> Array:
    """A read-only float64 array; a writable one is copied, so that the caller's stays the caller's."""
    array = np.asarray(values)
    if array.flags.writeable or array.dtype != np.float64:
        array = np.array(array, dtype=np.float64, order="C")
        array.setflags(write=False)
    return array


def first(mask: Array) -> tuple[int, ...]:
    """Where the first True of a mask (...) stands; () where it has no axes."""
    return tuple(int(i) for i in np.argwhere(mask)[0])


def _entry(field: str, at: tuple[int, ...]) -> str:
    return f"{field}{list(at)}" if at else field


def real(values: Any, field: str) -> Array:
    """`values` as float64: numeric, finite, within the range in which products are safe."""
    if np.ma.is_masked(values):
        at = first(np.ma.getmaskarray(values))
        raise NonFiniteError(f"{_entry(field, at)} is masked; every entry must be given", field=field, index=at)
    try:
        given = np.asarray(values)
    except Exception as error:  # ragged nesting, or an object's own __array__
        raise ShapeError(f"{field} is no rectangular array: {line(error)}", field=field) from error
    if given.ndim > MOST_AXES:
        raise ShapeError(f"{field} has {given.ndim} axes; at most {MOST_AXES} are possible", field=field)
    if given.dtype.kind == "O":
        given = _floats(given, field)
    if given.dtype.kind not in "fiu":
        shown = f" ({line(reprlib.repr(given.item(0)))}, ...)" if given.size else ""
        raise ShapeError(f"{field} must hold real numbers, not {line(given.dtype)}{shown}", field=field)
    bad = ~np.isfinite(given)
    if bad.any():
        at = first(bad)
        raise NonFiniteError(
            f"{_entry(field, at)} is {given[at]}; every entry must be finite", field=field, index=at, value=float(given[at])
        )
    with np.errstate(over="ignore", under="ignore"):  # of wider floats; the range is checked next
        array = given.astype(np.float64)
    size = np.abs(array)
    bad = (size > LARGEST_ENTRY) | ((size < SMALLEST_ENTRY) & (given != 0))
    if bad.any():
        at = first(bad)
        raise _out_of_range(field, at, str(given[at]), float(array[at]))
    return array


def _floats(objects: Array, field: str) -> Array:
    """Python's own numbers as float64; integers beyond 64 bits come as objects."""
    array = np.empty(objects.shape)
    for at in np.ndindex(objects.shape):
        entry = objects[at]
        if isinstance(entry, bool) or not isinstance(entry, numbers.Real):
            told = line(reprlib.repr(entry))
            raise ShapeError(f"{field} must hold real numbers, but {_entry(field, at)} is {told}", field=field, index=at)
        try:
            array[at] = float(entry)
        except OverflowError:
            raise _out_of_range(field, at, "beyond all floats", np.inf if entry > 0 else -np.inf) from None
    return array


def _out_of_range(field: str, at: tuple[int, ...], told: str, value: float) -> RangeError:
    return RangeError(
        f"{_entry(field, at)} is {told}; nonzero magnitudes must lie between {SMALLEST_ENTRY:g} and "
        f"{LARGEST_ENTRY:g}: choose other units",
        field=field,
        index=at,
        value=value,
    )


def matrices(values: Any, field: str) -> Array:
    """`values` as a checked array of at least two axes."""
    array = real(values, field)
    if array.ndim < 2:
        raise ShapeError(f"{field} has shape {array.shape}; it must be a matrix or a stack of them", field=field)
    return array


def shape(array: Array, trailing: Sequence[str], sizes: dict[str, int], field: str) -> None:
    """Refuse `array` unless its last axes have the sizes that `trailing` names."""
    want = tuple(
        sizes.get(letter, array.shape[i - len(trailing)] if array.ndim >= len(trailing) else -1)
        for i, letter in enumerate(trailing)
    )
    if array.ndim < len(trailing) or array.shape[array.ndim - len(trailing) :] != want:
        letters = ", ".join(trailing)
        numbers = ", ".join(str(sizes.get(letter, letter)) for letter in trailing)
        raise ShapeError(
            f"{field} has shape {array.shape}; it must be (..., {letters}) = (..., {numbers})", field=field, shape=array.shape
        )
    if 0 in array.shape:
        what = "an empty stack" if 0 in array.shape[: array.ndim - len(trailing)] else "a zero size"
        raise ShapeError(f"{field} has shape {array.shape}: {what}; give at least one", field=field, shape=array.shape)


def symmetric(array: Array, field: str) -> Array:
    """(array + array')/2, refused when the two differ by more than rounding (methods 1.10)."""
    transposed = np.swapaxes(array, -1, -2)
    difference = np.abs(array - transposed)
    allowed = SYMMETRY * np.abs(array).max(axis=(-1, -2), keepdims=True)
    bad = difference > allowed
    if bad.any():
        at = first(bad)
        mirror = (*at[:-2], at[-1], at[-2])
        raise AsymmetricWeightError(
            f"{field}{list(at)} is {array[at]:.17g} but {field}{list(mirror)} is {array[mirror]:.17g}; "
            f"{field} must be symmetric: pass ({field} + {field}')/2 if that is what you mean",
            field=field,
            index=at,
            value=float(array[at]),
        )
    return (array + transposed) / 2


def leading(fields: dict[str, tuple[int, ...]]) -> tuple[int, ...]:
    """The common shape of the stacks, by numpy's rules."""
    try:
        return np.broadcast_shapes(*fields.values())
    except ValueError:
        told = ", ".join(f"{name} {lead}" for name, lead in fields.items())
        raise ShapeError(f"the stacks do not agree: leading axes {told}", **fields) from None
