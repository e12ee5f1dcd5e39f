"""A simulated inertial measurement unit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..devices.force_torque import SensorStatus
from .node import SimNode


class SimImu(SimNode):
    """A unit that is ready.

    Attributes:
        acceleration: (3,) specific force in its frame [m/s^2]; the plant sets it.
        angular_velocity: (3,) in its frame [rad/s]; the plant sets it.
        status: bits of `SensorStatus`.
    """

    acceleration: Sequence[float] | NDArray[np.float64]
    angular_velocity: Sequence[float] | NDArray[np.float64]
    status = int(SensorStatus.READY)
