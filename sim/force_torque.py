"""A simulated six-axis force-torque sensor."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..devices.force_torque import SensorStatus
from .node import SimNode


class SimForceTorque(SimNode):
    """A sensor that is ready.

    Attributes:
        wrench: (6,) force and torque in its frame [N, N m]; the plant sets it.
        status: bits of `SensorStatus`.
    """

    wrench: Sequence[float] | NDArray[np.float64]
    status = int(SensorStatus.READY)
