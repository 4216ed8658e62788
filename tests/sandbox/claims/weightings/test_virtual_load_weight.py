"""A single load."""

from __future__ import annotations

import numpy as np

from problems import robots
from sandbox.claims.weightings.virtual_load_weight import VirtualBody, alone, rates


def test_a_load_alone_is_told_by_its_place():
    """On the last link of the Panda's pose task it is at rest under self-motion, on the fourth it is not."""
    robot = robots.load("panda")
    q = (robot.lower + robot.upper)[None] / 2 + 0.2
    for joint, held in ((4, True), (7, False)):
        body = VirtualBody(joint, 1.0, (0.05, 0.02, 0.03), 0.01 * np.eye(3))
        refused, share = alone(rates, robot, q, np.ones((1, 6)), body)
        assert refused[0] != held
        assert (share[0] > 1e-6) == held
