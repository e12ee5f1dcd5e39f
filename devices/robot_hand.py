"""What robot hands have in common: drives that go to a position and tell what current that takes."""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntFlag
from typing import ClassVar, Final

from .cia301 import Address
from .device import Device, Field, Quantity, Word
from .group import Group, Quantities, Words
from .image import ProcessImage

ANGLE: Final = 1e-4
"""Of a count [rad]."""
CURRENT: Final = 1e-3
"""Of a count [A]."""
ENABLED: Final = 1
"""Of `enable`: the drives hold their targets; without it they have no current."""


class HandStatus(IntFlag):
    """Status word of the hands."""

    READY = 0x01
    ENABLED = 0x02
    FAULT = 0x04


class RobotHand(Device, frozen=True, kw_only=True):
    """A hand whose drives have their own position controllers.

    Attributes:
        drives: names of its drives, in the order of the wire.
    """

    drives: ClassVar[tuple[str, ...]] = ()

    def inputs(self) -> Mapping[Address, Field]:
        """Positions [rad], positive where a finger closes, motor currents [A] and status."""
        own = range(1, len(self.drives) + 1)
        return {
            **{(0x2610, i): Quantity("position", ANGLE) for i in own},
            **{(0x2611, i): Quantity("current", CURRENT) for i in own},
            (0x2612, 0): Word("status"),
        }

    def outputs(self) -> Mapping[Address, Field]:
        """Positions to go to [rad], and whether the drives may."""
        own = range(1, len(self.drives) + 1)
        return {**{(0x2613, i): Quantity("target", ANGLE) for i in own}, (0x2614, 0): Word("enable")}


class RobotHands(Group):
    """The hands of a group, which have n drives each.

    Attributes:
        position: (hands, n) [rad].
        current: (hands, n) of the motors [A].
        status: (hands,) bits of HandStatus.
        target: (hands, n) as it is encoded; read only [rad].
        enable: (hands,) ENABLED or 0; the machine writes it.
    """

    kind = RobotHand
    position: Quantities
    current: Quantities
    status: Words
    target: Quantities
    enable: Words

    def __init__(self, image: ProcessImage, group: str) -> None:
        """The group is to be named: hands of different kinds have different ones."""
        super().__init__(image, group)

    def ready(self, i: int) -> bool:
        """Whether a hand says that it is ready, and has no fault."""
        return self.status.item(i) & ~HandStatus.ENABLED.value == HandStatus.READY.value
