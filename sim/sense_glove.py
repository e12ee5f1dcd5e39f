"""A simulated glove on a simulated hand."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..devices.cia301 import AlState
from ..devices.force_torque import SensorStatus
from ..devices.sense_glove import FINGERS
from .fingers import GlovedFingers
from .node import SimNode


class SimSenseGlove(SimNode):
    """A glove that is ready; the plant moves the fingers in it.

    Attributes:
        angle: of the joints, (20,) [rad]; ``advance`` sets them.
        status: bits of `SensorStatus`.
        brakes: bits that it was told, one a finger from the thumb on.
    """

    angle: Sequence[float] | NDArray[np.float64]
    status = int(SensorStatus.READY)
    brakes: int

    @property
    def braked(self) -> tuple[bool, ...]:
        """Which brakes are closed; without valid outputs none is."""
        told = self.brakes if self.al_state is AlState.OP else 0
        return tuple(bool(told >> i & 1) for i in range(len(FINGERS)))

    def advance(self, fingers: GlovedFingers, wanted: Sequence[float], dt: float) -> None:
        """Let fingers want to be closed so far, (5,) 0 to 1, for dt [s], and report their joints."""
        fingers.step(wanted, self.braked, dt)
        self.fields["angle"][:] = fingers.angle
