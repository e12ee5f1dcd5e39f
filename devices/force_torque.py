"""A six-axis force-torque sensor."""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntFlag
from typing import Final

from ..configs.quantities import Force, Torque
from .cia301 import Address
from .device import Device, Field, Quantity, Word
from .group import Group, Quantities, Words
from .image import ProcessImage


class SensorStatus(IntFlag):
    """Status word of the sensors."""

    READY = 0x01
    SATURATED = 0x02
    FAULT = 0x04


READY: Final = SensorStatus.READY.value
"""A plain number: enum arithmetic is slow."""


class ForceTorque(Device, frozen=True, kw_only=True, tag="force_torque"):
    """Reports the wrench in its own frame, in SI units; what it cannot measure it reports as NaN.

    Attributes:
        force, torque: full scale of each component [N, N m].
    """

    force: Force
    torque: Torque
    group: str = "force_torque"
    eds: str = "force_torque.eds"

    def inputs(self) -> Mapping[Address, Field]:
        """Wrench (linear, angular) [N, N m] and status."""
        return {
            **{(0x2300, axis): Quantity("wrench") for axis in range(1, 7)},
            (0x2301, 0): Word("status"),
        }


class ForceTorques(Group):
    """The force-torque sensors of a group.

    Attributes:
        wrench: (n, 6) force and torque in the sensor's frame [N, N m].
        status: (n,) bits of `SensorStatus`.
        scales: full scale of every component of each [N, N m].
    """

    kind = ForceTorque
    wrench: Quantities
    status: Words

    def __init__(self, image: ProcessImage, group: str = "") -> None:
        super().__init__(image, group)
        self.scales = [[d.force] * 3 + [d.torque] * 3 for d in self._devices if isinstance(d, ForceTorque)]

    def ready(self, i: int) -> bool:
        """Whether a sensor says that it measures, and nothing else; its scale is for `safety` to judge."""
        return self.status.item(i) == READY
