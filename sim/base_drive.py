"""A simulated holonomic base."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, expm1, sin

import numpy as np

from ..devices.cia301 import AlState
from ..devices.robot_hand import ENABLED, HandStatus
from ..models import Array
from .node import SimNode

LAG_S = 0.05
"""Time constant with which its own controller follows."""
BRAKES = 1.5, 3.0
"""What its brakes slow it down by without leave to move [m/s^2, rad/s^2]."""


class SimBaseDrive(SimNode):
    """A base that is ready.

    Attributes:
        speed: measured: forward, to the left, about the upright axis, (3,) [m/s, m/s, rad/s].
        status: bits of `HandStatus`.
        target: speeds that it was told, (3,).
        enable: whether it may move.
        place: x, y and angle on the floor, (3,) [m, m, rad].
    """

    speed: Sequence[float]
    status = int(HandStatus.READY)
    target: Sequence[float]
    enable: int
    place: Array

    @property
    def enabled(self) -> bool:
        """Whether it may move: told to, by valid outputs."""
        return bool(self.enable & ENABLED) and self.al_state is AlState.OP

    def advance(self, dt: float) -> None:
        """Let dt [s] pass."""
        speed = self.fields["speed"]
        if self.enabled:
            speed -= expm1(-dt / LAG_S) * (self.fields["target"] - speed)
        else:
            along = float(np.hypot(speed[0], speed[1]))
            speed[:2] *= max(0.0, along - BRAKES[0] * dt) / along if along else 0.0
            speed[2] -= np.clip(speed[2], -BRAKES[1] * dt, BRAKES[1] * dt)
        x, y, angle = speed.tolist()
        turn = self.place[2]
        self.place += dt * np.array([cos(turn) * x - sin(turn) * y, sin(turn) * x + cos(turn) * y, angle])
        self.status = HandStatus.READY | (HandStatus.ENABLED if self.enabled else 0)

    def reset(self) -> None:
        """As any device; where it stands it stays."""
        self.place = getattr(self, "place", np.zeros(3))
        super().reset()
