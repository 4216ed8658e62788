"""The arms that accuracy and singularities are examined on."""

from __future__ import annotations

ARMS = {"planar_3r": "planar 3R", "panda": "Panda", "seven_joint": "7R", "planar_4r": "planar 4R"}
"""What an arm is called, by the name it is loaded by."""
