"""The kernels compiled by numba, on first use: importing this module loads no compiler."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from types import FunctionType
from typing import Any

from sandbox.closed_form import kernels


@cache
def compiled(name: str) -> Callable[..., Any]:
    """kernels.<name> for float64 and float32 arrays; machine code is cached beside the source.

    The twins see each other, not the plain functions, so the source needs no decorator.
    """
    return _twins()[name]


@cache
def _twins() -> dict[str, Any]:
    import numba

    twins = dict(vars(kernels))
    for name, function in vars(kernels).items():
        if isinstance(function, FunctionType):
            twin = FunctionType(function.__code__, twins, name)
            twin.__module__, twin.__qualname__ = function.__module__, function.__qualname__
            # the numpy model divides by zero as numpy does: a bad member must not stop the stack
            twins[name] = numba.njit(cache=True, error_model="numpy")(twin)
    return twins
