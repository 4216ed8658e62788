"""Checks at the door: each refusal names the field, the place in the stack and the value."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from sandbox.errors import AsymmetricWeightError, NonFiniteError, RangeError, ShapeError
from sandbox.tolerances import LARGEST_ENTRY, SMALLEST_ENTRY, SYMMETRY

Array = np.ndarray


def frozen(values: Any) -> Array:
    """A read-only float64 array; a writable one is copied, so that the caller's stays the caller's."""
    array = np.asarray(values)
    if array.flags.writeable or array.dtype != np.float64:
        array = np.array(array, dtype=np.float64, order="C")
        array.setflags(write=False)
    return array


def _place(mask: Array) -> tuple[int, ...]:
    return tuple(int(i) for i in np.argwhere(mask)[0])


def real(values: Any, field: str) -> Array:
    """`values` as float64: numeric, finite, within the range in which products are safe."""
    try:
        array = np.asarray(values)
    except ValueError as error:  # ragged nesting
        raise ShapeError(f"{field} is no rectangular array: {error}", field=field) from error
    if array.dtype.kind not in "fiu":
        shown = np.array2string(array.ravel()[:3], threshold=3)
        raise ShapeError(f"{field} must hold real numbers, not {array.dtype} ({shown}...)", field=field)
    array = array.astype(np.float64)
    bad = ~np.isfinite(array)
    if bad.any():
        at = _place(bad)
        raise NonFiniteError(
            f"{field}{list(at)} is {array[at]}; every entry must be finite", field=field, index=at, value=float(array[at])
        )
    size = np.abs(array)
    bad = (size > LARGEST_ENTRY) | ((size < SMALLEST_ENTRY) & (size > 0))
    if bad.any():
        at = _place(bad)
        raise RangeError(
            f"{field}{list(at)} is {array[at]:.17g}; nonzero magnitudes must lie between {SMALLEST_ENTRY:g} and "
            f"{LARGEST_ENTRY:g}: choose other units",
            field=field,
            index=at,
            value=float(array[at]),
        )
    return array


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
        at = _place(bad)
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
