"""A simulated hand with five drives."""

from __future__ import annotations

from .robot_hand import SimRobotHand


class SimSihHand(SimRobotHand):
    """See ``SimRobotHand``."""
