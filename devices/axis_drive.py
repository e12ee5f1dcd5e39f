"""A drive of a linear axis in velocity mode."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Final

from msgspec import Meta

from ..configs.quantities import AnyLength
from .cia301 import Address
from .cia402 import (
    CONTROLWORD,
    CYCLIC_SYNCHRONOUS_VELOCITY,
    ERROR_CODE,
    MODE,
    MODE_DISPLAY,
    POSITION,
    STATUSWORD,
    TARGET_VELOCITY,
    VELOCITY,
)
from .device import Device, Field, Quantity, Sign, Word
from .dictionary import Value
from .group import Group, Quantities, Words

COUNTS_PER_METRE: Final = (0x2203, 0)

CountsPerMetre = Annotated[int, Meta(ge=1000, le=10**8, description="a millimetre; 20 m fit into 32 bits")]


class AxisDrive(Device, frozen=True, kw_only=True, tag="axis_drive"):
    """A linear axis in cyclic synchronous velocity mode.

    Attributes:
        counts_per_metre: position increments per metre (2203h); velocities are increments per second.
        sign: -1 where the drive counts against the axis' positive direction.
        zero: position of the axis at position 0 of the encoder [m].
    """

    group: str = "axes"
    eds: str = "axis_drive.eds"
    counts_per_metre: CountsPerMetre
    sign: Sign = 1
    zero: AnyLength = AnyLength(0.0)

    def __post_init__(self) -> None:
        self.require(self.sign in (-1, 1), f"sign is {self.sign}; write 1 or -1")
        self.require(self.counts_per_metre > 0, "counts_per_metre must be positive")

    def inputs(self) -> Mapping[Address, Field]:
        """Position [m], velocity [m/s], and the drive's state."""
        metres = self.sign / self.counts_per_metre
        return {
            STATUSWORD: Word("statusword"),
            MODE_DISPLAY: Word("mode"),
            POSITION: Quantity("position", metres, self.zero),
            VELOCITY: Quantity("velocity", metres),
            ERROR_CODE: Word("error_code"),
        }

    def outputs(self) -> Mapping[Address, Field]:
        """Controlword and velocity."""
        return {
            CONTROLWORD: Word("controlword"),
            TARGET_VELOCITY: Quantity("target_velocity", self.sign / self.counts_per_metre),
        }

    def settings(self) -> Mapping[Address, Value]:
        """The mode of operation."""
        return {MODE: CYCLIC_SYNCHRONOUS_VELOCITY}

    def facts(self) -> Mapping[Address, Value]:
        """The scaling that the fields rely on."""
        return {COUNTS_PER_METRE: self.counts_per_metre}


class AxisDrives(Group):
    """The linear axes of a group as arrays, one entry per drive.

    Attributes:
        position: (n,) [m].
        velocity: (n,) [m/s].
        statusword, mode, error_code: (n,) 6041h, 6061h, 603Fh.
        controlword: (n,) 6040h; `PowerStage` writes it.
        target_velocity: (n,) as it is encoded; read only [m/s].
    """

    kind = AxisDrive
    position: Quantities
    velocity: Quantities
    statusword: Words
    mode: Words
    error_code: Words
    controlword: Words
    target_velocity: Quantities
