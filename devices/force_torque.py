"""A six-axis force-torque sensor."""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntFlag
from typing import Annotated, Final

from msgspec import Meta

from ..configs.quantities import SensedForce, SensedTorque
from .calibration import Calibration
from .cia301 import Address
from .device import Device, Field, Finding, Quantity, Word
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
        calibration: file that says what hangs on it and what it reads without that, beside the
            configuration; ``kept`` is what it says, by whoever loads the configuration.
    """

    force: SensedForce
    torque: SensedTorque
    calibration: Annotated[str, Meta(min_length=1, max_length=100)] | None = None
    kept: Calibration | None = None
    group: str = "force_torque"
    eds: str = "force_torque.eds"

    def inputs(self) -> Mapping[Address, Field]:
        """Wrench (linear, angular) [N, N m] and status."""
        return {
            **{(0x2300, axis): Quantity("wrench") for axis in range(1, 7)},
            (0x2301, 0): Word("status"),
        }

    def check(self) -> list[Finding]:
        """A calibration that is not this sensor's, or is no longer what was written."""
        kept = self.kept
        if kept is None:
            return []
        if self.calibration is None:
            return [("kept", "belongs to no file", "name the file as calibration, and remove this table")]
        found: list[Finding] = []
        key, again = "calibration", "calibrate this sensor: hapticd calibrate ft"
        if kept.sha256 != kept.digest:
            found.append((key, f'"{self.calibration}" was changed after it was written', again))
        if kept.sensor != self.name:
            found.append((key, f"\"{self.calibration}\" is of '{kept.sensor}', another sensor", again))
        if self.serial is None:
            problem = f'is missing, but "{self.calibration}" is of one sensor only, number {kept.serial}'
            found.append(("serial", problem, "give this one's: it is compared with the sensor at start"))
        elif self.serial != kept.serial:
            found.append(("serial", f'{self.serial}, but "{self.calibration}" is of {kept.serial}', again))
        over = [abs(x) > self.force for x in kept.force_bias] + [
            abs(x) > self.torque for x in kept.torque_bias
        ]
        if any(over):
            found.append((key, "the bias is beyond the sensor's full scale", again))
        return found


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
