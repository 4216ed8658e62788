"""Jacobians of the small planar arms that are worked out by hand."""

from __future__ import annotations

import numpy as np

from problems.sets.textbook import F1, F2

Array = np.ndarray

J1, J2 = np.array(F1.J, dtype=float), np.array(F2.J, dtype=float)
"""Of the planar 3R arm at (0, pi/2, -pi/2) and of the planar 4R arm at (0, pi/2, -pi/2, pi/2), unit links."""

ASKED = np.array([1.0, 1.0])
"""The task velocity of the small examples [m/s]."""
