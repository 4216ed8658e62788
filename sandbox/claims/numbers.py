"""Rows of numbers as a page tells them."""

from __future__ import annotations

from typing import Any

import numpy as np

SUBSCRIPTS = "₁₂₃₄₅₆₇"

DUST = 12
"""Decimals beyond which a number of a table is rounding."""


def told(values: Any, digits: int = 6) -> str:
    """A row, or a matrix by its rows, as text: (−1.6, 0, 0.666667)."""
    values = np.asarray(values, dtype=float)
    if values.ndim > 1:
        return "; ".join(told(row, digits) for row in values)
    return "(" + ", ".join(f"{value:.{digits}g}".replace("-", "−") for value in np.round(values, DUST) + 0.0) + ")"


def half_unit(decimals: int) -> float:
    """What a number given with so many decimals may be off."""
    return 0.5 * 10.0**-decimals
