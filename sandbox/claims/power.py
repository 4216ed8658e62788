"""Powers: those that errors, rates and condition numbers grow with, and of ten, as a page writes them."""

from __future__ import annotations

import numpy as np

Array = np.ndarray


def fitted(x: Array, y: Array) -> float:
    """Exponent p of y ~ x^p, by least squares of the logarithms; x and y (B,) positive."""
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


def scientific(value: float) -> str:
    r"""Two digits and a power of ten, in TeX."""
    digits, power = f"{value:.1e}".split("e")
    return rf"${digits} \times 10^{{{int(power)}}}$"
