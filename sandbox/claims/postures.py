"""Postures of the planar arms of unit links at which answers can be worked out by hand."""

from __future__ import annotations

import numpy as np

F1 = np.array([0.0, np.pi / 2, -np.pi / 2])
"""Planar 3R, tip at (2, 1) m."""

J1 = np.array([[-1.0, -1, 0], [2, 1, 1]])
"""The Jacobian at F1."""

NULL = np.array([-1.0, 1.0, 1.0])
"""Null vector of J at F1."""

F1B = np.array([0.0, np.pi / 2, 0.0])
"""Planar 3R, tip at (1, 2) m; null vector (0, -1, 2)."""

F2 = np.array([0.0, np.pi / 2, -np.pi / 2, np.pi / 2])
"""Planar 4R, tip at (2, 2) m."""

HAND_ANGLE = np.ones((1, 3))
"""Gradient of the hand's angle q_1 + q_2 + q_3 of the planar 3R, as a row."""
