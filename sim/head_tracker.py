"""A simulated tracker of a head."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from ..devices.force_torque import SensorStatus
from .node import SimNode


class SimHeadTracker(SimNode):
    """A tracker that is ready; the plant says where the head is.

    Attributes:
        pose: position and quaternion x y z w, as reported, (7,) [m].
        status: bits of `SensorStatus`.
    """

    pose: Sequence[float]
    status = int(SensorStatus.READY)

    def see(self, position: Sequence[float], turned: Sequence[float]) -> None:
        """The head is at a position (3,) [m], turned by a rotation vector (3,) [rad]."""
        self.pose = (*position, *pin.Quaternion(pin.exp3(np.array(turned))).coeffs().tolist())
