"""An inertial measurement unit; also the shortest example of a device type."""

from __future__ import annotations

from collections.abc import Mapping

from ..configs.quantities import AccelerationScale
from .cia301 import Address
from .device import Device, Field, Quantity, Word
from .force_torque import READY
from .group import Group, Quantities, Words
from .image import ProcessImage


class Imu(Device, frozen=True, kw_only=True, tag="imu"):
    """Three accelerometers and three gyroscopes; the device reports SI units.

    Attributes:
        acceleration: full scale of each component [m/s^2].
    """

    acceleration: AccelerationScale
    group: str = "imus"
    eds: str = "imu.eds"

    def inputs(self) -> Mapping[Address, Field]:
        """Acceleration [m/s^2], angular velocity [rad/s] and status."""
        return {
            **{(0x2400, axis): Quantity("acceleration") for axis in (1, 2, 3)},
            **{(0x2401, axis): Quantity("angular_velocity") for axis in (1, 2, 3)},
            (0x2402, 0): Word("status"),
        }


class Imus(Group):
    """The inertial units of a group.

    Attributes:
        acceleration: (n, 3) specific force in the sensor's frame [m/s^2].
        angular_velocity: (n, 3) in the sensor's frame [rad/s].
        status: (n,) bits of `force_torque.SensorStatus`.
        scales: full scale of the acceleration of each [m/s^2].
    """

    kind = Imu
    acceleration: Quantities
    angular_velocity: Quantities
    status: Words

    def __init__(self, image: ProcessImage, group: str = "") -> None:
        super().__init__(image, group)
        self.scales = [device.acceleration for device in self._devices if isinstance(device, Imu)]

    def ready(self, i: int) -> bool:
        """Whether a sensor says that it measures, and nothing else; its scale is for `safety` to judge."""
        return self.status.item(i) == READY
