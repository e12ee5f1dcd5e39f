"""A simulated hand with nine drives."""

from __future__ import annotations

from .robot_hand import SimRobotHand


class SimSvhHand(SimRobotHand):
    """See ``SimRobotHand``."""
