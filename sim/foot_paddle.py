"""A simulated paddle under a foot."""

from __future__ import annotations

from collections.abc import Sequence

from ..devices.force_torque import SensorStatus
from .node import SimNode


class SimFootPaddle(SimNode):
    """A paddle that is ready; whoever simulates a foot sets its axes.

    Attributes:
        axes: -1 to 1 of their way, (3,).
        status: bits of `SensorStatus`.
    """

    axes: Sequence[float]
    status = int(SensorStatus.READY)
