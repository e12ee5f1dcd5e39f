"""A simulated neck arm."""

from __future__ import annotations

from collections.abc import Sequence
from math import expm1

from ..devices.cia301 import AlState
from ..devices.robot_hand import ENABLED, HandStatus
from .node import SimNode

LAG_S = 0.04
"""Time constant with which its own controller follows."""


class SimNeckArm(SimNode):
    """An arm that is ready, and stands by its brakes where it has no leave to move.

    Attributes:
        way: of its end from its middle, (6,) [m, rad].
        status: bits of `HandStatus`.
        target: where it was told to go, (6,) [m, rad].
        enable: whether it may.
    """

    way: Sequence[float]
    status = int(HandStatus.READY)
    target: Sequence[float]
    enable: int

    @property
    def enabled(self) -> bool:
        """Whether it may move: told to, by valid outputs."""
        return bool(self.enable & ENABLED) and self.al_state is AlState.OP

    def advance(self, dt: float) -> None:
        """Let dt [s] pass."""
        if self.enabled:
            way = self.fields["way"]
            way -= expm1(-dt / LAG_S) * (self.fields["target"] - way)
        self.status = HandStatus.READY | (HandStatus.ENABLED if self.enabled else 0)
