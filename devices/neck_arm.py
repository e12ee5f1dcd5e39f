"""The arm that carries the avatar's head, and goes to poses by its own controller."""

from __future__ import annotations

from collections.abc import Mapping

from .cia301 import Address
from .device import Device, Field, Quantity, Word
from .group import Group, Quantities, Words


class NeckArm(Device, frozen=True, kw_only=True, tag="neck_arm"):
    """Takes where its end is to be, seen from its middle; its own controller moves its six joints."""

    group: str = "neck"
    eds: str = "neck_arm.eds"

    def inputs(self) -> Mapping[Address, Field]:
        """Position and rotation vector from the middle [m, rad], and status."""
        return {**{(0x2610, i): Quantity("way") for i in range(1, 7)}, (0x2612, 0): Word("status")}

    def outputs(self) -> Mapping[Address, Field]:
        """The same to go to, and whether it may."""
        return {**{(0x2613, i): Quantity("target") for i in range(1, 7)}, (0x2614, 0): Word("enable")}


class NeckArms(Group):
    """The arms of a group.

    Attributes:
        way: (n, 6) position and rotation vector from the middle [m, rad].
        status: (n,) bits of `robot_hand.HandStatus`.
    """

    kind = NeckArm
    way: Quantities
    status: Words
