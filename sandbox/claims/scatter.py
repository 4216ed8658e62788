"""Many seeded points on one plot: beside each other, on logarithmic axes, and no more of them than can be seen."""

from __future__ import annotations

import numpy as np

Array = np.ndarray

LEAST_SHOWN = 2.0**-60
"""Where an error of zero is drawn on a logarithmic axis."""


def beside(place: int, count: int) -> Array:
    """`count` abscissae around a category, so that points do not hide each other."""
    return place + np.linspace(-0.3, 0.3, count) if count > 1 else np.full(count, float(place))


def drawable(values: Array) -> Array:
    """The same for a logarithmic axis: zero is drawn at LEAST_SHOWN."""
    return np.maximum(values, LEAST_SHOWN)


def thinned(values: Array, most: int = 600) -> Array:
    """Evenly spaced entries of what is too many points for a plot."""
    return values[:: -(-len(values) // most)]
