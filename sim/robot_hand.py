"""What simulated robot hands have in common: they report what their fingers do."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..devices.cia301 import AlState
from ..devices.robot_hand import ENABLED, HandStatus, RobotHand
from .fingers import Fingers
from .node import SimNode

Angles = Sequence[float] | NDArray[np.float64]


class SimRobotHand(SimNode):
    """A hand that is ready; the plant steps its fingers.

    Attributes:
        position, current: of the drives, (n,) [rad, A]; ``advance`` sets them.
        status: bits of `HandStatus`.
        target: where the drives were told to go, (n,) [rad].
        enable: whether they may.
    """

    device: RobotHand
    position: Angles
    current: Angles
    status = int(HandStatus.READY)
    target: Angles
    enable: int

    @property
    def enabled(self) -> bool:
        """Whether its drives hold their targets: told to, by valid outputs."""
        return bool(self.enable & ENABLED) and self.al_state is AlState.OP

    def advance(self, fingers: Fingers, dt: float) -> None:
        """Let its fingers move for dt [s], and report them."""
        fingers.step(self.fields["target"], self.enabled, dt)
        self.fields["position"][:] = fingers.position
        self.fields["current"][:] = fingers.current
        self.status = HandStatus.READY | (HandStatus.ENABLED if self.enabled else 0)
