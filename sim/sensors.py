"""Simulated sensors."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

from ..devices.force_torque import ForceTorque, SensorStatus
from ..devices.imu import Imu
from .node import SimNode


class SimForceTorque(SimNode):
    """A six-axis force-torque sensor.

    Attributes:
        wrench: (6,) force and torque in its frame [N, N m]; the plant sets it.
        status: bits of `SensorStatus`.
    """

    def __init__(self, device: ForceTorque, outbox: deque[tuple[int, bytes]]) -> None:
        self.wrench: Sequence[float] = (0.0,) * 6
        self.status = int(SensorStatus.READY)
        super().__init__(device, outbox)


class SimImu(SimNode):
    """An inertial measurement unit.

    Attributes:
        acceleration: (3,) specific force in its frame [m/s^2]; the plant sets it.
        angular_velocity: (3,) in its frame [rad/s]; the plant sets it.
        status: bits of `SensorStatus`.
    """

    def __init__(self, device: Imu, outbox: deque[tuple[int, bytes]]) -> None:
        self.acceleration: Sequence[float] = (0.0,) * 3
        self.angular_velocity: Sequence[float] = (0.0,) * 3
        self.status = int(SensorStatus.READY)
        super().__init__(device, outbox)
