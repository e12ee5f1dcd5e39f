"""A holonomic base with a controller of its own."""

from __future__ import annotations

from collections.abc import Mapping

from .cia301 import Address
from .device import Device, Field, Quantity, Word
from .group import Group, Quantities, Words


class BaseDrive(Device, frozen=True, kw_only=True, tag="base_drive"):
    """Takes speeds: forward, to the left, about the upright axis; its own controller turns its wheels."""

    group: str = "base"
    eds: str = "base_drive.eds"

    def inputs(self) -> Mapping[Address, Field]:
        """Measured speeds [m/s, m/s, rad/s] and status."""
        return {**{(0x2610, i): Quantity("speed") for i in range(1, 4)}, (0x2612, 0): Word("status")}

    def outputs(self) -> Mapping[Address, Field]:
        """Speeds to have, and whether it may move; without, its brakes are closed."""
        return {**{(0x2613, i): Quantity("target") for i in range(1, 4)}, (0x2614, 0): Word("enable")}


class BaseDrives(Group):
    """The bases of a group.

    Attributes:
        speed: (n, 3) [m/s, m/s, rad/s].
        status: (n,) bits of `robot_hand.HandStatus`.
    """

    kind = BaseDrive
    speed: Quantities
    status: Words
